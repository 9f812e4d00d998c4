/* What must hold of pictures of triangles: watertight fill, what a ray would see, interpolation,
 * clipping, composition with what is there, bad input. */
#include "raster/raster_internal.h"
#include "raster_scenes.h"

/* ---- coverage ---------------------------------------------------------------------------------*/

/* The hits of one picture of all triangles, and the sum of those of each alone. */
static void count_hits(vd_context *context, const float *positions, size_t triangles,
                       const vd_camera *camera, int samples, int size, uint64_t *together,
                       uint64_t *apart) {
    vd_raster_def def = vd_raster_def_default();
    def.samples = samples;
    vd_draw draw = vd_draw_default();
    draw.cull = VD_CULL_NONE;
    draw.shader = vd_shader_find(VD_SHADING_ID);
    vd_raster *raster = NULL;
    vd_frame *frame = NULL;
    vd_raster_stats stats;
    assert_ok(vd_raster_create(context, &raster));
    assert_ok(vd_frame_create(context, size, size, 0, &frame));
    *apart = 0;
    for (size_t t = 0; t <= triangles; t++) {
        const bool all = t == triangles;
        vd_mesh *mesh = soup(context, positions + (all ? 0 : 9 * t), all ? 3 * triangles : 3);
        draw.mesh = mesh;
        assert_ok(vd_raster_render(raster, NULL, &def, camera, &draw, 1, frame, &stats));
        *apart += all ? 0 : stats.hits;
        *together = stats.hits;
        vd_mesh_destroy(context, &mesh);
    }
    vd_frame_destroy(&frame);
    vd_raster_destroy(&raster);
}

/* A grid of n × n quads that covers more than the picture, its inner points moved about, some onto
 * centres and corners of pixels. */
static size_t make_grid(uint64_t *random, int n, int size, double depth, float *out) {
    enum { MOST = 21 };
    float p[MOST][MOST][3];
    for (int j = 0; j <= n; j++) {
        for (int i = 0; i <= n; i++) {
            const double step = 1.2 * size / n;
            double x = -0.1 * size + i * step, y = -0.1 * size + j * step;
            if (i > 0 && i < n && j > 0 && j < n) {
                x += (test_uniform(random) - 0.5) * 0.6 * step;
                y += (test_uniform(random) - 0.5) * 0.6 * step;
            }
            if (test_random(random) % 2 == 0) {
                x = floor(2 * x) / 2;
                y = floor(2 * y) / 2;
            }
            p[j][i][0] = (float)x;
            p[j][i][1] = (float)y;
            p[j][i][2] = (float)depth;
        }
    }
    size_t count = 0;
    for (int j = 0; j < n; j++) {
        for (int i = 0; i < n; i++) {
            const float *q[6] = {p[j][i],     p[j + 1][i], p[j][i + 1],
                                 p[j][i + 1], p[j + 1][i], p[j + 1][i + 1]};
            for (int k = 0; k < 6; k++) {
                memcpy(out + 3 * count++, q[k], 3 * sizeof(float));
            }
        }
    }
    return count / 3;
}

static void a_mesh_is_watertight(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    static float positions[20 * 20 * 2 * 9];
    const vd_camera camera = flat_camera();
    static const int samples[] = {1, 4, 8};
    uint64_t random = 5;
    for (int round = 0; round < (test_is_reduced() ? 3 : 9); round++) {
        const int size = 30 + 37 * (round % 4), n = 4 + 2 * round % 17;
        const size_t triangles = make_grid(&random, n, size, 0.5, positions);
        uint64_t together, apart;
        count_hits(context, positions, triangles, &camera, samples[round % 3], size, &together,
                   &apart);
        assert_int_equal(together, (uint64_t)size * (uint64_t)size * (uint64_t)samples[round % 3]);
        assert_int_equal(apart, together);
    }
    vd_context_destroy(&context);
}

