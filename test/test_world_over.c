/* Names and furniture over a world's picture. */
#include "world_scenes.h"

/* A name of an outline that is a box of 30 × 10 pixels. */
static void add_name(vd_context *context, vd_world *world, vd_vec3 place, vd_label_hidden hidden,
                     double priority) {
    static const double box[4][2] = {{0, 0}, {30, 0}, {30, -10}, {0, -10}};
    static const uint8_t verbs[5] = {VD_PATH_MOVE, VD_PATH_LINE, VD_PATH_LINE, VD_PATH_LINE,
                                     VD_PATH_CLOSE};
    const vd_label_def def = {
        .text = "box",
        .place = place,
        .outline = {.points = box, .point_count = 4, .verbs = verbs, .verb_count = 5},
        .advance = 30,
        .ascent = 10,
        .color = {255, 0, 255, 255},
        .priority = priority,
        .hidden = hidden};
    vd_object *object = NULL;
    assert_ok(vd_label_create(context, &def, &object));
    assert_ok(vd_world_add(world, &object));
}

static int count_pink(const vd_frame *frame) {
    int count = 0;
    for (int y = 0; y < frame->height; y++) {
        for (int x = 0; x < frame->width; x++) {
            const uint8_t *p = frame->rgba + 4 * ((size_t)y * frame->stride + (size_t)x);
            count += p[0] == 255 && p[1] == 0 && p[2] == 255;
        }
    }
    return count;
}

static int draw_names(vd_context *context, vd_world *world, const vd_camera *camera,
                      vd_world_stats *stats) {
    vd_world_renderer *renderer = NULL;
    vd_frame *frame = NULL;
    assert_ok(vd_world_arrange(world, NULL));
    assert_ok(vd_frame_create(context, WIDTH, HEIGHT, 0, &frame));
    assert_ok(vd_world_renderer_create(context, NULL, world, NULL, &renderer));
    assert_ok(vd_world_renderer_draw(renderer, NULL, camera, frame, stats));
    const uint64_t before = vd_context_memory(context).allocations;
    assert_ok(vd_world_renderer_draw(renderer, NULL, camera, frame, stats));
    assert_true(vd_context_memory(context).allocations == before);
    assert_null(frame->depth);
    const int pink = count_pink(frame);
    vd_frame_destroy(&frame);
    vd_world_renderer_destroy(&renderer);
    return pink;
}

