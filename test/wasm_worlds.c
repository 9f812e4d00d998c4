/* wasm_worlds OUT FRAMES: a seeded scene of pictures in the world, that come and go while a camera
 * jumps, and the hashes of its frames drawn natively, for test/wasm/scene.mjs. All little-endian;
 * u32 frame count, u32 slots, u32 heap bytes; then of each frame
 *   u32 number of changes; of each: u32 slot, width (0: removed), height, opaque[4], f64
 *   corners[12], texels
 *   u32 number of slots shown, u32 slots, farthest first
 *   u32 width, height; f64 eye[3], heading, pitch, roll, fov (degrees), near
 *   f64 orientation[4], lens[4] as the native camera has them
 *   u32 pictures placed, FNV-1a 64 of the RGBA rows without padding (low word, high word) */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "display_scenes.h"

enum { SLOTS = 24, MOST_SIDE = 62, HEAP_BYTES = 160 * 1024, HEAD_BYTES = 64 };

typedef struct slot {
    vd_quad_picture picture; /* width 0: empty */
    vd_vec3 corners[4];
    uint8_t texels[4 * MOST_SIDE * MOST_SIDE];
} slot;

typedef struct world {
    FILE *file;
    bool written;
    uint64_t random;
    slot slots[SLOTS];
    uint32_t order[SLOTS];
    uint32_t shown;
} world;

static void put(world *w, const void *data, size_t bytes) {
    w->written = w->written && fwrite(data, 1, bytes, w->file) == bytes;
}

static void put_word(world *w, uint32_t word) {
    put(w, &word, 4);
}

static double between(world *w, double low, double high) {
    return (double)display_scene_between(&w->random, low, high);
}

static uint32_t below(world *w, uint32_t count) {
    return (uint32_t)(display_scene_random(&w->random) % count);
}

static size_t heap_bytes(int width, int height) {
    return (HEAD_BYTES + 4 * (size_t)width * (size_t)height + HEAD_BYTES - 1) / HEAD_BYTES *
           HEAD_BYTES;
}

static size_t used_bytes(const world *w) {
    size_t bytes = 0;
    for (int i = 0; i < SLOTS; i++) {
        const vd_quad_picture *p = &w->slots[i].picture;
        bytes += p->width > 0 ? heap_bytes(p->width, p->height) : 0;
    }
    return bytes;
}

/* A picture around the origin of a world that lies far out. */
static void make_picture(world *w, slot *s, int width, int height) {
    const double middle[3] = {400000.125 + between(w, -40, 40), 5e6 + between(w, -40, 40),
                              between(w, -20, 20)};
    double along[3], down[3];
    s->picture = (vd_quad_picture){s->texels, width, height, (size_t)width, {0, 0, 0, 0}};
    for (int k = 0; k < 3; k++) {
        along[k] = between(w, -8, 8);
        down[k] = between(w, -8, 8);
    }
    for (int i = 0; i < 4; i++) {
        const double a = i == 1 || i == 2 ? 1 : 0, d = i >= 2 ? 1 : 0;
        s->corners[i] = vd_vec3_make(middle[0] + a * along[0] + d * down[0],
                                     middle[1] + a * along[1] + d * down[1],
                                     middle[2] + a * along[2] + d * down[2]);
    }
    for (int i = 0; i < width * height; i++) {
        const uint32_t r = (uint32_t)display_scene_random(&w->random);
        const uint32_t alpha = r >> 24;
        for (int c = 0; c < 3; c++) {
            s->texels[4 * i + c] = (uint8_t)((r >> (8 * c) & 255) % (alpha + 1));
        }
        s->texels[4 * i + 3] = (uint8_t)alpha;
    }
}

static void change(world *w) {
    const uint32_t number = below(w, SLOTS);
    slot *s = &w->slots[number];
    const int width = 2 + (int)below(w, MOST_SIDE - 1), height = 2 + (int)below(w, MOST_SIDE - 1);
    s->picture.width = 0;
    put_word(w, number);
    if (below(w, 5) == 0 || used_bytes(w) + heap_bytes(width, height) > HEAP_BYTES) {
        put_word(w, 0);
        return;
    }
    make_picture(w, s, width, height);
    put_word(w, (uint32_t)width);
    put_word(w, (uint32_t)height);
    put(w, s->picture.opaque, sizeof s->picture.opaque);
    put(w, s->corners, sizeof s->corners);
    put(w, s->texels, 4 * (size_t)width * (size_t)height);
}

