/* test_classic.c: the classic picture: every method against an oracle that is written from the
 * definition alone, on any number of threads; golden hashes. */
#include "classic_scenes.h"
#include <stdio.h>
#include "core/real.h"

/* ---- the oracle ------------------------------------------------------------------------------
 * From the words of the definition, the other way round where it can be: back to front, every slice
 * painted down to the picture's bottom edge, the remainder by fmod, sin and cos by the C library.
 */

static double *oracle_slices(const vd_classic_def *def, size_t *count) {
    size_t capacity = 1 << 16, n = 0;
    double *zs = malloc(capacity * sizeof *zs);
    assert_non_null(zs);
    if (def->growth == 0.0) {
        float z = (float)def->z0;
        for (; z < (float)def->distance; z = (float)def->z0 + (float)n * (float)def->step) {
            assert_true(n < capacity);
            zs[n++] = z;
        }
    } else {
        double z = def->z0, delta = def->step;
        while (z < def->distance) {
            assert_true(n < capacity);
            zs[n++] = z;
            delta += def->growth;
            z += delta;
        }
    }
    *count = n;
    return zs;
}

static int oracle_modulo(float p, int size) {
    double rest = fmod(floor((double)p), (double)size);
    return (int)(rest < 0.0 ? rest + size : rest);
}

/* First row that a slice covers in column i, in [0, rows]; the cell goes to *cx, *cy. */
static int oracle_row(const vd_classic_def *def, const vd_heightfield *map, float z, int i,
                      int width, int rows, int *cx, int *cy) {
    float s = (float)sin(def->yaw_rad), c = (float)cos(def->yaw_rad), view = (float)def->view;
    float left[2] = {-c - s * view, s - c * view}, right[2] = {c - s * view, -s - c * view};
    float p[2], eye[2] = {(float)def->x, (float)def->y};
    for (int axis = 0; axis < 2; axis++) {
        float d = left[axis] + (float)i * ((right[axis] - left[axis]) / (float)width);
        p[axis] = eye[axis] + z * d;
        if (!isfinite(p[axis])) {
            return rows;
        }
    }
    *cx = oracle_modulo(p[0], map->width);
    *cy = oracle_modulo(p[1], map->height);
    float h = vd_heightfield_at(map, *cx, *cy);
    float v = ((float)def->height - h) * ((float)def->scale / z) + (float)def->horizon;
    if (isnan(v) || v >= (float)rows) {
        return rows;
    }
    return v < 0.0f ? 0 : (int)v;
}

static void oracle_render(const vd_classic_def *def, const vd_heightfield *map, vd_frame *frame) {
    size_t count = 0;
    double *zs = oracle_slices(def, &count);
    for (int i = 0; i < frame->width; i++) {
        for (int row = 0; row < frame->height; row++) {
            size_t at = (size_t)row * frame->stride + (size_t)i;
            memcpy(frame->rgba + 4 * at, &def->background, 4);
            frame->rgba[4 * at + 3] = 255;
            frame->depth[at] = 0.0f;
            frame->id[at] = 0;
        }
        for (size_t k = count; k-- > 0;) {
            float z = (float)zs[k];
            int cx = 0, cy = 0;
            int row = oracle_row(def, map, z, i, frame->width, frame->height, &cx, &cy);
            for (; row < frame->height; row++) {
                size_t at = (size_t)row * frame->stride + (size_t)i;
                memcpy(frame->rgba + 4 * at,
                       vd_heightfield_colors(map) + (size_t)cy * map->color_stride + cx, 3);
                frame->depth[at] = (float)def->z0 / z;
                frame->id[at] = 1;
            }
        }
    }
    free(zs);
}

/* ---- scenes ---------------------------------------------------------------------------------- */

typedef struct scene {
    const char *name;
    map_kind map;
    int width, height;
    double x, y, eye, yaw_degrees, horizon, scale, view, distance, z0, step, growth;
} scene;

#define U8_MAP                                                                                     \
    { 128, 128, VD_HEIGHT_U8, 1 }

