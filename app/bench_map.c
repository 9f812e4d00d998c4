/* bench_map.c: the terrain that benches run on.
 *
 * Two pictures of Mont Blanc are part of the program, so that it measures the same terrain wherever
 * it is installed: data/bench/mont-blanc-1024.png, 1024² heights 0 … 118 that wrap without a seam,
 * and data/mont-blanc.png, metres, for the lens. --map mirrored is made from the second, 512² of it
 * four times; --map noise from integer noise alone.
 */
#include "bench.h"

#include <string.h>

/* The bytes of FILE between NAME and NAME_end. The paths come from the build. */
#define EMBED(name, file)                                                                          \
    __asm__(".section .rodata\n.balign 16\n" #name ":\n.incbin \"" file "\"\n" #name               \
            "_end:\n.byte 0\n.previous\n");                                                        \
    extern const uint8_t name[] __attribute__((visibility("hidden")));                             \
    extern const uint8_t name##_end[] __attribute__((visibility("hidden")))

EMBED(bench_mont_blanc_1024, VEDUTA_DATA_DIR "/bench/mont-blanc-1024.png");
EMBED(bench_mont_blanc, VEDUTA_DATA_DIR "/mont-blanc.png");

enum { NOISE_SIDE = 1024, OCTAVES = 7, COARSEST = 256, HIGHEST = 118, PIECE_SIDE = 512 };

/* A map before it has a type and a size: one block, heights then colours. */
typedef struct base_map {
    int width, height, highest;
    uint16_t *heights; /* [height][width] */
    uint8_t *rgb;      /* [height][width][3] */
} base_map;

static void base_finish(vd_context *context, base_map *base) {
    vd_release(context, base->heights);
    vd_release(context, base->rgb);
}

static vd_status base_init(vd_context *context, base_map *base, int width, int height) {
    size_t count = (size_t)width * (size_t)height;
    *base = (base_map){.width = width, .height = height};
    base->heights = vd_allocate(context, count, sizeof *base->heights);
    base->rgb = vd_allocate(context, count, 3);
    if (base->heights == NULL || base->rgb == NULL) {
        base_finish(context, base);
        return vd_failure(VD_ERROR_MEMORY, "out of memory for the bench's map");
    }
    return vd_success();
}

/* ---- noise ------------------------------------------------------------------------------------*/

/* lowbias32, an integer hash (Wellons 2018, "Prospecting for hash functions"). */
static uint32_t hash32(uint32_t x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    x ^= x >> 16;
    return x;
}

/* Value noise on a lattice of the given spacing that repeats after NOISE_SIDE samples: 0 … 65535.
 */
static uint32_t noise_at(uint32_t x, uint32_t y, uint32_t spacing, uint32_t seed) {
    uint32_t cells = NOISE_SIDE / spacing;
    uint32_t corner[4];
    for (uint32_t i = 0; i < 4; i++) {
        uint32_t cx = (x / spacing + (i & 1)) % cells, cy = (y / spacing + (i >> 1)) % cells;
        corner[i] = hash32(seed * 0x9e3779b9u + cy * cells + cx) >> 16;
    }
    /* Smoothstep 3t² − 2t³ of the position in the lattice cell, in 1/256. */
    uint32_t tx = x % spacing * 256 / spacing, ty = y % spacing * 256 / spacing;
    tx = tx * tx * (768 - 2 * tx) >> 16;
    ty = ty * ty * (768 - 2 * ty) >> 16;
    uint32_t upper = (corner[0] * (256 - tx) + corner[1] * tx) >> 8;
    uint32_t lower = (corner[2] * (256 - tx) + corner[3] * tx) >> 8;
    return (upper * (256 - ty) + lower * ty) >> 8;
}

/* Mountains: octaves that halve in size and height, squared so that valleys are wide. */
static vd_status make_noise(vd_context *context, base_map *base) {
    vd_status status = base_init(context, base, NOISE_SIDE, NOISE_SIDE);
    uint32_t *sums = vd_allocate(context, (size_t)NOISE_SIDE * NOISE_SIDE, sizeof *sums);
    if (status.code == VD_OK && sums == NULL) {
        base_finish(context, base);
        status = vd_failure(VD_ERROR_MEMORY, "out of memory for the bench's map");
    }
    if (status.code == VD_OK) {
        uint32_t lowest = UINT32_MAX, highest = 0;
        for (uint32_t y = 0; y < NOISE_SIDE; y++) {
            for (uint32_t x = 0; x < NOISE_SIDE; x++) {
                uint32_t sum = 0;
                for (uint32_t octave = 0; octave < OCTAVES; octave++) {
                    sum += noise_at(x, y, (uint32_t)COARSEST >> octave, octave + 1) >> octave;
                }
                sums[y * NOISE_SIDE + x] = sum;
                lowest = sum < lowest ? sum : lowest;
                highest = sum > highest ? sum : highest;
            }
        }
        for (uint32_t i = 0; i < NOISE_SIDE * NOISE_SIDE; i++) {
            uint64_t t = (uint64_t)(sums[i] - lowest) * 65535 / (highest - lowest);
            base->heights[i] = (uint16_t)((t * t * HIGHEST / 65535 + 32767) / 65535);
        }
    }
    vd_release(context, sums);
    return status;
}

