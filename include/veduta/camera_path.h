/* camera_path.h: a camera that moves: keyframes, an orbit or a track, and where it is at any time.
 *
 *     vd_camera_path_def def = vd_camera_path_def_default();
 *     def.keyframes = keyframes;
 *     def.count = 5;
 *     def.speed_mps = 40.0;
 *     status = vd_camera_path_create(context, &def, &path);
 *     for (int i = 0; i < frames; i++) {
 *         vd_camera_path_at(path, i / 30.0, 1920, 1080, &camera);
 *     }
 *
 * Positions follow centripetal Catmull-Rom curves (Barry & Goldman 1988; with the square root of
 * the distance between knots, Yuksel, Schaefer & Keyser 2011, they have neither cusps nor loops
 * between two keyframes). How far along the curve the camera is at a time is a monotone cubic
 * through the keyframes (Fritsch & Butland 1984), so that it never turns back and its speed has no
 * jumps; without times the speed is constant. Directions are Bézier curves of slerps (Shoemake
 * 1985, §4) whose turning speed has no jumps either. Where every keyframe is level, so is the
 * camera in between.
 *
 * A path is computed once and then only read: any number of threads may ask it at once. The same
 * bytes on every machine.
 */
#ifndef VEDUTA_CAMERA_PATH_H
#define VEDUTA_CAMERA_PATH_H

#include <stdbool.h>
#include <veduta/camera.h>
#include <veduta/context.h>

VD_BEGIN_DECLARATIONS

/* The most keyframes of a path and points of a track. */
#define VD_MAX_KEYFRAMES 1000000

/* The longest path in seconds. */
#define VD_MAX_PATH_SECONDS 1e6

typedef struct vd_keyframe {
    double time_s; /* of a timed path: when the camera is here; rising from keyframe to keyframe */
    vd_vec3 eye;   /* world, metres */
    vd_quat orientation; /* as a camera's: a unit quaternion */
    double fov_y_rad;    /* vertical field of view, above 0, below π */
} vd_keyframe;

typedef struct vd_camera_path_def {
    const vd_keyframe *keyframes; /* [count], not kept */
    int count;                    /* 2 … VD_MAX_KEYFRAMES */
    bool timed;                   /* the keyframes say when; else the speed is constant */
    double duration_s;            /* of a timed path 0: as the keyframes say, else these are scaled;
                                     of others 0: by speed_mps */
    double speed_mps;             /* of a path without times and duration */
    bool loop; /* from the last keyframe back to the first, at the mean speed, and on */
    double
        ease_s; /* seconds in which a path that is no loop gathers and loses its speed; 0: none */
    double near_m; /* of the cameras, above 0 */
} vd_camera_path_def;

/* No keyframes, no times, 1 s of ease, near 0.1 m. */
VD_API vd_camera_path_def vd_camera_path_def_default(void);

typedef struct vd_camera_path vd_camera_path;

/* Makes a path through keyframes; *out is owned by the caller. Two neighbours at one place are a
 * rest, or a turn on the spot, and need times. Cost: some microseconds a keyframe; all memory is
 * taken here. Returns VD_ERROR_ARGUMENT (the sentence names keyframe and field; also where nothing
 * moves at all), VD_ERROR_LIMIT or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_camera_path_create(vd_context *context,
                                                   const vd_camera_path_def *def,
                                                   vd_camera_path **out);

/* Ends a path and sets *path to null. Null is accepted. */
VD_API void vd_camera_path_destroy(vd_camera_path **path);

/* A circle about a point that the camera looks at. */
typedef struct vd_orbit_def {
    vd_vec3 centre;     /* world, metres: the middle of the picture */
    double radius_m;    /* above 0, measured level */
    double height_m;    /* of the eye above the centre */
    double heading_rad; /* of the view at the beginning: 0 stands in the south and looks north */
    double turns;      /* not 0; positive: the eye goes clockwise seen from above, as headings do */
    double duration_s; /* above 0 */
    double fov_y_rad;
    double near_m;
    double ease_s; /* whole turns are a loop and have none */
} vd_orbit_def;

/* One turn in 20 s from the south, radius 1000 m, 500 m above, 40°. */
VD_API vd_orbit_def vd_orbit_def_default(void);

/* Makes an orbit: a circle within 2·10⁻⁵ of the radius. Errors as for vd_camera_path_create. */
VD_API VD_MUST_USE vd_status vd_camera_path_create_orbit(vd_context *context,
                                                         const vd_orbit_def *def,
                                                         vd_camera_path **out);

