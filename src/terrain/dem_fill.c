/* dem_fill.c: filling missing samples by push-pull.
 *
 * Push: every coarser level holds the mean of the present ones among the four samples below, until
 * one sample is left. Pull: back down, a missing sample takes the bilinear value of the coarser
 * level, which by then is complete. (Gortler, Grzeszczuk, Szeliski & Cohen 1996, "The Lumigraph",
 * §5.3. With a 2 × 2 box and saturated weights a weight is 0 or 1, so NaN serves as the weight.)
 *
 * The pyramid takes a third of the DEM's own memory.
 */
#include <string.h>
#include "core/core.h"
#include "terrain/dem_internal.h"

#define MAX_LEVELS 17 /* 65535 is halved 16 times */

typedef struct fill_level {
    float *heights;
    int width, height;
    size_t stride;
} fill_level;

static void push(const fill_level *fine, const fill_level *coarse) {
    for (int row = 0; row < coarse->height; row++) {
        for (int column = 0; column < coarse->width; column++) {
            double sum = 0.0;
            int present = 0;
            for (int r = 2 * row; r < 2 * row + 2 && r < fine->height; r++) {
                for (int c = 2 * column; c < 2 * column + 2 && c < fine->width; c++) {
                    float h = fine->heights[(size_t)r * fine->stride + (size_t)c];
                    if (!isnan(h)) {
                        sum += (double)h;
                        present++;
                    }
                }
            }
            coarse->heights[(size_t)row * coarse->stride + (size_t)column] =
                present > 0 ? (float)(sum / present) : NAN;
        }
    }
}

/* A fine sample lies a quarter of a coarse cell from the centre of the coarse sample above it: its
 * neighbour on that side weighs 1/4, the one above 3/4, in each direction. */
static float interpolate(const fill_level *coarse, int column, int row) {
    int c0 = column / 2, r0 = row / 2;
    int c1 = c0 + (column % 2 ? 1 : -1), r1 = r0 + (row % 2 ? 1 : -1);
    c1 = c1 < 0 || c1 >= coarse->width ? c0 : c1;
    r1 = r1 < 0 || r1 >= coarse->height ? r0 : r1;
    const float *near_row = coarse->heights + (size_t)r0 * coarse->stride;
    const float *far_row = coarse->heights + (size_t)r1 * coarse->stride;
    double a = 0.75 * (double)near_row[c0] + 0.25 * (double)near_row[c1];
    double b = 0.75 * (double)far_row[c0] + 0.25 * (double)far_row[c1];
    return (float)(0.75 * a + 0.25 * b);
}

static void pull(const fill_level *coarse, const fill_level *fine) {
    for (int row = 0; row < fine->height; row++) {
        float *heights = fine->heights + (size_t)row * fine->stride;
        for (int column = 0; column < fine->width; column++) {
            if (isnan(heights[column])) {
                heights[column] = interpolate(coarse, column, row);
            }
        }
    }
}

/* Lays out the coarser levels one after the other; returns how many samples they take. */
static size_t lay_out(fill_level levels[MAX_LEVELS], int *count) {
    size_t total = 0;
    int n = 1;
    while (levels[n - 1].width > 1 || levels[n - 1].height > 1) {
        levels[n].width = (levels[n - 1].width + 1) / 2;
        levels[n].height = (levels[n - 1].height + 1) / 2;
        levels[n].stride = (size_t)levels[n].width;
        total += (size_t)levels[n].width * (size_t)levels[n].height;
        n++;
    }
    *count = n;
    return total;
}

vd_status vd_dem_fill(vd_dem *dem) {
    vd_dem_update_range(dem);
    if (dem->missing == 0 || isnan(dem->min)) {
        return vd_success();
    }
    fill_level levels[MAX_LEVELS] = {{.heights = dem->heights,
                                      .width = dem->width,
                                      .height = dem->height,
                                      .stride = dem->stride}};
    int count;
    size_t total = lay_out(levels, &count);
    float *pyramid = vd_allocate(dem->context, total, sizeof *pyramid);
    if (!pyramid) {
        return vd_out_of_memory("filling missing heights", total * sizeof *pyramid);
    }
    float *next = pyramid;
    for (int l = 1; l < count; l++) {
        levels[l].heights = next;
        next += (size_t)levels[l].width * (size_t)levels[l].height;
        push(&levels[l - 1], &levels[l]);
    }
    for (int l = count - 1; l > 0; l--) {
        pull(&levels[l], &levels[l - 1]);
    }
    vd_release(dem->context, pyramid);
    vd_dem_update_range(dem);
    return vd_success();
}
