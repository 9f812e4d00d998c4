/* bench_codec.c: the picture codecs: bytes, and time to encode and decode, by the picture's side.
 *
 * Again what Lawlor 2004 measured (§5.3, table 5.7, figures 5.4 and 5.5): pictures as impostors
 * have them, drawn by exact coverage with much emptiness around: a tree, a building, a cloud of
 * particles. Packing, sending and unpacking work at the same time on different pictures, so a link
 * ships one picture in the time of the slowest of the three: that is what the note of the decoding
 * says for links of 1, 10 and 100 MB/s.
 */
#include "bench.h"
#include "random.h"
#include "remote_module.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_LAYERS = 2400, MOST_POINTS = 8 };

static const double links_bytes_per_s[3] = {1e6, 10e6, 100e6};

/* ---- pictures ---------------------------------------------------------------------------------*/

typedef struct drawing {
    vd_layer layers[MOST_LAYERS];
    double points[MOST_LAYERS][MOST_POINTS][2];
    size_t count;
} drawing;

/* Fills a drawing. */
typedef void bench_codec_draw(drawing *d);

/* Adds a polygon whose corners are in 0 … 1; straight colours of 0 … 1. */
static void add(drawing *d, int corners, const double (*points)[2], const double color[3],
                double alpha) {
    vd_layer *layer = &d->layers[d->count];
    memcpy(d->points[d->count], points, sizeof **points * 2 * (size_t)corners);
    *layer = vd_layer_default();
    layer->path.points = (const double(*)[2])d->points[d->count];
    layer->path.point_count = (size_t)corners;
    for (int c = 0; c < 3; c++) {
        layer->fill[c] = (uint16_t)(65535 * color[c] * alpha);
    }
    layer->fill[3] = (uint16_t)(65535 * alpha);
    d->count++;
}

/* A leaf or particle: eight corners of an ellipse turned by an angle. */
static void add_ellipse(drawing *d, double x, double y, double a, double b, double turn,
                        const double color[3], double alpha) {
    double p[MOST_POINTS][2];
    for (int i = 0; i < MOST_POINTS; i++) {
        const double u = a * cos(0.785398 * i), v = b * sin(0.785398 * i);
        p[i][0] = x + u * cos(turn) - v * sin(turn);
        p[i][1] = y + u * sin(turn) + v * cos(turn);
    }
    add(d, MOST_POINTS, (const double(*)[2])p, color, alpha);
}

static void add_branch(drawing *d, double x0, double y0, double x1, double y1, double wide) {
    static const double bark[3] = {0.33, 0.25, 0.18};
    const double thin = 0.4 * wide;
    const double p[4][2] = {{x0 - wide, y0}, {x0 + wide, y0}, {x1 + thin, y1}, {x1 - thin, y1}};
    add(d, 4, p, bark, 1);
}

static void draw_tree(drawing *d) {
    uint64_t random = 1;
    add_branch(d, 0.5, 0.97, 0.5, 0.4, 0.025);
    for (int i = 0; i < 12; i++) {
        const double y = 0.35 + 0.035 * i;
        add_branch(d, 0.5, y + 0.15, 0.5 + (i % 2 == 0 ? 0.28 : -0.28) * vd_uniform(&random), y,
                   0.008);
    }
    for (int i = 0; i < 2000; i++) { /* clumps of leaves around the branches */
        const double way = 6.283185 * vd_uniform(&random), r = sqrt(vd_uniform(&random));
        const double x = 0.5 + 0.36 * r * cos(way) * (0.7 + 0.3 * sin(5 * way));
        const double y = 0.4 + 0.36 * r * sin(way) * (0.75 + 0.25 * cos(7 * way));
        const double light = 0.5 + 0.5 * vd_uniform(&random) - 0.4 * (y - 0.4);
        const double green[3] = {0.25 * light, 0.55 * light, 0.15 * light};
        add_ellipse(d, x, y, 0.006 + 0.008 * vd_uniform(&random), 0.005, 3.14 * vd_uniform(&random),
                    green, 1);
    }
}

