/* render_settings.h: the options of `veduta render` and what they mean.
 *
 * The table below is the one place that knows the options; vd_render_settings is the same thing
 * understood: every text parsed, every range and every pair of options that exclude each other
 * checked, before any file is opened. Angles are in degrees, as given.
 */
#ifndef VEDUTA_APP_RENDER_SETTINGS_H
#define VEDUTA_APP_RENDER_SETTINGS_H

#include <veduta/veduta.h>

#include "options.h"

enum {
    OPTION_OUTPUT = 0,
    OPTION_SIZE,
    OPTION_SAMPLES,
    OPTION_FILTER,
    OPTION_PRESET,
    OPTION_METHOD,
    OPTION_THREADS,
    OPTION_PNG_LEVEL,
    OPTION_DEPTH,
    OPTION_IDS,

    OPTION_COLOR,
    OPTION_COLORMAP,
    OPTION_SUN,
    OPTION_SHADOWS,
    OPTION_SHADING,
    OPTION_HAZE,
    OPTION_SKY,
    OPTION_BACKGROUND,
    OPTION_EXAGGERATE,
    OPTION_CURVATURE,

    OPTION_AZIMUTH,
    OPTION_ELEVATION,
    OPTION_DISTANCE,
    OPTION_EYE,
    OPTION_TARGET,
    OPTION_HEADING,
    OPTION_PITCH,
    OPTION_ROLL,
    OPTION_FOV,
    OPTION_PROJECTION,
    OPTION_NEAR,
    OPTION_PRINT_CAMERA,

    OPTION_MISSING,
    OPTION_NODATA,
    OPTION_CELL_SIZE,
    OPTION_HEIGHT_SCALE,
    OPTION_HEIGHT_OFFSET,
    OPTION_HEIGHT_ENCODING,
    OPTION_RAW,
    OPTION_BAND,
    OPTION_BANDS,
    OPTION_FUNCTION,
    OPTION_EXTENT,

    OPTION_CAMERA,
    OPTION_LINES,
    OPTION_LABELS,
    OPTION_LABEL_PEAKS,
    OPTION_TITLE,
    OPTION_NORTH_ARROW,
    OPTION_SCALE_BAR,
    OPTION_LEGEND,

    OPTION_IMPOSTORS,
    OPTION_TOLERANCE,
    OPTION_SHOW,

    OPTION_CLASSIC,
    OPTION_HEIGHT,

    OPTION_SHADE,
    OPTION_TEXTURE,
    OPTION_WIREFRAME,
    OPTION_POINTS,
    OPTION_SHOW_NORMALS,
    OPTION_LINE_WIDTH,
    OPTION_POINT_SIZE,
    OPTION_CULL,
    OPTION_WINDING,
    OPTION_UP,
    OPTION_FAR,
    OPTION_RASTER,

    OPTION_OPTIONS,
    OPTION_SAVE,
    OPTION_SAVE_WORLD,
    OPTION_DRY_RUN,
    OPTION_ALLOW_EMPTY,
    OPTION_JSON,
    OPTION_QUIET,
    OPTION_HELP,
    OPTION_COUNT
};

extern const vd_option vd_render_table[OPTION_COUNT];

/* Where a model is looked at from unless it is said: the direction, and how far down. */
#define VD_MODEL_AZIMUTH (-30.0)
#define VD_MODEL_ELEVATION 25.0

#define VD_RADIANS_PER_DEGREE (3.14159265358979323846 / 180.0)

typedef enum vd_position_kind {
    VD_POSITION_NONE = 0,
    VD_POSITION_WORLD,        /* x, y, z in world metres */
    VD_POSITION_ABOVE_GROUND, /* latitude, longitude, metres above the ground */
    VD_POSITION_ABOVE_SEA     /* latitude, longitude, metres in the data's own heights */
} vd_position_kind;

typedef struct vd_position {
    vd_position_kind kind;
    double v[3];
} vd_position;

typedef enum vd_camera_spelling {
    VD_SPELLING_ORBIT = 0, /* azimuth, elevation, distance about a target */
    VD_SPELLING_LOOK_AT,   /* eye, target */
    VD_SPELLING_ANGLES     /* eye, heading, pitch */
} vd_camera_spelling;

typedef struct vd_camera_settings {
    vd_camera_spelling spelling;
    vd_position eye, target;          /* kind NONE: found from the terrain */
    double azimuth, elevation;        /* orbit: where the camera looks; how far it looks down */
    bool elevation_given;             /* else another one may be taken where this shows nothing */
    double distance_m;                /* orbit: 0 frames the relief */
    double heading, pitch, roll, fov; /* degrees */
    vd_projection projection;
    double near_m; /* of a model 0: by its size */
    double far_m;  /* of a model; 0: none */
} vd_camera_settings;

