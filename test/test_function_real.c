/* Formulas in numbers: how exact the functions are, the noise, and that bounds enclose. */
#include <math.h>
#include "function_texts.h"
#include "terrain/function_kernels.h"

/* ---- accuracy ---------------------------------------------------------------------------------
 */

/* |got − exact| in units of the last place of a float of the size of `exact`. */
static double ulps(float got, double exact) {
    int exponent;
    frexp(exact, &exponent);
    exponent = exponent < -125 ? -125 : exponent;
    return fabs((double)got - exact) / ldexp(1.0, exponent - 24);
}

static double exact_pow(double a, double b) {
    return pow(a, b);
}
static double exact_atan2(double a, double b) {
    return atan2(a, b);
}

static void functions_are_as_exact_as_documented(void **state) {
    (void)state;
    static const struct {
        vd_function_op op;
        double (*one)(double);
        double (*two)(double, double);
        double lo, hi, lo2, hi2;
        double bound; /* ulps; the table in docs/function-terrain.md */
        const char *name;
    } cases[] = {
        {VD_OP_SIN, sin, NULL, -100, 100, 0, 0, 2.5, "sin"},
        {VD_OP_SIN, sin, NULL, -100000, 100000, 0, 0, 2.5, "sin far"},
        {VD_OP_COS, cos, NULL, -100, 100, 0, 0, 2.5, "cos"},
        {VD_OP_COS, cos, NULL, -100000, 100000, 0, 0, 2.5, "cos far"},
        {VD_OP_TAN, tan, NULL, -1000, 1000, 0, 0, 4, "tan"},
        {VD_OP_ATAN2, NULL, exact_atan2, -1000, 1000, -1000, 1000, 3, "atan2"},
        {VD_OP_EXP, exp, NULL, -87, 88, 0, 0, 1.5, "exp"},
        {VD_OP_EXP, exp, NULL, -104, -87, 0, 0, 1.5, "exp denormal"},
        {VD_OP_LOG, log, NULL, 0, 3e38, 0, 0, 1.5, "log"},
        {VD_OP_LOG, log, NULL, 0.5, 2, 0, 0, 1.5, "log near 1"},
        {VD_OP_LOG, log, NULL, 0, 1e-38, 0, 0, 1.5, "log denormal"},
        {VD_OP_POW, NULL, exact_pow, 0, 1000, -12, 12, 0.51, "pow"},
        {VD_OP_POW, NULL, exact_pow, 0, 1, -10, 100, 0.51, "pow small"},
    };
    for (size_t c = 0; c < sizeof cases / sizeof cases[0]; c++) {
        uint64_t random = 77;
        double worst = 0;
        float worst_a = 0;
        for (int i = 0; i < rounds(400000); i++) {
            const float a =
                (float)(cases[c].lo + (cases[c].hi - cases[c].lo) * test_uniform(&random));
            const float b =
                (float)(cases[c].lo2 + (cases[c].hi2 - cases[c].lo2) * test_uniform(&random));
            const double exact =
                cases[c].one != NULL ? cases[c].one((double)a) : cases[c].two((double)a, (double)b);
            const double got = (double)vd_function_apply(cases[c].op, a, b, 0);
            /* far from 0 the last part of π/2 shows next to the zeros */
            if (fabs(exact) > 3.4028234e38 ||
                fabs(got - exact) < (fabs((double)a) > 1000 ? 2e-11 : 0)) {
                continue;
            }
            const double error = ulps((float)got, exact);
            worst_a = error > worst ? a : worst_a;
            worst = error > worst ? error : worst;
        }
        print_message("%s: %.3f ulp at %g\n", cases[c].name, worst, (double)worst_a);
        if (!(worst <= cases[c].bound)) {
            fail_msg("%s is off by %g ulp at %g", cases[c].name, worst, (double)worst_a);
        }
    }
}

