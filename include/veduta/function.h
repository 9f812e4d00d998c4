/* function.h: terrain from a formula.
 *
 * The thesis renders cos(x)·sin(y) by passing a function where the maps were (FutSpace 2020, §6.1).
 * Here the function is text, compiled once and evaluated 16 points at a time:
 *
 *     h = 60*cos(x/40)*sin(y/40); rgb = hsv(h/120, 0.6, 1)
 *
 * A text is a list of statements `name = expression` separated by `;`. `h`, the height, is required
 * and a number; `rgb` is optional and a colour, three sRGB-encoded components 0 … 1; other names
 * are the writer's own and may be used after they are defined. docs/function-terrain.md is the
 * language.
 *
 * All arithmetic is in `float`; the same text gives the same bytes on every machine and at every
 * SIMD level. A height that is not finite (a division by zero, the root of a negative number) is a
 * hole, −infinity, as in a heightfield; a colour component that is NaN is 0, others are clamped to
 * 0 … 1. A compiled function is immutable: any number of threads may evaluate it at once.
 */
#ifndef VEDUTA_FUNCTION_H
#define VEDUTA_FUNCTION_H

#include <stdbool.h>
#include <veduta/heightfield.h>
#include <veduta/job.h>

VD_BEGIN_DECLARATIONS

/* Points a batch. Longer arrays are cut into batches, so any count may be evaluated. */
#define VD_FUNCTION_LANES 16

#define VD_FUNCTION_MAX_BYTES 16384 /* of text */
#define VD_FUNCTION_MAX_DEPTH 100   /* of nesting */
#define VD_FUNCTION_MAX_STEPS 4096  /* of the compiled program */
#define VD_FUNCTION_MAX_OCTAVES 16  /* of fbm and ridged; more are taken as 16, less than 1 as 1 */

typedef struct vd_function vd_function;

/* Compiles a text (NUL-terminated UTF-8; × ÷ − π are accepted besides * / - pi). On success *out is
 * owned by the caller: one block of memory without pointers inside. On failure *out is untouched.
 * Returns VD_ERROR_ARGUMENT (a null argument), VD_ERROR_FORMAT (the text is wrong), VD_ERROR_LIMIT
 * (longer, deeper or bigger than the limits above) or VD_ERROR_MEMORY. For a wrong text the message
 * is one sentence with the position, then a line with the text around it, then a line with a caret
 * under the bad character. Cost: some microseconds a line of text. */
VD_API VD_MUST_USE vd_status vd_function_compile(vd_context *context, const char *text,
                                                 vd_function **out);

/* Fills h[0 … 15], and red, green, blue [0 … 15] when they are not null, for 16 points. Called from
 * several threads at once. Heights that are not finite become holes, as above. */
typedef void vd_function_callback(void *user, const float x[VD_FUNCTION_LANES],
                                  const float y[VD_FUNCTION_LANES], float h[VD_FUNCTION_LANES],
                                  float red[VD_FUNCTION_LANES], float green[VD_FUNCTION_LANES],
                                  float blue[VD_FUNCTION_LANES]);

/* Gives min <= every finite height <= max over the closed rectangle [x0, x1] × [y0, y1]. */
typedef void vd_function_bounds_callback(void *user, float x0, float x1, float y0, float y1,
                                         float *min, float *max);

typedef struct vd_function_callback_def {
    vd_function_callback *evaluate;      /* required */
    vd_function_bounds_callback *bounds; /* null: nothing is known, −infinity … infinity */
    void *user;                          /* not owned; must outlive the function */
    bool has_color;                      /* false: red, green and blue are always null */
} vd_function_callback_def;

/* Makes a function of C code. Such a function is the same on every machine only if its callback
 * is. Returns VD_ERROR_ARGUMENT (a null argument, no `evaluate`) or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_function_from_callback(vd_context *context,
                                                       const vd_function_callback_def *def,
                                                       vd_function **out);

/* Frees a function and sets *function to null. Null is accepted. */
VD_API void vd_function_destroy(vd_context *context, vd_function **function);

/* True when the function gives colours. */
VD_API bool vd_function_has_color(const vd_function *function);

/* Evaluates `count` points: reads x[count] and y[count], writes h[count], and, when `rgb` is not
 * null, rgb[0 … 2][count] (1, 1, 1 when the function gives no colours). Any alignment; outputs must
 * not overlap inputs or each other. Evaluating heights alone skips what only colours need.
 * Best in calls of 32 points or more. Cost on one processor with AVX-512: about 0.2 ns a step and
 * point, 1.3 ns an octave of noise, 5 ns a power; no allocation, at most 40 KiB of stack. */
VD_API void vd_function_evaluate(const vd_function *function, size_t count, const float *x,
                                 const float *y, float *h, float *const rgb[3]);

/* Encloses the height over the closed rectangle [x0, x1] × [y0, y1]: every height that
 * vd_function_evaluate gives there for float x and y lies in [*min, *max] or is a hole. By interval
 * arithmetic (Moore 1966) on the compiled program, rounded outwards. The result is exact for a
 * single use of each variable and loose where a variable occurs several times (x − x), around a
 * division by an interval with zero (−infinity … infinity) and for noise over more than a cell
 * (then its whole range); it tightens as the rectangle shrinks. NaN or reversed bounds give
 * −infinity … infinity. Cost: about 20 ns a step of the program, 40 ns an octave. */
VD_API void vd_function_bounds(const vd_function *function, float x0, float x1, float y0, float y1,
                               float *min, float *max);

/* A grid of samples: column c, row r lies at x = x0 + c·cell, y = y0 − r·cell (row 0 north). */
typedef struct vd_function_grid {
    double x0, y0; /* of sample (0, 0), the north-west one */
    double cell;   /* distance of neighbouring samples, > 0 */
    int width, height;
} vd_function_grid;

/* Samples the function into a heightfield (VD_HEIGHT_F32, does not wrap, world coordinates as in
 * the grid), with an 8-bit colour a sample if the function gives colours. In parallel over rows;
 * `job` may be null. *out is owned by the caller (vd_heightfield_destroy); on failure it is
 * untouched. Returns VD_ERROR_ARGUMENT (names the field), VD_ERROR_LIMIT, VD_ERROR_MEMORY or
 * VD_ERROR_CANCELLED. */
VD_API VD_MUST_USE vd_status vd_function_heightfield(vd_context *context, vd_job *job,
                                                     const vd_function *function,
                                                     const vd_function_grid *grid,
                                                     vd_heightfield **out);

VD_END_DECLARATIONS

#endif
