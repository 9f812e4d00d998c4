/* Materials that are alpha-tested or blended: all methods agree, and what a painter would see. */
#include "raster_scenes.h"

/* A leaf: a disc of full alpha, a rim that fades, nothing outside; colours by place. */
static vd_texture *leaf(vd_context *context) {
    enum { SIDE = 32 };
    vd_picture *picture = NULL;
    vd_texture *texture = NULL;
    assert_ok(vd_picture_create(context, SIDE, SIDE, 4, 8, &picture));
    for (int y = 0; y < SIDE; y++) {
        uint8_t *row = (uint8_t *)picture->data + (size_t)y * picture->stride_bytes;
        for (int x = 0; x < SIDE; x++) {
            const double d = hypot(x + 0.5 - 16, y + 0.5 - 16);
            const double alpha = d < 10 ? 1.0 : d > 15 ? 0.0 : (15 - d) / 5;
            row[4 * x] = (uint8_t)(8 * x);
            row[4 * x + 1] = (uint8_t)(255 - 8 * y);
            row[4 * x + 2] = 90;
            row[4 * x + 3] = (uint8_t)(255 * alpha + 0.5);
        }
    }
    assert_ok(vd_texture_create(context, picture, &texture));
    vd_picture_destroy(&picture);
    return texture;
}

/* `count` random quads in front of flat_camera, or at z = 1 … 3 before plain_camera, textured, with
 * normals, in `parts` parts of materials 0 … 3. */
static vd_mesh *quads(vd_context *context, size_t count, int parts, double size, bool flat,
                      uint64_t seed) {
    float *p = malloc(count * 12 * sizeof *p), *n = malloc(count * 12 * sizeof *n);
    float *uv = malloc(count * 8 * sizeof *uv);
    uint32_t *indices = malloc(count * 6 * sizeof *indices);
    vd_mesh_part *runs = malloc((size_t)parts * sizeof *runs);
    for (size_t q = 0; q < count; q++) {
        const double scale = flat ? size : 2.0, side = scale * (0.1 + 0.4 * test_uniform(&seed));
        const double cx = test_uniform(&seed) * scale - (flat ? 0 : 0.5 * scale);
        const double cy = test_uniform(&seed) * scale - (flat ? 0 : 0.5 * scale);
        const double turn = 6.28 * test_uniform(&seed), z = test_uniform(&seed);
        const double tilt = flat ? 0.3 / scale : 0.6;
        for (size_t k = 0; k < 4; k++) {
            const double u = k == 1 || k == 2, v = k >= 2;
            const double dx = (u - 0.5) * side, dy = (v - 0.5) * side;
            float *to = p + 3 * (4 * q + k);
            to[0] = (float)(cx + cos(turn) * dx - sin(turn) * dy);
            to[1] = (float)(cy + sin(turn) * dx + cos(turn) * dy);
            to[2] = (float)((flat ? 0.2 + 0.6 * z : 0.3 + 2 * z) + tilt * dx);
            uv[2 * (4 * q + k)] = (float)u;
            uv[2 * (4 * q + k) + 1] = (float)v;
            n[3 * (4 * q + k)] = n[3 * (4 * q + k) + 1] = 0.3f;
            n[3 * (4 * q + k) + 2] = -1.0f;
        }
        const uint32_t i = (uint32_t)(4 * q), quad[6] = {i, i + 1, i + 2, i, i + 2, i + 3};
        memcpy(indices + 6 * q, quad, sizeof quad);
    }
    uint32_t first = 0;
    for (int i = 0; i < parts; i++) { /* whole numbers of triangles, some parts empty */
        const uint32_t end = (uint32_t)(2 * count * (size_t)(i + 1) / (size_t)parts);
        runs[i] = (vd_mesh_part){first, end - first, (uint32_t)(i % 4)};
        first = end;
    }
    vd_mesh_def def = vd_mesh_def_default();
    def.vertex_count = 4 * count;
    def.positions = p;
    def.normals = n;
    def.uvs = uv;
    def.index_count = 6 * count;
    def.indices = indices;
    def.parts = runs;
    def.part_count = parts;
    vd_mesh *mesh = NULL;
    assert_ok(vd_mesh_create(context, &def, &mesh));
    free(p);
    free(n);
    free(uv);
    free(indices);
    free(runs);
    return mesh;
}

