/* depth_file.c: depth and id planes into files.
 *
 * A frame's depth is reversed and relative to the camera; files carry the distance along the view
 * axis in metres, with +infinity where there is nothing.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "core/core.h"
#include "core/file.h"
#include "image/depth_exr.h"
#include "image/image.h"

void vd_distance_row(const vd_distance_source *source, int y, float *out) {
    const float *depth = source->frame->depth + (size_t)y * source->frame->stride;
    for (int x = 0; x < source->frame->width; x++) {
        const double d = (double)depth[x];
        if (!(d > 0.0)) { /* also NaN */
            out[x] = INFINITY;
        } else if (source->far_m > 0.0) {
            out[x] = (float)(source->far_m * (1.0 - d));
        } else {
            out[x] = (float)(source->near_m / d);
        }
    }
}

/* ---- PFM ----------------------------------------------------------------------------------- */

/* Portable float map (P. Debevec's): bottom row first; a negative scale says little-endian. */
static vd_status write_pfm(const vd_distance_source *source, const char *path) {
    const vd_frame *frame = source->frame;
    vd_context *context = frame->context;
    const size_t width = (size_t)frame->width;
    float *row = vd_allocate(context, width, sizeof *row);
    if (!row) {
        return vd_out_of_memory("a row of depth", width * sizeof *row);
    }
    vd_file file;
    vd_status status = vd_file_create(context, path, &file);
    if (status.code == VD_OK) {
        char header[64];
        const int length =
            snprintf(header, sizeof header, "Pf\n%d %d\n-1.0\n", frame->width, frame->height);
        vd_file_write(&file, header, (size_t)length);
        for (int y = frame->height - 1; y >= 0; y--) {
            vd_distance_row(source, y, row);
            for (size_t x = 0; x < width; x++) {
                uint32_t bits;
                memcpy(&bits, &row[x], sizeof bits);
                const uint8_t bytes[4] = {(uint8_t)bits, (uint8_t)(bits >> 8),
                                          (uint8_t)(bits >> 16), (uint8_t)(bits >> 24)};
                memcpy(&row[x], bytes, sizeof bytes);
            }
            vd_file_write(&file, row, width * sizeof *row);
        }
        status = vd_file_commit(&file);
    }
    vd_release(context, row);
    return status;
}

/* ---- PNG ----------------------------------------------------------------------------------- */

typedef struct grey_source {
    const vd_distance_source *distances;
    double nearest;
    float *row;
} grey_source;

static void grey_row(const void *user, int y, void *row) {
    const grey_source *source = user;
    uint16_t *out = row;
    vd_distance_row(source->distances, y, source->row);
    for (int x = 0; x < source->distances->frame->width; x++) {
        const double distance = (double)source->row[x];
        double value = 0.0;
        if (distance <= source->nearest) {
            value = 65535.0;
        } else if (isfinite(distance)) {
            value = floor(65535.0 * source->nearest / distance + 0.5);
            value = value > 1.0 ? value : 1.0; /* 0 is kept for nothing */
        }
        out[x] = (uint16_t)value;
    }
}

/* Returns the smallest distance above 0, infinity when there is none. */
static double find_nearest(const vd_distance_source *source, float *row) {
    float nearest = INFINITY;
    for (int y = 0; y < source->frame->height; y++) {
        vd_distance_row(source, y, row);
        for (int x = 0; x < source->frame->width; x++) {
            nearest = row[x] > 0.0f && row[x] < nearest ? row[x] : nearest;
        }
    }
    return (double)nearest;
}

/* Prints metres to the nanometre with a point, whatever the locale. */
static void print_metres(double metres, char *out, size_t out_bytes) {
    if (!isfinite(metres)) {
        snprintf(out, out_bytes, "inf");
    } else if (metres < 1e9) {
        const unsigned long long nanometres = (unsigned long long)(metres * 1e9 + 0.5);
        snprintf(out, out_bytes, "%llu.%09llu", nanometres / 1000000000, nanometres % 1000000000);
    } else {
        snprintf(out, out_bytes, "%.0f", metres);
    }
}

