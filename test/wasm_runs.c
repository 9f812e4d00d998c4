/* wasm_runs FILE: run-length pictures for the decoder in WebAssembly, each packed here: u32 width,
 * height, bytes, whether they are sound, then the bytes (padded to four) and, where they are, the
 * pixels. Unsound ones are cut or have a bit turned. */
#include "remote/codec_runs.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* SplitMix64 (Steele, Lea, Flood 2014). */
static uint64_t next(uint64_t *state) {
    uint64_t z = (*state += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

static void paint(uint8_t *rgba, size_t width, size_t height, uint64_t *seed) {
    uint32_t pixel = 0;
    for (size_t i = 0; i < width * height; i++) {
        if (next(seed) % 7 == 0) { /* runs of about seven, half of them transparent */
            pixel = next(seed) % 2 ? (uint32_t)next(seed) : 0;
        }
        memcpy(rgba + 4 * i, &pixel, 4);
    }
}

int main(int argc, char **argv) {
    enum { PICTURES = 300, MOST = 70 };
    FILE *out = argc == 2 ? fopen(argv[1], "wb") : NULL;
    if (out == NULL) {
        fprintf(stderr, "wasm_runs: give a file that can be written\n");
        return 2;
    }
    static uint8_t rgba[4 * MOST * MOST], back[4 * MOST * MOST];
    uint8_t *packed = malloc(vd_runs_bound(MOST, MOST) + 4);
    uint64_t seed = 1;
    for (int i = 0; i < PICTURES && packed != NULL; i++) {
        const size_t width = 1 + next(&seed) % MOST, height = 1 + next(&seed) % MOST;
        paint(rgba, width, height, &seed);
        size_t bytes = vd_runs_encode(rgba, width, width, height, packed);
        if (i % 3 == 1) {
            bytes = next(&seed) % bytes;
        } else if (i % 3 == 2) {
            packed[next(&seed) % bytes] ^= (uint8_t)(1u << next(&seed) % 8);
        }
        memset(packed + bytes, 0, 4);
        const uint32_t sound =
            vd_runs_decode(packed, bytes, width, height, back, width) == NULL ? 1 : 0;
        const uint32_t head[4] = {(uint32_t)width, (uint32_t)height, (uint32_t)bytes, sound};
        fwrite(head, sizeof head, 1, out);
        fwrite(packed, 1, (bytes + 3) / 4 * 4, out);
        fwrite(back, 1, sound ? 4 * width * height : 0, out);
    }
    free(packed);
    return fclose(out) == 0 ? 0 : 1;
}
