/* coverage_scenes.h: what the tests of paths share: alpha planes, random shapes, comparison. */
#ifndef VEDUTA_TEST_COVERAGE_SCENES_H
#define VEDUTA_TEST_COVERAGE_SCENES_H

#include <math.h>
#include <veduta/veduta.h>
#include "support.h"

/* Coverage of every pixel of a window, 0 … 65535; the last layer's where several touch. */
typedef struct plane {
    int x, y, width, height;
    uint16_t *at; /* [height][width] */
} plane;

static inline void plane_span(void *user, const vd_span *span) {
    plane *p = user;
    assert_true(span->count > 0);
    assert_true(span->x >= p->x && span->x + span->count <= p->x + p->width);
    assert_true(span->y >= p->y && span->y < p->y + p->height);
    uint16_t *row = p->at + (size_t)(span->y - p->y) * (size_t)p->width + (span->x - p->x);
    for (int i = 0; i < span->count; i++) {
        row[i] = span->coverage == NULL ? 65535 : span->coverage[i];
    }
}

static inline plane plane_make(int x, int y, int width, int height) {
    plane p = {x, y, width, height, calloc((size_t)width * (size_t)height, sizeof *p.at)};
    assert_non_null(p.at);
    return p;
}

static inline void plane_draw(plane *p, vd_coverage *coverage, vd_coverage_method method,
                              const vd_layer *layers, size_t count) {
    const vd_coverage_def def = {.method = method};
    memset(p->at, 0, (size_t)p->width * (size_t)p->height * sizeof *p->at);
    assert_ok(vd_coverage_spans(coverage, NULL, &def, layers, count, p->x, p->y, p->width,
                                p->height, plane_span, p));
}

static inline bool plane_equal(const plane *a, const plane *b) {
    return memcmp(a->at, b->at, (size_t)a->width * (size_t)a->height * sizeof *a->at) == 0;
}

/* The largest difference of a pixel. */
static inline int plane_difference(const plane *a, const plane *b) {
    int most = 0;
    for (size_t i = 0; i < (size_t)a->width * (size_t)a->height; i++) {
        const int d = abs(a->at[i] - b->at[i]);
        most = d > most ? d : most;
    }
    return most;
}

/* Covered pixels. */
static inline double plane_area(const plane *p) {
    double sum = 0;
    for (size_t i = 0; i < (size_t)p->width * (size_t)p->height; i++) {
        sum += p->at[i];
    }
    return sum / 65535;
}

/* Random corners in and around a square, some on whole and half pixels, some repeated. */
static inline void random_corners(uint64_t *random, double size, size_t count, double (*out)[2]) {
    for (size_t i = 0; i < count; i++) {
        const uint64_t kind = test_random(random) % 16;
        for (int k = 0; k < 2; k++) {
            double v = (test_uniform(random) * 1.4 - 0.2) * size;
            v = kind < 4 ? floor(v) : kind < 6 ? floor(2 * v) / 2 : v;
            out[i][k] = kind == 15 && i > 0 ? out[i - 1][k] : v;
            if (kind == 14 && i > 0 && k == 1) {
                out[i][k] = out[i - 1][k]; /* horizontal */
            }
        }
    }
}

#endif
