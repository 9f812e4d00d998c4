/* display_wasm.h: what the parts of the WebAssembly build share. */
#ifndef VEDUTA_DISPLAY_WASM_H
#define VEDUTA_DISPLAY_WASM_H

#include <veduta/camera.h>
#include "display/display_rows.h"

#define VD_EXPORT(name) __attribute__((export_name(#name), used)) name

/* Memory, as display_wasm.c says. */
uintptr_t vd_wasm_mark(void);
void vd_wasm_return(uintptr_t mark);
uintptr_t vd_wasm_take(size_t bytes);

/* Draws the quads that are sound, farthest first, over the window. Returns how many were left out,
 * or −1 when there is no memory. */
int vd_wasm_draw_quads(const vd_display_window *window, const vd_quad *quads, int count,
                       float near_m, bool draw_hidden);

/* Numbers of an order from here on are those of instances of models, and from there of bricks,
 * which src/world/wasm draws. */
#define VD_WASM_INSTANCES 0x80000000u
#define VD_WASM_BRICKS 0xC0000000u

/* Draws the `run`th run of these in an order over the window; returns how many were drawn. */
int vd_wasm_placed_draw(int run, const uint32_t *order, int count, const vd_camera *camera,
                        const vd_display_window *window);

/* Whether the runs since the first one asked for more than any sound server does. */
bool vd_wasm_placed_is_absurd(int width, int height);

#endif
