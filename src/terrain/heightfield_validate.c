/* heightfield_validate.c: may a block from outside be used? */
#include <math.h>
#include <string.h>
#include "terrain/heightfield_block.h"

static vd_status wrong(const char *field, const char *why) {
    return vd_failure(VD_ERROR_FORMAT, "the heightfield block's %s %s; import the terrain again",
                      field, why);
}

static bool is_zero(const double *values, int count) {
    for (int i = 0; i < count; i++) {
        if (!(values[i] == 0.0)) {
            return false;
        }
    }
    return true;
}

/* Lays the block out again from its sizes and compares. */
static vd_status check_layout(const vd_heightfield *head, size_t size_bytes) {
    const char *field = vd_heightfield_wrong_size(head);
    if (field) {
        return wrong(field, "is out of range");
    }
    vd_heightfield expected = *head;
    vd_heightfield_lay_out(&expected);
    if (head->size_bytes != expected.size_bytes || expected.size_bytes != size_bytes) {
        return wrong("size_bytes", "does not fit its sizes and the bytes at hand");
    }
    if (head->color_offset_bytes != expected.color_offset_bytes ||
        head->color_stride != expected.color_stride) {
        return wrong("color_offset_bytes or color_stride", "does not fit its sizes");
    }
    if (head->level_count != expected.level_count) {
        return wrong("level_count", "does not fit its sizes");
    }
    for (int i = 0; i < VD_HEIGHTFIELD_MAX_LEVELS; i++) {
        const vd_heightfield_level *a = &head->levels[i], *b = &expected.levels[i];
        if (a->offset_bytes != b->offset_bytes || a->width != b->width || a->height != b->height ||
            a->stride != b->stride) {
            return wrong("levels", "do not fit its sizes");
        }
    }
    return vd_success();
}

static vd_status check_head(const vd_heightfield *head) {
    if (memcmp(head->magic, "VDHEIGHT", sizeof head->magic) != 0) {
        return vd_failure(VD_ERROR_FORMAT,
                          "the heightfield block's magic is not VDHEIGHT: it is no heightfield");
    }
    if (head->version != VD_HEIGHTFIELD_VERSION) {
        return vd_failure(
            VD_ERROR_FORMAT,
            "the heightfield block's version is %u, this program reads %u; import the "
            "terrain again",
            (unsigned)head->version, (unsigned)VD_HEIGHTFIELD_VERSION);
    }
    if (head->header_bytes != sizeof *head) {
        return wrong("header_bytes", "is not that of its version on this kind of machine");
    }
    if (head->wraps > 1) {
        return wrong("wraps", "must be 0 or 1");
    }
    if (head->reserved != 0) {
        return wrong("reserved field", "must be 0");
    }
    double inverse[6];
    if (!vd_heightfield_invert(head->world_from_sample, inverse)) {
        return wrong("world_from_sample", "is singular or not finite");
    }
    for (int i = 0; i < 6; i++) {
        if (!isfinite(head->color_from_sample[i])) {
            return wrong("color_from_sample", "is not finite");
        }
    }
    if (head->color_width == 0 && !is_zero(head->color_from_sample, 6)) {
        return wrong("color_from_sample", "must be 0 without colours");
    }
    return vd_success();
}

/* True when every sample of a level is the maximum of those below it. */
static bool level_is_right(const vd_heightfield *head, const uint8_t *block, int level) {
    const vd_heightfield_level *fine = &head->levels[level - 1], *coarse = &head->levels[level];
    const int32_t reach = level == 1 ? 2 : 1; /* blocks of samples share their border samples */
    for (int32_t row = 0; row < coarse->height; row++) {
        for (int32_t column = 0; column < coarse->width; column++) {
            float expected = -INFINITY;
            for (int32_t r = 2 * row; r <= 2 * row + reach && r < fine->height; r++) {
                for (int32_t c = 2 * column; c <= 2 * column + reach && c < fine->width; c++) {
                    float h = vd_heightfield_sample(head, block, level - 1, c, r);
                    expected = expected < h ? h : expected;
                }
            }
            if (vd_heightfield_sample(head, block, level, column, row) != expected) {
                return false;
            }
        }
    }
    return true;
}

static vd_status check_contents(const vd_heightfield *head, const uint8_t *block) {
    float min, max;
    uint64_t holes;
    if (!vd_heightfield_measure(head, block, &min, &max, &holes)) {
        return wrong("heights", "are not all finite or holes");
    }
    if (min != head->min || max != head->max || holes != head->holes) {
        return wrong("min, max or holes", "does not fit its heights");
    }
    for (int level = 1; level < head->level_count; level++) {
        if (!level_is_right(head, block, level)) {
            return wrong("pyramid", "does not hold the maxima of its heights");
        }
    }
    return vd_success();
}

vd_status vd_heightfield_validate(const void *block, size_t size_bytes) {
    if (!block || (uintptr_t)block % VD_HEIGHTFIELD_ALIGNMENT != 0) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "a heightfield block must lie at a multiple of %u bytes; copy it there",
                          VD_HEIGHTFIELD_ALIGNMENT);
    }
    vd_heightfield head;
    if (size_bytes < sizeof head) {
        return wrong("header", "is cut short");
    }
    memcpy(&head, block, sizeof head);
    vd_status status = check_head(&head);
    if (status.code == VD_OK) {
        status = check_layout(&head, size_bytes);
    }
    if (status.code == VD_OK && head.checksum != vd_heightfield_checksum(block, size_bytes)) {
        status = wrong("checksum", "does not fit its contents: it is damaged");
    }
    if (status.code == VD_OK) {
        status = check_contents(&head, block);
    }
    return status;
}
