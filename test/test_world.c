/* A world's tree, and its pictures. */
#include <math.h>
#include <veduta/veduta.h>
#include "image/blended.h"
#include "image/image.h"
#include "raster/raster_run.h"
#include "terrain/lens_renderer.h"
#include "world_scenes.h"

/* ---- ids --------------------------------------------------------------------------------------*/

static void ids_are_paths(void **state) {
    (void)state;
    const uint64_t a = vd_object_child_id(0, 1), b = vd_object_child_id(a, 255);
    assert_true(a == (uint64_t)1 << 56 && b == ((uint64_t)1 << 56 | (uint64_t)255 << 48));
    assert_true(vd_object_parent_id(b) == a && vd_object_parent_id(a) == 0);
    assert_int_equal(vd_object_depth(0), 0);
    assert_int_equal(vd_object_depth(b), 2);
    assert_true(vd_object_is_within(b, a) && vd_object_is_within(b, 0) &&
                vd_object_is_within(a, a));
    assert_false(vd_object_is_within(a, b) || vd_object_is_within(vd_object_child_id(0, 2), a));
    uint64_t deep = 0;
    for (int i = 0; i < VD_OBJECT_MAX_DEPTH; i++) {
        deep = vd_object_child_id(deep, 7);
    }
    assert_int_equal(vd_object_depth(deep), 8);
    assert_true(vd_object_child_id(deep, 1) == 0);
    assert_true(vd_object_child_id(a, 0) == 0 && vd_object_child_id(a, 256) == 0);
}

static vd_frame *draw_world(vd_context *context, const vd_world *world, const vd_camera *camera,
                            int samples, vd_world_stats *stats) {
    vd_world_renderer_def def = vd_world_renderer_def_default();
    def.samples = samples;
    vd_world_renderer *renderer = NULL;
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, WIDTH, HEIGHT, VD_PLANE_DEPTH | VD_PLANE_ID, &frame));
    assert_ok(vd_world_renderer_create(context, NULL, world, &def, &renderer));
    assert_ok(vd_world_renderer_draw(renderer, NULL, camera, frame, stats));
    const uint64_t hash = vd_frame_hash(frame);
    const uint64_t before = vd_context_memory(context).allocations;
    assert_ok(vd_world_renderer_draw(renderer, NULL, camera, frame, stats));
    assert_true(vd_context_memory(context).allocations == before); /* a warm frame */
    assert_true(vd_frame_hash(frame) == hash);
    vd_world_renderer_destroy(&renderer);
    return frame;
}

/* ---- the tree ---------------------------------------------------------------------------------*/

static size_t walk(const vd_world *world, uint64_t id, uint64_t *sum) {
    const int children = vd_world_child_count(world, id);
    const vd_object *object = vd_world_find(world, id);
    size_t count = 0;
    vd_vec3 min, max;
    if (id != 0) {
        assert_non_null(object);
        assert_true(object->id == id);
        vd_object_bounds(object, &min, &max);
    }
    for (int i = 1; i <= children; i++) {
        const uint64_t child = vd_object_child_id(id, i);
        const vd_object *below = vd_world_find(world, child);
        vd_vec3 low, high;
        assert_non_null(below);
        vd_object_bounds(below, &low, &high);
        if (id != 0) { /* to the rounding of floats relative to an anchor */
            assert_true(low.x >= min.x - 1e-3 && low.y >= min.y - 1e-3 && low.z >= min.z - 1e-3);
            assert_true(high.x <= max.x + 1e-3 && high.y <= max.y + 1e-3 && high.z <= max.z + 1e-3);
        }
        count += walk(world, child, sum);
    }
    assert_null(vd_world_find(world, vd_object_child_id(id, children + 1)));
    *sum ^= id * (uint64_t)(children + 3);
    return children == 0 ? 1 : count;
}

static void the_tree_holds_everything_once(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    static const int counts[] = {0, 1, 15, 16, 17, 250, 3000};
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
        const vd_vec3 middle = {0, 0, 0};
        vd_heightfield *map = hills(context, middle);
        vd_world *world = make_world(context, map, middle, counts[i], 5);
        vd_world *again = make_world(context, map, middle, counts[i], 5);
        uint64_t sums[2] = {0, 0};
        assert_int_equal(walk(world, 0, &sums[0]), counts[i] + 3);
        assert_int_equal(walk(again, 0, &sums[1]), counts[i] + 3);
        assert_true(sums[0] == sums[1]);
        vd_world_destroy(&world);
        vd_world_destroy(&again);
        vd_heightfield_destroy(context, &map);
    }
    vd_context_destroy(&context);
}

