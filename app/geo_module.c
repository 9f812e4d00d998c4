/* geo_module.c: finding veduta-io. */
#include "geo_module.h"

#include <string.h>

#if defined(VEDUTA_IO_LINKED)

vd_status vd_geo_module_open(const char *purpose, vd_geo_module *out) {
    (void)purpose;
    *out = (vd_geo_module){
        .def_default = vd_geo_def_default,
        .load_dem = vd_geo_load_dem,
        .load_color = vd_geo_load_color,
        .features_def_default = vd_geo_features_def_default,
        .load_features = vd_geo_load_features,
        .features_destroy = vd_features_destroy,
        .from_lonlat = vd_geo_from_lonlat,
        .to_lonlat = vd_geo_to_lonlat,
        .describe = vd_geo_describe,
    };
    return vd_success();
}

#elif defined(VEDUTA_IO_LIBRARY)

#include <dlfcn.h>

vd_status vd_geo_module_open(const char *purpose, vd_geo_module *out) {
    /* The program's own folders come first: its run path names them. */
    void *library = dlopen(VEDUTA_IO_LIBRARY, RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) {
        return vd_failure(VD_ERROR_UNSUPPORTED,
                          "cannot %.160s without GDAL, and %s does not load (%.100s); install "
                          "veduta-io and GDAL",
                          purpose, VEDUTA_IO_LIBRARY, dlerror());
    }
    vd_geo_module made;
    const struct {
        const char *name;
        void *function; /* where the address goes */
    } symbols[] = {
        {"vd_geo_def_default", &made.def_default},
        {"vd_geo_load_dem", &made.load_dem},
        {"vd_geo_load_color", &made.load_color},
        {"vd_geo_from_lonlat", &made.from_lonlat},
        {"vd_geo_to_lonlat", &made.to_lonlat},
        {"vd_geo_describe", &made.describe},
        {"vd_geo_features_def_default", &made.features_def_default},
        {"vd_geo_load_features", &made.load_features},
        {"vd_features_destroy", &made.features_destroy},
    };
    for (size_t i = 0; i < sizeof symbols / sizeof symbols[0]; i++) {
        void *address = dlsym(library, symbols[i].name);
        if (address == NULL) {
            return vd_failure(VD_ERROR_UNSUPPORTED,
                              "cannot %.160s: %s lacks %s; install the veduta-io of version %s",
                              purpose, VEDUTA_IO_LIBRARY, symbols[i].name, vd_version());
        }
        memcpy(symbols[i].function, &address, sizeof address);
    }
    *out = made;
    return vd_success();
}

#else

vd_status vd_geo_module_open(const char *purpose, vd_geo_module *out) {
    (void)out;
    return vd_failure(VD_ERROR_UNSUPPORTED,
                      "cannot %.200s: this veduta was built without GDAL and reads PNG, PGM, .hgt, "
                      "ESRI ASCII and raw only; convert the file or build with VEDUTA_GEO=ON",
                      purpose);
}

#endif