static void add_wall(drawing *d, double x0, double x1, double lift0, double lift1,
                     const double color[3], int windows) {
    static const double glass[3] = {0.18, 0.24, 0.32};
    const double top0 = 0.3 + lift0, top1 = 0.3 + lift1, low0 = 0.9 - lift0, low1 = 0.9 - lift1;
    const double wall[4][2] = {{x0, top0}, {x1, top1}, {x1, low1}, {x0, low0}};
    add(d, 4, wall, color, 1);
    for (int i = 0; i < windows * 6; i++) {
        double p[4][2];
        for (int k = 0; k < 4; k++) {
            const double u = (i % windows + (k == 1 || k == 2 ? 0.8 : 0.25)) / windows;
            const double v = (i / windows + (k >= 2 ? 0.8 : 0.2)) / 6;
            const double top = top0 + (top1 - top0) * u, low = low0 + (low1 - low0) * u;
            p[k][0] = x0 + (x1 - x0) * u;
            p[k][1] = top + (low - top) * v;
        }
        add(d, 4, (const double(*)[2])p, glass, 1);
    }
}

static void draw_building(drawing *d) {
    static const double lit[3] = {0.82, 0.77, 0.68}, shaded[3] = {0.5, 0.46, 0.42};
    static const double tiles[3] = {0.55, 0.25, 0.2};
    static const double roof[4][2] = {{0.1, 0.35}, {0.38, 0.12}, {0.9, 0.38}, {0.62, 0.31}};
    add_wall(d, 0.12, 0.6, 0.04, 0, lit, 8);
    add_wall(d, 0.6, 0.88, 0, 0.07, shaded, 4);
    add(d, 4, roof, tiles, 1);
}

static void draw_particles(drawing *d) {
    uint64_t random = 1;
    for (int i = 0; i < MOST_LAYERS; i++) { /* the sum of uniform numbers is nearly a Gaussian */
        double x = 0, y = 0;
        for (int k = 0; k < 6; k++) {
            x += vd_uniform(&random) / 6;
            y += vd_uniform(&random) / 6;
        }
        const double heat = vd_uniform(&random);
        const double color[3] = {0.4 + 0.6 * heat, 0.5 + 0.3 * heat, 1 - 0.5 * heat};
        const double size = 0.002 + 0.006 * vd_uniform(&random);
        add_ellipse(d, 0.5 + 1.3 * (x - 0.5), y, size, size, 0, color, 0.6);
    }
}

/* ---- measuring --------------------------------------------------------------------------------*/

typedef struct studio {
    vd_remote_module remote;
    vd_context *context;
    vd_coverage *coverage;
    vd_coder *coder;
    drawing *drawing;
    vd_frame *frame;
    uint8_t *packed, *back;
    size_t room;
    vd_encode_def def;
    vd_codec_picture picture;
    vd_encoded encoded;
    int turns; /* pictures a measured run */
} studio;

static void finish_studio(studio *s) {
    if (s->coder != NULL) {
        s->remote.coder_destroy(&s->coder);
    }
    vd_coverage_destroy(&s->coverage);
    free(s->drawing);
    if (s->context != NULL) {
        vd_context_destroy(&s->context);
    }
}

static vd_status init_studio(studio *s, bench_codec_draw *draw) {
    memset(s, 0, sizeof *s);
    vd_context_def def = vd_context_def_default();
    def.threads = 1;
    vd_status status = vd_remote_module_open("measure codecs", &s->remote);
    if (status.code == VD_OK) {
        status = vd_context_create(&def, &s->context);
    }
    if (status.code == VD_OK) {
        status = vd_coverage_create(s->context, &s->coverage);
    }
    if (status.code == VD_OK) {
        status = s->remote.coder_create(s->context, &s->coder);
    }
    if (status.code == VD_OK) {
        s->drawing = calloc(1, sizeof *s->drawing);
        if (s->drawing == NULL) {
            return vd_failure(VD_ERROR_MEMORY, "out of memory for a drawing");
        }
        draw(s->drawing);
    }
    return status;
}

/* Draws the picture at a side and makes room for it packed and back. */
static vd_status open_side(studio *s, int side) {
    vd_status status = vd_frame_create(s->context, side, side, 0, &s->frame);
    if (status.code != VD_OK) {
        return status;
    }
    memset(s->frame->rgba, 0, 4 * s->frame->stride * (size_t)side);
    for (size_t i = 0; i < s->drawing->count; i++) {
        s->drawing->layers[i].picture_from_path = (vd_affine){.xx = side, .yy = side};
    }
    status = vd_coverage_draw_frame(s->coverage, NULL, NULL, s->drawing->layers, s->drawing->count,
                                    s->frame);
    s->picture = (vd_codec_picture){s->frame->rgba, side, side, s->frame->stride};
    s->room = s->remote.codec_bound(VD_CODEC_AUTO, side, side);
    s->packed = malloc(s->room);
    s->back = malloc(4 * (size_t)side * (size_t)side);
    if (status.code == VD_OK && (s->packed == NULL || s->back == NULL)) {
        status = vd_failure(VD_ERROR_MEMORY, "out of memory for a packed picture");
    }
    return status;
}

