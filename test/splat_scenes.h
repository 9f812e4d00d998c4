/* splat_scenes.h: what the tests of splatting draw. */
#ifndef VEDUTA_TEST_SPLAT_SCENES_H
#define VEDUTA_TEST_SPLAT_SCENES_H

#include <math.h>
#include <veduta/veduta.h>
#include "support.h"

#define CLOUD_MOST 6000

/* Arrays of every kind that a list of particles may have. */
typedef struct cloud {
    size_t count;
    float x[CLOUD_MOST], y[CLOUD_MOST], z[CLOUD_MOST];
    uint16_t x16[CLOUD_MOST], y16[CLOUD_MOST], z16[CLOUD_MOST];
    float radius[CLOUD_MOST], value[CLOUD_MOST], weight[CLOUD_MOST];
    uint16_t value16[CLOUD_MOST];
    uint8_t classes[CLOUD_MOST];
    vd_rgba8 color[CLOUD_MOST];
} cloud;

/* Looks along +y from the origin, x to the right and z up: at distance d a metre is `focal` / d
 * pixels. */
static inline vd_camera splat_camera(int width, int height, double focal) {
    vd_camera camera = {.eye = {0, 0, 0},
                        .orientation = vd_orientation_from_angles(0, 0, 0),
                        .lens = {focal, focal, 0.5 * width, 0.5 * height},
                        .near_m = 0.1,
                        .far_m = 1000};
    return camera;
}

/* One pixel a metre, pixel (0, 0)'s upper left corner at x = 0, z = 0, looking along +y. */
static inline vd_camera flat_view(void) {
    vd_camera camera = splat_camera(0, 0, 1.0);
    camera.projection = VD_PROJECTION_ORTHOGRAPHIC;
    return camera;
}

/* Particles in and around a box before the camera, some of them anything. */
static inline void fill_cloud(cloud *c, size_t count, uint64_t seed, double odd_share) {
    c->count = count;
    for (size_t i = 0; i < count; i++) {
        c->x[i] = (float)(10.0 * test_uniform(&seed) - 5.0);
        c->y[i] = (float)(6.0 * test_uniform(&seed) - 1.0);
        c->z[i] = (float)(8.0 * test_uniform(&seed) - 4.0);
        c->x16[i] = (uint16_t)test_random(&seed);
        c->y16[i] = (uint16_t)test_random(&seed);
        c->z16[i] = (uint16_t)test_random(&seed);
        const double size = test_uniform(&seed);
        c->radius[i] = (float)(0.05 * size * size * size * size);
        c->value[i] = (float)(test_uniform(&seed) * 100.0 - 5.0);
        c->weight[i] = (float)test_uniform(&seed);
        c->value16[i] = (uint16_t)test_random(&seed);
        c->classes[i] = (uint8_t)test_random(&seed);
        const uint64_t bytes = test_random(&seed);
        memcpy(&c->color[i], &bytes, 4);
        if (test_uniform(&seed) < odd_share) {
            static const float odd[] = {NAN, INFINITY, -INFINITY, 3e38f, -3e38f, 1e-40f, 0.0f, -1};
            const uint64_t pick = test_random(&seed);
            float *const arrays[] = {c->x, c->y, c->z, c->radius, c->value, c->weight};
            arrays[pick % 6][i] = odd[pick / 6 % 8];
        }
    }
}

static inline vd_splats cloud_splats(const cloud *c) {
    vd_splats splats = vd_splats_default();
    splats.count = c->count;
    splats.x = c->x;
    splats.y = c->y;
    splats.z = c->z;
    splats.radius = c->radius;
    splats.color = c->color;
    return splats;
}

static inline vd_frame *draw_splats(vd_context *context, const vd_splat_def *def,
                                    const vd_camera *camera, const vd_splats *splats, int count,
                                    int width, int height, vd_splat_stats *stats) {
    vd_splatter *splatter = NULL;
    vd_frame *frame = NULL;
    assert_ok(vd_splatter_create(context, &splatter));
    assert_ok(vd_frame_create(context, width, height, VD_PLANE_DEPTH | VD_PLANE_ID, &frame));
    assert_ok(vd_splatter_render(splatter, NULL, def, camera, splats, count, frame, stats));
    vd_splatter_destroy(&splatter);
    return frame;
}

static inline void assert_same_frames(const vd_frame *a, const vd_frame *b) {
    assert_int_equal(a->width, b->width);
    assert_int_equal(a->height, b->height);
    for (int y = 0; y < a->height; y++) {
        const size_t at = (size_t)y * a->stride;
        assert_memory_equal(a->rgba + 4 * at, b->rgba + 4 * at, 4 * (size_t)a->width);
        assert_memory_equal(a->depth + at, b->depth + at, 4 * (size_t)a->width);
        assert_memory_equal(a->id + at, b->id + at, 4 * (size_t)a->width);
    }
}

#endif
