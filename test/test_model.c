/* test_model.c: models from files and from memory: what readers find, what is made of it. */
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <veduta/model.h>
#include "model/model_build.h"

#define MODELS VEDUTA_SOURCE_DIR "/test/models/"

static vd_context *context;

static vd_model *load(const char *name) {
    char path[512];
    vd_model *model = NULL;
    (void)snprintf(path, sizeof path, "%s%s", MODELS, name);
    assert_ok(vd_model_load(context, path, NULL, &model));
    return model;
}

static vd_model *decode(const char *name, const char *text) {
    vd_model *model = NULL;
    assert_ok(vd_model_decode(context, text, strlen(text), name, NULL, &model));
    return model;
}

static void expect_failure(const char *name, const char *text, vd_code code, const char *part) {
    vd_model *model = NULL;
    vd_status status = vd_model_decode(context, text, strlen(text), name, NULL, &model);
    if (status.code != code || strstr(status.message, part) == NULL) {
        fail_msg("%s: %s, not \"%s\"", vd_code_name(status.code), status.message, part);
    }
    assert_null(model);
}

static const vd_mesh *triangles(const vd_model *model) {
    assert_non_null(model->meshes[VD_TOPOLOGY_TRIANGLES]);
    return model->meshes[VD_TOPOLOGY_TRIANGLES];
}

static vd_vec3 place(const vd_mesh *mesh, uint32_t v) {
    return vd_vec3_make((double)vd_mesh_positions(mesh, 0)[v],
                        (double)vd_mesh_positions(mesh, 1)[v],
                        (double)vd_mesh_positions(mesh, 2)[v]);
}

static vd_vec3 normal(const vd_mesh *mesh, uint32_t v) {
    const float *n = vd_mesh_attributes(mesh, 0) + 4 * (size_t)v;
    return vd_vec3_make((double)n[0], (double)n[1], (double)n[2]);
}

/* Sum of the triangles' areas. */
static double area(const vd_mesh *mesh) {
    const uint32_t *i = vd_mesh_indices(mesh);
    double sum = 0.0;
    for (uint32_t t = 0; t < mesh->primitive_count; t++) {
        const vd_vec3 a = place(mesh, i[3 * t]);
        sum += 0.5 * vd_vec3_length(vd_vec3_cross(vd_vec3_subtract(place(mesh, i[3 * t + 1]), a),
                                                  vd_vec3_subtract(place(mesh, i[3 * t + 2]), a)));
    }
    return sum;
}

/* ---- files ------------------------------------------------------------------------------------*/

/* ASCII and both byte orders give the same block. */
static void test_ply_encodings(void **state) {
    (void)state;
    static const char *const names[] = {"cube-ascii.ply", "cube-little.ply", "cube-big.ply"};
    vd_model *models[3];
    for (int i = 0; i < 3; i++) {
        models[i] = load(names[i]);
        const vd_mesh *mesh = triangles(models[i]);
        assert_int_equal(mesh->size_bytes, triangles(models[0])->size_bytes);
        assert_memory_equal(mesh, triangles(models[0]), (size_t)mesh->size_bytes);
    }
    assert_string_equal(models[0]->format, "PLY, ASCII");
    assert_string_equal(models[1]->format, "PLY, binary");
    for (int i = 0; i < 3; i++) {
        vd_model_destroy(&models[i]);
        assert_null(models[i]);
    }
}

/* A cube has sharp edges: three normals at each corner, along the axes, outwards. */
static void test_cube_normals(void **state) {
    (void)state;
    vd_model *model = load("cube-ascii.ply");
    const vd_mesh *mesh = triangles(model);
    assert_int_equal(mesh->primitive_count, 12);
    assert_int_equal(mesh->vertex_count, 24);
    assert_true(model->computed_normals);
    for (uint32_t t = 0; t < 12; t++) {
        const uint32_t *i = vd_mesh_indices(mesh) + 3 * t;
        const vd_vec3 a = place(mesh, i[0]);
        const vd_vec3 face = vd_vec3_normalize(vd_vec3_cross(
            vd_vec3_subtract(place(mesh, i[1]), a), vd_vec3_subtract(place(mesh, i[2]), a)));
        for (int k = 0; k < 3; k++) {
            assert_true(vd_vec3_dot(face, normal(mesh, i[k])) > 0.999999);
            assert_true(vd_vec3_dot(face, place(mesh, i[k])) > 0.0);
        }
    }
    assert_true(fabs(area(mesh) - 24.0) < 1e-9);
    vd_model_destroy(&model);
}

