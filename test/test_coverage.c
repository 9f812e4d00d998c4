/* Coverage against the truth: the reference, areas known from geometry, and what must not change
 * it. */
#include "coverage_scenes.h"

/* What vd_coverage_draw promises, in 65535ths. */
#define BOUND 16

typedef struct fixture {
    vd_context *context;
    vd_coverage *coverage;
} fixture;

static int set_up(void **state) {
    static fixture f;
    f.context = test_context(1, VD_ISA_AUTO);
    assert_ok(vd_coverage_create(f.context, &f.coverage));
    *state = &f;
    return 0;
}

static int tear_down(void **state) {
    fixture *f = *state;
    vd_coverage_destroy(&f->coverage);
    vd_context_destroy(&f->context);
    return 0;
}

static int rounds(int count) {
    return test_is_reduced() ? count / 10 : count;
}

static vd_layer polygon(const double (*points)[2], size_t count) {
    vd_layer layer = vd_layer_default();
    layer.path.points = points;
    layer.path.point_count = count;
    return layer;
}

static vd_stroke random_stroke(uint64_t *random) {
    vd_stroke stroke = vd_stroke_default();
    stroke.width = 0.2 + 4 * test_uniform(random);
    stroke.join = (vd_join)(test_random(random) % VD_JOIN_COUNT);
    stroke.cap = (vd_cap)(test_random(random) % VD_CAP_COUNT);
    stroke.miter_limit = (double)(test_random(random) % 3);
    if (test_random(random) % 4 == 0) {
        stroke.dash_count = 4;
        for (int i = 0; i < 4; i++) {
            stroke.dashes[i] = 3 * test_uniform(random);
        }
        stroke.dash_offset = 10 * test_uniform(random) - 5;
    }
    return stroke;
}

/* Several subpaths of lines and curves. */
static size_t random_verbs(uint64_t *random, uint8_t *verbs, size_t *verb_count) {
    static const size_t counts[VD_PATH_VERB_COUNT] = {1, 1, 2, 3, 0};
    size_t points = 1, count = 0;
    verbs[count++] = VD_PATH_MOVE;
    for (int i = 0; i < 6; i++) {
        verbs[count] = (uint8_t)(test_random(random) % VD_PATH_VERB_COUNT);
        points += counts[verbs[count++]];
    }
    *verb_count = count;
    return points;
}

/* ---- the reference ----------------------------------------------------------------------------*/

static void compare(fixture *f, const vd_layer *layer, uint64_t *random) {
    const int x = (int)(test_random(random) % 12) - 4, y = (int)(test_random(random) % 40) - 4;
    plane fast = plane_make(x, y, 18, 40), slow = plane_make(x, y, 18, 40);
    plane_draw(&fast, f->coverage, VD_COVERAGE_ROWS, layer, 1);
    plane_draw(&slow, f->coverage, VD_COVERAGE_REFERENCE, layer, 1);
    assert_in_range(plane_difference(&fast, &slow), 0, BOUND);
    free(fast.at);
    free(slow.at);
}

static void polygons_are_as_the_reference(void **state) {
    uint64_t random = 1;
    for (int round = 0; round < rounds(400); round++) {
        double points[24][2];
        const size_t count = test_random(&random) % (round % 3 == 0 ? 24 : 7);
        random_corners(&random, 24, count, points);
        vd_layer layer = polygon((const double(*)[2])points, count);
        layer.rule = (vd_fill_rule)(round % 2);
        layer.expand = round % 5 == 0 ? 2 * test_uniform(&random) : 0;
        compare(*state, &layer, &random);
    }
}

static void curves_and_strokes_are_as_the_reference(void **state) {
    uint64_t random = 2;
    for (int round = 0; round < rounds(120); round++) {
        double points[20][2];
        uint8_t verbs[8];
        vd_layer layer = vd_layer_default();
        layer.path.verbs = verbs;
        layer.path.point_count = random_verbs(&random, verbs, &layer.path.verb_count);
        layer.path.points = (const double(*)[2])points;
        random_corners(&random, 24, layer.path.point_count, points);
        vd_stroke stroke = random_stroke(&random);
        layer.stroke = &stroke;
        layer.filled = round % 2 == 0;
        layer.rule = (vd_fill_rule)(round / 2 % 2);
        layer.stroke = layer.filled ? NULL : &stroke;
        compare(*state, &layer, &random);
    }
}

