/* What splats must do, told by properties: energy, symmetry, order, regular grids, opacity that
 * adds up, sums that do not care for order; the radix sort; what is refused. */
#include <stdio.h>
#include "core/core.h"
#include "splat/splat_internal.h"
#include "splat_scenes.h"

static vd_context *context;

/* The frame's alpha (channel 3) or another channel, summed over all pixels, 255 = 1. */
static double sum_channel(const vd_frame *frame, int channel) {
    double sum = 0.0;
    for (int y = 0; y < frame->height; y++) {
        for (int x = 0; x < frame->width; x++) {
            sum += frame->rgba[4 * ((size_t)y * frame->stride + (size_t)x) + (size_t)channel];
        }
    }
    return sum / 255.0;
}

static int at_pixel(const vd_frame *frame, int x, int y, int channel) {
    return frame->rgba[4 * ((size_t)y * frame->stride + (size_t)x) + (size_t)channel];
}

/* One splat in the finest numbers there are: the tile pixels of the reference, floats of 255. */
static void draw_one(vd_splat_mode mode, vd_splat_kernel kernel, float x, float y, float radius,
                     int side, void *pixels) {
    vd_splat_profile profiles[2];
    vd_splat_profile_init(&profiles[0], VD_SPLAT_GAUSSIAN);
    vd_splat_profile_init(&profiles[1], VD_SPLAT_SPH);
    vd_splat_def def = vd_splat_def_default();
    def.mode = mode;
    def.kernel = kernel;
    vd_splat_picture picture;
    vd_splat_picture_init(&picture, &def, side, side, profiles);
    vd_splat_picture_set_weight(&picture, 1.0);
    const float z = -y, depth = 10.0f;
    vd_splats splats = vd_splats_default();
    splats.count = 1;
    splats.x = &x;
    splats.y = &depth;
    splats.z = &z;
    splats.radius_m = radius;
    const vd_camera camera = flat_view();
    vd_placing placing;
    vd_placing_init(&placing, &splats, &def, &picture, &camera);
    const int sequence = 0;
    uint64_t scratch[2];
    vd_splat_counts counts = {0, 0, 0};
    memset(pixels, 0, (size_t)side * (size_t)side * 16);
    vd_splat_draw_reference(&picture, &placing, &sequence, 1, true, scratch, pixels, &counts);
    assert_int_equal(counts.drawn, 1);
}

enum { SIDE = 40 };

/* What a splat of opacity 1 leaves is its area; a density's sum its weight; wherever it is. */
static void energy_is_kept(void **state) {
    (void)state;
    static const float radii[] = {0.02f, 0.2f, 0.4999f, 0.501f, 0.8f, 1.7f, 3.9f, 6.0f};
    float *pixels = malloc(SIDE * SIDE * 16);
    uint64_t seed = 3;
    for (int kernel = 0; kernel < VD_SPLAT_KERNEL_COUNT; kernel++) {
        vd_splat_profile profiles[2];
        vd_splat_profile_init(&profiles[0], VD_SPLAT_GAUSSIAN);
        vd_splat_profile_init(&profiles[1], VD_SPLAT_SPH);
        const vd_splat_shape shape = vd_splat_shape_of((vd_splat_kernel)kernel, profiles);
        for (size_t r = 0; r < 8; r++) {
            for (int i = 0; i < 40; i++) {
                const float x = (float)(SIDE / 2 + test_uniform(&seed));
                const float y = (float)(SIDE / 2 + test_uniform(&seed));
                draw_one(VD_SPLAT_ALPHA, (vd_splat_kernel)kernel, x, y, radii[r], SIDE, pixels);
                double sum = 0.0, most = 0.0;
                for (int p = 0; p < SIDE * SIDE; p++) {
                    sum += pixels[4 * p + 3] / 255.0;
                    most = pixels[4 * p + 3] > most ? (double)pixels[4 * p + 3] : most;
                }
                const double area = (double)shape.area * pow(radii[r] * shape.support, 2);
                assert_true(most <= 255.0);
                if (most < 254.9) { /* nothing was cut at opaque */
                    assert_true(fabs(sum - area) <= area / 4096.0);
                }
                draw_one(VD_SPLAT_DENSITY, (vd_splat_kernel)kernel, x, y, radii[r], SIDE, pixels);
                const uint64_t *sums = (const uint64_t *)(const void *)pixels;
                double total = 0.0;
                for (int p = 0; p < SIDE * SIDE; p++) {
                    total += (double)sums[p];
                }
                assert_true(fabs(total / (256.0 * VD_WEIGHT_ONE) - 1.0) <= 1.0 / 4096.0);
                if (radii[r] < 0.5f) {
                    assert_true(total == 256.0 * VD_WEIGHT_ONE); /* to the last bit */
                }
            }
        }
    }
    free(pixels);
}

