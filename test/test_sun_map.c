/* The map of shadows against rays; moved worlds; holes of leaves; what blends; errors. */
#include <math.h>
#include "core/real.h"
#include "raster_scenes.h"
#include "world/sun_map.h"

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

/* Where a ray is in the cube of the half side `half` around `middle`: from … to; false nowhere. */
static bool through(vd_vec3 origin, vd_vec3 direction, vd_vec3 middle, double half, double *from,
                    double *to) {
    const vd_vec3 o = vd_vec3_subtract(origin, middle);
    const double at[3] = {o.x, o.y, o.z}, along[3] = {direction.x, direction.y, direction.z};
    *from = -INFINITY;
    *to = INFINITY;
    for (int k = 0; k < 3; k++) {
        const double a = (-half - at[k]) / along[k], b = (half - at[k]) / along[k];
        *from = fmax(*from, fmin(a, b));
        *to = fmin(*to, fmax(a, b));
    }
    return *from < *to;
}

static float share_at(const vd_sun_map *map, vd_vec3 point, float footprint) {
    float place[3];
    vd_sun_map_place(map, point, place);
    return vd_sun_map_share(map, place, footprint);
}

/* Points on a plane under a cube and inside it are dark where their rays meet it, but for a texel
 * and a half at the edge. */
static void shades_as_rays_do(void **state) {
    (void)state;
    uint64_t random = 1;
    vd_sun_map *map = NULL;
    assert_ok(vd_sun_map_create(context, &map));
    int dark = 0, lit = 0;
    for (int scene = 0; scene < 20; scene++) {
        const vd_vec3 middle = {1000.25, -2000.5, 10};
        vd_mesh *mesh = test_cube(context, 4, middle);
        vd_draw draw = vd_draw_default();
        draw.mesh = mesh;
        vd_vec3 min, max;
        vd_mesh_bounds(mesh, &min, &max);
        const double altitude = scene == 0 ? 0.5 * VD_PI : 0.1 + 1.4 * test_uniform(&random);
        const vd_vec3 sun = vd_sun_direction(6.3 * test_uniform(&random), altitude);
        assert_ok(vd_sun_map_draw(map, NULL, sun, &draw, 1, min, max));
        assert_int_equal(map->side, 256);
        for (int i = 0; i < 2000; i++) {
            vd_vec3 p = {middle.x + 40 * (test_uniform(&random) - 0.5),
                         middle.y + 40 * (test_uniform(&random) - 0.5), 0};
            /* One in four above, beside or in the cube. */
            p.z = i % 4 == 0 ? 20 * test_uniform(&random) : 0;
            double from, to;
            const bool meets = through(p, sun, middle, 4, &from, &to) && to > 0;
            double a, b;
            const bool wide = through(p, sun, middle, 4 + 2.5 * (double)map->texel_m, &a, &b) &&
                              b > -2.0 * (double)map->texel_m;
            const bool deep = through(p, sun, middle, 4 - 2.5 * (double)map->texel_m, &a, &b) &&
                              b > 2.0 * (double)map->texel_m;
            const float share = share_at(map, p, 0.0f);
            if (deep ? share != 0.0f : !wide ? share != 1.0f : false) {
                fail_msg("scene %d point %d: share %g, meets %d", scene, i, (double)share, meets);
            }
            dark += deep;
            lit += !wide;
        }
        vd_mesh_destroy(context, &mesh);
    }
    assert_true(dark > 2000 && lit > 2000);
    vd_sun_map_destroy(&map);
}

/* The lifted surface of a caster that faces the sun is lit all over. */
static void has_no_acne(void **state) {
    (void)state;
    uint64_t random = 2;
    vd_sun_map *map = NULL;
    assert_ok(vd_sun_map_create(context, &map));
    for (int scene = 0; scene < 30; scene++) {
        vd_mesh *mesh = test_cube(context, 4, vd_vec3_make(0, 0, 0));
        vd_draw draw = vd_draw_default();
        draw.mesh = mesh;
        const vd_vec3 sun =
            vd_sun_direction(6.3 * test_uniform(&random), test_uniform(&random) + 0.2);
        assert_ok(vd_sun_map_draw(map, NULL, sun, &draw, 1, vd_vec3_make(-4, -4, -4),
                                  vd_vec3_make(4, 4, 4)));
        for (int i = 0; i < 1000; i++) {
            const float footprint = 3.0f * map->texel_m * (float)test_uniform(&random);
            const float width = vd_sun_map_width(map, footprint);
            const double cosine = sun.z, sine = sqrt(1 - cosine * cosine);
            const float lift = vd_sun_map_lift(map, width, (float)sine);
            const vd_vec3 p = {8 * test_uniform(&random) - 4, 8 * test_uniform(&random) - 4,
                               4 + (double)lift};
            const float share = share_at(map, p, footprint);
            if (share < 1.0f) {
                fail_msg("scene %d point %d: share %g", scene, i, (double)share);
            }
        }
        vd_mesh_destroy(context, &mesh);
    }
    vd_sun_map_destroy(&map);
}