/* ---- areas ------------------------------------------------------------------------------------*/

static double shoelace(const double (*p)[2], size_t count) {
    double twice = 0;
    for (size_t i = 0; i < count; i++) {
        const double *a = p[i], *b = p[(i + 1) % count];
        twice += a[0] * b[1] - a[1] * b[0];
    }
    return fabs(twice) / 2;
}

/* A star about a point: simple, with as many corners as wanted. */
static void make_star(uint64_t *random, double x, double y, double radius, double depth,
                      size_t count, double (*out)[2]) {
    for (size_t i = 0; i < count; i++) {
        const double angle = 6.283185307179586 * (double)i / (double)count;
        const double r = radius * (1 - depth * test_uniform(random));
        out[i][0] = x + r * cos(angle);
        out[i][1] = y + r * sin(angle);
    }
}

static void area_is_kept(void **state) {
    fixture *f = *state;
    uint64_t random = 3;
    static const size_t counts[] = {3, 4, 5, 9, 50, 1000, 100000};
    plane p = plane_make(0, 0, 200, 200);
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
        double(*points)[2] = calloc(counts[i], sizeof *points);
        assert_non_null(points);
        for (int round = 0; round < 3; round++) {
            /* A hundred thousand spikes would take a while: a rough circle will do. */
            make_star(&random, 100 + test_uniform(&random), 100, 1 + 32 * round,
                      counts[i] > 1000 ? 0.02 : 0.3 * round, counts[i], points);
            vd_layer layer = polygon((const double(*)[2])points, counts[i]);
            plane_draw(&p, f->coverage, VD_COVERAGE_ROWS, &layer, 1);
            /* A pixel is rounded to 1/65535; some 1000 are touched by an outline. */
            assert_true(fabs(plane_area(&p) - shoelace(layer.path.points, counts[i])) < 0.01);
        }
        free(points);
    }
    free(p.at);
}

static double stroke_area(fixture *f, const double (*points)[2], size_t count, bool open,
                          const vd_stroke *stroke) {
    plane p = plane_make(0, 0, 64, 64);
    vd_layer layer = polygon(points, count);
    layer.path.open = open;
    layer.filled = false;
    layer.stroke = stroke;
    plane_draw(&p, f->coverage, VD_COVERAGE_ROWS, &layer, 1);
    const double area = plane_area(&p);
    free(p.at);
    return area;
}

static void strokes_have_their_area(void **state) {
    fixture *f = *state;
    const double line[2][2] = {{10.3, 12.1}, {34.3, 44.1}}; /* 40 long */
    const double corner[3][2] = {{10, 10}, {40, 10}, {40, 50}};
    vd_stroke stroke = vd_stroke_default();
    stroke.width = 6;
    static const double ends[VD_CAP_COUNT] = {0, 9 * 3.14159265358979, 36};
    for (int cap = 0; cap < VD_CAP_COUNT; cap++) {
        stroke.cap = (vd_cap)cap;
        assert_true(fabs(stroke_area(f, line, 2, true, &stroke) - 240 - ends[cap]) < 0.2);
        /* The same point twice is a dot; one point is nothing. */
        const double dot[2][2] = {{30.2, 30.7}, {30.2, 30.7}};
        assert_true(fabs(stroke_area(f, dot, 2, true, &stroke) - ends[cap]) < 0.2);
        assert_true(stroke_area(f, dot, 1, true, &stroke) == 0);
    }
    stroke.cap = VD_CAP_BUTT;
    static const double joins[VD_JOIN_COUNT] = {9, 9 * 3.14159265358979 / 4, 4.5};
    for (int join = 0; join < VD_JOIN_COUNT; join++) {
        stroke.join = (vd_join)join;
        /* Two rectangles that share a quarter of the square at the corner, and the join. */
        const double two = 6 * 30 + 6 * 40 - 9;
        assert_true(fabs(stroke_area(f, corner, 3, true, &stroke) - two - joins[join]) < 0.1);
        /* Closed: a triangle's three sides; only that more is covered than by two. */
        assert_true(stroke_area(f, corner, 3, false, &stroke) > two + 200);
    }
    stroke.dash_count = 2;
    stroke.dashes[0] = 3;
    stroke.dashes[1] = 5;
    assert_true(fabs(stroke_area(f, line, 2, true, &stroke) - 6 * 15) < 0.01);
    stroke.dash_offset = 3;
    assert_true(fabs(stroke_area(f, line, 2, true, &stroke) - 6 * 15) < 0.01);
    /* A miter beyond its limit is a bevel. */
    const double sharp[3][2] = {{10, 30}, {40, 31}, {10, 32}};
    stroke.dash_count = 0;
    stroke.join = VD_JOIN_BEVEL;
    const double bevel = stroke_area(f, sharp, 3, true, &stroke);
    stroke.join = VD_JOIN_MITER;
    assert_true(stroke_area(f, sharp, 3, true, &stroke) == bevel);
    stroke.miter_limit = 64;
    assert_true(stroke_area(f, sharp, 3, true, &stroke) > bevel + 50);
}

