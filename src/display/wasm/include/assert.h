/* assert.h: the freestanding build has nobody to tell. */
#ifndef VEDUTA_WASM_ASSERT_H
#define VEDUTA_WASM_ASSERT_H
#define assert(condition) ((void)0)
#endif