/* Solid, tested, blended, and both of these. */
static void make_materials(const vd_texture *texture, vd_material *out) {
    for (int i = 0; i < 4; i++) {
        out[i] = vd_material_default();
        out[i].texture = i == 0 ? NULL : texture;
        out[i].alpha = i == 2 ? 0.6f : 1.0f;
        out[i].alpha_test = i == 1 ? 0.5f : i == 3 ? 0.25f : 0.0f;
        out[i].blend = i >= 2;
        out[i].filter = (vd_texture_filter)i;
    }
}

static void methods_agree(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_texture *texture = leaf(context);
    vd_material materials[4];
    make_materials(texture, materials);
    static const vd_shader none = {.fragment = NULL};
    for (int round = 0; round < (test_is_reduced() ? 4 : 8); round++) {
        const bool flat = round % 2 == 0;
        vd_mesh *mesh =
            quads(context, test_is_reduced() ? 25 : 40, 9, 70, flat, 40 + (uint64_t)round);
        vd_draw draws[2] = {vd_draw_default(), vd_draw_default()};
        for (int k = 0; k < 2; k++) {
            draws[k].mesh = mesh;
            draws[k].cull = k == 0 ? VD_CULL_NONE : VD_CULL_BACK;
            draws[k].materials = materials;
            draws[k].material_count = 4;
            draws[k].object_id = 9 - (uint64_t)k; /* in the other order than the draws */
            draws[k].shader = vd_shader_find((vd_shading)((2 * round + k) % VD_SHADING_COUNT));
        }
        vd_material more[5];
        memcpy(more, materials, sizeof materials);
        more[4] = materials[1];
        draws[1].materials = more + 1;
        draws[1].shader = round == 3 ? &none : draws[1].shader;
        draws[1].fill = round == 4   ? VD_FILL_WIREFRAME
                        : round == 6 ? VD_FILL_POINTS
                                     : VD_FILL_SOLID;
        draws[1].line_width = 2.5;
        draws[1].point_size = 7.0;
        const vd_camera camera = flat ? flat_camera() : plain_camera(75, 70, 45.0, 0.5);
        vd_raster_def def = vd_raster_def_default();
        def.samples = round % 3 == 0 ? 1 : round % 3 == 1 ? 4 : 8;
        def.tile_pixels = round == 5 ? 16 : round == 7 ? 128 : 0;
        def.background = (vd_rgba8){40, 80, 120, (uint8_t)(round % 2 == 0 ? 255 : 100)};
        compare_all(&def, &camera, draws, 2, 75, 70);
        vd_mesh_destroy(context, &mesh);
    }
    vd_texture_destroy(&texture);
    vd_context_destroy(&context);
}

/* ---- against what is true ---------------------------------------------------------------------*/

/* Colours by primitive, [count][4]. */
static void shade_by_table(const vd_fragments *f) {
    const float(*table)[4] = f->uniforms;
    for (int i = 0; i < VD_BATCH; i++) {
        for (int c = 0; c < 4; c++) {
            f->color[c][i] = table[f->primitive[i]][c];
        }
    }
}

static const vd_shader by_table = {.fragment = shade_by_table};

/* Sheets over the whole picture, in any order, are painted from the farthest to the nearest, more
 * of them than a target's list holds at once. */