static void windings_follow_the_rule(void **state) {
    fixture *f = *state;
    static const double twice[8][2] = {{2, 2}, {9, 2}, {9, 9}, {2, 9},
                                       {2, 2}, {9, 2}, {9, 9}, {2, 9}};
    static const double eight[4][2] = {{2, 2}, {10, 10}, {10, 2}, {2, 10}}; /* crosses at (6, 6) */
    static const double rings[8][2] = {{0, 0}, {12, 0}, {12, 12}, {0, 12},
                                       {3, 3}, {3, 9},  {9, 9},   {9, 3}};
    static const double same[8][2] = {{0, 0}, {12, 0}, {12, 12}, {0, 12},
                                      {3, 3}, {9, 3},  {9, 9},   {3, 9}};
    static const uint8_t verbs[10] = {0, 1, 1, 1, 4, 0, 1, 1, 1, 4};
    const struct {
        const double (*points)[2];
        size_t count;
        bool subpaths;
        double area[VD_FILL_RULE_COUNT];
    } cases[] = {{twice, 8, false, {49, 0}},
                 {eight, 4, false, {32, 32}},
                 {rings, 8, true, {144 - 36, 144 - 36}},
                 {same, 8, true, {144, 144 - 36}}};
    plane p = plane_make(0, 0, 13, 13);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        for (int rule = 0; rule < VD_FILL_RULE_COUNT; rule++) {
            vd_layer layer = polygon(cases[i].points, cases[i].count);
            layer.path.verbs = cases[i].subpaths ? verbs : NULL;
            layer.path.verb_count = cases[i].subpaths ? sizeof verbs : 0;
            layer.rule = (vd_fill_rule)rule;
            plane_draw(&p, f->coverage, VD_COVERAGE_ROWS, &layer, 1);
            assert_true(fabs(plane_area(&p) - cases[i].area[rule]) < 1e-3);
        }
    }
    free(p.at);
}

/* ---- what must not matter ---------------------------------------------------------------------*/

/* Corners on a grid that moving by whole pixels keeps. */
static void snap_corners(double (*points)[2], size_t count) {
    for (size_t i = 0; i < 2 * count; i++) {
        points[i / 2][i % 2] = floor(points[i / 2][i % 2] * 1024) / 1024;
    }
}

