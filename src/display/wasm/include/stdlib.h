/* stdlib.h: what the freestanding build needs of it (src/world/wasm/core_wasm.c). */
#ifndef VEDUTA_WASM_STDLIB_H
#define VEDUTA_WASM_STDLIB_H
#include <stddef.h>
void *malloc(size_t bytes); /* nothing that is exported asks for these two */
void free(void *memory);
void qsort(void *items, size_t count, size_t size,
           int (*compare)(const void *left, const void *right));
#endif
