/* placed_wasm.h: models that the page draws itself, for the scene. */
#ifndef VEDUTA_WORLD_WASM_PLACED_WASM_H
#define VEDUTA_WORLD_WASM_PLACED_WASM_H

#include <veduta/placed.h>

/* Memory at a multiple of 64 bytes, as display_wasm.c has it; 0 when there is none. */
uintptr_t vd_wasm_take(size_t bytes);

/* The context, made with an arena of so many bytes; null when there is no memory. */
vd_context *vd_wasm_context(size_t bytes);

/* Numbers of the order from here on are those of instances. */
#define VD_WASM_INSTANCES 0x80000000u

/* Draws instances by the numbers of an order over the window; returns how many were drawn. */
int vd_wasm_placed_draw(const uint32_t *order, int count, const vd_camera *camera,
                        const vd_placed_window *window);

#endif