static void sheets_are_painted_in_order(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    enum { SHEETS = 29, SOLID = 11 };
    float positions[SHEETS * 9], table[SHEETS][4];
    uint64_t random = 3;
    for (int i = 0; i < SHEETS; i++) {
        const float z = 0.1f + 0.8f * (float)(i * 12 % SHEETS) / SHEETS; /* a permutation */
        const float sheet[9] = {-10, -10, z, -10, 90, z, 90, -10, z};
        memcpy(positions + 9 * i, sheet, sizeof sheet);
        for (int c = 0; c < 4; c++) {
            table[i][c] = (float)test_uniform(&random);
        }
    }
    vd_mesh_def mesh_def = vd_mesh_def_default();
    mesh_def.vertex_count = SHEETS * 3;
    mesh_def.positions = positions;
    const vd_mesh_part parts[3] = {
        {0, SOLID, 0}, {SOLID, 1, 1}, {SOLID + 1, SHEETS - SOLID - 1, 0}};
    mesh_def.parts = parts;
    mesh_def.part_count = 3;
    vd_mesh *mesh = NULL;
    assert_ok(vd_mesh_create(context, &mesh_def, &mesh));
    vd_material materials[2] = {vd_material_default(), vd_material_default()};
    vd_draw draw = vd_draw_default();
    draw.mesh = mesh;
    draw.shader = &by_table;
    draw.uniforms = table;
    draw.materials = materials;
    draw.material_count = 2;
    draw.cull = VD_CULL_NONE;
    const vd_camera camera = flat_camera();
    for (int solid = 0; solid < 2; solid++) { /* with an opaque one among them, and without */
        materials[0].blend = true;
        materials[1].blend = solid == 0;
        table[SOLID][3] = solid == 0 ? 0.5f : 1.0f;
        double expected[4] = {0, 0, 0, 0};
        for (int depth = SHEETS - 1; depth >= 0; depth--) {
            for (int i = 0; i < SHEETS; i++) {
                for (int c = 0; c < 4 && i * 12 % SHEETS == depth; c++) {
                    const double alpha = (double)table[i][3];
                    const double color = c == 3 ? alpha : alpha * (double)table[i][c];
                    expected[c] = color + (1 - alpha) * expected[c];
                }
            }
        }
        vd_raster_def def = vd_raster_def_default();
        def.samples = solid == 0 ? 1 : 4;
        vd_raster_stats stats;
        vd_frame *frame = draw_frame(context, &def, &camera, &draw, 1, 40, 30, &stats);
        assert_int_equal(stats.hits, 40 * 30 * def.samples);
        for (int c = 0; c < 4; c++) {
            assert_true(fabs(frame->rgba[4 * (7 * frame->stride + 9) + (size_t)c] -
                             255 * expected[c]) < 0.6);
        }
        const float z = 0.1f + 0.8f * (float)(SOLID * 12 % SHEETS) / SHEETS;
        assert_true(fabsf(frame->depth[9] - (solid == 0 ? 0.0f : 1.0f - z)) < 1e-6f);
        assert_int_equal(frame->id[9], solid);
        vd_frame_destroy(&frame);
    }
    vd_mesh_destroy(context, &mesh);
    vd_context_destroy(&context);
}

/* A leaf before a wall: where its alpha passes there is the leaf, opaque; elsewhere the wall. */
static void holes_show_what_is_behind(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_texture *texture = leaf(context);
    vd_material material = vd_material_default();
    material.texture = texture;
    material.alpha_test = 0.5f;
    material.filter = VD_TEXTURE_BILINEAR;
    const float wall[9] = {-10, -10, 0.9f, -10, 300, 0.9f, 300, -10, 0.9f};
    const float leaf_at[12] = {0, 0, 0.5f, 128, 0, 0.5f, 128, 128, 0.5f, 0, 128, 0.5f};
    const float uv[8] = {0, 0, 1, 0, 1, 1, 0, 1};
    const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    vd_mesh_def mesh_def = vd_mesh_def_default();
    mesh_def.vertex_count = 4;
    mesh_def.positions = leaf_at;
    mesh_def.uvs = uv;
    mesh_def.index_count = 6;
    mesh_def.indices = indices;
    vd_mesh *mesh = NULL, *behind = soup(context, wall, 3);
    assert_ok(vd_mesh_create(context, &mesh_def, &mesh));
    static const vd_shader none = {.fragment = NULL};
    for (int shading = 0; shading <= VD_SHADING_COUNT; shading++) {
        vd_draw draws[2] = {vd_draw_default(), vd_draw_default()};
        draws[0].mesh = mesh;
        draws[0].materials = &material;
        draws[0].material_count = 1;
        draws[0].shader = shading == VD_SHADING_COUNT ? &none : vd_shader_find((vd_shading)shading);
        draws[1].mesh = behind;
        draws[1].object_id = 2;
        draws[0].cull = draws[1].cull = VD_CULL_NONE;
        draws[1].shader = vd_shader_find(VD_SHADING_DEPTH);
        if (shading == VD_SHADING_PHONG || shading == VD_SHADING_NORMALS) {
            continue; /* the mesh has no normals */
        }
        const vd_camera camera = flat_camera();
        const vd_raster_def def = vd_raster_def_default();
        vd_frame *frame = draw_frame(context, &def, &camera, draws, 2, 128, 128, NULL);
        for (int y = 0; y < 128; y++) {
            for (int x = 0; x < 128; x++) {
                const double d = hypot(x + 0.5 - 64, y + 0.5 - 64) / 4; /* half alpha: at 12.5 */
                const size_t at = (size_t)y * frame->stride + (size_t)x;
                if (fabs(d - 12.5) > 0.5) {
                    assert_int_equal(frame->id[at], d < 12.5 ? 1 : 2);
                    assert_true(fabsf(frame->depth[at] - (d < 12.5 ? 0.5f : 0.1f)) < 1e-6f);
                }
                assert_true(frame->rgba[4 * at + 3] == 255 || shading == VD_SHADING_COUNT);
            }
        }
        vd_frame_destroy(&frame);
    }
    vd_mesh_destroy(context, &mesh);
    vd_mesh_destroy(context, &behind);
    vd_texture_destroy(&texture);
    vd_context_destroy(&context);
}

