/* source_las.c: LAS 1.0 to 1.4, point formats 0 to 10 (ASPRS 2019, LAS Specification 1.4-R15).
 *
 * Of a point we read where it is, its intensity, class, which return of its pulse it is, colours
 * and near infrared. Colours may be stored in 16 bits, as the specification says, or in 8, as many
 * programs do, or be there and all be zero: points from all over the file are looked at to tell. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "core/core.h"
#include "splat/source_input.h"

#define HEAD_BYTES 375

/* Where a point format has what; 0: it has not. */
typedef struct las_format {
    uint8_t bytes, class_at, rgb_at, nir_at, return_mask;
} las_format;

static const las_format formats[11] = {
    {20, 15, 0, 0, 7},    {28, 15, 0, 0, 7},  {26, 15, 20, 0, 7},   {34, 15, 28, 0, 7},
    {57, 15, 0, 0, 7},    {63, 15, 28, 0, 7}, {30, 16, 0, 0, 15},   {36, 16, 30, 0, 15},
    {38, 16, 30, 36, 15}, {59, 16, 0, 0, 15}, {67, 16, 30, 36, 15},
};

typedef struct las {
    vd_context *context;
    vd_input input;
    las_format format;
    int format_number;
    uint64_t begin, count, next;
    size_t stride;
    double scale[3], offset[3];
    float color_scale; /* to 0 … 255 */
    bool has_color;
} las;

static uint32_t u16(const uint8_t *p) {
    return (uint32_t)p[0] | (uint32_t)p[1] << 8;
}

static uint32_t u32(const uint8_t *p) {
    return u16(p) | u16(p + 2) << 16;
}

static vd_status las_read(void *user, vd_particle_batch *batch) {
    las *l = user;
    while (l->next < l->count && batch->count < batch->capacity) {
        vd_status status = vd_input_fill(&l->input, l->stride);
        if (status.code != VD_OK) {
            return status;
        }
        size_t records = (size_t)(l->input.end - l->input.at) / l->stride;
        const size_t room = batch->capacity - batch->count;
        records = records < room ? records : room;
        records = records < l->count - l->next ? records : (size_t)(l->count - l->next);
        if (records == 0) {
            return vd_failure(VD_ERROR_FORMAT,
                              "cannot read %.200s: it ends after %llu of %llu points; get the "
                              "whole file",
                              l->input.name, (unsigned long long)l->next,
                              (unsigned long long)l->count);
        }
        const uint8_t *p = l->input.at;
        const las_format f = l->format;
        for (size_t r = 0; r < records; r++, p += l->stride) {
            const size_t i = batch->count++;
            batch->x[i] = l->scale[0] * (int32_t)u32(p) + l->offset[0];
            batch->y[i] = l->scale[1] * (int32_t)u32(p + 4) + l->offset[1];
            batch->z[i] = l->scale[2] * (int32_t)u32(p + 8) + l->offset[2];
            batch->values[0][i] = (float)u16(p + 12);
            batch->values[1][i] = (float)(f.return_mask == 7 ? p[15] & 31 : p[f.class_at]);
            batch->values[2][i] = (float)(p[14] & f.return_mask);
            int a = 3;
            for (int c = 0; c < 3 && l->has_color; c++) {
                batch->values[a++][i] = (float)u16(p + f.rgb_at + 2 * c) * l->color_scale;
            }
            if (f.nir_at != 0) {
                batch->values[a][i] = (float)u16(p + f.nir_at);
            }
        }
        l->input.at = p;
        l->next += records;
    }
    return vd_success();
}

static vd_status las_rewind(void *user) {
    las *l = user;
    l->next = 0;
    vd_input_seek(&l->input, l->begin);
    return vd_success();
}

static double las_progress(void *user) {
    const las *l = user;
    return l->count == 0 ? 1.0 : (double)l->next / (double)l->count;
}

