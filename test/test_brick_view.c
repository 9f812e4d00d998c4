/* test_brick_view.c: what is chosen for a picture, in which order, and how near it is to drawing
 * everything. */
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <unistd.h>
#include <veduta/brick_view.h>

static vd_context *context;
static char folder[] = VEDUTA_BINARY_DIR "/test-brick-view-XXXXXX";

enum { COUNT = 60000 };
static double rows[COUNT][5];

/* Spheres of different density, x, y, z, mass, radius. */
static void fill_rows(void) {
    uint64_t seed = 1;
    for (size_t i = 0; i < COUNT; i++) {
        const double size = i % 4 == 0 ? 40.0 : i % 4 == 1 ? 2.0 : 8.0;
        double p[3], r2;
        do {
            r2 = 0.0;
            for (int k = 0; k < 3; k++) {
                p[k] = 2.0 * test_uniform(&seed) - 1.0;
                r2 += p[k] * p[k];
            }
        } while (r2 > 1.0);
        for (int k = 0; k < 3; k++) {
            rows[i][k] = size * p[k] + (double)(i % 4) * 10.0;
        }
        rows[i][3] = 1.0 + test_uniform(&seed);
        rows[i][4] = 0.05;
    }
}

static vd_bricks *open_rows(vd_context *with, const char *columns, uint32_t leaf) {
    vd_particle_source_def def = vd_particle_source_def_default();
    def.raw = "f64";
    def.columns = columns;
    vd_particle_source *source = NULL;
    vd_bricks *bricks = NULL;
    const vd_bricks_def bricks_def = {.leaf_particles = leaf};
    assert_ok(vd_particle_source_open_memory(with, rows, sizeof rows, "rows", &def, &source));
    assert_ok(vd_bricks_import(with, NULL, &source, 1, &bricks_def, "v.vdp", NULL));
    vd_particle_source_destroy(&source);
    assert_ok(vd_bricks_open(with, "v.vdp", &bricks));
    return bricks;
}

static int set_up(void **state) {
    (void)state;
    context = test_context(2, VD_ISA_AUTO);
    fill_rows();
    return test_enter_folder(folder);
}

static int tear_down(void **state) {
    (void)state;
    vd_context_destroy(&context);
    return test_leave_folder(folder);
}

enum { WIDTH = 160, HEIGHT = 120 };

static vd_camera camera_at(double x, double y, double z, vd_projection projection) {
    vd_camera c = {.eye = {x, y, z}, .near_m = 0.01, .far_m = 1000.0, .projection = projection};
    c.orientation = vd_orientation_look_at(c.eye, vd_vec3_make(12.0, 11.0, 10.0));
    c.lens = vd_lens_from_fov(0.9, WIDTH, HEIGHT);
    if (projection == VD_PROJECTION_ORTHOGRAPHIC) {
        c.lens.fx = c.lens.fy = 1.5;
    }
    return c;
}

/* ---- choosing -----------------------------------------------------------------------------------
 */

/* Which node a list is of: its positions lie in the file. */
static const vd_bricks_node *node_of(const vd_bricks *b, const vd_splats *s) {
    for (uint32_t n = 0; n < b->node_count; n++) {
        vd_brick brick;
        assert_ok(vd_bricks_brick(b, n, &brick));
        if (brick.x == s->x16) {
            return &b->nodes[n];
        }
    }
    fail_msg("a list is of no node");
    return NULL;
}

/* Whether `a`, drawn earlier, hides nothing of `b`: on some axis that parts them it is on the far
 * side. */
static bool is_behind(const vd_bricks_node *a, const vd_bricks_node *b, const vd_camera *c) {
    const double eye[3] = {c->eye.x, c->eye.y, c->eye.z};
    const vd_vec3 f = vd_quat_rotate(c->orientation, vd_vec3_make(0.0, 0.0, 1.0));
    const double forward[3] = {f.x, f.y, f.z};
    const bool flat = c->projection == VD_PROJECTION_ORTHOGRAPHIC;
    for (int k = 0; k < 3; k++) {
        if (a->min[k] >= b->max[k] && (flat ? forward[k] >= 0.0 : eye[k] <= a->min[k])) {
            return true;
        }
        if (a->max[k] <= b->min[k] && (flat ? forward[k] <= 0.0 : eye[k] >= a->max[k])) {
            return true;
        }
    }
    return false;
}

