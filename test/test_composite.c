/* Terrain and meshes in one target, sample by sample, against rays. */
#include "image/image.h"
#include "raster_scenes.h"

enum { WIDTH = 120, HEIGHT = 90, CELLS = 65 };

/* z = 1 + x / 4 − y / 8 over 64 m, straight, so that every cell of it is a plane. */
static vd_heightfield *slope(vd_context *context) {
    static float heights[CELLS * CELLS];
    for (int r = 0; r < CELLS; r++) {
        for (int c = 0; c < CELLS; c++) {
            heights[r * CELLS + c] = 1.0f + (float)(c - 32) * 0.25f - (float)(32 - r) * 0.125f;
        }
    }
    vd_heightfield_def def = vd_heightfield_def_default();
    def.width = def.height = def.height_stride = CELLS;
    def.type = VD_HEIGHT_F32;
    def.heights = heights;
    const double place[6] = {-32, 1, 0, 32, 0, -1};
    memcpy(def.world_from_sample, place, sizeof place);
    vd_heightfield *map = NULL;
    assert_ok(vd_heightfield_create(context, &def, &map));
    return map;
}

/* A cube of side 8 around the origin, its corners turned by no angle that is kind to pixels. */
static const double cube_half = 4.0;

static vd_quat cube_turn(void) {
    return vd_quat_from_axis_angle(vd_vec3_make(0.3, -0.5, 0.9), 0.7);
}

static vd_camera looking(bool parallel) {
    vd_camera camera = {.eye = {-14, -22, 14}, .near_m = 0.5, .far_m = 80};
    camera.orientation = vd_orientation_look_at(camera.eye, vd_vec3_make(2, 3, 1));
    camera.lens = (vd_lens){110, 105, 57.3, 41.7};
    if (parallel) {
        camera.projection = VD_PROJECTION_ORTHOGRAPHIC;
        camera.lens = (vd_lens){5, 5, 57.3, 41.7};
    }
    return camera;
}

/* Distances along the view axis of the cube's front and of the slope, along the ray of a place in
 * the picture; infinite where there is none. `rim` gets how close the ray is to leaving either. */
static void cast(const vd_camera *camera, double x, double y, double *to_cube, double *to_slope,
                 double *rim) {
    const vd_quat q = camera->orientation;
    vd_vec3 d = {0, 0, 1}, o = camera->eye;
    const vd_vec3 at = {(x - camera->lens.cx) / camera->lens.fx,
                        (y - camera->lens.cy) / camera->lens.fy, 0};
    if (camera->projection == VD_PROJECTION_ORTHOGRAPHIC) {
        o = vd_vec3_add(o, vd_quat_rotate(q, at));
    } else {
        d = vd_vec3_add(d, at);
    }
    d = vd_quat_rotate(q, d);
    const double above = o.z - (1 + o.x / 4 - o.y / 8), falls = d.z - d.x / 4 + d.y / 8;
    *to_slope = above / -falls;
    const double px = o.x + d.x * *to_slope, py = o.y + d.y * *to_slope;
    const double out = fmax(fabs(px), fabs(py)) - 32;
    *rim = fabs(out);
    if (!(*to_slope > 0) || out > 0) {
        *to_slope = INFINITY;
    }
    const vd_quat turn = cube_turn(), back = {-turn.x, -turn.y, -turn.z, turn.w};
    const vd_vec3 lo = vd_quat_rotate(back, vd_vec3_subtract(o, vd_vec3_make(2, 3, 1)));
    const vd_vec3 ld = vd_quat_rotate(back, d);
    const double from[3] = {lo.x, lo.y, lo.z}, along[3] = {ld.x, ld.y, ld.z};
    double enter = -INFINITY, leave = INFINITY;
    for (int k = 0; k < 3; k++) {
        const double a = (-cube_half - from[k]) / along[k], b = (cube_half - from[k]) / along[k];
        enter = fmax(enter, fmin(a, b));
        leave = fmin(leave, fmax(a, b));
    }
    *rim = fmin(*rim, fabs(leave - enter));
    *to_cube = enter < leave ? enter : INFINITY;
}