/* Around a centre, seen through the near plane: the fan's triangles are clipped, and still fit. */
static void a_clipped_fan_is_watertight(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    float positions[24 * 9];

    for (int round = 0; round < 20; round++) {
        for (int i = 0; i < 24; i++) {
            for (int k = 0; k < 2; k++) {
                const double a = (i + k) * 6.283185307179586 / 24;
                float *p = positions + 9 * i + 3 + 3 * k;
                p[0] = (float)(40 * cos(a));
                p[1] = (float)(40 * sin(a));
                p[2] = (float)(2 + 30 * sin(a + round)); /* some behind the eye */
            }
            positions[9 * i] = 0.3f;
            positions[9 * i + 1] = -0.2f;
            positions[9 * i + 2] = 5.0f;
        }
        const vd_camera camera = plain_camera(80, 80, 50.0, 0.7);
        uint64_t together, apart;
        count_hits(context, positions, 24, &camera, 4, 80, &together, &apart);
        assert_true(together > 1000);
        assert_int_equal(apart, together);
    }
    vd_context_destroy(&context);
}

/* A million triangles in pictures of 64, by the fast method and by brute force. */
static void a_million_triangles_agree(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    enum { BATCH = 64, SIZE = 32 };
    float positions[BATCH * 9];
    vd_raster *raster = NULL;
    vd_frame *frames[2] = {NULL, NULL};
    assert_ok(vd_raster_create(context, &raster));
    for (int i = 0; i < 2; i++) {
        assert_ok(vd_frame_create(context, SIZE, SIZE, VD_PLANE_DEPTH | VD_PLANE_ID, &frames[i]));
    }
    const vd_camera camera = flat_camera();
    vd_raster_def def = vd_raster_def_default();
    def.tile_pixels = SIZE;
    uint64_t random = 8;
    for (int batch = 0; batch < (test_is_reduced() ? 200 : 1000000 / BATCH); batch++) {
        random_triangles(&random, SIZE, SIZE, positions, BATCH);
        vd_mesh *mesh = soup(context, positions, BATCH * 3);
        vd_draw draw = vd_draw_default();
        draw.mesh = mesh;
        draw.cull = batch % 2 == 0 ? VD_CULL_NONE : VD_CULL_BACK;
        draw.shader = vd_shader_find(VD_SHADING_ID);
        for (int i = 0; i < 2; i++) {
            def.method = i == 0 ? VD_RASTER_REFERENCE : VD_RASTER_TILED;
            assert_ok(vd_raster_render(raster, NULL, &def, &camera, &draw, 1, frames[i], NULL));
        }
        assert_same_frames(frames[1], frames[0]);
        vd_mesh_destroy(context, &mesh);
    }
    for (int i = 0; i < 2; i++) {
        vd_frame_destroy(&frames[i]);
    }
    vd_raster_destroy(&raster);
    vd_context_destroy(&context);
}