/* A splat moved by whole pixels is the same picture moved; mirrored, mirrored. */
static void shifts_and_mirrors(void **state) {
    (void)state;
    float *a = malloc(SIDE * SIDE * 16), *b = malloc(SIDE * SIDE * 16);
    static const float radii[] = {0.3f, 2.25f};
    for (int kernel = 0; kernel < VD_SPLAT_KERNEL_COUNT; kernel++) {
        for (int r = 0; r < 2; r++) {
            for (int sub = 0; sub < 256; sub += 37) {
                const float x = 15.0f + (float)sub / 256.0f,
                            y = 14.0f + (float)(sub * 5 % 256) / 256.0f;
                draw_one(VD_SPLAT_ALPHA, (vd_splat_kernel)kernel, x, y, radii[r], SIDE, a);
                draw_one(VD_SPLAT_ALPHA, (vd_splat_kernel)kernel, x + 7.0f, y + 3.0f, radii[r],
                         SIDE, b);
                for (int py = 0; py + 3 < SIDE; py++) {
                    assert_memory_equal(a + 4 * SIDE * py, b + 4 * (SIDE * (py + 3) + 7),
                                        16 * (SIDE - 7));
                }
                draw_one(VD_SPLAT_ALPHA, (vd_splat_kernel)kernel, (float)SIDE - x, y, radii[r],
                         SIDE, b);
                for (int p = 0; p < SIDE * SIDE; p++) {
                    const int mirrored = p / SIDE * SIDE + SIDE - 1 - p % SIDE;
                    assert_true(fabsf(a[4 * p] - b[4 * mirrored]) <= 255.0f / 4096.0f);
                }
            }
        }
    }
    free(a);
    free(b);
}

/* ---- regular grids ----------------------------------------------------------------------------*/

enum { LINES = 100 };

/* Standard deviations of the lines' brightness and of their distance, of a picture of vertical
 * lines `pitch` pixels apart; row y is looked at. */
static void measure_lines(const vd_frame *frame, double start, double pitch, double *brightness,
                          double *distance) {
    double sum = 0, squares = 0, gaps = 0, gap_squares = 0, last = 0;
    for (int i = 0; i < LINES; i++) {
        const double middle = start + i * pitch;
        double light = 0, place = 0;
        for (int x = (int)floor(middle - pitch / 2); x <= (int)floor(middle + pitch / 2); x++) {
            double column = 0;
            for (int y = 0; x >= 0 && x < frame->width && y < frame->height; y++) {
                column += at_pixel(frame, x, y, 0);
            }
            light += column;
            place += column * (x + 0.5);
        }
        place /= light > 0 ? light : 1;
        sum += light;
        squares += light * light;
        if (i > 0) {
            gaps += place - last;
            gap_squares += (place - last) * (place - last);
        }
        last = place;
    }
    const double mean = sum / LINES, gap = gaps / (LINES - 1);
    *brightness = sqrt(fmax(0, squares / LINES - mean * mean)) / mean;
    *distance = sqrt(fmax(0, gap_squares / (LINES - 1) - gap * gap));
}

/* The dissertation's figures 6.12 and 6.13: 100 × 100 dots stay a grid at every shift; dots of one
 * whole pixel wobble. */
