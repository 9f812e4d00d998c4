/* Fuzzes the elevation readers. The first byte chooses the name and with it the reader; the second
 * the encoding or the raw type. Whatever is read must be consistent and usable. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <veduta/heightfield.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check(const vd_dem *dem) {
    uint64_t missing = 0;
    for (int row = 0; row < dem->height; row++) {
        for (int column = 0; column < dem->width; column++) {
            float h = dem->heights[(size_t)row * dem->stride + (size_t)column];
            missing += isnan(h) ? 1 : 0;
            if (isinf(h) || h < dem->min || h > dem->max) {
                abort();
            }
        }
    }
    if (missing != dem->missing) {
        abort();
    }
}

static void use(vd_context *context, vd_dem *dem) {
    check(dem);
    vd_dem *joined = NULL;
    const vd_dem *parts[1] = {dem};
    if (vd_dem_mosaic(context, parts, 1, &joined).code == VD_OK) {
        check(joined);
        vd_dem_destroy(&joined);
    }
    if (vd_dem_fill(dem).code == VD_OK) {
        check(dem);
    }
    vd_heightfield *heightfield = NULL;
    if (vd_heightfield_from_dem(dem, NULL, NULL, &heightfield).code == VD_OK) {
        if (vd_heightfield_validate(heightfield, (size_t)heightfield->size_bytes).code != VD_OK) {
            abort();
        }
        vd_heightfield_destroy(context, &heightfield);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static const char *const names[] = {"x.asc", "x.png", "x.raw", "N45E006.hgt"};
    static const char *const types[] = {"u8", "i16", "u16", "i32", "f32", "f64", "?"};
    if (size < 3) {
        return 0;
    }
    const char *name = names[data[0] % 4];
    vd_dem_def def = vd_dem_def_default();
    def.encoding = (vd_height_encoding)(data[1] % VD_ENCODING_COUNT);
    def.has_nodata = (data[1] & 64) != 0;
    if (name[2] == 'r') {
        snprintf(def.raw_type, sizeof def.raw_type, "%s", types[data[1] % 7]);
        def.raw_width = 1 + data[2] % 16;
        def.raw_height = 1 + data[2] / 16;
        def.raw_big_endian = (data[1] & 128) != 0;
        def.raw_offset_bytes = 1;
        data++;
        size--;
    }
    vd_context_def context_def = vd_context_def_default();
    context_def.threads = 1;
    vd_context *context = NULL;
    if (vd_context_create(&context_def, &context).code != VD_OK) {
        return 0;
    }
    vd_dem *dem = NULL;
    vd_status status = vd_dem_decode(context, data + 2, size - 2, name, &def, &dem);
    if ((status.code == VD_OK) != (dem != NULL)) {
        abort();
    }
    /* Large pictures compress well: using them would take all the time. */
    if (dem && (size_t)dem->width * (size_t)dem->height < 100000) {
        use(context, dem);
    }
    vd_dem_destroy(&dem);
    vd_context_destroy(&context);
    return 0;
}
