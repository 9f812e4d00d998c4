/* test_march.c: the march against the reference, byte for byte: random cameras over random maps, at
 * every SIMD level and on several thread counts; a proof that no slice it passed over was visible;
 * what it allocates. */
#include <math.h>
#include <stdio.h>
#include "support.h"

/* `vectors`: first slice, last slice and hidden row of each lane. */
static void check_skipped(const void *setup, const void *packet, const void *vectors,
                          uint32_t lanes);
#define VD_MARCH_SKIPPED(setup, p, first, end, hidden, lanes)                                      \
    do {                                                                                           \
        const vd_wide_f32 vectors[3] = {first, end, hidden};                                       \
        check_skipped(setup, p, vectors, lanes);                                                   \
    } while (0)
#define TABLE proving_kernels
#include "terrain/classic_march.inl"

/* ---- maps ------------------------------------------------------------------------------------ */

/* Half the maps are hills, the others noise, steps or one height with rare spikes: what a
 * pyramid finds easy, hard, and neither. Heights of all sizes; float ones with holes. */
static vd_heightfield *random_map(vd_context *context, uint64_t *random, int width, int height,
                                  vd_height_type type) {
    const size_t count = (size_t)width * (size_t)height;
    const int kind = (int)(test_random(random) % 6);
    const double waves = 1.0 + (double)(test_random(random) % 5);
    const double lift = type == VD_HEIGHT_F32 ? test_uniform(random) * 400.0 - 200.0 : 0.0;
    const double range = type == VD_HEIGHT_U16 ? 60000.0 : 200.0;
    void *heights = malloc(count * 4);
    vd_picture *colors = NULL;
    assert_non_null(heights);
    assert_ok(vd_picture_create(context, width, height, 3, 8, &colors));
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            const size_t i = (size_t)y * (size_t)width + (size_t)x;
            const double u = 6.283185307 * x / width, v = 6.283185307 * y / height;
            double h = kind == 0   ? test_uniform(random)
                       : kind == 1 ? ((x / 8 + y / 8) % 2 == 0 ? 0.2 : 0.7)
                       : kind == 2 ? (test_random(random) % 211 == 0 ? 1.0 : 0.1)
                                   : 0.5 + 0.25 * sin(waves * u) * cos(waves * v) +
                                         0.2 * test_uniform(random) * sin(u + 3.0 * v);
            h *= range;
            if (type == VD_HEIGHT_U8) {
                ((uint8_t *)heights)[i] = (uint8_t)h;
            } else if (type == VD_HEIGHT_U16) {
                ((uint16_t *)heights)[i] = (uint16_t)h;
            } else {
                const bool hole = kind != 5 && test_random(random) % 17 == 0;
                ((float *)heights)[i] = hole ? -INFINITY : (float)(h + lift);
            }
            uint8_t *color = (uint8_t *)colors->data + (size_t)y * colors->stride_bytes + 3 * x;
            const uint64_t r = test_random(random);
            memcpy(color, &r, 3);
        }
    }
    if (type == VD_HEIGHT_F32 && test_random(random) % 3 == 0) {
        ((float *)heights)[test_random(random) % count] = 3e38f;
        ((float *)heights)[test_random(random) % count] = -3e38f;
    }
    vd_heightfield_def def = vd_heightfield_def_default();
    def.width = width;
    def.height = height;
    def.type = type;
    def.heights = heights;
    def.height_stride = (size_t)width;
    def.wraps = true;
    def.colors = colors;
    vd_heightfield *map = NULL;
    assert_ok(vd_heightfield_create(context, &def, &map));
    vd_picture_destroy(&colors);
    free(heights);
    return map;
}

static int random_side(uint64_t *random) {
    switch (test_random(random) % 6) {
    case 0:
        return 1 + (int)(test_random(random) % 3);
    case 1:
        return 1 << test_random(random) % 9;
    case 2:
        return 1 + (int)(test_random(random) % 600);
    default:
        return 1 + (int)(test_random(random) % 100);
    }
}

/* ---- cameras --------------------------------------------------------------------------------- */

static double between(uint64_t *random, double low, double high) {
    return low + (high - low) * test_uniform(random);
}