static const scene scenes[] = {
    {"default", U8_MAP, 97, 61, 512, 800, 78, 0, 12, 30, 1, 300, 1, 0.5, 0},
    {"high", U8_MAP, 97, 61, 512, 800, 200, 0, 12, 30, 1, 300, 1, 0.5, 0},
    {"inside the ground", U8_MAP, 64, 40, 512, 800, 3, 0, 20, 30, 1, 300, 1, 0.5, 0},
    {"yaw 30", U8_MAP, 97, 61, 512.3, 800.7, 100, 30, 12, 30, 1, 300, 1, 0.5, 0},
    {"yaw 90", U8_MAP, 97, 61, 512, 800, 100, 90, 12, 30, 1, 300, 1, 0.5, 0},
    {"yaw 200", U8_MAP, 97, 61, 12.9, 0.1, 100, 200, 12, 30, 1, 300, 1, 0.5, 0},
    {"far outside", U8_MAP, 50, 61, 1e6, 1e6 + 0.3, 100, 45, 12, 30, 1, 300, 1, 0.5, 0},
    {"negative", U8_MAP, 50, 61, -777.7, -1e6, 100, 45, 12, 30, 1, 300, 1, 0.5, 0},
    {"beyond int32", U8_MAP, 20, 61, 3e9, -7e12, 100, 45, 12, 30, 1, 300, 1, 0.5, 0},
    {"beyond int64", U8_MAP, 20, 61, 1e20, -1e30, 100, 45, 12, 30, 1, 300, 1, 0.5, 0},
    {"beyond float", U8_MAP, 20, 61, 5, 5, 100, 45, 12, 30, 2, 3e38, 1e30, 1e37, 0},
    {"growing", U8_MAP, 97, 61, 512, 800, 78, 10, 12, 30, 1, 800, 1, 1, 0.005},
    {"growing from none", U8_MAP, 33, 61, 512, 800, 78, 10, 12, 30, 1, 800, 1, 0, 0.02},
    {"shrinking", U8_MAP, 33, 61, 512, 800, 78, 10, 12, 30, 1, 200, 1, 3, -0.01},
    {"narrow", U8_MAP, 97, 61, 512, 800, 78, 10, 12, 30, 2, 300, 1, 0.5, 0},
    {"wide", U8_MAP, 97, 61, 512, 800, 78, 10, 12, 30, 0.5, 300, 1, 0.5, 0},
    {"one cell", {1, 1, VD_HEIGHT_U8, 2}, 33, 20, 0.5, 0.5, 90, 30, 5, 9, 1, 90, 1, 0.5, 0},
    {"15 cells", {3, 5, VD_HEIGHT_U8, 3}, 33, 20, -4, 9.5, 90, 30, 5, 9, 1, 90, 1, 0.25, 0},
    {"no power of two",
     {100, 37, VD_HEIGHT_U8, 4},
     97,
     61,
     -9,
     5,
     90,
     77,
     9,
     30,
     1,
     300,
     1,
     0.5,
     0},
    {"no power far", {100, 37, VD_HEIGHT_U8, 4}, 20, 61, -9e9, 5e9, 90, 77, 9, 30, 1, 99, 1, 1, 0},
    {"16 bits", {100, 37, VD_HEIGHT_U16, 5}, 97, 61, 0, 0, 45e3, 300, 9, 0.06, 1, 300, 1, 0.5, 0},
    {"16 bits, mask", {64, 32, VD_HEIGHT_U16, 5}, 50, 61, 0, 0, 45e3, 3, 9, 0.06, 1, 300, 1, 1, 0},
    {"float", {100, 37, VD_HEIGHT_F32, 6}, 97, 61, 7.25, 8.5, 70, 111, 9, 30, 1, 300, 1, 0.5, 0},
    {"one pixel wide", U8_MAP, 1, 200, 512, 800, 78, 0, 12, 90, 1, 300, 1, 0.5, 0},
    {"one pixel", {100, 37, VD_HEIGHT_F32, 6}, 1, 1, 5, 8, 78, 0, -1e3, 90, 1, 300, 1, 0.5, 0},
    {"horizon far below", U8_MAP, 33, 40, 512, 800, 78, 0, 1e7, 30, 1, 300, 1, 0.5, 0},
    {"horizon far above", U8_MAP, 33, 40, 512, 800, 78, 0, -1e7, 30, 1, 300, 1, 0.5, 0},
    {"rows beyond int32", U8_MAP, 33, 40, 512, 800, 60, 0, 0, 1e12, 1, 300, 1, 0.5, 0},
    {"flat", U8_MAP, 33, 40, 512, 800, 60, 0, 20, 0, 1, 30, 1, 0.5, 0},
    {"upside down", U8_MAP, 33, 40, 512, 800, 60, 0, 20, -30, 1, 300, 1, 0.5, 0},
    {"nothing", U8_MAP, 33, 40, 512, 800, 60, 0, 20, 30, 1, 1, 1, 0.5, 0},
    /* nearly every slice shows, so far away that the last bit of a direction changes the cell */
    {"far slices", U8_MAP, 97, 200, 512, 800, 1e6, 30, 0, 60, 1, 1e6, 3e5, 2e3, 0},
    {"tiny z0", U8_MAP, 33, 40, 512, 800, 60, 0, 20, 30, 1, 9, 1e-40, 0.5, 0},
};

