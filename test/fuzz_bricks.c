/* Fuzzes brick files. Sums are made right before a file is opened, else nothing would get past
 * them; whatever opens must be usable: every brick, every number, a view of it. */
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>
#include <veduta/brick_view.h>
#include "splat/brick_format.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void mend_sums(uint8_t *file, size_t size) {
    vd_bricks_head *head = (vd_bricks_head *)file;
    if (size < sizeof *head || head->directory_offset < sizeof *head ||
        head->directory_offset > size) {
        return;
    }
    head->file_bytes = size;
    const uint64_t attributes = head->attribute_count * (uint64_t)sizeof(vd_bricks_attribute);
    uint64_t at = head->directory_offset;
    at = attributes <= size - at && at % 64 == 0 ? at + attributes : size;
    for (uint64_t i = 0; i < head->node_count && at + sizeof(vd_bricks_node) <= size; i++) {
        vd_bricks_node *n = (vd_bricks_node *)(file + at);
        if (n->offset <= size && n->bytes <= size - n->offset) {
            n->checksum = XXH64(file + n->offset, n->bytes, 0);
        }
        at += sizeof *n;
    }
    head->checksum = 0;
    const uint64_t sums[2] = {
        XXH64(head, sizeof *head, 0),
        XXH64(file + head->directory_offset, size - head->directory_offset, 0)};
    head->checksum = XXH64(sums, sizeof sums, 0);
}

static void use(vd_context *context, vd_bricks *b) {
    float *values = malloc(VD_BRICK_MOST * sizeof *values);
    for (uint32_t n = 0; n < b->node_count; n++) {
        vd_brick brick;
        if (vd_bricks_brick(b, n, &brick).code != VD_OK) {
            continue;
        }
        for (uint32_t a = 0; a < b->attribute_count; a++) {
            vd_bricks_values(b, &brick, (int)a, values);
        }
    }
    free(values);
    vd_brick_view *view = NULL;
    vd_splatter *splatter = NULL;
    vd_frame *frame = NULL;
    vd_camera camera = {.eye = {0.5, -3.0, 0.5}, .near_m = 0.01, .far_m = 100.0};
    camera.orientation = vd_orientation_look_at(camera.eye, vd_vec3_make(0.5, 0.5, 0.5));
    camera.lens = vd_lens_from_fov(1.0, 32, 32);
    vd_brick_view_def def = vd_brick_view_def_default();
    vd_splat_def splat_def = vd_splat_def_default();
    def.color = b->attribute_count > 0 ? VD_BRICK_COLOR_VALUE : VD_BRICK_COLOR_CONSTANT;
    def.attribute = 0;
    if (vd_brick_view_create(context, b, &view).code == VD_OK &&
        vd_splatter_create(context, &splatter).code == VD_OK &&
        vd_frame_create(context, 32, 32, 0, &frame).code == VD_OK &&
        vd_brick_view_update(view, NULL, &def, &camera, 32, 32, NULL).code == VD_OK) {
        vd_status status = vd_splatter_render(splatter, NULL, &splat_def, &camera, view->splats,
                                              view->count, frame, NULL);
        (void)status;
    }
    vd_frame_destroy(&frame);
    vd_splatter_destroy(&splatter);
    vd_brick_view_destroy(&view);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    vd_context_def context_def = vd_context_def_default();
    context_def.threads = 1;
    vd_context *context = NULL;
    uint8_t *file = aligned_alloc(64, (size + 127) / 64 * 64);
    if (file == NULL || vd_context_create(&context_def, &context).code != VD_OK) {
        free(file);
        return 0;
    }
    memcpy(file, data, size);
    for (int mended = 0; mended < 2; mended++) {
        vd_bricks *b = NULL;
        vd_status status = vd_bricks_open_memory(context, file, size, "fuzz", &b);
        if ((status.code == VD_OK) != (b != NULL)) {
            abort();
        }
        if (b != NULL) {
            use(context, b);
        }
        vd_bricks_close(&b);
        mend_sums(file, size);
    }
    vd_context_destroy(&context);
    free(file);
    return 0;
}