/* The corners of a picture of 16384², without the picture. */
static void huge_pictures_agree(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    enum { SIZE = 16384, TRIANGLES = 300 };
    static float positions[TRIANGLES * 9];
    uint64_t random = 9;
    for (size_t i = 0; i < TRIANGLES * 3; i++) {
        const double reach = i % 2 == 0 ? 1.0 : 3.0;
        positions[3 * i] = (float)((test_uniform(&random) - 0.5) * reach * SIZE + 0.5 * SIZE);
        positions[3 * i + 1] = (float)((test_uniform(&random) - 0.5) * reach * SIZE + 0.5 * SIZE);
        positions[3 * i + 2] = (float)test_uniform(&random);
    }
    vd_mesh *mesh = soup(context, positions, TRIANGLES * 3);
    vd_draw draw = vd_draw_default();
    draw.mesh = mesh;
    draw.cull = VD_CULL_NONE;
    draw.shader = vd_shader_find(VD_SHADING_ID);
    const vd_camera camera = flat_camera();
    vd_target *targets[2] = {NULL, NULL};
    for (int i = 0; i < 2; i++) {
        vd_raster *raster = NULL;
        assert_ok(vd_raster_create(context, &raster));
        assert_ok(vd_target_create(context, 96, 96, 1, &targets[i]));
        vd_frame *picture = NULL;
        assert_ok(vd_frame_create(context, SIZE, SIZE, 0, &picture));
        vd_raster_def def = vd_raster_def_default();
        def.method = i == 0 ? VD_RASTER_REFERENCE : VD_RASTER_TILED;
        assert_ok(vd_raster_prepare(raster, NULL, &def, &camera, &draw, 1, picture));
        vd_target_clear(targets[i], (uint16_t[4]){0, 0, 0, 0});
        vd_target *t = targets[i];
        for (int corner = 0; corner < 4; corner++) { /* one over the other, by depth */
            t->x = corner % 2 == 0 ? 32 : SIZE - 96;
            t->y = corner / 2 == 0 ? 0 : SIZE - 96;
            vd_raster_draw(raster, t, 0);
        }
        vd_raster_destroy(&raster);
        vd_frame_destroy(&picture);
    }
    assert_memory_equal(targets[0]->depth, targets[1]->depth, targets[0]->plane * 4);
    assert_memory_equal(targets[0]->id, targets[1]->id, targets[0]->plane * 4);
    assert_memory_equal(targets[0]->color, targets[1]->color, targets[0]->plane * 8);
    vd_target_destroy(&targets[0]);
    vd_target_destroy(&targets[1]);
    vd_mesh_destroy(context, &mesh);
    vd_context_destroy(&context);
}

/* ---- what a ray sees --------------------------------------------------------------------------*/

/* Where a fragment function of the tests writes what it was given. */
typedef struct record {
    int width;
    float *values; /* [height][width][4]: three varyings, w */
} record;

static void record_fragments(const vd_fragments *f) {
    const record *r = f->uniforms;
    for (int i = 0; i < VD_BATCH; i++) {
        if ((f->mask >> i & 1) != 0) {
            float *to = r->values + 4 * ((size_t)f->y[i] * (size_t)r->width + (size_t)f->x[i]);
            for (int k = 0; k < 3; k++) {
                to[k] = f->varyings[k][i];
            }
            to[3] = f->w[i];
        }
    }
}

static const vd_shader recorder = {.fragment = record_fragments, .inputs = VD_INPUT_EXTRA};

/* The distance along the view axis at which the ray through (x, y) meets a triangle's plane, and
 * how far inside it is, as the least of its shares. */
static double cast(const float *t, double x, double y, const vd_camera *camera, double *inside) {
    const vd_vec3 d = {(x - camera->lens.cx) / camera->lens.fx,
                       (y - camera->lens.cy) / camera->lens.fy, 1.0};
    const vd_vec3 a = {(double)t[0], (double)t[1], (double)t[2]};
    const vd_vec3 u = vd_vec3_subtract(vd_vec3_make((double)t[3], (double)t[4], (double)t[5]), a);
    const vd_vec3 v = vd_vec3_subtract(vd_vec3_make((double)t[6], (double)t[7], (double)t[8]), a);
    const vd_vec3 n = vd_vec3_cross(u, v);
    const double z = vd_vec3_dot(n, a) / vd_vec3_dot(n, d), n2 = vd_vec3_dot(n, n);
    const vd_vec3 p = vd_vec3_subtract(vd_vec3_scale(d, z), a);
    const double b1 = vd_vec3_dot(n, vd_vec3_cross(p, v)) / n2;
    const double b2 = vd_vec3_dot(n, vd_vec3_cross(u, p)) / n2;
    const double b0 = 1.0 - b1 - b2;
    *inside = b0 < b1 ? b0 : b1;
    *inside = b2 < *inside ? b2 : *inside;
    return z;
}

/* Triangles, many of them through the near plane, against rays: coverage but for a rim, depth, and
 * the position itself as a varying. */