/* Returns the ground's height at a place in the world, in metres as the camera's; −infinity or NaN
 * where there is none. */
typedef double vd_ground_function(void *user, double x, double y);

/* A walk along a line of points. */
typedef struct vd_track_def {
    const double (*points)[3]; /* [count] x, y, z: world, metres; not kept */
    int count;                 /* 2 … VD_MAX_KEYFRAMES */
    bool has_z;                /* z is a height; else it is not read */
    bool follow_z; /* fly height_m above the track's own heights, not above the ground */
    vd_ground_function *ground; /* null: there is none; then has_z must be set */
    void *ground_user;
    double height_m;     /* of the eye above the ground */
    double speed_mps;    /* above 0, unless duration_s says it */
    double duration_s;   /* 0: by the speed */
    double look_ahead_s; /* the camera looks where it will be in so many seconds */
    double pitch_rad;    /* of the view */
    bool pitch_free;     /* look up and down along the way too, beside pitch_rad */
    double smooth_s; /* corners and bumps are smoothed over so many seconds (a Gaussian's sigma) */
    double fov_y_rad;
    double near_m;
    double ease_s;
} vd_track_def;

/* 100 m above ground, 40 m/s, 4 s ahead, pitch −10°, smoothed over 1.5 s, 50°, 1 s of ease. */
VD_API vd_track_def vd_track_def_default(void);

/* Makes a path along a track: resampled to even steps, smoothed, lifted above the ground. Where
 * there is no ground the track's own heights stand in, then the ground's last height. Errors as for
 * vd_camera_path_create; points that repeat are one point. */
VD_API VD_MUST_USE vd_status vd_camera_path_create_track(vd_context *context,
                                                         const vd_track_def *def,
                                                         vd_camera_path **out);

/* Seconds from the first frame to the last; of a loop, of one round. */
VD_API double vd_camera_path_duration(const vd_camera_path *path);

/* Metres flown, the lift of vd_camera_path_clear included; of a loop, in one round. */
VD_API double vd_camera_path_length(const vd_camera_path *path);

VD_API bool vd_camera_path_loops(const vd_camera_path *path);

/* Gives the camera of a picture of width × height at a time: before the beginning the first, after
 * the end the last one; a loop goes round. Takes no memory; about a microsecond. */
VD_API void vd_camera_path_at(const vd_camera_path *path, double time_s, int width, int height,
                              vd_camera *camera);

/* Gives eye, orientation and field of view alone; time_s is the time asked for. */
VD_API vd_keyframe vd_camera_path_pose(const vd_camera_path *path, double time_s);

/* The path's own keyframes: their number, and each with the time at which the camera is there
 * (ease included). 0 <= index < count. */
VD_API int vd_camera_path_keyframe_count(const vd_camera_path *path);
VD_API vd_keyframe vd_camera_path_keyframe(const vd_camera_path *path, int index);

/* How near a path comes to the ground, straight down. */
typedef struct vd_path_clearance {
    bool has_ground;   /* the path passes over ground at all; else the rest is 0 */
    double lowest_m;   /* least height above ground; negative: under it */
    double time_s;     /* when */
    double lift_m;     /* the most that vd_camera_path_clear lifted the path by, else 0 */
    double unlifted_m; /* lowest_m as it was before */
} vd_path_clearance;

/* Measures it at places at most `step_m` apart (0: 2,048 steps), at most 2^18 of them. */
VD_API vd_path_clearance vd_camera_path_measure(const vd_camera_path *path,
                                                vd_ground_function *ground, void *user,
                                                double step_m);

/* Lifts the path, smoothly, so that it keeps at least clearance_m above the ground, also between
 * keyframes; what lies near such a place is lifted with it, so that the camera climbs and sinks at
 * a slope of about ¼ where the path is long enough. The ground is looked at every half clearance
 * (2,048 to 131,072 places). Call it once, before the path is shared. `out` may be null. Returns
 * VD_ERROR_ARGUMENT (a clearance that is negative or not finite) or VD_ERROR_MEMORY; the path is
 * then as before. */
VD_API VD_MUST_USE vd_status vd_camera_path_clear(vd_camera_path *path, vd_ground_function *ground,
                                                  void *user, double clearance_m,
                                                  vd_path_clearance *out);

VD_END_DECLARATIONS

#endif