#define SCENE_COUNT (sizeof scenes / sizeof scenes[0])

static vd_classic_def scene_def(const scene *s) {
    vd_classic_def def = vd_classic_def_default();
    def.x = s->x;
    def.y = s->y;
    def.height = s->eye;
    def.yaw_rad = vd_radians(s->yaw_degrees);
    def.horizon = s->horizon;
    def.scale = s->scale;
    def.view = s->view;
    def.distance = s->distance;
    def.z0 = s->z0;
    def.step = s->step;
    def.growth = s->growth;
    return def;
}

static void assert_same_frames(const char *what, const vd_frame *a, const vd_frame *b) {
    for (int row = 0; row < a->height; row++) {
        for (int i = 0; i < a->width; i++) {
            size_t at = (size_t)row * a->stride + (size_t)i;
            if (memcmp(a->rgba + 4 * at, b->rgba + 4 * at, 4) != 0 || a->id[at] != b->id[at] ||
                memcmp(a->depth + at, b->depth + at, sizeof *a->depth) != 0) {
                fail_msg("%s: pixel %d, %d: id %u, depth %g; expected id %u, depth %g", what, i,
                         row, b->id[at], (double)b->depth[at], a->id[at], (double)a->depth[at]);
            }
        }
    }
    assert_int_equal(vd_frame_hash(a), vd_frame_hash(b));
}

/* Draws with every method and compares with `expected`. */
static void check_methods(vd_context *context, const char *name, const vd_heightfield *map,
                          const vd_classic_def *def, const vd_frame *expected) {
    for (int method = 0; method < VD_CLASSIC_METHOD_COUNT; method++) {
        vd_frame *frame = NULL;
        assert_ok(vd_frame_create(context, expected->width, expected->height,
                                  VD_PLANE_DEPTH | VD_PLANE_ID, &frame));
        memset(frame->rgba, 0x55, frame->stride * (size_t)frame->height * 4);
        assert_ok(
            vd_classic_render(context, NULL, map, def, (vd_classic_method)method, frame, NULL));
        char what[128];
        snprintf(what, sizeof what, "%s, %s, %d threads", name,
                 vd_classic_method_name((vd_classic_method)method), vd_context_threads(context));
        assert_same_frames(what, expected, frame);
        assert_int_equal(frame->object_count, 2);
        assert_int_equal(frame->object_ids[1], 1);
        vd_frame_destroy(&frame);
    }
}

static void methods_equal_oracle(void **state) {
    (void)state;
    const int threads[] = {1, 2, 7};
    for (size_t t = 0; t < 3; t++) {
        vd_context *context = test_context(threads[t], VD_ISA_AUTO);
        for (size_t i = 0; i < SCENE_COUNT; i++) {
            vd_classic_def def = scene_def(&scenes[i]);
            vd_heightfield *map = make_map(context, scenes[i].map);
            vd_frame *expected = NULL;
            assert_ok(vd_frame_create(context, scenes[i].width, scenes[i].height,
                                      VD_PLANE_DEPTH | VD_PLANE_ID, &expected));
            oracle_render(&def, map, expected);
            check_methods(context, scenes[i].name, map, &def, expected);
            vd_frame_destroy(&expected);
            vd_heightfield_destroy(context, &map);
        }
        vd_context_destroy(&context);
    }
}