static void test_obj_materials(void **state) {
    (void)state;
    vd_model *model = load("cube.obj");
    const vd_mesh *mesh = triangles(model);
    assert_int_equal(mesh->primitive_count, 12);
    assert_int_equal(mesh->part_count, 2);
    assert_true(mesh->uv >= 0);
    const vd_mesh_part *parts = vd_mesh_parts(mesh);
    assert_int_equal(parts[0].count, 8);
    assert_int_equal(parts[1].count, 4);
    const vd_model_surface *first = &model->surfaces[parts[0].material];
    assert_string_equal(first->name, "textured");
    assert_string_equal(model->surfaces[parts[1].material].name, "plain");
    assert_int_equal(model->texture_count, 1);
    assert_int_equal(first->texture, 0);
    assert_ptr_equal(model->materials[parts[0].material].texture, model->textures[0]);
    assert_null(model->materials[parts[1].material].texture);
    assert_true(model->materials[parts[1].material].shininess == 60.0f);
    vd_model_destroy(&model);
    /* Without textures nothing is read. */
    const vd_model_def def = {.skip_textures = true};
    assert_ok(vd_model_load(context, MODELS "cube.obj", &def, &model));
    assert_int_equal(model->texture_count, 0);
    vd_model_destroy(&model);
}

/* Points in map coordinates keep their fractions; colours are linear. */
static void test_cloud(void **state) {
    (void)state;
    vd_model *model = load("cloud.ply");
    assert_null(model->meshes[VD_TOPOLOGY_TRIANGLES]);
    const vd_mesh *mesh = model->meshes[VD_TOPOLOGY_POINTS];
    assert_non_null(mesh);
    assert_int_equal(mesh->primitive_count, 27);
    vd_vec3 min, max;
    vd_model_bounds(model, &min, &max);
    assert_true(min.x == 450000.125 && max.x == 450002.125);
    assert_true(min.y == 4600000.25 && max.y == 4600002.25);
    assert_true(model->has_colors && mesh->extra_count == 3);
    const float *color = vd_mesh_attributes(mesh, mesh->extra / 4);
    assert_true(color[0] == vd_srgb_decode(80));
    vd_draw draws[VD_TOPOLOGY_COUNT];
    assert_int_equal(vd_model_draws(model, draws), 1);
    assert_ptr_equal(draws[0].mesh, mesh);
    vd_model_destroy(&model);
}

/* ---- parts of the formats ---------------------------------------------------------------------*/

#define PLY_HEAD(vertices)                                                                         \
    "ply\nformat ascii 1.0\nelement vertex " vertices                                              \
    "\nproperty float x\nproperty float y\nproperty float z\n"

static void test_ply_parts(void **state) {
    (void)state;
    /* Strips turn every other triangle; −1 begins a new one; edges become lines. */
    vd_model *model =
        decode("a.ply", PLY_HEAD("5") "element tristrips 1\nproperty list int int vertex_indices\n"
                                      "element edge 2\nproperty int vertex1\nproperty int vertex2\n"
                                      "end_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 0 0\n"
                                      "8 0 1 2 3 -1 1 4 3\n0 1\n2 3\n");
    const vd_mesh *mesh = triangles(model);
    assert_int_equal(mesh->primitive_count, 3);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        assert_true(normal(mesh, v).z > 0.999);
    }
    assert_int_equal(model->meshes[VD_TOPOLOGY_LINES]->primitive_count, 2);
    vd_model_destroy(&model);
    /* Normals of the file are kept; unused vertices are not. */
    model = decode("a.ply", PLY_HEAD("4") "property float nx\nproperty float ny\n"
                                          "property float nz\nelement face 1\n"
                                          "property list uchar int vertex_index\nend_header\n"
                                          "9 9 9 0 0 1\n0 0 0 0 1 0\n1 0 0 0 1 0\n0 1 0 0 1 0\n"
                                          "3 1 2 3\n");
    mesh = triangles(model);
    assert_false(model->computed_normals);
    assert_int_equal(mesh->vertex_count, 3);
    assert_true(normal(mesh, 0).y == 1.0);
    vd_model_destroy(&model);
}

