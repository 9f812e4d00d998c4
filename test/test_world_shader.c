/* A mesh has the terrain's colours; things throw shadows on the ground and on each other, and hills
 * on things; in one picture as in tiles. */
#include <math.h>
#include "core/real.h"
#include "image/image.h"
#include "raster_scenes.h"
#include "world/world_shader.h"

enum { WIDTH = 128, HEIGHT = 96, CELLS = 65 };

static vd_context *context;

static int set_up(void **state) {
    (void)state;
    context = test_context(2, VD_ISA_AUTO);
    return 0;
}

static int tear_down(void **state) {
    (void)state;
    vd_context_destroy(&context);
    return 0;
}

static const double rise_east = 0.25, rise_north = -0.125;

/* A plane of 640 m a side around the origin, of one colour; with a wall of 60 m along its western
 * edge if wanted. */
static vd_heightfield *plane_ground(vd_rgba8 color, bool level, bool wall) {
    static float heights[CELLS * CELLS];
    for (int r = 0; r < CELLS; r++) {
        for (int c = 0; c < CELLS; c++) {
            const double x = 10.0 * (c - 32), y = 10.0 * (32 - r);
            heights[r * CELLS + c] = level ? 0.0f : (float)(rise_east * x + rise_north * y);
            heights[r * CELLS + c] += wall && c == 20 ? 60.0f : 0.0f;
        }
    }
    vd_picture *colors = NULL;
    assert_ok(vd_picture_create(context, 1, 1, 3, 8, &colors));
    memcpy(colors->data, &color, 3);
    vd_heightfield_def def = vd_heightfield_def_default();
    def.width = def.height = def.height_stride = CELLS;
    def.type = VD_HEIGHT_F32;
    def.heights = heights;
    def.colors = colors;
    const double place[6] = {-320, 10, 0, 320, 0, -10};
    memcpy(def.world_from_sample, place, sizeof place);
    vd_heightfield *map = NULL;
    assert_ok(vd_heightfield_create(context, &def, &map));
    vd_picture_destroy(&colors);
    return map;
}

/* The same plane as two triangles, with normals or colours of its vertices if wanted. */
static vd_mesh *plane_mesh(bool normals, bool colors) {
    static const float corner[4][2] = {{-320, -320}, {320, -320}, {320, 320}, {-320, 320}};
    static const uint32_t indices[] = {0, 1, 2, 0, 2, 3};
    float positions[12], normal[12], extra[12];
    for (int i = 0; i < 4; i++) {
        positions[3 * i] = corner[i][0];
        positions[3 * i + 1] = corner[i][1];
        positions[3 * i + 2] =
            (float)(rise_east * (double)corner[i][0] + rise_north * (double)corner[i][1]);
        normal[3 * i] = (float)-rise_east;
        normal[3 * i + 1] = (float)-rise_north;
        normal[3 * i + 2] = 1.0f;
        extra[3 * i] = extra[3 * i + 1] = extra[3 * i + 2] = 0.5f;
    }
    vd_mesh_def def = vd_mesh_def_default();
    def.vertex_count = 4;
    def.positions = positions;
    def.normals = normals ? normal : NULL;
    def.extra = colors ? extra : NULL;
    def.extra_count = colors ? 3 : 0;
    def.index_count = 6;
    def.indices = indices;
    vd_mesh *mesh = NULL;
    assert_ok(vd_mesh_create(context, &def, &mesh));
    return mesh;
}

static vd_camera looking(vd_vec3 eye, vd_vec3 at, bool parallel) {
    vd_camera camera = {.eye = eye, .near_m = 0.5, .far_m = 2000};
    camera.orientation = vd_orientation_look_at(eye, at);
    camera.lens = vd_lens_from_fov(0.9, WIDTH, HEIGHT);
    if (parallel) {
        camera.projection = VD_PROJECTION_ORTHOGRAPHIC;
        camera.lens = (vd_lens){0.5, 0.5, 0.5 * WIDTH, 0.5 * HEIGHT};
    }
    return camera;
}

static vd_frame *new_frame(void) {
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, WIDTH, HEIGHT, VD_PLANE_DEPTH | VD_PLANE_ID, &frame));
    return frame;
}

static vd_frame *draw_ground(const vd_heightfield *map, const vd_light *light,
                             const vd_camera *camera, bool shadows) {
    vd_terrain_def def = vd_terrain_def_default();
    def.heightfield = map;
    def.light = *light;
    def.shadows = shadows;
    def.sky = false;
    def.samples = 1;
    vd_frame *frame = new_frame();
    assert_ok(vd_terrain_render(context, NULL, &def, camera, frame, NULL));
    return frame;
}

