/* Fuzzes blocks that a server sends: models and bricks of particles. Sums are made right, else
 * nothing would get past them; whatever unpacks must be drawn, in a bounded time. The first byte:
 * odd for a model. */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>
#include <veduta/placed.h>
#include "splat/brick_pack.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { SIDE = 32 };

/* In both kinds of block the sum follows the magic: a model's with its size between them. */
static void mend_model(uint8_t *block, size_t size) {
    static const uint8_t magic[8] = {'V', 'D', 'M', 'O', 'D', 'E', 'L', 1};
    const uint64_t bytes = size, none = 0;
    if (size < 24) {
        return;
    }
    memcpy(block, magic, sizeof magic);
    memcpy(block + 8, &bytes, sizeof bytes);
    memcpy(block + 16, &none, sizeof none);
    const uint64_t sum = XXH64(block, size, 0);
    memcpy(block + 16, &sum, sizeof sum);
}

static void mend_brick(uint8_t *block, size_t size) {
    static const uint8_t magic[8] = {'V', 'D', 'B', 'R', 'I', 'C', 'K', 1};
    if (size < sizeof(vd_brick_block_head)) {
        return;
    }
    memcpy(block, magic, sizeof magic);
    const uint64_t sum = vd_brick_block_checksum(block, size);
    memcpy(block + offsetof(vd_brick_block_head, checksum), &sum, sizeof sum);
}

static void draw(vd_context *context, const vd_placed *placed) {
    static uint8_t pixels[SIDE * SIDE * 4];
    const vd_placed_window window = {pixels, SIDE, SIDE, SIDE};
    const vd_light light = {.sun_direction = {0, 0, 1}};
    vd_camera camera = {.eye = {0.5, -3.0, 0.5}, .near_m = 0.01, .far_m = 100.0};
    camera.orientation = vd_orientation_look_at(camera.eye, vd_vec3_make(0.5, 0.5, 0.5));
    camera.lens = vd_lens_from_fov(1.0, SIDE, SIDE);
    vd_placer *placer = NULL;
    if (vd_placer_create(context, &placer).code == VD_OK) {
        const vd_status status =
            vd_placer_draw(placer, NULL, &light, &camera, placed, 1, &window, NULL, NULL);
        (void)status;
    }
    vd_placer_destroy(&placer);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    vd_context_def def = vd_context_def_default();
    def.threads = 1;
    vd_context *context = NULL;
    uint8_t *block = aligned_alloc(64, (size + 127) / 64 * 64);
    if (size == 0 || block == NULL || vd_context_create(&def, &context).code != VD_OK) {
        free(block);
        return 0;
    }
    const bool is_model = (data[0] & 1) != 0;
    const size_t bytes = size - 1;
    vd_placed placed = {.place = {.axes = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .sun = 1.0f}};
    vd_model *model = NULL;
    vd_brick_block *brick = NULL;
    memcpy(block, data + 1, bytes);
    is_model ? mend_model(block, bytes) : mend_brick(block, bytes);
    const vd_status status =
        is_model ? vd_model_unpack(context, block, bytes, &model)
                 : vd_brick_block_unpack(context, block, bytes, vd_vec3_make(0, 0, 0), &brick);
    if (status.code == VD_OK) {
        placed.model = model;
        placed.brick = brick;
        draw(context, &placed);
    }
    vd_brick_block_destroy(&brick);
    vd_model_destroy(&model);
    vd_context_destroy(&context);
    free(block);
    return 0;
}