static double pick(uint64_t *random, const double *values, size_t count) {
    return values[test_random(random) % count];
}

/* `slices` bounds the schedule's length, about. */
static vd_classic_def random_camera(uint64_t *random, const vd_heightfield *map, double slices) {
    static const double reaches[] = {20.0, 200.0, 200.0, 5000.0, 1e5, 1e6};
    static const double steps[] = {0.01, 0.1, 0.1, 0.25, 0.5, 1.0, 1.0, 3.0, 40.0};
    static const double turns[] = {0.0, 0.7853981633974483, 1.5707963267948966, 3.1415926535897931};
    vd_classic_def def = vd_classic_def_default();
    const double reach = pick(random, reaches, 6);
    def.x = between(random, -reach, reach);
    def.y = between(random, -reach, reach);
    if (test_random(random) % 3 == 0) {
        def.x = floor(def.x);
        def.y = floor(def.y);
    }
    const double range = (double)map->max - map->min + 1.0;
    const double tall = range < 1e5 ? range : 300.0;
    def.height = (map->min > -1e5f ? (double)map->min : 0.0) + between(random, -0.3, 2.0) * tall;
    if (test_random(random) % 4 == 0) {
        def.height = floor(def.height);
    }
    def.yaw_rad = between(random, -7.0, 7.0);
    if (test_random(random) % 4 == 0) {
        def.yaw_rad = pick(random, turns, 4);
    }
    def.horizon = between(random, -60.0, 120.0);
    if (test_random(random) % 12 == 0) {
        def.horizon = between(random, -1e6, 1e6);
    }
    def.scale = between(random, 1.0, 60.0) * (map->height_type == VD_HEIGHT_U16 ? 0.01 : 1.0);
    if (test_random(random) % 12 == 0) {
        def.scale = exp(between(random, -20.0, 20.0));
    }
    def.view = exp(between(random, log(0.05), log(8.0)));
    def.z0 = test_random(random) % 3 == 0 ? between(random, 0.01, 50.0) : 1.0;
    def.step = test_random(random) % 3 == 0 ? between(random, 0.01, 2.0) : pick(random, steps, 9);
    def.distance = def.z0 + def.step * between(random, 1.0, slices);
    if (test_random(random) % 4 == 0) {
        def.growth = between(random, 0.0, 0.05);
        if (test_random(random) % 4 == 0) {
            def.growth = -def.growth * def.step;
            def.distance = def.z0 + def.step * 5.0;
        }
    }
    if (test_random(random) % 40 == 0) {
        def.scale = -def.scale;
    }
    if (test_random(random) % 40 == 0) {
        def.x *= 1e8;
    }
    if (test_random(random) % 20 == 0) { /* next to the map's corner, along its edges */
        static const double tiny[] = {0.0, 1e-42, -1e-42, 1e-30, -1e-12, -1e-7, 1e-7};
        def.x = pick(random, tiny, 7);
        def.y = pick(random, tiny, 7);
        def.yaw_rad = pick(random, turns, 4);
    }
    return def;
}

/* Any of the options, each as often as not. */
static void choose_quality(uint64_t *random, vd_classic_def *def) {
    def->filter = (vd_filter)(test_random(random) % 2);
    def->mip = test_random(random) % 2 == 0;
    def->smooth = test_random(random) % 2 == 0;
    def->samples = test_random(random) % 8 != 0 ? 0 : test_random(random) % 2 == 0 ? 4 : 8;
}

static void describe(const vd_classic_def *def, const vd_heightfield *map, const vd_frame *frame,
                     char *out, size_t out_bytes) {
    snprintf(
        out, out_bytes,
        "%d x %d type %u, frame %d x %d, x %.9g y %.9g h %.9g yaw %.9g horizon %.9g scale "
        "%.9g view %.9g z0 %.9g step %.9g growth %.9g distance %.9g, filter %d mip %d smooth %d "
        "samples %d",
        map->width, map->height, map->height_type, frame->width, frame->height, def->x, def->y,
        def->height, def->yaw_rad, def->horizon, def->scale, def->view, def->z0, def->step,
        def->growth, def->distance, (int)def->filter, def->mip, def->smooth, def->samples);
}

