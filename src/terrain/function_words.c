/* function_words.c: the table of the formula language's own names. */
#include <string.h>
#include "terrain/function_words.h"

#define OPERATION VD_WORD_OPERATION

static const vd_function_word words[] = {
    {"x", "x", VD_WORD_X, 0, 0, false},
    {"y", "y", VD_WORD_Y, 0, 0, false},
    {"pi", "pi", VD_WORD_PI, 0, 0, false},
    {"and", "a and b", VD_WORD_LOGIC, 0, 0, false},
    {"or", "a or b", VD_WORD_LOGIC, 0, 0, false},
    {"not", "not a", VD_WORD_LOGIC, 0, 0, false},
    {"min", "min(a, b)", OPERATION, VD_OP_MIN, 2, true},
    {"max", "max(a, b)", OPERATION, VD_OP_MAX, 2, true},
    {"abs", "abs(a)", OPERATION, VD_OP_ABS, 1, true},
    {"floor", "floor(a)", OPERATION, VD_OP_FLOOR, 1, false},
    {"mod", "mod(a, b)", OPERATION, VD_OP_MOD, 2, false},
    {"sqrt", "sqrt(a)", OPERATION, VD_OP_SQRT, 1, false},
    {"sin", "sin(a)", OPERATION, VD_OP_SIN, 1, false},
    {"cos", "cos(a)", OPERATION, VD_OP_COS, 1, false},
    {"tan", "tan(a)", OPERATION, VD_OP_TAN, 1, false},
    {"atan2", "atan2(y, x)", OPERATION, VD_OP_ATAN2, 2, false},
    {"exp", "exp(a)", OPERATION, VD_OP_EXP, 1, false},
    {"log", "log(a)", OPERATION, VD_OP_LOG, 1, false},
    {"noise", "noise(x, y)", OPERATION, VD_OP_NOISE, 2, false},
    {"fbm", "fbm(x, y, octaves)", OPERATION, VD_OP_FBM, 3, false},
    {"ridged", "ridged(x, y, octaves)", OPERATION, VD_OP_RIDGED, 3, false},
    {"hsv", "hsv(hue, saturation, value)", VD_WORD_HSV, 0, 3, false},
    {"rgb", "rgb(red, green, blue)", VD_WORD_RGB, 0, 3, false},
    {"mix", "mix(a, b, t)", VD_WORD_MIX, 0, 3, true},
    {"clamp", "clamp(a, low, high)", VD_WORD_CLAMP, 0, 3, true},
};

#define WORD_COUNT (sizeof words / sizeof words[0])

const vd_function_word *vd_function_word_find(const char *name, size_t bytes) {
    for (size_t i = 0; i < WORD_COUNT; i++) {
        if (strlen(words[i].name) == bytes && memcmp(words[i].name, name, bytes) == 0) {
            return &words[i];
        }
    }
    return NULL;
}

/* Insertions, deletions, replacements and exchanges of neighbours between two names of at most 15
 * letters (Damerau 1964, restricted form), upper case taken as lower. */
static int distance(const char *a, size_t a_bytes, const char *b, size_t b_bytes) {
    int d[17][17];
    for (size_t i = 0; i <= a_bytes; i++) {
        for (size_t j = 0; j <= b_bytes; j++) {
            if (i == 0 || j == 0) {
                d[i][j] = (int)(i + j);
                continue;
            }
            const bool same = (a[i - 1] | 0x20) == (b[j - 1] | 0x20);
            int best = d[i - 1][j - 1] + !same;
            best = d[i - 1][j] + 1 < best ? d[i - 1][j] + 1 : best;
            best = d[i][j - 1] + 1 < best ? d[i][j - 1] + 1 : best;
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] &&
                d[i - 2][j - 2] + 1 < best) {
                best = d[i - 2][j - 2] + 1;
            }
            d[i][j] = best;
        }
    }
    return d[a_bytes][b_bytes];
}

const char *vd_function_word_near(const char *name, size_t bytes) {
    /* One mistake in a short word, two in one of five letters or more. */
    int best = bytes >= 5 ? 3 : 2;
    const char *near = NULL;
    for (size_t i = 0; bytes >= 2 && bytes <= 15 && i < WORD_COUNT; i++) {
        const size_t n = strlen(words[i].name);
        const int d = n >= 2 ? distance(name, bytes, words[i].name, n) : best;
        if (d < best) {
            best = d;
            near = words[i].name;
        }
    }
    return near;
}
