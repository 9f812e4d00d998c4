/* brick_block.c: blocks of bricks at whoever draws them. Also built to WebAssembly.
 *
 * Opacity. A sample stands for k particles, each of which covers a share c of a pixel, opacity
 * times area, at most opacity. k of them, one over the other, cover 1 − (1 − c)^k; so much must the
 * sample. Its area grows with k as far as a pixel; the rest is its opacity. Keeping k·c instead,
 * the sum of the areas, is the same for small c; for dense clouds it would cover too much, by up to
 * 1 / e of a pixel. */
#define XXH_INLINE_ALL
#include <xxhash.h>

#include <math.h>
#include <string.h>
#include "core/core.h"
#include "core/real.h"
#include "splat/brick_pack.h"

#define MOST_METRES 1e6f /* of a step, of a radius */
#define MOST_STANDS_FOR 1e15

static const uint8_t block_magic[8] = {'V', 'D', 'B', 'R', 'I', 'C', 'K', 1};

static size_t padded(size_t bytes) {
    return (bytes + 63) / 64 * 64;
}

vd_brick_layout vd_brick_block_layout(uint32_t count, uint32_t parts) {
    const size_t axis = padded(2 * (size_t)count);
    vd_brick_layout l = {.x = sizeof(vd_brick_block_head)};
    l.y = l.x + axis;
    l.z = l.y + axis;
    l.radius = l.z + axis;
    l.color = l.radius + ((parts & VD_BLOCK_RADII) != 0 ? axis : 0);
    l.size_bytes = l.color + ((parts & VD_BLOCK_COLORS) != 0 ? padded(4 * (size_t)count) : 0);
    return l;
}

uint64_t vd_brick_block_checksum(const void *block, size_t size_bytes) {
    vd_brick_block_head head;
    memcpy(&head, block, sizeof head);
    head.checksum = 0;
    const uint64_t rest = XXH64((const uint8_t *)block + sizeof head, size_bytes - sizeof head, 0);
    return XXH64(&head, sizeof head, rest);
}

/* ---- checks -----------------------------------------------------------------------------------*/

static bool is_within(float v, float most) {
    return v >= 0.0f && v <= most; /* false for NaN */
}

/* What of a block is wrong; null: nothing. */
static const char *find_fault(const vd_brick_block_head *h, const void *block, size_t size_bytes) {
    if (memcmp(h->magic, block_magic, sizeof block_magic) != 0) {
        return "it does not begin as one";
    }
    if (h->count < 1 || h->count > VD_BRICK_BLOCK_MOST ||
        (h->parts & ~(uint32_t)VD_BLOCK_PARTS) != 0 ||
        vd_brick_block_layout(h->count, h->parts).size_bytes != size_bytes) {
        return "its size is not what it says";
    }
    if (vd_brick_block_checksum(block, size_bytes) != h->checksum) {
        return "its checksum does not hold";
    }
    const bool sound = h->kernel < VD_SPLAT_KERNEL_COUNT && is_within(h->step[0], MOST_METRES) &&
                       is_within(h->step[1], MOST_METRES) && is_within(h->step[2], MOST_METRES) &&
                       is_within(h->radius, MOST_METRES) &&
                       is_within(h->radius_step, MOST_METRES) && is_within(h->opacity, 1.0f) &&
                       h->stands_for >= 1.0 && h->stands_for <= MOST_STANDS_FOR;
    return sound ? NULL : "a number is out of its range";
}

vd_status vd_brick_block_unpack(vd_context *context, const void *block, size_t size_bytes,
                                vd_vec3 origin, vd_brick_block **out) {
    vd_brick_block_head head = {.count = 0};
    memcpy(&head, block, size_bytes < sizeof head ? size_bytes : sizeof head);
    const char *fault = size_bytes >= sizeof head ? find_fault(&head, block, size_bytes)
                                                  : "it is shorter than its head";
    if (fault != NULL) {
        return vd_failure(VD_ERROR_FORMAT, "a brick's block is damaged: %s; get it again", fault);
    }
    const size_t own = padded(sizeof(vd_brick_block));
    uint8_t *memory = vd_allocate(context, 1, own + size_bytes);
    if (memory == NULL) {
        return vd_out_of_memory("a brick", own + size_bytes);
    }
    const vd_brick_layout l = vd_brick_block_layout(head.count, head.parts);
    uint8_t *at = memory + own;
    memcpy(at, block, size_bytes);
    vd_brick_block *made = (vd_brick_block *)(void *)memory;
    *made = (vd_brick_block){.context = context, .origin = origin, .head = head};
    made->x = (const uint16_t *)(const void *)(at + l.x);
    made->y = (const uint16_t *)(const void *)(at + l.y);
    made->z = (const uint16_t *)(const void *)(at + l.z);
    if ((head.parts & VD_BLOCK_RADII) != 0) {
        made->radius = (const uint16_t *)(const void *)(at + l.radius);
    }
    if ((head.parts & VD_BLOCK_COLORS) != 0) {
        made->color = (const vd_rgba8 *)(const void *)(at + l.color);
    }
    *out = made;
    return vd_success();
}

void vd_brick_block_destroy(vd_brick_block **block) {
    if (*block != NULL) {
        vd_release((*block)->context, *block);
        *block = NULL;
    }
}

/* ---- what stands for others -------------------------------------------------------------------*/

void vd_brick_stand_in(double radius, double each, double opacity, double pixels, double nearest,
                       double *factor, float *out) {
    *factor = 1.0;
    *out = (float)opacity;
    if (!(each > 1.0 && radius > 0.0)) {
        return;
    }
    const double side = 2.0 * radius * pixels;
    const double area = side < 1.0 ? side * side : 1.0;
    const double covered =
        opacity * area < 1.0
            ? 1.0 - vd_exp(each * 0.69314718055994530942 * vd_log2(1.0 - opacity * area))
            : 1.0;
    /* As far as a pixel, for the nearest of them: larger ones are drawn more slowly. */
    const double pixel = 1.0 / (2.0 * radius * nearest);
    *factor = sqrt(each) < pixel ? sqrt(each) : pixel > 1.0 ? pixel : 1.0;
    const double share = area * *factor * *factor < 1.0 ? area * *factor * *factor : 1.0;
    *out = (float)(covered / share < 1.0 ? covered / share : 1.0);
}
