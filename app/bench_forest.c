/* bench_forest.c: Mont Blanc with a forest and names on it, for the cases that fly through it. */
#include "bench_forest.h"
#include "bench_cloud.h"

#include <math.h>
#include <unistd.h>

enum { TREES = 1000, NAMES = 50, RINGS = 21, SECTORS = 12 }; /* 504 triangles a tree */

/* A fir as a body of revolution, 18 m high, its outline in steps. */
static vd_status make_tree(vd_context *context, vd_model **out) {
    static double positions[(RINGS + 1) * SECTORS][3];
    static uint32_t triangles[2 * RINGS * SECTORS][3];
    for (int r = 0; r <= RINGS; r++) {
        const double up = (double)r / RINGS, step = (r % 4) / 4.0;
        const double radius = r == 0 ? 0.3 : r == RINGS ? 0.0 : 4.0 * (1.0 - up) * (1.2 - step);
        for (int s = 0; s < SECTORS; s++) {
            const double angle = 2.0 * 3.14159265358979323846 * s / SECTORS;
            positions[r * SECTORS + s][0] = radius * cos(angle);
            positions[r * SECTORS + s][1] = radius * sin(angle);
            positions[r * SECTORS + s][2] = 18.0 * up;
        }
    }
    size_t count = 0;
    for (uint32_t r = 0; r < RINGS; r++) {
        for (uint32_t s = 0; s < SECTORS; s++) {
            const uint32_t next = (s + 1) % SECTORS, a = r * SECTORS, b = a + SECTORS;
            const uint32_t two[2][3] = {{a + s, a + next, b + s}, {a + next, b + next, b + s}};
            for (int t = 0; t < 2; t++, count++) {
                for (int k = 0; k < 3; k++) {
                    triangles[count][k] = two[t][k];
                }
            }
        }
    }
    vd_material green = vd_model_clay();
    green.albedo = (vd_linear){0.05f, 0.12f, 0.04f};
    const vd_model_surface surface = {.name = "fir", .texture = -1};
    const vd_model_source source = {.name = "fir",
                                    .format = "bench",
                                    .z_up = true,
                                    .vertex_count = (RINGS + 1) * SECTORS,
                                    .positions = (const double(*)[3])positions,
                                    .triangle_count = count,
                                    .triangles = (const uint32_t(*)[3])triangles,
                                    .material_count = 1,
                                    .materials = &green,
                                    .surfaces = &surface};
    return vd_model_create(context, &source, out);
}

static double uniform(uint64_t *state) {
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) * 0x1p-53;
}

/* A forest ahead of the camera, where it looks. */
static vd_status plant(bench_forest *w, uint32_t model, vd_vec3 min, vd_vec3 max) {
    uint64_t random = 1;
    vd_status status = vd_success();
    const vd_vec3 ahead = vd_quat_rotate(w->s.camera.orientation, vd_vec3_make(0, 0, 1));
    for (int i = 0; i < TREES && status.code == VD_OK; i++) {
        const double along = 300.0 + 3000.0 * uniform(&random);
        const double beside = 1.4 * along * (uniform(&random) - 0.5);
        const double x = w->s.camera.eye.x + ahead.x * along - ahead.y * beside;
        const double y = w->s.camera.eye.y + ahead.y * along + ahead.x * beside;
        const double turn = 6.28 * uniform(&random), size = 0.7 + 0.6 * uniform(&random);
        const vd_matrix turned =
            vd_matrix_rotation(vd_quat_from_axis_angle(vd_vec3_make(0, 0, 1), turn));
        const vd_matrix scaled = vd_matrix_scaling(vd_vec3_make(size, size, size));
        const vd_matrix moved =
            vd_matrix_translation(vd_vec3_make(x, y, vd_world_ground(w->world, x, y)));
        vd_instance_def def = {.model = model, .min = min, .max = max};
        def.transform = vd_matrix_multiply(&turned, &scaled);
        def.transform = vd_matrix_multiply(&moved, &def.transform);
        vd_object *object = NULL;
        if (isfinite(def.transform.m[2][3])) {
            status = vd_instance_create(w->s.context, &def, &object);
        }
        if (object != NULL) {
            status = vd_world_add(w->world, &object);
        }
        vd_object_destroy(w->s.context, &object);
    }
    return status;
}