/* Every number of slices and rows from 0 or 1 to 40: the scan's trees are never full. */
static void all_small_sizes(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_heightfield *map = make_map(context, small_map);
    for (int n = 0; n <= 40; n++) {
        vd_classic_def def = small_def(78.0);
        def.z0 = 40.0;
        def.step = 4.0;
        def.distance = 40.0 + 4.0 * n;
        assert_int_equal(vd_classic_slice_count(&def), n);
        vd_frame *expected = NULL;
        assert_ok(vd_frame_create(context, 5, 41 - n, VD_PLANE_DEPTH | VD_PLANE_ID, &expected));
        oracle_render(&def, map, expected);
        check_methods(context, "small", map, &def, expected);
        vd_frame_destroy(&expected);
    }
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

static scene random_scene(uint64_t *state) {
    scene s = {.name = "random"};
    s.map.width = 1 + (int)(test_random(state) % 90);
    s.map.height = 1 + (int)(test_random(state) % 90);
    s.map.type = (vd_height_type)(test_random(state) % VD_HEIGHT_TYPE_COUNT);
    s.map.seed = test_random(state) >> 40;
    s.width = 1 + (int)(test_random(state) % 70);
    s.height = 1 + (int)(test_random(state) % 70);
    double reach = test_random(state) % 4 == 0 ? 1e6 : 200.0;
    s.x = (test_uniform(state) - 0.5) * 2.0 * reach;
    s.y = (test_uniform(state) - 0.5) * 2.0 * reach;
    s.eye = test_uniform(state) * (s.map.type == VD_HEIGHT_U16 ? 70000.0 : 150.0);
    s.yaw_degrees = test_uniform(state) * 720.0 - 360.0;
    s.horizon = (test_uniform(state) - 0.3) * 150.0;
    s.scale = test_uniform(state) * (s.map.type == VD_HEIGHT_U16 ? 0.2 : 100.0);
    s.view = 0.2 + test_uniform(state) * 3.0;
    s.z0 = 0.1 + test_uniform(state) * 3.0;
    s.distance = 10.0 + test_uniform(state) * 200.0;
    s.step = 0.2 + test_uniform(state);
    s.growth = test_random(state) % 2 == 0 ? 0.0 : test_uniform(state) * 0.05;
    return s;
}

static void random_scenes(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    uint64_t seed = 20261121;
    for (int i = 0; i < 60; i++) {
        scene s = random_scene(&seed);
        vd_classic_def def = scene_def(&s);
        vd_heightfield *map = make_map(context, s.map);
        vd_frame *expected = NULL;
        assert_ok(
            vd_frame_create(context, s.width, s.height, VD_PLANE_DEPTH | VD_PLANE_ID, &expected));
        oracle_render(&def, map, expected);
        check_methods(context, "random", map, &def, expected);
        vd_frame_destroy(&expected);
        vd_heightfield_destroy(context, &map);
    }
    vd_context_destroy(&context);
}

/* The pictures themselves, as any machine must draw them. */
static void golden_hashes(void **state) {
    (void)state;
    const struct {
        double height, yaw_degrees, distance, step, growth;
        uint64_t hash;
    } golden[] = {
        {78, 0, 1000, 0.5, 0, 0x326d2afe245d381c},
        {200, 200, 1000, 0.5, 0, 0x491652b49aaeaf55},
        {78, 30, 800, 1, 0.005, 0xe7ff3a4b41838bad},
    };
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_heightfield *map = make_map(context, (map_kind){256, 256, VD_HEIGHT_U8, 1992});
    for (size_t i = 0; i < sizeof golden / sizeof golden[0]; i++) {
        vd_classic_def def = vd_classic_def_default();
        def.height = golden[i].height;
        def.yaw_rad = vd_radians(golden[i].yaw_degrees);
        def.distance = golden[i].distance;
        def.step = golden[i].step;
        def.growth = golden[i].growth;
        for (int method = 0; method < VD_CLASSIC_METHOD_COUNT; method++) {
            vd_frame *frame = NULL;
            assert_ok(vd_frame_create(context, 320, 200, 0, &frame));
            assert_ok(vd_classic_render(context, NULL, map, &def, (vd_classic_method)method, frame,
                                        NULL));
            if (vd_frame_hash(frame) != golden[i].hash) {
                fail_msg("golden picture %zu by %s has the hash %016llx", i,
                         vd_classic_method_name((vd_classic_method)method),
                         (unsigned long long)vd_frame_hash(frame));
            }
            vd_frame_destroy(&frame);
        }
    }
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(methods_equal_oracle),
        cmocka_unit_test(all_small_sizes),
        cmocka_unit_test(random_scenes),
        cmocka_unit_test(golden_hashes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