static void whole_pixels_change_nothing(void **state) {
    fixture *f = *state;
    uint64_t random = 4;
    plane a = plane_make(-3, -2, 40, 75), b = a;
    b.at = calloc((size_t)a.width * (size_t)a.height, sizeof *b.at);
    assert_non_null(b.at);
    for (int round = 0; round < rounds(1000); round++) {
        double points[20][2];
        uint8_t verbs[8];
        vd_layer layer = vd_layer_default();
        layer.path.verbs = verbs;
        layer.path.point_count = random_verbs(&random, verbs, &layer.path.verb_count);
        layer.path.points = (const double(*)[2])points;
        random_corners(&random, 60, layer.path.point_count, points);
        snap_corners(points, layer.path.point_count);
        const vd_stroke stroke = random_stroke(&random);
        layer.filled = round % 2 == 0;
        layer.stroke = layer.filled ? NULL : &stroke;
        plane_draw(&a, f->coverage, VD_COVERAGE_ROWS, &layer, 1);
        /* Path and window moved together, or the window's part that is nearer. */
        const int dx = (int)(test_random(&random) % 5000) - 2500, dy = (int)(round % 64) - 17;
        layer.picture_from_path.x0 = dx;
        layer.picture_from_path.y0 = dy;
        b.x = a.x + dx;
        b.y = a.y + dy;
        plane_draw(&b, f->coverage, VD_COVERAGE_ROWS, &layer, 1);
        assert_true(plane_equal(&a, &b));
    }
    free(a.at);
    free(b.at);
}

/* A window shows what a larger one shows there: cutting at its sides changes at most the last bit,
 * where a flat edge is cut within a pixel. */
static void windows_agree(void **state) {
    fixture *f = *state;
    uint64_t random = 5;
    plane large = plane_make(-30, -30, 150, 150);
    for (int round = 0; round < rounds(400); round++) {
        double points[12][2];
        const size_t count = 3 + test_random(&random) % 9;
        random_corners(&random, 90, count, points);
        vd_layer layer = polygon((const double(*)[2])points, count);
        layer.rule = (vd_fill_rule)(round % 2);
        plane_draw(&large, f->coverage, VD_COVERAGE_ROWS, &layer, 1);
        plane small =
            plane_make((int)(test_random(&random) % 60), (int)(test_random(&random) % 60), 20, 40);
        plane_draw(&small, f->coverage, VD_COVERAGE_ROWS, &layer, 1);
        for (int y = 0; y < small.height; y++) {
            for (int x = 0; x < small.width; x++) {
                const int other = large.at[(y + small.y + 30) * 150 + x + small.x + 30];
                assert_true(abs(small.at[y * small.width + x] - other) <= 1);
            }
        }
        free(small.at);
    }
    free(large.at);
}

static void orientation_changes_nothing(void **state) {
    fixture *f = *state;
    uint64_t random = 6;
    plane a = plane_make(0, 0, 60, 60), b = plane_make(0, 0, 60, 60);
    for (int round = 0; round < rounds(1000); round++) {
        double points[20][2], reversed[20][2];
        const size_t count = 3 + test_random(&random) % (round % 2 ? 2 : 17);
        random_corners(&random, 60, count, points);
        for (size_t i = 0; i < count; i++) {
            memcpy(reversed[i], points[count - 1 - i], sizeof points[i]);
        }
        vd_layer layer = polygon((const double(*)[2])points, count);
        layer.rule = (vd_fill_rule)(round / 2 % 2);
        plane_draw(&a, f->coverage, VD_COVERAGE_ROWS, &layer, 1);
        layer.path.points = (const double(*)[2])reversed;
        plane_draw(&b, f->coverage, VD_COVERAGE_ROWS, &layer, 1);
        assert_true(plane_equal(&a, &b));
    }
    free(a.at);
    free(b.at);
}

/* A square cut into triangles about a point of its own: together they cover every pixel once. */
static void neighbours_sum_to_one(void **state) {
    fixture *f = *state;
    uint64_t random = 7;
    plane p = plane_make(0, 0, 70, 70);
    int *sum = calloc(70 * 70, sizeof *sum);
    assert_non_null(sum);
    for (int round = 0; round < rounds(200); round++) {
        enum { RING = 7 };
        double ring[RING][2];
        make_star(&random, 35, 35, 30, 0.4, RING, ring);
        const double middle[2] = {34 + test_uniform(&random), 34 + test_uniform(&random)};
        memset(sum, 0, 70 * 70 * sizeof *sum);
        vd_layer layer = polygon((const double(*)[2])ring, RING);
        plane_draw(&p, f->coverage, VD_COVERAGE_ROWS, &layer, 1);
        for (int i = 0; i < 70 * 70; i++) {
            sum[i] -= p.at[i];
        }
        for (int part = 0; part < RING; part++) {
            double points[3][2];
            memcpy(points[0], middle, sizeof middle);
            memcpy(points[1], ring[part], sizeof middle);
            memcpy(points[2], ring[(part + 1) % RING], sizeof middle);
            layer = polygon((const double(*)[2])points, 3);
            plane_draw(&p, f->coverage, VD_COVERAGE_ROWS, &layer, 1);
            for (int i = 0; i < 70 * 70; i++) {
                sum[i] += p.at[i];
            }
        }
        for (int i = 0; i < 70 * 70; i++) {
            /* Each part of a pixel is rounded; at the middle all of them meet. */
            assert_true(abs(sum[i]) <= RING / 2 + 1);
        }
    }
    free(sum);
    free(p.at);
}

