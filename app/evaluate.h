/* evaluate.h: the measure of impostors: what is on screen against what should be.
 *
 * Lawlor 2004, §5.1: a stream of viewpoints, perfect frames of them, a run that shows what it has
 * in time, and the difference of the two (eq. 5.1). Four programs are measured on one stream:
 * impostors, impostors without reuse, screen shipping (whole frames over the same link), and frames
 * that are drawn directly in no time, of which nothing is wrong but that they stand for a sixtieth
 * of a second.
 */
#ifndef VEDUTA_APP_EVALUATE_H
#define VEDUTA_APP_EVALUATE_H

#include "fly_world.h"
#include "path_file.h"
#include "remote_module.h"

/* Behind `render`'s, whose places in the table stay. */
enum {
    EVALUATE_TOLERANCE = OPTION_COUNT,
    EVALUATE_BUDGET,
    EVALUATE_MEMORY,
    EVALUATE_MOST_PX,
    EVALUATE_LEAST_REUSE,
    EVALUATE_FADE,
    EVALUATE_BANDWIDTH,
    EVALUATE_LATENCY,
    EVALUATE_CODEC,
    EVALUATE_QUALITY,
    EVALUATE_RATE,
    EVALUATE_SECONDS,
    EVALUATE_COMPARE,
    EVALUATE_ONLY,
    EVALUATE_REFERENCE_SAMPLES,
    EVALUATE_VIRTUAL,
    EVALUATE_ONE_MACHINE,
    EVALUATE_OUTPUT,
    EVALUATE_PLOT,
    EVALUATE_WORST,
    EVALUATE_COUNT
};

typedef enum vd_evaluated {
    VD_EVALUATED_IMPOSTORS = 0,
    VD_EVALUATED_SCREEN,
    VD_EVALUATED_NO_REUSE,
    VD_EVALUATED_DIRECT, /* drawn itself, in no time, without a link: what a display costs */
    VD_EVALUATED_COUNT
} vd_evaluated;

typedef struct vd_evaluate_settings {
    vd_render_settings render; /* the world and its look */
    vd_path_settings path;
    const char *path_file;
    const char *output, *plot, *worst; /* files; null: none */
    vd_impostor_def impostors;
    double rate_hz, compare_hz;
    double seconds;           /* 0: as long as the path */
    vd_evaluated first, last; /* the programs that run */
    int reference_samples;    /* a pixel, of perfect frames */
    bool is_virtual;
    vd_codec codec; /* of what goes over the link */
    int quality;    /* of codecs with losses */
} vd_evaluate_settings;

/* Fills the table; its texts live as long as the program. */
void vd_evaluate_make_table(vd_option table[EVALUATE_COUNT]);
void vd_evaluate_print_help(void);

/* Reads the settings; `out` borrows from `options` and the path's name. Returns VD_ERROR_ARGUMENT.
 */
VD_MUST_USE vd_status vd_evaluate_settings_read(const vd_options *options, const char *path_file,
                                                vd_evaluate_settings *out);

/* The word of --codec. */
const char *vd_evaluate_codec_name(vd_codec codec);

/* ---- packing ----------------------------------------------------------------------------------*/

/* What makes pictures and screens small for the link. */
typedef struct vd_packer {
    vd_remote_module remote;
    vd_coder *coder; /* null: nothing is packed */
    vd_encode_def def;
    uint8_t *bytes;
    size_t room;
    double decode_s; /* that unpacking has taken, all in all */
} vd_packer;

/* Returns VD_ERROR_UNSUPPORTED where veduta-remote is missing, or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_packer_init(vd_context *context, const vd_evaluate_settings *settings,
                                     vd_packer *out);
void vd_packer_finish(vd_packer *packer);

/* Packs rgba [height][stride][4] and unpacks it in its place. Returns the bytes on the way: of what
 * cannot be packed, and without a codec, width × height × 4. */
size_t vd_packer_pass(vd_packer *packer, uint8_t *rgba, int width, int height, size_t stride);

/* ---- a run ------------------------------------------------------------------------------------*/

/* Of one program. Sums are over displayed frames until they are divided. */
typedef struct vd_evaluated_figures {
    uint64_t frames;          /* that came onto the screen in time */
    uint64_t made;            /* of impostors; the last may come too late */
    double whole;             /* of these, as many as were new as a whole: no reuse */
    double error;             /* e, eq. 5.1: mean of `errors` */
    double *errors;           /* [compared] e(t); owned by the evaluation */
    double busy_s, slowest_s; /* work on all frames, on the longest of them: of this machine */
    uint64_t bytes, pixels;   /* over the link; pixels of impostors */
    uint64_t uploads;
    double reuse, overdraw, shown, direct; /* of impostors: R; the others are means */
    double reused, pictures;               /* likewise: shown again; kept */
    double error_px, show_s;
    uint64_t failed, dropped;
    double worst_error, worst_s; /* the greatest error, and when */
} vd_evaluated_figures;

typedef struct vd_evaluation {
    const vd_evaluate_settings *settings;
    vd_context *context;
    vd_job *job;
    vd_fly_world *world;
    const vd_camera_path *path;
    vd_packer *packer;
    double seconds;
    int compared; /* moments */
    vd_evaluated_figures of[VD_EVALUATED_COUNT];
    vd_frame *worst; /* of the first program, where it was asked for */
} vd_evaluation;

/* Runs the programs of the settings, one beside the other. vd_evaluation_finish is due also after a
 * failure. */
VD_MUST_USE vd_status vd_evaluation_run(vd_evaluation *evaluation);
void vd_evaluation_finish(vd_evaluation *evaluation);

/* The moment of a comparison, seconds. */
double vd_evaluation_time(const vd_evaluation *evaluation, int compared);

/* ---- what comes out ---------------------------------------------------------------------------*/

/* The result; `series`: with the errors over time. Null when memory is out. */
json_t *vd_evaluation_json(const vd_evaluation *evaluation, bool series);

/* A table for people; false when it could not be written. */
bool vd_evaluation_print(const vd_evaluation *evaluation);

VD_MUST_USE vd_status vd_evaluation_plot(const vd_evaluation *evaluation, const char *path);

#endif