static void grids_stay_regular(void **state) {
    (void)state;
    enum { WIDTH = 420 };
    static float x[LINES * LINES], y[LINES * LINES], z[LINES * LINES];
    const double pitch = 3.7;
    vd_splats splats = vd_splats_default();
    splats.count = LINES * LINES;
    splats.x = x;
    splats.y = y;
    splats.z = z;
    splats.radius_m = 0.5f;
    const vd_camera camera = flat_view();
    vd_splat_def def = vd_splat_def_default();
    def.background = (vd_rgba8){0, 0, 0, 255};
    for (int shift = 0; shift < 8; shift++) {
        const double start = 20.0 + shift / 8.0 + 0.013;
        for (int i = 0; i < LINES * LINES; i++) {
            x[i] = (float)(start + i % LINES * pitch);
            y[i] = 10.0f;
            z[i] = -(float)(start + i / LINES * pitch);
        }
        double brightness, distance;
        def.mode = VD_SPLAT_ALPHA;
        vd_frame *frame = draw_splats(context, &def, &camera, &splats, 1, WIDTH, WIDTH, NULL);
        measure_lines(frame, start, pitch, &brightness, &distance);
        assert_true(brightness < 0.004);
        assert_true(distance < 0.006);
        vd_frame_destroy(&frame);
        def.mode = VD_SPLAT_NEAREST;
        frame = draw_splats(context, &def, &camera, &splats, 1, WIDTH, WIDTH, NULL);
        measure_lines(frame, start, pitch, &brightness, &distance);
        assert_true(distance > 0.3); /* the measure sees what it is for */
        vd_frame_destroy(&frame);
    }
}

/* ---- blending ---------------------------------------------------------------------------------*/

/* 2,000 splats of opacity 0.001: 1 − 0.999^2000 = 0.865. */
static void faint_splats_add_up(void **state) {
    (void)state;
    enum { COUNT = 2000 };
    static float x[COUNT], y[COUNT], z[COUNT];
    for (int i = 0; i < COUNT; i++) {
        x[i] = 4.5f;
        y[i] = 10.0f;
        z[i] = -4.5f;
    }
    vd_splats splats = vd_splats_default();
    splats.count = COUNT;
    splats.x = x;
    splats.y = y;
    splats.z = z;
    splats.radius_m = 0.5f;
    splats.opacity = 0.001f;
    const vd_camera camera = flat_view();
    vd_splat_def def = vd_splat_def_default();
    vd_frame *frame = draw_splats(context, &def, &camera, &splats, 1, 9, 9, NULL);
    assert_int_equal(at_pixel(frame, 4, 4, 3), (int)(255 * (1 - pow(0.999, COUNT)) + 0.5));
    assert_int_equal(at_pixel(frame, 4, 4, 0), at_pixel(frame, 4, 4, 3));
    assert_true(sum_channel(frame, 3) * 255 == at_pixel(frame, 4, 4, 3));
    vd_frame_destroy(&frame);
}