typedef enum vd_haze_mode { VD_HAZE_AUTO = 0, VD_HAZE_OFF, VD_HAZE_DISTANCE } vd_haze_mode;

typedef enum vd_up { VD_UP_AUTO = 0, VD_UP_Y, VD_UP_Z } vd_up;

/* What is said of a picture of a model. */
typedef struct vd_model_settings {
    vd_shading shading;
    const char *texture; /* a file for all of it; null: the model's own */
    bool skip_textures;  /* --texture none */
    vd_fill fill;
    bool ink; /* lines or points, and no --shade: dark and unlit */
    bool show_normals;
    double line_width, point_size; /* pixels */
    vd_cull cull;
    vd_winding winding;
    vd_up up;
    vd_raster_method method;
    vd_texture_filter filter;
    bool sun_given; /* else the light follows the viewer */
} vd_model_settings;

/* Names point into the vd_options that the settings were made from. */
typedef struct vd_render_settings {
    const char *output, *depth, *ids; /* depth and ids null unless asked for */
    const char *const *inputs;
    int input_count;
    const char *function; /* a formula in place of inputs, or null */
    double extent[4];     /* of the function: x0, y0, x1, y1, metres; all 0: endless */
    int width, height, samples, threads, png_level;
    vd_filter filter;
    const char *color, *colormap;     /* color null: none */
    bool colormap_given;              /* else the data may suggest another one */
    double sun_azimuth, sun_altitude; /* degrees */
    vd_shadow_curve shadow_curve;     /* of the classic picture */
    bool shadows, shading, sky, sky_colored;
    bool shadows_given; /* asked for, not the default */
    vd_rgba8 sky_color, background;
    vd_haze_mode haze;
    double haze_m;
    double exaggeration;
    int curvature; /* −1: on when the data is georeferenced */
    vd_camera_settings camera;
    bool fill_missing;
    vd_dem_def dem;
    bool has_cell_size;
    int band, bands[3];         /* 0: automatic */
    bool world;                 /* a world file was read */
    const char *lines, *labels; /* files; null: none */
    int label_peaks;
    const char *title; /* null: none */
    bool north_arrow, scale_bar, legend;
    bool impostors; /* pictures stand in for things */
    double tolerance_px;
    bool moving; /* --show: impostors as a moving camera has them */
    vd_impostor_show show;
    bool is_model; /* the input is a model */
    vd_model_settings model;
    bool classic;
    vd_classic_def classic_def;
    double classic_yaw; /* degrees, as given */
    vd_terrain_method terrain_method;
    vd_classic_method classic_method;
    bool print_camera, dry_run, allow_empty, json, quiet;
} vd_render_settings;

/* Reads the settings out of the options. Returns VD_ERROR_ARGUMENT for bad use. */
VD_MUST_USE vd_status vd_render_settings_read(const vd_options *options, vd_render_settings *out);

/* Drops from an options file what flags say in another way: flags that place the camera replace
 * the file's camera where the two would be different spellings, and so with the colours. */
VD_MUST_USE vd_status vd_render_prefer_flags(vd_options *options);

/* Gives the options that no one set the values of --preset. */
VD_MUST_USE vd_status vd_render_apply_preset(vd_options *options);

/* Reads RRGGBB (a # before it is allowed). */
bool vd_read_color(const char *text, vd_rgba8 *out);

bool vd_ends_with(const char *text, const char *ending);

/* Whether a file's name ends as models' names do; *z_up (may be null) tells which axis points up in
 * such files by custom. */
bool vd_is_model_name(const char *path, bool *z_up);

/* Reads what a model's picture has options for, and refuses those that belong to terrain; for a
 * picture of terrain the other way round. Returns VD_ERROR_ARGUMENT naming the option. */
VD_MUST_USE vd_status vd_model_settings_read(const vd_options *options, vd_render_settings *out);

/* Reads the options of lines, labels and furniture, and refuses those of worlds where there is
 * none. Returns VD_ERROR_ARGUMENT naming the option. */
VD_MUST_USE vd_status vd_world_settings_read(const vd_options *options, vd_render_settings *out);

/* Reads the options of impostors, when all others are read, and refuses them where there can be
 * none. Returns VD_ERROR_ARGUMENT naming the option. */
VD_MUST_USE vd_status vd_impostor_settings_read(const vd_options *options, vd_render_settings *out);

/* Reads the camera's options. Returns VD_ERROR_ARGUMENT naming the option. */
VD_MUST_USE vd_status vd_camera_settings_read(const vd_options *options, vd_camera_settings *out);

#endif
