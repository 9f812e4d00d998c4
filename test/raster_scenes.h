/* raster_scenes.h: meshes and views for the tests of triangles. */
#ifndef VEDUTA_TEST_RASTER_SCENES_H
#define VEDUTA_TEST_RASTER_SCENES_H

#include <math.h>
#include <stdio.h>
#include <veduta/veduta.h>
#include "support.h"

/* A camera whose picture space is the mesh's x and y: pixel (x, y) shows (x, y), depth 1 − z. */
static inline vd_camera flat_camera(void) {
    vd_camera camera = {.projection = VD_PROJECTION_ORTHOGRAPHIC,
                        .orientation = {0, 0, 0, 1},
                        .lens = {1, 1, 0, 0},
                        .near_m = 0x1p-20,
                        .far_m = 1.0};
    return camera;
}

/* A camera at the origin that looks along +z, x to the right, y down. */
static inline vd_camera plain_camera(int width, int height, double focal, double near_m) {
    vd_camera camera = {.projection = VD_PROJECTION_PERSPECTIVE,
                        .orientation = {0, 0, 0, 1},
                        .lens = {focal, focal, 0.5 * width, 0.5 * height},
                        .near_m = near_m};
    return camera;
}

/* A mesh of given positions [count][3]; every three are a triangle. */
static inline vd_mesh *soup(vd_context *context, const float *positions, size_t count) {
    vd_mesh_def def = vd_mesh_def_default();
    def.vertex_count = count;
    def.positions = positions;
    vd_mesh *mesh = NULL;
    assert_ok(vd_mesh_create(context, &def, &mesh));
    return mesh;
}

/* Random triangles around a picture of width × height in front of flat_camera: mostly small, some
 * slivers, some huge, some sharing corners exactly on sample positions. */
static inline void random_triangles(uint64_t *random, int width, int height, float *positions,
                                    size_t triangles) {
    for (size_t t = 0; t < triangles; t++) {
        const uint64_t kind = test_random(random) % 16;
        const double size = kind < 6 ? 3.0 : kind < 10 ? 20.0 : kind < 13 ? 150.0 : 2.0 * width;
        const double cx = test_uniform(random) * width, cy = test_uniform(random) * height;
        for (int i = 0; i < 3; i++) {
            double x = cx + (test_uniform(random) - 0.5) * size;
            double y = cy + (test_uniform(random) - 0.5) * size;
            if (kind % 4 == 1) { /* a sliver */
                y = cy + (x - cx) * 0.37 + (test_uniform(random) - 0.5) * 0.05;
            }
            if (kind % 4 == 2) { /* on the grid of centres and corners */
                x = floor(2.0 * x) / 2.0;
                y = floor(2.0 * y) / 2.0;
            }
            if (kind == 15) { /* far outside the guard band */
                x = (x - 0.5 * width) * 1000.0;
                y = (y - 0.5 * height) * 1000.0;
            }
            positions[9 * t + 3 * (size_t)i] = (float)x;
            positions[9 * t + 3 * (size_t)i + 1] = (float)y;
            positions[9 * t + 3 * (size_t)i + 2] =
                kind % 5 == 0 ? 0.5f : (float)(test_uniform(random) * 1.2 - 0.1);
        }
    }
}

/* Draws into a new frame with all planes. */
static inline vd_frame *draw_frame(vd_context *context, const vd_raster_def *def,
                                   const vd_camera *camera, const vd_draw *draws, int count,
                                   int width, int height, vd_raster_stats *stats) {
    vd_frame *frame = NULL;
    vd_raster *raster = NULL;
    assert_ok(vd_frame_create(context, width, height, VD_PLANE_DEPTH | VD_PLANE_ID, &frame));
    assert_ok(vd_raster_create(context, &raster));
    assert_ok(vd_raster_render(raster, NULL, def, camera, draws, count, frame, stats));
    vd_raster_destroy(&raster);
    return frame;
}

/* All planes of two frames are the same. */
static inline void assert_same_frames(const vd_frame *a, const vd_frame *b) {
    assert_int_equal(a->width, b->width);
    assert_int_equal(a->height, b->height);
    for (int y = 0; y < a->height; y++) {
        const size_t at = (size_t)y * a->stride;
        for (int x = 0; x < a->width; x++) {
            const size_t i = at + (size_t)x;
            if (memcmp(a->rgba + 4 * i, b->rgba + 4 * i, 4) != 0 ||
                memcmp(a->depth + i, b->depth + i, 4) != 0 || a->id[i] != b->id[i]) {
                fail_msg("pixel %d, %d: %02x%02x%02x%02x depth %.9g id %u, but %02x%02x%02x%02x "
                         "depth %.9g id %u",
                         x, y, a->rgba[4 * i], a->rgba[4 * i + 1], a->rgba[4 * i + 2],
                         a->rgba[4 * i + 3], (double)a->depth[i], a->id[i], b->rgba[4 * i],
                         b->rgba[4 * i + 1], b->rgba[4 * i + 2], b->rgba[4 * i + 3],
                         (double)b->depth[i], b->id[i]);
            }
        }
    }
}