static void test_choice(void **state) {
    (void)state;
    vd_bricks *b = open_rows(context, "x,y,z,mass,-", 200);
    vd_brick_view *view = NULL;
    assert_ok(vd_brick_view_create(context, b, &view));
    static const double eyes[][3] = {{12, -120, 10}, {12, 11, 150},   {20, 20, 20},
                                     {-30, 40, 5},   {12, -3000, 10}, {12.5, 11, 10}};
    const int near = test_is_reduced() ? 6 : 40; /* in the order */
    uint64_t fewest = COUNT;
    for (size_t e = 0; e < sizeof eyes / sizeof eyes[0]; e++) {
        for (int p = 0; p < VD_PROJECTION_COUNT; p++) {
            const vd_camera camera =
                camera_at(eyes[e][0], eyes[e][1], eyes[e][2], (vd_projection)p);
            vd_brick_view_def def = vd_brick_view_def_default();
            vd_brick_view_stats stats;
            assert_ok(vd_brick_view_update(view, NULL, &def, &camera, WIDTH, HEIGHT, &stats));
            assert_int_equal(stats.stands_for + stats.culled, COUNT);
            fewest = stats.particles < fewest && stats.culled == 0 ? stats.particles : fewest;
            for (int i = 0; i < view->count; i++) {
                const vd_bricks_node *earlier = node_of(b, &view->splats[i]);
                for (int j = i + 1; j < view->count && j < i + near; j++) {
                    assert_true(is_behind(earlier, node_of(b, &view->splats[j]), &camera));
                }
            }
            def.detail_px = -1.0;
            vd_brick_view_stats all;
            assert_ok(vd_brick_view_update(view, NULL, &def, &camera, WIDTH, HEIGHT, &all));
            assert_int_equal(all.leaves, all.nodes);
            assert_int_equal(all.particles, all.stands_for);
            assert_int_equal(all.culled, stats.culled);
        }
    }
    assert_true(fewest < COUNT / 4);
    vd_brick_view_destroy(&view);
    vd_bricks_close(&b);
}

/* Nodes of at most `most` particles of the data below, none above another. */
static size_t cut_tree(const vd_bricks *b, uint32_t node, uint64_t most, uint32_t *out) {
    const vd_bricks_node *n = &b->nodes[node];
    if (n->leaves <= most || n->child_count == 0) {
        *out = node;
        return 1;
    }
    size_t count = 0;
    for (uint32_t c = 0; c < n->child_count; c++) {
        count += cut_tree(b, n->child_first + c, most, out + count);
    }
    return count;
}

static bool is_below(const vd_bricks *b, uint32_t root, const vd_bricks_node *node) {
    const vd_bricks_node *n = &b->nodes[root];
    bool found = n == node;
    for (uint32_t c = 0; c < n->child_count && !found; c++) {
        found = is_below(b, n->child_first + c, node);
    }
    return found;
}

/* `some` shows what of `all` lies below the roots, with `above` also above them, in its order. */
static void check_part(const vd_bricks *b, const vd_brick_view *all, const vd_brick_view *some,
                       const uint32_t *roots, size_t count, bool above) {
    int at = 0;
    for (int i = 0; i < all->count; i++) {
        const vd_bricks_node *node = node_of(b, &all->splats[i]);
        bool wanted = false;
        for (size_t k = 0; k < count && !wanted; k++) {
            wanted = is_below(b, roots[k], node) ||
                     (above && is_below(b, (uint32_t)(node - b->nodes), &b->nodes[roots[k]]));
        }
        if (wanted) {
            assert_true(at < some->count);
            assert_ptr_equal(some->splats[at++].x16, all->splats[i].x16);
        }
    }
    assert_int_equal(at, some->count);
}