/* Names among the trees; boxes stand for letters, which cost as much by their edges. */
static vd_status add_names(bench_forest *w) {
    static const double box[4][2] = {{0, 0}, {90, 0}, {90, -14}, {0, -14}};
    static const uint8_t verbs[5] = {VD_PATH_MOVE, VD_PATH_LINE, VD_PATH_LINE, VD_PATH_LINE,
                                     VD_PATH_CLOSE};
    uint64_t random = 2;
    vd_status status = vd_success();
    const vd_vec3 ahead = vd_quat_rotate(w->s.camera.orientation, vd_vec3_make(0, 0, 1));
    for (int i = 0; i < NAMES && status.code == VD_OK; i++) {
        const double along = 500.0 + 8000.0 * uniform(&random);
        const double beside = 1.4 * along * (uniform(&random) - 0.5);
        const double x = w->s.camera.eye.x + ahead.x * along - ahead.y * beside;
        const double y = w->s.camera.eye.y + ahead.y * along + ahead.x * beside;
        const vd_label_def def = {
            .text = "name",
            .place = {x, y, vd_world_ground(w->world, x, y)},
            .outline = {.points = box, .point_count = 4, .verbs = verbs, .verb_count = 5},
            .advance = 90.0f,
            .ascent = 14.0f,
            .color = {255, 255, 255, 255},
            .halo = {0, 0, 0, 160},
            .priority = i};
        vd_object *object = NULL;
        if (isfinite(def.place.z)) {
            status = vd_label_create(w->s.context, &def, &object);
        }
        if (object != NULL) {
            status = vd_world_add(w->world, &object);
        }
        vd_object_destroy(w->s.context, &object);
    }
    return status;
}

vd_vec3 bench_forest_middle(const bench_forest *w) {
    const vd_vec3 ahead = vd_quat_rotate(w->s.camera.orientation, vd_vec3_make(0, 0, 1));
    vd_vec3 middle = vd_vec3_add(w->s.camera.eye, vd_vec3_scale(ahead, 1600.0));
    const double ground = vd_world_ground(w->world, middle.x, middle.y);
    middle.z = isfinite(ground) ? ground : middle.z;
    return middle;
}

static vd_status add_cloud(bench_forest *w, const bench_forest_cloud *cloud) {
    enum { MOST_OF_OBJECT = 100000 };
    vd_particles_place place = {.centre = bench_forest_middle(w), .size = 1000.0};
    size_t objects;
    place.centre.z += 500.0;
    const vd_status status = access(cloud->path, F_OK) == 0
                                 ? vd_success()
                                 : bench_cloud_write(cloud->path, cloud->count, &place);
    return status.code == VD_OK ? bench_cloud_add(w->s.context, w->world, cloud->path, true,
                                                  MOST_OF_OBJECT, &objects)
                                : status;
}

static vd_status make_world(bench_forest *w, const bench_forest_cloud *cloud) {
    const vd_world_def def = {w->s.terrain};
    vd_model *tree = NULL;
    uint32_t number = 0;
    vd_vec3 min, max;
    vd_status status = vd_world_create(w->s.context, &def, &w->world);
    if (status.code == VD_OK) {
        status = make_tree(w->s.context, &tree);
    }
    if (status.code == VD_OK) {
        vd_model_bounds(tree, &min, &max);
        status = vd_world_add_model(w->world, &tree, &number);
    }
    if (status.code == VD_OK) {
        status = plant(w, number, min, max);
    }
    if (status.code == VD_OK) {
        status = add_names(w);
    }
    if (status.code == VD_OK && cloud != NULL) {
        status = add_cloud(w, cloud);
    }
    if (status.code == VD_OK) {
        status = vd_world_arrange(w->world, NULL);
    }
    vd_model_destroy(&tree);
    return status;
}

vd_status bench_forest_init(bench_forest *w, const bench_run *run, const bench_camera *camera,
                            const bench_forest_cloud *cloud, vd_isa isa, int threads, int width,
                            int height) {
    *w = (bench_forest){.world = NULL};
    vd_status status =
        bench_scene_init(&w->s, run, BENCH_MAP_METRES, 0, isa, threads, width, height);
    if (status.code != VD_OK) {
        return status;
    }
    bench_set_camera(&w->s, camera);
    bench_set_everything(&w->s);
    return make_world(w, cloud);
}

vd_status bench_forest_renderer(bench_forest *w, int samples) {
    vd_world_renderer_def def = vd_world_renderer_def_default();
    def.samples = samples;
    return vd_world_renderer_create(w->s.context, NULL, w->world, &def, &w->renderer);
}

void bench_forest_finish(bench_forest *w) {
    vd_world_renderer_destroy(&w->renderer);
    vd_world_destroy(&w->world);
    bench_scene_finish(&w->s);
}

vd_camera bench_forest_camera(const bench_forest *w, int frame) {
    const int phase = frame % BENCH_FLIGHT;
    const double way = phase < BENCH_FLIGHT / 2 ? phase : BENCH_FLIGHT - phase;
    vd_camera camera = w->s.camera;
    const vd_vec3 ahead = vd_quat_rotate(camera.orientation, vd_vec3_make(0, 0, 1));
    camera.eye = vd_vec3_add(camera.eye, vd_vec3_scale(ahead, way));
    return camera;
}