static vd_frame *draw_meshes(const vd_draw *draws, int count, const vd_camera *camera) {
    vd_frame *frame = new_frame();
    vd_raster *raster = NULL;
    const vd_raster_def def = vd_raster_def_default();
    assert_ok(vd_raster_create(context, &raster));
    assert_ok(vd_raster_render(raster, NULL, &def, camera, draws, count, frame, NULL));
    vd_raster_destroy(&raster);
    return frame;
}

static const uint8_t *pixel(const vd_frame *frame, int x, int y) {
    return frame->rgba + 4 * ((size_t)y * frame->stride + (size_t)x);
}

static void compare(const vd_frame *a, const vd_frame *b, int within) {
    int both = 0;
    for (int y = 0; y < HEIGHT; y++) {
        for (int x = 0; x < WIDTH; x++) {
            const uint8_t *p = pixel(a, x, y), *q = pixel(b, x, y);
            if (p[3] == 0 || q[3] == 0) {
                continue;
            }
            both++;
            for (int c = 0; c < 3; c++) {
                if (abs(p[c] - q[c]) > within) {
                    fail_msg("pixel %d, %d: %d %d %d and %d %d %d", x, y, p[0], p[1], p[2], q[0],
                             q[1], q[2]);
                }
            }
        }
    }
    assert_true(both > WIDTH * HEIGHT / 4);
}

static void looks_as_the_terrain(void **state) {
    (void)state;
    const vd_rgba8 color = {200, 140, 90, 255};
    vd_heightfield *map = plane_ground(color, false, false);
    for (int i = 0; i < 48; i++) {
        const bool normals = (i & 1) != 0, parallel = (i & 2) != 0, colors = (i & 4) != 0;
        vd_light light = vd_light_daylight(0.4 * i, (i & 8) != 0 ? 0.9 : 0.25);
        light.haze_m = i < 16 ? 0.0 : i < 32 ? 300.0 : 2000.0;
        const vd_camera camera =
            looking(vd_vec3_make(-150, -250, 130), vd_vec3_make(20, 30, 0), parallel);
        vd_mesh *mesh = plane_mesh(normals, colors);
        vd_world_light lit;
        vd_world_light_aim(&lit, &light, &camera, NULL, NULL, 1.0, false);
        const vd_world_uniforms uniforms = {&lit, 1.0f, false, true};
        vd_material material = vd_material_default();
        material.specular = (vd_linear){0, 0, 0};
        material.albedo = vd_linear_from_rgba8(color);
        if (colors) {
            material.albedo.r *= 2.0f;
            material.albedo.g *= 2.0f;
            material.albedo.b *= 2.0f;
        }
        vd_draw draw = vd_draw_default();
        draw.mesh = mesh;
        draw.cull = VD_CULL_NONE;
        draw.materials = &material;
        draw.material_count = 1;
        draw.shader = vd_world_shader_for(&draw, colors);
        draw.uniforms = &uniforms;
        vd_frame *ground = draw_ground(map, &light, &camera, false);
        vd_frame *things = draw_meshes(&draw, 1, &camera);
        compare(ground, things, 2);
        vd_frame_destroy(&ground);
        vd_frame_destroy(&things);
        vd_mesh_destroy(context, &mesh);
    }
    vd_heightfield_destroy(context, &map);
}

/* A cube of 20 m over level ground. */
typedef struct scene {
    vd_heightfield *map;
    vd_mesh *mesh;
    vd_sun_map *shadows;
    vd_light light;
    vd_camera camera;
    vd_world_light lit;
} scene;

static void set_scene(scene *s, bool wall, double haze_m, vd_vec3 by) {
    s->map = plane_ground((vd_rgba8){180, 180, 180, 255}, true, wall);
    s->mesh = test_cube(context, 10, vd_vec3_add(by, vd_vec3_make(0, 0, 10)));
    s->light = vd_light_daylight(vd_radians(270), vd_radians(35));
    s->light.haze_m = haze_m;
    s->camera = looking(vd_vec3_add(by, vd_vec3_make(20, -140, 90)),
                        vd_vec3_add(by, vd_vec3_make(10, 0, 0)), false);
    vd_draw draw = vd_draw_default();
    draw.mesh = s->mesh;
    vd_vec3 min, max;
    vd_mesh_bounds(s->mesh, &min, &max);
    s->shadows = NULL;
    assert_ok(vd_sun_map_create(context, &s->shadows));
    assert_ok(vd_sun_map_draw(s->shadows, NULL, s->light.sun_direction, &draw, 1, min, max));
    vd_world_light_aim(&s->lit, &s->light, &s->camera, s->shadows, s->map, 1.0, false);
}

