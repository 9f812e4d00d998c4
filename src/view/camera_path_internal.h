/* camera_path_internal.h: what a path is made of, for its constructors and its clearance. */
#ifndef VEDUTA_VIEW_CAMERA_PATH_INTERNAL_H
#define VEDUTA_VIEW_CAMERA_PATH_INTERNAL_H

#include <veduta/camera_path.h>

/* Pieces of a segment whose lengths are kept, for the way back from a length. */
enum { VD_PATH_PIECES = 8 };

/* A knot: a keyframe, or the first one again at the end of a loop. */
typedef struct vd_path_knot {
    vd_keyframe key;  /* its time: without ease */
    double length_m;  /* along the curve from the beginning, without lift */
    double speed_mps; /* along the curve */
    vd_vec3 spin;     /* rotation vector per second, in the camera's own axes */
    double fov_per_s; /* slope of the field of view */
} vd_path_knot;

/* From knot i to knot i + 1: c[0] + u·(c[1] + u·(c[2] + u·c[3])), u = 0 … 1. */
typedef struct vd_path_segment {
    vd_vec3 c[4];
    double length_m[VD_PATH_PIECES + 1]; /* from the segment's beginning to each piece's */
} vd_path_segment;

struct vd_camera_path {
    vd_context *context;
    vd_path_knot *knots;       /* [segment_count + 1] */
    vd_path_segment *segments; /* [segment_count] */
    int count, segment_count;  /* keyframes; count − 1, of a loop count */
    bool timed, loop, level;
    double duration_s, ease_s, near_m;
    double curve_m; /* length without lift */
    double flown_m; /* with it */

    /* Lift: a uniform cubic B-spline over the curve's length, [lift_count] control values, one
     * every lift_step_m, the first at 0; null: none. A loop's values go round. */
    double *lifts;
    int lift_count;
    double lift_step_m;
};

/* Where a segment is at u, and the u at which so many of its metres are behind. */
vd_vec3 vd_segment_place(const vd_path_segment *segment, double u);
double vd_segment_at_length(const vd_path_segment *segment, double length_m);

/* Makes the segments from the knots' eyes, and gives the knots their lengths. */
void vd_path_make_segments(vd_camera_path *path);

/* The last segment that begins at or before a length (or else a path time). */
int vd_path_find(const vd_camera_path *path, bool by_length, double value);

/* The place at a length along the curve without lift, 0 … curve_m. */
vd_vec3 vd_path_place(const vd_camera_path *path, double length_m);

/* The lift there. */
double vd_path_lift(const vd_camera_path *path, double length_m);

/* The time at which the camera is at a length along the curve; at a rest, its beginning. */
double vd_path_time(const vd_camera_path *path, double length_m);

#endif
