/* heightfield_block.c: layout, pyramid, range and checksum of a heightfield block. */
#define XXH_STATIC_LINKING_ONLY /* the hash's state on the stack, not from malloc */
#include <math.h>
#include <string.h>
#include <xxhash.h>
#include "core/core.h"
#include "terrain/heightfield_block.h"

size_t vd_height_bytes(uint32_t height_type) {
    return height_type == VD_HEIGHT_U8 ? 1 : height_type == VD_HEIGHT_U16 ? 2 : 4;
}

static uint64_t align_up(uint64_t bytes) {
    return (bytes + VD_HEIGHTFIELD_ALIGNMENT - 1) / VD_HEIGHTFIELD_ALIGNMENT *
           VD_HEIGHTFIELD_ALIGNMENT;
}

static bool side_fits(int32_t width, int32_t height) {
    return width >= 1 && height >= 1 && width <= VD_MAX_SIDE && height <= VD_MAX_SIDE &&
           (uint64_t)width * (uint64_t)height <= VD_MAX_PIXELS;
}

const char *vd_heightfield_wrong_size(const vd_heightfield *head) {
    if (head->height_type >= VD_HEIGHT_TYPE_COUNT) {
        return "height_type";
    }
    if (!side_fits(head->width, head->height)) {
        return "width or height";
    }
    bool no_colors = head->color_width == 0 && head->color_height == 0;
    if (!no_colors && !side_fits(head->color_width, head->color_height)) {
        return "color_width or color_height";
    }
    return NULL;
}

void vd_heightfield_lay_out(vd_heightfield *head) {
    size_t sample = vd_height_bytes(head->height_type);
    uint64_t at = align_up(sizeof *head);
    int32_t width = head->width, height = head->height;
    memset(head->levels, 0, sizeof head->levels);
    head->color_offset_bytes = head->color_stride = 0;
    int level = 0;
    for (;; level++) {
        vd_heightfield_level *l = &head->levels[level];
        l->offset_bytes = at;
        l->width = width;
        l->height = height;
        l->stride = vd_row_stride((size_t)width, sample);
        at = align_up(at + l->stride * (uint64_t)height * sample);
        if (level == 0 && head->color_width > 0) {
            head->color_offset_bytes = at;
            head->color_stride = vd_row_stride((size_t)head->color_width, sizeof(vd_rgba8));
            at =
                align_up(at + head->color_stride * (uint64_t)head->color_height * sizeof(vd_rgba8));
        }
        if (width == 1 && height == 1) {
            break;
        }
        width = (width + 1) / 2;
        height = (height + 1) / 2;
    }
    head->level_count = level + 1;
    head->size_bytes = at;
}

float vd_heightfield_sample(const vd_heightfield *layout, const void *block, int level, int column,
                            int row) {
    const vd_heightfield_level *l = &layout->levels[level];
    const void *samples = (const uint8_t *)block + l->offset_bytes;
    size_t i = (size_t)row * (size_t)l->stride + (size_t)column;
    switch (layout->height_type) {
    case VD_HEIGHT_U8:
        return ((const uint8_t *)samples)[i];
    case VD_HEIGHT_U16:
        return ((const uint16_t *)samples)[i];
    default:
        return ((const float *)samples)[i];
    }
}

/* One row of maxima from three rows of `count` samples, some of which may be the same row: each
 * over `reach` columns, 3 for the first level (whose cells share their border samples), then 2. */
static void reduce_u8(const uint8_t *const rows[3], int count, int reach, uint8_t *out) {
    for (int i = 0; i < count; i += 2) {
        uint8_t max = rows[0][i];
        for (int row = 0; row < 3; row++) {
            for (int j = i; j < i + reach && j < count; j++) {
                max = max < rows[row][j] ? rows[row][j] : max;
            }
        }
        out[i / 2] = max;
    }
}

