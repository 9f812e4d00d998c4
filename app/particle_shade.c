/* particle_shade.c: eye-dome lighting.
 *
 * Where the published response is the sum of logarithms of ratios of distances, this takes 1 less
 * the ratio, which is the same where it matters, and 1 / (1 + r) in place of exp(−r): no functions
 * whose last bit differs between machines. */
#include "particle_shade.h"

typedef struct shading {
    const vd_frame *frame;
    const float *distance; /* [height][width]; 0: background */
    int reach;             /* pixels to the neighbours */
} shading;

static float response(const shading *s, int x, int y) {
    static const int around[8][2] = {{1, 0},  {1, 1},   {0, 1},  {-1, 1},
                                     {-1, 0}, {-1, -1}, {0, -1}, {1, -1}};
    const int width = s->frame->width, height = s->frame->height;
    const float own = s->distance[(size_t)y * (size_t)width + (size_t)x];
    float sum = 0.0f;
    for (int i = 0; i < 8; i++) {
        const int nx = x + s->reach * around[i][0], ny = y + s->reach * around[i][1];
        if (nx < 0 || nx >= width || ny < 0 || ny >= height) {
            continue;
        }
        const float other = s->distance[(size_t)ny * (size_t)width + (size_t)nx];
        if (other > 0.0f && other < own) {
            const float nearer = 1.0f - other / own;
            sum += nearer < 0.02f ? nearer : 0.02f; /* what stands far in front is one edge */
        }
    }
    return sum * 0.125f;
}

static void shade_row(void *user, int y, int worker) {
    (void)worker;
    const shading *s = user;
    const vd_frame *f = s->frame;
    for (int x = 0; x < f->width; x++) {
        if (s->distance[(size_t)y * (size_t)f->width + (size_t)x] <= 0.0f) {
            continue;
        }
        const float light = 1.0f / (1.0f + 150.0f * response(s, x, y));
        uint8_t *pixel = f->rgba + 4 * ((size_t)y * f->stride + (size_t)x);
        for (int c = 0; c < 3; c++) {
            pixel[c] = (uint8_t)(light * (float)pixel[c] + 0.5f);
        }
    }
}

vd_status vd_particle_shade(vd_context *context, vd_frame *frame, const vd_camera *camera) {
    const size_t width = (size_t)frame->width, height = (size_t)frame->height;
    float *distance = vd_allocate(context, width * height, sizeof *distance);
    if (distance == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory for shading");
    }
    for (size_t y = 0; y < height; y++) {
        for (size_t x = 0; x < width; x++) {
            const float depth = frame->depth[y * frame->stride + x];
            distance[y * width + x] =
                depth > 0.0f ? (float)vd_camera_distance(camera, depth) : 0.0f;
        }
    }
    shading s = {frame, distance, 1 + frame->height / 720};
    vd_status status = vd_parallel_for(context, NULL, frame->height, shade_row, &s);
    vd_release(context, distance);
    return status;
}
