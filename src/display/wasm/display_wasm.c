/* The display in WebAssembly: what script/build-wasm exports, and the memory that it hands out.
 *
 * The page takes memory once for what it keeps (vd_wasm_take, in order; vd_wasm_mark and
 * vd_wasm_return give back all that was taken since), writes pictures and quads there, and draws:
 * a quad is WORDS 32-bit words: x, y, w of four corners (floats), then the picture's address,
 * width, height, stride, its opaque rectangle, and the opacity. Sizes come from the page's own
 * code, but numbers may come from a server: every quad is checked, one that is not sound is left
 * out.
 */
#include <string.h>
#include "display/wasm/display_wasm.h"

#define PAGE 65536u
#define WORDS 21

extern unsigned char __heap_base; /* set by the linker */

static uintptr_t taken;

/* Or the compiler would see these loops for what they are, and call them. */
#define NO_BUILTIN(name) __attribute__((no_builtin(name)))

NO_BUILTIN("memcpy") void *memcpy(void *restrict to, const void *restrict from, size_t count) {
    unsigned char *t = to;
    const unsigned char *f = from;
    for (size_t i = 0; i < count; i++) {
        t[i] = f[i];
    }
    return to;
}

NO_BUILTIN("memset") void *memset(void *to, int value, size_t count) {
    unsigned char *t = to;
    for (size_t i = 0; i < count; i++) {
        t[i] = (unsigned char)value;
    }
    return to;
}

/* Where the memory taken so far ends. */
uintptr_t VD_EXPORT(vd_wasm_mark)(void) {
    if (taken == 0) {
        taken = ((uintptr_t)&__heap_base + 63) & ~(uintptr_t)63;
    }
    return taken;
}

/* Gives back all that was taken since the mark. */
void VD_EXPORT(vd_wasm_return)(uintptr_t mark) {
    taken = mark;
}

/* Takes memory at a multiple of 64 bytes; 0 when there is none. */
uintptr_t VD_EXPORT(vd_wasm_take)(size_t bytes) {
    const uintptr_t at = vd_wasm_mark();
    const uint64_t end = ((uint64_t)at + bytes + 63) & ~(uint64_t)63;
    const uint64_t have = (uint64_t)__builtin_wasm_memory_size(0) * PAGE;
    if (end > UINT32_MAX ||
        (end > have && __builtin_wasm_memory_grow(0, (end - have + PAGE - 1) / PAGE) == SIZE_MAX)) {
        return 0;
    }
    taken = (uintptr_t)end;
    return at;
}

static vd_quad read_quad(const uint32_t words[WORDS]) {
    vd_quad quad = {.nearer = 0};
    memcpy(quad.corners, words, sizeof quad.corners);
    quad.picture.rgba = (const uint8_t *)(uintptr_t)words[12];
    quad.picture.width = (int)words[13];
    quad.picture.height = (int)words[14];
    quad.picture.stride = words[15];
    memcpy(quad.picture.opaque, words + 16, sizeof quad.picture.opaque);
    quad.opacity = (uint8_t)words[20];
    return quad;
}

int vd_wasm_draw_quads(const vd_display_window *window, const vd_quad *quads, int count,
                       float near_m, bool draw_hidden) {
    const uintptr_t mark = vd_wasm_mark();
    const size_t n = (size_t)count;
    vd_display_setup *setups = (vd_display_setup *)vd_wasm_take(n * sizeof *setups);
    vd_display_entry *entries = (vd_display_entry *)vd_wasm_take(n * sizeof *entries);
    vd_display_entry *active = (vd_display_entry *)vd_wasm_take(n * sizeof *active);
    vd_display_segment *segments =
        (vd_display_segment *)vd_wasm_take(vd_display_segment_count(count) * sizeof *segments);
    int unsound = -1;
    if (setups != NULL && entries != NULL && active != NULL && segments != NULL) {
        vd_display_list list = {.window = *window,
                                .kernels = vd_display_kernels_for(VD_ISA_V2),
                                .entries = entries,
                                .draw_hidden = draw_hidden};
        unsound = 0;
        for (int i = 0; i < count; i++) {
            const char *field;
            if (!vd_display_check(&quads[i], &field)) {
                unsound++;
            } else if (vd_display_prepare(&quads[i], near_m, window->height, &setups[list.count],
                                          &entries[list.count])) {
                list.count++;
            }
        }
        vd_display_rows(&list, 0, window->height, (vd_display_scratch){active, segments});
    }
    vd_wasm_return(mark);
    return unsound;
}

/* Draws `count` quads of `words` over rgba, height rows of stride pixels (a multiple of 16, rgba at
 * a multiple of 64). Returns how many were left out because they are not sound, or −1 when there is
 * no memory. */
int VD_EXPORT(vd_wasm_draw)(uint8_t *rgba, int width, int height, size_t stride,
                            const uint32_t *words, int count, float near_m, int draw_hidden) {
    const uintptr_t mark = vd_wasm_mark();
    vd_quad *quads = (vd_quad *)vd_wasm_take((size_t)count * sizeof *quads);
    int unsound = -1;
    if (quads != NULL) {
        const vd_display_window window = {
            .rgba = rgba, .width = width, .height = height, .stride = stride};
        for (int i = 0; i < count; i++) {
            quads[i] = read_quad(words + (size_t)i * WORDS);
        }
        unsound = vd_wasm_draw_quads(&window, quads, count, near_m, draw_hidden != 0);
    }
    vd_wasm_return(mark);
    return unsound;
}