/* A shadow's edge is a ramp as wide as a texel, or as the footprint. */
static void softens_edges(void **state) {
    (void)state;
    vd_sun_map *map = NULL;
    assert_ok(vd_sun_map_create(context, &map));
    vd_mesh *mesh = test_cube(context, 4, vd_vec3_make(0, 0, 0));
    vd_draw draw = vd_draw_default();
    draw.mesh = mesh;
    assert_ok(vd_sun_map_draw(map, NULL, vd_vec3_make(0, 0, 1), &draw, 1, vd_vec3_make(-4, -4, -4),
                              vd_vec3_make(4, 4, 4)));
    const double texel = (double)map->texel_m;
    for (int wide = 1; wide <= 3; wide++) {
        double from = INFINITY, to = -INFINITY, last = 0;
        for (double x = 3; x < 5; x += texel / 64) {
            const double share =
                (double)share_at(map, vd_vec3_make(x, 0.3, -6), (float)(wide * texel));
            assert_true(share >= last - 1e-5);
            last = share;
            from = share > 0 && x < from ? x : from;
            to = share < 1 ? x : to;
        }
        assert_float_equal((to - from) / texel, wide, 0.1);
        assert_float_equal((to + from) / 2, 4, 0.51 * texel);
    }
    vd_mesh_destroy(context, &mesh);
    vd_sun_map_destroy(&map);
}

/* Moved by 10^7 m east and 2^-10 m up, the map and what is read from it are the same bytes. */
static void moves_with_the_world(void **state) {
    (void)state;
    vd_sun_map *maps[2] = {NULL, NULL};
    vd_mesh *meshes[2][2];
    const vd_vec3 sun = vd_sun_direction(1.234, 0.543);
    for (int i = 0; i < 2; i++) {
        const vd_vec3 by = {i * 1e7, i * -3e6, i * 0x1p-10};
        assert_ok(vd_sun_map_create(context, &maps[i]));
        vd_draw draws[2];
        vd_material pane = vd_material_default();
        pane.blend = true;
        pane.alpha = 0.5f;
        for (int k = 0; k < 2; k++) {
            meshes[i][k] = test_cube(context, k == 0 ? 3.1f : 1.7f,
                                     vd_vec3_add(by, vd_vec3_make(7 * k, 2, 5)));
            draws[k] = vd_draw_default();
            draws[k].mesh = meshes[i][k];
        }
        draws[1].materials = &pane;
        draws[1].material_count = 1;
        /* Bounds that are no multiples of 2^-10. */
        const vd_vec3 min = {-3.1, -1.1, 1.9}, max = {8.7, 5.1, 8.1};
        assert_ok(vd_sun_map_draw(maps[i], NULL, sun, draws, 2, vd_vec3_add(by, min),
                                  vd_vec3_add(by, max)));
    }
    const size_t side = (size_t)maps[0]->side;
    assert_int_equal(maps[0]->side, maps[1]->side);
    assert_memory_equal(maps[0]->axes, maps[1]->axes, sizeof maps[0]->axes);
    assert_memory_equal(maps[0]->at, maps[1]->at, sizeof maps[0]->at);
    assert_float_equal(maps[1]->origin.x - maps[0]->origin.x, 1e7, 0);
    int between = 0, panes = 0;
    for (size_t y = 0; y < side; y++) {
        const size_t at = y * maps[0]->stride;
        const float *top = maps[0]->top + at, *bottom = maps[0]->bottom + at;
        const uint8_t *alpha = maps[0]->alpha + at;
        assert_memory_equal(top, maps[1]->top + at, side * sizeof(float));
        assert_memory_equal(bottom, maps[1]->bottom + at, side * sizeof(float));
        assert_memory_equal(alpha, maps[1]->alpha + at, side);
        for (size_t i = 0; i < side; i++) {
            between += top[i] > bottom[i];
            assert_true((top[i] > -INFINITY) == (alpha[i] > 0));
            panes += alpha[i] > 120 && alpha[i] < 135;
        }
    }
    assert_true(between > 2000 && panes > 500);
    for (int i = 0; i < 2; i++) {
        vd_mesh_destroy(context, &meshes[i][0]);
        vd_mesh_destroy(context, &meshes[i][1]);
        vd_sun_map_destroy(&maps[i]);
    }
}

