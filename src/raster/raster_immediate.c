/* raster_immediate.c: the immediate method as published (Siddique 2026, §3.1.3).
 *
 *   triangles ─ bins of their boxes ─► (triangle, bin) ─ masks ─► (triangle, bin, fine tile)
 *       └─ small: box, masks ─► pixels        pixels ◄─ masks ─┘
 *
 * Each arrow is an expansion (core/expand.h). The published one materializes each stage for all
 * triangles of a picture; here a stage's outputs come in runs of RUN, so that memory is fixed and
 * stays in cache. Bins go through plain expansion, since their number is not bounded; fine tiles of
 * a bin, pixels of a fine tile and pixels of a small triangle's box through masks.
 */
#include <string.h>
#include "core/expand.h"
#include "raster/raster_edges.h"

#define RUN 512

/* One triangle for one sample's plane. */
typedef struct job {
    vd_setup setup;
    vd_edges edges;
    int sample;
} job;

/* A triangle on a square of the picture. */
typedef struct piece {
    uint32_t job;
    int32_t x, y; /* the square's upper left pixel */
} piece;

/* The sources of one stage. */
typedef struct stage {
    piece pieces[RUN];
    vd_mask masks[RUN];
    uint64_t offsets[RUN + 1];
    vd_expansion expansion;
    uint64_t first; /* the output that goes to the next stage's piece 0 */
} stage;

struct vd_immediate {
    vd_visible *window;
    int bin, fine, small_pixels;
    job jobs[RUN], small_jobs[RUN];
    size_t job_count, small_count;
    stage bins, tiles, pixels, small;
};

vd_immediate *vd_immediate_create(vd_context *context) {
    return vd_allocate_zero(context, 1, sizeof(vd_immediate));
}

void vd_immediate_destroy(vd_context *context, vd_immediate *immediate) {
    vd_release(context, immediate);
}

void vd_immediate_begin(vd_immediate *im, vd_visible *window, int bin, int fine, int small_pixels) {
    im->window = window;
    im->bin = bin;
    im->fine = fine;
    im->small_pixels = small_pixels < VD_MASK_BITS ? small_pixels : VD_MASK_BITS;
    im->job_count = im->small_count = 0;
}

/* ---- edges ------------------------------------------------------------------------------------*/

static bool covers(const vd_edges *e, int x, int y) {
    return e->at[0] + x * e->dx[0] + y * e->dy[0] >= 0 &&
           e->at[1] + x * e->dx[1] + y * e->dy[1] >= 0 &&
           e->at[2] + x * e->dx[2] + y * e->dy[2] >= 0;
}

/* Whether a square of `side` pixels may have a covered one: no edge has it all outside. */
static bool may_cover(const vd_edges *e, int x, int y, int side) {
    if (x > e->x1 || y > e->y1 || x + side <= e->x0 || y + side <= e->y0) {
        return false;
    }
    for (int i = 0; i < 3; i++) {
        const int right = e->dx[i] > 0 ? side - 1 : 0, down = e->dy[i] > 0 ? side - 1 : 0;
        if (e->at[i] + (x + right) * e->dx[i] + (y + down) * e->dy[i] < 0) {
            return false;
        }
    }
    return true;
}

/* ---- pixels -----------------------------------------------------------------------------------*/

static uint32_t pixel_size(const void *user, size_t source) {
    const vd_immediate *im = user;
    (void)source;
    return (uint32_t)(im->fine * im->fine);
}

static bool pixel_wanted(const void *user, size_t source, uint32_t element) {
    const vd_immediate *im = user;
    const piece *p = &im->pixels.pieces[source];
    const vd_edges *e = &im->jobs[p->job].edges;
    const int x = p->x + (int)element % im->fine, y = p->y + (int)element / im->fine;
    return x >= e->x0 && x <= e->x1 && y >= e->y0 && y <= e->y1 && covers(e, x, y);
}

static void pixel_get(void *user, size_t source, uint32_t element, uint64_t output) {
    vd_immediate *im = user;
    const piece *p = &im->pixels.pieces[source];
    const job *j = &im->jobs[p->job];
    (void)output;
    vd_window_take(im->window, j->sample, &j->setup, p->x + (int)element % im->fine,
                   p->y + (int)element / im->fine);
}

/* ---- fine tiles of a bin ----------------------------------------------------------------------*/

static piece tile_piece(const vd_immediate *im, size_t source, uint32_t element) {
    const int across = im->bin / im->fine;
    piece p = im->tiles.pieces[source];
    p.x += (int)element % across * im->fine;
    p.y += (int)element / across * im->fine;
    return p;
}

static uint32_t tile_size(const void *user, size_t source) {
    const vd_immediate *im = user;
    (void)source;
    return (uint32_t)(im->bin / im->fine) * (uint32_t)(im->bin / im->fine);
}

static bool tile_wanted(const void *user, size_t source, uint32_t element) {
    const vd_immediate *im = user;
    const piece p = tile_piece(im, source, element);
    return may_cover(&im->jobs[p.job].edges, p.x, p.y, im->fine);
}