static void shuffle(world *w) {
    uint32_t all[SLOTS];
    for (uint32_t i = 0; i < SLOTS; i++) {
        const uint32_t j = below(w, i + 1);
        all[i] = all[j];
        all[j] = i;
    }
    w->shown = below(w, SLOTS + 1);
    memcpy(w->order, all, sizeof all);
    put_word(w, w->shown);
    put(w, w->order, 4 * w->shown);
}

static vd_camera aim(world *w, int width, int height) {
    const double degree = 3.14159265358979323846 / 180.0;
    double n[8] = {400000.125 + between(w, -60, 60),
                   5e6 + between(w, -60, 60),
                   between(w, -9, 30),
                   between(w, 0, 360),
                   between(w, -90, 90),
                   between(w, -20, 20),
                   between(w, 10, 120),
                   between(w, 0.01, 5)};
    const vd_camera camera = {
        .eye = vd_vec3_make(n[0], n[1], n[2]),
        .orientation = vd_orientation_from_angles(n[3] * degree, n[4] * degree, n[5] * degree),
        .projection = VD_PROJECTION_PERSPECTIVE,
        .lens = vd_lens_from_fov(n[6] * degree, width, height),
        .near_m = n[7]};
    put(w, n, sizeof n);
    put(w, &camera.orientation, sizeof camera.orientation);
    put(w, &camera.lens, sizeof camera.lens);
    return camera;
}

static vd_status draw(world *w, vd_context *context, vd_display *display) {
    const int width = 1 + (int)below(w, 200), height = 1 + (int)below(w, 150);
    put_word(w, (uint32_t)width);
    put_word(w, (uint32_t)height);
    const vd_camera camera = aim(w, width, height);
    vd_quad quads[SLOTS];
    int count = 0;
    vd_status status = vd_success();
    for (uint32_t i = 0; i < w->shown && status.code == VD_OK; i++) {
        const slot *s = &w->slots[w->order[i]];
        if (s->picture.width > 0) {
            quads[count] = (vd_quad){.picture = s->picture, .opacity = 255};
            status = vd_quad_place(&quads[count++], &camera, s->corners);
        }
    }
    vd_frame *frame = NULL;
    if (status.code == VD_OK) {
        status = vd_frame_create(context, width, height, 0, &frame);
    }
    if (status.code == VD_OK) {
        const uint32_t background = 0xFF306090u;
        const vd_display_def def = {.near_m = (float)camera.near_m};
        for (size_t i = 0; i < frame->stride * (size_t)frame->height; i++) {
            memcpy(frame->rgba + 4 * i, &background, 4);
        }
        status = vd_display_draw(display, NULL, frame, quads, count, &def);
        const uint64_t hash = display_scene_hash(frame);
        put_word(w, (uint32_t)count);
        put_word(w, (uint32_t)hash);
        put_word(w, (uint32_t)(hash >> 32));
    }
    vd_frame_destroy(&frame);
    return status;
}

int main(int argc, char **argv) {
    const uint32_t frames = argc > 2 ? (uint32_t)atoi(argv[2]) : 0;
    world *w = calloc(1, sizeof *w);
    FILE *file = argc > 2 ? fopen(argv[1], "wb") : NULL;
    if (w == NULL || file == NULL) {
        fprintf(stderr, "wasm_worlds: cannot write; use: wasm_worlds OUT FRAMES\n");
        return 1;
    }
    w->file = file;
    w->written = true;
    w->random = 5;
    vd_context *context = NULL;
    vd_display *display = NULL;
    vd_status status = vd_context_create(NULL, &context);
    if (status.code == VD_OK) {
        status = vd_display_create(context, &display);
    }
    put_word(w, frames);
    put_word(w, SLOTS);
    put_word(w, HEAP_BYTES);
    for (uint32_t i = 0; i < frames && status.code == VD_OK; i++) {
        const uint32_t changes = i == 0 ? 4 * SLOTS : below(w, 6);
        put_word(w, changes);
        for (uint32_t k = 0; k < changes; k++) {
            change(w);
        }
        shuffle(w);
        status = draw(w, context, display);
    }
    const bool written = fclose(file) == 0 && w->written;
    if (!written || status.code != VD_OK) {
        fprintf(stderr, "wasm_worlds: %s\n",
                status.code != VD_OK ? status.message : "cannot write");
    }
    vd_display_destroy(&display);
    vd_context_destroy(&context);
    free(w);
    return written && status.code == VD_OK ? 0 : 1;
}
