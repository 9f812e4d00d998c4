/* Formulas: what they mean, how they fail, and that every evaluator and every bound agrees. */
#include <math.h>
#include <stdio.h>
#include "support.h"
#include "terrain/function_kernels.h"
#include <veduta/function.h>

static int rounds(int full) {
    return getenv("VEDUTA_TEST_REDUCED") != NULL ? (full + 9) / 10 : full;
}

static vd_function *compile(vd_context *context, const char *text) {
    vd_function *f = NULL;
    const vd_status status = vd_function_compile(context, text, &f);
    if (status.code != VD_OK) {
        fail_msg("%s\n%s", text, status.message);
    }
    return f;
}

/* The height that a text gives at one point. */
static float height(vd_context *context, const char *text, float x, float y) {
    vd_function *f = compile(context, text);
    float h = 0.0f;
    vd_function_evaluate(f, 1, &x, &y, &h, NULL);
    vd_function_destroy(context, &f);
    assert_null(f);
    return h;
}

static void expressions_mean_what_they_say(void **state) {
    (void)state;
    static const struct {
        const char *text;
        float expected; /* at x = 3, y = −2 */
    } cases[] = {
        {"h=x", 3},
        {"h=y", -2},
        {"h = 1 + 2 * 3", 7},
        {"h=(1+2)*3", 9},
        {"h=8/4/2", 1},
        {"h=8-4-2", 2},
        {"h=-x^2", -9},
        {"h=(-x)^2", 9},
        {"h=2^3^2", 512},
        {"h=2^-1", 0.5f},
        {"h=x^-2*9", 1},
        {"h=y^3", -8},
        {"h=y^x", -8},
        {"h=x^0", 1},
        {"h=--x", 3},
        {"h=+x", 3},
        {"h=1e2+.5+2.", 102.5f},
        {"h=x<y", 0},
        {"h=x>y", 1},
        {"h=x<=3", 1},
        {"h=x>=4", 0},
        {"h=x==3", 1},
        {"h=x!=3", 0},
        {"h=x<y or y<0", 1},
        {"h=x<y and y<0", 0},
        {"h=not x<y", 1},
        {"h=not not x", 1},
        {"h=x>0&&y>0||1", 1},
        {"h=x>0 ? 10 : 20", 10},
        {"h=x<0 ? 10 : y<0 ? 30 : 20", 30},
        {"h=min(x,y)", -2},
        {"h=max(x,y)", 3},
        {"h=abs(y)", 2},
        {"h=floor(-2.5)", -3},
        {"h=mod(y,5)", 3},
        {"h=mod(x,-5)", -2},
        {"h=sqrt(x+1)", 2},
        {"h=mix(x,y,.5)", 0.5f},
        {"h=clamp(x,0,1)", 1},
        {"h=clamp(y,0,1)", 0},
        {"a=x*x; b=a+y; h=a-b", 2},
        {";;a=1; \n h = a;\n", 1},
        {"h=exp(0)+log(1)+sin(0)+cos(0)+tan(0)+atan2(0,1)", 2},
        {"h = 2 × 3 ÷ 2 − 1", 2},
        {"h=noise(4,7)", 0},
        {"rgb=hsv(0,1,1); h=1", 1},
    };
    vd_context *context = test_context(1, VD_ISA_AUTO);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const float h = height(context, cases[i].text, 3.0f, -2.0f);
        if (h != cases[i].expected) {
            fail_msg("%s is %g, not %g", cases[i].text, (double)h, (double)cases[i].expected);
        }
    }
    assert_true(fabsf(height(context, "h=pi-π+pi", 0, 0) - 3.1415927f) < 1e-6f);
    vd_context_destroy(&context);
}

