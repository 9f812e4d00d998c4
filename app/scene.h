/* scene.h: elevation files and imagery, loaded and ready to be drawn. */
#ifndef VEDUTA_APP_SCENE_H
#define VEDUTA_APP_SCENE_H

#include <veduta/veduta.h>

/* What to load. */
typedef struct vd_scene_def {
    const char *const *inputs; /* elevation files; several become one terrain */
    int input_count;
    const char *function; /* a formula in place of the files; null: files */
    double extent[4];     /* what of the function is drawn: x0, y0, x1, y1, metres; all 0: all */
    vd_dem_def dem;       /* what the files do not say themselves */
    bool has_cell_size;
    int band; /* of the elevation files; 0: the first */
    bool fill_missing;
    const char *color; /* imagery; null: none */
    int bands[3];      /* of the imagery; 0: automatic */
} vd_scene_def;

/* A terrain, with what is left to know of the DEM that it was made from. */
typedef struct vd_scene {
    vd_context *context;
    vd_heightfield *terrain; /* null in a world of objects alone */
    vd_function *function;   /* endless; `terrain` is then what of it lies around the origin */
    double cell_m;           /* of the function's finest cells */
    vd_crs_kind kind;
    char *crs; /* owned; null when there is none */
    double crs_unit_m;
    vd_placement placement;
    double crs_from_sample[6];
    char height_type[16], height_unit[16];
    char format[256];  /* one line for people */
    uint64_t missing;  /* samples missing in the files, also when they were filled */
    vd_vec3 low, high; /* without a terrain: the box of what is looked at */
} vd_scene;

/* Loads elevation as a DEM: the core's own readers first, veduta-io for what they do not know and
 * for files with a georeference beside them. `format` receives a line for people, or may be null.
 */
VD_MUST_USE vd_status vd_scene_load_dem(vd_context *context, const vd_scene_def *def, vd_dem **out,
                                        char *format, size_t format_bytes);

/* Writes a share as people read it: "6.25 %", and "> 99.9 %" where "100 %" would be a lie. */
void vd_write_share(uint64_t part, uint64_t whole, char out[16]);

/* Loads elevation and imagery. What is remarkable goes to the context's log. */
VD_MUST_USE vd_status vd_scene_load(vd_context *context, const vd_scene_def *def, vd_scene *out);
void vd_scene_finish(vd_scene *scene);

/* The height of an endless function at the origin, and how far the heights around it range, leaving
 * out the lowest and the highest fiftieth. */
void vd_scene_origin(const vd_scene *scene, double *ground, double *relief);

/* Whether the Earth's curvature is on by default: for georeferenced data up to 1,000 km across. The
 * formula bends a flat map, and on whole continents it would bend it out of sight. */
bool vd_scene_is_curved(const vd_scene *scene);

/* Converts latitude and longitude in degrees to world x and y. */
VD_MUST_USE vd_status vd_scene_world_from_latlon(const vd_scene *scene, double latitude,
                                                 double longitude, double *x, double *y);

/* The way back. */
VD_MUST_USE vd_status vd_scene_latlon_from_world(const vd_scene *scene, double x, double y,
                                                 double *latitude, double *longitude);

#endif