/* Behind the hills, on them, beside the picture. */
static void names_are_seen_where_their_places_are(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    const vd_vec3 middle = {0, 0, 0};
    vd_heightfield *map = hills(context, middle);
    const vd_camera camera = looking(middle);
    /* The truth: where a ray through a pixel ends on the ground, and a place well behind it. */
    vd_frame *ground = NULL;
    vd_terrain_def terrain = vd_terrain_def_default();
    terrain.heightfield = map;
    assert_ok(vd_frame_create(context, WIDTH, HEIGHT, VD_PLANE_DEPTH, &ground));
    assert_ok(vd_terrain_render(context, NULL, &terrain, &camera, ground, NULL));
    int tried = 0;
    for (int y = 60; y < HEIGHT - 4; y += 13) {
        for (int x = 20; x < WIDTH - 20; x += 31) {
            const float depth = ground->depth[(size_t)y * ground->stride + (size_t)x];
            if (!(depth > 0.0f)) {
                continue;
            }
            const vd_ray ray = vd_camera_ray(&camera, x + 0.5, y + 0.5);
            const double t = vd_camera_distance(&camera, depth);
            for (int k = 0; k < 3; k++) { /* on it; far behind, hidden; the same, shown */
                vd_world *world = make_world(context, map, middle, 0, 1);
                const double at = k == 0 ? t : 1.3 * t + 20;
                add_name(context, world, vd_vec3_add(ray.origin, vd_vec3_scale(ray.direction, at)),
                         k == 2 ? VD_LABEL_SHOW : VD_LABEL_HIDE, 1);
                vd_world_stats stats;
                const int pink = draw_names(context, world, &camera, &stats);
                assert_int_equal(stats.labels, 1);
                assert_int_equal(stats.labels_shown, k != 1);
                assert_true(k == 1 ? pink == 0 : pink >= 9 * 29);
                vd_world_destroy(&world);
            }
            tried++;
        }
    }
    assert_true(tried > 8);
    vd_frame_destroy(&ground);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

/* Many names at one place: none over another, the first by priority. */
static void names_keep_apart(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    const vd_vec3 middle = {0, 0, 0};
    vd_heightfield *map = hills(context, middle);
    vd_world *world = make_world(context, map, middle, 0, 1);
    const vd_camera camera = looking(middle);
    for (int i = 0; i < 60; i++) {
        add_name(context, world, vd_vec3_make(i - 30, 0, 60), VD_LABEL_HIDE, i);
    }
    add_name(context, world, vd_vec3_make(0, -9000, 60), VD_LABEL_SHOW, 100); /* behind */
    vd_world_stats stats;
    const int pink = draw_names(context, world, &camera, &stats);
    assert_int_equal(stats.labels, 60);
    assert_true(stats.labels_shown >= 2);
    assert_true(pink >= (int)stats.labels_shown * 9 * 29);
    vd_world_destroy(&world);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

/* ---- furniture --------------------------------------------------------------------------------*/

typedef struct furniture {
    vd_layer layer;
    float kept[1][4];
    bool fails;
} furniture;

static vd_status give(void *user, const vd_camera *camera, int width, int height, vd_overlay *out) {
    furniture *f = user;
    (void)camera;
    assert_true(width == WIDTH && height == HEIGHT);
    if (f->fails) {
        return vd_failure(VD_ERROR_IO, "no furniture today");
    }
    *out = (vd_overlay){&f->layer, 1, (const float(*)[4])f->kept, 1};
    return vd_success();
}

static void furniture_lies_over_all(void **state) {
    (void)state;
    static const double corners[4][2] = {{2, 2}, {140, 2}, {140, 50}, {2, 50}};
    vd_context *context = test_context(2, VD_ISA_AUTO);
    const vd_vec3 middle = {0, 0, 0};
    vd_heightfield *map = hills(context, middle);
    vd_world *world = make_world(context, map, middle, 0, 1);
    const vd_camera camera = looking(middle);
    furniture f = {.layer = vd_layer_default(), .kept = {{2, 2, 140, 50}}};
    f.layer.path.points = corners;
    f.layer.path.point_count = 4;
    add_name(context, world, vd_vec3_make(0, 0, 62), VD_LABEL_SHOW, 1);
    assert_ok(vd_world_arrange(world, NULL));
    vd_world_renderer_def def = vd_world_renderer_def_default();
    def.overlay = give;
    def.overlay_user = &f;
    vd_world_renderer *renderer = NULL;
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, WIDTH, HEIGHT, 0, &frame));
    assert_ok(vd_world_renderer_create(context, NULL, world, &def, &renderer));
    assert_ok(vd_world_renderer_draw(renderer, NULL, &camera, frame, NULL));
    for (int y = 2; y < 50; y++) { /* nothing of the name, nothing of the world */
        for (int x = 2; x < 140; x++) {
            const uint8_t *p = frame->rgba + 4 * ((size_t)y * frame->stride + (size_t)x);
            assert_true(p[0] == 0 && p[1] == 0 && p[2] == 0 && p[3] == 255);
        }
    }
    f.fails = true;
    const vd_status status = vd_world_renderer_draw(renderer, NULL, &camera, frame, NULL);
    assert_int_equal(status.code, VD_ERROR_IO);
    assert_string_equal(status.message, "no furniture today");
    vd_frame_destroy(&frame);
    vd_world_renderer_destroy(&renderer);
    vd_world_destroy(&world);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(names_are_seen_where_their_places_are),
        cmocka_unit_test(names_keep_apart),
        cmocka_unit_test(furniture_lies_over_all),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
