/* Formulas: what they mean, how they fail, and that every evaluator agrees. */
#include <math.h>
#include <stdio.h>
#include "function_texts.h"
#include "terrain/function_kernels.h"

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
        cmocka_unit_test(callbacks_fill_batches),
        cmocka_unit_test(heightfields_are_the_same_everywhere),
        cmocka_unit_test(memory_may_end_anywhere),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
