/* text_module.c: finding veduta-text. */
#include "text_module.h"

#include <string.h>

#if defined(VEDUTA_TEXT_LINKED)

vd_status vd_text_module_open(const char *purpose, vd_text_module *out) {
    (void)purpose;
    *out = (vd_text_module){
        .create = vd_font_create,
        .find = vd_font_find,
        .destroy = vd_font_destroy,
        .path = vd_font_path,
        .family = vd_font_family,
        .outline = vd_font_outline,
    };
    return vd_success();
}

#elif defined(VEDUTA_TEXT_LIBRARY)

#include <dlfcn.h>
#include <veduta/context.h>

vd_status vd_text_module_open(const char *purpose, vd_text_module *out) {
    /* The program's own folders come first: its run path names them. */
    void *library = dlopen(VEDUTA_TEXT_LIBRARY, RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) {
        return vd_failure(VD_ERROR_UNSUPPORTED,
                          "cannot %.160s without FreeType and HarfBuzz, and %s does not load "
                          "(%.100s); install veduta-text, FreeType and HarfBuzz",
                          purpose, VEDUTA_TEXT_LIBRARY, dlerror());
    }
    vd_text_module made;
    const struct {
        const char *name;
        void *function; /* where the address goes */
    } symbols[] = {
        {"vd_font_create", &made.create},   {"vd_font_find", &made.find},
        {"vd_font_destroy", &made.destroy}, {"vd_font_path", &made.path},
        {"vd_font_family", &made.family},   {"vd_font_outline", &made.outline},
    };
    for (size_t i = 0; i < sizeof symbols / sizeof symbols[0]; i++) {
        void *address = dlsym(library, symbols[i].name);
        if (address == NULL) {
            return vd_failure(VD_ERROR_UNSUPPORTED,
                              "cannot %.160s: %s lacks %s; install the veduta-text of version %s",
                              purpose, VEDUTA_TEXT_LIBRARY, symbols[i].name, vd_version());
        }
        memcpy(symbols[i].function, &address, sizeof address);
    }
    *out = made;
    return vd_success();
}

#else

vd_status vd_text_module_open(const char *purpose, vd_text_module *out) {
    (void)out;
    return vd_failure(VD_ERROR_UNSUPPORTED,
                      "cannot %.200s: this veduta was built without FreeType and HarfBuzz; build "
                      "with VEDUTA_TEXT=ON",
                      purpose);
}

#endif