/* Near ones over far ones, whatever the order in the arrays; kept orders used while they hold. */
static void near_covers_far(void **state) {
    (void)state;
    enum { COUNT = 500 };
    static float x[COUNT], y[COUNT], z[COUNT];
    static vd_rgba8 color[COUNT];
    static uint32_t index[COUNT];
    uint64_t seed = 17;
    int nearest = 0;
    for (int i = 0; i < COUNT; i++) {
        x[i] = 4.5f;
        y[i] = (float)(1 + 500 * test_uniform(&seed));
        z[i] = -4.5f;
        color[i] = (vd_rgba8){(uint8_t)i, (uint8_t)(i / 256), 77, 255};
        nearest = y[i] < y[nearest] ? i : nearest;
    }
    vd_splats splats = vd_splats_default();
    splats.count = COUNT;
    splats.x = x;
    splats.y = y;
    splats.z = z;
    splats.color = color;
    splats.radius_m = 0.5f;
    vd_splat_order order = {index, {0, 0, 0}};
    splats.order = &order;
    vd_camera camera = flat_view();
    vd_splat_def def = vd_splat_def_default();
    vd_splatter *splatter = NULL;
    vd_frame *frame = NULL;
    vd_splat_stats stats;
    assert_ok(vd_splatter_create(context, &splatter));
    assert_ok(vd_frame_create(context, 9, 9, 0, &frame));
    for (int turn = 0; turn < 3; turn++) {
        assert_ok(vd_splatter_render(splatter, NULL, &def, &camera, &splats, 1, frame, &stats));
        assert_int_equal(stats.sorted, turn == 0 ? COUNT : 0);
        assert_int_equal(at_pixel(frame, 4, 4, 0), color[nearest].r);
        assert_int_equal(at_pixel(frame, 4, 4, 1), color[nearest].g);
        camera.eye.y -= 5.0; /* moving does not change the order */
    }
    for (int i = 1; i < COUNT; i++) {
        assert_true(y[index[i - 1]] >= y[index[i]] - 500.0f / 4194304.0f);
    }
    camera.orientation = vd_orientation_from_angles(0.01, 0, 0);
    def.resort_rad = 0.02;
    assert_ok(vd_splatter_render(splatter, NULL, &def, &camera, &splats, 1, frame, &stats));
    assert_int_equal(stats.sorted, 0);
    def.resort_rad = 0.005;
    assert_ok(vd_splatter_render(splatter, NULL, &def, &camera, &splats, 1, frame, &stats));
    assert_int_equal(stats.sorted, COUNT);
    vd_frame_destroy(&frame);
    vd_splatter_destroy(&splatter);
}

/* Densities of shuffled particles are the same bytes. */
static void density_has_no_order(void **state) {
    (void)state;
    cloud *c = malloc(sizeof *c);
    fill_cloud(c, CLOUD_MOST, 23, 0.0);
    const vd_camera camera = splat_camera(160, 120, 80.0);
    vd_splat_def def = vd_splat_def_default();
    def.mode = VD_SPLAT_DENSITY;
    def.kernel = VD_SPLAT_SPH;
    def.log = true;
    vd_splats splats = cloud_splats(c);
    splats.weight = c->weight;
    vd_frame *expected = draw_splats(context, &def, &camera, &splats, 1, 160, 120, NULL);
    uint64_t seed = 5;
    for (size_t i = c->count - 1; i > 0; i--) {
        const size_t k = test_random(&seed) % (i + 1);
        float *const arrays[] = {c->x, c->y, c->z, c->radius, c->weight};
        for (int a = 0; a < 5; a++) {
            const float swap = arrays[a][i];
            arrays[a][i] = arrays[a][k];
            arrays[a][k] = swap;
        }
    }
    vd_frame *frame = draw_splats(context, &def, &camera, &splats, 1, 160, 120, NULL);
    assert_same_frames(expected, frame);
    vd_frame_destroy(&frame);
    vd_frame_destroy(&expected);
    free(c);
}

/* ---- odd input --------------------------------------------------------------------------------*/

static void bad_numbers_are_counted(void **state) {
    (void)state;
    float x[] = {4, NAN, 4, 4, INFINITY, 4}, y[] = {9, 9, -INFINITY, 9, 9, -9};
    float z[] = {-4, -4, -4, -4, -4, -4}, r[] = {0.5f, 0.5f, 0.5f, NAN, 0.5f, 0.5f};
    vd_splats splats = vd_splats_default();
    splats.count = 6;
    splats.x = x;
    splats.y = y;
    splats.z = z;
    splats.radius = r;
    const vd_camera camera = flat_view();
    vd_splat_stats stats;
    for (int mode = 0; mode < VD_SPLAT_MODE_COUNT; mode++) {
        vd_splat_def def = vd_splat_def_default();
        def.mode = (vd_splat_mode)mode;
        vd_frame *frame = draw_splats(context, &def, &camera, &splats, 1, 9, 9, &stats);
        assert_int_equal(stats.splats, 6);
        assert_int_equal(stats.not_finite, 4);
        assert_int_equal(stats.outside, 1);
        vd_frame_destroy(&frame);
    }
}