static void undefined_heights_are_holes(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    static const char *const texts[] = {
        "h=1/0",     "h=x/0",         "h=0/x",      "h=sqrt(-1-x*x)", "h=log(x)",
        "h=log(-1)", "h=(-2)^(x+.5)", "h=exp(999)", "h=mod(x+1, x)",  "h=1e38*1e38*(x+1)"};
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        assert_true(height(context, texts[i], 0, 0) == -INFINITY);
    }
    assert_true(height(context, "h = x/0 > 1 ? 5 : 6", 1, 0) == 5);
    /* Undefined colours are black there, and the terrain stays. */
    vd_function *f = compile(context, "h=1; rgb=rgb(x/x, 2, -1)");
    const float x = 0, y = 0;
    float h, r, g, b;
    float *const planes[3] = {&r, &g, &b};
    vd_function_evaluate(f, 1, &x, &y, &h, planes);
    assert_true(h == 1 && r == 0 && g == 1 && b == 0);
    vd_function_destroy(context, &f);
    vd_context_destroy(&context);
}

static void colors_follow_hsv(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_function *f = compile(context, "h=60*cos(x/40)*sin(y/40); rgb=hsv(x, y, 1)");
    assert_true(vd_function_has_color(f));
    static const float expected[][5] = {{0, 1, 1, 0, 0},        {1.0f / 6, 1, 1, 1, 0},
                                        {1.0f / 3, 1, 0, 1, 0}, {0.5f, 1, 0, 1, 1},
                                        {2.0f / 3, 1, 0, 0, 1}, {-0.5f, 0.5f, 0.5f, 1, 1},
                                        {7.25f, 0, 1, 1, 1},    {5.0f / 6, 1, 1, 0, 1}};
    for (size_t i = 0; i < sizeof expected / sizeof expected[0]; i++) {
        float h, rgb[3];
        float *const planes[3] = {&rgb[0], &rgb[1], &rgb[2]};
        vd_function_evaluate(f, 1, &expected[i][0], &expected[i][1], &h, planes);
        for (int k = 0; k < 3; k++) {
            assert_true(fabsf(rgb[k] - expected[i][2 + k]) < 2e-6f);
        }
    }
    vd_function_destroy(context, &f);
    f = compile(context, "c=mix(rgb(1,0,0), rgb(0,0,1), .25)*2; h=0; rgb = x>0 ? c/2 : -c+1");
    float h, rgb[3];
    const float x = 1, y = 0;
    float *const planes[3] = {&rgb[0], &rgb[1], &rgb[2]};
    vd_function_evaluate(f, 1, &x, &y, &h, planes);
    assert_true(rgb[0] == 0.75f && rgb[1] == 0 && rgb[2] == 0.25f);
    vd_function_destroy(context, &f);
    vd_context_destroy(&context);
}

static void errors_point_at_the_character(void **state) {
    (void)state;
    static const struct {
        const char *text, *contains; /* of the message; "\n" and what follows is the caret's line */
    } cases[] = {
        {"h=60*coz(x)",
         "column 6: unknown name \"coz\"; did you mean cos?\n  h=60*coz(x)\n       ^"},
        {"", "the height is missing"},
        {"a=1", "the height is missing"},
        {"h=", "the text ends where\0"},
        {"h=1+", "the text ends where"},
        {"h=(1+2", "before a \"(\" is closed"},
        {"h=1)", "column 4: this \")\" closes nothing"},
        {"h=2x", "column 4: an operator or \";\" is missing"},
        {"h=x y", "column 5: an operator"},
        {"h=1<2<3", "column 6: comparisons do not chain"},
        {"h=a", "unknown name \"a\""},
        {"h=1;h=2", "column 5: this name is defined already"},
        {"x=1;h=2", "column 1: this name is the language's own"},
        {"h=sin", "write sin(a)"},
        {"h=sin(1,2)", "column 9: one argument too many"},
        {"h=min(1)", "too few arguments: write min(a, b)"},
        {"h=rgb(1,2,3)", "column 3: h is the height"},
        {"h=1;rgb=2", "column 9: rgb is a colour"},
        {"h=sin(rgb(1,2,3))", "column 7: a number is needed"},
        {"h=1;rgb=x?rgb(1,1,1):2", "both sides of ?:"},
        {"h=x?1", "\":\" is missing"},
        {"h==1", "\"=\" is missing"},
        {"h=x=1", "write \"==\""},
        {"h=1 $ 2", "column 5: an operator or"},
        {"h=1e99", "too large"},
        {"h=1\nrgb=2", "line 2, column 1"},
        {"h=é+1", "column 3: a number"},
        {"h=1;\n  é = \t 2", "line 2, column 3"},
        {"h=a(1);", "unknown name \"a\""},
        {"a=1;h=a(1);", "column 8: an operator is missing before this \"(\""},
        {"h=and", "is missing before this"},
        {"h=.", "a number needs a digit"},
        {"7=h", "begins with a name"},
    };
    vd_context *context = test_context(1, VD_ISA_AUTO);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        vd_function *f = NULL;
        const vd_status status = vd_function_compile(context, cases[i].text, &f);
        assert_null(f);
        if (status.code != VD_ERROR_FORMAT || strstr(status.message, cases[i].contains) == NULL) {
            fail_msg("%s gave \"%s\", which lacks \"%s\"", cases[i].text, status.message,
                     cases[i].contains);
        }
    }
    vd_context_destroy(&context);
}

