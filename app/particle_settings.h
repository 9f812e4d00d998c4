/* particle_settings.h: the options of `veduta render` for particles, and what they mean. */
#ifndef VEDUTA_APP_PARTICLE_SETTINGS_H
#define VEDUTA_APP_PARTICLE_SETTINGS_H

#include <veduta/veduta.h>

#include "options.h"

enum {
    PARTICLES_OUTPUT = 0,
    PARTICLES_SIZE,
    PARTICLES_COLOR_BY,
    PARTICLES_COLORMAP,
    PARTICLES_RANGE,
    PARTICLES_LOG,
    PARTICLES_MODE,
    PARTICLES_KERNEL,
    PARTICLES_RADIUS,
    PARTICLES_RADIUS_SCALE,
    PARTICLES_OPACITY,
    PARTICLES_WEIGHT,
    PARTICLES_SHADING,
    PARTICLES_BACKGROUND,
    PARTICLES_LEGEND,
    PARTICLES_DETAIL,
    PARTICLES_AZIMUTH,
    PARTICLES_ELEVATION,
    PARTICLES_DISTANCE,
    PARTICLES_EYE,
    PARTICLES_TARGET,
    PARTICLES_FOV,
    PARTICLES_PROJECTION,
    PARTICLES_COLUMNS,
    PARTICLES_RAW,
    PARTICLES_TYPE,
    PARTICLES_THREADS,
    PARTICLES_PNG_LEVEL,
    PARTICLES_JSON,
    PARTICLES_QUIET,
    PARTICLES_HELP,
    PARTICLES_COUNT
};

extern const vd_option vd_particles_table[PARTICLES_COUNT];

typedef struct vd_particle_settings {
    int width, height;
    const char *color_by; /* null: chosen by what there is */
    const char *weight;   /* null: mass where there is one */
    vd_colormap colormap;
    bool colormap_given;
    double range[2]; /* equal: automatic */
    int log;         /* −1: chosen */
    int mode;        /* vd_splat_mode; −1: chosen */
    int kernel;      /* vd_splat_kernel; −1: chosen */
    double radius_m, radius_scale, opacity, detail_px;
    bool shading, radius_scale_given;
    bool background_given;
    vd_rgba8 background;
    int legend; /* −1: where colours stand for numbers */
    bool has_eye, has_target;
    vd_vec3 eye, target;
    double azimuth, elevation, distance_m, fov; /* degrees */
    vd_projection projection;
    vd_particle_source_def source;
} vd_particle_settings;

/* Reads the settings out of the options. Returns VD_ERROR_ARGUMENT for bad use, and what loading a
 * colour map returns. */
VD_MUST_USE vd_status vd_particle_settings_read(vd_context *context, const vd_options *options,
                                                vd_particle_settings *out);

#endif