static void end_scene(scene *s) {
    vd_sun_map_destroy(&s->shadows);
    vd_mesh_destroy(context, &s->mesh);
    vd_heightfield_destroy(context, &s->map);
}

/* 1: well within the cube's shadow on the ground, 0: well outside, −1: near its edge. */
static int in_shadow(const scene *s, int x, int y, double slack) {
    const vd_ray ray = vd_camera_ray(&s->camera, x + 0.5, y + 0.5);
    const double t = -ray.origin.z / ray.direction.z;
    const double px = ray.origin.x + t * ray.direction.x, py = ray.origin.y + t * ray.direction.y;
    const double reach = 10 + 20 / tan(vd_radians(35));
    const double out = fmax(fmax(-10 - px, px - reach), fabs(py) - 10);
    return t < 0 ? 0 : out < -slack ? 1 : out > slack ? 0 : -1;
}

static void things_darken_the_ground(void **state) {
    (void)state;
    for (int haze = 0; haze < 2; haze++) {
        scene s;
        set_scene(&s, false, haze != 0 ? 400 : 0, vd_vec3_make(0, 0, 0));
        vd_frame *before = draw_ground(s.map, &s.light, &s.camera, true);
        vd_frame *after = draw_ground(s.map, &s.light, &s.camera, true);
        vd_world_shade_picture(&s.lit, before, after, 0, 0, WIDTH, HEIGHT);
        int dark = 0;
        for (int y = 0; y < HEIGHT; y++) {
            for (int x = 0; x < WIDTH; x++) {
                const size_t at = (size_t)y * before->stride + (size_t)x;
                const int in = before->depth[at] > 0 ? in_shadow(&s, x, y, 0.6) : 0;
                const double z = vd_camera_distance(&s.camera, before->depth[at]);
                const double right = (x + 0.5 - s.camera.lens.cx) / s.camera.lens.fx;
                const double down = (y + 0.5 - s.camera.lens.cy) / s.camera.lens.fy;
                const double away = z * sqrt(1 + right * right + down * down);
                const double left = haze != 0 ? exp(-away / 400) : 1;
                for (int c = 0; c < 3 && in >= 0; c++) {
                    const double air = 255 * (double)s.lit.haze_color[c] * (1 - left);
                    const int was = pixel(before, x, y)[c], is = pixel(after, x, y)[c];
                    const double expected = in == 1 ? (was - air) * 0.35 + air : was;
                    if (fabs(expected - is) > 1.01) {
                        fail_msg("pixel %d, %d: %d after %d, expected %g", x, y, is, was, expected);
                    }
                }
                dark += in == 1;
            }
        }
        assert_true(dark > 100);
        vd_frame_destroy(&before);
        vd_frame_destroy(&after);
        end_scene(&s);
    }
}

/* Fills a window of a target with the picture of the ground. */
static void fill_window(const vd_frame *ground, vd_target *t, int x, int y, int width, int height) {
    t->x = x;
    t->y = y;
    t->width = width;
    t->height = height;
    for (int sample = 0; sample < t->samples; sample++) {
        for (int r = 0; r < height; r++) {
            for (int c = 0; c < width; c++) {
                const size_t to = (size_t)sample * t->plane + (size_t)r * t->stride + (size_t)c;
                const size_t from = (size_t)(y + r) * ground->stride + (size_t)(x + c);
                for (int k = 0; k < 4; k++) {
                    t->color[4 * to + (size_t)k] =
                        (uint16_t)(ground->rgba[4 * from + (size_t)k] * 257);
                }
                t->depth[to] = ground->depth[from];
                t->id[to] = ground->depth[from] > 0 ? 7 : 0;
            }
        }
    }
}

