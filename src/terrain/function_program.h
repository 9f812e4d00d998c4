/* function_program.h: what a formula is compiled to, and who makes and runs it.
 *
 *     text ──parse──► nodes ──fold, share──► registers ──► vd_function ──► kernels
 *                     (function_build.c)                   (one block)     bounds
 *
 * A program is a list of three-operand instructions on registers of 32 floats. Register 0 is x, 1
 * is y, then come the constants, loaded once a call, then the temporaries. Nothing branches: both
 * sides of ?: are computed and one is selected, as lanes may differ.
 *
 *     ┌────────────┐ 0
 *     │ vd_function│
 *     ├────────────┤ constants_offset
 *     │ constants  │ float [constant_count], for registers 2 …
 *     ├────────────┤ steps_offset
 *     │ steps      │ the first `height_steps` give h; the rest is for colours only
 *     └────────────┘ size_bytes
 */
#ifndef VEDUTA_TERRAIN_FUNCTION_PROGRAM_H
#define VEDUTA_TERRAIN_FUNCTION_PROGRAM_H

#include <veduta/function.h>

#define VD_FUNCTION_MAX_REGISTERS 256 /* 128 bytes each, on the stack of who evaluates */

typedef enum vd_function_op {
    VD_OP_ADD = 0, /* a + b */
    VD_OP_SUBTRACT,
    VD_OP_MULTIPLY,
    VD_OP_DIVIDE,
    VD_OP_NEGATE,
    VD_OP_MIN, /* a < b ? a : b */
    VD_OP_MAX, /* a > b ? a : b */
    VD_OP_ABS,
    VD_OP_FLOOR,
    VD_OP_MOD, /* a − b·floor(a / b) */
    VD_OP_SQRT,
    VD_OP_SIN,
    VD_OP_COS,
    VD_OP_TAN,
    VD_OP_ATAN2, /* a is y, b is x */
    VD_OP_EXP,
    VD_OP_LOG,
    VD_OP_POW,
    VD_OP_NOISE,
    VD_OP_FBM, /* c octaves */
    VD_OP_RIDGED,
    VD_OP_LESS, /* 1 or 0, as all that follow up to NOT */
    VD_OP_LESS_EQUAL,
    VD_OP_EQUAL,
    VD_OP_NOT_EQUAL,
    VD_OP_AND, /* a != 0 and b != 0 */
    VD_OP_OR,
    VD_OP_NOT,    /* a == 0 */
    VD_OP_SELECT, /* a != 0 ? b : c */
    VD_OP_COUNT
} vd_function_op;

typedef struct vd_function_step {
    uint16_t op, to, a, b, c; /* registers; operands that the op lacks are 0 */
} vd_function_step;

struct vd_function {
    uint32_t size_bytes;
    uint32_t isa; /* vd_isa of the context it was compiled in: which kernels evaluate it */
    uint32_t has_color;
    uint32_t constant_count, register_count;
    uint32_t step_count, height_steps;
    uint32_t constants_offset, steps_offset;
    uint16_t result[4]; /* registers of h, red, green, blue */
    /* Only of functions made of C code, which live in one process. */
    vd_function_callback *callback;
    vd_function_bounds_callback *bounds_callback;
    void *user;
};

static inline const float *vd_function_constants(const vd_function *f) {
    return (const float *)(const void *)((const uint8_t *)f + f->constants_offset);
}

static inline const vd_function_step *vd_function_steps(const vd_function *f) {
    return (const vd_function_step *)(const void *)((const uint8_t *)f + f->steps_offset);
}

/* ---- building (function_build.c) ---- */

#define VD_FUNCTION_HASH 16384 /* places of the table that finds equal nodes: a power of two */

typedef struct vd_function_node {
    float value; /* of a constant */
    uint16_t op; /* vd_function_op, or one of the two below */
    uint16_t a, b, c;
} vd_function_node;

#define VD_NODE_CONSTANT 1000
#define VD_NODE_INPUT 1001 /* a is 0 for x, 1 for y */

typedef struct vd_function_builder {
    vd_function_node nodes[VD_FUNCTION_MAX_STEPS]; /* operands come before their users */
    uint16_t hash[VD_FUNCTION_HASH];               /* node + 1, or 0 */
    int node_count;
    bool full;
} vd_function_builder;

/* Empties a builder; node 0 is x and node 1 is y. */
void vd_function_builder_init(vd_function_builder *b);

/* Return the node, an old one where an equal one exists and a constant where all operands are. When
 * the builder is full they return 0 and set `full`. */
int vd_function_constant(vd_function_builder *b, float value);
int vd_function_node_make(vd_function_builder *b, vd_function_op op, int a, int b_, int c);

/* a^b: by multiplications when b is a constant whole number of at most 64 in size, else VD_OP_POW.
 */
int vd_function_power(vd_function_builder *b, int base, int exponent);

/* The three components of hue (turns, wraps), saturation, value (Smith 1978). */
void vd_function_hsv(vd_function_builder *b, int hue, int saturation, int value, int out[3]);

/* Turns the nodes that h and the colour (null: none) need into a function.
 * Returns VD_ERROR_LIMIT or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_function_emit(vd_context *context, const vd_function_builder *b, int h,
                                       const int *rgb, vd_function **out);

/* ---- parsing (function_parse.c) ---- */

/* Parses into an empty builder; *has_color tells whether rgb was given. */
VD_MUST_USE vd_status vd_function_parse(const char *text, size_t size_bytes,
                                        vd_function_builder *builder, int *h, int rgb[3],
                                        bool *has_color);

/* ---- errors (function_error.c) ---- */

/* The failure `sentence` at byte `at` of the text, with the excerpt and the caret. */
vd_status vd_function_error(vd_code code, const char *text, size_t size_bytes, size_t at,
                            const char *sentence);

#endif
