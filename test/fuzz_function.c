/* Any text: compiles or fails with a message; what compiles evaluates, and within its bounds. */
#include <assert.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include "terrain/function_kernels.h"
#include <veduta/function.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static vd_context *context;

static void check_function(vd_function *f) {
    static const float x[20] = {0,   -0.0f, 1,    -1,   0.5f,  1e9f, -1e9f, 1e-40f, 3e38f, INFINITY,
                                NAN, 100,   -100, 7.5f, -2.5f, 3,    4,     5,      6,     7};
    static const float y[20] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, -1, -2, -3, 0, 0, 0};
    float expected[4][20], got[4][20];
    float *const expected_rgb[3] = {expected[1], expected[2], expected[3]};
    float *const rgb[3] = {got[1], got[2], got[3]};
    vd_function_kernels_reference.evaluate(f, 20, x, y, expected[0], expected_rgb);
    vd_function_evaluate(f, 20, x, y, got[0], rgb);
    assert(memcmp(got, expected, sizeof got) == 0);
    float min, max;
    vd_function_bounds(f, -2.5f, 7.5f, -3.0f, 14.0f, &min, &max);
    for (int i = 0; i < 20; i++) {
        if (x[i] >= -2.5f && x[i] <= 7.5f && y[i] <= 14.0f && got[0][i] != -INFINITY) {
            assert(got[0][i] >= min && got[0][i] <= max);
        }
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (context == NULL) {
        vd_context_def def = vd_context_def_default();
        def.threads = 1;
        if (vd_context_create(&def, &context).code != VD_OK) {
            abort();
        }
    }
    char *text = malloc(size + 1);
    if (text == NULL) {
        return 0;
    }
    memcpy(text, data, size);
    text[size] = '\0';
    vd_function *f = NULL;
    const vd_status status = vd_function_compile(context, text, &f);
    assert((status.code == VD_OK) == (f != NULL) && strlen(status.message) < VD_MESSAGE_BYTES);
    if (f != NULL) {
        check_function(f);
        vd_function_destroy(context, &f);
    } else {
        assert(status.message[0] != '\0');
    }
    free(text);
    return 0;
}