/* Draws both into a target, in either order, in windows. */
static vd_target *draw_both(int threads, vd_isa isa, const vd_camera *camera, int samples,
                            bool terrain_first, vd_context **context_out) {
    vd_context *context = test_context(threads, isa);
    vd_heightfield *map = slope(context);
    vd_mesh *mesh = test_cube(context, 4, vd_vec3_make(2, 3, 1));
    vd_terrain_def terrain_def = vd_terrain_def_default();
    terrain_def.heightfield = map;
    terrain_def.mip = false;
    terrain_def.object_id = 70;
    vd_terrain_renderer *terrain = NULL;
    vd_raster *raster = NULL;
    vd_frame *frame = NULL;
    vd_target *target = NULL, *window = NULL;
    assert_ok(vd_terrain_renderer_create(context, NULL, &terrain_def, &terrain));
    assert_ok(vd_raster_create(context, &raster));
    assert_ok(vd_frame_create(context, WIDTH, HEIGHT, 0, &frame));
    assert_ok(vd_target_create(context, WIDTH, HEIGHT, samples, &target));
    assert_ok(vd_target_create(context, 70, 50, samples, &window));
    vd_draw draw = vd_draw_default();
    draw.mesh = mesh;
    draw.object_id = 80;
    const vd_matrix there = vd_matrix_translation(vd_vec3_make(2, 3, 1));
    const vd_matrix back = vd_matrix_translation(vd_vec3_make(-2, -3, -1));
    draw.world_from_mesh = vd_matrix_rotation(cube_turn());
    draw.world_from_mesh = vd_matrix_multiply(&draw.world_from_mesh, &back);
    draw.world_from_mesh = vd_matrix_multiply(&there, &draw.world_from_mesh);
    vd_raster_def def = vd_raster_def_default();
    def.samples = samples;
    assert_int_equal(frame->object_count, 1);
    uint32_t first = 0;
    assert_ok(vd_frame_add_object(frame, 70, &first)); /* the same ids in either order */
    assert_ok(vd_raster_prepare(raster, NULL, &def, camera, &draw, 1, frame));
    for (int y = 0; y < HEIGHT; y += 50) {
        for (int x = 0; x < WIDTH; x += 70) {
            window->x = x;
            window->y = y;
            window->width = WIDTH - x < 70 ? WIDTH - x : 70;
            window->height = HEIGHT - y < 50 ? HEIGHT - y : 50;
            vd_target_clear(window, (uint16_t[4]){0, 0, 0, 0});
            for (int step = 0; step < 2; step++) {
                if ((step == 0) == terrain_first) {
                    assert_ok(
                        vd_terrain_renderer_composite(terrain, NULL, camera, frame, window, NULL));
                } else {
                    vd_raster_draw(raster, window, 0);
                }
            }
            for (int s = 0; s < samples; s++) {
                for (int row = 0; row < window->height; row++) {
                    const size_t from = (size_t)s * window->plane + (size_t)row * window->stride;
                    const size_t to =
                        (size_t)s * target->plane + (size_t)(y + row) * target->stride + (size_t)x;
                    const size_t count = (size_t)window->width;
                    memcpy(target->color + 4 * to, window->color + 4 * from, count * 8);
                    memcpy(target->depth + to, window->depth + from, count * 4);
                    memcpy(target->id + to, window->id + from, count * 4);
                }
            }
        }
    }
    vd_target_destroy(&window);
    vd_frame_destroy(&frame);
    vd_raster_destroy(&raster);
    vd_terrain_renderer_destroy(&terrain);
    vd_mesh_destroy(context, &mesh);
    vd_heightfield_destroy(context, &map);
    *context_out = context;
    return target;
}

static void a_cube_stands_in_a_slope(void **state) {
    (void)state;
    static const int counts[] = {1, 4, 8};
    for (int round = 0; round < 6; round++) {
        const int samples = counts[round % 3];
        const vd_camera camera = looking(round >= 3);
        vd_context *context = NULL;
        vd_target *target = draw_both(2, VD_ISA_AUTO, &camera, samples, round % 2 == 0, &context);
        size_t cubes = 0, slopes = 0, skies = 0, close = 0;
        for (int s = 0; s < samples; s++) {
            const float *offset = vd_sample_offsets(samples)[s];
            for (int y = 0; y < HEIGHT; y++) {
                for (int x = 0; x < WIDTH; x++) {
                    double to_cube, to_slope, rim;
                    cast(&camera, x + (double)offset[0], y + (double)offset[1], &to_cube, &to_slope,
                         &rim);
                    const size_t i =
                        (size_t)s * target->plane + (size_t)y * target->stride + (size_t)x;
                    if (rim < 0.25 || fabs(to_cube - to_slope) < 0.2) {
                        close++;
                        continue; /* corners snapped to 1/256 pixel decide: 0.2 m on steep faces */
                    }
                    const double t = fmin(to_cube, to_slope);
                    const uint32_t wanted = !(t < INFINITY) ? 0 : to_cube < to_slope ? 2 : 1;
                    cubes += wanted == 2;
                    slopes += wanted == 1;
                    skies += wanted == 0;
                    assert_int_equal(target->id[i], wanted);
                    const double depth = (double)target->depth[i];
                    const double seen =
                        round >= 3 ? (1 - depth) * camera.far_m : camera.near_m / depth;
                    assert_true(wanted == 0 ? depth == 0 : fabs(seen - t) < 0.2);
                    assert_int_equal(target->color[4 * i + 3], 65535);
                }
            }
        }
        const size_t all = (size_t)(WIDTH * HEIGHT * samples);
        assert_true(cubes > all / 20 && slopes > all / 2);
        assert_true(round >= 3 ? skies == 0 : skies > all / 10);
        assert_true(close < all / 50);
        vd_target_destroy(&target);
        vd_context_destroy(&context);
    }
}

/* The order of drawing, threads and SIMD levels change nothing. */
static void order_and_threads_do_not_matter(void **state) {
    (void)state;
    const vd_camera camera = looking(false);
    vd_context *context = NULL, *other = NULL;
    vd_target *expected = draw_both(1, VD_ISA_V2, &camera, 4, true, &context);
    static const int threads[] = {1, 2, 7};
    for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
        for (int t = 0; t < 3; t++) {
            vd_target *target =
                draw_both(threads[t], (vd_isa)isa, &camera, 4, (isa + t) % 2 == 0, &other);
            for (int s = 0; s < 4; s++) {
                for (int y = 0; y < HEIGHT; y++) {
                    const size_t at = (size_t)s * target->plane + (size_t)y * target->stride;
                    assert_memory_equal(target->color + 4 * at, expected->color + 4 * at,
                                        8 * WIDTH);
                    assert_memory_equal(target->depth + at, expected->depth + at, 4 * WIDTH);
                    assert_memory_equal(target->id + at, expected->id + at, 4 * WIDTH);
                }
            }
            vd_target_destroy(&target);
            vd_context_destroy(&other);
        }
    }
    vd_target_destroy(&expected);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_cube_stands_in_a_slope),
        cmocka_unit_test(order_and_threads_do_not_matter),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