/* ---- far away ---------------------------------------------------------------------------------*/

static void far_paths_are_clipped(void **state) {
    fixture *f = *state;
    const double far = 5e8;
    /* The picture is a speck inside, then beside. */
    const double around[4][2] = {{-far, -far}, {far, -far}, {far, far}, {-far, far}};
    const double beside[4][2] = {{20, -far}, {far, -far}, {far, far}, {20, far}};
    const double slanted[3][2] = {{-far, -far}, {far, far}, {-far, far}}; /* below the diagonal */
    plane p = plane_make(0, 0, 20, 20);
    vd_layer layer = polygon(around, 4);
    plane_draw(&p, f->coverage, VD_COVERAGE_ROWS, &layer, 1);
    assert_true(plane_area(&p) == 400);
    layer.path.points = beside;
    plane_draw(&p, f->coverage, VD_COVERAGE_ROWS, &layer, 1);
    assert_true(plane_area(&p) == 0);
    layer = polygon(slanted, 3);
    plane_draw(&p, f->coverage, VD_COVERAGE_ROWS, &layer, 1);
    assert_true(fabs(plane_area(&p) - 200) < 0.01);
    free(p.at);
    /* Dashes along a line that is mostly elsewhere cost what is seen of them. */
    const double line[2][2] = {{-far, 30}, {far, 30}};
    vd_stroke stroke = vd_stroke_default();
    stroke.width = 2;
    stroke.dash_count = 2;
    stroke.dashes[0] = stroke.dashes[1] = 0.5;
    assert_true(fabs(stroke_area(f, line, 2, true, &stroke) - 64) < 1);
}

/* Of a large path in a small window the edges that are not seen are not kept. */
static void what_is_outside_takes_no_memory(void **state) {
    (void)state;
    enum { COUNT = 100000 };
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_coverage *coverage = NULL;
    assert_ok(vd_coverage_create(context, &coverage));
    double(*points)[2] = calloc(COUNT, sizeof *points);
    assert_non_null(points);
    uint64_t random = 8;
    make_star(&random, 0, 0, 30000, 0.1, COUNT, points);
    const vd_layer layer = polygon((const double(*)[2])points, COUNT);
    plane p = plane_make(26000, 0, 40, 40);
    plane_draw(&p, coverage, VD_COVERAGE_ROWS, &layer, 1);
    assert_true(vd_context_memory(context).bytes_peak < 1 << 20);
    p.x = 1000;
    plane_draw(&p, coverage, VD_COVERAGE_ROWS, &layer, 1);
    assert_true(plane_area(&p) == 1600);
    p.x = 40000;
    plane_draw(&p, coverage, VD_COVERAGE_ROWS, &layer, 1);
    assert_true(plane_area(&p) == 0);
    assert_true(vd_context_memory(context).bytes_peak < 1 << 20);
    free(points);
    free(p.at);
    vd_coverage_destroy(&coverage);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(polygons_are_as_the_reference),
        cmocka_unit_test(curves_and_strokes_are_as_the_reference),
        cmocka_unit_test(area_is_kept),
        cmocka_unit_test(strokes_have_their_area),
        cmocka_unit_test(windings_follow_the_rule),
        cmocka_unit_test(whole_pixels_change_nothing),
        cmocka_unit_test(windows_agree),
        cmocka_unit_test(orientation_changes_nothing),
        cmocka_unit_test(neighbours_sum_to_one),
        cmocka_unit_test(far_paths_are_clipped),
        cmocka_unit_test(what_is_outside_takes_no_memory),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
