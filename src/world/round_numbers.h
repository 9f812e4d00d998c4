/* round_numbers.h: numbers that people like to read off a scale. */
#ifndef VEDUTA_WORLD_ROUND_NUMBERS_H
#define VEDUTA_WORLD_ROUND_NUMBERS_H

#include <stdbool.h>
#include <stddef.h>

/* The greatest of 1, 2, 5 × 10ⁿ that is not above `most` (1e-6 … 1e15); *parts becomes into how
 * many parts a bar of this length is divided: 4 or 5. */
double vd_round_length(double most, int *parts);

#define VD_ROUND_LABELS 6

/* Finds 4 … 6 multiples of a round step within [min, max]: 1, 2, 5 × 10ⁿ where that gives so many,
 * else 2.5, 4, 3, 1.5 or 7.5. Returns how many, 0 for a range that is empty, not finite, or too
 * narrow or far out for a scale. */
int vd_round_labels(double min, double max, double out[VD_ROUND_LABELS], double *step);

/* Writes a multiple of `step` with as many decimals as the step has, at most 6; a real minus sign,
 * a point whatever the locale. |value| < 1e12. */
void vd_round_text(double value, double step, char *out, size_t out_bytes);

#endif
