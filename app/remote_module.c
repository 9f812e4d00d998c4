/* remote_module.c: finding veduta-remote. */
#include "remote_module.h"

#include <string.h>

#if defined(VEDUTA_REMOTE_LINKED)

vd_status vd_remote_module_open(const char *purpose, vd_remote_module *out) {
    (void)purpose;
    *out = (vd_remote_module){
        .codec_name = vd_codec_name,
        .codec_bound = vd_codec_bound,
        .coder_create = vd_coder_create,
        .coder_destroy = vd_coder_destroy,
        .encode = vd_coder_encode,
        .decode = vd_coder_decode,
        .wire_create = vd_wire_create,
        .wire_destroy = vd_wire_destroy,
        .wire_decode = vd_wire_decode,
        .wire_kind_name = vd_wire_kind_name,
        .server_def_default = vd_server_def_default,
        .server_create = vd_server_create,
        .server_destroy = vd_server_destroy,
        .server_port = vd_server_port,
        .server_has_page = vd_server_has_page,
        .server_listen = vd_server_listen,
        .server_render = vd_server_render,
        .server_stop = vd_server_stop,
        .client_def_default = vd_client_def_default,
        .client_state_name = vd_client_state_name,
        .client_create = vd_client_create,
        .client_destroy = vd_client_destroy,
        .client_look = vd_client_look,
        .client_set = vd_client_set,
        .client_cut = vd_client_cut,
        .client_draw = vd_client_draw,
        .client_get_news = vd_client_get_news,
        .client_get_world = vd_client_get_world,
        .client_ground = vd_client_ground,
    };
    return vd_success();
}

#elif defined(VEDUTA_REMOTE_LIBRARY)

#include <dlfcn.h>
#include <veduta/context.h>

vd_status vd_remote_module_open(const char *purpose, vd_remote_module *out) {
    /* The program's own folders come first: its run path names them. */
    void *library = dlopen(VEDUTA_REMOTE_LIBRARY, RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) {
        return vd_failure(VD_ERROR_UNSUPPORTED,
                          "cannot %.160s without protobuf-c, zstd, libwebp, libjpeg and "
                          "libwebsockets, and %s does "
                          "not load (%.100s); install veduta-remote and these",
                          purpose, VEDUTA_REMOTE_LIBRARY, dlerror());
    }
    vd_remote_module made;
    const struct {
        const char *name;
        void *function; /* where the address goes */
    } symbols[] = {
        {"vd_codec_name", &made.codec_name},
        {"vd_codec_bound", &made.codec_bound},
        {"vd_coder_create", &made.coder_create},
        {"vd_coder_destroy", &made.coder_destroy},
        {"vd_coder_encode", &made.encode},
        {"vd_coder_decode", &made.decode},
        {"vd_wire_create", &made.wire_create},
        {"vd_wire_destroy", &made.wire_destroy},
        {"vd_wire_decode", &made.wire_decode},
        {"vd_wire_kind_name", &made.wire_kind_name},
        {"vd_server_def_default", &made.server_def_default},
        {"vd_server_create", &made.server_create},
        {"vd_server_destroy", &made.server_destroy},
        {"vd_server_port", &made.server_port},
        {"vd_server_has_page", &made.server_has_page},
        {"vd_server_listen", &made.server_listen},
        {"vd_server_render", &made.server_render},
        {"vd_server_stop", &made.server_stop},
        {"vd_client_def_default", &made.client_def_default},
        {"vd_client_state_name", &made.client_state_name},
        {"vd_client_create", &made.client_create},
        {"vd_client_destroy", &made.client_destroy},
        {"vd_client_look", &made.client_look},
        {"vd_client_set", &made.client_set},
        {"vd_client_cut", &made.client_cut},
        {"vd_client_draw", &made.client_draw},
        {"vd_client_get_news", &made.client_get_news},
        {"vd_client_get_world", &made.client_get_world},
        {"vd_client_ground", &made.client_ground},
    };
    for (size_t i = 0; i < sizeof symbols / sizeof symbols[0]; i++) {
        void *address = dlsym(library, symbols[i].name);
        if (address == NULL) {
            return vd_failure(VD_ERROR_UNSUPPORTED,
                              "cannot %.160s: %s lacks %s; install the veduta-remote of version %s",
                              purpose, VEDUTA_REMOTE_LIBRARY, symbols[i].name, vd_version());
        }
        memcpy(symbols[i].function, &address, sizeof address);
    }
    *out = made;
    return vd_success();
}

#else

vd_status vd_remote_module_open(const char *purpose, vd_remote_module *out) {
    (void)out;
    return vd_failure(VD_ERROR_UNSUPPORTED,
                      "cannot %.200s: this veduta was built without protobuf-c, zstd, libwebp and "
                      "libjpeg; build with VEDUTA_REMOTE=ON",
                      purpose);
}

#endif