static void las_close(void *user) {
    las *l = user;
    vd_input_close(&l->input);
    vd_release(l->context, l);
}

static const vd_particle_reader reader = {las_read, las_rewind, las_progress, las_close};

static vd_status bad(const las *l, const char *what) {
    return vd_failure(VD_ERROR_FORMAT, "cannot read %.200s: %s; get the whole file again",
                      l->input.name, what);
}

static vd_status check_version(const las *l, const uint8_t *head) {
    if (head[24] != 1 || head[25] > 4) {
        return vd_failure(VD_ERROR_UNSUPPORTED,
                          "cannot read %.200s: LAS %d.%d is not known; convert it to LAS 1.4, for "
                          "instance with `las2las`",
                          l->input.name, head[24], head[25]);
    }
    if ((head[104] & 0xC0) != 0) {
        return vd_failure(VD_ERROR_UNSUPPORTED,
                          "cannot read %.200s: it is LAZ, which is compressed; convert it with "
                          "`laszip -i IN.laz -o OUT.las` or `pdal translate IN.laz OUT.las`",
                          l->input.name);
    }
    if (head[104] > 10) {
        return vd_failure(VD_ERROR_UNSUPPORTED,
                          "cannot read %.200s: its points are of format %d, and 0 to 10 are known; "
                          "convert it with `las2las`",
                          l->input.name, head[104]);
    }
    return vd_success();
}

static vd_status read_head(las *l) {
    uint8_t head[HEAD_BYTES] = {0};
    const size_t got = vd_input_peek(&l->input, 0, head, sizeof head);
    if (got < 227) {
        return bad(l, "it ends within its header");
    }
    vd_status status = check_version(l, head);
    if (status.code != VD_OK) {
        return status;
    }
    l->format_number = head[104];
    l->format = formats[head[104]];
    l->begin = u32(head + 96);
    l->stride = u16(head + 105);
    l->count = u32(head + 107);
    if (head[25] >= 4 && u16(head + 94) >= HEAD_BYTES && got == HEAD_BYTES) {
        const uint64_t count = u32(head + 247) | (uint64_t)u32(head + 251) << 32;
        l->count = count != 0 ? count : l->count;
    }
    const bool swapped = vd_number_is_swapped(false);
    for (int i = 0; i < 3; i++) {
        l->scale[i] = vd_number_read(head + 131 + 8 * i, VD_NUMBER_F64, swapped);
        l->offset[i] = vd_number_read(head + 155 + 8 * i, VD_NUMBER_F64, swapped);
        if (!isfinite(l->scale[i]) || !isfinite(l->offset[i]) || l->scale[i] == 0.0) {
            return bad(l, "a scale or an offset of its coordinates is no number or 0");
        }
    }
    if (l->stride < l->format.bytes) {
        return bad(l, "its points are shorter than their format needs");
    }
    if (l->begin < 227 || l->begin > l->input.size_bytes) {
        return bad(l, "its points begin outside the file");
    }
    const uint64_t fit = (l->input.size_bytes - l->begin) / l->stride;
    if (l->count > fit) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %.200s: its header promises %llu points and the file ends "
                          "after %llu; get the whole file",
                          l->input.name, (unsigned long long)l->count, (unsigned long long)fit);
    }
    return vd_success();
}

/* Looks at up to 4096 points, 64 at each of 64 places, for how colours are stored. */
static void look_at_colors(las *l) {
    uint8_t block[64 * 256];
    uint32_t most = 0;
    const size_t rows = l->stride <= 256 ? 64 : 1;
    for (uint64_t k = 0; k < 64 && l->format.rgb_at != 0 && l->stride <= sizeof block; k++) {
        const uint64_t from = l->begin + l->count / 64 * k * l->stride;
        const size_t got = vd_input_peek(&l->input, from, block, rows * l->stride) / l->stride;
        for (size_t i = 0; i < got && k * (l->count / 64) + i < l->count; i++) {
            for (int c = 0; c < 3; c++) {
                const uint32_t v = u16(block + i * l->stride + l->format.rgb_at + 2 * c);
                most = v > most ? v : most;
            }
        }
    }
    l->has_color = most > 0;
    l->color_scale = most > 255 ? 1.0f / 257.0f : 1.0f;
    if (l->format.rgb_at != 0 && most == 0 && l->count > 0) {
        vd_log(l->context, VD_LOG_INFO, "the colours of %.200s are all black, so it has none",
               l->input.name);
    }
}

