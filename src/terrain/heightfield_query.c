/* heightfield_query.c: asking a heightfield for heights and bounds. */
#include <math.h>
#include "terrain/heightfield_block.h"

float vd_heightfield_at(const vd_heightfield *heightfield, int column, int row) {
    return vd_heightfield_sample(heightfield, heightfield, 0, column, row);
}

/* One axis of a position: the two samples around it and the weight of the second. */
typedef struct axis_position {
    int first, second;
    double fraction;
} axis_position;

/* False when `at` lies outside [0, size − 1] of a map that ends at its edge, or is not finite. */
static bool locate(double at, int size, bool wraps, axis_position *out) {
    if (wraps) {
        if (!isfinite(at)) {
            return false;
        }
        at -= floor(at / size) * size;
        double cell = floor(at);
        out->fraction = at - cell;
        out->first = cell >= 0.0 && cell < size ? (int)cell : 0; /* rounding may give `size` */
        out->second = out->first + 1 < size ? out->first + 1 : 0;
        return true;
    }
    if (!(at >= 0.0 && at <= size - 1)) {
        return false;
    }
    out->first = (int)at;
    if (out->first == size - 1 && size > 1) {
        out->first--; /* the last sample belongs to the last cell */
    }
    out->second = size > 1 ? out->first + 1 : out->first;
    out->fraction = at - out->first;
    return true;
}

double vd_heightfield_height_at(const vd_heightfield *heightfield, double x, double y) {
    double m[6];
    axis_position c, r;
    if (!vd_heightfield_invert(heightfield->world_from_sample, m)) {
        return -(double)INFINITY;
    }
    /* Relative to sample (0, 0): far from the world's origin its offset would cancel digits. */
    double dx = x - heightfield->world_from_sample[0], dy = y - heightfield->world_from_sample[3];
    bool wraps = heightfield->wraps != 0;
    if (!locate(m[1] * dx + m[2] * dy, heightfield->width, wraps, &c) ||
        !locate(m[4] * dx + m[5] * dy, heightfield->height, wraps, &r)) {
        return -(double)INFINITY;
    }
    double h00 = (double)vd_heightfield_at(heightfield, c.first, r.first);
    double h10 = (double)vd_heightfield_at(heightfield, c.second, r.first);
    double h01 = (double)vd_heightfield_at(heightfield, c.first, r.second);
    double h11 = (double)vd_heightfield_at(heightfield, c.second, r.second);
    if (!isfinite(h00) || !isfinite(h10) || !isfinite(h01) || !isfinite(h11)) {
        return -(double)INFINITY;
    }
    double north = h00 + c.fraction * (h10 - h00), south = h01 + c.fraction * (h11 - h01);
    return north + r.fraction * (south - north);
}

void vd_heightfield_bounds(const vd_heightfield *heightfield, vd_vec3 *min, vd_vec3 *max) {
    const double *m = heightfield->world_from_sample;
    for (int corner = 0; corner < 4; corner++) {
        double column = corner & 1 ? heightfield->width - 1 : 0;
        double row = corner & 2 ? heightfield->height - 1 : 0;
        double x = m[0] + column * m[1] + row * m[2], y = m[3] + column * m[4] + row * m[5];
        min->x = corner == 0 || x < min->x ? x : min->x;
        min->y = corner == 0 || y < min->y ? y : min->y;
        max->x = corner == 0 || x > max->x ? x : max->x;
        max->y = corner == 0 || y > max->y ? y : max->y;
    }
    min->z = (double)heightfield->min;
    max->z = (double)heightfield->max;
}
