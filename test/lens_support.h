/* lens_support.h: what the tests of the lens methods share: random numbers, a picture, equality. */
#ifndef VEDUTA_TEST_LENS_SUPPORT_H
#define VEDUTA_TEST_LENS_SUPPORT_H

#include "support.h"
#include <veduta/veduta.h>

static inline double between(uint64_t *random, double low, double high) {
    return low + (high - low) * test_uniform(random);
}

static inline int pick(uint64_t *random, int count) {
    return (int)(test_random(random) % (uint64_t)count);
}

static inline vd_frame *draw_lens(vd_context *context, const vd_terrain_def *def,
                                  const vd_camera *camera, int width, int height,
                                  vd_frame_stats *stats) {
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, width, height, VD_PLANE_DEPTH | VD_PLANE_ID, &frame));
    assert_ok(vd_terrain_render(context, NULL, def, camera, frame, stats));
    return frame;
}

static inline void assert_same(const vd_frame *a, const vd_frame *b, const char *text, int scene,
                               const char *name) {
    for (int y = 0; y < a->height; y++) {
        for (int x = 0; x < a->width; x++) {
            const size_t i = (size_t)y * a->stride + (size_t)x;
            if (memcmp(a->rgba + 4 * i, b->rgba + 4 * i, 4) != 0 ||
                memcmp(a->depth + i, b->depth + i, 4) != 0 || a->id[i] != b->id[i]) {
                fail_msg("%s, scene %d, %s, pixel %d, %d: %02x%02x%02x%02x depth %.9g, but "
                         "%02x%02x%02x%02x depth %.9g",
                         text, scene, name, x, y, a->rgba[4 * i], a->rgba[4 * i + 1],
                         a->rgba[4 * i + 2], a->rgba[4 * i + 3], (double)a->depth[i],
                         b->rgba[4 * i], b->rgba[4 * i + 1], b->rgba[4 * i + 2], b->rgba[4 * i + 3],
                         (double)b->depth[i]);
            }
        }
    }
}

#endif