static void rays_see_the_same(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    enum { SIZE = 48 };
    const vd_camera camera = plain_camera(SIZE, SIZE, 40.0, 0.5);
    static float values[SIZE * SIZE * 4];
    record r = {SIZE, values};
    uint64_t random = 10, checked = 0, clipped = 0;
    for (int round = 0; round < 300; round++) {
        float t[9];
        for (int i = 0; i < 9; i++) {
            t[i] = (float)((test_uniform(&random) - 0.5) * 6 + (i % 3 == 2 ? 1.5 : 0));
        }
        vd_mesh_def mesh_def = vd_mesh_def_default();
        mesh_def.vertex_count = 3;
        mesh_def.positions = t;
        mesh_def.extra = t;
        mesh_def.extra_count = 3;
        vd_mesh *mesh = NULL;
        assert_ok(vd_mesh_create(context, &mesh_def, &mesh));
        vd_draw draw = vd_draw_default();
        draw.mesh = mesh;
        draw.cull = VD_CULL_NONE;
        draw.shader = &recorder;
        draw.uniforms = &r;
        vd_raster_def def = vd_raster_def_default();
        vd_raster_stats stats;
        vd_frame *frame = draw_frame(context, &def, &camera, &draw, 1, SIZE, SIZE, &stats);
        clipped += stats.clipped;
        for (int y = 0; y < SIZE; y++) {
            for (int x = 0; x < SIZE; x++) {
                double inside;
                const double z = cast(t, x + 0.5, y + 0.5, &camera, &inside);
                const bool hit = frame->id[(size_t)y * frame->stride + (size_t)x] != 0;
                if (fabs(inside) < 0.02 || fabs(z - 0.5) < 0.02) {
                    continue; /* the rim, where snapping decides */
                }
                assert_int_equal(hit, inside > 0 && z > 0.5);
                if (!hit) {
                    continue;
                }
                checked++;
                const float *v = values + 4 * ((size_t)y * SIZE + (size_t)x);
                const double tolerance = 0.02 * z; /* a steep triangle's share of a subpixel */
                assert_true(fabs((double)v[3] - z) < tolerance);
                const double expected[3] = {(x + 0.5 - 24) / 40 * z, (y + 0.5 - 24) / 40 * z, z};
                for (int k = 0; k < 3; k++) {
                    assert_true(fabs((double)v[k] - expected[k]) < 2 * tolerance);
                }
            }
        }
        vd_frame_destroy(&frame);
        vd_mesh_destroy(context, &mesh);
    }
    assert_true(checked > 20000 && clipped > 50);
    vd_context_destroy(&context);
}

/* At a corner on a pixel's centre an attribute is the corner's, to 4 units in the last place. */
static void corners_have_their_attributes(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    enum { SIZE = 64 };
    static float values[SIZE * SIZE * 4];
    record r = {SIZE, values};
    uint64_t random = 11;
    for (int round = 0; round < 200; round++) {
        float p[9], extra[9];
        for (int i = 0; i < 9; i++) {
            p[i] = i % 3 == 2 ? 0.5f : (float)(test_random(&random) % SIZE) + 0.5f;
            extra[i] = (float)(test_uniform(&random) * 100 + 1);
        }
        vd_mesh_def mesh_def = vd_mesh_def_default();
        mesh_def.vertex_count = 3;
        mesh_def.positions = p;
        mesh_def.extra = extra;
        mesh_def.extra_count = 3;
        vd_mesh *mesh = NULL;
        assert_ok(vd_mesh_create(context, &mesh_def, &mesh));
        vd_draw draw = vd_draw_default();
        draw.mesh = mesh;
        draw.cull = VD_CULL_NONE;
        draw.shader = &recorder;
        draw.uniforms = &r;
        const vd_camera camera = flat_camera();
        vd_raster_def def = vd_raster_def_default();
        vd_frame *frame = draw_frame(context, &def, &camera, &draw, 1, SIZE, SIZE, NULL);
        for (int i = 0; i < 3; i++) {
            const size_t x = (size_t)p[3 * i], y = (size_t)p[3 * i + 1];
            if (frame->id[y * frame->stride + x] == 0) {
                continue; /* not its corner by the fill rule */
            }
            for (int k = 0; k < 3; k++) {
                const float wanted = extra[3 * i + k];
                const float got = values[4 * (y * SIZE + x) + (size_t)k];
                const float largest = fmaxf(fmaxf(extra[k], extra[3 + k]), extra[6 + k]);
                assert_true(fabsf(got - wanted) <= 4 * (nextafterf(largest, 1e9f) - largest));
            }
        }
        vd_frame_destroy(&frame);
        vd_mesh_destroy(context, &mesh);
    }
    vd_context_destroy(&context);
}

