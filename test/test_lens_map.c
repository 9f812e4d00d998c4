/* The lens map: the twin against the reference, and what must hold of either. */
#include <math.h>
#include <stdio.h>
#include "core/real.h"
#include "support.h"
#include "terrain/lens_map_internal.h"

static int rounds(int full) {
    return test_is_reduced() ? (full + 9) / 10 : full;
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

/* ---- properties ------------------------------------------------------------------------------ */

/* The bilinear height of a level at a position in its cells; −infinity at holes. */
static double height_at(const vd_lens_ground *g, double x, double y) {
    const int c = (int)x < g->columns ? (int)x : g->columns - 1;
    const int r = (int)y < g->rows ? (int)y : g->rows - 1;
    const float *a = g->heights + (size_t)r * g->stride + (size_t)c, *b = a + g->stride;
    const double u = x - c, v = y - r;
    if (!isfinite(a[0]) || !isfinite(a[1]) || !isfinite(b[0]) || !isfinite(b[1])) {
        return -(double)INFINITY;
    }
    const double top = a[0] * (1.0 - u) + a[1] * u, bottom = b[0] * (1.0 - u) + b[1] * u;
    return top * (1.0 - v) + bottom * v;
}

static void maxima_bound_all_levels(void **state) {
    (void)state;
    uint64_t random = 3;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    for (int i = 0; i < rounds(60); i++) {
        scene s;
        vd_lens_map map;
        make_scene(context, &random, 2 + (int)(test_random(&random) % 200),
                   2 + (int)(test_random(&random) % 200), &s);
        assert_ok(vd_lens_map_init(context, NULL, &s.def, &map));
        const vd_lens_ground *last = &map.ground[map.levels - 1];
        assert_int_equal(last->columns, 1);
        assert_int_equal(last->rows, 1);
        assert_int_equal(last->top, 0);
        for (int point = 0; point < 400; point++) {
            const int level = (int)(test_random(&random) % (uint64_t)map.levels);
            const vd_lens_ground *g = &map.ground[level];
            const double x = test_uniform(&random) * g->columns;
            const double y = test_uniform(&random) * g->rows;
            const double h = height_at(g, x, y);
            assert_true(h == -(double)INFINITY || (h >= map.lowest - 1e-3 && h <= map.highest));
            for (int r = 1; r <= g->top; r++) {
                const float bound =
                    g->maxima[g->offset[r] + ((int)y >> r) * g->pitch[r] + ((int)x >> r)];
                assert_true(h <= (double)bound + 1e-4);
                assert_true(bound <= map.highest);
            }
        }
        vd_lens_map_finish(&map);
        vd_heightfield_destroy(context, &s.heightfield);
    }
    vd_context_destroy(&context);
}

static vd_heightfield *make_map(vd_context *context, int width, int height, const float *heights,
                                const double *world) {
    vd_heightfield_def def = vd_heightfield_def_default();
    vd_heightfield *map = NULL;
    def.width = width;
    def.height = height;
    def.type = VD_HEIGHT_F32;
    def.heights = heights;
    def.height_stride = (size_t)width;
    if (world != NULL) {
        memcpy(def.world_from_sample, world, sizeof def.world_from_sample);
    }
    assert_ok(vd_heightfield_create(context, &def, &map));
    return map;
}

/* A constant stays, and so does a ramp, wherever all neighbours exist on all levels. */
static void means_are_kept(void **state) {
    (void)state;
    static float heights[129 * 97];
    vd_context *context = test_context(2, VD_ISA_AUTO);
    for (int ramp = 0; ramp < 2; ramp++) {
        for (int i = 0; i < 129 * 97; i++) {
            heights[i] = ramp ? (float)(2 * (i % 129) - 3 * (i / 129)) : 41.5f;
        }
        vd_lens_map map;
        vd_terrain_def def = vd_terrain_def_default();
        vd_heightfield *h = make_map(context, 129, 97, heights, NULL);
        def.heightfield = h;
        assert_ok(vd_lens_map_init(context, NULL, &def, &map));
        for (int l = 0; l < map.levels; l++) {
            const vd_lens_ground *g = &map.ground[l];
            for (int y = 0; y <= g->rows; y++) {
                for (int x = 0; x <= g->columns; x++) {
                    const bool inside = x > 1 && y > 1 && x < g->columns - 1 && y < g->rows - 1;
                    const float here = g->heights[(size_t)y * g->stride + (size_t)x];
                    if (!ramp) {
                        assert_true(here == 41.5f);
                    } else if (inside && l < 4) {
                        assert_float_equal(here, (2 * x - 3 * y) * (1 << l), 1e-3);
                    }
                }
            }
        }
        assert_true(ramp || (map.lowest == 41.5f && map.highest == 41.5f));
        vd_lens_map_finish(&map);
        vd_heightfield_destroy(context, &h);
    }
    vd_context_destroy(&context);
}

/* A byte that is decoded and encoded is the same, and both are near the exact curve. */
static void colors_come_back(void **state) {
    (void)state;
    for (uint32_t b = 0; b < 256; b++) {
        assert_int_equal(vd_srgb_byte_encode(vd_srgb_byte_decode(b)), b);
        assert_int_equal(vd_srgb_byte_encode(vd_srgb_decode((uint8_t)b)), b);
    }
    uint32_t last = 0;
    for (int i = 0; i <= 100000; i++) {
        const float x = (float)i / 100000.0f;
        const uint32_t e = vd_srgb_byte_encode(x);
        const double exact = vd_srgb_encode(x) / 257.0;
        assert_true(fabs(e - exact) <= 0.62);
        assert_true(e >= last);
        last = e;
    }
    assert_int_equal(vd_srgb_byte_encode(NAN), 0);
    assert_int_equal(vd_srgb_byte_encode(-1.0f), 0);
    assert_int_equal(vd_srgb_byte_encode(INFINITY), 255);
}

/* Level ground in full sun: one colour everywhere, of the same light as vd_light_shade. */
static void level_ground_is_lit_evenly(void **state) {
    (void)state;
    static float heights[40 * 30];
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_heightfield *h = make_map(context, 40, 30, heights, NULL);
    vd_terrain_def def = vd_terrain_def_default();
    def.heightfield = h;
    vd_lens_map map;
    assert_ok(vd_lens_map_init(context, NULL, &def, &map));
    assert_ok(vd_lens_map_light(&map, NULL, &def));
    const vd_linear lit =
        vd_light_shade(&def.light, vd_linear_from_rgba8((vd_rgba8){190, 190, 190, 255}),
                       vd_vec3_make(0.0, 0.0, 1.0), 1.0f);
    const float linear[3] = {lit.r, lit.g, lit.b};
    for (int size = 0; size < map.textures; size++) {
        for (int i = 0; i < 3; i++) {
            const int e = (int)(map.texture[size].texels[0] >> (8 * i) & 255);
            assert_true(abs(e - vd_round_16_to_8(vd_srgb_encode(linear[i]))) <= 1);
            assert_int_equal(map.texture[size].texels[0], map.texture[0].texels[0]);
        }
    }
    vd_lens_map_finish(&map);
    vd_heightfield_destroy(context, &h);
    vd_context_destroy(&context);
}

/* ---- a wall's shadow --------------------------------------------------------------------------
 */

#define SIDE 160

/* A tall square pillar's shadow ends where height / tan(altitude) says, in metres, away from the
 * sun, on any grid. */
static void shadows_are_as_long_as_they_should(void **state) {
    (void)state;
    static const double worlds[][6] = {
        {0, 1, 0, 0, 0, -1}, {0, 10, 0, 0, 0, -25},    {0, 30, 0, 0, 0, 20},    {5, 3, 4, 7, 4, -3},
        {0, -8, 3, 0, 2, 9}, {1e6, 0, 12, 2e6, 12, 0}, {0, 0.5, 0, 0, 0, -0.5},
    };
    static float heights[SIDE * SIDE];
    uint64_t random = 5;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    for (int i = 0; i < rounds(140); i++) {
        const double *m = worlds[i % 7];
        const double cell = fmin(hypot(m[1], m[4]), hypot(m[2], m[5]));
        const double exaggeration = i % 2 ? 1.0 : 0.5 + test_uniform(&random);
        const double altitude = vd_radians(20.0 + 40.0 * test_uniform(&random));
        const double length = cell * (20.0 + 30.0 * test_uniform(&random)); /* metres */
        memset(heights, 0, sizeof heights);
        for (int k = 0; k < 49; k++) {
            heights[(SIDE / 2 - 3 + k / 7) * SIDE + SIDE / 2 - 3 + k % 7] =
                (float)(length * tan(altitude) / exaggeration);
        }
        vd_heightfield *h = make_map(context, SIDE, SIDE, heights, m);
        const vd_vec3 sun = vd_sun_direction(7.0 * test_uniform(&random), altitude);
        vd_terrain_def def = vd_terrain_def_default();
        vd_lens_map map;
        def.heightfield = h;
        def.exaggeration = exaggeration;
        def.light.sun_direction = sun;
        assert_ok(vd_lens_map_init(context, NULL, &def, &map));
        assert_ok(vd_lens_map_light(&map, NULL, &def));
        const uint32_t lit = map.texture[0].texels[0];
        /* Away from the sun, in samples per metre. */
        const double det = m[1] * m[5] - m[2] * m[4], level = hypot(sun.x, sun.y);
        const double dc = -(m[5] * sun.x - m[2] * sun.y) / det / level;
        const double dr = -(m[1] * sun.y - m[4] * sun.x) / det / level;
        const double step = 1.0 / fmax(fabs(dc), fabs(dr)); /* metres a sample */
        for (int far = 0; far < 2; far++) {
            const double at = far ? length + 6.0 * step : length - 2.0 * step;
            const int c = (int)floor(SIDE / 2 + at * dc + 0.5);
            const int r = (int)floor(SIDE / 2 + at * dr + 0.5);
            if (c < 2 || r < 2 || c >= SIDE - 2 || r >= SIDE - 2) {
                continue;
            }
            const uint32_t color =
                map.texture[0].texels[(size_t)r * (size_t)map.texture[0].stride + (size_t)c];
            if ((far != 0) != (color == lit)) {
                fail_msg("world %d: the shadow is too %s", i % 7, far ? "long" : "short");
            }
        }
        vd_lens_map_finish(&map);
        vd_heightfield_destroy(context, &h);
    }
    vd_context_destroy(&context);
}

/* On the compass' square grid the general form is the published one but for its stride. */
static void general_steps_are_checked(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    static float heights[16 * 16];
    static uint8_t counts[16 * 16];
    vd_heightfield *h = make_map(context, 16, 16, heights, NULL);
    const double wrong[][3] = {{65, 0, 1}, {0, NAN, 1}, {1, 1, -1}, {1, 1, NAN}};
    for (int i = 0; i < 4; i++) {
        vd_shadow_def def = vd_shadow_def_default();
        def.step_columns = wrong[i][0];
        def.step_rows = wrong[i][1];
        def.step_rise = wrong[i][2];
        assert_int_equal(vd_shadow_count(context, NULL, h, &def, counts, 16).code,
                         VD_ERROR_ARGUMENT);
    }
    const vd_vec3 suns[] = {{0, 0, 1}, {1, 0, 0}, {0.6, 0, -0.8}, {0.6, 0, 0.8}};
    for (int i = 0; i < 4; i++) {
        vd_shadow_def def = vd_shadow_def_default();
        vd_shadow_def_aim(&def, h, suns[i], 1.0);
        assert_ok(vd_shadow_count(context, NULL, h, &def, counts, 16));
        for (int j = 0; j < 256; j++) {
            assert_int_equal(counts[j], 0);
        }
    }
    vd_shadow_def def = vd_shadow_def_default();
    vd_shadow_def_aim(&def, h, suns[3], 2.0);
    assert_float_equal(def.step_columns, 4.0, 1e-12);
    assert_float_equal(def.step_rows, 0.0, 1e-12);
    assert_float_equal(def.step_rise, 4.0 * (0.8 / 0.6) / 2.0, 1e-12);
    vd_heightfield_destroy(context, &h);
    vd_context_destroy(&context);
}

/* ---- memory, failures ------------------------------------------------------------------------ */

static void every_allocation_may_fail(void **state) {
    (void)state;
    for (int reference = 0; reference < 2; reference++) {
        for (int kind = 0; kind < 6; kind++) {
            for (int n = 1;; n++) {
                test_allocator allocator = {0};
                vd_context *context = test_failing_context(&allocator);
                uint64_t random = (uint64_t)kind;
                scene s;
                vd_lens_map map;
                make_scene(context, &random, 33, 21, &s);
                s.def.shading = s.def.shadows = true;
                s.def.light = vd_light_daylight(1.0, 0.5);
                const int live = allocator.live;
                allocator.fail_at = allocator.calls + n;
                vd_status status = reference ? vd_lens_map_init_reference(context, &s.def, &map)
                                             : vd_lens_map_init(context, NULL, &s.def, &map);
                if (status.code == VD_OK) {
                    status = reference ? vd_lens_map_light_reference(&map, &s.def)
                                       : vd_lens_map_light(&map, NULL, &s.def);
                    vd_lens_map_finish(&map);
                }
                const bool failed = allocator.calls >= allocator.fail_at;
                assert_int_equal(status.code, failed ? VD_ERROR_MEMORY : VD_OK);
                assert_int_equal(allocator.live, live);
                vd_heightfield_destroy(context, &s.heightfield);
                vd_context_destroy(&context);
                if (!failed) {
                    assert_true(n > 5);
                    break;
                }
            }
        }
    }
}

static void memory_is_bounded(void **state) {
    (void)state;
    enum { WIDTH = 1000, HEIGHT = 700 };
    uint64_t random = 9;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    float *heights = malloc(sizeof(float) * WIDTH * HEIGHT);
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        heights[i] = (float)(100.0 * test_uniform(&random));
    }
    vd_picture *picture = NULL;
    assert_ok(vd_picture_create(context, WIDTH, HEIGHT, 4, 8, &picture));
    memset(picture->data, 0xCC, picture->stride_bytes * HEIGHT);
    vd_heightfield_def def = vd_heightfield_def_default();
    def.width = WIDTH;
    def.height = HEIGHT;
    def.type = VD_HEIGHT_F32;
    def.heights = heights;
    def.height_stride = WIDTH;
    def.colors = picture;
    def.world_from_sample[1] = 10.0;
    def.world_from_sample[5] = -10.0;
    vd_terrain_def terrain = vd_terrain_def_default();
    vd_heightfield *h = NULL;
    const size_t before = vd_context_memory(context).bytes_now;
    assert_ok(vd_heightfield_create(context, &def, &h));
    terrain.heightfield = h;
    terrain.light = vd_light_daylight(1.0, 0.05);
    vd_context_memory_reset_peak(context);
    vd_lens_map map;
    assert_ok(vd_lens_map_init(context, NULL, &terrain, &map));
    const size_t held = vd_context_memory(context).bytes_now;
    for (int i = 0; i < 3; i++) {
        assert_ok(vd_lens_map_light(&map, NULL, &terrain));
        assert_int_equal(vd_context_memory(context).bytes_now, held);
    }
    assert_true((double)(held - before) <= 2.2 * 8.0 * WIDTH * HEIGHT);
    /* Lighting takes place where the textures will be. */
    assert_int_equal(vd_context_memory(context).bytes_peak, held);
    vd_lens_map_finish(&map);
    vd_heightfield_destroy(context, &h);
    vd_picture_destroy(&picture);
    vd_context_destroy(&context);
    free(heights);
}

