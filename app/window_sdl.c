/* window_sdl.c: finding SDL2. */
#if defined(VEDUTA_SDL_LIBRARY)

#include "window_sdl.h"

#include <dlfcn.h>
#include <string.h>

vd_status vd_sdl_open(vd_sdl *out) {
    void *library = dlopen(VEDUTA_SDL_LIBRARY, RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) {
        return vd_failure(VD_ERROR_UNSUPPORTED,
                          "cannot open a window: SDL2 does not load (%.160s); install it "
                          "(libsdl2-2.0-0), or draw pictures with `veduta render`",
                          dlerror());
    }
    vd_sdl made;
    const char *missing = NULL;
    void *address;
    /* POSIX lets an object pointer hold a function's address; C wants it copied. */
#define VD_SDL_FIND(name)                                                                          \
    address = dlsym(library, "SDL_" #name);                                                        \
    missing = address == NULL ? "SDL_" #name : missing;                                            \
    memcpy(&made.name, &address, sizeof address);
    VD_SDL_FUNCTIONS(VD_SDL_FIND)
#undef VD_SDL_FIND
    if (missing != NULL) {
        return vd_failure(VD_ERROR_UNSUPPORTED,
                          "cannot open a window: %s lacks %s; install a newer SDL2",
                          VEDUTA_SDL_LIBRARY, missing);
    }
    *out = made;
    return vd_success();
}

#else

typedef int vd_window_without_sdl; /* a translation unit holds something */

#endif
