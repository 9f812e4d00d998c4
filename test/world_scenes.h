/* world_scenes.h: a world for tests: hills, balls half in them, a sprite and a line. */
#ifndef VEDUTA_TEST_WORLD_SCENES_H
#define VEDUTA_TEST_WORLD_SCENES_H

#include "raster_scenes.h"
#include "world/world_renderer.h"

enum { WIDTH = 150, HEIGHT = 110, CELLS = 129 };

/* Hills over 1,280 m around a middle. */
static inline vd_heightfield *hills(vd_context *context, vd_vec3 middle) {
    static float heights[CELLS * CELLS];
    for (int r = 0; r < CELLS; r++) {
        for (int c = 0; c < CELLS; c++) {
            const double x = (c - 64) * 0.11, y = (r - 64) * 0.07;
            heights[r * CELLS + c] =
                (float)(middle.z + 40.0 * sin(x) * cos(y) + 15.0 * sin(2.3 * x + y));
        }
    }
    vd_heightfield_def def = vd_heightfield_def_default();
    def.width = def.height = CELLS;
    def.height_stride = CELLS;
    def.type = VD_HEIGHT_F32;
    def.heights = heights;
    const double place[6] = {middle.x - 640, 10, 0, middle.y + 640, 0, -10};
    memcpy(def.world_from_sample, place, sizeof place);
    vd_heightfield *map = NULL;
    assert_ok(vd_heightfield_create(context, &def, &map));
    return map;
}

static inline vd_model *ball(vd_context *context) {
    static double positions[9 * 16][3];
    static uint32_t triangles[8 * 16 * 2][3];
    for (int r = 0; r <= 8; r++) {
        for (int s = 0; s < 16; s++) {
            const double a = 3.14159265358979 * r / 8, b = 6.28318530717959 * s / 16;
            positions[r * 16 + s][0] = 6 * sin(a) * cos(b);
            positions[r * 16 + s][1] = 6 * sin(a) * sin(b);
            positions[r * 16 + s][2] = 6 - 6 * cos(a);
        }
    }
    size_t count = 0;
    for (uint32_t r = 0; r < 8; r++) {
        for (uint32_t s = 0; s < 16; s++) {
            const uint32_t n = (s + 1) % 16, a = r * 16, b = a + 16;
            const uint32_t made[2][3] = {{a + s, a + n, b + s}, {a + n, b + n, b + s}};
            memcpy(triangles[count], made, sizeof made);
            count += 2;
        }
    }
    const vd_model_source source = {.name = "ball",
                                    .format = "test",
                                    .vertex_count = 9 * 16,
                                    .positions = (const double(*)[3])positions,
                                    .triangle_count = count,
                                    .triangles = (const uint32_t(*)[3])triangles};
    vd_model *model = NULL;
    assert_ok(vd_model_create(context, &source, &model));
    return model;
}

/* A world of hills with balls, a sprite and a line on them, moved as a whole. */
static inline vd_world *make_world(vd_context *context, const vd_heightfield *map, vd_vec3 middle,
                                   int balls, uint64_t seed) {
    vd_world_def def = vd_world_def_default();
    def.terrain.heightfield = map;
    vd_world *world = NULL;
    assert_ok(vd_world_create(context, &def, &world));
    vd_model *model = ball(context);
    uint32_t number = 0, picture = 0;
    vd_instance_def instance = {0};
    vd_model_bounds(model, &instance.min, &instance.max);
    assert_ok(vd_world_add_model(world, &model, &number));
    assert_null(model);
    vd_object *object = NULL;
    for (int i = 0; i < balls; i++) {
        const double x = floor(1100 * (test_uniform(&seed) - 0.5)) + middle.x;
        const double y = floor(1100 * (test_uniform(&seed) - 0.5)) + middle.y;
        const double z = floor(vd_world_ground(world, x, y) - middle.z) - 3 + middle.z;
        const vd_quat turn =
            vd_quat_from_axis_angle(vd_vec3_make(0, 0, 1), 6 * test_uniform(&seed));
        const vd_matrix turned = vd_matrix_rotation(turn);
        const vd_matrix moved = vd_matrix_translation(vd_vec3_make(x, y, z));
        instance.model = number;
        instance.transform = vd_matrix_multiply(&moved, &turned);
        assert_ok(vd_instance_create(context, &instance, &object));
        assert_ok(vd_world_add(world, &object));
    }
    uint8_t pixels[8 * 8 * 4];
    for (int i = 0; i < 64; i++) {
        const bool in = (i % 8 - 4) * (i % 8 - 4) + (i / 8 - 4) * (i / 8 - 4) < 12;
        const uint8_t texel[4] = {200, 40, 30, in ? 255 : 0};
        memcpy(pixels + 4 * i, texel, 4);
    }
    const vd_picture red = {.context = context,
                            .width = 8,
                            .height = 8,
                            .channels = 4,
                            .bits = 8,
                            .stride_bytes = 32,
                            .data = pixels};
    assert_ok(vd_world_add_picture(world, &red, &picture));
    const vd_sprite_def sprite = {
        picture, vd_vec3_make(middle.x + 20, middle.y - 180, middle.z + 9), 40, 50, false};
    assert_ok(vd_sprite_create(context, &sprite, &object));
    assert_ok(vd_world_add(world, &object));
    const vd_vec3 points[3] = {{middle.x - 200, middle.y - 200, middle.z + 40},
                               {middle.x + 100, middle.y - 100, middle.z + 45},
                               {middle.x + 250, middle.y + 180, middle.z + 40}};
    const vd_line_def line = {points, 3, false, 2.5, {10, 20, 220, 255}};
    assert_ok(vd_line_create(context, &line, &object));
    assert_ok(vd_world_add(world, &object));
    assert_ok(vd_world_arrange(world, NULL));
    return world;
}

static inline vd_camera looking(vd_vec3 middle) {
    vd_camera camera = {.near_m = 1.0};
    camera.eye = vd_vec3_add(middle, vd_vec3_make(-30, -420, 130));
    camera.orientation = vd_orientation_from_angles(0.1, -0.25, 0.0);
    camera.lens = vd_lens_from_fov(0.9, WIDTH, HEIGHT);
    return camera;
}

#endif