/* A square of 8 m in the air at z = 5, its texture's left half away, drawn with an alpha test or
 * blended. */
static void leaves_have_holes(void **state) {
    (void)state;
    static const float positions[] = {-4, -4, 5, 4, -4, 5, 4, 4, 5, -4, 4, 5};
    static const float uvs[] = {0, 1, 1, 1, 1, 0, 0, 0};
    static const uint32_t indices[] = {0, 1, 2, 0, 2, 3};
    vd_mesh_def def = vd_mesh_def_default();
    def.vertex_count = 4;
    def.positions = positions;
    def.uvs = uvs;
    def.index_count = 6;
    def.indices = indices;
    vd_mesh *mesh = NULL;
    assert_ok(vd_mesh_create(context, &def, &mesh));
    vd_picture *picture = NULL;
    assert_ok(vd_picture_create(context, 8, 8, 4, 8, &picture));
    for (int i = 0; i < 64; i++) {
        uint8_t *texel = (uint8_t *)picture->data + (size_t)(i / 8) * picture->stride_bytes;
        memset(texel + 4 * (i % 8), 255, 4);
        texel[4 * (i % 8) + 3] = i % 8 < 4 ? 0 : 255;
    }
    vd_texture *texture = NULL;
    assert_ok(vd_texture_create(context, picture, &texture));
    vd_material material = vd_material_default();
    material.texture = texture;
    vd_draw draw = vd_draw_default();
    draw.mesh = mesh;
    draw.materials = &material;
    draw.material_count = 1;
    vd_sun_map *map = NULL;
    assert_ok(vd_sun_map_create(context, &map));
    const vd_vec3 sun = {0, 0, 1}, min = {-4, -4, 5}, max = {4, 4, 5};
    const vd_vec3 left = {-2, 1, 0}, right = {2, 1, 0};
    material.alpha_test = 0.5f;
    assert_ok(vd_sun_map_draw(map, NULL, sun, &draw, 1, min, max));
    assert_float_equal(share_at(map, left, 0), 1, 0);
    assert_float_equal(share_at(map, right, 0), 0, 0);
    assert_float_equal(share_at(map, vd_vec3_make(2, 1, 5.5), 0), 1, 0);
    /* The same bounds and addresses: drawn again only when it is told. */
    const uint64_t times = map->redraw;
    assert_ok(vd_sun_map_draw(map, NULL, sun, &draw, 1, min, max));
    assert_int_equal(map->redraw, times);
    vd_material pane = material;
    pane.alpha_test = 0;
    pane.blend = true;
    pane.alpha = 0.4f;
    draw.materials = &pane;
    assert_ok(vd_sun_map_draw(map, NULL, sun, &draw, 1, min, max));
    assert_int_equal(map->redraw, times + 1);
    assert_float_equal(share_at(map, left, 0), 1, 0);
    assert_float_equal(share_at(map, right, 0), 0.6, 0.01);
    vd_sun_map_destroy(&map);
    vd_texture_destroy(&texture);
    vd_picture_destroy(&picture);
    vd_mesh_destroy(context, &mesh);
}

/* More casters than are drawn at once: the same map as of the least and of a part. */
static void draws_any_number_of_casters(void **state) {
    (void)state;
    enum { MANY = 300 };
    static float positions[3 * 3 * 4000];
    uint64_t random = 9;
    for (int i = 0; i < 3 * 3 * 4000; i++) {
        positions[i] = (float)(8 * test_uniform(&random) - 4);
    }
    vd_mesh *mesh = soup(context, positions, 3 * 4000); /* 300 of them: 3.6 million vertices */
    static vd_draw draws[MANY];
    for (int i = 0; i < MANY; i++) {
        draws[i] = vd_draw_default();
        draws[i].mesh = mesh;
        draws[i].world_from_mesh = vd_matrix_identity();
        const double at[3] = {10.0 * (i % 20), 10.0 * (i / 20), 3.0 * (i % 7)};
        for (int k = 0; k < 3; k++) {
            draws[i].world_from_mesh.m[k][k] = 0.9;
            draws[i].world_from_mesh.m[k][3] = at[k];
        }
    }
    vd_sun_map *map = NULL, *last = NULL;
    const vd_vec3 sun = vd_sun_direction(1, 0.9), min = {-5, -5, -5}, max = {200, 150, 30};
    assert_ok(vd_sun_map_create(context, &map));
    assert_ok(vd_sun_map_create(context, &last));
    assert_ok(vd_sun_map_draw(map, NULL, sun, draws, MANY, min, max));
    /* The first and the last hundred of them alone, over the same box. */
    size_t dark = 0;
    for (int part = 0; part < 2; part++) {
        assert_ok(vd_sun_map_draw(last, NULL, sun, draws + 200 * part, 100, min, max));
        assert_int_equal(last->side, map->side);
        for (size_t y = 0; y < (size_t)map->side; y++) {
            for (size_t x = 0; x < (size_t)map->side; x++) {
                const size_t at = y * map->stride + x;
                assert_true(map->top[at] >= last->top[at]);
                dark += last->top[at] > -INFINITY && map->top[at] == last->top[at];
            }
        }
    }
    assert_true(dark > 10000);
    vd_sun_map_destroy(&map);
    vd_sun_map_destroy(&last);
    vd_mesh_destroy(context, &mesh);
}

