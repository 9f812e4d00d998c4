/* math.h: what the freestanding build needs of it; each is one instruction. */
#ifndef VEDUTA_WASM_MATH_H
#define VEDUTA_WASM_MATH_H
#define floorf __builtin_floorf
#define sqrtf __builtin_sqrtf
#endif