/* Wherever the error is in a long line, excerpt and caret fit the message and the caret is under
 * the bad character. */
static void carets_stand_under_the_character_of_long_lines(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    for (int before = 0; before < 300; before++) {
        char text[1200] = "h=1";
        for (int i = 0; i < before; i++) {
            strcat(text, i % 7 == 0 ? " − 1" : "+1");
        }
        strcat(text, "$");
        for (int i = 0; i < 150; i++) {
            strcat(text, i % 5 == 0 ? " × 1" : "*1");
        }
        vd_function *f = NULL;
        const vd_status status = vd_function_compile(context, text, &f);
        assert_int_equal(status.code, VD_ERROR_FORMAT);
        const char *excerpt = strchr(status.message, '\n') + 1, *caret = strchr(excerpt, '\n') + 1;
        assert_string_equal(strchr(caret, '^'), "^");
        int column = (int)(strchr(caret, '^') - caret);
        const char *p = excerpt;
        for (; column > 0; p++) { /* over `column` characters */
            column -= (p[1] & 0xC0) != 0x80;
        }
        assert_int_equal(*p, '$');
    }
    vd_context_destroy(&context);
}

static void limits_are_errors(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    static char text[VD_FUNCTION_MAX_BYTES + 2];
    vd_function *f = NULL;
    const char *const openers[] = {"(", "-", "not ", "1?", "2^", "abs("};
    for (size_t k = 0; k < sizeof openers / sizeof openers[0]; k++) {
        strcpy(text, "h=");
        for (int i = 0; i < 2000; i++) {
            strcat(text, openers[k]);
        }
        assert_int_equal(vd_function_compile(context, text, &f).code, VD_ERROR_LIMIT);
    }
    memset(text, ' ', VD_FUNCTION_MAX_BYTES + 1);
    memcpy(text, "h=1", 3);
    assert_int_equal(vd_function_compile(context, text, &f).code, VD_ERROR_LIMIT);
    text[VD_FUNCTION_MAX_BYTES] = '\0';
    assert_ok(vd_function_compile(context, text, &f));
    vd_function_destroy(context, &f);
    /* too many operations, too many constants */
    strcpy(text, "h=x");
    for (int i = 0; i < 4200; i++) {
        strcat(text, "-y");
    }
    assert_int_equal(vd_function_compile(context, text, &f).code, VD_ERROR_LIMIT);
    strcpy(text, "h=x");
    for (int i = 0; i < 600; i++) {
        sprintf(text + strlen(text), "*%d", i + 2);
    }
    const vd_status status = vd_function_compile(context, text, &f);
    assert_int_equal(status.code, VD_ERROR_LIMIT);
    assert_non_null(strstr(status.message, "constants"));
    assert_int_equal(vd_function_compile(context, NULL, &f).code, VD_ERROR_ARGUMENT);
    assert_int_equal(vd_function_compile(NULL, "h=1", &f).code, VD_ERROR_ARGUMENT);
    assert_null(f);
    vd_context_destroy(&context);
}