/* Draws by every method, level and number of threads and compares with the reference; reduced, each
 * level with one number of threads. */
static inline void compare_all(const vd_raster_def *base, const vd_camera *camera,
                               const vd_draw *draws, int count, int width, int height) {
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_raster_def def = *base;
    vd_raster_stats stats;
    def.method = VD_RASTER_REFERENCE;
    vd_frame *expected = draw_frame(context, &def, camera, draws, count, width, height, &stats);
    const uint64_t hits = stats.hits;
    for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
        static const int threads[] = {1, 2, 7};
        for (int t = test_is_reduced() ? 1 + isa % 2 : 0; t < 3; t += test_is_reduced() ? 3 : 1) {
            vd_context *other = test_context(threads[t], (vd_isa)isa);
            for (int m = 0; m < VD_RASTER_REFERENCE; m++) {
                def.method = (vd_raster_method)m;
                vd_frame *frame =
                    draw_frame(other, &def, camera, draws, count, width, height, &stats);
                assert_int_equal(stats.hits, hits);
                assert_same_frames(frame, expected);
                vd_frame_destroy(&frame);
            }
            vd_context_destroy(&other);
        }
    }
    vd_frame_destroy(&expected);
    vd_context_destroy(&context);
}

/* A sphere of rings × sectors quads around the origin, with normals and texture coordinates. */
static inline vd_mesh *sphere(vd_context *context, int rings, int sectors, double radius,
                              vd_vec3 centre) {
    const size_t count = (size_t)(rings + 1) * (size_t)(sectors + 1);
    float *p = malloc(count * 3 * sizeof *p), *n = malloc(count * 3 * sizeof *n);
    float *uv = malloc(count * 2 * sizeof *uv);
    uint32_t *indices = malloc((size_t)rings * (size_t)sectors * 6 * sizeof *indices);
    size_t at = 0;
    for (int r = 0; r <= rings; r++) {
        for (int s = 0; s <= sectors; s++) {
            const size_t v = (size_t)r * (size_t)(sectors + 1) + (size_t)s;
            const double a = 3.14159265358979 * r / rings, b = 6.28318530717959 * s / sectors;
            const double d[3] = {sin(a) * cos(b), sin(a) * sin(b), cos(a)};
            const double c[3] = {centre.x, centre.y, centre.z};
            for (int i = 0; i < 3; i++) {
                p[3 * v + (size_t)i] = (float)(c[i] + radius * d[i]);
                n[3 * v + (size_t)i] = (float)d[i];
            }
            uv[2 * v] = (float)s / (float)sectors;
            uv[2 * v + 1] = (float)r / (float)rings;
            if (r < rings && s < sectors) {
                const uint32_t i = (uint32_t)v, below = i + (uint32_t)sectors + 1;
                const uint32_t quad[6] = {i, below, below + 1, i, below + 1, i + 1};
                memcpy(indices + at, quad, sizeof quad);
                at += 6;
            }
        }
    }
    vd_mesh_def def = vd_mesh_def_default();
    def.vertex_count = count;
    def.positions = p;
    def.normals = n;
    def.uvs = uv;
    def.index_count = at;
    def.indices = indices;
    vd_mesh *mesh = NULL;
    assert_ok(vd_mesh_create(context, &def, &mesh));
    free(p);
    free(n);
    free(uv);
    free(indices);
    return mesh;
}

/* A cube of side 2 · `half`, its axes the world's. */
static inline vd_mesh *test_cube(vd_context *context, float half, vd_vec3 anchor) {
    float p[24];
    for (int i = 0; i < 8; i++) {
        for (int k = 0; k < 3; k++) {
            p[3 * i + k] = (i >> k & 1) != 0 ? half : -half;
        }
    }
    static const uint32_t indices[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                         2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    vd_mesh_def def = vd_mesh_def_default();
    def.vertex_count = 8;
    def.positions = p;
    def.index_count = 36;
    def.indices = indices;
    def.anchor = anchor;
    vd_mesh *mesh = NULL;
    assert_ok(vd_mesh_create(context, &def, &mesh));
    return mesh;
}

#endif