/* Many at one point: one tile has everything, on the corner of four. */
static void all_at_one_point(void **state) {
    (void)state;
    enum { COUNT = 40000 };
    float *at = malloc(COUNT * sizeof *at);
    for (int i = 0; i < COUNT; i++) {
        at[i] = 128.0f;
    }
    vd_splats splats = vd_splats_default();
    vd_matrix flip = vd_matrix_scaling(vd_vec3_make(1, 1, -1));
    splats.count = COUNT;
    splats.x = splats.y = splats.z = at;
    splats.transform = &flip;
    splats.radius_m = 0.1f;
    const vd_camera camera = flat_view();
    vd_splat_def def = vd_splat_def_default();
    vd_splat_stats stats;
    for (int mode = 0; mode < VD_SPLAT_MODE_COUNT; mode++) {
        def.mode = (vd_splat_mode)mode;
        vd_frame *frame = draw_splats(context, &def, &camera, &splats, 1, 256, 256, &stats);
        assert_int_equal(stats.outside, 0);
        if (mode == VD_SPLAT_DENSITY) {
            assert_true(fabs(stats.value_max - COUNT / 4) < 1.0);
        } else {
            assert_int_equal(at_pixel(frame, 128, 128, 3), 255);
        }
        vd_frame_destroy(&frame);
    }
    free(at);
}

static void wrong_use_is_refused(void **state) {
    (void)state;
    float at[1] = {1};
    vd_splatter *splatter = NULL;
    vd_frame *frame = NULL;
    assert_ok(vd_splatter_create(context, &splatter));
    assert_ok(vd_frame_create(context, 8, 8, 0, &frame));
    const vd_camera camera = flat_view();
    for (int wrong = 0; wrong < 9; wrong++) {
        vd_splat_def def = vd_splat_def_default();
        vd_splats splats = vd_splats_default();
        vd_splat_order order = {NULL, {0, 0, 0}};
        splats.count = 1;
        splats.x = splats.y = splats.z = at;
        def.mode = wrong == 1 ? VD_SPLAT_MODE_COUNT : VD_SPLAT_ALPHA;
        def.kernel = wrong == 2 ? (vd_splat_kernel)-1 : VD_SPLAT_BOX;
        def.range_min = wrong == 3 ? 2.0 : wrong == 4 ? -1.0 : 0.0;
        def.range_max = wrong == 3 ? 1.0 : wrong == 4 ? 5.0 : 0.0;
        def.log = wrong == 4;
        splats.y = wrong == 5 ? NULL : at;
        splats.opacity = wrong == 6 ? 1.5f : 1.0f;
        splats.order = wrong == 7 ? &order : NULL;
        splats.count = wrong == 8 ? (size_t)VD_SPLATS_MAX_COUNT + 1 : 1;
        const vd_status status =
            vd_splatter_render(splatter, NULL, &def, &camera, &splats, 1, frame, NULL);
        assert_int_equal(status.code, wrong == 0   ? VD_OK
                                      : wrong == 8 ? VD_ERROR_LIMIT
                                                   : VD_ERROR_ARGUMENT);
        assert_true((status.message[0] == '\0') == (wrong == 0));
    }
    assert_ok(
        vd_splatter_render(splatter, NULL, &(vd_splat_def){0}, &camera, NULL, 0, frame, NULL));
    vd_frame_destroy(&frame);
    vd_splatter_destroy(&splatter);
}

