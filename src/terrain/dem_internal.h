/* dem_internal.h: what the readers of elevation files share. */
#ifndef VEDUTA_TERRAIN_DEM_INTERNAL_H
#define VEDUTA_TERRAIN_DEM_INTERNAL_H

#include <float.h>
#include <math.h>
#include <veduta/dem.h>

/* How a stored value becomes a height: missing when it equals a nodata value, else scaled. */
typedef struct vd_dem_rule {
    double scale, offset_m;
    double nodata[2]; /* the caller's and the file's own; NaN: none */
    bool as_float;    /* compare nodata as floats: the file's values are no more exact than that */
} vd_dem_rule;

static inline vd_dem_rule vd_dem_rule_make(const vd_dem_def *def) {
    vd_dem_rule rule = {.scale = def->height_scale == 0.0 ? 1.0 : def->height_scale,
                        .offset_m = def->height_offset_m,
                        .nodata = {def->has_nodata ? def->nodata : (double)NAN, (double)NAN},
                        .as_float = false};
    return rule;
}

static inline float vd_dem_rule_height(const vd_dem_rule *rule, double stored) {
    for (int i = 0; i < 2; i++) {
        double nodata = rule->nodata[i];
        if (stored == nodata || (rule->as_float && (float)stored == (float)nodata)) {
            return NAN;
        }
    }
    double height = stored * rule->scale + rule->offset_m;
    return fabs(height) <= (double)FLT_MAX ? (float)height : NAN; /* NaN fails the comparison */
}

/* The file formats of the core. */
typedef enum vd_dem_format {
    VD_DEM_UNKNOWN = 0,
    VD_DEM_HGT,
    VD_DEM_ASCII,
    VD_DEM_PICTURE,
    VD_DEM_RAW
} vd_dem_format;

/* Bytes from a file's beginning that are enough to tell its format. */
#define VD_DEM_PEEK_BYTES 512

/* Tells the format by name and first bytes; `def` only says whether the file is raw. */
vd_dem_format vd_dem_recognize(const void *head, size_t size_bytes, const char *name,
                               const vd_dem_def *def);

/* vd_dem_create for a reader: failures name the file. */
VD_MUST_USE vd_status vd_dem_create_for(vd_context *context, const char *name, int width,
                                        int height, vd_dem **out);

/* The readers. `def` is complete and checked; *out is written only on success, with range. */
VD_MUST_USE vd_status vd_dem_decode_hgt(vd_context *context, const void *data, size_t size_bytes,
                                        const char *name, const vd_dem_def *def, vd_dem **out);
VD_MUST_USE vd_status vd_dem_decode_ascii(vd_context *context, const void *data, size_t size_bytes,
                                          const char *name, const vd_dem_def *def, vd_dem **out);
VD_MUST_USE vd_status vd_dem_decode_picture(vd_context *context, const void *data,
                                            size_t size_bytes, const char *name,
                                            const vd_dem_def *def, vd_dem **out);
VD_MUST_USE vd_status vd_dem_decode_raw(vd_context *context, const void *data, size_t size_bytes,
                                        const char *name, const vd_dem_def *def, vd_dem **out);

#endif