/* Finds the coordinate system among the variable-length records: a WKT, or a code of EPSG. */
static char *find_crs(las *l) {
    uint8_t head[HEAD_BYTES], record[54];
    (void)vd_input_peek(&l->input, 0, head, sizeof head);
    uint64_t at = u16(head + 94);
    const uint32_t records = u32(head + 100);
    char code[16] = "";
    for (uint32_t r = 0; r < records && r < 1000; r++) {
        if (vd_input_peek(&l->input, at, record, sizeof record) < sizeof record) {
            break;
        }
        const uint32_t id = u16(record + 18), bytes = u16(record + 20);
        const bool ours = memcmp(record + 2, "LASF_Projection", 15) == 0;
        if (ours && id == 2112) {
            char *wkt = vd_allocate_zero(l->context, bytes + 1u, 1);
            if (wkt != NULL) {
                (void)vd_input_peek(&l->input, at + 54, wkt, bytes);
            }
            return wkt;
        }
        for (uint32_t k = 8; ours && id == 34735 && k + 8 <= bytes; k += 8) {
            uint8_t key[8];
            if (vd_input_peek(&l->input, at + 54 + k, key, 8) == 8 && u16(key + 2) == 0 &&
                (u16(key) == 3072 || (u16(key) == 2048 && code[0] == '\0')) &&
                u16(key + 6) < 32767) {
                snprintf(code, sizeof code, "EPSG:%u", u16(key + 6));
            }
        }
        at += 54 + bytes;
    }
    return code[0] != '\0' ? vd_copy_string(l->context, code) : NULL;
}

vd_status vd_las_open(vd_context *context, const char *path, vd_input input,
                      vd_particle_source **out) {
    las *l = vd_allocate_zero(context, 1, sizeof *l);
    if (l == NULL) {
        vd_input_close(&input);
        return vd_out_of_memory(path, sizeof *l);
    }
    l->context = context;
    l->input = input;
    vd_status status = read_head(l);
    if (status.code != VD_OK) {
        las_close(l);
        return status;
    }
    look_at_colors(l);
    vd_particle_source *source;
    status = vd_particle_source_create(context, path, &reader, l, &source);
    if (status.code != VD_OK) {
        return status;
    }
    l->input.name = source->path;
    (void)las_rewind(l);
    uint8_t minor = 0;
    (void)vd_input_peek(&l->input, 25, &minor, 1);
    snprintf(source->format, sizeof source->format, "LAS 1.%d, points of format %d", minor,
             l->format_number);
    source->count = l->count;
    source->crs = find_crs(l);
    (void)vd_particle_source_add(source, "intensity", VD_ATTRIBUTE_SCALAR);
    (void)vd_particle_source_add(source, "class", VD_ATTRIBUTE_CATEGORY);
    (void)vd_particle_source_add(source, "return", VD_ATTRIBUTE_CATEGORY);
    if (l->has_color) {
        (void)vd_particle_source_add(source, "red", VD_ATTRIBUTE_CHANNEL);
        (void)vd_particle_source_add(source, "green", VD_ATTRIBUTE_CHANNEL);
        (void)vd_particle_source_add(source, "blue", VD_ATTRIBUTE_CHANNEL);
    }
    if (l->format.nir_at != 0) {
        (void)vd_particle_source_add(source, "near_infrared", VD_ATTRIBUTE_SCALAR);
    }
    *out = source;
    return vd_success();
}