/* The n-th allocation fails, for every n; and a warm picture allocates nothing. */
static void memory(void **state) {
    (void)state;
    cloud *c = malloc(sizeof *c);
    fill_cloud(c, 3000, 29, 0.0);
    const vd_splats splats = cloud_splats(c);
    const vd_camera camera = splat_camera(64, 64, 40.0);
    const vd_splat_def def = vd_splat_def_default();
    bool done = false;
    for (int n = 2; !done; n++) {
        test_allocator allocator = {0, 0, 0};
        vd_context *failing = test_failing_context(&allocator);
        vd_frame *frame = NULL;
        vd_splatter *splatter = NULL;
        assert_ok(vd_frame_create(failing, 64, 64, 0, &frame));
        allocator.fail_at = allocator.calls + n - 1;
        vd_status status = vd_splatter_create(failing, &splatter);
        if (status.code == VD_OK) {
            status = vd_splatter_render(splatter, NULL, &def, &camera, &splats, 1, frame, NULL);
        }
        done = status.code == VD_OK;
        if (done) {
            const int calls = allocator.calls;
            assert_ok(vd_splatter_render(splatter, NULL, &def, &camera, &splats, 1, frame, NULL));
            assert_int_equal(allocator.calls, calls);
        } else {
            assert_int_equal(status.code, VD_ERROR_MEMORY);
        }
        vd_splatter_destroy(&splatter);
        vd_frame_destroy(&frame);
        vd_context_destroy(&failing);
        assert_int_equal(allocator.live, 0);
    }
    free(c);
}

static void jobs_can_be_cancelled(void **state) {
    (void)state;
    cloud *c = malloc(sizeof *c);
    fill_cloud(c, 3000, 31, 0.0);
    const vd_splats splats = cloud_splats(c);
    const vd_camera camera = splat_camera(64, 64, 40.0);
    const vd_splat_def def = vd_splat_def_default();
    vd_job *job = NULL;
    vd_splatter *splatter = NULL;
    vd_frame *frame = NULL;
    assert_ok(vd_job_create(context, &job));
    assert_ok(vd_splatter_create(context, &splatter));
    assert_ok(vd_frame_create(context, 64, 64, 0, &frame));
    vd_job_cancel(job);
    const vd_status status =
        vd_splatter_render(splatter, job, &def, &camera, &splats, 1, frame, NULL);
    assert_int_equal(status.code, VD_ERROR_CANCELLED);
    vd_job_reset(job);
    assert_ok(vd_splatter_render(splatter, job, &def, &camera, &splats, 1, frame, NULL));
    assert_true(vd_job_progress(job) == 1.0);
    vd_frame_destroy(&frame);
    vd_splatter_destroy(&splatter);
    vd_job_destroy(&job);
    free(c);
}

/* ---- parts ------------------------------------------------------------------------------------*/

static void sorting_is_stable(void **state) {
    (void)state;
    static const size_t counts[] = {0, 1, 2, 128, 129, 1000, 5000};
    vd_sorter *sorter = malloc(sizeof *sorter);
    sorter->keys = malloc(5000 * sizeof *sorter->keys);
    sorter->pairs = malloc(5000 * sizeof *sorter->pairs);
    uint32_t *index = malloc(5000 * sizeof *index);
    uint64_t seed = 11;
    for (int k = 0; k < 7; k++) {
        for (size_t i = 0; i < counts[k]; i++) {
            sorter->keys[i] = (uint32_t)(test_random(&seed) & (k % 2 ? 0x3FFFFF : 0x3F0003));
        }
        vd_sorter_run(sorter, counts[k], index);
        for (size_t i = 1; i < counts[k]; i++) {
            const uint32_t a = sorter->keys[index[i - 1]], b = sorter->keys[index[i]];
            assert_true(a < b || (a == b && index[i - 1] < index[i]));
        }
    }
    free(index);
    free(sorter->keys);
    free(sorter->pairs);
    free(sorter);
}