/* All roots of a cut are the whole; some of them are what of it lies below them, in its order. */
static void test_roots(void **state) {
    (void)state;
    vd_bricks *b = open_rows(context, "x,y,z,mass,-", 200);
    vd_brick_view *all = NULL, *some = NULL;
    assert_ok(vd_brick_view_create(context, b, &all));
    assert_ok(vd_brick_view_create(context, b, &some));
    uint32_t *roots = malloc(b->node_count * sizeof *roots);
    uint64_t seed = 4;
    assert_non_null(roots);
    for (int turn = 0; turn < 24; turn++) {
        const vd_camera camera = camera_at(40.0 * test_uniform(&seed) - 5.0, -90.0,
                                           30.0 * test_uniform(&seed), (vd_projection)(turn % 2));
        vd_brick_view_def def = vd_brick_view_def_default();
        vd_brick_view_stats stats;
        def.detail_px = turn % 3 == 0 ? -1.0 : 0.5;
        def.drop_per_m2 = turn % 4 == 3 ? 1e-4 : 0.0;
        assert_ok(vd_brick_view_update(all, NULL, &def, &camera, WIDTH, HEIGHT, NULL));
        def.roots = roots;
        def.root_count = cut_tree(b, 0, 500u << (turn % 7), roots);
        assert_ok(vd_brick_view_update(some, NULL, &def, &camera, WIDTH, HEIGHT, &stats));
        assert_int_equal(stats.stands_for + stats.culled, COUNT);
        assert_int_equal(some->count, all->count);
        for (int i = 0; i < all->count; i++) {
            assert_ptr_equal(some->splats[i].x16, all->splats[i].x16);
            assert_true(some->splats[i].anchor.z == all->splats[i].anchor.z);
        }
        const vd_bricks_node *top = &b->nodes[roots[0]];
        assert_true(top->leaves <= (500u << (turn % 7)));
        /* A few of them, one twice, all leaves: the others are left out. */
        size_t kept = 0;
        for (size_t i = 0; i < def.root_count; i++) {
            roots[kept] = roots[i];
            kept += test_uniform(&seed) < 0.4 ? 1u : 0u;
        }
        def.root_count = kept;
        if (kept > 0 && kept < b->node_count) {
            roots[def.root_count++] = roots[0];
        }
        def.detail_px = -1.0;
        assert_ok(vd_brick_view_update(some, NULL, &def, &camera, WIDTH, HEIGHT, &stats));
        def.roots = NULL;
        assert_ok(vd_brick_view_update(all, NULL, &def, &camera, WIDTH, HEIGHT, NULL));
        check_part(b, all, some, roots, kept, false);
        /* Where the others are hidden: also what stands above them. */
        def.detail_px = 2.0;
        assert_ok(vd_brick_view_update(all, NULL, &def, &camera, WIDTH, HEIGHT, NULL));
        def.roots = roots;
        def.rest_hidden = true;
        assert_ok(vd_brick_view_update(some, NULL, &def, &camera, WIDTH, HEIGHT, NULL));
        check_part(b, all, some, roots, kept, true);
    }
    const vd_camera camera = camera_at(0, -90, 0, VD_PROJECTION_PERSPECTIVE);
    vd_brick_view_def def = vd_brick_view_def_default();
    def.roots = roots;
    def.root_count = 1;
    roots[0] = b->node_count;
    const vd_status status = vd_brick_view_update(some, NULL, &def, &camera, WIDTH, HEIGHT, NULL);
    assert_int_equal(status.code, VD_ERROR_ARGUMENT);
    assert_non_null(strstr(status.message, "root"));
    free(roots);
    vd_brick_view_destroy(&all);
    vd_brick_view_destroy(&some);
    vd_bricks_close(&b);
}

/* Weights of any cut add up to those of the data. */
static void test_weights(void **state) {
    (void)state;
    vd_bricks *b = open_rows(context, "x,y,z,mass,radius", 200);
    vd_brick_view *view = NULL;
    assert_ok(vd_brick_view_create(context, b, &view));
    double expected = 0.0;
    for (size_t i = 0; i < COUNT; i++) {
        expected += rows[i][3];
    }
    for (double distance = 100.0; distance < 1e5; distance *= 3.0) {
        const vd_camera camera = camera_at(12.0, -distance, 10.0, VD_PROJECTION_PERSPECTIVE);
        vd_brick_view_def def = vd_brick_view_def_default();
        def.mode = VD_SPLAT_DENSITY;
        def.weight = vd_bricks_find(b, "mass");
        vd_brick_view_stats stats;
        assert_ok(vd_brick_view_update(view, NULL, &def, &camera, WIDTH, HEIGHT, &stats));
        double sum = 0.0;
        for (int i = 0; i < view->count; i++) {
            for (size_t k = 0; k < view->splats[i].count; k++) {
                sum += (double)view->splats[i].weight[k];
            }
        }
        const double inside = stats.culled == 0 ? expected : sum;
        assert_true(fabs(sum - inside) < 1e-4 * inside);
    }
    vd_brick_view_destroy(&view);
    vd_bricks_close(&b);
}

/* ---- pictures -----------------------------------------------------------------------------------
 */

static vd_status draw(vd_splatter *splatter, vd_brick_view *view, const vd_brick_view_def *def,
                      const vd_camera *camera, vd_frame *frame) {
    vd_status status = vd_brick_view_update(view, NULL, def, camera, WIDTH, HEIGHT, NULL);
    if (status.code != VD_OK) {
        return status;
    }
    vd_splat_def splat_def = vd_splat_def_default();
    splat_def.mode = def->mode;
    splat_def.kernel = def->kernel;
    splat_def.background = (vd_rgba8){0, 0, 0, 255};
    return vd_splatter_render(splatter, NULL, &splat_def, camera, view->splats, view->count, frame,
                              NULL);
}

