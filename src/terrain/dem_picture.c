/* dem_picture.c: heights kept in pictures, as grey levels or packed into red, green and blue. */
#include <stdio.h>
#include "terrain/dem_internal.h"

/* A pixel's channels as they stand in the file. */
static void read_pixel(const vd_picture *picture, int x, int y, uint32_t channels[4]) {
    const uint8_t *row = (const uint8_t *)picture->data + (size_t)y * picture->stride_bytes;
    for (int c = 0; c < picture->channels; c++) {
        size_t i = (size_t)x * (size_t)picture->channels + (size_t)c;
        channels[c] = picture->bits == 16 ? ((const uint16_t *)(const void *)row)[i] : row[i];
    }
}

static double stored_value(const uint32_t c[4], vd_height_encoding encoding) {
    switch (encoding) {
    case VD_ENCODING_RGB24:
        return c[0] * 65536.0 + c[1] * 256.0 + c[2];
    case VD_ENCODING_TERRARIUM:
        return c[0] * 256.0 + c[1] + c[2] / 256.0 - 32768.0;
    case VD_ENCODING_MAPBOX:
        return (c[0] * 65536.0 + c[1] * 256.0 + c[2]) / 10.0 - 10000.0;
    default:
        return c[0];
    }
}

static void fill_heights(const vd_picture *picture, const vd_dem_def *def, vd_dem *dem) {
    vd_dem_rule rule = vd_dem_rule_make(def);
    bool has_alpha = picture->channels == 2 || picture->channels == 4;
    for (int y = 0; y < dem->height; y++) {
        float *heights = dem->heights + (size_t)y * dem->stride;
        for (int x = 0; x < dem->width; x++) {
            uint32_t channels[4] = {0, 0, 0, 0};
            read_pixel(picture, x, y, channels);
            if (has_alpha && channels[picture->channels - 1] == 0) {
                continue; /* transparent: stays missing */
            }
            heights[x] = vd_dem_rule_height(&rule, stored_value(channels, def->encoding));
        }
    }
}

vd_status vd_dem_decode_picture(vd_context *context, const void *data, size_t size_bytes,
                                const char *name, const vd_dem_def *def, vd_dem **out) {
    vd_picture *picture = NULL;
    vd_dem *dem = NULL;
    vd_status status = vd_picture_decode(context, data, size_bytes, name, &picture);
    if (status.code != VD_OK) {
        return status;
    }
    if (def->encoding != VD_ENCODING_GREY && (picture->channels < 3 || picture->bits != 8)) {
        status =
            vd_failure(VD_ERROR_FORMAT,
                       "cannot read %s: heights packed into red, green and blue need an 8-bit "
                       "colour picture, this one has %d channel%s of %d bits; read it as grey",
                       name, picture->channels, picture->channels == 1 ? "" : "s", picture->bits);
        goto done;
    }
    status = vd_dem_create_for(context, name, picture->width, picture->height, &dem);
    if (status.code != VD_OK) {
        goto done;
    }
    fill_heights(picture, def, dem);
    double cell = def->cell_size_m > 0.0 ? def->cell_size_m : 1.0;
    dem->transform[1] = cell;
    dem->transform[5] = -cell;
    snprintf(dem->height_type, sizeof dem->height_type, "%s",
             def->encoding != VD_ENCODING_GREY ? "rgb24"
             : picture->bits == 16             ? "uint16"
                                               : "uint8");
    vd_dem_update_range(dem);
    *out = dem;
done:
    vd_picture_destroy(&picture);
    return status;
}