/* ---- pictures ---------------------------------------------------------------------------------*/

static void moving_the_world_changes_no_byte(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    static const int samples[] = {1, 4};
    for (int s = 0; s < 2; s++) {
        vd_frame *frames[2];
        for (int i = 0; i < 2; i++) {
            const vd_vec3 middle =
                i == 0 ? vd_vec3_make(0, 0, 0) : vd_vec3_make(1e7 + 0.25, -1e7 + 0x1p-10, 0);
            vd_heightfield *map = hills(context, middle);
            vd_world *world = make_world(context, map, middle, 60, 9);
            const vd_camera camera = looking(middle);
            vd_world_stats stats;
            frames[i] = draw_world(context, world, &camera, samples[s], &stats);
            assert_true(stats.drawn > 10 && stats.outside > 5);
            vd_world_destroy(&world);
            vd_heightfield_destroy(context, &map);
        }
        assert_same_frames(frames[0], frames[1]);
        vd_frame_destroy(&frames[0]);
        vd_frame_destroy(&frames[1]);
    }
    vd_context_destroy(&context);
}

static void threads_and_levels_change_no_byte(void **state) {
    (void)state;
    const vd_vec3 middle = {0, 0, 0};
    vd_frame *first = NULL;
    vd_context *keeper = test_context(1, VD_ISA_AUTO);
    static const int threads[] = {1, 2, 7};
    for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
        for (int t = 0; t < 3; t++) {
            vd_context *context = test_context(threads[t], (vd_isa)isa);
            vd_heightfield *map = hills(context, middle);
            vd_world *world = make_world(context, map, middle, 60, 9);
            const vd_camera camera = looking(middle);
            vd_frame *frame = draw_world(context, world, &camera, 4, NULL);
            if (first == NULL) {
                assert_ok(
                    vd_frame_create(keeper, WIDTH, HEIGHT, VD_PLANE_DEPTH | VD_PLANE_ID, &first));
                memcpy(first->rgba, frame->rgba, frame->stride * HEIGHT * 4);
                memcpy(first->depth, frame->depth, frame->stride * HEIGHT * 4);
                memcpy(first->id, frame->id, frame->stride * HEIGHT * 4);
            }
            assert_same_frames(first, frame);
            vd_frame_destroy(&frame);
            vd_world_destroy(&world);
            vd_heightfield_destroy(context, &map);
            vd_context_destroy(&context);
        }
    }
    vd_frame_destroy(&first);
    vd_context_destroy(&keeper);
}

/* Pixels that show things are those of a target in which the terrain takes all samples; the others
 * are the terrain's own picture. */
