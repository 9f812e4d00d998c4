/* serve_settings.c: the option table of `veduta serve` and what it means. */
#include "serve_settings.h"

#include <ctype.h>
#include <string.h>

#define SERVER "Server"

enum { TOKEN_BYTES = 256 };

static const vd_option own[SERVE_COUNT - OPTION_COUNT] = {
    [SERVE_PORT - OPTION_COUNT] = {.key = "port",
                                   .group = SERVER,
                                   .type = VD_OPTION_INTEGER,
                                   .argument = "N",
                                   .max = 65535,
                                   .fallback = "8080",
                                   .help = "of page, socket and pictures; 0: a free one"},
    [SERVE_BIND - OPTION_COUNT] = {.key = "bind",
                                   .group = SERVER,
                                   .type = VD_OPTION_TEXT,
                                   .argument = "ADDRESS",
                                   .fallback = "127.0.0.1",
                                   .help = "where to listen; 0.0.0.0: at every address that this "
                                           "machine has"},
    [SERVE_TOKEN - OPTION_COUNT] =
        {.key = "token",
         .group = SERVER,
         .type = VD_OPTION_TEXT,
         .argument = "TEXT",
         .transient = true,
         .help = "what clients must say, letters, digits, - . _ and ~; by default a random one"},
    [SERVE_TLS - OPTION_COUNT] = {.key = "tls",
                                  .group = SERVER,
                                  .type = VD_OPTION_FILE,
                                  .argument = "CERT.pem",
                                  .help = "encrypt, with this certificate and those after it"},
    [SERVE_TLS_KEY - OPTION_COUNT] = {.key = "tls-key",
                                      .group = SERVER,
                                      .type = VD_OPTION_FILE,
                                      .argument = "KEY.pem",
                                      .help = "its key, where it does not stand in the same file"},
    [SERVE_ROOT - OPTION_COUNT] = {.key = "root",
                                   .group = SERVER,
                                   .type = VD_OPTION_FILE,
                                   .argument = "FOLDER",
                                   .help = "the page, with its index.html"},
    [SERVE_MAX_CLIENTS - OPTION_COUNT] = {.key = "max-clients",
                                          .group = SERVER,
                                          .type = VD_OPTION_INTEGER,
                                          .argument = "N",
                                          .min = 1,
                                          .max = 4096,
                                          .fallback = "32",
                                          .help = "that are served at once"},
    [SERVE_BANDWIDTH - OPTION_COUNT] = {.key = "bandwidth",
                                        .group = SERVER,
                                        .type = VD_OPTION_TEXT,
                                        .argument = "B",
                                        .unit = "bytes a second, or with ending: 2M",
                                        .fallback = "0",
                                        .help = "most that a client is sent; 0: what its link "
                                                "takes"},
    [SERVE_MEMORY - OPTION_COUNT] = {.key = "memory",
                                     .group = SERVER,
                                     .type = VD_OPTION_TEXT,
                                     .argument = "B",
                                     .unit = "bytes, or with ending: 64M",
                                     .fallback = "64M",
                                     .help = "most that a client's pictures take here and there"},
    [SERVE_RECORD - OPTION_COUNT] = {.key = "record",
                                     .group = SERVER,
                                     .type = VD_OPTION_FILE,
                                     .argument = "FILE.vdx",
                                     .transient = true,
                                     .help = "write what is said to and by the first client into "
                                             "it, for `veduta replay`"},
};

/* Options of `veduta render` that say nothing about a server. */
static bool is_for_server(int option) {
    return option != OPTION_OUTPUT && option != OPTION_DEPTH && option != OPTION_IDS &&
           option != OPTION_PROJECTION && option != OPTION_PRINT_CAMERA &&
           option != OPTION_CLASSIC && option != OPTION_HEIGHT && option != OPTION_SAVE &&
           option != OPTION_SAVE_WORLD && option != OPTION_PNG_LEVEL && option != OPTION_DRY_RUN &&
           option != OPTION_JSON && option != OPTION_IMPOSTORS && option != OPTION_TOLERANCE &&
           option != OPTION_SHOW && !(option >= OPTION_SHADE && option <= OPTION_RASTER);
}

