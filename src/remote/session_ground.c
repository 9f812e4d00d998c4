/* session_ground.c: heights around the eye, for a client that keeps above the ground.
 *
 * A window of a world asks the world; a client has pictures alone. What it needs is near by: as far
 * as it goes before the next window of heights is there. One is SIDE × SIDE floats, 17 KB, a few
 * seconds of flight apart.
 */
#include <math.h>
#include "remote/session_internal.h"

#define SIDE VD_SESSION_GROUND_SIDE

/* How far heights reach to each side, of the world's size: at full speed, a hundredth of it a
 * second, it is 1.6 s. High up clients fly faster, at half their height a second. */
#define REACH_SHARE (1.0 / 64)
#define LEAST_REACH_M 32.0

/* Of terrain without an end. */
#define ENDLESS_M 10000.0

/* The share of the reach after which there is another window. */
#define MOVED_SHARE 0.5

static double size_of(const vd_heightfield *heightfield) {
    vd_vec3 min, max;
    if (heightfield == NULL || heightfield->wraps != 0) {
        return ENDLESS_M;
    }
    vd_heightfield_bounds(heightfield, &min, &max);
    return hypot(max.x - min.x, max.y - min.y);
}

/* Metres between samples; 0: there are none. */
static double cell_of(const vd_heightfield *heightfield) {
    const double *g = heightfield != NULL ? heightfield->world_from_sample : NULL;
    return g != NULL ? fmin(hypot(g[1], g[4]), hypot(g[2], g[5])) : 0.0;
}

/* The highest ground around a place, where there are more samples than heights are sent. */
static float height_at(const vd_world *world, double x, double y, double around_m) {
    double highest = vd_world_ground(world, x, y);
    for (int i = 0; i < 9 && around_m > 0.0; i++) {
        const double at =
            vd_world_ground(world, x + around_m * (i % 3 - 1), y + around_m * (i / 3 - 1));
        highest = at > highest ? at : highest;
    }
    return highest > (double)VD_WIRE_NO_GROUND ? (float)highest : VD_WIRE_NO_GROUND;
}

/* Whether the heights that the client has do not do for its camera. */
static bool is_due(const vd_session_ground *g, vd_vec3 eye, double reach_m) {
    const double moved = fmax(fabs(eye.x - g->x), fabs(eye.y - g->y));
    return !g->sent || moved > MOVED_SHARE * g->reach_m || reach_m > 2.0 * g->reach_m ||
           reach_m < 0.5 * g->reach_m;
}

void vd_session_add_ground(vd_session *s, double now_s) {
    const vd_terrain_def *terrain = &vd_world_look(s->def.world)->terrain;
    const vd_vec3 eye = s->camera.camera.eye;
    vd_session_ground *g = &s->ground;
    if ((s->hello.capabilities & VD_WIRE_HEIGHTS) == 0 ||
        (terrain->heightfield == NULL && terrain->function == NULL)) {
        return;
    }
    const double above = eye.z - vd_world_ground(s->def.world, eye.x, eye.y);
    const double reach_m = fmax(fmax(REACH_SHARE * size_of(terrain->heightfield), LEAST_REACH_M),
                                isfinite(above) ? above : 0.0);
    if (!is_due(g, eye, reach_m)) {
        return;
    }
    *g = (vd_session_ground){.sent = true, .x = eye.x, .y = eye.y, .reach_m = reach_m};
    const double step_m = 2.0 * reach_m / (SIDE - 1);
    const double cell_m = cell_of(terrain->heightfield);
    const double around_m = cell_m > 0.0 && step_m > cell_m ? 0.5 * step_m : 0.0;
    vd_wire_message message = {.kind = VD_WIRE_GROUND};
    message.as.ground = (vd_wire_ground){.x = eye.x - reach_m,
                                         .y = eye.y - reach_m,
                                         .step_m = step_m,
                                         .columns = SIDE,
                                         .rows = SIDE,
                                         .heights = &s->heights[0][0]};
    for (int row = 0; row < SIDE; row++) {
        for (int column = 0; column < SIDE; column++) {
            s->heights[row][column] = height_at(s->def.world, message.as.ground.x + column * step_m,
                                                message.as.ground.y + row * step_m, around_m);
        }
    }
    vd_session_add(s, &message, now_s);
    vd_session_flush(s, now_s); /* the heights are used again */
}