static void things_and_ground_meet_sample_by_sample(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    const vd_vec3 middle = {0, 0, 0};
    vd_heightfield *map = hills(context, middle);
    vd_world *world = make_world(context, map, middle, 120, 3);
    const vd_camera camera = looking(middle);
    vd_world_renderer *renderer = NULL;
    vd_world_renderer_def def = vd_world_renderer_def_default();
    def.samples = 4;
    vd_frame *frame = NULL, *all = NULL, *ground = NULL;
    const unsigned planes = VD_PLANE_DEPTH | VD_PLANE_ID;
    assert_ok(vd_frame_create(context, WIDTH, HEIGHT, planes, &frame));
    assert_ok(vd_frame_create(context, WIDTH, HEIGHT, planes, &all));
    assert_ok(vd_frame_create(context, WIDTH, HEIGHT, planes, &ground));
    assert_ok(vd_world_renderer_create(context, NULL, world, &def, &renderer));
    vd_sun_map_destroy(&renderer->sun_map); /* shadows are looked at in test_sun_map */
    assert_ok(vd_world_renderer_draw(renderer, NULL, &camera, frame, NULL));

    /* What was rasterized is still there: into one target, all samples of the ground over it. */
    vd_target *target = NULL;
    uint32_t id = 0;
    assert_ok(vd_target_create(context, WIDTH, HEIGHT, 4, &target));
    vd_target_clear(target, (uint16_t[4]){0, 0, 0, 0});
    vd_raster_draw(renderer->raster, target, 0);
    assert_ok(vd_frame_add_object(all, renderer->ground->def.object_id, &id));
    assert_ok(vd_terrain_renderer_composite(renderer->ground, NULL, &camera, all, target, NULL));
    assert_ok(vd_target_reserve_blended(target));
    vd_target_begin_blended(target);
    do {
        vd_raster_blend(renderer->raster, target, 0);
    } while (vd_target_blend(target));
    vd_target_resolve(target, all);
    assert_ok(vd_terrain_renderer_draw(renderer->ground, NULL, &camera, ground, NULL));

    int mixed = 0, plain = 0;
    for (int y = 0; y < HEIGHT; y++) {
        for (int x = 0; x < WIDTH; x++) {
            const size_t i = (size_t)y * frame->stride + (size_t)x;
            bool thing = false;
            for (int s = 0; s < 4; s++) {
                const size_t at =
                    (size_t)s * target->plane + (size_t)y * target->stride + (size_t)x;
                thing = thing || (target->id[at] != 0 && target->id[at] != id) ||
                        vd_blended_any(&target->blended[at]);
            }
            const vd_frame *wanted = thing ? all : ground;
            mixed += thing && frame->id[i] == id;
            plain += !thing;
            assert_memory_equal(frame->rgba + 4 * i, wanted->rgba + 4 * i, 4);
            assert_memory_equal(frame->depth + i, wanted->depth + i, 4);
        }
    }
    assert_true(mixed > 50 && plain > 1000);
    vd_target_destroy(&target);
    vd_frame_destroy(&frame);
    vd_frame_destroy(&all);
    vd_frame_destroy(&ground);
    vd_world_renderer_destroy(&renderer);
    vd_world_destroy(&world);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

/* A picture that faces the viewer stands half behind ridges: by rays through pixel centres, where
 * neither the picture's edge nor the ridge is near. */
static void sprites_stand_behind_ridges(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    const vd_vec3 middle = {0, 0, 0};
    vd_heightfield *map = hills(context, middle);
    vd_camera camera = looking(middle); /* from a valley */
    camera.eye.z = vd_heightfield_height_at(map, camera.eye.x, camera.eye.y) + 8;
    camera.orientation = vd_orientation_from_angles(0.1, 0.02, 0.0);
    vd_frame *ground = NULL, *frame = NULL;
    vd_terrain_def terrain = vd_terrain_def_default();
    terrain.heightfield = map;
    terrain.samples = 1;
    assert_ok(vd_frame_create(context, WIDTH, HEIGHT, VD_PLANE_DEPTH, &ground));
    assert_ok(vd_frame_create(context, WIDTH, HEIGHT, VD_PLANE_DEPTH | VD_PLANE_ID, &frame));
    assert_ok(vd_terrain_render(context, NULL, &terrain, &camera, ground, NULL));
    uint64_t random = 4;
    int seen = 0, hidden = 0;
    for (int scene = 0; scene < 150; scene++) {
        vd_world *world = make_world(context, map, middle, 0, 1);
        const double x = 500 * test_uniform(&random) - 250, y = 450 * test_uniform(&random) - 350;
        const vd_sprite_def def = {1, vd_vec3_make(x, y, vd_world_ground(world, x, y) - 2), 60, 80,
                                   false};
        vd_object *object = NULL;
        assert_ok(vd_sprite_create(context, &def, &object));
        const vd_vec3 foot = object->anchor;
        assert_ok(vd_world_add(world, &object));
        assert_ok(vd_world_arrange(world, NULL));
        const uint64_t id = world->entries[world->entry_list.count - 1].object->id;
        vd_world_renderer_def with = vd_world_renderer_def_default();
        with.samples = 1;
        vd_world_renderer *renderer = NULL;
        assert_ok(vd_world_renderer_create(context, NULL, world, &with, &renderer));
        assert_ok(vd_world_renderer_draw(renderer, NULL, &camera, frame, NULL));
        const vd_vec3 away = vd_vec3_subtract(foot, camera.eye);
        const vd_vec3 right = vd_vec3_normalize(
            vd_vec3_cross(vd_vec3_make(away.x, away.y, 0), vd_vec3_make(0, 0, 1)));
        const vd_vec3 normal = vd_vec3_cross(right, vd_vec3_make(0, 0, 1));
        for (int py = 0; py < HEIGHT; py++) {
            for (int px = 0; px < WIDTH; px++) {
                const size_t at = (size_t)py * frame->stride + (size_t)px;
                const vd_ray ray = vd_camera_ray(&camera, px + 0.5, py + 0.5);
                const double t = vd_vec3_dot(away, normal) / vd_vec3_dot(ray.direction, normal);
                const vd_vec3 p = vd_vec3_subtract(vd_vec3_scale(ray.direction, t), away);
                const double u = vd_vec3_dot(p, right) / 60, v = p.z / 80 - 0.5;
                const double far = vd_camera_distance(&camera, ground->depth[at]);
                if (!(t > camera.near_m && t < 600) || u * u + v * v > 0.02 ||
                    fabs(t - far) < 0.02 * t) {
                    continue;
                }
                const uint64_t shown = frame->object_ids[frame->id[at]];
                if (t < far) {
                    seen++; /* another sprite and a line stand in the world, too */
                    assert_true(shown == id || frame->depth[at] > ground->depth[at]);
                } else {
                    hidden++;
                    assert_true(shown != id);
                }
            }
        }
        vd_world_renderer_destroy(&renderer);
        vd_world_destroy(&world);
    }
    assert_true(seen > 300 && hidden > 300);
    vd_frame_destroy(&ground);
    vd_frame_destroy(&frame);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

/* What the horizon hides is not seen. */
static void what_is_hidden_is_not_seen(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    const vd_vec3 middle = {0, 0, 0};
    vd_heightfield *map = hills(context, middle);
    uint64_t random = 5, hidden = 0;
    vd_world *world = make_world(context, map, middle, 400, 3);
    for (int i = 0; i < 40; i++) {
        vd_camera camera = looking(middle);
        camera.eye =
            vd_vec3_make(1200 * test_uniform(&random) - 600, 1200 * test_uniform(&random) - 600, 0);
        camera.eye.z =
            vd_world_ground(world, camera.eye.x, camera.eye.y) + 2 + 60 * test_uniform(&random);
        camera.orientation = vd_orientation_from_angles(6.28 * test_uniform(&random),
                                                        -0.2 * test_uniform(&random), 0);
        vd_frame *frames[2] = {NULL, NULL};
        for (int k = 0; k < 2; k++) {
            vd_world_renderer *renderer = NULL;
            vd_world_stats stats;
            assert_ok(vd_frame_create(context, WIDTH, HEIGHT, VD_PLANE_DEPTH, &frames[k]));
            assert_ok(vd_world_renderer_create(context, NULL, world, NULL, &renderer));
            if (k == 1) {
                vd_horizon_map_destroy(&renderer->horizon_map);
            }
            assert_ok(vd_world_renderer_draw(renderer, NULL, &camera, frames[k], &stats));
            assert_true(stats.objects ==
                        stats.drawn + stats.hidden + stats.outside + stats.too_small);
            hidden += stats.hidden;
            vd_world_renderer_destroy(&renderer);
        }
        assert_memory_equal(frames[0]->rgba, frames[1]->rgba, frames[0]->stride * HEIGHT * 4);
        assert_memory_equal(frames[0]->depth, frames[1]->depth, frames[0]->stride * HEIGHT * 4);
        vd_frame_destroy(&frames[0]);
        vd_frame_destroy(&frames[1]);
    }
    assert_true(hidden > 500);
    vd_world_destroy(&world);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

/* A picture of one object has its pixels and no other's. */
static void an_object_alone_is_cut_out(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    const vd_vec3 middle = {0, 0, 0};
    vd_heightfield *map = hills(context, middle);
    vd_world *world = make_world(context, map, middle, 40, 3);
    const vd_camera camera = looking(middle);
    vd_world_renderer *renderer = NULL;
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, WIDTH, HEIGHT, VD_PLANE_DEPTH | VD_PLANE_ID, &frame));
    assert_ok(vd_world_renderer_create(context, NULL, world, NULL, &renderer));
    int shown = 0;
    for (int i = 0; i < (int)vd_world_object_count(world); i++) {
        const uint64_t id = world->entries[i].object->id;
        vd_world_stats stats;
        assert_ok(vd_world_renderer_draw_object(renderer, NULL, &camera, id, frame, &stats));
        bool any = false;
        for (int y = 0; y < HEIGHT; y++) {
            for (int x = 0; x < WIDTH; x++) {
                const size_t at = (size_t)y * frame->stride + (size_t)x;
                any = any || frame->rgba[4 * at + 3] != 0;
                assert_true(frame->id[at] == 0 || frame->object_ids[frame->id[at]] == id);
                assert_true(frame->id[at] == 0 || frame->rgba[4 * at + 3] > 0);
            }
        }
        shown += any;
        assert_true(vd_world_renderer_cost(renderer, id) > 0.0);
        assert_true(!any || stats.drawn == 1);
    }
    assert_true(shown > 10);
    assert_int_equal(vd_world_renderer_draw_object(renderer, NULL, &camera, 99, frame, NULL).code,
                     VD_ERROR_ARGUMENT);
    vd_frame_destroy(&frame);
    vd_world_renderer_destroy(&renderer);
    vd_world_destroy(&world);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

/* Without a terrain things stand before the sky, the first of them too. */
static void a_world_needs_no_terrain(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    const vd_vec3 points[2] = {{-50, 200, 5}, {50, 200, 5}};
    const vd_line_def line = {
        .points = points, .count = 2, .width_px = 6.0, .color = {255, 0, 0, 255}};
    vd_world *world = NULL;
    vd_object *object = NULL;
    assert_ok(vd_world_create(context, NULL, &world));
    assert_ok(vd_line_create(context, &line, &object));
    assert_ok(vd_world_add(world, &object));
    assert_ok(vd_world_arrange(world, NULL));
    vd_camera camera = {.eye = {0, 0, 10}};
    camera.orientation = vd_orientation_look_at(camera.eye, vd_vec3_make(0, 200, 5));
    camera.lens = vd_lens_from_fov(0.6, WIDTH, HEIGHT);
    camera.near_m = 0.1;
    for (int samples = 1; samples <= 8; samples = samples == 1 ? 4 : 2 * samples) {
        vd_world_stats stats;
        vd_frame *frame = draw_world(context, world, &camera, samples, &stats);
        const size_t middle = (size_t)(HEIGHT / 2) * frame->stride + WIDTH / 2;
        assert_true(stats.drawn == 1);
        assert_int_equal(frame->rgba[4 * middle], 255);
        assert_int_equal(frame->rgba[4 * middle + 1], 0);
        assert_true(frame->id[middle] != 0 && frame->id[0] == 0);
        vd_frame_destroy(&frame);
    }
    vd_world_destroy(&world);
    vd_context_destroy(&context);
}

/* ---- blocks -----------------------------------------------------------------------------------*/

static void blocks_are_checked(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const vd_vec3 middle = {0, 0, 0};
    vd_heightfield *map = hills(context, middle);
    vd_world *world = make_world(context, map, middle, 3, 3);
    const double outline[5][2] = {{0, 0}, {5, 0}, {5, -7}, {2, -9}, {0, -7}};
    static const uint8_t verbs[5] = {VD_PATH_MOVE, VD_PATH_LINE, VD_PATH_LINE, VD_PATH_QUADRATIC,
                                     VD_PATH_CLOSE};
    const vd_label_def label = {
        .text = "Mönch",
        .place = {3, 4, 5},
        .outline = {.points = outline, .point_count = 5, .verbs = verbs, .verb_count = 5},
        .advance = 6,
        .ascent = 9,
        .descent = 2,
        .priority = 3};
    vd_object *made = NULL;
    assert_ok(vd_label_create(context, &label, &made));
    assert_string_equal(vd_label_text((const vd_label *)made), "Mönch");
    assert_ok(vd_world_add(world, &made));
    uint64_t random = 11;
    for (size_t i = 0; i < vd_world_object_count(world); i++) {
        const vd_object *object = world->entries[i].object;
        const size_t bytes = object->size_bytes;
        vd_object *copy = NULL;
        assert_ok(vd_object_unpack(context, object, bytes, &copy));
        assert_memory_equal(copy, object, bytes);
        for (size_t cut = 0; cut < bytes; cut += 1 + bytes / 50) {
            assert_int_equal(vd_object_validate(copy, cut).code, VD_ERROR_FORMAT);
        }
        for (int k = 0; k < 2000; k++) { /* found wrong, or harmless: never beyond the block */
            memcpy(copy, object, bytes);
            ((uint8_t *)copy)[test_random(&random) % bytes] = (uint8_t)test_random(&random);
            const vd_status status = vd_object_validate(copy, bytes);
            assert_true(status.code == VD_OK || status.code == VD_ERROR_FORMAT);
        }
        vd_vec3 points[VD_OBJECT_KEY_POINTS];
        assert_int_equal(vd_object_key_points(object, points), 8);
        vd_object_destroy(context, &copy);
    }
    vd_world_destroy(&world);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ids_are_paths),
        cmocka_unit_test(the_tree_holds_everything_once),
        cmocka_unit_test(moving_the_world_changes_no_byte),
        cmocka_unit_test(threads_and_levels_change_no_byte),
        cmocka_unit_test(things_and_ground_meet_sample_by_sample),
        cmocka_unit_test(sprites_stand_behind_ridges),
        cmocka_unit_test(what_is_hidden_is_not_seen),
        cmocka_unit_test(an_object_alone_is_cut_out),
        cmocka_unit_test(a_world_needs_no_terrain),
        cmocka_unit_test(blocks_are_checked),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
