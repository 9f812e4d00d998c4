/* picture.c: pictures in memory, and which reader a file belongs to. */
#include <veduta/picture.h>

#include <string.h>

#include "core/core.h"
#include "core/file.h"
#include "image/image.h"

/* The largest picture of VD_MAX_PIXELS takes 4 GiB; compressed files are far smaller. */
#define FILE_LIMIT_BYTES ((size_t)2 << 30)

vd_status vd_check_file_size(const char *name, uint64_t width, uint64_t height) {
    if (width == 0 || height == 0) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %s: its header says %llu × %llu pixels; get the file again",
                          name, (unsigned long long)width, (unsigned long long)height);
    }
    if (width > VD_MAX_SIDE || height > VD_MAX_SIDE || width * height > VD_MAX_PIXELS) {
        return vd_failure(
            VD_ERROR_LIMIT,
            "cannot read %s: %llu × %llu pixels exceed the limit of %d a side and %zu "
            "in all; crop or shrink it first",
            name, (unsigned long long)width, (unsigned long long)height, VD_MAX_SIDE,
            VD_MAX_PIXELS);
    }
    return vd_success();
}

vd_status vd_picture_create(vd_context *context, int width, int height, int channels, int bits,
                            vd_picture **out) {
    vd_status status = vd_check_size("a picture", width, height);
    if (status.code != VD_OK) {
        return status;
    }
    if (channels < 1 || channels > 4) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "a picture of %d channels is not possible; give 1 to 4", channels);
    }
    if (bits != 8 && bits != 16) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "a picture of %d bits a channel is not possible; give 8 or 16", bits);
    }
    vd_picture *picture = vd_allocate_zero(context, 1, sizeof *picture);
    if (!picture) {
        return vd_out_of_memory("a picture", sizeof *picture);
    }
    const size_t bytes = (size_t)bits / 8;
    picture->context = context;
    picture->width = width;
    picture->height = height;
    picture->channels = channels;
    picture->bits = bits;
    picture->stride_bytes = vd_row_stride((size_t)width * (size_t)channels, bytes) * bytes;
    picture->data = vd_allocate(context, (size_t)height, picture->stride_bytes);
    if (!picture->data) {
        status = vd_out_of_memory("a picture", (size_t)height * picture->stride_bytes);
        vd_picture_destroy(&picture);
        return status;
    }
    *out = picture;
    return vd_success();
}

void vd_picture_destroy(vd_picture **picture) {
    if (!picture || !*picture) {
        return;
    }
    vd_context *context = (*picture)->context;
    vd_release(context, (*picture)->data);
    vd_release(context, *picture);
    *picture = NULL;
}

vd_status vd_picture_decode(vd_context *context, const void *data, size_t size_bytes,
                            const char *name, vd_picture **out) {
    if (vd_png_matches(data, size_bytes)) {
        return vd_png_decode(context, data, size_bytes, name, out);
    }
    if (vd_pnm_matches(data, size_bytes)) {
        return vd_pnm_decode(context, data, size_bytes, name, out);
    }
    if (vd_jpeg_matches(data, size_bytes)) {
        return vd_jpeg_decode(context, data, size_bytes, name, out);
    }
    if (size_bytes == 0) {
        return vd_failure(VD_ERROR_FORMAT, "cannot read %s: it is empty; get the file again", name);
    }
    return vd_failure(
        VD_ERROR_FORMAT,
        "cannot read %s: it is neither PNG nor PGM nor PPM nor JPEG; convert it to PNG first",
        name);
}

vd_status vd_picture_load(vd_context *context, const char *path, vd_picture **out) {
    void *data = NULL;
    size_t size_bytes = 0;
    vd_status status = vd_file_read(context, path, FILE_LIMIT_BYTES, &data, &size_bytes);
    if (status.code != VD_OK) {
        return status;
    }
    const char *name = strcmp(path, "-") == 0 ? "standard input" : path;
    status = vd_picture_decode(context, data, size_bytes, name, out);
    vd_release(context, data);
    return status;
}

vd_rgba8 vd_picture_color(const vd_picture *picture, int x, int y) {
    const size_t first = (size_t)x * (size_t)picture->channels;
    uint8_t v[4] = {0, 0, 0, 255};
    for (int c = 0; c < picture->channels; c++) {
        if (picture->bits == 16) {
            const uint16_t *row = vd_picture_row(picture, y);
            v[c] = vd_round_16_to_8(row[first + (size_t)c]);
        } else {
            const uint8_t *row = vd_picture_row(picture, y);
            v[c] = row[first + (size_t)c];
        }
    }
    if (picture->channels <= 2) {
        vd_rgba8 grey = {v[0], v[0], v[0], picture->channels == 2 ? v[1] : 255};
        return grey;
    }
    vd_rgba8 color = {v[0], v[1], v[2], v[3]};
    return color;
}
