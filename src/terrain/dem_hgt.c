/* dem_hgt.c: SRTM tiles (.hgt).
 *
 * A tile is one degree square of big-endian 16-bit metres, north-west sample first, without any
 * header: its name says where it lies, its size how fine it is. Samples are points: the outermost
 * ones lie exactly on the degree lines and are shared with the neighbouring tile.
 * (USGS, "SRTM Topography", SRTM_Topo.pdf, §2.1 and §3.)
 */
#include <string.h>
#include "core/core.h"
#include "terrain/dem_internal.h"

static const double void_height = -32768.0;

static bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

/* Reads "N45E006" at `p`: the tile's south-west corner in degrees. */
static bool corner_at(const char *p, int *latitude, int *longitude) {
    if (!p[0] || !strchr("nNsS", p[0]) || !is_digit(p[1]) || !is_digit(p[2]) || !p[3] ||
        !strchr("eEwW", p[3]) || !is_digit(p[4]) || !is_digit(p[5]) || !is_digit(p[6]) ||
        is_digit(p[7])) {
        return false;
    }
    int y = (p[1] - '0') * 10 + (p[2] - '0');
    int x = (p[4] - '0') * 100 + (p[5] - '0') * 10 + (p[6] - '0');
    *latitude = strchr("sS", p[0]) ? -y : y;
    *longitude = strchr("wW", p[3]) ? -x : x;
    return *latitude >= -90 && *latitude <= 89 && *longitude >= -180 && *longitude <= 179;
}

static bool corner_from_name(const char *name, int *latitude, int *longitude) {
    const char *slash = strrchr(name, '/');
    for (const char *p = slash ? slash + 1 : name; *p; p++) {
        if (corner_at(p, latitude, longitude)) {
            return true;
        }
    }
    return false;
}

/* The shapes that tiles come in: 3″, 1″, and 1″ with every other column dropped (north of 60°). */
static bool shape_from_size(size_t size_bytes, int *width, int *height) {
    static const int shapes[][2] = {{1201, 1201}, {3601, 3601}, {1801, 3601}};
    for (size_t i = 0; i < sizeof shapes / sizeof shapes[0]; i++) {
        if (size_bytes == (size_t)shapes[i][0] * (size_t)shapes[i][1] * 2) {
            *width = shapes[i][0];
            *height = shapes[i][1];
            return true;
        }
    }
    return false;
}

static int16_t big_endian_i16(const uint8_t *p) {
    uint32_t v = (uint32_t)p[0] << 8 | p[1];
    return (int16_t)(v < 0x8000u ? (int32_t)v : (int32_t)v - 0x10000);
}

vd_status vd_dem_decode_hgt(vd_context *context, const void *data, size_t size_bytes,
                            const char *name, const vd_dem_def *def, vd_dem **out) {
    int latitude, longitude, width, height;
    if (!corner_from_name(name, &latitude, &longitude)) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %s: a tile's name must give its south-west corner, such as "
                          "N45E006.hgt; rename the file",
                          name);
    }
    if (!shape_from_size(size_bytes, &width, &height)) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %s: it has %zu bytes, a tile of 1201 × 1201 samples has "
                          "2884802, 3601 × 3601 has 25934402, 1801 × 3601 has 12970802; get the "
                          "tile again, unpacked",
                          name, size_bytes);
    }
    vd_dem *dem = NULL;
    vd_status status = vd_dem_create_for(context, name, width, height, &dem);
    if (status.code != VD_OK) {
        return status;
    }
    vd_dem_rule rule = vd_dem_rule_make(def);
    rule.nodata[1] = void_height;
    const uint8_t *stored = data;
    for (int row = 0; row < height; row++) {
        float *heights = dem->heights + (size_t)row * dem->stride;
        for (int column = 0; column < width; column++, stored += 2) {
            heights[column] = vd_dem_rule_height(&rule, big_endian_i16(stored));
        }
    }
    dem->kind = VD_CRS_GEOGRAPHIC;
    dem->transform[0] = longitude;
    dem->transform[1] = 1.0 / (width - 1);
    dem->transform[3] = latitude + 1;
    dem->transform[5] = -1.0 / (height - 1);
    strcpy(dem->height_type, "int16");
    strcpy(dem->height_unit, "m");
    dem->crs = vd_copy_string(context, "EPSG:4326");
    if (!dem->crs) {
        vd_dem_destroy(&dem);
        return vd_out_of_memory("a coordinate system's name", sizeof "EPSG:4326");
    }
    vd_dem_update_range(dem);
    *out = dem;
    return vd_success();
}