static double mean_of(const vd_frame *frame) {
    double sum = 0.0;
    for (int y = 0; y < HEIGHT; y++) {
        for (int x = 0; x < WIDTH; x++) {
            sum += frame->rgba[4 * ((size_t)y * frame->stride + (size_t)x)];
        }
    }
    return sum / (WIDTH * HEIGHT);
}

static double rms_of(const vd_frame *a, const vd_frame *b) {
    double sum = 0.0;
    for (int y = 0; y < HEIGHT; y++) {
        for (int x = 0; x < WIDTH; x++) {
            const size_t at = 4 * ((size_t)y * a->stride + (size_t)x);
            const double d = (double)a->rgba[at] - (double)b->rgba[at];
            sum += d * d;
        }
    }
    return sqrt(sum / (WIDTH * HEIGHT));
}

/* A zoom from where all is a dozen pixels to where leaves are drawn: beside the picture of all
 * particles neither the brightness nor its change from step to step differs to the eye. */
static void test_zoom(void **state) {
    (void)state;
    vd_frame *some = NULL, *all = NULL;
    assert_ok(vd_frame_create(context, WIDTH, HEIGHT, 0, &some));
    assert_ok(vd_frame_create(context, WIDTH, HEIGHT, 0, &all));
    const double shrink = test_is_reduced() ? 0.7 : 0.94;
    for (int own = 0; own < 2; own++) { /* radii of their own, and one for all */
        vd_bricks *b = open_rows(context, own ? "x,y,z,-,radius" : "x,y,z,-,-", 200);
        vd_brick_view *view = NULL;
        vd_splatter *splatter = NULL;
        assert_ok(vd_brick_view_create(context, b, &view));
        assert_ok(vd_splatter_create(context, &splatter));
        double last = 0.0, worst_rms = 0.0, worst_step = 0.0, worst_mean = 0.0;
        for (double distance = 650.0; distance > 30.0; distance *= shrink) {
            const vd_camera camera = camera_at(12.0, -distance, 10.0, VD_PROJECTION_PERSPECTIVE);
            vd_brick_view_def def = vd_brick_view_def_default();
            def.radius_m = own ? 0.0 : 0.3;
            def.radius_scale = own ? 6.0 : 1.0;
            def.opacity = 0.7;
            assert_ok(draw(splatter, view, &def, &camera, some));
            def.detail_px = -1.0;
            assert_ok(draw(splatter, view, &def, &camera, all));
            const double ratio = mean_of(some) / mean_of(all);
            const double step = last > 0.0 ? fabs(ratio / last - 1.0) : 0.0;
            worst_step = step > worst_step ? step : worst_step;
            worst_mean = fabs(ratio - 1.0) > worst_mean ? fabs(ratio - 1.0) : worst_mean;
            const double rms = rms_of(some, all);
            worst_rms = rms > worst_rms ? rms : worst_rms;
            last = ratio;
        }
        assert_true(worst_rms < 255.0 / 64.0);
        assert_true(worst_mean < 0.03);
        assert_true(worst_step < 0.015 || test_is_reduced()); /* of small steps */
        vd_splatter_destroy(&splatter);
        vd_brick_view_destroy(&view);
        vd_bricks_close(&b);
    }
    vd_frame_destroy(&some);
    vd_frame_destroy(&all);
}

/* The same bytes for any number of threads, with what was kept and without. */
static void test_same_picture(void **state) {
    (void)state;
    uint64_t hashes[VD_SPLAT_MODE_COUNT] = {0};
    static const int threads[] = {1, 2, 7};
    for (int t = 0; t < 3; t++) {
        vd_context *with = test_context(threads[t], VD_ISA_AUTO);
        vd_bricks *b = open_rows(with, "x,y,z,mass,radius", 200);
        vd_brick_view *view = NULL;
        vd_splatter *splatter = NULL;
        vd_frame *frame = NULL;
        assert_ok(vd_brick_view_create(with, b, &view));
        assert_ok(vd_splatter_create(with, &splatter));
        assert_ok(vd_frame_create(with, WIDTH, HEIGHT, 0, &frame));
        for (int mode = 0; mode < VD_SPLAT_MODE_COUNT; mode++) {
            vd_brick_view_def def = vd_brick_view_def_default();
            def.mode = (vd_splat_mode)mode;
            def.color = VD_BRICK_COLOR_VALUE;
            def.attribute = vd_bricks_find(b, "mass");
            const vd_camera elsewhere = camera_at(50.0, -20.0, 30.0, VD_PROJECTION_PERSPECTIVE);
            const vd_camera camera = camera_at(12.0, -90.0, 10.0, VD_PROJECTION_PERSPECTIVE);
            if (t == 1) {
                assert_ok(draw(splatter, view, &def, &elsewhere, frame));
            }
            assert_ok(draw(splatter, view, &def, &camera, frame));
            hashes[mode] = t == 0 ? vd_frame_hash(frame) : hashes[mode];
            assert_int_equal(vd_frame_hash(frame), hashes[mode]);
            const uint64_t before = vd_context_memory(with).allocations;
            assert_ok(draw(splatter, view, &def, &camera, frame));
            assert_int_equal(vd_context_memory(with).allocations, before);
        }
        vd_frame_destroy(&frame);
        vd_splatter_destroy(&splatter);
        vd_brick_view_destroy(&view);
        vd_bricks_close(&b);
        vd_context_destroy(&with);
    }
}