static void close_side(studio *s) {
    free(s->packed);
    free(s->back);
    s->packed = s->back = NULL;
    vd_frame_destroy(&s->frame);
}

static vd_status encode(void *user) {
    studio *s = user;
    vd_status status = vd_success();
    for (int i = 0; i < s->turns && status.code == VD_OK; i++) {
        status = s->remote.encode(s->coder, &s->def, &s->picture, s->packed, s->room, &s->encoded);
    }
    return status;
}

static vd_status decode(void *user) {
    studio *s = user;
    vd_status status = vd_success();
    const int side = s->picture.width;
    for (int i = 0; i < s->turns && status.code == VD_OK; i++) {
        status = s->remote.decode(s->coder, s->encoded.codec, s->packed, s->encoded.bytes, side,
                                  side, s->back, (size_t)side);
    }
    return status;
}

/* Measures one direction; times are of one picture. */
static vd_status measure(bench_run *run, studio *s, bench_work *work, bench_result *result) {
    s->turns = 1;
    vd_status status = work(s); /* the first takes memory */
    const double start_ms = bench_wall_ms();
    if (status.code == VD_OK) {
        status = work(s);
    }
    const double once_ms = bench_wall_ms() - start_ms;
    s->turns = once_ms > 1 ? 1 : once_ms > 1e-3 ? (int)(1 / once_ms) : 1000;
    if (status.code == VD_OK) {
        status = bench_measure(run, work, s, bench_wall_ms, result);
    }
    result->median_ms /= s->turns;
    result->p99_ms /= s->turns;
    result->min_ms /= s->turns;
    return status;
}

static vd_status measure_codec(bench_run *run, const bench_case *self, studio *s, vd_codec codec) {
    bench_result results[2];
    const int side = s->picture.width;
    vd_status status = vd_success();
    s->def = (vd_encode_def){.codec = codec};
    for (int back = 0; back < 2 && status.code == VD_OK; back++) {
        bench_result *r = &results[back];
        char method[32];
        snprintf(method, sizeof method, "%s %s", s->remote.codec_name(codec),
                 back ? "decode" : "encode");
        *r = bench_result_of(self, method);
        r->at = side;
        r->isa = vd_context_isa(s->context);
        r->width = r->height = side;
        status = measure(run, s, back ? decode : encode, r);
        r->output_bytes = s->encoded.bytes;
    }
    if (status.code != VD_OK) {
        return status;
    }
    const double slower = fmax(results[0].median_ms, results[1].median_ms);
    for (int i = 0; i < 3; i++) {
        results[1].limited_ms[i] =
            fmax(slower, (double)s->encoded.bytes / links_bytes_per_s[i] * 1e3);
    }
    snprintf(results[0].note, sizeof results[0].note, "%.2f us, %zu bytes",
             results[0].median_ms * 1e3, s->encoded.bytes);
    snprintf(results[1].note, sizeof results[1].note,
             "%.2f us; 1, 10, 100 MB/s: %.3g, %.3g, %.3g ms", results[1].median_ms * 1e3,
             results[1].limited_ms[0], results[1].limited_ms[1], results[1].limited_ms[2]);
    status = bench_add(run, &results[0]);
    return status.code == VD_OK ? bench_add(run, &results[1]) : status;
}

static vd_status measure_picture(bench_run *run, const bench_case *self, bench_codec_draw *draw) {
    studio s;
    vd_status status = init_studio(&s, draw);
    run->seconds = 0.1;
    const int points = bench_sweep_points(run, self->sweep);
    for (int p = 0; p < points && status.code == VD_OK; p++) {
        status = open_side(&s, (int)self->sweep->values[p]);
        for (int codec = VD_CODEC_RAW; codec < VD_CODEC_COUNT && status.code == VD_OK; codec++) {
            status = measure_codec(run, self, &s, (vd_codec)codec);
        }
        close_side(&s);
    }
    finish_studio(&s);
    return status.code == VD_OK ? bench_add_published(run, self) : status;
}

vd_status bench_codec_tree(bench_run *run, const bench_case *self) {
    return measure_picture(run, self, draw_tree);
}

vd_status bench_codec_building(bench_run *run, const bench_case *self) {
    return measure_picture(run, self, draw_building);
}

vd_status bench_codec_particles(bench_run *run, const bench_case *self) {
    return measure_picture(run, self, draw_particles);
}
