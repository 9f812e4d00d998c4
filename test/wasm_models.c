/* wasm_models OUT FRAMES: models, where instances of them stand around a camera, bricks of
 * particles, and the hashes of frames of them drawn natively over a picture, for
 * test/wasm/models.mjs. All little-endian; u32 number of models; of each: u32 bytes, its block; the
 * same of bricks f64 light[16], as vd_wasm_light_set takes it u32 frames; of each u32 width,
 * height; f64 camera[12]: eye, orientation, lens, near f64 corners[12] of a picture, texels
 * [8][8][4]; u32 how many instances are behind it u32 number of instances; of each: u32 model, f64
 * numbers[17], as vd_wasm_instance_add takes them; u32 number of bricks, which come last; of each:
 * u32 brick, f64 origin[3] u32 instances and bricks in sight, FNV-1a 64 of the RGBA rows without
 * padding (low word, high word) */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <veduta/placed.h>
#include "display_scenes.h"
#include "raster/texture_internal.h"
#include "splat/brick_pack.h"

enum { MODELS = 5, BRICKS = 9, MOST = 12, MOST_BRICKS = 6, RINGS = 10, SIDES = 14, SIDE = 8 };

typedef struct scene {
    FILE *file;
    bool written;
    uint64_t random;
    vd_context *context;
    vd_model *models[MODELS];
    uint8_t *bricks[BRICKS];
    size_t brick_bytes[BRICKS];
    vd_display *display;
    vd_placer *placer;
    vd_light light;
    uint8_t texels[SIDE * SIDE * 4];
} scene;

static void put(scene *s, const void *data, size_t bytes) {
    s->written = s->written && fwrite(data, 1, bytes, s->file) == bytes;
}

static void put_word(scene *s, uint32_t word) {
    put(s, &word, 4);
}

static double between(scene *s, double low, double high) {
    return (double)display_scene_between(&s->random, low, high);
}

static uint32_t below(scene *s, uint32_t count) {
    return (uint32_t)(display_scene_random(&s->random) % count);
}

static void make_texels(scene *s, bool opaque) {
    for (int i = 0; i < SIDE * SIDE; i++) {
        const uint32_t r = (uint32_t)display_scene_random(&s->random);
        const uint32_t alpha = opaque ? 255 : r >> 24;
        for (int c = 0; c < 3; c++) {
            s->texels[4 * i + c] = (uint8_t)((r >> (8 * c) & 255) % (alpha + 1));
        }
        s->texels[4 * i + 3] = (uint8_t)alpha;
    }
}

/* A lumpy ball, smooth or with holes, glass, coloured corners, or a cage of lines. */
static vd_status make_model(scene *s, int kind, vd_model **out) {
    static double positions[RINGS * SIDES][3];
    static float uvs[RINGS * SIDES][2], colors[RINGS * SIDES][3];
    static uint32_t triangles[2 * (RINGS - 1) * SIDES][3], lines[(RINGS - 1) * SIDES][2];
    uint32_t count = 0;
    for (uint32_t i = 0; i < RINGS * SIDES; i++) {
        const double u = (double)(i % SIDES) / SIDES, v = (double)(i / SIDES) / (RINGS - 1);
        const double x = 1 - 2 * v, ring = 1 - x * x, size = between(s, 2.5, 3);
        const double turn = 8 * u, a = turn < 4 ? 2 - turn : turn - 6; /* a square */
        positions[i][0] = size * ring * (a > 1 ? 1 : a < -1 ? -1 : a);
        positions[i][1] = size * ring * (turn < 4 ? 1 - 0.3 * a * a : 0.3 * a * a - 1);
        positions[i][2] = size * x;
        uvs[i][0] = (float)(3 * u);
        uvs[i][1] = (float)v;
        for (int c = 0; c < 3; c++) {
            colors[i][c] = (float)between(s, 0, 1);
        }
        if (i / SIDES + 1 < RINGS) {
            const uint32_t next = i / SIDES * SIDES + (i + 1) % SIDES;
            memcpy(triangles[count++], (uint32_t[3]){i, next, i + SIDES}, 12);
            memcpy(triangles[count++], (uint32_t[3]){next, next + SIDES, i + SIDES}, 12);
            memcpy(lines[i], (uint32_t[2]){i, i + SIDES}, 8);
        }
    }
    vd_material material = vd_material_default();
    vd_model_surface surface = {.name = "skin", .texture = -1};
    material.filter = VD_TEXTURE_TRILINEAR;
    vd_texture *texture = NULL;
    vd_status status = vd_success();
    if (kind == 1) {
        make_texels(s, false);
        surface.alpha_mode = VD_ALPHA_MASK;
        surface.alpha_cutoff = material.alpha_test = 0.5f;
        surface.texture = 0;
        status = vd_texture_create_from_texels(s->context, s->texels, SIDE, SIDE, &texture);
    } else if (kind == 2) {
        surface.alpha_mode = VD_ALPHA_BLEND;
        material.blend = true;
        material.alpha = 0.6f;
    }
    const char *name = "texture";
    const vd_model_source source = {.name = "lump",
                                    .format = "test",
                                    .vertex_count = RINGS * SIDES,
                                    .positions = (const double(*)[3])positions,
                                    .uvs = (const float(*)[2])uvs,
                                    .colors = kind == 3 ? (const float(*)[3])colors : NULL,
                                    .triangle_count = kind == 4 ? 0 : count,
                                    .triangles = (const uint32_t(*)[3])triangles,
                                    .line_count = kind == 4 ? (RINGS - 1) * SIDES : 0,
                                    .lines = (const uint32_t(*)[2])lines,
                                    .material_count = 1,
                                    .materials = &material,
                                    .surfaces = &surface,
                                    .texture_count = texture != NULL ? 1 : 0,
                                    .textures = &texture,
                                    .texture_names = &name};
    return status.code == VD_OK ? vd_model_create(s->context, &source, out) : status;
}

