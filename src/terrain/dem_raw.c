/* dem_raw.c: heights without any header; the caller says size, type and byte order. */
#include <stdio.h>
#include <string.h>
#include "terrain/dem_internal.h"

typedef enum raw_kind { RAW_UNSIGNED, RAW_SIGNED, RAW_REAL } raw_kind;

typedef struct raw_type {
    const char *key, *name;
    int bytes;
    raw_kind kind;
} raw_type;

static const raw_type types[] = {
    {"u8", "uint8", 1, RAW_UNSIGNED},   {"i16", "int16", 2, RAW_SIGNED},
    {"u16", "uint16", 2, RAW_UNSIGNED}, {"i32", "int32", 4, RAW_SIGNED},
    {"f32", "float32", 4, RAW_REAL},    {"f64", "float64", 8, RAW_REAL},
};

static const raw_type *find_type(const char key[8]) {
    for (size_t i = 0; i < sizeof types / sizeof types[0]; i++) {
        if (strncmp(types[i].key, key, 8) == 0) {
            return &types[i];
        }
    }
    return NULL;
}

/* Reads one value, whatever the byte orders of file and machine. */
static double read_value(const uint8_t *p, const raw_type *type, bool big_endian) {
    uint64_t bits = 0;
    for (int i = 0; i < type->bytes; i++) {
        bits = bits << 8 | p[big_endian ? i : type->bytes - 1 - i];
    }
    if (type->kind == RAW_REAL && type->bytes == 8) {
        double value;
        memcpy(&value, &bits, sizeof value);
        return value;
    }
    if (type->kind == RAW_REAL) {
        uint32_t bits32 = (uint32_t)bits;
        float value;
        memcpy(&value, &bits32, sizeof value);
        return value;
    }
    uint64_t sign = (uint64_t)1 << (type->bytes * 8 - 1);
    double value = (double)bits;
    return type->kind == RAW_SIGNED && (bits & sign) ? value - 2.0 * (double)sign : value;
}

static vd_status check_size(size_t size_bytes, const char *name, const vd_dem_def *def,
                            const raw_type *type) {
    if (def->raw_width < 1 || def->raw_height < 1) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "cannot read %s: the raw size %d × %d must be at least 1 × 1", name,
                          def->raw_width, def->raw_height);
    }
    if (!type) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "cannot read %s: the raw type must be u8, i16, u16, i32, f32 or f64",
                          name);
    }
    uint64_t expected =
        (uint64_t)def->raw_width * (uint64_t)def->raw_height * (uint64_t)type->bytes;
    if (size_bytes < def->raw_offset_bytes || size_bytes - def->raw_offset_bytes != expected) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %s: %d × %d values of type %s after %zu bytes make %llu "
                          "bytes, the file has %zu; check size, type and offset",
                          name, def->raw_width, def->raw_height, type->key, def->raw_offset_bytes,
                          (unsigned long long)(expected + def->raw_offset_bytes), size_bytes);
    }
    return vd_success();
}

vd_status vd_dem_decode_raw(vd_context *context, const void *data, size_t size_bytes,
                            const char *name, const vd_dem_def *def, vd_dem **out) {
    const raw_type *type = find_type(def->raw_type);
    vd_status status = check_size(size_bytes, name, def, type);
    if (status.code != VD_OK) {
        return status;
    }
    vd_dem *dem = NULL;
    status = vd_dem_create_for(context, name, def->raw_width, def->raw_height, &dem);
    if (status.code != VD_OK) {
        return status;
    }
    vd_dem_rule rule = vd_dem_rule_make(def);
    rule.as_float = type->kind == RAW_REAL && type->bytes == 4;
    const uint8_t *stored = (const uint8_t *)data + def->raw_offset_bytes;
    for (int row = 0; row < dem->height; row++) {
        float *heights = dem->heights + (size_t)row * dem->stride;
        for (int column = 0; column < dem->width; column++, stored += type->bytes) {
            double value = read_value(stored, type, def->raw_big_endian);
            heights[column] = vd_dem_rule_height(&rule, value);
        }
    }
    double cell = def->cell_size_m > 0.0 ? def->cell_size_m : 1.0;
    dem->transform[1] = cell;
    dem->transform[5] = -cell;
    snprintf(dem->height_type, sizeof dem->height_type, "%s", type->name);
    vd_dem_update_range(dem);
    *out = dem;
    return vd_success();
}
