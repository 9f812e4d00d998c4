/* mirror_ground.c: the ground that a server told of, which a client keeps its eye above. */
#include <math.h>
#include <string.h>
#include "remote/mirror_internal.h"

void vd_mirror_take_ground(vd_mirror *m, const vd_wire_ground *ground) {
    const size_t count = (size_t)ground->columns * (size_t)ground->rows;
    pthread_mutex_lock(&m->lock);
    m->ground = *ground;
    memcpy(m->heights, ground->heights, count * sizeof *m->heights);
    m->ground.heights = m->heights;
    pthread_mutex_unlock(&m->lock);
}

/* Between four heights; where some of them are missing the highest of the others. */
static double height_between(const float h[4], double u, double v) {
    double highest = -INFINITY;
    int missing = 0;
    for (int i = 0; i < 4; i++) {
        missing += h[i] > VD_WIRE_NO_GROUND ? 0 : 1;
        highest = h[i] > VD_WIRE_NO_GROUND && (double)h[i] > highest ? (double)h[i] : highest;
    }
    const double low = (double)h[0] + u * ((double)h[1] - (double)h[0]);
    const double high = (double)h[2] + u * ((double)h[3] - (double)h[2]);
    return missing > 0 ? highest : low + v * (high - low);
}

double vd_mirror_ground(vd_mirror *m, double x, double y) {
    double height = -INFINITY;
    pthread_mutex_lock(&m->lock);
    const vd_wire_ground *g = &m->ground;
    const double u = (x - g->x) / g->step_m, v = (y - g->y) / g->step_m;
    if (g->columns > 0 && u >= 0.0 && v >= 0.0 && u < g->columns - 1 && v < g->rows - 1) {
        const float *at = m->heights + (size_t)v * (size_t)g->columns + (size_t)u;
        const float h[4] = {at[0], at[1], at[g->columns], at[g->columns + 1]};
        height = height_between(h, u - floor(u), v - floor(v));
    }
    pthread_mutex_unlock(&m->lock);
    return height;
}