static vd_status write_grey(const vd_distance_source *source, const char *path) {
    const vd_frame *frame = source->frame;
    float *row = vd_allocate(frame->context, (size_t)frame->width, sizeof *row);
    if (!row) {
        return vd_out_of_memory("a row of depth", (size_t)frame->width * sizeof *row);
    }
    const grey_source grey = {source, find_nearest(source, row), row};
    char metres[352];
    print_metres(grey.nearest, metres, sizeof metres);
    const vd_picture_text text = {"veduta:nearest_m", metres};
    vd_png_def def = vd_png_def_default();
    def.text = &text;
    def.text_count = 1;
    const vd_png_source png = {frame->context, frame->width, frame->height, 1, 16, grey_row, &grey};
    const vd_status status = vd_png_write(&png, path, &def);
    vd_release(frame->context, row);
    return status;
}

/* ---- choosing ------------------------------------------------------------------------------ */

static bool ends_with(const char *path, const char *ending) {
    const size_t length = strlen(path), ending_length = strlen(ending);
    return length > ending_length && strcasecmp(path + length - ending_length, ending) == 0;
}

vd_status vd_frame_save_depth(const vd_frame *frame, double near_m, double far_m,
                              const char *path) {
    if (!frame->depth) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "cannot write %s: the frame has no depth; create it with VD_PLANE_DEPTH",
                          path);
    }
    if (!isfinite(near_m) || !isfinite(far_m) || far_m < 0.0 || (far_m == 0.0 && near_m <= 0.0)) {
        return vd_failure(
            VD_ERROR_ARGUMENT,
            "cannot write %s: depth with near %g m and far %g m has no distances; give "
            "the camera's",
            path, near_m, far_m);
    }
    const vd_distance_source source = {frame, near_m, far_m};
    if (ends_with(path, ".pfm")) {
        return write_pfm(&source, path);
    }
    if (ends_with(path, ".exr")) {
        return vd_exr_write(&source, path);
    }
    if (ends_with(path, ".png")) {
        return write_grey(&source, path);
    }
    return vd_failure(VD_ERROR_ARGUMENT,
                      "cannot write %s: depth files end in .exr, .pfm or .png; rename it", path);
}

/* ---- ids ----------------------------------------------------------------------------------- */

static void id_row(const void *user, int y, void *row) {
    const vd_frame *frame = user;
    const uint32_t *in = frame->id + (size_t)y * frame->stride;
    uint16_t *out = row;
    for (int x = 0; x < frame->width; x++) {
        out[x] = (uint16_t)in[x];
    }
}

static vd_status check_ids(const vd_frame *frame, const char *path) {
    if (!frame->id) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "cannot write %s: the frame has no ids; create it with VD_PLANE_ID",
                          path);
    }
    for (int y = 0; y < frame->height; y++) {
        const uint32_t *row = frame->id + (size_t)y * frame->stride;
        for (int x = 0; x < frame->width; x++) {
            if (row[x] > 65535) {
                return vd_failure(VD_ERROR_LIMIT,
                                  "cannot write %s: pixel %d, %d has the id %u, but the file holds "
                                  "ids up to 65535; draw fewer objects",
                                  path, x, y, row[x]);
            }
        }
    }
    return vd_success();
}

/* What a PNG keeps of one object: its frame id and its own. */
typedef struct id_text {
    char keyword[32], value[32];
} id_text;

vd_status vd_frame_save_ids(const vd_frame *frame, const char *path) {
    vd_status status = check_ids(frame, path);
    if (status.code != VD_OK) {
        return status;
    }
    const size_t count = (size_t)frame->object_count - 1;
    id_text *entries = vd_allocate(frame->context, count, sizeof *entries);
    vd_picture_text *text = vd_allocate(frame->context, count, sizeof *text);
    if (entries == NULL || text == NULL) {
        status = vd_out_of_memory("the objects' names", count * sizeof *entries);
    }
    for (size_t i = 0; i < count && status.code == VD_OK; i++) {
        snprintf(entries[i].keyword, sizeof entries[i].keyword, "veduta:id %zu", i + 1);
        snprintf(entries[i].value, sizeof entries[i].value, "%llu",
                 (unsigned long long)frame->object_ids[i + 1]);
        text[i].keyword = entries[i].keyword;
        text[i].text = entries[i].value;
    }
    if (status.code == VD_OK) {
        vd_png_def def = vd_png_def_default();
        def.text = text;
        def.text_count = (int)count;
        const vd_png_source png = {frame->context, frame->width, frame->height, 1, 16,
                                   id_row,         frame};
        status = vd_png_write(&png, path, &def);
    }
    vd_release(frame->context, text);
    vd_release(frame->context, entries);
    return status;
}