static void jobs_stop(void **state) {
    (void)state;
    uint64_t random = 2;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_job *job = NULL;
    assert_ok(vd_job_create(context, &job));
    for (int i = 0; i < 6; i++) {
        scene s;
        vd_lens_map map;
        make_scene(context, &random, i < 3 ? 20 : 400, i < 3 ? 10 : 300, &s);
        const size_t held = vd_context_memory(context).bytes_now;
        vd_job_cancel(job);
        assert_int_equal(vd_lens_map_init(context, job, &s.def, &map).code, VD_ERROR_CANCELLED);
        assert_int_equal(vd_context_memory(context).bytes_now, held);
        vd_job_reset(job);
        assert_ok(vd_lens_map_init(context, job, &s.def, &map));
        vd_job_cancel(job);
        assert_int_equal(vd_lens_map_light(&map, job, &s.def).code, VD_ERROR_CANCELLED);
        vd_job_reset(job);
        assert_ok(vd_lens_map_light(&map, job, &s.def));
        vd_lens_map_finish(&map);
        vd_heightfield_destroy(context, &s.heightfield);
    }
    vd_job_destroy(&job);
    vd_context_destroy(&context);
}

static void what_cannot_be_drawn_is_refused(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    static const uint8_t bytes[16];
    static const float heights[16];
    vd_lens_map map;
    vd_terrain_def terrain = vd_terrain_def_default();
    vd_heightfield *h = NULL;
    vd_heightfield_def def = vd_heightfield_def_default();
    def.width = def.height = 4;
    def.heights = bytes;
    def.height_stride = 4;
    def.type = VD_HEIGHT_U8;
    assert_ok(vd_heightfield_create(context, &def, &h));
    terrain.heightfield = h;
    assert_int_equal(vd_lens_map_init(context, NULL, &terrain, &map).code, VD_ERROR_ARGUMENT);
    vd_heightfield_destroy(context, &h);
    terrain.heightfield = h = make_map(context, 16, 1, heights, NULL);
    assert_int_equal(vd_lens_map_init(context, NULL, &terrain, &map).code, VD_ERROR_ARGUMENT);
    vd_heightfield_destroy(context, &h);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(twin_equals_reference),
        cmocka_unit_test(maxima_bound_all_levels),
        cmocka_unit_test(means_are_kept),
        cmocka_unit_test(colors_come_back),
        cmocka_unit_test(level_ground_is_lit_evenly),
        cmocka_unit_test(shadows_are_as_long_as_they_should),
        cmocka_unit_test(general_steps_are_checked),
        cmocka_unit_test(every_allocation_may_fail),
        cmocka_unit_test(memory_is_bounded),
        cmocka_unit_test(jobs_stop),
        cmocka_unit_test(what_cannot_be_drawn_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