static void is_empty_without_sun_or_casters(void **state) {
    (void)state;
    vd_sun_map *map = NULL;
    assert_ok(vd_sun_map_create(context, &map));
    assert_float_equal(share_at(map, vd_vec3_make(0, 0, 0), 1), 1, 0);
    vd_mesh *mesh = test_cube(context, 4, vd_vec3_make(0, 0, 10));
    vd_draw draw = vd_draw_default();
    draw.mesh = mesh;
    vd_vec3 min, max;
    vd_mesh_bounds(mesh, &min, &max);
    const vd_vec3 up = {0, 0, 1}, level = {1, 0, 0}, under = {0, 0, 0};
    assert_ok(vd_sun_map_draw(map, NULL, up, &draw, 1, min, max));
    assert_float_equal(share_at(map, under, 0), 0, 0);
    assert_ok(vd_sun_map_draw(map, NULL, level, &draw, 1, min, max));
    assert_float_equal(share_at(map, under, 0), 1, 0);
    assert_ok(vd_sun_map_draw(map, NULL, up, &draw, 0, min, max));
    assert_float_equal(share_at(map, under, 0), 1, 0);
    draw.fill = VD_FILL_WIREFRAME;
    assert_ok(vd_sun_map_draw(map, NULL, up, &draw, 1, min, max));
    assert_float_equal(share_at(map, under, 0), 1, 0);
    /* An error empties it. */
    draw.fill = VD_FILL_SOLID;
    assert_ok(vd_sun_map_draw(map, NULL, up, &draw, 1, min, max));
    draw.world_from_mesh.m[1][2] = NAN;
    const vd_status status = vd_sun_map_draw(map, NULL, up, &draw, 1, min, max);
    assert_int_equal(status.code, VD_ERROR_ARGUMENT);
    assert_float_equal(share_at(map, under, 0), 1, 0);
    vd_mesh_destroy(context, &mesh);
    vd_sun_map_destroy(&map);
}

static void says_when_memory_is_out(void **state) {
    (void)state;
    for (int fail_at = 0;; fail_at++) {
        test_allocator allocator = {0};
        vd_context *failing = test_failing_context(&allocator);
        vd_mesh *mesh = test_cube(context, 4, vd_vec3_make(0, 0, 10));
        vd_draw draw = vd_draw_default();
        vd_material glass = vd_material_default();
        draw.mesh = mesh;
        glass.blend = true;
        draw.materials = &glass;
        draw.material_count = 1;
        allocator.fail_at = fail_at == 0 ? 0 : allocator.calls + fail_at;
        const int before = allocator.calls;
        vd_sun_map *map = NULL;
        vd_status status = vd_sun_map_create(failing, &map);
        if (status.code == VD_OK) {
            status = vd_sun_map_draw(map, NULL, vd_vec3_make(0, 0, 1), &draw, 1,
                                     vd_vec3_make(-4, -4, 6), vd_vec3_make(4, 4, 14));
        }
        assert_true(status.code == VD_OK || status.code == VD_ERROR_MEMORY);
        const bool over = fail_at > allocator.calls - before;
        vd_sun_map_destroy(&map);
        vd_mesh_destroy(context, &mesh);
        vd_context_destroy(&failing);
        assert_int_equal(allocator.live, 0);
        if (over) {
            break;
        }
        assert_true(fail_at == 0 || status.code == VD_ERROR_MEMORY);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shades_as_rays_do),
        cmocka_unit_test(has_no_acne),
        cmocka_unit_test(softens_edges),
        cmocka_unit_test(moves_with_the_world),
        cmocka_unit_test(leaves_have_holes),
        cmocka_unit_test(draws_any_number_of_casters),
        cmocka_unit_test(is_empty_without_sun_or_casters),
        cmocka_unit_test(says_when_memory_is_out),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
