/* lens_scenes.h: random maps, cameras and options for the tests of the lens methods. */
#ifndef VEDUTA_TEST_LENS_SCENES_H
#define VEDUTA_TEST_LENS_SCENES_H

#include <math.h>
#include <stdio.h>
#include "core/real.h"
#include "lens_support.h"

/* ---- scenes ---------------------------------------------------------------------------------- */

enum { ROUGH, SMOOTH, WALLS, FLAT, PITS, KINDS };

static inline float height_of(uint64_t *random, int kind, int c, int r, bool holes) {
    if (holes && test_uniform(random) < 0.05) {
        return NAN;
    }
    switch (kind) {
    case ROUGH:
        return (float)between(random, 0, 12);
    case SMOOTH:
        return (float)(20 * sin(c / 7.0) * cos(r / 5.0));
    case WALLS:
        return (c / 5 + r / 7) % 2 == 0 ? 0.0f : 30.0f;
    case FLAT:
        return 4.0f;
    default:
        return test_uniform(random) < 0.1 ? -25.0f : (float)between(random, 0, 1);
    }
}

static inline vd_heightfield *random_map(vd_context *context, uint64_t *random) {
    static const int sizes[] = {2, 3, 5, 17, 33, 64, 65, 150, 257};
    const int width = sizes[pick(random, 9)], height = sizes[pick(random, 9)];
    const int kind = pick(random, KINDS);
    const bool holes = pick(random, 3) == 0;
    float *heights = vd_allocate(context, (size_t)width * (size_t)height, sizeof *heights);
    assert_non_null(heights);
    for (int r = 0; r < height; r++) {
        for (int c = 0; c < width; c++) {
            heights[r * width + c] = height_of(random, kind, c, r, holes);
        }
    }
    vd_heightfield_def def = vd_heightfield_def_default();
    def.width = width;
    def.height = height;
    def.type = VD_HEIGHT_F32;
    def.heights = heights;
    def.height_stride = (size_t)width;
    const double cell = between(random, 0.5, 8),
                 turn = pick(random, 3) == 0 ? between(random, -3, 3) : 0;
    const double x = pick(random, 4) == 0 ? 1e6 : -0.5 * cell * width;
    const double m[6] = {x,
                         cell * cos(turn),
                         cell * 1.3 * sin(turn),
                         0.5 * cell * height,
                         cell * sin(turn),
                         -cell * 1.3 * cos(turn)};
    memcpy(def.world_from_sample, m, sizeof m);
    vd_picture *colors = NULL;
    if (pick(random, 2) == 0) {
        assert_ok(
            vd_picture_create(context, 1 + pick(random, 90), 1 + pick(random, 90), 3, 8, &colors));
        uint8_t *bytes = colors->data;
        for (size_t i = 0; i < colors->stride_bytes * (size_t)colors->height; i++) {
            bytes[i] = (uint8_t)test_random(random);
        }
        def.colors = colors;
    }
    vd_heightfield *map = NULL;
    assert_ok(vd_heightfield_create(context, &def, &map));
    vd_picture_destroy(&colors);
    vd_release(context, heights);
    return map;
}

static inline vd_vec3 world_of(const vd_heightfield *map, double column, double row, double z) {
    const double *m = map->world_from_sample;
    return vd_vec3_make(m[0] + column * m[1] + row * m[2], m[3] + column * m[4] + row * m[5], z);
}

/* Level, steep, rolled, straight down, on samples and along rows, under ground, far away. */
static inline vd_camera random_camera(const vd_heightfield *map, uint64_t *random, int width,
                                      int height) {
    vd_camera camera;
    memset(&camera, 0, sizeof camera);
    const int kind = pick(random, 8);
    double column = between(random, -0.7, 1.7) * map->width;
    double row = between(random, -0.7, 1.7) * map->height;
    double z = between(random, -5, 60), pitch = between(random, -1.5, 0.4);
    double heading = between(random, 0, 6.3),
           roll = pick(random, 3) == 0 ? between(random, -3, 3) : 0;
    if (kind == 0) { /* on a sample, along the axes */
        column = floor(column), row = floor(row);
        heading = pick(random, 4) * 0.5 * VD_PI;
        pitch = 0;
        roll = 0;
    } else if (kind == 1) {
        pitch = -0.5 * VD_PI;
        z += 60;
    } else if (kind == 2) { /* from far away */
        column += between(random, -20, 20) * map->width;
        z = between(random, 10, 2000);
    }
    camera.eye = world_of(map, column, row, z);
    camera.orientation = vd_orientation_from_angles(heading, pitch, roll);
    if (kind >= 4) { /* over the map */
        column = between(random, 0, 1) * map->width, row = between(random, 0, 1) * map->height;
        z = between(random, 15, 60);
        camera.eye = world_of(map, column, row, z);
    }
    if (kind == 2 || kind == 3) {
        const vd_vec3 target = world_of(map, 0.5 * map->width, 0.5 * map->height, 0);
        camera.orientation = vd_orientation_look_at(camera.eye, target);
    }
    camera.lens = vd_lens_from_fov(between(random, kind == 2 ? 0.01 : 0.2, 2), width, height);
    camera.lens.cx += pick(random, 3) == 0 ? between(random, -40, 40) : 0;
    camera.lens.fx *= pick(random, 3) == 0 ? between(random, 0.5, 2) : 1;
    camera.near_m = pick(random, 3) == 0 ? between(random, 0.01, 30) : 0.1;
    if (pick(random, 5) == 0) {
        camera.projection = VD_PROJECTION_ORTHOGRAPHIC;
        camera.lens.fx = camera.lens.fy = between(random, 0.2, 8);
        camera.far_m = between(random, 100, 3000) + camera.near_m;
    }
    return camera;
}

static inline vd_terrain_def random_def(const vd_heightfield *map, const vd_colormap *colormap,
                                        uint64_t *random) {
    vd_terrain_def def = vd_terrain_def_default();
    def.heightfield = map;
    def.colormap = pick(random, 2) == 0 ? colormap : NULL;
    def.light = vd_light_daylight(between(random, 0, 6.3), between(random, -0.1, 1.5));
    def.light.haze_m = pick(random, 2) == 0 ? between(random, 10, 5000) : 0;
    def.filter = (vd_filter)pick(random, VD_FILTER_COUNT);
    def.mip = pick(random, 3) != 0;
    def.samples = (int[]){1, 4, 8}[pick(random, 3)];
    def.antialias = pick(random, 4) == 0 ? VD_ANTIALIAS_EVERYWHERE : VD_ANTIALIAS_EDGES;
    def.exaggeration = pick(random, 3) == 0 ? between(random, 0.2, 5) : 1;
    def.shading = pick(random, 4) != 0;
    def.shadows = pick(random, 2) == 0;
    def.curvature = pick(random, 3) == 0;
    def.sky = pick(random, 3) != 0;
    def.background = (vd_rgba8){200, 100, 50, (uint8_t)pick(random, 256)};
    if (pick(random, 4) == 0) {
        def.window.column = pick(random, map->width - 1);
        def.window.row = pick(random, map->height - 1);
        def.window.columns = 1 + pick(random, map->width - 1 - def.window.column);
        def.window.rows = 1 + pick(random, map->height - 1 - def.window.row);
    }
    return def;
}

#endif