static void far_angles_stay_in_range(void **state) {
    (void)state;
    uint64_t random = 3;
    for (int i = 0; i < rounds(200000); i++) {
        const float x = (float)((test_uniform(&random) - 0.5) * (i % 2 ? 1e7 : 4e5));
        const float s = vd_function_apply(VD_OP_SIN, x, 0, 0);
        const float c = vd_function_apply(VD_OP_COS, x, 0, 0);
        assert_true(fabsf(s) <= 1.0f && fabsf(c) <= 1.0f);
        if (fabsf(x) < 4e6f) { /* the error is that of moving x by less than its own float step */
            assert_true(fabs((double)s - sin((double)x)) <=
                        2e-7 * fmax(1.0, fabs((double)x) - 1e5));
        }
    }
    assert_true(isnan(vd_function_apply(VD_OP_SIN, INFINITY, 0, 0)));
    assert_true(isnan(vd_function_apply(VD_OP_COS, NAN, 0, 0)));
    assert_true(vd_function_apply(VD_OP_COS, 1e30f, 0, 0) == 1.0f);
}

static void noise_is_smooth_and_within_its_range(void **state) {
    (void)state;
    uint64_t random = 4;
    double sum = 0, square = 0, most = 0;
    const int count = rounds(200000);
    for (int i = 0; i < count; i++) {
        const float x = (float)((test_uniform(&random) - 0.5) * 2000);
        const float y = (float)((test_uniform(&random) - 0.5) * 2000);
        const float n = vd_function_noise(x, y, 0), m = vd_function_noise(x + 0.001f, y, 0);
        assert_true(n > -1.0f && n < 1.0f);
        assert_true(fabsf(n - m) < 4.75f * 0.0011f);
        const float f = vd_function_apply(VD_OP_FBM, x, y, 8);
        const float r = vd_function_apply(VD_OP_RIDGED, x, y, 8);
        assert_true(f > -2.0f && f < 2.0f && r >= 0.0f && r < 2.0f);
        sum += (double)n;
        square += (double)n * (double)n;
        most = fmax(most, fabs((double)n));
    }
    print_message("noise: mean %.4f, deviation %.4f, largest %.3f\n", sum / count,
                  sqrt(square / count), most);
    assert_true(fabs(sum / count) < 0.01 && sqrt(square / count) > 0.15 && most > 0.5);
    for (int i = -3; i < 3; i++) {
        assert_true(vd_function_noise((float)i, (float)(2 * i), 5) == 0.0f);
    }
    assert_true(isnan(vd_function_noise(INFINITY, 0, 0)));
    assert_true(vd_function_noise(1e30f, 5, 0) == 0.0f);
    assert_true(vd_function_apply(VD_OP_FBM, 1.3f, 2.4f, NAN) == vd_function_noise(1.3f, 2.4f, 0));
}

/* Pinned: a change of the noise or of a polynomial changes everybody's terrain. */
static void the_noise_is_what_it_was(void **state) {
    (void)state;
    uint64_t hash = 1469598103934665603u;
    for (int i = 0; i < 1000; i++) {
        const float v[3] = {vd_function_apply(VD_OP_FBM, (float)i * 0.37f, (float)i * -0.11f, 6),
                            vd_function_apply(VD_OP_RIDGED, (float)i * 0.21f, (float)i * 0.4f, 6),
                            vd_function_apply(VD_OP_SIN, (float)i * 0.7f, 0, 0)};
        uint8_t bytes[sizeof v];
        memcpy(bytes, v, sizeof v);
        for (size_t k = 0; k < sizeof v; k++) {
            hash = (hash ^ bytes[k]) * 1099511628211u;
        }
    }
    assert_true(hash == 0x3267b680ece2201fu);
}

/* ---- bounds -----------------------------------------------------------------------------------
 */

static void check_bounds(vd_context *context, const char *text, uint64_t *random) {
    vd_function *f = compile(context, text);
    for (int box = 0; box < 6; box++) {
        const double scale[] = {1e-3, 0.1, 1, 30, 1000, 1e5};
        const double size = scale[test_random(random) % 6], far = scale[test_random(random) % 6];
        float x0 = (float)((test_uniform(random) - 0.5) * far);
        float y0 = (float)((test_uniform(random) - 0.5) * far);
        if (test_random(random) % 8 == 0) {
            x0 = y0 = 0.0f;
        }
        const float x1 = x0 + (float)(size * test_uniform(random));
        const float y1 = box == 5 ? y0 : y0 + (float)(size * test_uniform(random));
        float lo, hi, x[64], y[64], h[64];
        vd_function_bounds(f, x0, x1, y0, y1, &lo, &hi);
        assert_true(lo <= hi);
        for (int i = 0; i < 64; i++) {
            x[i] = i < 2 ? (i ? x1 : x0)
                         : (float)((double)x0 + ((double)x1 - (double)x0) * test_uniform(random));
            y[i] = i % 9 == 0
                       ? y0
                       : (float)((double)y0 + ((double)y1 - (double)y0) * test_uniform(random));
        }
        vd_function_evaluate(f, 64, x, y, h, NULL);
        for (int i = 0; i < 64; i++) {
            if (h[i] != -INFINITY && !(h[i] >= lo && h[i] <= hi)) {
                fail_msg("%s at (%.9g, %.9g) is %.9g, outside %.9g … %.9g", text, (double)x[i],
                         (double)y[i], (double)h[i], (double)lo, (double)hi);
            }
        }
    }
    vd_function_destroy(context, &f);
}

