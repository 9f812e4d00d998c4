/* test_app_forest.c: `veduta generate forest`, from outside. */
#include "support.h"

#include <fcntl.h>
#include <math.h>
#include <spawn.h>
#include <stdio.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <veduta/veduta.h>

extern char **environ;

static const char *const program = VEDUTA_BINARY_DIR "/veduta";
static const char *const heights = VEDUTA_SOURCE_DIR "/data/mont-blanc.png";
static char folder[] = VEDUTA_BINARY_DIR "/test-app-forest-XXXXXX";
static char out[1 << 16], err[1 << 14];

static size_t read_back(const char *path, char *text, size_t bytes) {
    FILE *file = fopen(path, "rb");
    const size_t length = file != NULL ? fread(text, 1, bytes - 1, file) : 0;
    text[length] = '\0';
    if (file != NULL) {
        fclose(file);
    }
    return length;
}

static int run(const char *const *arguments, int count) {
    char *argv[32] = {(char *)program, "generate", "forest"};
    for (int i = 0; i < count; i++) {
        argv[i + 3] = (char *)arguments[i];
    }
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 1, "out.txt", O_WRONLY | O_CREAT | O_TRUNC, 0644);
    posix_spawn_file_actions_addopen(&actions, 2, "err.txt", O_WRONLY | O_CREAT | O_TRUNC, 0644);
    pid_t child = 0;
    if (posix_spawn(&child, program, &actions, NULL, argv, environ) != 0) {
        fail_msg("cannot start %s; build veduta-program first", program);
    }
    posix_spawn_file_actions_destroy(&actions);
    int status = 0;
    assert_int_equal(waitpid(child, &status, 0), child);
    (void)read_back("out.txt", out, sizeof out);
    (void)read_back("err.txt", err, sizeof err);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

#define COUNT(...) ((int)(sizeof((const char *[]){__VA_ARGS__}) / sizeof(char *)))
#define FOREST(...) run((const char *[]){__VA_ARGS__}, COUNT(__VA_ARGS__))

static void expect_success(int got) {
    if (got != 0) {
        fail_msg("status %d: %s", got, err);
    }
}

/* One sentence, nothing on standard output. */
static void expect_failure(int got, int status, const char *part) {
    if (got != status || strstr(err, part) == NULL) {
        fail_msg("status %d, expected %d and \"%s\": %s", got, status, part, err);
    }
    assert_string_equal(out, "");
    assert_ptr_equal(strchr(err, '\n'), err + strlen(err) - 1);
}

#define FAILS(status, part, ...) expect_failure(FOREST(__VA_ARGS__), status, part)

typedef struct one_tree {
    double x, y, heading, scale;
    bool leafy;
} one_tree;

/* Reads the instances: each stands on a line of its own. */
static int read_trees(const char *path, one_tree *trees, int most) {
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    char line[4096];
    int count = 0;
    bool leafy = false;
    while (fgets(line, sizeof line, file) != NULL) {
        one_tree t;
        if (strstr(line, "\"mesh\"") != NULL) {
            leafy = strstr(line, "broadleaf") != NULL || strstr(line, "birch") != NULL;
        } else if (sscanf(line, " [%lf, %lf, %lf, %lf]", &t.x, &t.y, &t.heading, &t.scale) == 4) {
            t.leafy = leafy;
            assert_true(count < most);
            trees[count++] = t;
        }
    }
    fclose(file);
    return count;
}

static vd_heightfield *load_map(vd_context *context) {
    vd_dem_def def = vd_dem_def_default();
    def.cell_size_m = 75.0;
    vd_dem *dem = NULL;
    vd_heightfield *map = NULL;
    assert_ok(vd_dem_load(context, heights, &def, &dem));
    assert_ok(vd_heightfield_from_dem(dem, NULL, NULL, &map));
    vd_dem_destroy(&dem);
    return map;
}