/* Little memory: what was not drawn lately goes. */
static void test_little_memory(void **state) {
    (void)state;
    vd_bricks *b = open_rows(context, "x,y,z,mass,-", 200);
    vd_brick_view *view = NULL;
    assert_ok(vd_brick_view_create(context, b, &view));
    const size_t before = vd_context_memory(context).bytes_now;
    vd_brick_view_def def = vd_brick_view_def_default();
    def.memory_bytes = 1;
    for (int i = 0; i < 40; i++) {
        const vd_camera camera =
            camera_at(10.0 * i - 200.0, -30.0, 10.0, VD_PROJECTION_PERSPECTIVE);
        vd_brick_view_stats stats;
        assert_ok(vd_brick_view_update(view, NULL, &def, &camera, WIDTH, HEIGHT, &stats));
        assert_true(vd_context_memory(context).bytes_now - before <= 8 * stats.particles);
    }
    vd_brick_view_destroy(&view);
    vd_bricks_close(&b);
}

static void test_bad(void **state) {
    (void)state;
    vd_bricks *b = open_rows(context, "x,y,z,mass,-", 200);
    vd_brick_view *view = NULL;
    assert_ok(vd_brick_view_create(context, b, &view));
    const vd_camera camera = camera_at(12.0, -90.0, 10.0, VD_PROJECTION_PERSPECTIVE);
    vd_brick_view_def def = vd_brick_view_def_default();
    assert_int_equal(vd_brick_view_update(view, NULL, &def, &camera, 0, 1, NULL).code,
                     VD_ERROR_ARGUMENT);
    def.color = VD_BRICK_COLOR_VALUE;
    def.attribute = 7;
    assert_int_equal(vd_brick_view_update(view, NULL, &def, &camera, 9, 9, NULL).code,
                     VD_ERROR_ARGUMENT);
    def.color = VD_BRICK_COLOR_CLASS;
    def.attribute = 0;
    assert_int_equal(vd_brick_view_update(view, NULL, &def, &camera, 9, 9, NULL).code,
                     VD_ERROR_ARGUMENT);
    def.color = VD_BRICK_COLOR_RGB;
    assert_int_equal(vd_brick_view_update(view, NULL, &def, &camera, 9, 9, NULL).code,
                     VD_ERROR_ARGUMENT);
    def = vd_brick_view_def_default();
    def.radius_m = NAN;
    assert_int_equal(vd_brick_view_update(view, NULL, &def, &camera, 9, 9, NULL).code,
                     VD_ERROR_ARGUMENT);
    vd_brick_view_destroy(&view);
    /* A brick that was damaged after the directory was checked. */
    const vd_bricks_node root = b->nodes[0];
    vd_bricks_close(&b);
    FILE *file = fopen("v.vdp", "r+b");
    fseek(file, (long)root.offset + 70, SEEK_SET);
    fputs("damage", file);
    fclose(file);
    assert_ok(vd_bricks_open(context, "v.vdp", &b));
    assert_ok(vd_brick_view_create(context, b, &view));
    def = vd_brick_view_def_default();
    def.detail_px = 1e9; /* the root alone */
    vd_status status = vd_brick_view_update(view, NULL, &def, &camera, WIDTH, HEIGHT, NULL);
    assert_int_equal(status.code, VD_ERROR_FORMAT);
    assert_non_null(strstr(status.message, "checksum of a brick"));
    assert_int_equal(view->count, 0);
    vd_brick_view_destroy(&view);
    vd_bricks_close(&b);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_choice),       cmocka_unit_test(test_roots),
        cmocka_unit_test(test_weights),      cmocka_unit_test(test_zoom),
        cmocka_unit_test(test_same_picture), cmocka_unit_test(test_little_memory),
        cmocka_unit_test(test_bad),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
