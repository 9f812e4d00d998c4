/* serve_settings.h: the options of `veduta serve`. */
#ifndef VEDUTA_APP_SERVE_SETTINGS_H
#define VEDUTA_APP_SERVE_SETTINGS_H

#include "render_settings.h"

enum {
    SERVE_PORT = OPTION_COUNT,
    SERVE_BIND,
    SERVE_TOKEN,
    SERVE_TLS,
    SERVE_TLS_KEY,
    SERVE_ROOT,
    SERVE_MAX_CLIENTS,
    SERVE_BANDWIDTH,
    SERVE_MEMORY,
    SERVE_RECORD,
    SERVE_COUNT
};

typedef struct vd_serve_settings {
    int port;
    const char *address;
    const char *token;             /* null: a random one */
    const char *certificate, *key; /* null: no TLS */
    const char *root;              /* null: where a page usually is */
    const char *record;            /* null: nothing is */
    int max_clients;
    double bytes_per_s; /* 0: no limit */
    double memory_bytes;
} vd_serve_settings;

void vd_serve_make_table(vd_option table[SERVE_COUNT]);
void vd_serve_print_help(const vd_option *table);

/* Reads and checks what can be refused before anything is loaded. */
VD_MUST_USE vd_status vd_serve_settings_read(const vd_options *options,
                                             const vd_render_settings *render,
                                             vd_serve_settings *out);

#endif
