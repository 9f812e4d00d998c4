/* classic_samples.c: the option samples: edges from several pictures.
 *
 * Any method draws the pictures: first the one with one sample, which tells where edges are, then
 * one for each sample, of which only the pixels at edges are read. That costs S + 1 pictures, and
 * is exact for every method and thread count because each of the pictures is. */
#include <string.h>
#include <veduta/target.h>
#include "core/core.h"
#include "terrain/classic_internal.h"

typedef struct post {
    const vd_classic_resolver *resolver;
    const vd_frame *single; /* with depth */
    const uint8_t *rgba;    /* of the picture to add */
    int samples;
} post;

static bool is_edge(float a, float b) {
    return a > b * 1.125f || b > a * 1.125f; /* background has depth 0 */
}

/* Clears a row's sums and marks its edges. */
static void find_edges(void *user, int row, int worker) {
    (void)worker;
    const post *p = user;
    const vd_frame *frame = p->single;
    const size_t first = (size_t)row * frame->stride;
    const float *here = frame->depth + first;
    const float *up = row > 0 ? here - frame->stride : here;
    const float *down = row + 1 < frame->height ? here + frame->stride : here;
    uint16_t *sums = p->resolver->sums + 4 * first;
    for (int i = 0; i < frame->width; i++) {
        const float d = here[i];
        const bool edge = is_edge(d, up[i]) || is_edge(d, down[i]) ||
                          (i > 0 && is_edge(d, here[i - 1])) ||
                          (i + 1 < frame->width && is_edge(d, here[i + 1]));
        memset(sums + 4 * i, 0, 4 * sizeof *sums);
        sums[4 * i + 3] = edge;
    }
}

static void add(void *user, int row, int worker) {
    (void)worker;
    const post *p = user;
    const size_t first = (size_t)row * p->single->stride;
    uint16_t *sums = p->resolver->sums + 4 * first;
    const uint8_t *rgba = p->rgba + 4 * first;
    for (int i = 0; i < p->single->width; i++) {
        for (int channel = 0; channel < 3 && sums[4 * i + 3] != 0; channel++) {
            sums[4 * i + channel] = (uint16_t)(sums[4 * i + channel] + rgba[4 * i + channel]);
        }
    }
}

static void take_mean(void *user, int row, int worker) {
    (void)worker;
    const post *p = user;
    const size_t first = (size_t)row * p->single->stride;
    const uint16_t *sums = p->resolver->sums + 4 * first;
    uint8_t *rgba = p->single->rgba + 4 * first;
    for (int i = 0; i < p->single->width; i++) {
        for (int channel = 0; channel < 3 && sums[4 * i + 3] != 0; channel++) {
            rgba[4 * i + channel] =
                (uint8_t)((sums[4 * i + channel] + p->samples / 2) / p->samples);
        }
    }
}

static vd_status reserve(vd_context *context, vd_classic_resolver *resolver, size_t pixels) {
    if (pixels <= resolver->pixels) {
        return vd_success();
    }
    vd_classic_resolver_finish(context, resolver);
    resolver->rgba = vd_allocate(context, pixels, 4);
    resolver->depth = vd_allocate(context, pixels, sizeof *resolver->depth);
    resolver->sums = vd_allocate(context, pixels, 4 * sizeof *resolver->sums);
    if (resolver->rgba == NULL || resolver->depth == NULL || resolver->sums == NULL) {
        vd_classic_resolver_finish(context, resolver);
        return vd_out_of_memory("a picture for each sample", pixels * 16);
    }
    resolver->pixels = pixels;
    return vd_success();
}

void vd_classic_resolver_finish(vd_context *context, vd_classic_resolver *resolver) {
    vd_release(context, resolver->rgba);
    vd_release(context, resolver->depth);
    vd_release(context, resolver->sums);
    memset(resolver, 0, sizeof *resolver);
}

/* Draws the pictures of the samples into the resolver and adds them up. */
static vd_status add_samples(vd_context *context, post *p, const vd_classic_def *def,
                             vd_classic_draw_view *draw, void *user) {
    const float(*offsets)[2] = vd_sample_offsets(p->samples);
    vd_frame frame = *p->single;
    frame.rgba = p->resolver->rgba;
    frame.depth = NULL;
    frame.id = NULL;
    vd_status status = vd_parallel_for(context, NULL, frame.height, find_edges, p);
    for (int i = 0; i < p->samples && status.code == VD_OK; i++) {
        const vd_classic_view view = {def, offsets[i][0] - 0.5, 0.5 - offsets[i][1], &frame};
        status = draw(user, &view);
        if (status.code == VD_OK) {
            status = vd_parallel_for(context, NULL, frame.height, add, p);
        }
    }
    return status.code == VD_OK ? vd_parallel_for(context, NULL, frame.height, take_mean, p)
                                : status;
}

vd_status vd_classic_resolve(vd_context *context, vd_classic_resolver *resolver,
                             const vd_classic_def *def, vd_frame *frame, vd_classic_draw_view *draw,
                             void *user) {
    const vd_classic_view view = {def, 0.0, 0.0, frame};
    if (def->samples <= 1) {
        return draw(user, &view);
    }
    vd_status status = reserve(context, resolver, frame->stride * (size_t)frame->height);
    if (status.code != VD_OK) {
        return status;
    }
    vd_frame deep = *frame;
    deep.depth = frame->depth != NULL ? frame->depth : resolver->depth;
    const vd_classic_view single = {def, 0.0, 0.0, &deep};
    status = draw(user, &single);
    if (status.code == VD_OK) {
        post p = {resolver, &deep, resolver->rgba, def->samples};
        vd_classic_set_objects(frame);
        status = add_samples(context, &p, def, draw, user);
    }
    return status;
}