static void reduce_u16(const uint16_t *const rows[3], int count, int reach, uint16_t *out) {
    for (int i = 0; i < count; i += 2) {
        uint16_t max = rows[0][i];
        for (int row = 0; row < 3; row++) {
            for (int j = i; j < i + reach && j < count; j++) {
                max = max < rows[row][j] ? rows[row][j] : max;
            }
        }
        out[i / 2] = max;
    }
}

static void reduce_f32(const float *const rows[3], int count, int reach, float *out) {
    for (int i = 0; i < count; i += 2) {
        float max = rows[0][i];
        for (int row = 0; row < 3; row++) {
            for (int j = i; j < i + reach && j < count; j++) {
                max = max < rows[row][j] ? rows[row][j] : max;
            }
        }
        out[i / 2] = max;
    }
}

void vd_heightfield_build_level(const vd_heightfield *layout, void *block, int level) {
    const vd_heightfield_level *fine = &layout->levels[level - 1], *coarse = &layout->levels[level];
    const size_t sample = vd_height_bytes(layout->height_type);
    const int reach = level == 1 ? 3 : 2;
    uint8_t *bytes = block;
    for (int32_t row = 0; row < coarse->height; row++) {
        const void *rows[3];
        for (int i = 0; i < 3; i++) {
            int32_t from = 2 * row + (i < reach ? i : 0);
            from = from < fine->height ? from : 2 * row;
            rows[i] = bytes + fine->offset_bytes + (uint64_t)from * fine->stride * sample;
        }
        void *out = bytes + coarse->offset_bytes + (uint64_t)row * coarse->stride * sample;
        if (layout->height_type == VD_HEIGHT_U8) {
            reduce_u8((const uint8_t *const[3]){rows[0], rows[1], rows[2]}, fine->width, reach,
                      out);
        } else if (layout->height_type == VD_HEIGHT_U16) {
            reduce_u16((const uint16_t *const[3]){rows[0], rows[1], rows[2]}, fine->width, reach,
                       out);
        } else {
            reduce_f32((const float *const[3]){rows[0], rows[1], rows[2]}, fine->width, reach, out);
        }
    }
}

bool vd_heightfield_measure(const vd_heightfield *layout, const void *block, float *min, float *max,
                            uint64_t *holes) {
    const vd_heightfield_level *level = &layout->levels[0];
    float low = INFINITY, high = -INFINITY;
    uint64_t count = 0;
    for (int32_t row = 0; row < level->height; row++) {
        for (int32_t column = 0; column < level->width; column++) {
            float h = vd_heightfield_sample(layout, block, 0, column, row);
            if (h == -INFINITY) {
                count++;
                continue;
            }
            if (!isfinite(h)) {
                return false;
            }
            low = h < low ? h : low;
            high = h > high ? h : high;
        }
    }
    bool empty = count == (uint64_t)level->width * (uint64_t)level->height;
    *min = empty ? 0.0f : low;
    *max = empty ? 0.0f : high;
    *holes = count;
    return true;
}

uint64_t vd_heightfield_checksum(const void *block, size_t size_bytes) {
    vd_heightfield head;
    memcpy(&head, block, sizeof head);
    head.checksum = 0;
    XXH64_state_t state;
    (void)XXH64_reset(&state, 0);
    (void)XXH64_update(&state, &head, sizeof head);
    (void)XXH64_update(&state, (const uint8_t *)block + sizeof head, size_bytes - sizeof head);
    return XXH64_digest(&state);
}

bool vd_heightfield_invert(const double m[6], double out[6]) {
    double det = m[1] * m[5] - m[2] * m[4];
    const double r[6] = {0.0, m[5] / det, -m[2] / det, 0.0, -m[4] / det, m[1] / det};
    memcpy(out, r, sizeof r);
    out[0] = -(r[1] * m[0] + r[2] * m[3]);
    out[3] = -(r[4] * m[0] + r[5] * m[3]);
    bool finite = det != 0.0;
    for (int i = 0; i < 6; i++) {
        finite = finite && isfinite(m[i]) && isfinite(out[i]);
    }
    return finite;
}