/* ---- a picture of heights ---------------------------------------------------------------------*/

/* Decodes one of the program's own pictures. */
static vd_status decode_own(vd_context *context, const uint8_t *from, const uint8_t *end,
                            vd_picture **out) {
    return vd_picture_decode(context, from, (size_t)(end - from), "the bench's map", out);
}

/* The middle 512² of data/mont-blanc.png, which is 16-bit grey, and its mirror images, so that it
 * wraps without a seam; the heights as 0 … 118. */
static vd_status make_mirrored(vd_context *context, base_map *base) {
    vd_picture *picture = NULL;
    vd_status status = decode_own(context, bench_mont_blanc, bench_mont_blanc_end, &picture);
    if (status.code != VD_OK) {
        return status;
    }
    status = base_init(context, base, 2 * PIECE_SIDE, 2 * PIECE_SIDE);
    int lowest = UINT16_MAX, highest = 0;
    for (int i = 0; i < base->width * base->height && status.code == VD_OK; i++) {
        int x = i % base->width, y = i / base->width;
        x = (picture->width - PIECE_SIDE) / 2 + (x < PIECE_SIDE ? x : 2 * PIECE_SIDE - 1 - x);
        y = (picture->height - PIECE_SIDE) / 2 + (y < PIECE_SIDE ? y : 2 * PIECE_SIDE - 1 - y);
        const uint8_t *row = (const uint8_t *)picture->data + (size_t)y * picture->stride_bytes;
        int metres = ((const uint16_t *)(const void *)row)[x];
        base->heights[i] = (uint16_t)metres;
        lowest = metres < lowest ? metres : lowest;
        highest = metres > highest ? metres : highest;
    }
    for (int i = 0; i < base->width * base->height && status.code == VD_OK; i++) {
        int range = highest - lowest;
        base->heights[i] =
            (uint16_t)(((base->heights[i] - lowest) * 2 * HIGHEST + range) / (2 * range));
    }
    vd_picture_destroy(&picture);
    return status;
}

static vd_status read_heights(vd_context *context, const char *map, base_map *base) {
    vd_picture *picture = NULL;
    vd_status status =
        strcmp(map, "mont-blanc") == 0
            ? decode_own(context, bench_mont_blanc_1024, bench_mont_blanc_1024_end, &picture)
            : vd_picture_load(context, map, &picture);
    if (status.code != VD_OK) {
        return status;
    }
    status = base_init(context, base, picture->width, picture->height);
    for (int y = 0; y < picture->height && status.code == VD_OK; y++) {
        const uint8_t *row = (const uint8_t *)picture->data + (size_t)y * picture->stride_bytes;
        for (int x = 0; x < picture->width; x++) {
            size_t at = (size_t)x * (size_t)picture->channels;
            base->heights[(size_t)y * (size_t)picture->width + (size_t)x] =
                picture->bits == 16 ? ((const uint16_t *)(const void *)row)[at] : row[at];
        }
    }
    vd_picture_destroy(&picture);
    return status;
}

/* ---- colours and sizes ------------------------------------------------------------------------*/

/* Meadow, forest, rock and snow by height, darker on slopes that face east, a little noise. */
static void make_color(const base_map *base, int x, int y, uint8_t rgb[3]) {
    static const struct {
        int height;
        int rgb[3];
    } stops[] = {{0, {110, 140, 80}},
                 {30, {60, 100, 50}},
                 {60, {120, 105, 90}},
                 {90, {200, 200, 205}},
                 {HIGHEST, {250, 250, 255}}};
    const uint16_t *row = base->heights + (size_t)y * (size_t)base->width;
    int scale = base->highest > 0 ? base->highest : 1;
    int here = row[x] * HIGHEST / scale, east = row[(x + 1) % base->width] * HIGHEST / scale;
    int stop = 0;
    while (here > stops[stop + 1].height) {
        stop++;
    }
    int from = stops[stop].height, to = stops[stop + 1].height;
    uint32_t index = (uint32_t)y * (uint32_t)base->width + (uint32_t)x;
    int light = 256 - 24 * (here - east) + (int)(hash32(index) % 33) - 16;
    for (int c = 0; c < 3; c++) {
        int a = stops[stop].rgb[c], b = stops[stop + 1].rgb[c];
        int value = (a + (b - a) * (here - from) / (to - from)) * light / 256;
        rgb[c] = (uint8_t)(value < 0 ? 0 : value > 255 ? 255 : value);
    }
}

