/* veduta-display OUT [SECONDS]: how fast quads are blended, natively on one thread at each SIMD
 * level that this machine has, in scenes as a client of a world has them; and the scenes as a file,
 * for bench/display.mjs, which measures the same in WebAssembly (script/bench-display runs both).
 * Little-endian: u32 scene count; of each, u32 words:
 *   width, height, quad count, texel count, blended pixels, thousands of them a second at v2, and
 * 16 bytes of name; quads and texels as test/wasm_scenes.c writes them. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <veduta/context.h>
#include "core/core.h"
#include "display/display_rows.h"

enum { WIDTH = 1280, HEIGHT = 720, MOST_QUADS = 2048, MOST_TEXELS = 1 << 22, WORDS = 21 };

typedef struct scene {
    const char *name;
    int count;
    vd_quad quads[MOST_QUADS];
    uint32_t texels[MOST_TEXELS];
    size_t texel_count;
    uint64_t random;
    uint8_t *rgba;
    vd_display_setup setups[MOST_QUADS];
    vd_display_entry entries[MOST_QUADS], active[MOST_QUADS];
    vd_display_segment segments[MOST_QUADS + 4096 + VD_DISPLAY_SPLITS];
} scene;

/* In [low, high); SplitMix64 (Steele, Lea, Flood 2014). */
static double between(scene *s, double low, double high) {
    uint64_t z = (s->random += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return low + (high - low) * ((double)((z ^ (z >> 31)) >> 11) * 0x1p-53);
}

/* ---- scenes -----------------------------------------------------------------------------------*/

/* A picture of noise; of a crown: opaque in an ellipse, soft at its edge, clear outside it. */
static vd_quad_picture make_picture(scene *s, int width, int height, bool crown) {
    uint32_t *texels = s->texels + s->texel_count;
    s->texel_count += (size_t)width * (size_t)height;
    for (int i = 0; i < width * height; i++) {
        const double x = (2.0 * (i % width) + 1) / width - 1;
        const double y = (2.0 * (i / width) + 1) / height - 1; /* pixel centres, -1 … 1 */
        const double inside = crown ? 4 * (1 - x * x - y * y) : 1;
        const double alpha = inside < 0 ? 0 : inside < 1 ? inside : 1;
        uint32_t texel = (uint32_t)(255 * alpha) << 24;
        for (int c = 0; c < 3; c++) {
            texel |= (uint32_t)(alpha * between(s, 0, 255)) << (8 * c);
        }
        texels[i] = texel;
    }
    return (vd_quad_picture){(const uint8_t *)texels, width, height, (size_t)width, {0}};
}

/* A parallelogram through three places on the picture (pixels), each so many metres away. */
static void add(scene *s, vd_quad_picture picture, const double at[3][3]) {
    vd_quad *q = &s->quads[s->count++];
    *q = (vd_quad){.picture = picture, .opacity = 255};
    for (int i = 0; i < 4; i++) {
        double c[3] = {0, 0, 0};
        for (int k = 0; k < 3; k++) {
            const double weight = i < 3 ? i == k : k == 1 ? -1 : 1;
            c[0] += weight * at[k][0] * at[k][2];
            c[1] += weight * at[k][1] * at[k][2];
            c[2] += weight * at[k][2];
        }
        q->corners[i] = (vd_quad_corner){(float)c[0], (float)c[1], (float)c[2]};
    }
}

/* Pictures of side x side texels, each `zoom` times as large as it is, a little turned. */
static void add_pictures(scene *s, int count, int side, double zoom, bool crown, bool opaque) {
    vd_quad_picture kept[16];
    for (int i = 0; i < 16 && i < count; i++) {
        kept[i] = make_picture(s, side, side, crown);
        if (opaque) {
            const int edge = crown ? side / 4 : 0;
            memcpy(kept[i].opaque, (int[4]){edge, edge, side - edge, side - edge},
                   sizeof kept[i].opaque);
        }
    }
    for (int i = 0; i < count; i++) {
        const double size = zoom * side, tilt = between(s, -0.05, 0.05) * size;
        const double x = between(s, 0, WIDTH - size), y = between(s, 0, HEIGHT - size);
        const double w = between(s, 40, 60);
        add(s, kept[i % 16],
            (const double[3][3]){{x, y + tilt, w},
                                 {x + size, y - tilt, w * between(s, 0.97, 1.03)},
                                 {x + size - tilt, y + size, w * between(s, 0.97, 1.03)}});
    }
}

/* Ground to the horizon in patches, about as many texels as pixels, and 400 trees over it. */
static void make_world(scene *s) {
    for (int row = 0; row < 4; row++) {
        const double top = 180 + 135 * row, w = 400 / (1 << row);
        for (int column = 0; column < 3; column++) {
            vd_quad_picture p = make_picture(s, 428, 136, false);
            memcpy(p.opaque, (int[4]){0, 0, 428, 136}, sizeof p.opaque);
            const double x = 427 * column;
            add(s, p,
                (const double[3][3]){{x, top, w}, {x + 428, top, w}, {x + 440, top + 137, w / 2}});
        }
    }
    add_pictures(s, 400, 48, 0.9, true, true);
}

static void make_scene(scene *s, int number) {
    s->count = 0;
    s->texel_count = 0;
    s->random = (uint64_t)number;
    switch (number) {
    case 0:
        s->name = "ground 1:1";
        add_pictures(s, 4, 700, 1.0, false, false);
        break;
    case 1:
        s->name = "magnified 4x";
        add_pictures(s, 8, 128, 4.0, false, false);
        break;
    case 2:
        s->name = "minified 3x";
        add_pictures(s, 16, 500, 1.0 / 3, false, false);
        break;
    case 3:
        s->name = "trees 40x40";
        add_pictures(s, 1000, 40, 1.0, true, false);
        break;
    default:
        s->name = "world";
        make_world(s);
    }
}

enum { SCENES = 5 };

/* ---- measuring --------------------------------------------------------------------------------*/

static uint64_t blended; /* by `count_pixels`, which has no argument for it */

static void count_pixels(uint8_t *row, const vd_display_line *line, int begin, int end) {
    (void)row;
    (void)line;
    blended += (uint64_t)(end - begin);
}

static void draw(scene *s, const vd_display_kernels *kernels) {
    vd_display_list list = {
        .window = {.rgba = s->rgba, .width = WIDTH, .height = HEIGHT, .stride = WIDTH},
        .kernels = kernels,
        .entries = s->entries};
    for (int i = 0; i < s->count; i++) {
        if (vd_display_prepare(&s->quads[i], 0.01f, HEIGHT, &s->setups[list.count],
                               &s->entries[list.count])) {
            list.count++;
        }
    }
    vd_display_rows(&list, 0, HEIGHT, (vd_display_scratch){s->active, s->segments});
}

/* Blended pixels a nanosecond, of the fastest of the drawings that fit into `seconds`. */
static double rate(scene *s, const vd_display_kernels *kernels, double seconds) {
    uint64_t best = UINT64_MAX;
    const uint64_t end = vd_processor_ns() + (uint64_t)(1e9 * seconds);
    for (uint64_t now = vd_processor_ns(); now < end;) {
        const uint64_t start = now;
        draw(s, kernels);
        now = vd_processor_ns();
        best = now - start < best ? now - start : best;
    }
    return (double)blended / (double)best;
}

static bool write_scene(FILE *file, const scene *s, double v2) {
    const uint32_t head[6] = {WIDTH,
                              HEIGHT,
                              (uint32_t)s->count,
                              (uint32_t)s->texel_count,
                              (uint32_t)blended,
                              (uint32_t)(1e6 * v2)};
    char name[16] = {0};
    memcpy(name, s->name, strlen(s->name));
    bool written = fwrite(head, sizeof head, 1, file) == 1 && fwrite(name, 16, 1, file) == 1;
    for (int i = 0; i < s->count; i++) {
        const vd_quad *q = &s->quads[i];
        uint32_t words[WORDS];
        memcpy(words, q->corners, sizeof q->corners);
        words[12] = (uint32_t)((const uint32_t *)(const void *)q->picture.rgba - s->texels);
        words[13] = (uint32_t)q->picture.width;
        words[14] = (uint32_t)q->picture.height;
        words[15] = (uint32_t)q->picture.stride;
        memcpy(words + 16, q->picture.opaque, sizeof q->picture.opaque);
        words[20] = q->opacity;
        written = written && fwrite(words, sizeof words, 1, file) == 1;
    }
    return written && fwrite(s->texels, 4, s->texel_count, file) == s->texel_count;
}

int main(int argc, char **argv) {
    const vd_display_kernels counting = {count_pixels};
    const double seconds = argc > 2 ? atof(argv[2]) : 0.5;
    const uint32_t count = SCENES;
    FILE *file = argc > 1 ? fopen(argv[1], "wb") : NULL;
    scene *s = malloc(sizeof *s);
    bool written = file != NULL && s != NULL && fwrite(&count, 4, 1, file) == 1;
    if (written) {
        s->rgba = aligned_alloc(64, 4 * WIDTH * HEIGHT);
        written = s->rgba != NULL;
    }
    vd_context *context = NULL;
    written = written && vd_context_create(NULL, &context).code == VD_OK;
    for (int i = 0; i < SCENES && written; i++) {
        make_scene(s, i);
        memset(s->rgba, 0, 4 * WIDTH * HEIGHT);
        blended = 0;
        draw(s, &counting);
        printf("%-14s %8.0f blended pixels; native M/s:", s->name, (double)blended);
        double v2 = 0;
        for (vd_isa isa = VD_ISA_V2; isa <= vd_context_isa(context); isa++) {
            const double found = rate(s, vd_display_kernels_for(isa), seconds);
            v2 = isa == VD_ISA_V2 ? found : v2;
            printf(" v%d %.0f", 2 + (int)(isa - VD_ISA_V2), 1e3 * found);
        }
        printf("\n");
        written = write_scene(file, s, v2);
    }
    vd_context_destroy(&context);
    written = file != NULL && fclose(file) == 0 && written;
    if (!written) {
        fprintf(stderr, "veduta-display: cannot write; use: veduta-display OUT [SECONDS]\n");
    }
    if (s != NULL) {
        free(s->rgba);
    }
    free(s);
    return written ? 0 : 1;
}
