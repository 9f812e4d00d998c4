/* snapshot_module.c: finding veduta-snapshot. */
#include "snapshot_module.h"

#if defined(VEDUTA_SNAPSHOT_LINKED)

vd_status vd_snapshot_module_open(vd_context *context, const char *path, const vd_snapshot_def *def,
                                  vd_particle_source **out) {
    return vd_snapshot_open(context, path, def, out);
}

#elif defined(VEDUTA_SNAPSHOT_LIBRARY)

#include <dlfcn.h>
#include <string.h>

vd_status vd_snapshot_module_open(vd_context *context, const char *path, const vd_snapshot_def *def,
                                  vd_particle_source **out) {
    /* The program's own folders come first: its run path names them. */
    void *library = dlopen(VEDUTA_SNAPSHOT_LIBRARY, RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) {
        return vd_failure(VD_ERROR_UNSUPPORTED,
                          "cannot read %.160s without HDF5, and %s does not load (%.100s); install "
                          "veduta-snapshot and HDF5",
                          path, VEDUTA_SNAPSHOT_LIBRARY, dlerror());
    }
    vd_status (*open)(vd_context *, const char *, const vd_snapshot_def *, vd_particle_source **);
    void *address = dlsym(library, "vd_snapshot_open");
    if (address == NULL) {
        return vd_failure(VD_ERROR_UNSUPPORTED,
                          "cannot read %.160s: %s lacks vd_snapshot_open; install the "
                          "veduta-snapshot of version %s",
                          path, VEDUTA_SNAPSHOT_LIBRARY, vd_version());
    }
    memcpy(&open, &address, sizeof open);
    return open(context, path, def, out);
}

#else

vd_status vd_snapshot_module_open(vd_context *context, const char *path, const vd_snapshot_def *def,
                                  vd_particle_source **out) {
    (void)context;
    (void)def;
    (void)out;
    return vd_failure(VD_ERROR_UNSUPPORTED,
                      "cannot read %.200s: it is HDF5, and this veduta was built without; build "
                      "with VEDUTA_HDF5=ON",
                      path);
}

#endif