/* ---- clipping ---------------------------------------------------------------------------------*/

static double polygon_area(double (*p)[4], int count) {
    double twice = 0;
    for (int i = 2; i < count; i++) {
        const double x1 = p[i - 1][0] - p[0][0], y1 = p[i - 1][1] - p[0][1];
        const double x2 = p[i][0] - p[0][0], y2 = p[i][1] - p[0][1];
        twice += x1 * y2 - x2 * y1;
    }
    return 0.5 * fabs(twice);
}

/* In parallel projection the sides of the guard band are those of a square; the area of what is
 * left is that of the parts that are cut off, taken away. */
static void clipping_keeps_the_area(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_mesh *mesh = soup(context, (float[9]){0}, 3);
    vd_draw draw = vd_draw_default();
    draw.mesh = mesh;
    const vd_camera camera = flat_camera();
    const vd_raster_def def = vd_raster_def_default();
    vd_drawing drawing;
    assert_ok(vd_drawing_init(&drawing, &draw, &def, &camera, 100, 100));
    uint64_t random = 12;
    int seen[VD_CLIP_MAX + 1] = {0};
    for (int round = 0; round < 20000; round++) {
        double p[VD_CLIP_MAX][4];
        int vertex[VD_CLIP_MAX] = {0, 1, 2};
        const double reach = round % 3 == 0 ? 50000 : 300000;
        for (int i = 0; i < 3; i++) {
            p[i][0] = (test_uniform(&random) - 0.5) * reach + (round % 7 == 0 ? 70000 : 0);
            p[i][1] = (test_uniform(&random) - 0.5) * reach;
            p[i][2] = test_uniform(&random) * 1.6 - 0.3;
            p[i][3] = 1.0;
        }
        double whole[VD_CLIP_MAX][4];
        memcpy(whole, p, sizeof whole);
        const int count = vd_clip_polygon(&drawing, p, vertex, 3);
        assert_true(count == 0 || (count >= 3 && count <= 9));
        seen[count]++;
        assert_true(polygon_area(p, count) <= polygon_area(whole, 3) * (1 + 1e-9));
        for (int i = 0; i < count; i++) {
            assert_true(fabs(p[i][0] - 50) <= VD_GUARD_PIXELS * (1 + 1e-9));
            assert_true(fabs(p[i][1] - 50) <= VD_GUARD_PIXELS * (1 + 1e-9));
            assert_true(p[i][2] <= 1 + 1e-9 && p[i][2] >= -1e-9);
            assert_true(vertex[i] < 0 || memcmp(p[i], whole[vertex[i]], sizeof p[i]) == 0);
        }
        /* A clipped polygon is left as it is. */
        double again[VD_CLIP_MAX][4];
        memcpy(again, p, sizeof again);
        for (int i = 0; i < count; i++) { /* what rounding left outside */
            again[i][0] = 50 + (again[i][0] - 50) * (1 - 1e-9);
            again[i][1] = 50 + (again[i][1] - 50) * (1 - 1e-9);
            again[i][2] = again[i][2] * (1 - 1e-6) + 1e-7;
        }
        assert_int_equal(vd_clip_polygon(&drawing, again, vertex, count), count);
    }
    for (int count = 3; count <= 7; count++) {
        assert_true(seen[count] > 0);
    }
    assert_true(seen[0] > 0);
    vd_mesh_destroy(context, &mesh);
    vd_context_destroy(&context);
}