static void particles_are_the_same_everywhere(void **state) {
    (void)state;
    vd_context *one = test_context(1, VD_ISA_V2), *seven = test_context(7, VD_ISA_AUTO);
    vd_particles *a = NULL, *b = NULL;
    assert_ok(vd_particles_generate(one, NULL, 42, 100000, &a));
    assert_ok(vd_particles_generate(seven, NULL, 42, 100000, &b));
    assert_memory_equal(a->x, b->x, a->count * 4);
    assert_memory_equal(a->z, b->z, a->count * 4);
    assert_memory_equal(a->speed, b->speed, a->count * 4);
    size_t kinds[3] = {0, 0, 0};
    for (size_t i = 0; i < a->count; i++) {
        assert_true(fabsf(a->x[i]) <= 0.5f && a->radius[i] > 0.0f && a->speed[i] >= 0.0f);
        kinds[a->classes[i]]++;
    }
    assert_true(kinds[0] > 9000 && kinds[1] > 28000 && kinds[2] > 58000);
    /* A run of the Morton order is a compact block: far smaller than the cube. */
    double volume = 0;
    for (size_t first = 0; first < a->count; first += 1000) {
        const vd_splats run = vd_particles_splats(a, first, 1000);
        volume += (double)(run.max[0] - run.min[0]) * (run.max[1] - run.min[1]) *
                  (run.max[2] - run.min[2]);
    }
    assert_true(volume < 5.0); /* of 100 blocks; unsorted ones have 1 each */
    vd_particles_destroy(&a);
    assert_ok(vd_particles_generate(one, NULL, 42, 0, &a));
    vd_particles_destroy(&a);
    vd_particles_destroy(&b);
    vd_context_destroy(&one);
    vd_context_destroy(&seven);
}

/* Each form has the size that its numbers take; an ending that says nothing is refused. */
static void particles_are_saved(void **state) {
    (void)state;
    static const char *const names[] = {"particles.ply", "particles.csv", "particles.raw"};
    vd_particles *particles = NULL;
    assert_ok(vd_particles_generate(context, NULL, 1, 100, &particles));
    for (int i = 0; i < 3; i++) {
        char path[512];
        snprintf(path, sizeof path, "%s/test_splat_%s", VEDUTA_BINARY_DIR, names[i]);
        assert_ok(vd_particles_save(particles, path));
        FILE *file = fopen(path, "rb");
        assert_non_null(file);
        int lines = 0, c;
        long size = 0, body = 0;
        for (; (c = fgetc(file)) != EOF; size++) {
            lines += c == '\n';
            body = i == 0 && lines == 11 && body == 0 ? size + 1 : body;
        }
        fclose(file);
        remove(path);
        assert_true(i == 0 ? size - body == 2500 : i == 1 ? lines == 101 : size == 2400);
    }
    assert_int_equal(vd_particles_save(particles, "particles.txt").code, VD_ERROR_ARGUMENT);
    vd_particles_destroy(&particles);
}

static void legend_is_drawn(void **state) {
    (void)state;
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, 640, 480, 0, &frame));
    vd_splat_def def = vd_splat_def_default();
    vd_splat_stats stats = {.value_min = 0.5, .value_max = 200.0};
    vd_splat_draw_legend(frame, &def, &stats);
    assert_true(sum_channel(frame, 3) > 1000.0);
    vd_frame_destroy(&frame);
    assert_ok(vd_frame_create(context, 20, 20, 0, &frame));
    vd_splat_draw_legend(frame, &def, &stats); /* no room: nothing */
    assert_true(sum_channel(frame, 3) == 0.0);
    vd_frame_destroy(&frame);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(energy_is_kept),
        cmocka_unit_test(shifts_and_mirrors),
        cmocka_unit_test(grids_stay_regular),
        cmocka_unit_test(faint_splats_add_up),
        cmocka_unit_test(near_covers_far),
        cmocka_unit_test(density_has_no_order),
        cmocka_unit_test(bad_numbers_are_counted),
        cmocka_unit_test(all_at_one_point),
        cmocka_unit_test(wrong_use_is_refused),
        cmocka_unit_test(memory),
        cmocka_unit_test(jobs_can_be_cancelled),
        cmocka_unit_test(sorting_is_stable),
        cmocka_unit_test(particles_are_the_same_everywhere),
        cmocka_unit_test(particles_are_saved),
        cmocka_unit_test(legend_is_drawn),
    };
    context = test_context(2, VD_ISA_AUTO);
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    vd_context_destroy(&context);
    return failed;
}
