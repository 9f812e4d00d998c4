/* heightfield.c: building a heightfield block, from arrays or from a DEM. */
#include <math.h>
#include <string.h>
#include "core/core.h"
#include "terrain/heightfield_block.h"

vd_heightfield_def vd_heightfield_def_default(void) {
    vd_heightfield_def def;
    memset(&def, 0, sizeof def);
    def.type = VD_HEIGHT_F32;
    return def;
}

static bool all_finite(const double *values, int count) {
    for (int i = 0; i < count; i++) {
        if (!isfinite(values[i])) {
            return false;
        }
    }
    return true;
}

static vd_status check_def(const vd_heightfield_def *def) {
    if (!def->heights) {
        return vd_failure(VD_ERROR_ARGUMENT, "heights must not be null");
    }
    if ((unsigned)def->type >= VD_HEIGHT_TYPE_COUNT) {
        return vd_failure(VD_ERROR_ARGUMENT, "type must be one of vd_height_type");
    }
    if (def->width < 1 || def->height < 1) {
        return vd_failure(VD_ERROR_ARGUMENT, "the size %d × %d must be at least 1 × 1", def->width,
                          def->height);
    }
    if (def->height_stride < (size_t)def->width) {
        return vd_failure(VD_ERROR_ARGUMENT, "height_stride %zu must be at least the width %d",
                          def->height_stride, def->width);
    }
    if (def->colors && (!def->colors->data || def->colors->width < 1 || def->colors->height < 1)) {
        return vd_failure(VD_ERROR_ARGUMENT, "colors must be a picture of at least 1 × 1 pixels");
    }
    if (def->colors && def->color_from_sample && !all_finite(def->color_from_sample, 6)) {
        return vd_failure(VD_ERROR_ARGUMENT, "color_from_sample must be finite");
    }
    return vd_success();
}

static vd_status set_transforms(const vd_heightfield_def *def, vd_heightfield *head) {
    static const double plain[6] = {0.0, 1.0, 0.0, 0.0, 0.0, -1.0};
    bool given = false;
    for (int i = 0; i < 6; i++) {
        given = given || def->world_from_sample[i] != 0.0; /* also true of NaN */
    }
    memcpy(head->world_from_sample, given ? def->world_from_sample : plain, sizeof plain);
    double inverse[6];
    if (!vd_heightfield_invert(head->world_from_sample, inverse)) {
        return vd_failure(VD_ERROR_ARGUMENT, "world_from_sample must be finite and not singular: "
                                             "columns and rows need different directions");
    }
    if (def->colors && def->color_from_sample) {
        memcpy(head->color_from_sample, def->color_from_sample, sizeof head->color_from_sample);
    } else if (def->colors) {
        /* Sample c covers [c − ½, c + ½]: the picture spans all of that. */
        double u = (double)def->colors->width / def->width;
        double v = (double)def->colors->height / def->height;
        const double stretched[6] = {0.5 * u, u, 0.0, 0.5 * v, 0.0, v};
        memcpy(head->color_from_sample, stretched, sizeof stretched);
    }
    return vd_success();
}

static void copy_heights(const vd_heightfield_def *def, vd_heightfield *block) {
    size_t sample = vd_height_bytes(block->height_type), stride = (size_t)block->levels[0].stride;
    uint8_t *to = (uint8_t *)block + block->levels[0].offset_bytes;
    const uint8_t *from = def->heights;
    for (int row = 0; row < def->height; row++) {
        memcpy(to, from, (size_t)def->width * sample);
        for (int column = 0; def->type == VD_HEIGHT_F32 && column < def->width; column++) {
            float *height = (float *)(void *)to + column;
            *height = isfinite(*height) ? *height : -INFINITY;
        }
        to += stride * sample;
        from += def->height_stride * sample;
    }
}

static void copy_colors(const vd_picture *colors, vd_heightfield *block) {
    vd_rgba8 *to = (vd_rgba8 *)(void *)((uint8_t *)block + block->color_offset_bytes);
    for (int y = 0; y < colors->height; y++) {
        for (int x = 0; x < colors->width; x++) {
            to[x] = vd_picture_color(colors, x, y);
        }
        to += block->color_stride;
    }
}

static vd_status make_head(const vd_heightfield_def *def, vd_heightfield *head) {
    vd_status status = check_def(def);
    if (status.code != VD_OK) {
        return status;
    }
    memset(head, 0, sizeof *head);
    memcpy(head->magic, "VDHEIGHT", sizeof head->magic);
    head->version = VD_HEIGHTFIELD_VERSION;
    head->header_bytes = sizeof *head;
    head->height_type = (uint32_t)def->type;
    head->wraps = def->wraps;
    head->width = def->width;
    head->height = def->height;
    head->color_width = def->colors ? def->colors->width : 0;
    head->color_height = def->colors ? def->colors->height : 0;
    const char *wrong = vd_heightfield_wrong_size(head);
    if (wrong) {
        return vd_failure(VD_ERROR_LIMIT,
                          "%s is more than a heightfield takes (%d a side, %zu in all): %d × %d "
                          "heights, %d × %d colours; crop or reduce them",
                          wrong, VD_MAX_SIDE, VD_MAX_PIXELS, def->width, def->height,
                          head->color_width, head->color_height);
    }
    status = set_transforms(def, head);
    if (status.code != VD_OK) {
        return status;
    }
    vd_heightfield_lay_out(head);
    if (head->size_bytes > SIZE_MAX) {
        return vd_failure(VD_ERROR_LIMIT,
                          "the heightfield needs more memory than can be addressed");
    }
    return vd_success();
}

vd_status vd_heightfield_create(vd_context *context, const vd_heightfield_def *def,
                                vd_heightfield **out) {
    if (!context || !def || !out) {
        return vd_failure(VD_ERROR_ARGUMENT, "vd_heightfield_create: no argument may be null");
    }
    vd_heightfield head;
    vd_status status = make_head(def, &head);
    if (status.code != VD_OK) {
        return status;
    }
    /* Cleared, so that the padding and with it the checksum are the same every time. */
    vd_heightfield *block = vd_allocate_zero(context, 1, (size_t)head.size_bytes);
    if (!block) {
        return vd_out_of_memory("a heightfield", (size_t)head.size_bytes);
    }
    *block = head;
    copy_heights(def, block);
    if (def->colors) {
        copy_colors(def->colors, block);
    }
    for (int level = 1; level < block->level_count; level++) {
        vd_heightfield_build_level(block, block, level);
    }
    (void)vd_heightfield_measure(block, block, &block->min, &block->max, &block->holes);
    block->checksum = vd_heightfield_checksum(block, (size_t)block->size_bytes);
    *out = block;
    return vd_success();
}

void vd_heightfield_destroy(vd_context *context, vd_heightfield **heightfield) {
    if (heightfield && *heightfield) {
        vd_release(context, *heightfield);
        *heightfield = NULL;
    }
}

vd_status vd_heightfield_from_dem(const vd_dem *dem, const vd_picture *colors,
                                  const double *color_from_sample, vd_heightfield **out) {
    if (!dem || !out) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "vd_heightfield_from_dem: dem and out must not be null");
    }
    vd_heightfield_def def = vd_heightfield_def_default();
    def.width = dem->width;
    def.height = dem->height;
    def.heights = dem->heights;
    def.height_stride = dem->stride;
    def.colors = colors;
    def.color_from_sample = color_from_sample;
    vd_dem_world_from_sample(dem, def.world_from_sample);
    return vd_heightfield_create(dem->context, &def, out);
}
