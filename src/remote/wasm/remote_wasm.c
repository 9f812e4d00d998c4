/* The run-length decoder in WebAssembly: what script/build-wasm exports of it.
 *
 * Sizes and addresses are the page's own; the bytes are a server's and are checked. Both return 0,
 * or the address of what is wrong: a piece of a sentence, ended by a zero.
 */
#include "remote/codec_runs.h"

#define EXPORT(name) __attribute__((export_name(#name), used)) name

uintptr_t EXPORT(vd_wasm_unpack_runs)(const uint8_t *data, size_t bytes, size_t width,
                                      size_t height, uint8_t *rgba, size_t stride) {
    return (uintptr_t)vd_runs_decode(data, bytes, width, height, rgba, stride);
}

uintptr_t EXPORT(vd_wasm_unpack_plane)(const uint8_t *data, size_t bytes, size_t count,
                                       uint8_t *plane) {
    return (uintptr_t)vd_runs_decode_plane(data, bytes, count, plane);
}