static void trees_stand_where_they_grow(void **state) {
    (void)state;
    static one_tree trees[3000];
    expect_success(FOREST(heights, "--cell-size", "75", "-o", "woods", "--count", "3000"));
    assert_int_equal(read_trees("woods/forest.json", trees, 3000), 3000);
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_heightfield *map = load_map(context);
    double leafy_height = 0, bare_height = 0, nearest = INFINITY;
    int leafy = 0;
    for (int i = 0; i < 3000; i++) {
        const one_tree *t = &trees[i];
        const double h = vd_heightfield_height_at(map, t->x, t->y);
        assert_true(h > 0 && h < 2000);
        assert_true(t->heading >= 0 && t->heading < 360 && t->scale > 0.25 && t->scale < 1.3);
        const double dx = vd_heightfield_height_at(map, t->x + 1, t->y) - h;
        const double dy = vd_heightfield_height_at(map, t->x, t->y + 1) - h;
        assert_true(sqrt(dx * dx + dy * dy) < 2.0);
        *(t->leafy ? &leafy_height : &bare_height) += h;
        leafy += t->leafy;
        for (int k = 0; k < i; k++) {
            const double x = trees[k].x - t->x, y = trees[k].y - t->y;
            nearest = sqrt(x * x + y * y) < nearest ? sqrt(x * x + y * y) : nearest;
        }
    }
    /* 3,000 over 2,000 km² of which half are too high: 600 m apart if they were even. */
    assert_true(nearest > 30.0);
    assert_true(leafy > 300 && leafy < 2700);
    assert_true(leafy_height / leafy + 150 < bare_height / (3000 - leafy));
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

static void a_grove(void **state) {
    (void)state;
    static one_tree trees[500];
    expect_success(FOREST(heights, "--cell-size", "75", "-o", "grove", "-n", "500", "--center",
                          "24000,-9000", "--radius", "400"));
    assert_int_equal(read_trees("grove/forest.json", trees, 500), 500);
    for (int i = 0; i < 500; i++) {
        const double x = trees[i].x - 24000, y = trees[i].y + 9000;
        assert_true(x * x + y * y < 401.0 * 401.0);
    }
}

static void meshes_are_models(void **state) {
    (void)state;
    static const char *const names[] = {"conifer", "larch", "broadleaf", "birch"};
    expect_success(FOREST(heights, "-o", "meshes", "-n", "1", "--tree-line", "9000"));
    vd_context *context = test_context(1, VD_ISA_AUTO);
    for (int i = 0; i < 4; i++) {
        char path[64];
        snprintf(path, sizeof path, "meshes/tree-%s.obj", names[i]);
        vd_model *model = NULL;
        assert_ok(vd_model_load(context, path, NULL, &model));
        const uint32_t triangles = model->meshes[VD_TOPOLOGY_TRIANGLES]->primitive_count;
        assert_true(triangles > 450 && triangles < 550 && model->flat_triangles == 0);
        assert_true(model->material_count >= 4);
        vd_vec3 min, max;
        vd_model_bounds(model, &min, &max);
        assert_true(min.y < 0 && min.y >= -1.0 && max.y > 12 && max.y < 24); /* y is up */
        assert_true(max.x < 9 && min.x > -9 && max.z < 9 && min.z > -9);
        vd_model_destroy(&model);
    }
    vd_context_destroy(&context);
}

static void the_same_seed_the_same_bytes(void **state) {
    (void)state;
    expect_success(FOREST(heights, "-o", "one", "-n", "50", "--seed", "4", "--cell-size", "75"));
    expect_success(FOREST(heights, "-o", "two", "-n", "50", "--seed", "4", "--cell-size", "75"));
    assert_int_equal(system("diff -r one two >diff.txt"), 0);
    expect_success(FOREST(heights, "-o", "two", "-n", "50", "--seed", "5", "--cell-size", "75"));
    assert_int_equal(system("diff -rq one two | wc -l | grep -qx 5"), 0); /* all but tree.mtl */
    /* The path is one from the folder, not from here. */
    static char text[1 << 16];
    assert_int_equal(system("cp " VEDUTA_SOURCE_DIR "/data/mont-blanc.png 'a \"map\".png'"), 0);
    expect_success(FOREST("a \"map\".png", "-o", "one", "-n", "5", "--cell-size", "75"));
    assert_true(read_back("one/forest.json", text, sizeof text) > 0);
    assert_non_null(strstr(text, "{\"veduta_world\": 1,\n \"terrain\": {\"heights\": "
                                 "[\"../a \\\"map\\\".png\"], \"cell_size\": 75}"));
    expect_success(FOREST("a \"map\".png", "-o", ".", "-n", "5"));
    assert_true(read_back("forest.json", text, sizeof text) > 0);
    assert_non_null(strstr(text, "{\"heights\": [\"a \\\"map\\\".png\"]}"));
}

static void failures_have_sentences(void **state) {
    (void)state;
    FAILS(2, "say where the trees are to stand", "-o", "x");
    FAILS(1, "cannot read none.png: No such file", "none.png", "-o", "x");
    FAILS(2, "--center: here is no place", heights, "-o", "x", "--center", "here");
    FAILS(2, "lies beside the map", heights, "-o", "x", "--center", "1e7,0", "--radius", "5");
    FAILS(1, "only 0 of 10 trees find a place: the ground is above the tree line of 100 m", heights,
          "-o", "x", "-n", "10", "--tree-line", "100");
    FAILS(2, "--count", heights, "-o", "x", "-n", "0");
    FILE *file = fopen("file", "wb");
    assert_non_null(file);
    fclose(file);
    FAILS(1, "file is not a folder; give another name", heights, "-o", "file", "-n", "5",
          "--tree-line", "9000");
    FAILS(1, "cannot make the folder none/x", heights, "-o", "none/x", "-n", "5", "--tree-line",
          "9000");
    assert_int_equal(access("x", F_OK), -1);
    assert_int_equal(FOREST("--help"), 0);
    assert_non_null(strstr(out, "usage: veduta generate forest HEIGHTS"));
    assert_non_null(strstr(out, "\"veduta_world\": 1"));
}

static int set_up(void **state) {
    (void)state;
    return test_enter_folder(folder);
}

static int tear_down(void **state) {
    (void)state;
    return test_leave_folder(folder);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(trees_stand_where_they_grow),
        cmocka_unit_test(a_grove),
        cmocka_unit_test(meshes_are_models),
        cmocka_unit_test(the_same_seed_the_same_bytes),
        cmocka_unit_test(failures_have_sentences),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
