/* window_motion.c: speeds that die down, places above ground. */
#include "window_motion.h"

#include <math.h>

/* Seconds in which a speed covers 63 % of the way to what is wanted. */
static const double time_constant = 0.08;

/* Speeds below this share of full speed are none. */
static const double at_rest = 5e-3;

/* Seconds that the ground is looked at ahead of the eye, so that it rises before a slope. */
static const double look_ahead = 0.6;

vd_motion vd_motion_start(void) {
    return (vd_motion){.pace = 1.0};
}

bool vd_motion_active(const vd_motion *motion) {
    for (int i = 0; i < VD_MOTION_COUNT; i++) {
        if (motion->wanted[i] != 0.0 || motion->speed[i] != 0.0) {
            return true;
        }
    }
    return false;
}

static double clamp(double value, double low, double high) {
    return value < low ? low : value > high ? high : value;
}

/* Moves a speed on and returns the way that was made with it, in full speeds × seconds. */
static double integrate(double wanted, double *speed, double seconds) {
    const double left = exp(-seconds / time_constant);
    const double way = wanted * seconds + (*speed - wanted) * time_constant * (1.0 - left);
    *speed = wanted + (*speed - wanted) * left;
    if (wanted == 0.0 && fabs(*speed) < at_rest) {
        *speed = 0.0;
    }
    return way;
}

static double ground_at(const vd_motion_world *world, double x, double y) {
    return world->ground != NULL ? world->ground(world->user, x, y) : (double)-INFINITY;
}

/* Metres a second at pace 1: a two-hundredth of the world, more from high up. */
static double full_speed(const vd_motion_world *world, const vd_motion_state *state) {
    const double ground = ground_at(world, state->eye[0], state->eye[1]);
    const double above = isfinite(ground) ? state->eye[2] - ground : 0.1 * world->size_m;
    return fmax(world->size_m / 100.0, 0.5 * above);
}

void vd_motion_clear_ground(const vd_motion_world *world, vd_motion_state *state) {
    const double least = ground_at(world, state->eye[0], state->eye[1]) + VD_MOTION_CLEARANCE_M;
    if (state->eye[2] < least) {
        state->eye[2] = least;
    }
}

/* Rises towards the clearance over the highest ground ahead, the sooner the nearer it is. */
static void rise_before_slopes(const vd_motion_world *world, double dx, double dy, double seconds,
                               vd_motion_state *state) {
    enum { STEPS = 6 };
    if (seconds <= 0.0 || (dx == 0.0 && dy == 0.0)) {
        return;
    }
    for (int i = 1; i <= STEPS; i++) {
        const double ahead = look_ahead * i / STEPS / seconds;
        const double least =
            ground_at(world, state->eye[0] + dx * ahead, state->eye[1] + dy * ahead) +
            VD_MOTION_CLEARANCE_M;
        if (state->eye[2] < least) {
            const double left = exp(-seconds / (look_ahead * i / STEPS));
            state->eye[2] = least + (state->eye[2] - least) * left;
        }
    }
}

void vd_motion_turn(vd_motion_state *state, double right, double up) {
    state->heading = fmod(state->heading + right, 360.0);
    state->heading += state->heading < 0.0 ? 360.0 : 0.0;
    state->pitch = clamp(state->pitch + up, -89.0, 89.0);
}

void vd_motion_advance(vd_motion *motion, const vd_motion_world *world, double seconds,
                       vd_motion_state *state) {
    double way[VD_MOTION_COUNT];
    for (int i = 0; i < VD_MOTION_COUNT; i++) {
        way[i] = integrate(motion->wanted[i], &motion->speed[i], seconds);
    }
    vd_motion_turn(state, way[VD_MOTION_TURN] * 60.0, way[VD_MOTION_LOOK] * 45.0);
    const double metres = motion->pace * full_speed(world, state);
    const double heading = state->heading * VD_RADIANS_PER_DEGREE;
    const double dx = way[VD_MOTION_FORWARD] * metres * sin(heading);
    const double dy = way[VD_MOTION_FORWARD] * metres * cos(heading);
    state->eye[0] += dx;
    state->eye[1] += dy;
    state->eye[2] += way[VD_MOTION_RISE] * 0.5 * metres;
    rise_before_slopes(world, dx, dy, seconds, state);
    vd_motion_clear_ground(world, state);
    state->fov = clamp(state->fov * exp(way[VD_MOTION_FOV]), 5.0, 140.0);
    state->exaggeration = clamp(state->exaggeration * exp(way[VD_MOTION_HEIGHTS]), 0.01, 100.0);
    if (way[VD_MOTION_HAZE] != 0.0 && state->haze_m > 0.0) {
        state->haze_m = clamp(state->haze_m * exp(1.5 * way[VD_MOTION_HAZE]), 1e-3 * world->size_m,
                              1e3 * world->size_m);
    }
}
