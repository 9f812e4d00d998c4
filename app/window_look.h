/* window_look.h: the options that can change while a world is looked at, as sliders and words.
 *
 * Their values are those of the option table: a slider writes the option's text, and the settings
 * are read again from all of it, so that the window can ask for nothing that the command line could
 * not.
 */
#ifndef VEDUTA_APP_WINDOW_LOOK_H
#define VEDUTA_APP_WINDOW_LOOK_H

#include "render_settings.h"

typedef enum vd_live {
    VD_LIVE_SUN_AZIMUTH = 0,
    VD_LIVE_SUN_ALTITUDE,
    VD_LIVE_HAZE,
    VD_LIVE_EXAGGERATE,
    VD_LIVE_FOV,
    VD_LIVE_SAMPLES,
    VD_LIVE_FILTER,
    VD_LIVE_SHADOWS,
    VD_LIVE_SHADING,
    VD_LIVE_SKY,
    VD_LIVE_CURVATURE,
    VD_LIVE_COLORMAP,
    VD_LIVE_METHOD,
    VD_LIVE_THREADS,
    VD_LIVE_COUNT
} vd_live;

/* What is automatic until it is said: filled in from the world. */
typedef struct vd_look_defaults {
    double haze_m, size_m;
    bool curvature;
    int threads;
} vd_look_defaults;

/* The option that a live value belongs to. */
int vd_live_option(vd_live live);

/* True for values on a slider; false for words to choose from. */
bool vd_live_is_slider(vd_live live);

/* Writes what the panel calls it: the option's key, and which part of it. */
void vd_live_label(vd_live live, char out[40]);

/* Where it stands, 0 … 1; of words: which of them, in the same range. */
double vd_live_position(const vd_options *options, const vd_look_defaults *defaults, vd_live live);

/* Writes the value with its unit, as people read it. */
void vd_live_value(const vd_options *options, const vd_look_defaults *defaults, vd_live live,
                   char out[64]);

/* Sets a slider to a position, 0 … 1. Returns the errors of vd_options_set. */
VD_MUST_USE vd_status vd_live_set_position(vd_options *options, const vd_look_defaults *defaults,
                                           vd_live live, double position);

/* Sets a slider's value in the option's own unit (metres, degrees …). */
VD_MUST_USE vd_status vd_live_set_number(vd_options *options, vd_live live, double value);

/* Takes the next word (or the one before), around the end. */
VD_MUST_USE vd_status vd_live_next(vd_options *options, const vd_look_defaults *defaults,
                                   vd_live live, int step);

/* Reads a slider's value in the option's own unit. */
double vd_live_number(const vd_options *options, const vd_look_defaults *defaults, vd_live live);

/* Writes the flags of all options that were given and are not the camera's, each after a space and
 * quoted for a shell where it must be, cut at out_bytes. What is automatic is named as it is. */
void vd_look_flags(const vd_options *options, const vd_look_defaults *defaults, char *out,
                   size_t out_bytes);

#endif
