/* The lens map: the twin against the reference, and what must hold of either. */
#include <math.h>
#include <stdio.h>
#include "core/real.h"
#include "support.h"
#include "terrain/lens_map_internal.h"

static int rounds(int full) {
    return getenv("VEDUTA_TEST_REDUCED") != NULL ? (full + 9) / 10 : full;
}

/* A random scene: the heightfield is the test's, def points at it. */
typedef struct scene {
    vd_heightfield *heightfield;
    vd_colormap colormap;
    vd_terrain_def def;
} scene;

static float random_height(uint64_t *random, int kind, int x, int y) {
    const double u = test_uniform(random);
    if (kind >= 3 && u < 0.06) {
        return NAN;
    }
    return (float)(kind % 3 == 0   ? 300.0 * u - 100.0
                   : kind % 3 == 1 ? 80.0 * sin(0.2 * x) * cos(0.13 * y) + u
                                   : (x / 7 + y / 5) % 2 * 40.0);
}

static void random_transform(uint64_t *random, double m[6], double scale) {
    const double angle = test_uniform(random) * 6.0;
    const double stretch = 0.5 + test_uniform(random);
    m[0] = test_uniform(random) * 20.0 - 10.0;
    m[3] = test_uniform(random) * 20.0 - 10.0;
    m[1] = scale * cos(angle);
    m[4] = scale * sin(angle);
    m[2] = scale * stretch * sin(angle + 0.2);
    m[5] = -scale * stretch * cos(angle + 0.2);
}

static void make_scene(vd_context *context, uint64_t *random, int width, int height, scene *out) {
    float *heights = malloc((size_t)width * (size_t)height * sizeof *heights);
    const int kind = (int)(test_random(random) % 7);
    for (int i = 0; i < width * height; i++) {
        heights[i] = kind == 6 ? NAN : random_height(random, kind, i % width, i / width);
    }
    vd_heightfield_def def = vd_heightfield_def_default();
    def.width = width;
    def.height = height;
    def.type = VD_HEIGHT_F32;
    def.heights = heights;
    def.height_stride = (size_t)width;
    if (test_random(random) % 2 == 0) {
        random_transform(random, def.world_from_sample, 1.0 + 30.0 * test_uniform(random));
    }
    vd_picture *picture = NULL;
    double placed[6];
    if (test_random(random) % 3 != 0) {
        const bool same = test_random(random) % 2 == 0;
        const int w = same ? width : 1 + (int)(test_random(random) % 100);
        const int h = same ? height : 1 + (int)(test_random(random) % 100);
        assert_ok(vd_picture_create(context, w, h, 4, 8, &picture));
        const uint64_t holes = test_random(random) % 3;
        for (int i = 0; i < w * h; i++) {
            uint8_t *p =
                (uint8_t *)picture->data + (size_t)(i / w) * picture->stride_bytes + i % w * 4;
            const uint64_t r = test_random(random);
            memcpy(p, &r, 4);
            p[3] = holes == 0 || r >> 40 & 3 ? 255 : p[3];
        }
        def.colors = picture;
        if (!same && test_random(random) % 2 == 0) {
            random_transform(random, placed, 0.2 + test_uniform(random));
            if (test_random(random) % 2 == 0) {
                placed[2] = placed[4] = 0.0;
                placed[5] = placed[5] != 0.0 ? placed[5] : 1.0;
            }
            def.color_from_sample = placed;
        }
    }
    assert_ok(vd_heightfield_create(context, &def, &out->heightfield));
    vd_picture_destroy(&picture);
    free(heights);
    out->def = vd_terrain_def_default();
    out->def.heightfield = out->heightfield;
    if (test_random(random) % 4 != 0) {
        assert_true(
            vd_colormap_find(vd_colormap_name((int)(test_random(random) % 7)), &out->colormap));
        out->def.colormap = &out->colormap;
    }
    out->def.exaggeration = test_random(random) % 2 == 0 ? 1.0 : 0.3 + 3.0 * test_uniform(random);
    out->def.shading = test_random(random) % 5 != 0;
    out->def.shadows = test_random(random) % 4 != 0;
    out->def.light =
        vd_light_daylight(7.0 * test_uniform(random), 1.7 * test_uniform(random) - 0.1);
}

static void smoke(void **state) {
    (void)state;
    uint64_t random = 1;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const size_t before = vd_context_memory(context).bytes_now;
    for (int i = 0; i < rounds(300); i++) {
        scene s;
        vd_lens_map map;
        make_scene(context, &random, 2 + (int)(test_random(&random) % 89),
                   2 + (int)(test_random(&random) % 69), &s);
        assert_ok(vd_lens_map_init_reference(context, &s.def, &map));
        assert_ok(vd_lens_map_light_reference(&map, &s.def));
        vd_lens_map_finish(&map);
        vd_heightfield_destroy(context, &s.heightfield);
    }
    assert_int_equal(vd_context_memory(context).bytes_now, before);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(smoke),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