static void color_base(base_map *base) {
    size_t count = (size_t)base->width * (size_t)base->height;
    for (size_t i = 0; i < count; i++) {
        base->highest = base->heights[i] > base->highest ? base->heights[i] : base->highest;
    }
    for (int y = 0; y < base->height; y++) {
        for (int x = 0; x < base->width; x++) {
            make_color(base, x, y, base->rgb + 3 * ((size_t)y * (size_t)base->width + (size_t)x));
        }
    }
}

/* Where sample i of `side` lies in a base of `base_side`: repeated, or every n-th. */
static int source_of(int i, int side, int base_side) {
    return side >= base_side ? i % base_side : (int)((int64_t)i * base_side / side);
}

/* Fills heights of a type, and colours, of the wanted size. */
static void spread(const base_map *base, vd_height_type type, int width, int height, void *heights,
                   vd_picture *colors) {
    for (int y = 0; y < height; y++) {
        size_t from = (size_t)source_of(y, height, base->height) * (size_t)base->width;
        size_t to = (size_t)y * (size_t)width;
        uint8_t *rgb = (uint8_t *)colors->data + (size_t)y * colors->stride_bytes;
        for (int x = 0; x < width; x++) {
            size_t at = from + (size_t)source_of(x, width, base->width);
            uint16_t value = base->heights[at];
            if (type == VD_HEIGHT_U8) {
                ((uint8_t *)heights)[to + (size_t)x] = (uint8_t)value;
            } else if (type == VD_HEIGHT_U16) {
                ((uint16_t *)heights)[to + (size_t)x] = value;
            } else {
                ((float *)heights)[to + (size_t)x] = value;
            }
            memcpy(rgb + 3 * (size_t)x, base->rgb + 3 * at, 3);
        }
    }
}

static vd_status create_metres(vd_context *context, vd_heightfield **out) {
    vd_dem_def def = vd_dem_def_default();
    def.cell_size_m = 75;
    vd_dem *dem = NULL;
    vd_status status =
        vd_dem_decode(context, bench_mont_blanc, (size_t)(bench_mont_blanc_end - bench_mont_blanc),
                      "mont-blanc.png", &def, &dem);
    if (status.code == VD_OK) {
        status = vd_heightfield_from_dem(dem, NULL, NULL, out);
    }
    vd_dem_destroy(&dem);
    return status;
}

vd_status bench_map_create(vd_context *context, const char *map, bench_map_kind kind, int width,
                           int height, vd_heightfield **out) {
    if (kind == BENCH_MAP_METRES) {
        return create_metres(context, out);
    }
    base_map base;
    vd_status status = strcmp(map, "noise") == 0      ? make_noise(context, &base)
                       : strcmp(map, "mirrored") == 0 ? make_mirrored(context, &base)
                                                      : read_heights(context, map, &base);
    if (status.code != VD_OK) {
        return status;
    }
    color_base(&base);
    vd_heightfield_def def = vd_heightfield_def_default();
    def.width = width > 0 ? width : base.width;
    def.height = height > 0 ? height : base.height;
    def.type = kind == BENCH_MAP_FLOAT ? VD_HEIGHT_F32
               : base.highest > 255    ? VD_HEIGHT_U16
                                       : VD_HEIGHT_U8;
    static const size_t bytes[VD_HEIGHT_TYPE_COUNT] = {1, 2, 4};
    vd_picture *colors = NULL;
    void *heights = vd_allocate(context, (size_t)def.width * (size_t)def.height, bytes[def.type]);
    status = heights != NULL ? vd_picture_create(context, def.width, def.height, 3, 8, &colors)
                             : vd_failure(VD_ERROR_MEMORY, "out of memory for the bench's map");
    if (status.code == VD_OK) {
        spread(&base, def.type, def.width, def.height, heights, colors);
        def.heights = heights;
        def.height_stride = (size_t)def.width;
        def.wraps = kind == BENCH_MAP_CLASSIC;
        def.colors = colors;
        status = vd_heightfield_create(context, &def, out);
    }
    vd_picture_destroy(&colors);
    vd_release(context, heights);
    base_finish(context, &base);
    return status;
}
