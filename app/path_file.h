/* path_file.h: a camera path from a file: keyframes or an orbit as JSON, or a track. docs/fly.md
 * describes the JSON. */
#ifndef VEDUTA_APP_PATH_FILE_H
#define VEDUTA_APP_PATH_FILE_H

#include "scene.h"

/* What the command line says; a file's own words come second, then the defaults. NaN: not said. */
typedef struct vd_path_settings {
    double duration_s, speed_mps;
    double height_m;     /* of a track above the ground */
    double look_ahead_s; /* on a track */
    double smooth_s;     /* of a track */
    double pitch;        /* of the view along a track, degrees */
    double fov;          /* degrees */
    double clearance_m;  /* kept above the ground; 0: none */
    double near_m;
    double exaggeration;
} vd_path_settings;

/* Nothing said. */
vd_path_settings vd_path_settings_default(void);

/* What goes with a path. */
typedef struct vd_path_notes {
    double clearance_m; /* to be kept: said by flag or file, else 10 m, half of a lower track's
                           height */
    char kind[16];      /* "keyframes", "orbit" or "track" */
} vd_path_notes;

/* Reads a path: .json, or a track (.gpx, .kml, .geojson …); `path` null is an orbit about all of
 * the terrain. Heights above ground come from `ground`. *out is owned by the caller; it is not yet
 * lifted to the clearance. Returns VD_ERROR_IO, VD_ERROR_FORMAT, VD_ERROR_ARGUMENT,
 * VD_ERROR_UNSUPPORTED or VD_ERROR_MEMORY, with file and field. */
VD_MUST_USE vd_status vd_path_load(vd_context *context, const char *path,
                                   const vd_path_settings *settings, const vd_scene *scene,
                                   vd_ground_function *ground, void *ground_user,
                                   vd_path_notes *notes, vd_camera_path **out);

/* Points of a line on the Earth. */
typedef struct vd_track_points {
    double (*lonlat)[3]; /* [count] degrees, degrees, metres; owned: vd_release */
    int count;
    bool has_z;
} vd_track_points;

/* Reads the first line of a GPX, KML, GeoJSON or other vector file. The one place that knows how.
 */
VD_MUST_USE vd_status vd_path_load_track(vd_context *context, const char *path,
                                         vd_track_points *out);

#endif
