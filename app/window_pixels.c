/* window_pixels.c: the loops over every pixel that is shown. Compiled with -O3, for vectors. */
#include "window_pixels.h"

#include <string.h>

enum { ROWS_A_TASK = 32, BLOCK = 256 };

typedef struct conversion {
    const vd_frame *frame;
    int width, height;
    uint32_t *out;
} conversion;

static inline uint32_t swap_red_and_blue(uint32_t p) {
    return 0xFF000000u | (p >> 16 & 0xFFu) | (p & 0xFF00u) | (p & 0xFFu) << 16;
}

static void convert_row(const uint32_t *restrict from, int width, uint32_t *restrict to) {
    for (int x = 0; x < width; x++) {
        to[x] = swap_red_and_blue(from[x]);
    }
}

/* a + (b − a)·weight/256 in each channel, two at a time. */
static inline uint32_t mix(uint32_t a, uint32_t b, uint32_t weight) {
    const uint32_t low = 0x00FF00FFu, other = 256u - weight;
    const uint32_t even = ((a & low) * other + (b & low) * weight) >> 8 & low;
    const uint32_t odd = ((a >> 8 & low) * other + (b >> 8 & low) * weight) & ~low;
    return even | odd;
}

static void mix_rows(const uint32_t *restrict a, const uint32_t *restrict b, uint32_t weight,
                     int width, uint32_t *restrict to) {
    for (int x = 0; x < width; x++) {
        to[x] = mix(a[x], b[x], weight);
    }
}

static const uint32_t *row_of(const vd_frame *frame, int y) {
    y = y < 0 ? 0 : y < frame->height ? y : frame->height - 1;
    return (const uint32_t *)(const void *)frame->rgba + (size_t)y * frame->stride;
}

/* Where output pixels' centres lie in the source, in 1/256 of a pixel from the first centre. */
typedef struct steps {
    int64_t first, step; /* in 2^-24 of a source pixel */
} steps;

static steps make_steps(int count, int source_count) {
    const int64_t step = ((int64_t)source_count << 24) / count;
    return (steps){step / 2 - (1 << 23), step};
}

static inline int source_position(const steps *s, int at) {
    return (int)((s->first + at * s->step) >> 16);
}

/* Stretches a part of an output row, whose source row is mixed from rows a and b first. */
static void stretch_block(const conversion *c, const steps *across, const uint32_t *a,
                          const uint32_t *b, uint32_t weight, int x0, int x1, uint32_t *to) {
    uint32_t row[BLOCK + 4]; /* enough, since frames are no larger than what is shown */
    /* From the pixel left of the first centre to the one right of the last; the picture's outermost
     * pixels are repeated. */
    const int left = source_position(across, x0) >> 8;
    const int count = (source_position(across, x1 - 1) >> 8) + 2 - left;
    const int inner_left = left < 0 ? 0 : left, width = c->frame->width;
    const int inner_right = left + count < width ? left + count : width;
    mix_rows(a + inner_left, b + inner_left, weight, inner_right - inner_left,
             row + (inner_left - left));
    if (left < 0) {
        row[0] = row[1];
    }
    if (inner_right < left + count) {
        row[count - 1] = row[count - 2];
    }
    for (int x = x0; x < x1; x++) {
        const int u = source_position(across, x);
        const uint32_t *p = row + ((u >> 8) - left);
        to[x] = swap_red_and_blue(mix(p[0], p[1], (uint32_t)(u & 255)));
    }
}

static void stretch_rows(const conversion *c, int first, int last) {
    const vd_frame *f = c->frame;
    const steps across = make_steps(c->width, f->width), down = make_steps(c->height, f->height);
    for (int y = first; y < last; y++) {
        const int v = source_position(&down, y);
        const uint32_t *a = row_of(f, v >> 8), *b = row_of(f, (v >> 8) + 1);
        uint32_t *to = c->out + (size_t)y * (size_t)c->width;
        for (int x0 = 0; x0 < c->width; x0 += BLOCK) {
            const int x1 = x0 + BLOCK < c->width ? x0 + BLOCK : c->width;
            stretch_block(c, &across, a, b, (uint32_t)(v & 255), x0, x1, to);
        }
    }
}

static void convert_rows(void *user, int index, int worker) {
    const conversion *c = user;
    (void)worker;
    const int first = index * ROWS_A_TASK;
    const int last = first + ROWS_A_TASK < c->height ? first + ROWS_A_TASK : c->height;
    if (c->frame->width != c->width || c->frame->height != c->height) {
        stretch_rows(c, first, last);
        return;
    }
    for (int y = first; y < last; y++) {
        convert_row(row_of(c->frame, y), c->width, c->out + (size_t)y * (size_t)c->width);
    }
}

vd_status vd_pixels_from_frame(vd_context *context, const vd_frame *frame, int width, int height,
                               uint32_t *out) {
    conversion c = {frame, width, height, out};
    if (frame->width > width || frame->height > height) {
        return vd_failure(VD_ERROR_ARGUMENT, "a frame of %d x %d is larger than %d x %d pixels",
                          frame->width, frame->height, width, height);
    }
    return vd_parallel_for(context, NULL, (height + ROWS_A_TASK - 1) / ROWS_A_TASK, convert_rows,
                           &c);
}

void vd_pixels_lay_over(uint32_t *pixels, size_t stride, int width, int height,
                        const vd_frame *frame, int x, int y) {
    for (int row = 0; row < frame->height; row++) {
        if (y + row < 0 || y + row >= height) {
            continue;
        }
        const uint8_t *from = frame->rgba + 4 * (size_t)row * frame->stride;
        uint32_t *to = pixels + (size_t)(y + row) * stride;
        for (int column = 0; column < frame->width; column++, from += 4) {
            if (from[3] == 0 || x + column < 0 || x + column >= width) {
                continue;
            }
            const uint32_t under = to[x + column], left = 255u - from[3];
            const uint32_t r = from[0] + ((under >> 16 & 255u) * left + 127u) / 255u;
            const uint32_t g = from[1] + ((under >> 8 & 255u) * left + 127u) / 255u;
            const uint32_t b = from[2] + ((under & 255u) * left + 127u) / 255u;
            to[x + column] = 0xFF000000u | r << 16 | g << 8 | b;
        }
    }
}
