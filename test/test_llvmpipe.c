/* The same frame by Mesa's llvmpipe, where it is installed, from vertices rounded alike: no pixel
 * is covered by one only, and greys are at most one level apart, lit colours four (but where a
 * normal is at right angles to the view, and rounding decides which of its sides is lit: a handful
 * of pixels on the outline). */
#include "raster_scenes.h"
#include <unistd.h>

enum { SIZE = 700 };

static const char program[] = VEDUTA_BINARY_DIR "/veduta-llvmpipe";

/* A ball with a rough skin, as the peer reads it and as a mesh. */
static vd_mesh *make_ball(vd_context *context, const char *path) {
    vd_mesh *smooth = sphere(context, 60, 90, 1.0, vd_vec3_make(0.03, -0.02, 0));
    const uint32_t count = smooth->vertex_count, triangles = smooth->primitive_count;
    float *p = malloc((size_t)count * 3 * sizeof *p);
    uint64_t random = 4;
    for (uint32_t i = 0; i < count; i++) {
        const float stretch = 0.97f + 0.06f * (float)test_uniform(&random);
        for (int axis = 0; axis < 3; axis++) {
            p[3 * i + (uint32_t)axis] = vd_mesh_positions(smooth, axis)[i] * stretch;
        }
    }
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fwrite("VDBENCH1", 1, 8, file);
    fwrite(&count, 4, 1, file);
    fwrite(&triangles, 4, 1, file);
    fwrite(p, 12, count, file);
    fwrite(vd_mesh_indices(smooth), 12, triangles, file);
    fclose(file);
    vd_mesh_def def = vd_mesh_def_default();
    def.vertex_count = count;
    def.positions = p;
    def.index_count = smooth->index_count;
    def.indices = vd_mesh_indices(smooth);
    def.compute_normals = true;
    vd_mesh *mesh = NULL;
    assert_ok(vd_mesh_create(context, &def, &mesh));
    vd_mesh_destroy(context, &smooth);
    free(p);
    return mesh;
}

/* Draws by the peer; null where there is none. */
static uint8_t *draw_peer(const char *model, const char *shading, const vd_camera *camera) {
    char command[2048], out[] = "/tmp/veduta-llvmpipe-XXXXXX";
    const int file = mkstemp(out);
    assert_true(file >= 0);
    close(file);
    const vd_matrix project = vd_camera_matrix(camera);
    const vd_matrix move = vd_matrix_translation(vd_vec3_scale(camera->eye, -1.0));
    const vd_matrix m = vd_matrix_multiply(&project, &move);
    int at = snprintf(command, sizeof command, "'%s' '%s' %d %s", program, model, SIZE, shading);
    for (int i = 0; i < 16; i++) {
        at += snprintf(command + at, sizeof command - (size_t)at, " %.9g", m.m[i / 4][i % 4]);
    }
    snprintf(command + at, sizeof command - (size_t)at, " 1 0 '%s' >/dev/null 2>&1", out);
    const size_t bytes = (size_t)SIZE * SIZE * 4;
    uint8_t *pixels = NULL;
    if (system(command) == 0) {
        FILE *in = fopen(out, "rb");
        pixels = malloc(bytes);
        assert_non_null(in);
        assert_int_equal(fread(pixels, 1, bytes, in), bytes);
        fclose(in);
    }
    unlink(out);
    return pixels;
}

static void compare(const vd_frame *frame, const uint8_t *peer, int tolerance) {
    int covered = 0, differing = 0, apart = 0;
    for (int y = 0; y < SIZE; y++) {
        for (int x = 0; x < SIZE; x++) {
            const size_t at = (size_t)y * frame->stride + (size_t)x;
            const uint8_t *mine = frame->rgba + 4 * at;
            const uint8_t *theirs = peer + 4 * ((size_t)y * SIZE + (size_t)x);
            const bool here = frame->id[at] != 0;
            covered += here;
            differing += here != (theirs[0] != 0 || theirs[1] != 0 || theirs[2] != 0);
            int worst = 0;
            for (int c = 0; c < 3; c++) {
                const int difference = abs(mine[c] - theirs[c]);
                worst = difference > worst ? difference : worst;
            }
            apart += worst > tolerance;
        }
    }
    assert_true(covered > SIZE * SIZE / 3);
    assert_int_equal(differing, 0);
    assert_true(apart <= (tolerance > 1 ? 4 : 0));
}

static void llvmpipe_draws_the_same(void **state) {
    (void)state;
    if (access(program, X_OK) != 0) {
        skip();
    }
    char path[] = "/tmp/veduta-ball-XXXXXX";
    const int file = mkstemp(path);
    assert_true(file >= 0);
    close(file);
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_mesh *mesh = make_ball(context, path);
    /* As `veduta bench raster` looks: along −z, y up. */
    const vd_quat down =
        vd_quat_from_axes(vd_vec3_make(1, 0, 0), vd_vec3_make(0, -1, 0), vd_vec3_make(0, 0, -1));
    vd_camera cameras[2] = {
        {.eye = {0, 0, 2},
         .orientation = down,
         .projection = VD_PROJECTION_ORTHOGRAPHIC,
         .lens = {330, 330, 350, 350},
         .near_m = 0.2,
         .far_m = 4},
        {.eye = {0.1, 0, 3}, .orientation = down, .lens = {900, 900, 340.5, 351}, .near_m = 1.5}};
    bool started = true;
    for (int i = 0; i < 3; i++) {
        const vd_shading shading = i == 2 ? VD_SHADING_PHONG : VD_SHADING_DEPTH;
        const vd_camera *camera = &cameras[i % 2];
        uint8_t *peer = draw_peer(path, vd_shading_name(shading), camera);
        if (peer == NULL) {
            started = false; /* the program is there, but Mesa does not start */
            break;
        }
        vd_draw draw = vd_draw_default();
        draw.mesh = mesh;
        draw.shader = vd_shader_find(shading);
        vd_raster_def def = vd_raster_def_default();
        def.background = (vd_rgba8){0, 0, 0, 255};
        vd_frame *frame = draw_frame(context, &def, camera, &draw, 1, SIZE, SIZE, NULL);
        compare(frame, peer, shading == VD_SHADING_PHONG ? 4 : 1);
        vd_frame_destroy(&frame);
        free(peer);
    }
    unlink(path);
    vd_mesh_destroy(context, &mesh);
    vd_context_destroy(&context);
    if (!started) {
        skip();
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(llvmpipe_draws_the_same)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