static void test_obj_parts(void **state) {
    (void)state;
    /* Colours behind positions, negative numbers, continued lines, lines and points. */
    vd_model *model = decode("a.obj", "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nv 1 1 0 1 1 1\n"
                                      "f -4 -3 \\\r\n-1 -2\r\nl 1 2 4\np 3 # a point\n");
    assert_int_equal(triangles(model)->primitive_count, 2);
    assert_int_equal(model->meshes[VD_TOPOLOGY_LINES]->primitive_count, 2);
    assert_int_equal(model->meshes[VD_TOPOLOGY_POINTS]->primitive_count, 1);
    assert_true(model->has_colors);
    vd_model_destroy(&model);
    /* Corners with two normals at one position become two vertices. */
    model = decode("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvn 0 0 1\nvn 0 1 0\n"
                            "f 1//1 2//1 3//1\nf 2//2 4//2 3//2\n");
    assert_int_equal(triangles(model)->vertex_count, 6);
    assert_false(model->computed_normals);
    vd_model_destroy(&model);
    /* Two faces that share an edge and turn little share its vertices, seam of texture or not. */
    model = decode("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.1\nf 1 2 3\nf 2 4 3\n");
    assert_int_equal(triangles(model)->vertex_count, 4);
    vd_model_destroy(&model);
    model = decode("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.1\nvt 0 0\nvt 1 1\n"
                            "f 1/1 2/1 3/1\nf 2/2 4/2 3/2\n");
    assert_int_equal(triangles(model)->vertex_count, 6);
    vd_model_destroy(&model);
}

static void test_bad(void **state) {
    (void)state;
    expect_failure("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n\nf 1 2 4\n", VD_ERROR_FORMAT, "line 5");
    expect_failure("a.obj", "v 0 nan 0\n", VD_ERROR_FORMAT, "not a number");
    expect_failure("a.obj", "hello\n", VD_ERROR_EMPTY, "no vertices");
    expect_failure("a.obj", "v 0 0 0\nusemtl x\nf 1 1\n", VD_ERROR_FORMAT, "three corners");
    expect_failure("a.ply",
                   "ply\nformat ascii 1.0\nelement vertex 99999999999\n"
                   "property float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n",
                   VD_ERROR_FORMAT, "promises");
    expect_failure("a.ply",
                   PLY_HEAD("3") "element face 1\nproperty list uchar int vertex_indices\n"
                                 "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n",
                   VD_ERROR_FORMAT, "face 0 (line 13) names vertex 3");
    expect_failure("a.dae", "x", VD_ERROR_UNSUPPORTED, "none of");
    expect_failure("a.ply", "", VD_ERROR_FORMAT, "empty");
}

/* ---- what is made of it -----------------------------------------------------------------------*/

/* Polygons that are no convex keep their area and their side. */
static void test_polygons(void **state) {
    (void)state;
    uint64_t seed = 7;
    for (int round = 0; round < 200; round++) {
        /* A star about the origin, in a plane turned by chance: simple, seldom convex. */
        enum { MOST = 40 };
        const size_t count = 4 + (size_t)(test_random(&seed) % (MOST - 3));
        double points[MOST][3];
        uint32_t left[MOST], out[MOST][3];
        const vd_quat turn = vd_quat_normalize((vd_quat){
            test_uniform(&seed) - 0.5, test_uniform(&seed) - 0.5, test_uniform(&seed) - 0.5, 0.7});
        double expected = 0.0, x0 = 0.0, y0 = 0.0, first[2] = {0.0, 0.0};
        for (size_t i = 0; i < count; i++) {
            const double angle = 6.283185307179586 * (double)i / (double)count;
            const double radius = 0.2 + test_uniform(&seed);
            const double x = radius * cos(angle), y = radius * sin(angle);
            const vd_vec3 p = vd_quat_rotate(turn, vd_vec3_make(x, y, 0.0));
            points[i][0] = p.x;
            points[i][1] = p.y;
            points[i][2] = p.z;
            if (i == 0) {
                first[0] = x;
                first[1] = y;
            } else {
                expected += 0.5 * (x0 * y - y0 * x);
            }
            x0 = x;
            y0 = y;
        }
        expected += 0.5 * (x0 * first[1] - y0 * first[0]);
        vd_triangulate((const double(*)[3])points, count, left, out);
        const vd_vec3 up = vd_quat_rotate(turn, vd_vec3_make(0, 0, 1));
        double sum = 0.0;
        for (size_t t = 0; t + 2 < count; t++) {
            vd_vec3 c[3];
            for (int k = 0; k < 3; k++) {
                assert_true(out[t][k] < count);
                c[k] =
                    vd_vec3_make(points[out[t][k]][0], points[out[t][k]][1], points[out[t][k]][2]);
            }
            const double a = 0.5 * vd_vec3_dot(up, vd_vec3_cross(vd_vec3_subtract(c[1], c[0]),
                                                                 vd_vec3_subtract(c[2], c[0])));
            assert_true(a > -1e-12);
            sum += a;
        }
        assert_true(fabs(sum - expected) < 1e-9);
    }
}