static void bounds_enclose_every_sample(void **state) {
    (void)state;
    uint64_t random = 6;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    static const char *const texts[] = {"h=60*cos(x/40)*sin(y/40)",
                                        "h=fbm(x/30,y/30,8)*100",
                                        "h=ridged(x/50,y/50,6)^1.5*300",
                                        "h=mod(x,7)+floor(y/3)",
                                        "h=atan2(y,x)",
                                        "h=exp(-(x*x+y*y)/100)*50",
                                        "h=tan(x/1000)",
                                        "h=x>y?x:y",
                                        "h=noise(x,y)",
                                        "h=sqrt(x)+log(y)",
                                        "h=1/(x*x+1)",
                                        "h=min(x/y,y/x)",
                                        "h=abs(x)^0.3",
                                        "h=max(sqrt(x),y)",
                                        "h=y^x"};
    for (int round = 0; round < rounds(150); round++) {
        for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
            check_bounds(context, texts[i], &random);
        }
    }
    for (int round = 0; round < rounds(15000); round++) {
        char text[500] = "h=";
        random_number_text(&random, 1 + round % 5, text + 2);
        check_bounds(context, text, &random);
    }
    vd_context_destroy(&context);
}

static void bounds_are_tight_where_they_can_be(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    static const struct {
        const char *text;
        float x0, x1, lo, hi, slack;
    } cases[] = {
        {"h=2*x+1", -1, 3, -1, 7, 0},
        {"h=x^2", -1, 3, 0, 9, 0},
        {"h=sin(x)", 1, 2, 0.8414710f, 1, 1e-5f},
        {"h=cos(x)", -1, 1, 0.5403023f, 1, 1e-5f},
        {"h=exp(x)", 0, 1, 1, 2.7182818f, 1e-5f},
        {"h=abs(x)", -2, 1, 0, 2, 0},
        {"h=x>5?100:x", 0, 4, 0, 4, 0},
        {"h=fbm(x/1000,0.5,4)", 10, 10.01f, -0.9f, 0.9f, 1},
        {"h=sqrt(x)", 4, 9, 2, 3, 0},
        {"h=mod(x,10)", 23, 24, 3, 4, 1e-4f},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        vd_function *f = compile(context, cases[i].text);
        float lo, hi;
        vd_function_bounds(f, cases[i].x0, cases[i].x1, 0, 0, &lo, &hi);
        if (fabsf(lo - cases[i].lo) > cases[i].slack || fabsf(hi - cases[i].hi) > cases[i].slack) {
            fail_msg("%s: %.9g … %.9g", cases[i].text, (double)lo, (double)hi);
        }
        vd_function_destroy(context, &f);
    }
    /* Noise over a hundredth of a cell is known to within a small part of its range. */
    vd_function *f = compile(context, "h=fbm(x,y,1)");
    float lo, hi;
    vd_function_bounds(f, 5.3f, 5.31f, 2.6f, 2.61f, &lo, &hi);
    assert_true(hi - lo < 0.11f);
    vd_function_bounds(f, 1, 0, 0, 1, &lo, &hi);
    assert_true(lo == -INFINITY && hi == INFINITY);
    vd_function_bounds(f, NAN, 1, 0, 1, &lo, &hi);
    assert_true(lo == -INFINITY && hi == INFINITY);
    vd_function_destroy(context, &f);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(functions_are_as_exact_as_documented),
        cmocka_unit_test(far_angles_stay_in_range),
        cmocka_unit_test(noise_is_smooth_and_within_its_range),
        cmocka_unit_test(the_noise_is_what_it_was),
        cmocka_unit_test(bounds_enclose_every_sample),
        cmocka_unit_test(bounds_are_tight_where_they_can_be),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
