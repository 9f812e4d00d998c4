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

static void assert_same_row(const void *a, const void *b, size_t bytes, const char *what, int level,
                            int row) {
    if (memcmp(a, b, bytes) != 0) {
        fail_msg("%s of level %d differ in row %d", what, level, row);
    }
}

static void assert_same_heights(const vd_lens_map *a, const vd_lens_map *b) {
    assert_int_equal(a->levels, b->levels);
    assert_memory_equal(&a->lowest, &b->lowest, sizeof a->lowest);
    assert_memory_equal(&a->highest, &b->highest, sizeof a->highest);
    for (int l = 0; l < a->levels; l++) {
        const vd_lens_ground *g = &a->ground[l], *h = &b->ground[l];
        assert_int_equal(g->columns, h->columns);
        assert_int_equal(g->rows, h->rows);
        assert_int_equal(g->top, h->top);
        for (int y = 0; y <= g->rows; y++) {
            assert_same_row(g->heights + (size_t)y * g->stride, h->heights + (size_t)y * h->stride,
                            ((size_t)g->columns + 1) * sizeof(float), "heights", l, y);
        }
        for (int y = 0; l > 0 && y < g->rows; y++) {
            const size_t at = (size_t)y * (size_t)g[-1].pitch[1];
            assert_same_row(vd_lens_maxima(a, l) + at, vd_lens_maxima(b, l) + at,
                            (size_t)g->columns * sizeof(float), "maxima", l, y);
        }
    }
}

static void assert_same_textures(const vd_lens_map *a, const vd_lens_map *b) {
    assert_int_equal(a->textures, b->textures);
    assert_memory_equal(a->texture_from_sample, b->texture_from_sample,
                        sizeof a->texture_from_sample);
    for (int i = 0; i < a->textures; i++) {
        const vd_lens_texture *s = &a->texture[i], *t = &b->texture[i];
        assert_int_equal(s->width, t->width);
        assert_int_equal(s->height, t->height);
        for (int y = -1; y <= s->height; y++) {
            const uint32_t *p = s->texels + (ptrdiff_t)y * s->stride - 1;
            const uint32_t *q = t->texels + (ptrdiff_t)y * t->stride - 1;
            assert_same_row(p, q, ((size_t)s->width + 2) * 4, "texels", i, y);
        }
    }
}

static const int thread_counts[] = {1, 2, 7};

static void twin_equals_reference(void **state) {
    (void)state;
    for (int t = 0; t < 3; t++) {
        for (vd_isa isa = VD_ISA_V2; isa <= vd_isa_best(); isa++) {
            uint64_t random = (uint64_t)(t * 100 + (int)isa);
            vd_context *context = test_context(thread_counts[t], isa);
            const size_t before = vd_context_memory(context).bytes_now;
            for (int i = 0; i < rounds(150); i++) {
                scene s;
                vd_lens_map map, reference;
                const bool large = i % 30 == 0;
                const int width = large ? 700 : 2 + (int)(test_random(&random) % 89);
                make_scene(context, &random, width, 2 + (int)(test_random(&random) % 69), &s);
                assert_ok(vd_lens_map_init_reference(context, &s.def, &reference));
                assert_ok(vd_lens_map_init(context, NULL, &s.def, &map));
                assert_same_heights(&map, &reference);
                for (int light = 0; light < 2; light++) {
                    assert_ok(vd_lens_map_light_reference(&reference, &s.def));
                    assert_ok(vd_lens_map_light(&map, NULL, &s.def));
                    assert_same_textures(&map, &reference);
                    s.def.light = vd_light_daylight(7.0 * test_uniform(&random), 0.3);
                    s.def.shading = true;
                }
                vd_lens_map_finish(&map);
                vd_lens_map_finish(&reference);
                vd_heightfield_destroy(context, &s.heightfield);
            }
            assert_int_equal(vd_context_memory(context).bytes_now, before);
            vd_context_destroy(&context);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(twin_equals_reference),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