/* Makes all models, and writes their blocks. */
static vd_status make_models(scene *s) {
    vd_status status = vd_success();
    put_word(s, MODELS);
    for (int i = 0; i < MODELS && status.code == VD_OK; i++) {
        status = make_model(s, i, &s->models[i]);
        if (status.code != VD_OK) {
            break;
        }
        const size_t bytes = vd_model_packed_bytes(s->models[i]);
        void *block = vd_allocate(s->context, bytes, 1);
        if (block == NULL) {
            return vd_failure(VD_ERROR_MEMORY, "no memory");
        }
        vd_model_pack(s->models[i], block);
        put_word(s, (uint32_t)bytes);
        put(s, block, bytes);
        vd_release(s->context, block);
    }
    return status;
}

/* Blocks of every kernel, with and without sizes and colours of their own. */
static vd_status make_bricks(scene *s) {
    put_word(s, BRICKS);
    for (uint32_t i = 0; i < BRICKS; i++) {
        vd_brick_block_head head = {.magic = {'V', 'D', 'B', 'R', 'I', 'C', 'K', 1},
                                    .stands_for = i % 3 == 0 ? 1.0 : between(s, 1, 90),
                                    .count = 1 + below(s, i == 4 ? 9000 : 700),
                                    .kernel = i % VD_SPLAT_KERNEL_COUNT,
                                    .parts = i & VD_BLOCK_PARTS,
                                    .color = {200, 120, (uint8_t)(20 * i), (uint8_t)(255 - 15 * i)},
                                    .radius = (float)between(s, 0.01, 0.3),
                                    .radius_step = (float)between(s, 0, 1e-5),
                                    .opacity = (float)between(s, 0.2, 1)};
        for (int k = 0; k < 3; k++) {
            head.step[k] = (float)between(s, 1e-5, 4e-4);
        }
        const size_t bytes = vd_brick_block_layout(head.count, head.parts).size_bytes;
        uint8_t *block = vd_allocate(s->context, 1, bytes);
        if (block == NULL) {
            return vd_failure(VD_ERROR_MEMORY, "no memory");
        }
        for (size_t at = 0; at < bytes; at++) {
            block[at] = (uint8_t)display_scene_random(&s->random);
        }
        memcpy(block, &head, sizeof head);
        head.checksum = vd_brick_block_checksum(block, bytes);
        memcpy(block, &head, sizeof head);
        s->bricks[i] = block;
        s->brick_bytes[i] = bytes;
        put_word(s, (uint32_t)bytes);
        put(s, block, bytes);
    }
    return vd_success();
}