static void windows_are_as_the_picture(void **state) {
    (void)state;
    scene s;
    set_scene(&s, false, 400, vd_vec3_make(0, 0, 0));
    vd_frame *ground = draw_ground(s.map, &s.light, &s.camera, true);
    vd_frame *whole = draw_ground(s.map, &s.light, &s.camera, true);
    vd_world_shade_picture(&s.lit, ground, whole, 0, 0, WIDTH, HEIGHT);
    vd_frame *tiles = new_frame();
    vd_target *window = NULL;
    assert_ok(vd_target_create(context, 40, 32, 1, &window));
    for (int y = 0; y < HEIGHT; y += 32) {
        for (int x = 0; x < WIDTH; x += 40) {
            fill_window(ground, window, x, y, WIDTH - x < 40 ? WIDTH - x : 40, 32);
            vd_world_shade_ground(&s.lit, window, 7, NULL, 0);
            vd_target_resolve(window, tiles);
        }
    }
    compare(whole, tiles, 1);
    /* Another id is left alone, and so is everything without a map. */
    for (int i = 0; i < 2; i++) {
        fill_window(ground, window, 50, 40, 40, 32);
        vd_world_light none = s.lit;
        none.map = NULL;
        vd_world_shade_ground(i == 0 ? &s.lit : &none, window, i == 0 ? 8 : 7, NULL, 0);
        for (int r = 0; r < 32; r++) {
            for (int c = 0; c < 40; c++) {
                const size_t at = 4 * ((size_t)r * window->stride + (size_t)c);
                assert_int_equal(window->color[at], pixel(ground, 50 + c, 40 + r)[0] * 257);
            }
        }
    }
    /* Eight samples: the mean of a pixel near an edge lies between. */
    vd_target_destroy(&window);
    assert_ok(vd_target_create(context, WIDTH, HEIGHT, 8, &window));
    fill_window(ground, window, 0, 0, WIDTH, HEIGHT);
    vd_world_shade_ground(&s.lit, window, 7, NULL, 0);
    vd_target_resolve(window, tiles);
    for (int y = 0; y < HEIGHT; y++) {
        for (int x = 0; x < WIDTH; x++) {
            if (ground->depth[(size_t)y * ground->stride + (size_t)x] > 0 &&
                in_shadow(&s, x, y, 4) >= 0) {
                assert_in_range(abs(pixel(tiles, x, y)[1] - pixel(whole, x, y)[1]), 0, 1);
            }
        }
    }
    vd_target_destroy(&window);
    vd_frame_destroy(&tiles);
    vd_frame_destroy(&whole);
    vd_frame_destroy(&ground);
    end_scene(&s);
}

/* Behind the wall the ground is in its shadow already: nothing darkens it twice. */
static void hills_come_first(void **state) {
    (void)state;
    scene s;
    set_scene(&s, true, 0, vd_vec3_make(-90, 0, 0));
    vd_frame *before = draw_ground(s.map, &s.light, &s.camera, true);
    vd_frame *after = draw_ground(s.map, &s.light, &s.camera, true);
    vd_world_shade_picture(&s.lit, before, after, 0, 0, WIDTH, HEIGHT);
    assert_memory_equal(before->rgba, after->rgba, 4 * before->stride * HEIGHT);
    vd_world_light plain;
    vd_world_light_aim(&plain, &s.light, &s.camera, s.shadows, NULL, 1.0, false);
    vd_world_shade_picture(&plain, before, after, 0, 0, WIDTH, HEIGHT);
    assert_memory_not_equal(before->rgba, after->rgba, 4 * before->stride * HEIGHT);
    vd_frame_destroy(&before);
    vd_frame_destroy(&after);
    end_scene(&s);
}