/* ---- comparing ------------------------------------------------------------------------------- */

static void assert_same(const vd_frame *expected, const vd_frame *got, const char *who,
                        const vd_classic_def *def, const vd_heightfield *map) {
    for (int row = 0; row < expected->height; row++) {
        const size_t at = (size_t)row * expected->stride;
        const size_t bytes = 4 * (size_t)expected->width;
        if (memcmp(expected->rgba + 4 * at, got->rgba + 4 * at, bytes) != 0 ||
            (got->depth != NULL && memcmp(expected->depth + at, got->depth + at, bytes) != 0) ||
            (got->id != NULL && memcmp(expected->id + at, got->id + at, bytes) != 0)) {
            char scene[512];
            describe(def, map, expected, scene, sizeof scene);
            fail_msg("%s: row %d differs: %s", who, row, scene);
        }
    }
    assert_int_equal(got->object_count, 2);
}

static vd_frame *dirty_frame(vd_context *context, int width, int height, unsigned planes) {
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, width, height, planes, &frame));
    memset(frame->rgba, 0x55, frame->stride * (size_t)height * 4);
    if (frame->depth != NULL) {
        memset(frame->depth, 0x55, frame->stride * (size_t)height * 4);
    }
    if (frame->id != NULL) {
        memset(frame->id, 0x55, frame->stride * (size_t)height * 4);
    }
    return frame;
}

/* A context and a renderer of the current map for each SIMD level and thread count. */
typedef struct crew_member {
    vd_context *context;
    vd_classic_renderer *renderer;
    vd_march_kernels ahead; /* of its level, with the march for large maps in place of the other */
    char name[32];
} crew_member;

#define MAX_CREW 9

static int make_crew(crew_member *members) {
    static const int threads[] = {1, 2, 7};
    int count = 0;
    for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
        for (int t = 0; t < 3; t++) {
            crew_member *m = &members[count++];
            m->context = test_context(threads[t], (vd_isa)isa);
            m->renderer = NULL;
            m->ahead = *vd_march_kernels_for((vd_isa)isa);
            memcpy(m->ahead.march, m->ahead.ahead, sizeof m->ahead.march);
            snprintf(m->name, sizeof m->name, "%s, %d threads", vd_isa_name((vd_isa)isa),
                     threads[t]);
        }
    }
    return count;
}

static int scaled(int count) {
    return test_is_reduced() ? count / 10 : count;
}

/* Draws one scene with the reference and with `draws` members of the crew. */
static void compare_scene(crew_member *crew, int members, int draws, uint64_t *random,
                          const vd_heightfield *map, const vd_classic_def *def, int width,
                          int height) {
    vd_frame *expected = NULL;
    const unsigned planes = VD_PLANE_DEPTH | VD_PLANE_ID;
    assert_ok(vd_frame_create(crew[0].context, width, height, planes, &expected));
    assert_ok(
        vd_classic_render(crew[0].context, NULL, map, def, VD_CLASSIC_REFERENCE, expected, NULL));
    for (int i = 0; i < draws; i++) {
        crew_member *m = &crew[test_random(random) % (uint64_t)members];
        const unsigned wanted = (unsigned)(test_random(random) % 4);
        vd_frame *frame = dirty_frame(m->context, width, height, wanted);
        assert_ok(vd_classic_renderer_draw(m->renderer, NULL, def, frame));
        assert_same(expected, frame, m->name, def, map);
        vd_frame_destroy(&frame);
    }
    vd_frame_destroy(&expected);
}

