/* frame.c: the frame's planes. */
#include <string.h>
#include <veduta/frame.h>

/* Inlined, so that the state may stand on the stack and hashing cannot fail. */
#define XXH_INLINE_ALL
#include <xxhash.h>

#include "core/core.h"
#include "image/image.h"

vd_status vd_check_size(const char *what, int width, int height) {
    if (width < 1 || height < 1) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "%s of %d × %d pixels is empty; give both sides at least 1", what, width,
                          height);
    }
    if (width > VD_MAX_SIDE || height > VD_MAX_SIDE) {
        return vd_failure(VD_ERROR_LIMIT,
                          "%s of %d × %d pixels is too large; no side may exceed %d pixels", what,
                          width, height, VD_MAX_SIDE);
    }
    if ((size_t)width * (size_t)height > VD_MAX_PIXELS) {
        return vd_failure(
            VD_ERROR_LIMIT,
            "%s of %d × %d pixels is too large; it may have at most %zu pixels in all", what, width,
            height, VD_MAX_PIXELS);
    }
    return vd_success();
}

size_t vd_frame_stride(int width) {
    return vd_row_stride(width > 0 ? (size_t)width : 1, sizeof(float));
}

/* ---- the table of object ids ------------------------------------------------------------------
 */

#define FIRST_OBJECTS 16
#define MOST_OBJECTS (1 << 24)

/* The slot where an id stands, or the free one where it would. */
static uint32_t *find_slot(uint32_t *slots, int capacity, const uint64_t *ids, uint64_t object_id) {
    const uint32_t mask = 2 * (uint32_t)capacity - 1;
    uint32_t at = (uint32_t)((object_id * 0x9e3779b97f4a7c15u) >> 32) & mask;
    while (slots[at] != 0 && ids[slots[at]] != object_id) {
        at = (at + 1) & mask;
    }
    return &slots[at];
}

static vd_status grow_objects(vd_frame *frame) {
    const int capacity = frame->object_capacity > 0 ? 2 * frame->object_capacity : FIRST_OBJECTS;
    if (capacity > MOST_OBJECTS) {
        return vd_failure(VD_ERROR_LIMIT, "a frame shows at most %d objects; draw fewer at once",
                          MOST_OBJECTS);
    }
    uint64_t *ids = vd_allocate_zero(frame->context, (size_t)capacity, sizeof *ids);
    uint32_t *slots = vd_allocate_zero(frame->context, (size_t)capacity, 2 * sizeof *slots);
    if (ids == NULL || slots == NULL) {
        vd_release(frame->context, ids);
        vd_release(frame->context, slots);
        return vd_out_of_memory("a frame's table of objects", (size_t)capacity * 16);
    }
    for (int i = 1; i < frame->object_count; i++) {
        ids[i] = frame->object_ids[i];
        *find_slot(slots, capacity, ids, ids[i]) = (uint32_t)i;
    }
    vd_release(frame->context, frame->object_ids);
    vd_release(frame->context, frame->object_slots);
    frame->object_ids = ids;
    frame->object_slots = slots;
    frame->object_capacity = capacity;
    return vd_success();
}

vd_status vd_frame_add_object(vd_frame *frame, uint64_t object_id, uint32_t *out) {
    uint32_t *slot =
        find_slot(frame->object_slots, frame->object_capacity, frame->object_ids, object_id);
    if (*slot == 0) {
        if (frame->object_count >= frame->object_capacity) {
            const vd_status status = grow_objects(frame);
            if (status.code != VD_OK) {
                return status;
            }
            slot = find_slot(frame->object_slots, frame->object_capacity, frame->object_ids,
                             object_id);
        }
        frame->object_ids[frame->object_count] = object_id;
        *slot = (uint32_t)frame->object_count++;
    }
    *out = *slot;
    return vd_success();
}

void vd_frame_forget_objects(vd_frame *frame) {
    frame->object_count = 1;
    memset(frame->object_slots, 0, 2 * (size_t)frame->object_capacity * sizeof(uint32_t));
}

vd_status vd_frame_create(vd_context *context, int width, int height, unsigned planes,
                          vd_frame **out) {
    vd_status status = vd_check_size("a frame", width, height);
    if (status.code != VD_OK) {
        return status;
    }
    vd_frame *frame = vd_allocate_zero(context, 1, sizeof *frame);
    if (!frame) {
        return vd_out_of_memory("a frame", sizeof *frame);
    }
    frame->context = context;
    frame->width = width;
    frame->height = height;
    frame->stride = vd_frame_stride(width);

    const size_t pixels = frame->stride * (size_t)height; /* below 2^30: sides are checked */
    frame->rgba = vd_allocate_zero(context, pixels, 4);
    if (planes & VD_PLANE_DEPTH) {
        frame->depth = vd_allocate_zero(context, pixels, sizeof *frame->depth);
    }
    if (planes & VD_PLANE_ID) {
        frame->id = vd_allocate_zero(context, pixels, sizeof *frame->id);
    }
    frame->object_count = 1;
    const vd_status table = grow_objects(frame);
    if (table.code != VD_OK) {
        vd_frame_destroy(&frame);
        return table;
    }
    if (!frame->rgba || ((planes & VD_PLANE_DEPTH) && !frame->depth) ||
        ((planes & VD_PLANE_ID) && !frame->id)) {
        vd_frame_destroy(&frame);
        return vd_out_of_memory("a plane of a frame", pixels * 4);
    }
    *out = frame;
    return vd_success();
}

void vd_frame_destroy(vd_frame **frame) {
    if (!frame || !*frame) {
        return;
    }
    vd_context *context = (*frame)->context;
    vd_release(context, (*frame)->rgba);
    vd_release(context, (*frame)->depth);
    vd_release(context, (*frame)->id);
    vd_release(context, (*frame)->object_ids);
    vd_release(context, (*frame)->object_slots);
    vd_release(context, *frame);
    *frame = NULL;
}

vd_status vd_frame_fit(vd_context *context, int width, int height, unsigned planes,
                       vd_frame **frame, size_t *pixels) {
    const size_t wanted = vd_frame_stride(width) * (size_t)height;
    if (*frame == NULL || wanted > *pixels) {
        vd_frame_destroy(frame);
        *pixels = 0;
        const vd_status status = vd_frame_create(context, width, height, planes, frame);
        if (status.code != VD_OK) {
            return status;
        }
        *pixels = wanted;
    }
    (*frame)->width = width;
    (*frame)->height = height;
    (*frame)->stride = vd_frame_stride(width);
    return vd_success();
}

uint64_t vd_frame_hash(const vd_frame *frame) {
    XXH64_state_t state;
    XXH64_reset(&state, 0);
    uint8_t rgb[3 * 256];
    for (int y = 0; y < frame->height; y++) {
        const uint8_t *row = frame->rgba + (size_t)y * frame->stride * 4;
        for (int x = 0; x < frame->width; x += 256) {
            const int count = frame->width - x < 256 ? frame->width - x : 256;
            for (int i = 0; i < count; i++) {
                rgb[3 * i + 0] = row[4 * (x + i) + 0];
                rgb[3 * i + 1] = row[4 * (x + i) + 1];
                rgb[3 * i + 2] = row[4 * (x + i) + 2];
            }
            XXH64_update(&state, rgb, 3 * (size_t)count);
        }
    }
    return XXH64_digest(&state);
}
