/* world_content.h: what stands in a world beside its terrain, as a world file says it: parsed and
 * checked, nothing opened yet.
 */
#ifndef VEDUTA_APP_WORLD_CONTENT_H
#define VEDUTA_APP_WORLD_CONTENT_H

#include <jansson.h>

#include "render_settings.h"

typedef enum vd_spot_height {
    VD_SPOT_ON_GROUND = 0,
    VD_SPOT_ABOVE_GROUND, /* metres above it */
    VD_SPOT_AT_ALTITUDE   /* metres in the data's own heights */
} vd_spot_height;

/* Where something stands. */
typedef struct vd_world_spot {
    bool given;
    bool geographic; /* (x, y) is longitude and latitude in degrees; else world metres */
    double x, y;
    vd_spot_height height;
    double height_m;
} vd_world_spot;

/* An object or a sprite, or many of them. */
typedef struct vd_world_item {
    char key[32];     /* "objects[3]", for sentences */
    const char *path; /* of the mesh or the picture */
    vd_world_spot spot;
    double heading;  /* degrees clockwise */
    double scale[3]; /* along the model's x, y and z axes */
    vd_up up;
    bool foot;       /* the middle of the lower face stands there, not the model's origin */
    bool shadowless; /* throws none */
    double plane[3]; /* normal of the plane of its impostors at heading 0; zeros: the best */
    double height_m; /* of a sprite */
    bool tilts;      /* a sprite: faces the eye from above too */
    size_t instance_count;
    double (*instances)[4];    /* x, y, heading, scale: metres, degrees, factor */
    const char *instance_path; /* a file of points in their place; null: none */
} vd_world_item;

typedef struct vd_world_line {
    char key[32];
    const char *path; /* a file of lines; null: the points */
    size_t count;
    double (*points)[2]; /* metres, or longitude and latitude */
    bool geographic, closed;
    vd_rgba8 color;
    double width_px;
    double above_m; /* the ground */
} vd_world_line;

typedef struct vd_world_label {
    char key[32];
    const char *text; /* null: those of a file */
    vd_world_spot spot;
    const char *path,
        *property; /* a file of places and what names them; property null: the usual */
    double priority;
    vd_label_hidden hidden;
    vd_rgba8 color;
} vd_world_label;

/* A brick file, and how its particles look. */
typedef struct vd_world_particles {
    char key[32];
    const char *path;
    bool has_color; /* all are of `color`; else by `color_by` */
    vd_rgba8 color;
    const char *color_by; /* null: by what there is */
    const char *colormap; /* a name or a path; null: the usual */
    double range[2];      /* equal: that of the file */
    bool log;
    double radius_m, radius_scale; /* 0: not given */
    double opacity, detail_px;
    vd_splat_kernel kernel;
    double most; /* particles of an object; 0: the usual */
} vd_world_particles;

/* Of lines that do not say it. */
extern const vd_rgba8 vd_world_line_color;
extern const double vd_world_line_width_px;

/* The most objects, sprites and labels that a world file may have, instances counted. */
#define VD_WORLD_MOST ((size_t)1 << 24)

/* All zero: nothing. */
typedef struct vd_world_content {
    char *name;   /* of the file, for sentences; null: there was none */
    json_t *root; /* the file's own lists, for saving; without paths made absolute */
    char *folder; /* what its relative paths start from; "" for none */
    size_t object_count, sprite_count, line_count, label_count, particles_count;
    vd_world_item *objects, *sprites;
    vd_world_line *lines;
    vd_world_label *labels;
    vd_world_particles *particles;
    vd_label_hidden peaks_hidden; /* of --label-peaks */
    const char *legend_title;     /* null: the usual */
    const char *camera;           /* the name of the one that is looked through; null: none */
    char **warnings;              /* sentences about what is legal but surely not meant */
    size_t warning_count;
    void **owned; /* what the pointers above point to */
    size_t owned_count;
} vd_world_content;

void vd_world_content_finish(vd_world_content *content);

/* True when there is anything to be seen in it. */
bool vd_world_content_any(const vd_world_content *content);

/* Reads the lists "objects", "sprites", "lines", "labels" and "particles" out of a world file's
 * root. Returns VD_ERROR_FORMAT with a sentence that names file and key, or VD_ERROR_MEMORY. What
 * was read before a failure stays, for vd_world_content_finish. */
VD_MUST_USE vd_status vd_world_content_read(vd_world_content *content, const json_t *root);

#endif