/* Max's weights are exact on a sphere, whatever the triangles are. Each triangle with positions of
 * its own: they are one surface all the same. */
static void test_sphere(void **state) {
    (void)state;
    enum { SIDES = 24, RINGS = 12 };
    static char text[1 << 18];
    size_t used = 0;
    for (int ring = 0; ring < RINGS; ring++) {
        for (int side = 0; side < SIDES; side++) {
            for (int k = 0; k < 4; k++) {
                const double theta = 3.141592653589793 * (ring + (k >= 2)) / RINGS;
                const double phi =
                    6.283185307179586 * ((side + (k == 1 || k == 2)) % SIDES) / SIDES;
                used += (size_t)snprintf(text + used, sizeof text - used, "v %.9f %.9f %.9f\n",
                                         sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta));
            }
            used += (size_t)snprintf(text + used, sizeof text - used, "f -4 -1 -2 -3\n");
        }
    }
    vd_model *model = decode("sphere.obj", text);
    const vd_mesh *mesh = triangles(model);
    assert_int_equal(mesh->vertex_count, SIDES * (RINGS - 1) + 2);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        const double cosine = vd_vec3_dot(place(mesh, v), normal(mesh, v));
        if (!(cosine > 0.9999)) {
            fail_msg("vertex %u: cosine %.9f", v, cosine);
        }
    }
    vd_model_destroy(&model);
}

/* A million triangles of nothing about one vertex, in bounded time. */
static void test_no_area(void **state) {
    (void)state;
    enum { COUNT = 1000000 };
    const char head[] =
        PLY_HEAD("2") "element face 1000000\nproperty list uchar uchar vertex_indices\n"
                      "end_header\n0 0 0\n1 0 0\n";
    const size_t bytes = sizeof head - 1 + (size_t)COUNT * 8;
    char *text = malloc(bytes);
    assert_non_null(text);
    memcpy(text, head, sizeof head - 1);
    for (size_t i = 0; i < COUNT; i++) {
        memcpy(text + sizeof head - 1 + 8 * i, "3 0 0 1\n", 8);
    }
    vd_model *model = NULL;
    assert_ok(vd_model_decode(context, text, bytes, "a.ply", NULL, &model));
    assert_int_equal(model->flat_triangles, COUNT);
    vd_model_destroy(&model);
    free(text);
}

/* Every allocation may fail. */
static void test_out_of_memory(void **state) {
    (void)state;
    static const char *const names[] = {"cube.obj", "cube-little.ply", "cloud.ply"};
    for (int i = 0; i < 3; i++) {
        char path[512];
        (void)snprintf(path, sizeof path, "%s%s", MODELS, names[i]);
        bool done = false;
        for (int fail_at = 1; !done; fail_at++) {
            test_allocator allocator = {0, 0, 0};
            vd_context *failing = test_failing_context(&allocator);
            const int live = allocator.live;
            allocator.fail_at = allocator.calls + fail_at;
            vd_model *model = NULL;
            vd_status status = vd_model_load(failing, path, NULL, &model);
            done = status.code == VD_OK;
            if (!done) {
                assert_int_equal(status.code, VD_ERROR_MEMORY);
                assert_null(model);
            }
            vd_model_destroy(&model);
            assert_int_equal(allocator.live, live);
            allocator.fail_at = 0;
            vd_context_destroy(&failing);
            assert_true(fail_at < 1000);
        }
    }
}

static int set_up(void **state) {
    (void)state;
    context = test_context(1, VD_ISA_AUTO);
    return 0;
}

static int tear_down(void **state) {
    (void)state;
    vd_context_destroy(&context);
    return 0;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ply_encodings), cmocka_unit_test(test_cube_normals),
        cmocka_unit_test(test_obj_materials), cmocka_unit_test(test_cloud),
        cmocka_unit_test(test_ply_parts),     cmocka_unit_test(test_obj_parts),
        cmocka_unit_test(test_bad),           cmocka_unit_test(test_polygons),
        cmocka_unit_test(test_sphere),        cmocka_unit_test(test_no_area),
        cmocka_unit_test(test_out_of_memory),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
