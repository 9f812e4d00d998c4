/* wasm_scenes OUT COUNT: seeded scenes of quads and the hashes of their frames, drawn natively, as
 * one file for test/wasm/display.mjs. Little-endian 32-bit words:
 *   scene count; for each: width, height, background, quad count, texel count, FNV-1a 64 of the
 * RGBA rows without padding (low word, high word); quads as vd_wasm_draw takes them, with the
 * picture's first texel in the place of its address; texels. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "display_scenes.h"

enum { WORDS = 21 };

static bool write_scene(FILE *file, const display_scene *scene, uint64_t hash) {
    const uint32_t head[7] = {
        (uint32_t)scene->width,      (uint32_t)scene->height,      scene->background,
        (uint32_t)scene->quad_count, (uint32_t)scene->texel_count, (uint32_t)hash,
        (uint32_t)(hash >> 32)};
    bool written = fwrite(head, sizeof head, 1, file) == 1;
    for (int i = 0; i < scene->quad_count; i++) {
        const vd_quad *quad = &scene->quads[i];
        uint32_t words[WORDS];
        memcpy(words, quad->corners, sizeof quad->corners);
        words[12] = (uint32_t)((quad->picture.rgba - scene->texels) / 4);
        words[13] = (uint32_t)quad->picture.width;
        words[14] = (uint32_t)quad->picture.height;
        words[15] = (uint32_t)quad->picture.stride;
        memcpy(words + 16, quad->picture.opaque, sizeof quad->picture.opaque);
        words[20] = quad->opacity;
        written = written && fwrite(words, sizeof words, 1, file) == 1;
    }
    return written && fwrite(scene->texels, 4, scene->texel_count, file) == scene->texel_count;
}

static vd_status draw_scene(vd_context *context, vd_display *display, const display_scene *scene,
                            uint64_t *hash) {
    vd_frame *frame = NULL;
    vd_status status = vd_frame_create(context, scene->width, scene->height, 0, &frame);
    if (status.code != VD_OK) {
        return status;
    }
    for (size_t i = 0; i < frame->stride * (size_t)frame->height; i++) {
        memcpy(frame->rgba + 4 * i, &scene->background, 4);
    }
    status = vd_display_draw(display, NULL, frame, scene->quads, scene->quad_count, NULL);
    *hash = display_scene_hash(frame);
    vd_frame_destroy(&frame);
    return status;
}

int main(int argc, char **argv) {
    const uint32_t count = argc > 2 ? (uint32_t)atoi(argv[2]) : 0;
    FILE *file = argc > 2 ? fopen(argv[1], "wb") : NULL;
    display_scene *scene = malloc(sizeof *scene);
    vd_context *context = NULL;
    vd_display *display = NULL;
    vd_status status = vd_context_create(NULL, &context);
    if (status.code == VD_OK) {
        status = vd_display_create(context, &display);
    }
    bool written = file != NULL && scene != NULL && fwrite(&count, 4, 1, file) == 1;
    for (uint32_t i = 0; i < count && written && status.code == VD_OK; i++) {
        uint64_t hash = 0;
        display_scene_make(scene, 1000 + i);
        status = draw_scene(context, display, scene, &hash);
        written = write_scene(file, scene, hash);
    }
    written = file != NULL && fclose(file) == 0 && written;
    if (!written || status.code != VD_OK) {
        fprintf(stderr, "wasm_scenes: %s\n",
                status.code != VD_OK ? status.message : "cannot write; use: wasm_scenes OUT COUNT");
    }
    vd_display_destroy(&display);
    vd_context_destroy(&context);
    free(scene);
    return written && status.code == VD_OK ? 0 : 1;
}
