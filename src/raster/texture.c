/* texture.c: a texture's pyramid. */
#include <string.h>
#include "raster/texture_internal.h"

#define MAX_SIDE 16384

static void fill_base(const vd_picture *picture, vd_texture_level *level) {
    for (int y = 0; y < level->height; y++) {
        for (int x = 0; x < level->width; x++) {
            const vd_rgba8 c = vd_picture_color(picture, x, y);
            uint8_t *to = level->texels + 4 * ((size_t)y * (size_t)level->width + (size_t)x);
            to[0] = (uint8_t)((c.r * c.a + 127) / 255);
            to[1] = (uint8_t)((c.g * c.a + 127) / 255);
            to[2] = (uint8_t)((c.b * c.a + 127) / 255);
            to[3] = c.a;
        }
    }
}

/* The part of [from, from + span), in texels of the finer level times `count`, that texel i covers,
 * is its weight: sides that are odd lose nothing at their end. */
static void halve(const vd_texture_level *fine, vd_texture_level *coarse) {
    const int64_t fw = fine->width, fh = fine->height, cw = coarse->width, ch = coarse->height;
    for (int64_t y = 0; y < ch; y++) {
        for (int64_t x = 0; x < cw; x++) {
            uint64_t sum[4] = {0, 0, 0, 0}, whole = (uint64_t)(fw * fh);
            for (int64_t j = y * fh / ch; j * ch < (y + 1) * fh; j++) {
                const int64_t top = j * ch > y * fh ? j * ch : y * fh;
                const int64_t end = (j + 1) * ch < (y + 1) * fh ? (j + 1) * ch : (y + 1) * fh;
                for (int64_t i = x * fw / cw; i * cw < (x + 1) * fw; i++) {
                    const int64_t left = i * cw > x * fw ? i * cw : x * fw;
                    const int64_t right = (i + 1) * cw < (x + 1) * fw ? (i + 1) * cw : (x + 1) * fw;
                    const uint64_t weight = (uint64_t)((end - top) * (right - left));
                    const uint8_t *t = fine->texels + 4 * (j * fw + i);
                    for (int c = 0; c < 4; c++) {
                        sum[c] += weight * t[c];
                    }
                }
            }
            for (int c = 0; c < 4; c++) {
                coarse->texels[4 * (y * cw + x) + c] = (uint8_t)((sum[c] + whole / 2) / whole);
            }
        }
    }
}

/* Memory for all levels of a size. */
static vd_status allocate_levels(vd_context *context, int width, int height, vd_texture **out) {
    if (width > MAX_SIDE || height > MAX_SIDE) {
        return vd_failure(VD_ERROR_LIMIT,
                          "a texture of %d × %d pixels is too large; no side may exceed %d", width,
                          height, MAX_SIDE);
    }
    size_t texels = 0;
    int w = width, h = height, levels = 1;
    for (;; levels++) {
        texels += (size_t)w * (size_t)h;
        if (w == 1 && h == 1) {
            break;
        }
        w = w > 1 ? w / 2 : 1;
        h = h > 1 ? h / 2 : 1;
    }
    vd_texture *texture = vd_allocate_zero(context, 1, sizeof *texture);
    uint8_t *memory = vd_allocate(context, texels, 4);
    if (texture == NULL || memory == NULL) {
        vd_release(context, texture);
        vd_release(context, memory);
        return vd_out_of_memory("a texture", texels * 4);
    }
    texture->context = context;
    texture->level_count = levels;
    for (int l = 0; l < levels; l++) {
        texture->levels[l] = (vd_texture_level){width, height, memory};
        memory += 4 * (size_t)width * (size_t)height;
        width = width > 1 ? width / 2 : 1;
        height = height > 1 ? height / 2 : 1;
    }
    *out = texture;
    return vd_success();
}

static void fill_coarse(vd_texture *texture) {
    for (int l = 1; l < texture->level_count; l++) {
        halve(&texture->levels[l - 1], &texture->levels[l]);
    }
}

vd_status vd_texture_create(vd_context *context, const vd_picture *picture, vd_texture **out) {
    const vd_status status = allocate_levels(context, picture->width, picture->height, out);
    if (status.code == VD_OK) {
        fill_base(picture, &(*out)->levels[0]);
        fill_coarse(*out);
    }
    return status;
}

vd_status vd_texture_create_from_texels(vd_context *context, const uint8_t *texels, int width,
                                        int height, vd_texture **out) {
    const vd_status status = allocate_levels(context, width, height, out);
    if (status.code == VD_OK) {
        memcpy((*out)->levels[0].texels, texels, (size_t)width * (size_t)height * 4);
        fill_coarse(*out);
    }
    return status;
}

void vd_texture_destroy(vd_texture **texture_in_out) {
    if (texture_in_out == NULL || *texture_in_out == NULL) {
        return;
    }
    vd_texture *texture = *texture_in_out;
    *texture_in_out = NULL;
    vd_release(texture->context, texture->levels[0].texels);
    vd_release(texture->context, texture);
}

int vd_texture_levels(const vd_texture *texture) {
    return texture->level_count;
}

const uint8_t *vd_texture_level_texels(const vd_texture *texture, int level, int *width,
                                       int *height) {
    *width = texture->levels[level].width;
    *height = texture->levels[level].height;
    return texture->levels[level].texels;
}

const char *vd_texture_filter_name(vd_texture_filter filter) {
    static const char *const names[VD_TEXTURE_FILTER_COUNT] = {"trilinear", "nearest", "bilinear",
                                                               "anisotropic"};
    return filter >= 0 && filter < VD_TEXTURE_FILTER_COUNT ? names[filter] : "unknown";
}
