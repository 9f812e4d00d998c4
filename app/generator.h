/* generator.h: what each kind of data that `veduta generate` makes brings along. */
#ifndef VEDUTA_APP_GENERATOR_H
#define VEDUTA_APP_GENERATOR_H

#include <veduta/context.h>

#include "options.h"

typedef struct vd_generator {
    const vd_option *table;
    int count;         /* of the options */
    int threads, help; /* which of them these are */
    void (*print_help)(void);
    vd_status (*check)(const vd_options *options); /* how it is used, before anything takes long */
    vd_status (*generate)(const vd_options *options, vd_context *context);
} vd_generator;

extern const vd_generator vd_generate_forest;

#endif
