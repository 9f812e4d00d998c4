/* impostor_motion.c: where the camera goes, and what it sees. */
#include <math.h>
#include "core/core.h"
#include "impostor/impostor_set.h"

/* How fast the camera's motion is believed. */
#define MOTION_SHARE 0.5

/* A turning camera's view is looked at so long before, and of turns between these, radians. */
#define TURN_AHEAD_S 0.15
#define LEAST_TURN 1e-3
#define MOST_TURN 0.5

/* A step may be so many times longer than the last and still be the same motion: cameras of a
 * stream come one or two at a time. */
#define MOST_CHANGE 4.0

/* A motion, of which steps come one after the other. A step that is like none before it, as when
 * the camera is put somewhere else, is not believed to go on. */
static void believe(vd_vec3 now, vd_vec3 *motion, vd_vec3 *last) {
    const double change = vd_vec3_length(vd_vec3_subtract(now, *last));
    *motion =
        vd_vec3_add(vd_vec3_scale(*motion, 1.0 - MOTION_SHARE), vd_vec3_scale(now, MOTION_SHARE));
    if (vd_vec3_length(now) == 0.0 || change > MOST_CHANGE * vd_vec3_length(*last)) {
        *motion = vd_vec3_make(0, 0, 0);
    }
    *last = now;
}

/* The turn from one orientation to another as axis times angle, near enough for small angles. */
static vd_vec3 turn_between(vd_quat from, vd_quat to) {
    const vd_quat back = {-from.x, -from.y, -from.z, from.w};
    const vd_quat turn = vd_quat_multiply(to, back);
    const double sign = turn.w < 0.0 ? -2.0 : 2.0;
    return vd_vec3_make(sign * turn.x, sign * turn.y, sign * turn.z);
}

/* Where the camera goes: constant velocity and turn. */
void vd_impostors_follow(vd_impostors *set, const vd_camera *camera, double time_s) {
    const double passed = time_s - set->time_s;
    set->interval_s = set->moving ? passed : 0.0;
    if (set->moving && passed > 0.0) {
        const vd_vec3 way = vd_vec3_subtract(camera->eye, set->eye);
        believe(vd_vec3_scale(way, 1.0 / passed), &set->velocity, &set->last_velocity);
        believe(vd_vec3_scale(turn_between(set->facing, camera->orientation), 1.0 / passed),
                &set->turn, &set->last_turn);
    }
    set->facing = camera->orientation;
    set->moving = true;
    set->eye = camera->eye;
    set->time_s = time_s;
}

/* What a turning camera will see when pictures that are asked for now are there. */
static void look_ahead(const vd_impostors *set, vd_impostor_view *view, const vd_camera *wide,
                       int width, int height, double ahead_s) {
    const double angle = ahead_s * vd_vec3_length(set->turn);
    view->turning = angle > LEAST_TURN;
    if (view->turning) {
        vd_camera camera = *wide;
        camera.eye = view->eye;
        camera.orientation = vd_quat_multiply(
            vd_quat_from_axis_angle(set->turn, angle < MOST_TURN ? angle : MOST_TURN),
            wide->orientation);
        view->ahead = vd_camera_frustum(&camera, width, height);
    }
}

vd_impostor_view vd_impostors_view(const vd_impostors *set, const vd_camera *camera, int width,
                                   int height) {
    /* Half of the time that a picture made now is at least shown. */
    double ahead_s = 0.5 * set->def.least_reuse / set->def.rate_hz;
    if (set->def.link_bytes_per_s > 0.0) { /* and until it comes */
        ahead_s += fmax(set->link_free_s - set->time_s, 0.0) + set->def.link_latency_s;
    }
    vd_impostor_view view = {.eye = vd_vec3_add(camera->eye, vd_vec3_scale(set->velocity, ahead_s)),
                             .camera = *camera,
                             .width = width,
                             .height = height,
                             .focal_px = fmax(camera->lens.fx, camera->lens.fy),
                             .detail = 1.0,
                             .velocity = set->velocity};
    view.seen = set->def.link_bytes_per_s > 0.0 || set->def.ship ? view.eye : camera->eye;
    const int x = (int)(set->def.spare * width), y = (int)(set->def.spare * height);
    vd_camera wide = *camera;
    wide.lens.cx += x;
    wide.lens.cy += y;
    view.frustum = vd_camera_frustum(&wide, width + 2 * x, height + 2 * y);
    look_ahead(set, &view, &wide, width + 2 * x, height + 2 * y, ahead_s + TURN_AHEAD_S);
    view.drop_per_m2 = set->world->def.terrain.curvature ? vd_curvature_drop(1.0) : 0.0;
    vd_ground_at(&set->ground, camera->eye.x, camera->eye.y, &view.u, &view.v);
    return view;
}