static void folding_and_sharing_shorten_programs(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_function *f = compile(context, "h = 2*pi/3 + sin(1)*exp(2)^3.5");
    assert_int_equal(f->step_count, 0);
    vd_function_destroy(context, &f);
    f = compile(context, "a = x*y; unused = sin(a); h = x*y + a; rgb = rgb(a, h, 1)");
    assert_int_equal(f->step_count, 2);
    assert_int_equal(f->height_steps, 2);
    vd_function_destroy(context, &f);
    f = compile(context, "h = 1 > 0 ? x : sin(y)");
    assert_int_equal(f->step_count, 0);
    vd_function_destroy(context, &f);
    vd_context_destroy(&context);
}

/* ---- random texts -----------------------------------------------------------------------------
 */

static void random_number_text(uint64_t *random, int depth, char *out) {
    static const char *const leaves[] = {"x", "y",   "1",  "0.5", "-2",  "3",    "x/7",
                                         "0", "100", "pi", "1e9", "0.3", "1e-9", "y*0.1"};
    static const char *const unary[] = {"-(%s)",   "abs(%s)", "floor(%s)", "sqrt(%s)", "sin(%s)",
                                        "cos(%s)", "tan(%s)", "exp(%s)",   "log(%s)",  "not (%s)",
                                        "(%s)^2",  "(%s)^3",  "(%s)^-1"};
    static const char *const binary[] = {
        "(%s)+(%s)",    "(%s)-(%s)",    "(%s)*(%s)",      "(%s)/(%s)",    "(%s)^(%s)",
        "min(%s,%s)",   "max(%s,%s)",   "mod(%s,%s)",     "atan2(%s,%s)", "noise(%s,%s)",
        "(%s)<(%s)",    "(%s)<=(%s)",   "(%s)==(%s)",     "(%s)!=(%s)",   "(%s) and (%s)",
        "(%s) or (%s)", "fbm(%s,%s,4)", "ridged(%s,%s,3)"};
    static const char *const ternary[] = {"(%s)?(%s):(%s)", "mix(%s,%s,%s)", "clamp(%s,%s,%s)",
                                          "fbm(%s,%s,%s)", "ridged(%s,%s,%s)"};
    const uint64_t r = test_random(random);
    if (depth == 0 || r % 8 == 0) {
        strcpy(out, leaves[(r >> 8) % 14]);
        return;
    }
    char a[400], b[400], c[400];
    random_number_text(random, depth - 1, a);
    random_number_text(random, depth - 1, b);
    random_number_text(random, depth - 1, c);
    const char *form = r % 8 < 3   ? unary[(r >> 8) % 13]
                       : r % 8 < 7 ? binary[(r >> 8) % 18]
                                   : ternary[(r >> 8) % 5];
    char made[1400];
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
    snprintf(made, sizeof made, form, a, b, c);
#pragma GCC diagnostic pop
    strcpy(out, strlen(made) < 400 ? made : "x+y");
}

static float random_float(uint64_t *random) {
    static const float extremes[] = {0.0f,  -0.0f,  1.0f,     -1.0f,     1e-40f, 3e38f, -3e38f,
                                     1e10f, -1e10f, INFINITY, -INFINITY, NAN,    0.5f,  1e5f};
    const uint64_t r = test_random(random);
    if (r % 5 == 0) {
        return extremes[(r >> 8) % 14];
    }
    return (float)((test_uniform(random) - 0.5) * (r % 5 == 1 ? 1e6 : r % 5 == 2 ? 4 : 500));
}

