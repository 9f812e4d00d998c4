/* window_motion.h: how the keys move the camera. No window here: time and keys in, a place out.
 *
 * Speeds approach what the keys ask for, and places are the integral of speeds in closed form, so
 * that a way flown in two steps or in two hundred ends at the same place but for rounding.
 */
#ifndef VEDUTA_APP_WINDOW_MOTION_H
#define VEDUTA_APP_WINDOW_MOTION_H

#include "render_settings.h"

/* What moves: each by −1 … 1 from a pair of keys. */
typedef enum vd_motion_axis {
    VD_MOTION_FORWARD = 0,
    VD_MOTION_TURN, /* right is positive */
    VD_MOTION_RISE,
    VD_MOTION_LOOK, /* up is positive */
    VD_MOTION_FOV,
    VD_MOTION_HEIGHTS, /* exaggeration */
    VD_MOTION_HAZE,    /* how far one sees */
    VD_MOTION_COUNT
} vd_motion_axis;

/* The eye stays this far above the ground, metres. */
#define VD_MOTION_CLEARANCE_M 10.0

typedef struct vd_motion {
    double wanted[VD_MOTION_COUNT]; /* by keys, −1 … 1 */
    double speed[VD_MOTION_COUNT];  /* as it is, in the same unit */
    double pace;                    /* factor on the way forward and up; the wheel changes it */
} vd_motion;

/* Height of the ground at a place, metres; −infinity where there is none. */
typedef double vd_motion_ground_function(void *user, double x, double y);

typedef struct vd_motion_world {
    vd_motion_ground_function *ground; /* null: none */
    void *user;
    double size_m;
} vd_motion_world;

/* What motion changes. Angles in degrees. */
typedef struct vd_motion_state {
    double eye[3], heading, pitch, fov, exaggeration, haze_m;
} vd_motion_state;

/* Nothing wanted, at rest, pace 1. */
vd_motion vd_motion_start(void);

/* True while keys are held or a speed has not died down. */
bool vd_motion_active(const vd_motion *motion);

/* Moves on by `seconds`. */
void vd_motion_advance(vd_motion *motion, const vd_motion_world *world, double seconds,
                       vd_motion_state *state);

/* Turns by degrees, as the mouse does. */
void vd_motion_turn(vd_motion_state *state, double right, double up);

/* Lifts the eye to the clearance where it is below. */
void vd_motion_clear_ground(const vd_motion_world *world, vd_motion_state *state);

#endif