/* Tiles of any place and size, drawn and blended by hand, make the picture that render makes. */
static void windows_make_the_picture(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_texture *texture = leaf(context);
    vd_material materials[4];
    make_materials(texture, materials);
    vd_mesh *mesh = quads(context, test_is_reduced() ? 25 : 80, 7, 150, true, 5);
    vd_draw draw = vd_draw_default();
    draw.mesh = mesh;
    draw.cull = VD_CULL_NONE;
    draw.materials = materials;
    draw.material_count = 4;
    const vd_camera camera = flat_camera();
    vd_raster_def def = vd_raster_def_default();
    def.samples = 4;
    for (int m = 0; m < VD_RASTER_METHOD_COUNT; m++) {
        def.method = (vd_raster_method)m;
        vd_frame *expected = draw_frame(context, &def, &camera, &draw, 1, 150, 140, NULL);
        vd_raster *raster = NULL;
        vd_target *target = NULL;
        vd_frame *frame = NULL;
        assert_ok(vd_raster_create(context, &raster));
        assert_ok(vd_target_create(context, 61, 47, 4, &target));
        assert_ok(vd_target_reserve_blended(target));
        assert_ok(vd_frame_create(context, 150, 140, VD_PLANE_DEPTH | VD_PLANE_ID, &frame));
        assert_ok(vd_raster_prepare(raster, NULL, &def, &camera, &draw, 1, frame));
        for (int y = 0; y < 140; y += 47) {
            for (int x = 0; x < 150; x += 61) {
                target->x = x;
                target->y = y;
                target->width = 150 - x < 61 ? 150 - x : 61;
                target->height = 140 - y < 47 ? 140 - y : 47;
                vd_target_clear(target, (uint16_t[4]){0, 0, 0, 0});
                vd_raster_draw(raster, target, 0);
                vd_target_begin_blended(target);
                do {
                    vd_raster_blend(raster, target, 0);
                } while (vd_target_blend(target));
                vd_target_resolve(target, frame);
            }
        }
        assert_same_frames(frame, expected);
        vd_frame_destroy(&frame);
        vd_frame_destroy(&expected);
        vd_target_destroy(&target);
        vd_raster_destroy(&raster);
    }
    vd_mesh_destroy(context, &mesh);
    vd_texture_destroy(&texture);
    vd_context_destroy(&context);
}

/* ---- limits -----------------------------------------------------------------------------------*/

/* Triangles of every kind of material, three of which cover too much. */
static void what_covers_too_much_is_left_out(void **state) {
    (void)state;
    enum { WIDE = 90, HIGH = 50, DRAWS = 4 };
    const float sheets[DRAWS][9] = {{-10, -10, 0.5f, -10, 200, 0.5f, 200, -10, 0.5f},
                                    {10, 10, 0.3f, 10, 20, 0.3f, 20, 10, 0.3f},
                                    {-10, -10, 0.2f, -10, 200, 0.2f, 200, -10, 0.2f},
                                    {30, 10, 0.1f, 30, 20, 0.1f, 40, 10, 0.1f}};
    /* One pixel more a side than between two places: boxes are of whole pixels. */
    const uint64_t areas[DRAWS] = {(WIDE + 1) * (HIGH + 1), 11 * 11, (WIDE + 1) * (HIGH + 1),
                                   11 * 11};
    vd_material materials[3] = {vd_material_default(), vd_material_default(),
                                vd_material_default()};
    materials[1].alpha_test = 0.5f;
    materials[2].blend = true;
    const uint64_t weights[3] = {1, 16, 32};
    vd_context *context = test_context(3, VD_ISA_AUTO);
    vd_draw draws[DRAWS];
    for (int i = 0; i < DRAWS; i++) {
        draws[i] = vd_draw_default();
        draws[i].mesh = soup(context, sheets[i], 3);
        draws[i].cull = VD_CULL_NONE;
        draws[i].shader = vd_shader_find(VD_SHADING_FLAT);
        draws[i].material_count = 1;
    }
    const vd_camera camera = flat_camera();
    vd_raster_stats stats;
    for (int kind = 0; kind < 3; kind++) {
        uint64_t all = 0;
        for (int i = 0; i < DRAWS; i++) {
            draws[i].materials = &materials[kind];
            all += weights[kind] * areas[i];
        }
        for (int m = 0; m < VD_RASTER_METHOD_COUNT; m++) {
            vd_raster_def def = vd_raster_def_default();
            def.samples = 4;
            def.method = (vd_raster_method)m;
            vd_frame *two = draw_frame(context, &def, &camera, draws, 2, WIDE, HIGH, NULL);
            vd_frame *four = draw_frame(context, &def, &camera, draws, 4, WIDE, HIGH, NULL);
            for (int k = 0; k < 2; k++) {
                def.most_pixels = k == 0 ? all : weights[kind] * (2 * areas[0] + areas[1] - 1);
                vd_frame *got = draw_frame(context, &def, &camera, draws, 4, WIDE, HIGH, &stats);
                assert_same_frames(got, k == 0 ? four : two);
                assert_int_equal(stats.left_out, 2 * k);
                assert_int_equal(stats.covered, all);
                vd_frame_destroy(&got);
            }
            vd_frame_destroy(&two);
            vd_frame_destroy(&four);
        }
    }
    vd_raster_def def = vd_raster_def_default();
    def.most_pixels = 1000000; /* culled, it covers nothing */
    for (int k = 0; k < 2; k++) {
        draws[0].cull = k == 0 ? VD_CULL_BACK : VD_CULL_FRONT;
        vd_frame *got = draw_frame(context, &def, &camera, draws, 1, WIDE, HIGH, &stats);
        assert_true((stats.covered == 0) == (stats.hits == 0));
        vd_frame_destroy(&got);
    }
    for (int i = 0; i < DRAWS; i++) {
        vd_mesh_destroy(context, (vd_mesh **)&draws[i].mesh);
    }
    vd_context_destroy(&context);
}

