/* math.h: what the freestanding build needs of it; each is one instruction. */
#ifndef VEDUTA_WASM_MATH_H
#define VEDUTA_WASM_MATH_H
#define floorf __builtin_floorf
#define floor __builtin_floor
#define sqrtf __builtin_sqrtf
#define sqrt __builtin_sqrt
#define fabsf __builtin_fabsf
#define fabs __builtin_fabs
#define isfinite __builtin_isfinite
#define isnan __builtin_isnan
double ldexp(double value, int power);
#define INFINITY (__builtin_inff())
#define NAN (__builtin_nanf(""))
#endif
