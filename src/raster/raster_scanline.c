/* raster_scanline.c: the immediate method by spans (Wylie et al. 1967).
 *
 * Instead of following two sides downwards, each row's span is what the three edge functions leave
 * of it: one exact division an edge and row. It therefore has the same samples as every other
 * method, and no drift.
 */
#include "raster/raster_edges.h"

static void pixel_range(const int32_t v[3], int32_t shift, int count, int *first, int *last) {
    int32_t min = v[0], max = v[0];
    for (int i = 1; i < 3; i++) {
        min = v[i] < min ? v[i] : min;
        max = v[i] > max ? v[i] : max;
    }
    const int low = (min - shift + VD_SUBPIXELS - 1) >> 8, high = (max - shift - 1) >> 8;
    *first = low > 0 ? low : 0;
    *last = high < count - 1 ? high : count - 1;
}

vd_edges vd_edges_make(const vd_setup *s, const vd_visible *window, int sample) {
    vd_edges e;
    int32_t shift_x, shift_y;
    vd_sample_shift(window->samples, sample, &shift_x, &shift_y);
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3;
        const int64_t dx = (int64_t)s->x[j] - s->x[i], dy = (int64_t)s->y[j] - s->y[i];
        const int64_t bias = dy < 0 || (dy == 0 && dx > 0) ? 0 : -1;
        const int64_t value =
            dx * ((int64_t)shift_y - s->y[i]) - dy * ((int64_t)shift_x - s->x[i]) + bias;
        e.at[i] = value >> 8;
        e.dx[i] = -dy;
        e.dy[i] = dx;
    }
    pixel_range(s->x, shift_x, window->width, &e.x0, &e.x1);
    pixel_range(s->y, shift_y, window->height, &e.y0, &e.y1);
    return e;
}

void vd_window_take(vd_visible *window, int sample, const vd_setup *s, int x, int y) {
    int32_t shift_x, shift_y;
    vd_sample_shift(window->samples, sample, &shift_x, &shift_y);
    const float dx = (float)(x * VD_SUBPIXELS + shift_x - s->x[0]);
    const float dy = (float)(y * VD_SUBPIXELS + shift_y - s->y[0]);
    float z = s->z0 + (dx * s->dz_dx + dy * s->dz_dy);
    z = z > s->z_min ? z : s->z_min;
    z = z < s->z_max ? z : s->z_max;
    const size_t at = (size_t)sample * window->plane + (size_t)y * window->stride + (size_t)x;
    if (z > window->depth[at] || (z == window->depth[at] && s->id < window->id[at])) {
        window->depth[at] = z;
        window->id[at] = s->id;
    }
}

/* floor(a / b) for b > 0. */
static int64_t floor_divide(int64_t a, int64_t b) {
    return a >= 0 ? a / b : -((-a + b - 1) / b);
}

void vd_scanline_fill(vd_visible *window, const vd_setup *setup) {
    for (int sample = 0; sample < window->samples; sample++) {
        const vd_edges e = vd_edges_make(setup, window, sample);
        for (int y = e.y0; y <= e.y1; y++) {
            int64_t first = e.x0, last = e.x1;
            for (int i = 0; i < 3; i++) {
                const int64_t row = e.at[i] + y * e.dy[i];
                if (e.dx[i] > 0) { /* x >= −row / dx, rounded up */
                    const int64_t from = -floor_divide(row, e.dx[i]);
                    first = from > first ? from : first;
                } else if (e.dx[i] < 0) {
                    const int64_t to = floor_divide(row, -e.dx[i]);
                    last = to < last ? to : last;
                } else if (row < 0) {
                    last = first - 1;
                }
            }
            for (int64_t x = first; x <= last; x++) {
                vd_window_take(window, sample, setup, (int)x, y);
            }
        }
    }
}