static void lines_are_clipped(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_mesh *mesh = soup(context, (float[9]){0}, 3);
    vd_draw draw = vd_draw_default();
    draw.mesh = mesh;
    const vd_camera camera = plain_camera(100, 100, 50, 1.0);
    const vd_raster_def def = vd_raster_def_default();
    vd_drawing drawing;
    assert_ok(vd_drawing_init(&drawing, &draw, &def, &camera, 100, 100));
    double t[2];
    const double front[4] = {100, 100, 1, 4}, back[4] = {-100, 0, 1, -2}, other[4] = {0, 0, 1, 0.5};
    assert_true(vd_clip_line(&drawing, front, back, t)); /* the near plane is at w = 1: half way */
    assert_true(t[0] == 0.0 && fabs(t[1] - 0.5) < 1e-12);
    assert_true(vd_clip_line(&drawing, back, front, t));
    assert_true(fabs(t[0] - 0.5) < 1e-12 && t[1] == 1.0);
    assert_false(vd_clip_line(&drawing, back, other, t));
    assert_true(vd_clip_line(&drawing, front, front, t));
    vd_mesh_destroy(context, &mesh);
    vd_context_destroy(&context);
}

/* ---- composition ------------------------------------------------------------------------------*/

static void what_is_nearer_stays(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_mesh *mesh = sphere(context, 20, 40, 1.0, vd_vec3_make(0, 0, 4));
    vd_draw draw = vd_draw_default();
    draw.mesh = mesh;
    draw.object_id = 7;
    draw.shader = vd_shader_find(VD_SHADING_NORMALS);
    const vd_camera camera = plain_camera(100, 80, 90.0, 0.1);
    vd_raster *raster = NULL;
    vd_target *target = NULL;
    vd_frame *frame = NULL;
    vd_raster_def def = vd_raster_def_default();
    def.samples = 4;
    assert_ok(vd_raster_create(context, &raster));
    assert_ok(vd_target_create(context, 37, 41, 4, &target));
    assert_ok(vd_frame_create(context, 100, 80, 0, &frame));
    assert_ok(vd_raster_prepare(raster, NULL, &def, &camera, &draw, 1, frame));
    target->x = 45;
    target->y = 20;
    vd_target_clear(target, (uint16_t[4]){1, 2, 3, 65535});
    for (size_t i = 0; i < 4 * target->plane; i++) {
        target->depth[i] = i % 2 == 0 ? 0.1f / 3.5f : 0.0f; /* every other sample: before it all */
        target->id[i] = 5;
    }
    /* The sphere's front is at 3, its rim at 3.75: it shows before 3.5 and where there was nothing.
     */
    vd_raster_draw(raster, target, 0);
    int before = 0, after = 0, shown = 0;
    for (int s = 0; s < 4; s++) {
        for (int y = 0; y < 41; y++) {
            for (int x = 0; x < 37; x++) {
                const size_t i = (size_t)s * target->plane + (size_t)y * target->stride + (size_t)x;
                const bool mine = target->id[i] == 1;
                const bool had = i % 2 == 0;
                shown += mine && !had;
                before += mine && had;
                after += !mine && had;
                assert_true(!mine || !had || target->depth[i] > 0.1f / 3.5f);
                assert_true(mine || target->color[4 * i] == 1);
            }
        }
    }
    assert_true(before > 100 && after > 100 && shown > before);
    assert_true(frame->object_ids[1] == 7);
    vd_frame_destroy(&frame);
    vd_target_destroy(&target);
    vd_raster_destroy(&raster);
    vd_mesh_destroy(context, &mesh);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_mesh_is_watertight),
        cmocka_unit_test(a_clipped_fan_is_watertight),
        cmocka_unit_test(a_million_triangles_agree),
        cmocka_unit_test(huge_pictures_agree),
        cmocka_unit_test(rays_see_the_same),
        cmocka_unit_test(corners_have_their_attributes),
        cmocka_unit_test(clipping_keeps_the_area),
        cmocka_unit_test(lines_are_clipped),
        cmocka_unit_test(what_is_nearer_stays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