/* Two cubes: the western one shades the other's side and top as rays say; hills shade all of it. */
static void things_shade_things(void **state) {
    (void)state;
    scene s;
    set_scene(&s, true, 0, vd_vec3_make(100, 0, 0));
    vd_mesh *second = test_cube(context, 10, vd_vec3_make(140, 0, 10));
    vd_draw draws[2] = {vd_draw_default(), vd_draw_default()};
    draws[0].mesh = s.mesh;
    draws[1].mesh = second;
    assert_ok(vd_sun_map_draw(s.shadows, NULL, s.light.sun_direction, draws, 2,
                              vd_vec3_make(90, -10, 0), vd_vec3_make(150, 10, 20)));
    const vd_camera camera = looking(vd_vec3_make(112, 2, 90), vd_vec3_make(120, 0, 0), false);
    vd_world_light_aim(&s.lit, &s.light, &camera, s.shadows, s.map, 1.0, false);
    vd_frame *pictures[4];
    static const vd_world_uniforms kinds[4] = {{NULL, 1.0f, false, true},
                                               {NULL, 1.0f, false, false},
                                               {NULL, 0.0f, false, true},
                                               {NULL, 1.0f, true, true}};
    for (int i = 0; i < 4; i++) {
        vd_world_uniforms uniforms = kinds[i];
        uniforms.light = &s.lit;
        for (int k = 0; k < 2; k++) {
            draws[k].cull = VD_CULL_NONE;
            draws[k].uniforms = &uniforms;
            draws[k].shader = vd_world_shader_for(&draws[k], false);
            assert_ptr_equal(draws[k].shader, &vd_world_shader_flat_plain);
        }
        pictures[i] = draw_meshes(draws, 2, &camera);
    }
    int dark = 0, lit = 0;
    for (int y = 0; y < HEIGHT; y++) {
        for (int x = 0; x < WIDTH; x++) {
            const int all = pixel(pictures[1], x, y)[0], none = pixel(pictures[2], x, y)[0];
            const int is = pixel(pictures[0], x, y)[0], with_hills = pixel(pictures[3], x, y)[0];
            if (pixel(pictures[0], x, y)[3] == 0) {
                continue;
            }
            assert_in_range(is, none, all);
            /* Tops of both are in the sun: the wall is 120 m away and 60 m high. */
            const vd_ray ray = vd_camera_ray(&camera, x + 0.5, y + 0.5);
            const double t = (20 - ray.origin.z) / ray.direction.z;
            const double px = ray.origin.x + t * ray.direction.x;
            const double py = ray.origin.y + t * ray.direction.y;
            const bool on_top = fabs(py) < 9.5 && (fabs(px - 100) < 9.5 || fabs(px - 140) < 9.5);
            if (on_top) {
                assert_int_equal(is, all);
                assert_int_equal(with_hills, all);
                lit++;
            }
            dark += is == none && all > none;
        }
    }
    assert_true(lit > 200);
    assert_true(dark > 5); /* of the second's western side */
    for (int i = 0; i < 4; i++) {
        vd_frame_destroy(&pictures[i]);
    }
    vd_mesh_destroy(context, &second);
    end_scene(&s);
}

/* With the Earth's curve the ground far away is lower, but its shadows stay where they were. */
static void curvature_moves_no_shadow(void **state) {
    (void)state;
    vd_light light = vd_light_daylight(1.0, 0.6);
    const vd_vec3 eye = {0, 0, 2000};
    vd_camera camera = looking(eye, vd_vec3_make(30000, 20000, 0), false);
    vd_mesh *mesh = test_cube(context, 50, vd_vec3_make(30000, 20000, 0));
    vd_draw draw = vd_draw_default();
    draw.mesh = mesh;
    vd_sun_map *map = NULL;
    vd_vec3 min, max;
    vd_mesh_bounds(mesh, &min, &max);
    assert_ok(vd_sun_map_create(context, &map));
    assert_ok(vd_sun_map_draw(map, NULL, light.sun_direction, &draw, 1, min, max));
    for (int curved = 0; curved < 2; curved++) {
        vd_world_light lit;
        vd_world_light_aim(&lit, &light, &camera, map, NULL, 1.0, curved != 0);
        uint64_t random = 3;
        for (int i = 0; i < 200; i++) {
            vd_vec3 p = {30000 + 200 * (test_uniform(&random) - 0.5),
                         20000 + 200 * (test_uniform(&random) - 0.5), -100 * test_uniform(&random)};
            float at[3], places[3][16] = {{0}}, width[16] = {1}, share[16];
            vd_sun_map_place(map, p, at);
            const float truth = vd_sun_map_share(map, at, 0);
            p.z -= curved != 0 ? vd_curvature_drop(sqrt(p.x * p.x + p.y * p.y)) : 0.0;
            const vd_vec3 seen = vd_vec3_subtract(p, eye);
            const vd_quat q = camera.orientation, back = {-q.x, -q.y, -q.z, q.w};
            const vd_vec3 there = vd_quat_rotate(back, seen);
            places[0][0] = (float)there.x;
            places[1][0] = (float)there.y;
            places[2][0] = (float)there.z;
            (void)vd_world_light_shares(&lit, 1, places, width, share);
            assert_float_equal(share[0], truth, 0.05);
        }
    }
    vd_sun_map_destroy(&map);
    vd_mesh_destroy(context, &mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(looks_as_the_terrain),       cmocka_unit_test(things_darken_the_ground),
        cmocka_unit_test(windows_are_as_the_picture), cmocka_unit_test(hills_come_first),
        cmocka_unit_test(things_shade_things),        cmocka_unit_test(curvature_moves_no_shadow),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