/* Of 29 sheets of glass the farthest are seen. */
static void layers_have_a_bound(void **state) {
    (void)state;
    enum { SHEETS = 29 };
    float positions[SHEETS * 9];
    for (int i = 0; i < SHEETS; i++) {
        const float z = 0.9f - 0.8f * (float)i / SHEETS; /* the farthest first */
        const float sheet[9] = {-10, -10, z, -10, 90, z, 90, -10, z};
        memcpy(positions + 9 * i, sheet, sizeof sheet);
    }
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_material glass = vd_material_default();
    glass.blend = true;
    glass.alpha = 0.3f;
    vd_draw draw = vd_draw_default();
    draw.materials = &glass;
    draw.material_count = 1;
    draw.cull = VD_CULL_NONE;
    draw.shader = vd_shader_find(VD_SHADING_FLAT);
    const vd_camera camera = flat_camera();
    static const int limits[][2] = {{0, SHEETS}, {1, 8}, {8, 8}, {9, 16}, {24, 24}, {25, SHEETS}};
    for (size_t i = 0; i < sizeof limits / sizeof limits[0]; i++) {
        vd_mesh *all = soup(context, positions, 3 * SHEETS);
        vd_mesh *far = soup(context, positions, 3 * (size_t)limits[i][1]);
        vd_raster_def def = vd_raster_def_default();
        draw.mesh = far;
        vd_frame *expected = draw_frame(context, &def, &camera, &draw, 1, 40, 30, NULL);
        def.most_layers = limits[i][0];
        draw.mesh = all;
        vd_frame *got = draw_frame(context, &def, &camera, &draw, 1, 40, 30, NULL);
        assert_same_frames(got, expected);
        vd_frame_destroy(&got);
        vd_frame_destroy(&expected);
        vd_mesh_destroy(context, &all);
        vd_mesh_destroy(context, &far);
    }
    vd_raster_def def = vd_raster_def_default();
    vd_frame *frame = NULL;
    vd_raster *raster = NULL;
    assert_ok(vd_frame_create(context, 4, 4, 0, &frame));
    assert_ok(vd_raster_create(context, &raster));
    def.most_layers = -1;
    const vd_status status = vd_raster_render(raster, NULL, &def, &camera, &draw, 0, frame, NULL);
    assert_int_equal(status.code, VD_ERROR_ARGUMENT);
    assert_non_null(strstr(status.message, "most_layers"));
    vd_raster_destroy(&raster);
    vd_frame_destroy(&frame);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(methods_agree),
        cmocka_unit_test(sheets_are_painted_in_order),
        cmocka_unit_test(holes_show_what_is_behind),
        cmocka_unit_test(windows_make_the_picture),
        cmocka_unit_test(what_covers_too_much_is_left_out),
        cmocka_unit_test(layers_have_a_bound),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