static void every_level_equals_the_reference(void **state) {
    (void)state;
    uint64_t random = 5;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    for (int round = 0; round < rounds(4000); round++) {
        char parts[4][400], text[1800];
        for (int i = 0; i < 4; i++) {
            random_number_text(&random, 1 + round % 5, parts[i]);
        }
        snprintf(text, sizeof text, "h=%s; rgb=%s(%s,%s,%s)", parts[0], round % 2 ? "rgb" : "hsv",
                 parts[1], parts[2], parts[3]);
        vd_function *f = compile(context, text);
        const size_t count = test_random(&random) % 70, shift = test_random(&random) % 4;
        float in[2][80], expected[4][80], got[4][80];
        for (int i = 0; i < 80; i++) {
            in[0][i] = random_float(&random);
            in[1][i] = random_float(&random);
        }
        const bool with_color = round % 3 != 0;
        memset(expected, 0x5A, sizeof expected);
        float *const expected_rgb[3] = {expected[1] + shift, expected[2] + shift,
                                        expected[3] + shift};
        vd_function_kernels_reference.evaluate(f, count, in[0] + shift, in[1] + shift,
                                               expected[0] + shift,
                                               with_color ? expected_rgb : NULL);
        for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
            memset(got, 0x5A, sizeof got);
            float *const rgb[3] = {got[1] + shift, got[2] + shift, got[3] + shift};
            f->isa = (uint32_t)isa;
            vd_function_evaluate(f, count, in[0] + shift, in[1] + shift, got[0] + shift,
                                 with_color ? rgb : NULL);
            if (memcmp(got, expected, sizeof got) != 0) {
                fail_msg("%s differs at level %s", text, vd_isa_name((vd_isa)isa));
            }
        }
        vd_function_destroy(context, &f);
    }
    vd_context_destroy(&context);
}

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

/* ---- callbacks, heightfields, memory ----------------------------------------------------------
 */

static void bowl(void *user, const float x[16], const float y[16], float h[16], float red[16],
                 float green[16], float blue[16]) {
    for (int i = 0; i < 16; i++) {
        h[i] = x[i] < -100 ? NAN : x[i] * x[i] + y[i] * y[i] + *(const float *)user;
        if (red != NULL) {
            red[i] = x[i];
            green[i] = 2.0f;
            blue[i] = NAN;
        }
    }
}

static void bowl_bounds(void *user, float x0, float x1, float y0, float y1, float *min,
                        float *max) {
    (void)x0, (void)x1, (void)y0, (void)y1;
    *min = *(const float *)user;
    *max = INFINITY;
}

static void callbacks_fill_batches(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    float base = 7;
    vd_function_callback_def def = {bowl, bowl_bounds, &base, true};
    vd_function *f = NULL;
    assert_ok(vd_function_from_callback(context, &def, &f));
    float x[37], y[37], h[38], rgb[3][37];
    for (int i = 0; i < 37; i++) {
        x[i] = (float)i / 36;
        y[i] = 2;
    }
    x[20] = -200;
    h[37] = 99;
    float *const planes[3] = {rgb[0], rgb[1], rgb[2]};
    vd_function_evaluate(f, 37, x, y, h, planes);
    for (int i = 0; i < 37; i++) {
        assert_true(h[i] == (i == 20 ? -INFINITY : x[i] * x[i] + 4 + 7));
        assert_true(rgb[0][i] == (i == 20 ? 0 : x[i]) && rgb[1][i] == 1 && rgb[2][i] == 0);
    }
    assert_true(h[37] == 99);
    float lo, hi;
    vd_function_bounds(f, 0, 1, 0, 1, &lo, &hi);
    assert_true(lo == 7 && hi == INFINITY);
    vd_function_destroy(context, &f);
    def.evaluate = NULL;
    assert_int_equal(vd_function_from_callback(context, &def, &f).code, VD_ERROR_ARGUMENT);
    vd_context_destroy(&context);
}

