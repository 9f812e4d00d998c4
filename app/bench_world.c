/* bench_world.c: a world in motion: Mont Blanc with a forest on it, and a camera that flies. */
#include "bench.h"

#include <math.h>

enum { TREES = 1000, NAMES = 50, RINGS = 21, SECTORS = 12 }; /* 504 triangles a tree */

typedef struct world_scene {
    bench_scene s;
    vd_world *world;
    vd_world_renderer *renderer;
    vd_impostors *impostors; /* null: everything is drawn itself */
    vd_frame *deep;          /* a frame with depth, which they want */
    vd_world_stats stats;    /* of the last picture */
    vd_impostor_stats shown; /* likewise */
    int frame;
} world_scene;

static void finish(world_scene *w) {
    vd_impostors_destroy(&w->impostors);
    vd_frame_destroy(&w->deep);
    vd_world_renderer_destroy(&w->renderer);
    vd_world_destroy(&w->world);
    bench_scene_finish(&w->s);
}

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
static vd_status plant(world_scene *w, uint32_t model, vd_vec3 min, vd_vec3 max) {
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
static vd_status add_names(world_scene *w) {
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

static vd_status make_world(world_scene *w) {
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
    if (status.code == VD_OK) {
        status = vd_world_arrange(w->world, NULL);
    }
    vd_model_destroy(&tree);
    return status;
}

/* The next picture of a flight at 60 m/s, 60 pictures a second, there and back in 4 s. */
static vd_status draw_next(void *user) {
    world_scene *w = user;
    const int phase = w->frame++ % 240;
    const double way = phase < 120 ? phase : 240 - phase;
    vd_camera camera = w->s.camera;
    const vd_vec3 ahead = vd_quat_rotate(camera.orientation, vd_vec3_make(0, 0, 1));
    camera.eye = vd_vec3_add(camera.eye, vd_vec3_scale(ahead, way));
    if (w->impostors != NULL) {
        const vd_status status = vd_impostors_update(w->impostors, NULL, &camera, w->deep->width,
                                                     w->deep->height, w->frame / 60.0, NULL);
        return status.code == VD_OK
                   ? vd_impostors_draw(w->impostors, NULL, &camera, w->deep, &w->shown)
                   : status;
    }
    return vd_world_renderer_draw(w->renderer, NULL, &camera, w->s.frame, &w->stats);
}

/* Impostors, once round the flight, so that those that can be there are. */
static vd_status begin_impostors(world_scene *w) {
    vd_status status =
        vd_impostors_create(w->s.context, w->world, w->renderer, NULL, &w->impostors);
    if (status.code == VD_OK) {
        status = vd_frame_create(w->s.context, w->s.frame->width, w->s.frame->height,
                                 VD_PLANE_DEPTH, &w->deep);
    }
    for (int i = 0; i < 240 && status.code == VD_OK; i++) {
        status = draw_next(w);
    }
    return status;
}

static vd_status measure(bench_run *run, const bench_case *self, world_scene *w, const char *method,
                         int samples, bool impostors) {
    vd_world_renderer_def def = vd_world_renderer_def_default();
    def.samples = samples;
    vd_status status = vd_world_renderer_create(w->s.context, NULL, w->world, &def, &w->renderer);
    bench_result result = bench_result_of(self, method);
    result.threads = vd_context_threads(w->s.context);
    result.isa = vd_context_isa(w->s.context);
    result.width = w->s.frame->width;
    result.height = w->s.frame->height;
    if (samples == 1) {
        result.target_fps = bench_target_fps(self, result.isa, result.threads);
    }
    w->frame = 0;
    if (status.code == VD_OK && impostors) {
        status = begin_impostors(w);
    }
    if (status.code == VD_OK) {
        status = bench_measure(run, draw_next, w, bench_wall_ms, &result);
    }
    const vd_world_stats *t = &w->stats;
    snprintf(result.note, sizeof result.note, "%u of %u; ms: %.1f ground, %.1f prepare, %.1f rest",
             (unsigned)t->drawn, (unsigned)t->objects, 1e3 * t->ground_s, 1e3 * t->prepare_s,
             1e3 * (t->objects_s + t->finish_s));
    if (impostors) {
        const vd_impostor_stats *i = &w->shown;
        snprintf(result.note, sizeof result.note,
                 "%u shown, %u direct; ms: %.1f direct, %.1f shown, %.1f drawn", (unsigned)i->shown,
                 (unsigned)i->direct, 1e3 * i->direct_s, 1e3 * i->show_s, 1e3 * i->draw_s);
    }
    vd_impostors_destroy(&w->impostors);
    vd_world_renderer_destroy(&w->renderer);
    return status.code == VD_OK ? bench_add(run, &result) : status;
}

static vd_status measure_size(bench_run *run, const bench_case *self, vd_isa isa, int threads,
                              double scale, const char *method, int samples, bool impostors) {
    world_scene w = {.frame = 0};
    vd_status status =
        bench_scene_init(&w.s, run, BENCH_MAP_METRES, 0, isa, threads,
                         (int)(self->width * scale + 0.5), (int)(self->rows * scale + 0.5));
    if (status.code != VD_OK) {
        return status;
    }
    bench_set_camera(&w.s, self->camera);
    bench_set_everything(&w.s);
    status = make_world(&w);
    if (status.code == VD_OK) {
        status = measure(run, self, &w, method, samples, impostors);
    }
    finish(&w);
    return status;
}

vd_status bench_world(bench_run *run, const bench_case *self) {
    static const struct {
        const char *method;
        double scale;
        int samples;
        bool impostors;
    } ways[] = {{"moving, 3/4", 0.75, 1, false},
                {"moving", 1.0, 1, false},
                {"impostors, 3/4", 0.75, 1, true},
                {"impostors", 1.0, 1, true},
                {"still", 1.0, 4, false}};
    vd_status status = vd_success();
    for (int i = 0; i < run->isa_count; i++) {
        for (int t = 0; t < run->thread_count; t++) {
            for (size_t k = 0; k < sizeof ways / sizeof ways[0] && status.code == VD_OK; k++) {
                status = measure_size(run, self, run->isas[i], run->threads[t], ways[k].scale,
                                      ways[k].method, ways[k].samples, ways[k].impostors);
            }
        }
    }
    return status;
}