static void tile_get(void *user, size_t source, uint32_t element, uint64_t output) {
    vd_immediate *im = user;
    im->pixels.pieces[output - im->tiles.first] = tile_piece(im, source, element);
}

/* ---- bins -------------------------------------------------------------------------------------*/

static uint32_t bin_size(const void *user, size_t source) {
    const vd_immediate *im = user;
    const vd_edges *e = &im->jobs[source].edges;
    return (uint32_t)(e->x1 / im->bin - e->x0 / im->bin + 1) *
           (uint32_t)(e->y1 / im->bin - e->y0 / im->bin + 1);
}

static void bin_get(void *user, size_t source, uint32_t element, uint64_t output) {
    vd_immediate *im = user;
    const vd_edges *e = &im->jobs[source].edges;
    const int across = e->x1 / im->bin - e->x0 / im->bin + 1;
    im->tiles.pieces[output - im->bins.first] =
        (piece){(uint32_t)source, (e->x0 / im->bin + (int)element % across) * im->bin,
                (e->y0 / im->bin + (int)element / across) * im->bin};
}

/* ---- small triangles --------------------------------------------------------------------------*/

static uint32_t small_size(const void *user, size_t source) {
    const vd_edges *e = &((const vd_immediate *)user)->small_jobs[source].edges;
    return (uint32_t)(e->x1 - e->x0 + 1) * (uint32_t)(e->y1 - e->y0 + 1);
}

static bool small_wanted(const void *user, size_t source, uint32_t element) {
    const vd_edges *e = &((const vd_immediate *)user)->small_jobs[source].edges;
    const int across = e->x1 - e->x0 + 1;
    return covers(e, e->x0 + (int)element % across, e->y0 + (int)element / across);
}

static void small_get(void *user, size_t source, uint32_t element, uint64_t output) {
    vd_immediate *im = user;
    const job *j = &im->small_jobs[source];
    const int across = j->edges.x1 - j->edges.x0 + 1;
    (void)output;
    vd_window_take(im->window, j->sample, &j->setup, j->edges.x0 + (int)element % across,
                   j->edges.y0 + (int)element / across);
}

/* ---- the stages -------------------------------------------------------------------------------*/

static const vd_expand_def bin_def = {bin_size, NULL, bin_get, 0};
static const vd_expand_def tile_def = {tile_size, tile_wanted, tile_get, VD_MASK_BITS};
static const vd_expand_def pixel_def = {pixel_size, pixel_wanted, pixel_get, VD_MASK_BITS};
static const vd_expand_def small_def = {small_size, small_wanted, small_get, VD_MASK_BITS};

static vd_expansion *sources(stage *s, size_t count) {
    s->expansion = (vd_expansion){count, s->masks, s->offsets};
    return &s->expansion;
}

static uint64_t run_end(uint64_t first, uint64_t total) {
    return first + RUN < total ? first + RUN : total;
}

static void fill_pixels(vd_immediate *im, size_t count) {
    const uint64_t total = vd_expand_masked(&pixel_def, im, sources(&im->pixels, count));
    vd_expand_masked_fill(&pixel_def, im, &im->pixels.expansion, 0, total);
}

static void fill_tiles(vd_immediate *im, size_t count) {
    const uint64_t total = vd_expand_masked(&tile_def, im, sources(&im->tiles, count));
    for (uint64_t at = 0; at < total; at += RUN) {
        im->tiles.first = at;
        vd_expand_masked_fill(&tile_def, im, &im->tiles.expansion, at, run_end(at, total));
        fill_pixels(im, (size_t)(run_end(at, total) - at));
    }
}

static void flush_large(vd_immediate *im) {
    const uint64_t total = vd_expand_filter(&bin_def, im, sources(&im->bins, im->job_count));
    for (uint64_t at = 0; at < total; at += RUN) {
        im->bins.first = at;
        vd_expand_filter_fill(&bin_def, im, &im->bins.expansion, at, run_end(at, total));
        fill_tiles(im, (size_t)(run_end(at, total) - at));
    }
    im->job_count = 0;
}

static void flush_small(vd_immediate *im) {
    const uint64_t total = vd_expand_masked(&small_def, im, sources(&im->small, im->small_count));
    vd_expand_masked_fill(&small_def, im, &im->small.expansion, 0, total);
    im->small_count = 0;
}

void vd_immediate_flush(vd_immediate *im) {
    flush_large(im);
    flush_small(im);
}

void vd_immediate_add(vd_immediate *im, const vd_setup *setup) {
    for (int s = 0; s < im->window->samples; s++) {
        const vd_edges e = vd_edges_make(setup, im->window, s);
        if (e.x1 < e.x0 || e.y1 < e.y0) {
            continue;
        }
        const int64_t box = (int64_t)(e.x1 - e.x0 + 1) * (e.y1 - e.y0 + 1);
        if (box <= im->small_pixels) {
            im->small_jobs[im->small_count++] = (job){*setup, e, s};
        } else {
            im->jobs[im->job_count++] = (job){*setup, e, s};
        }
        if (im->small_count == RUN) {
            flush_small(im);
        }
        if (im->job_count == RUN) {
            flush_large(im);
        }
    }
}