static vd_status make_brick(scene *s, const vd_camera *camera, vd_brick_block **out) {
    const uint32_t brick = below(s, BRICKS);
    const vd_vec3 way = vd_vec3_make(between(s, -20, 10), between(s, -20, 10), between(s, -5, 50));
    const vd_vec3 origin = vd_vec3_add(camera->eye, vd_quat_rotate(camera->orientation, way));
    put_word(s, brick);
    put(s, &origin, sizeof origin);
    return vd_brick_block_unpack(s->context, s->bricks[brick], s->brick_bytes[brick], origin, out);
}

static void make_light(scene *s) {
    const double altitude = between(s, 0.1, 1.4);
    s->light = vd_light_daylight(between(s, 0, 6), altitude);
    s->light.haze_m = 150;
    const vd_light *l = &s->light;
    const vd_linear colors[4] = {l->sun, l->ambient_up, l->ambient_down, l->horizon};
    put(s, &l->sun_direction, sizeof l->sun_direction);
    for (int i = 0; i < 4; i++) {
        const double rgb[3] = {(double)colors[i].r, (double)colors[i].g, (double)colors[i].b};
        put(s, rgb, sizeof rgb);
    }
    put(s, &l->haze_m, sizeof l->haze_m);
}

static vd_camera aim(scene *s, int width, int height) {
    vd_camera c = {.eye = vd_vec3_make(400000.125, 5e6, between(s, -9, 30)),
                   .orientation = vd_orientation_from_angles(between(s, 0, 6), between(s, -1, 1),
                                                             between(s, -0.3, 0.3)),
                   .projection = VD_PROJECTION_PERSPECTIVE,
                   .lens = vd_lens_from_fov(between(s, 0.2, 2), width, height),
                   .near_m = between(s, 0.01, 3)};
    put(s, &c.eye, sizeof c.eye);
    put(s, &c.orientation, sizeof c.orientation);
    put(s, &c.lens, sizeof c.lens);
    put(s, &c.near_m, sizeof c.near_m);
    return c;
}

static vd_quad make_picture(scene *s, const vd_camera *camera, vd_status *status) {
    vd_vec3 corners[4];
    const vd_vec3 at = vd_vec3_add(
        camera->eye, vd_quat_rotate(camera->orientation,
                                    vd_vec3_make(between(s, -4, 4), between(s, -4, 4), 12)));
    for (int i = 0; i < 4; i++) {
        corners[i] = vd_vec3_add(at, vd_vec3_make(i == 1 || i == 2 ? 6 : 0, 3, i >= 2 ? -5 : 0));
    }
    make_texels(s, false);
    put(s, corners, sizeof corners);
    put(s, s->texels, sizeof s->texels);
    vd_quad quad = {.picture = {s->texels, SIDE, SIDE, SIDE, {0, 0, 0, 0}}, .opacity = 255};
    *status = vd_quad_place(&quad, camera, corners);
    return quad;
}

static vd_placed make_instance(scene *s, const vd_camera *camera) {
    const uint32_t model = below(s, MODELS);
    const vd_vec3 way = vd_vec3_make(between(s, -20, 20), between(s, -20, 20), between(s, 0, 50));
    const vd_quat q = vd_orientation_from_angles(between(s, 0, 6), between(s, -1, 1), 0);
    double numbers[17] = {0};
    vd_placed p = {.model = s->models[model]};
    p.place.origin = vd_vec3_add(camera->eye, vd_quat_rotate(camera->orientation, way));
    memcpy(numbers, &p.place.origin, sizeof p.place.origin);
    for (int k = 0; k < 3; k++) {
        const vd_vec3 axis = vd_vec3_scale(vd_quat_rotate(q, vd_vec3_make(k == 0, k == 1, k == 2)),
                                           between(s, 0.5, 2));
        memcpy(numbers + 3 + 3 * k, &axis, sizeof axis);
    }
    numbers[12] = between(s, 0, 1);
    numbers[16] = below(s, 2);
    for (int k = 0; k < 3 && numbers[16] != 0; k++) {
        numbers[13 + k] = between(s, -1, 1);
    }
    for (int k = 0; k < 9; k++) {
        p.place.axes[k / 3][k % 3] = (float)numbers[3 + k];
    }
    p.place.sun = (float)numbers[12];
    p.place.has_ground = numbers[16] != 0;
    for (int k = 0; k < 3; k++) {
        p.place.ground[k] = (float)numbers[13 + k];
    }
    put_word(s, model);
    put(s, numbers, sizeof numbers);
    return p;
}

