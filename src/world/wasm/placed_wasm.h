/* placed_wasm.h: what the files that draw models in WebAssembly share. */
#ifndef VEDUTA_WORLD_WASM_PLACED_WASM_H
#define VEDUTA_WORLD_WASM_PLACED_WASM_H

#include <veduta/placed.h>
#include "display/wasm/display_wasm.h"

/* The context, made with an arena of so many bytes; null when there is no memory. */
vd_context *vd_wasm_context(size_t bytes);

#endif