void vd_serve_make_table(vd_option table[SERVE_COUNT]) {
    memcpy(table, vd_render_table, sizeof vd_render_table);
    memcpy(table + OPTION_COUNT, own, sizeof own);
    table[OPTION_SIZE].fallback = "1280x720";
    table[OPTION_SIZE].help = "of the picture that the first camera is for";
}

void vd_serve_print_help(const vd_option *table) {
    vd_option shown[SERVE_COUNT];
    int count = 0;
    for (int i = OPTION_COUNT; i < SERVE_COUNT; i++) {
        shown[count++] = table[i];
    }
    for (int i = 0; i < OPTION_COUNT; i++) {
        if (is_for_server(i)) {
            shown[count++] = table[i];
        }
    }
    fputs(
        "usage: veduta serve [OPTIONS] WORLD.json|HEIGHTS…\n\n"
        "Serves a world to browsers, which need no GPU, and prints the address to open. It stops\n"
        "when it is interrupted. What goes over the wire: docs/serve.md, docs/wire.md.\n",
        stdout);
    vd_options_print_help(shown, count, stdout);
    fputs(
        "\nexamples\n"
        "  veduta serve world.json\n"
        "  veduta serve dem.tif --port 0\n"
        "  veduta serve world.json --bind 0.0.0.0 --tls cert.pem --tls-key key.pem --bandwidth 2M\n"
        "  curl -H \"Authorization: Bearer $TOKEN\" \\\n"
        "    'http://127.0.0.1:8080/frame.png?size=640x360' -o view.png\n",
        stdout);
}

static bool is_token(const char *text) {
    size_t length = 0;
    for (; text[length] != '\0'; length++) {
        if (!isalnum((unsigned char)text[length]) && strchr("-._~", text[length]) == NULL) {
            return false;
        }
    }
    return length > 0 && length <= TOKEN_BYTES;
}

vd_status vd_serve_settings_read(const vd_options *options, const vd_render_settings *render,
                                 vd_serve_settings *out) {
    for (int i = 0; i < OPTION_COUNT; i++) {
        if (!is_for_server(i) && vd_options_given(options, i)) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "--%s does not apply to a server; leave it out, or give it to "
                              "`veduta render`",
                              options->table[i].key);
        }
    }
    if (render->is_model) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "%.160s is a model; put it into a world file (docs/world.md) and serve "
                          "that",
                          render->inputs[0]);
    }
    const vd_option_value *v = options->values;
    *out = (vd_serve_settings){.port = (int)v[SERVE_PORT].number,
                               .address = v[SERVE_BIND].text,
                               .token = v[SERVE_TOKEN].text,
                               .certificate = v[SERVE_TLS].text,
                               .key = v[SERVE_TLS_KEY].text,
                               .root = v[SERVE_ROOT].text,
                               .record = v[SERVE_RECORD].text,
                               .max_clients = (int)v[SERVE_MAX_CLIENTS].number};
    if (out->token != NULL && !is_token(out->token)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--token: a token is 1 to 256 letters, digits, - . _ and ~, since it "
                          "stands in an address; leave it out for a random one");
    }
    if (out->key != NULL && out->certificate == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--tls-key without --tls: name the certificate of the key");
    }
    out->key = out->key != NULL ? out->key : out->certificate;
    vd_status status = vd_option_bytes(options, SERVE_BANDWIDTH, 0.0, 1e15, &out->bytes_per_s);
    if (status.code == VD_OK) {
        status = vd_option_bytes(options, SERVE_MEMORY, 4194304.0, 1e12, &out->memory_bytes);
    }
    return status;
}