static vd_status draw(scene *s) {
    const int width = 1 + (int)below(s, 220), height = 1 + (int)below(s, 160);
    vd_placed placed[MOST + MOST_BRICKS];
    vd_brick_block *bricks[MOST_BRICKS] = {NULL};
    vd_status status = vd_success();
    put_word(s, (uint32_t)width);
    put_word(s, (uint32_t)height);
    const vd_camera camera = aim(s, width, height);
    const vd_quad quad = make_picture(s, &camera, &status);
    const uint32_t count = below(s, MOST + 1), behind = below(s, count + 1);
    put_word(s, behind);
    put_word(s, count);
    for (uint32_t i = 0; i < count; i++) {
        placed[i] = make_instance(s, &camera);
    }
    const uint32_t brick_count = below(s, MOST_BRICKS + 1);
    put_word(s, brick_count);
    for (uint32_t i = 0; i < brick_count && status.code == VD_OK; i++) {
        status = make_brick(s, &camera, &bricks[i]);
        placed[count + i] = (vd_placed){.brick = bricks[i]};
    }
    vd_frame *frame = NULL;
    if (status.code == VD_OK) {
        status = vd_frame_create(s->context, width, height, 0, &frame);
    }
    if (status.code != VD_OK) {
        return status;
    }
    const uint32_t background = 0xFF306090u;
    for (size_t i = 0; i < frame->stride * (size_t)height; i++) {
        memcpy(frame->rgba + 4 * i, &background, 4);
    }
    const vd_placed_window window = {frame->rgba, width, height, frame->stride};
    const vd_display_def def = {.near_m = (float)camera.near_m};
    int first = 0, second = 0;
    status = vd_placer_draw(s->placer, NULL, &s->light, &camera, placed, (int)behind, &window, NULL,
                            &first);
    if (status.code == VD_OK) {
        status = vd_display_draw(s->display, NULL, frame, &quad, 1, &def);
    }
    if (status.code == VD_OK) {
        status = vd_placer_draw(s->placer, NULL, &s->light, &camera, placed + behind,
                                (int)(count + brick_count - behind), &window, NULL, &second);
    }
    for (uint32_t i = 0; i < brick_count; i++) {
        vd_brick_block_destroy(&bricks[i]);
    }
    const uint64_t hash = display_scene_hash(frame);
    put_word(s, (uint32_t)(first + second));
    put_word(s, (uint32_t)hash);
    put_word(s, (uint32_t)(hash >> 32));
    vd_frame_destroy(&frame);
    return status;
}

int main(int argc, char **argv) {
    const uint32_t frames = argc > 2 ? (uint32_t)atoi(argv[2]) : 0;
    static scene s = {.written = true, .random = 9};
    s.file = argc > 2 ? fopen(argv[1], "wb") : NULL;
    if (s.file == NULL) {
        fprintf(stderr, "wasm_models: cannot write; use: wasm_models OUT FRAMES\n");
        return 1;
    }
    vd_status status = vd_context_create(NULL, &s.context);
    if (status.code == VD_OK) {
        status = vd_display_create(s.context, &s.display);
    }
    if (status.code == VD_OK) {
        status = vd_placer_create(s.context, &s.placer);
    }
    if (status.code == VD_OK) {
        status = make_models(&s);
    }
    if (status.code == VD_OK) {
        status = make_bricks(&s);
    }
    make_light(&s);
    put_word(&s, frames);
    for (uint32_t i = 0; i < frames && status.code == VD_OK; i++) {
        status = draw(&s);
    }
    const bool written = fclose(s.file) == 0 && s.written;
    if (!written || status.code != VD_OK) {
        fprintf(stderr, "wasm_models: %s\n",
                status.code != VD_OK ? status.message : "cannot write");
    }
    for (int i = 0; i < MODELS; i++) {
        vd_model_destroy(&s.models[i]);
    }
    for (int i = 0; i < BRICKS; i++) {
        vd_release(s.context, s.bricks[i]);
    }
    vd_placer_destroy(&s.placer);
    vd_display_destroy(&s.display);
    vd_context_destroy(&s.context);
    return written && status.code == VD_OK ? 0 : 1;
}