static void random_scenes(void **state) {
    (void)state;
    crew_member crew[MAX_CREW];
    const int members = make_crew(crew);
    uint64_t random = 1992;
    for (int m = 0; m < scaled(300); m++) {
        const vd_height_type type = (vd_height_type)(m % VD_HEIGHT_TYPE_COUNT);
        const int map_width = random_side(&random), map_height = random_side(&random);
        vd_heightfield *map = random_map(crew[0].context, &random, map_width, map_height, type);
        for (int i = 0; i < members; i++) {
            assert_ok(vd_classic_renderer_create(crew[i].context, map, &crew[i].renderer));
            if (m % 5 == 0) {
                vd_classic_renderer_use(crew[i].renderer, &crew[i].ahead);
            }
        }
        for (int scene = 0; scene < (test_is_reduced() ? 10 : 20); scene++) {
            const bool longer = scene % 10 == 9;
            vd_classic_def def = random_camera(&random, map, longer ? 8000.0 : 900.0);
            if (scene % 2 == 0) {
                choose_quality(&random, &def);
            }
            const int width = 1 + (int)(test_random(&random) % (longer ? 30 : 70));
            const int height = 1 + (int)(test_random(&random) % 120);
            compare_scene(crew, members, 3, &random, map, &def, width, height);
        }
        for (int i = 0; i < members; i++) {
            vd_classic_renderer_destroy(&crew[i].renderer);
        }
        vd_heightfield_destroy(crew[0].context, &map);
    }
    for (int i = 0; i < members; i++) {
        vd_context_destroy(&crew[i].context);
    }
}

/* Few scenes of the sizes that the random ones do not reach. */
static void large_scenes(void **state) {
    (void)state;
    const bool whole = getenv("VEDUTA_TEST_LONG") != NULL;
    const struct {
        int map_width, map_height, width, height;
        double slices;
    } sizes[] = {
        {1024, 1024, 301, 512, 30000.0}, {2048, 1024, 65, 300, 30000.0},
        {3000, 2001, 127, 333, 20000.0}, {1, 4097, 90, 200, 9000.0},
        {5000, 3, 90, 200, 9000.0},      {257, 1025, 4099, 40, 1000.0},
        {64, 64, 3, 5000, 9000.0},       {40000, 3, 40, 100, 60000.0},
        {2, 32768, 40, 100, 60000.0},    {333, 512, whole ? 16384 : 5000, 64, 1500.0},
    };
    crew_member crew[MAX_CREW];
    const int members = make_crew(crew);
    uint64_t random = 5550959;
    /* Reduced, without the largest maps: each member makes pyramids of its own. */
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        if (test_is_reduced() && s > 0 && s < 3) {
            continue;
        }
        vd_heightfield *map = random_map(crew[0].context, &random, sizes[s].map_width,
                                         sizes[s].map_height, (vd_height_type)(s % 3));
        for (int i = 0; i < members; i++) {
            assert_ok(vd_classic_renderer_create(crew[i].context, map, &crew[i].renderer));
        }
        for (int scene = 0; scene < (whole ? 20 : test_is_reduced() ? 1 : 4); scene++) {
            vd_classic_def def = random_camera(&random, map, sizes[s].slices);
            if (scene % 2 != 0) {
                choose_quality(&random, &def);
            }
            compare_scene(crew, members, 4, &random, map, &def, sizes[s].width, sizes[s].height);
        }
        for (int i = 0; i < members; i++) {
            vd_classic_renderer_destroy(&crew[i].renderer);
        }
        vd_heightfield_destroy(crew[0].context, &map);
    }
    for (int i = 0; i < members; i++) {
        vd_context_destroy(&crew[i].context);
    }
}

/* ---- nothing visible is passed over ---------------------------------------------------------- */

static uint64_t proven_slices, proven_runs;

/* The column of a packet's lane. */
static int column_of(const vd_classic_setup *setup, const packet *p, int lane) {
    const float scale = p->segment->scale;
    int column = 0;
    while (setup->direction_x[column] * scale != p->direction_x[lane] ||
           setup->direction_y[column] * scale != p->direction_y[lane]) {
        column++;
    }
    return column;
}

/* The row of a slice by the reference: drawn alone into a column of which all is hidden up to
 * `hidden` it changes the column only if it is visible. */
