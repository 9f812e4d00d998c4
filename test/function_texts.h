/* function_texts.h: what the tests of formulas share: compiling, and random texts. */
#ifndef VEDUTA_TEST_FUNCTION_TEXTS_H
#define VEDUTA_TEST_FUNCTION_TEXTS_H

#include <stdio.h>
#include "support.h"
#include <veduta/function.h>

static inline int rounds(int full) {
    return test_is_reduced() ? (full + 9) / 10 : full;
}

static inline vd_function *compile(vd_context *context, const char *text) {
    vd_function *f = NULL;
    const vd_status status = vd_function_compile(context, text, &f);
    if (status.code != VD_OK) {
        fail_msg("%s\n%s", text, status.message);
    }
    return f;
}

/* Writes a random expression of numbers, at most 399 bytes. */
static inline void random_number_text(uint64_t *random, int depth, char *out) {
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

#endif