static void heightfields_are_the_same_everywhere(void **state) {
    (void)state;
    const vd_function_grid grid = {-1234.5, 987.25, 2.5, 333, 57};
    uint64_t first = 0;
    for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
        const int threads[] = {1, 2, 7};
        for (int t = 0; t < 3; t++) {
            vd_context *context = test_context(threads[t], (vd_isa)isa);
            vd_function *f = compile(
                context, "h=100*fbm(x/90,y/90,7)+20*sin(x/50); rgb=hsv(h/200, .7, .5+h/300)");
            vd_heightfield *map = NULL;
            assert_ok(vd_function_heightfield(context, NULL, f, &grid, &map));
            assert_ok(vd_heightfield_validate(map, map->size_bytes));
            assert_int_equal(map->color_width, 333);
            first = first == 0 ? map->checksum : first;
            assert_true(map->checksum == first);
            const float x = (float)(-1234.5 + 300 * 2.5), y = (float)(987.25 - 41 * 2.5);
            float h;
            vd_function_evaluate(f, 1, &x, &y, &h, NULL);
            assert_true(vd_heightfield_at(map, 300, 41) == h);
            assert_true(fabs(vd_heightfield_height_at(map, (double)x, (double)y) - (double)h) <
                        1e-4);
            vd_heightfield_destroy(context, &map);
            vd_function_destroy(context, &f);
            vd_context_destroy(&context);
        }
    }
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_function *f = compile(context, "h=x");
    vd_heightfield *map = NULL;
    const vd_function_grid wrong[] = {
        {0, 0, 0, 1, 1},   {0, 0, NAN, 1, 1},      {0, 0, 1, 0, 1},
        {NAN, 0, 1, 1, 1}, {0, INFINITY, 1, 1, 1}, {0, 0, 1, 2000000000, 2000000000},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        assert_int_not_equal(vd_function_heightfield(context, NULL, f, &wrong[i], &map).code,
                             VD_OK);
        assert_null(map);
    }
    vd_function_destroy(context, &f);
    vd_context_destroy(&context);
}

static void memory_may_end_anywhere(void **state) {
    (void)state;
    const vd_function_grid grid = {0, 0, 1, 20, 10};
    for (int fail_at = 2;; fail_at++) {
        test_allocator allocator = {0, 0, 0};
        vd_context *context = test_failing_context(&allocator);
        const int before = allocator.live;
        allocator.calls = 1;
        allocator.fail_at = fail_at;
        vd_function *f = NULL;
        vd_heightfield *map = NULL;
        vd_status status = vd_function_compile(context, "h=sin(x);rgb=hsv(h,1,1)", &f);
        if (status.code == VD_OK) {
            status = vd_function_heightfield(context, NULL, f, &grid, &map);
        }
        const bool done = status.code == VD_OK;
        if (!done) {
            assert_int_equal(status.code, VD_ERROR_MEMORY);
            assert_null(map);
        }
        vd_heightfield_destroy(context, &map);
        vd_function_destroy(context, &f);
        assert_int_equal(allocator.live, before);
        vd_context_destroy(&context);
        if (done) {
            assert_true(fail_at > 5);
            break;
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(expressions_mean_what_they_say),
        cmocka_unit_test(undefined_heights_are_holes),
        cmocka_unit_test(colors_follow_hsv),
        cmocka_unit_test(errors_point_at_the_character),
        cmocka_unit_test(carets_stand_under_the_character_of_long_lines),
        cmocka_unit_test(limits_are_errors),
        cmocka_unit_test(folding_and_sharing_shorten_programs),
        cmocka_unit_test(every_level_equals_the_reference),
        cmocka_unit_test(functions_are_as_exact_as_documented),
        cmocka_unit_test(far_angles_stay_in_range),
        cmocka_unit_test(noise_is_smooth_and_within_its_range),
        cmocka_unit_test(the_noise_is_what_it_was),
        cmocka_unit_test(bounds_enclose_every_sample),
        cmocka_unit_test(bounds_are_tight_where_they_can_be),
        cmocka_unit_test(callbacks_fill_batches),
        cmocka_unit_test(heightfields_are_the_same_everywhere),
        cmocka_unit_test(memory_may_end_anywhere),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