static bool is_visible(const vd_classic_setup *setup, int column, float k, int32_t hidden) {
    vd_classic_slice slice = {.k = (uint32_t)k};
    slice.z = setup->z0 + k * setup->step;
    slice.rise = setup->scale / slice.z;
    slice.level = vd_classic_level_at(setup, slice.z, 0);
    if (setup->plain) {
        return vd_classic_look(setup, &slice, column, setup->height_type).top < hidden;
    }
    vd_frame nowhere = *setup->frame;
    static uint8_t pixels[4 * 4096];
    nowhere.rgba = pixels;
    nowhere.depth = NULL;
    nowhere.id = NULL;
    nowhere.stride = 0;
    vd_classic_setup alone = *setup;
    alone.frame = &nowhere;
    vd_classic_column state = {hidden, {0, 0, 0, 0}};
    vd_classic_draw_slice_quality(&alone, &slice, column, 1, &state);
    return state.hidden < hidden;
}

/* Every slice from the first to the last, by the reference's formula. */
static void check_skipped(const void *setup_, const void *packet_, const void *vectors_,
                          uint32_t lanes) {
    const vd_classic_setup *setup = setup_;
    const packet *p = packet_;
    vd_wide_f32 vectors[3];
    memcpy(vectors, vectors_, sizeof vectors);
    for (int lane = 0; lane < VD_WIDE_LANES; lane++) {
        const float first = vectors[0][lane], hidden = vectors[2][lane];
        const float end = fminf(vectors[1][lane], p->segment->last); /* a lane may be done */
        if ((lanes >> lane & 1) == 0 || !(hidden > 0.0f) || first > end) {
            continue;
        }
        const int column = column_of(setup, p, lane);
        proven_runs++;
        for (float k = first; k <= end; k += 1.0f) {
            if (is_visible(setup, column, k, (int32_t)hidden)) {
                fail_msg("slice %g of column %d is visible above %g and was passed over", (double)k,
                         column, (double)hidden);
            }
            proven_slices++;
        }
    }
}

static void no_visible_slice_is_passed_over(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_march_kernels ahead = proving_kernels;
    memcpy(ahead.march, ahead.ahead, sizeof ahead.march);
    uint64_t random = 5;
    for (int m = 0; m < scaled(60) + 3; m++) {
        vd_heightfield *map = random_map(context, &random, random_side(&random),
                                         random_side(&random), (vd_height_type)(m % 3));
        vd_classic_renderer *renderer = NULL;
        assert_ok(vd_classic_renderer_create(context, map, &renderer));
        vd_classic_renderer_use(renderer, m % 4 == 0 ? &ahead : &proving_kernels);
        for (int scene = 0; scene < 6; scene++) {
            vd_classic_def def = random_camera(&random, map, 6000.0);
            def.growth = 0.0;
            if (scene % 3 != 0) {
                choose_quality(&random, &def);
                def.samples = 0;
            }
            const unsigned planes = scene % 2 == 0 ? 0 : VD_PLANE_DEPTH;
            vd_frame *frame = dirty_frame(context, 1 + (int)(test_random(&random) % 40),
                                          1 + (int)(test_random(&random) % 200), planes);
            assert_ok(vd_classic_renderer_draw(renderer, NULL, &def, frame));
            vd_frame_destroy(&frame);
        }
        vd_classic_renderer_destroy(&renderer);
        vd_heightfield_destroy(context, &map);
    }
    assert_true(proven_runs > 1000 && proven_slices > 10 * proven_runs);
    vd_context_destroy(&context);
}

/* ---- memory and jobs ------------------------------------------------------------------------- */

static void warm_frames_allocate_nothing(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    uint64_t random = 3;
    vd_heightfield *map = random_map(context, &random, 256, 256, VD_HEIGHT_U8);
    const size_t before = vd_context_memory(context).bytes_now;
    vd_classic_renderer *renderer = NULL;
    assert_ok(vd_classic_renderer_create(context, map, &renderer));
    vd_frame *frame = dirty_frame(context, 100, 80, VD_PLANE_DEPTH);
    vd_classic_def def = vd_classic_def_default(), growing = vd_classic_def_default();
    growing.growth = 0.005;
    growing.distance = 800.0;
    assert_ok(vd_classic_renderer_draw(renderer, NULL, &def, frame));
    assert_ok(vd_classic_renderer_draw(renderer, NULL, &growing, frame));
    vd_classic_def best = def;
    best.filter = VD_FILTER_LINEAR;
    best.mip = best.smooth = true;
    best.samples = 4;
    assert_ok(vd_classic_renderer_draw(renderer, NULL, &best, frame));
    const uint64_t allocations = vd_context_memory(context).allocations;
    for (int i = 0; i < 10; i++) {
        def.yaw_rad = growing.yaw_rad = best.yaw_rad = i;
        assert_ok(vd_classic_renderer_draw(renderer, NULL, &best, frame));
        assert_ok(vd_classic_renderer_draw(renderer, NULL, &def, frame));
        assert_ok(vd_classic_renderer_draw(renderer, NULL, &growing, frame));
    }
    assert_int_equal(vd_context_memory(context).allocations, allocations);
    vd_frame_destroy(&frame);
    vd_classic_renderer_destroy(&renderer);
    assert_int_equal(vd_context_memory(context).bytes_now, before);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

static void a_stopped_job_leaves_the_renderer_usable(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    uint64_t random = 8;
    vd_heightfield *map = random_map(context, &random, 500, 300, VD_HEIGHT_U16);
    vd_classic_renderer *renderer = NULL;
    vd_job *job = NULL;
    assert_ok(vd_job_create(context, &job));
    assert_ok(vd_classic_renderer_create(context, map, &renderer));
    vd_frame *expected = dirty_frame(context, 300, 200, 0);
    vd_frame *frame = dirty_frame(context, 300, 200, 0);
    vd_classic_def def = vd_classic_def_default();
    def.height = 40000.0;
    def.scale = 0.5;
    def.distance = 5000.0;
    assert_ok(vd_classic_render(context, NULL, map, &def, VD_CLASSIC_COLUMNS, expected, NULL));
    for (int i = 0; i < 20; i++) {
        vd_job_reset(job);
        if (i % 4 == 0) {
            vd_job_cancel(job);
        } else {
            vd_job_set_time_limit(job, 1000u * (uint64_t)(i * i));
        }
        const vd_status status = vd_classic_renderer_draw(renderer, job, &def, frame);
        assert_true(status.code == VD_OK || status.code == VD_ERROR_CANCELLED);
        assert_true(i % 4 != 0 || status.code == VD_ERROR_CANCELLED);
        assert_ok(vd_classic_renderer_draw(renderer, NULL, &def, frame));
        assert_same(expected, frame, "after a stop", &def, map);
    }
    vd_frame_destroy(&frame);
    vd_frame_destroy(&expected);
    vd_classic_renderer_destroy(&renderer);
    vd_job_destroy(&job);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

static void wrong_calls_are_refused(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    uint64_t random = 9;
    vd_heightfield *map = random_map(context, &random, 8, 8, VD_HEIGHT_U8);
    vd_classic_renderer *renderer = NULL;
    map->wraps = 0;
    assert_int_equal(vd_classic_renderer_create(context, map, &renderer).code, VD_ERROR_ARGUMENT);
    map->wraps = 1;
    assert_int_equal(vd_classic_renderer_create(context, NULL, &renderer).code, VD_ERROR_ARGUMENT);
    assert_ok(vd_classic_renderer_create(context, map, &renderer));
    vd_frame *frame = dirty_frame(context, 8, 8, 0);
    vd_classic_def def = vd_classic_def_default();
    def.step = NAN;
    assert_int_equal(vd_classic_renderer_draw(renderer, NULL, &def, frame).code, VD_ERROR_ARGUMENT);
    assert_int_equal(vd_classic_renderer_draw(renderer, NULL, &def, NULL).code, VD_ERROR_ARGUMENT);
    assert_int_equal(vd_classic_renderer_draw(NULL, NULL, &def, frame).code, VD_ERROR_ARGUMENT);
    vd_frame_destroy(&frame);
    vd_classic_renderer_destroy(&renderer);
    vd_classic_renderer_destroy(&renderer);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_scenes),
        cmocka_unit_test(large_scenes),
        cmocka_unit_test(no_visible_slice_is_passed_over),
        cmocka_unit_test(warm_frames_allocate_nothing),
        cmocka_unit_test(a_stopped_job_leaves_the_renderer_usable),
        cmocka_unit_test(wrong_calls_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
