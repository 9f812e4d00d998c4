/* Particles as objects of a world. */
#include <math.h>
#include <unistd.h>
#include "particle_scenes.h"
#include "world_scenes.h"

static char folder[] = VEDUTA_BINARY_DIR "/test-world-particles-XXXXXX";

static int set_up(void **state) {
    (void)state;
    return test_enter_folder(folder);
}

static int tear_down(void **state) {
    (void)state;
    return test_leave_folder(folder);
}

enum { COUNT = 40000 };

/* Hills with balls and a cloud around `middle`, and the same without it. */
typedef struct scene {
    vd_context *context;
    vd_heightfield *map;
    vd_world *world, *without;
    const vd_bricks *bricks;
    size_t objects;
} scene;

static void begin(scene *s, int threads, vd_isa isa, vd_vec3 middle, double side,
                  const vd_particle_look *look) {
    const vd_vec3 origin = {0, 0, 0};
    s->context = test_context(threads, isa);
    s->map = hills(s->context, origin);
    s->world = make_world(s->context, s->map, origin, 20, 4);
    s->without = make_world(s->context, s->map, origin, 20, 4);
    vd_bricks *bricks = open_cloud(s->context, "cloud.vdp", COUNT, middle,
                                   vd_vec3_make(side, side, 0.5 * side), 200);
    s->bricks = bricks;
    s->objects = add_cloud(s->world, bricks, look, 1000);
    assert_ok(vd_world_arrange(s->world, NULL));
}

static void end(scene *s) {
    vd_world_destroy(&s->world);
    vd_world_destroy(&s->without);
    vd_heightfield_destroy(s->context, &s->map);
    vd_context_destroy(&s->context);
}

static vd_world_renderer *renderer_of(const scene *s, const vd_world *world) {
    vd_world_renderer *renderer = NULL;
    assert_ok(vd_world_renderer_create(s->context, NULL, world, NULL, &renderer));
    return renderer;
}

static vd_frame *frame_of(const scene *s, unsigned planes) {
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(s->context, WIDTH, HEIGHT, planes, &frame));
    return frame;
}

/* A picture of all of a world. */
static vd_frame *picture_of(const scene *s, const vd_world *world, const vd_camera *camera,
                            unsigned planes, vd_world_stats *stats) {
    vd_world_renderer *renderer = renderer_of(s, world);
    vd_frame *frame = frame_of(s, planes);
    assert_ok(vd_world_renderer_draw(renderer, NULL, camera, frame, stats));
    const uint64_t hash = vd_frame_hash(frame);
    const uint64_t before = vd_context_memory(s->context).allocations;
    assert_ok(vd_world_renderer_draw(renderer, NULL, camera, frame, stats));
    assert_true(vd_context_memory(s->context).allocations == before); /* a warm frame */
    assert_true(vd_frame_hash(frame) == hash);
    vd_world_renderer_destroy(&renderer);
    return frame;
}

/* What a look is for those who draw by hand. */
static void defs_of(const vd_particle_look *look, vd_brick_view_def *view, vd_splat_def *splat) {
    *view = vd_brick_view_def_default();
    view->kernel = splat->kernel = look->kernel;
    view->detail_px = look->detail_px;
    view->color = look->color;
    view->attribute = look->attribute;
    view->constant = look->constant;
    view->radius_m = look->radius_m;
    view->opacity = look->opacity;
    splat->over_frame = true;
    splat->range_min = look->range_min;
    splat->range_max = look->range_max;
}

/* Draws particles by hand over a frame: below `roots`, or all. */
static void draw_by_hand(const scene *s, const vd_particle_look *look, const vd_camera *camera,
                         const uint32_t *roots, size_t count, vd_frame *frame) {
    vd_brick_view_def view_def;
    vd_splat_def splat_def = vd_splat_def_default();
    vd_brick_view *view = NULL;
    vd_splatter *splatter = NULL;
    defs_of(look, &view_def, &splat_def);
    view_def.roots = roots;
    view_def.root_count = count;
    assert_ok(vd_brick_view_create(s->context, s->bricks, &view));
    assert_ok(vd_splatter_create(s->context, &splatter));
    assert_ok(vd_brick_view_update(view, NULL, &view_def, camera, WIDTH, HEIGHT, NULL));
    assert_ok(vd_splatter_render(splatter, NULL, &splat_def, camera, view->splats, view->count,
                                 frame, NULL));
    vd_splatter_destroy(&splatter);
    vd_brick_view_destroy(&view);
}

/* Roots of all particles at and below an id. */
static size_t roots_below(const vd_world *world, uint64_t id, uint32_t *out) {
    const int children = vd_world_child_count(world, id);
    const vd_object *object = vd_world_find(world, id);
    size_t count = 0;
    if (children == 0 && object != NULL && object->kind == VD_OBJECT_PARTICLES) {
        out[count++] = ((const vd_cloud *)object)->root;
    }
    for (int i = 1; i <= children; i++) {
        count += roots_below(world, vd_object_child_id(id, i), out + count);
    }
    return count;
}

static vd_camera camera_from(double x, double y, double z, vd_vec3 at) {
    vd_camera camera = {.eye = {x, y, z}, .near_m = 1.0, .far_m = 1e5};
    camera.orientation = vd_orientation_look_at(camera.eye, at);
    camera.lens = vd_lens_from_fov(0.9, WIDTH, HEIGHT);
    return camera;
}

static const vd_vec3 cloud_middle = {0, 0, 60}, cloud_size = {90, 80, 60};

/* ---- objects ----------------------------------------------------------------------------------*/

static void a_file_becomes_objects(void **state) {
    (void)state;
    scene s;
    const vd_particle_look look = cloud_look();
    begin(&s, 1, VD_ISA_AUTO, cloud_middle, 300, &look);
    static uint32_t roots[COUNT];
    uint64_t leaves = 0;
    assert_true(s.objects > 40);
    assert_int_equal(roots_below(s.world, 0, roots), s.objects);
    assert_int_equal(vd_world_object_count(s.world), vd_world_object_count(s.without) + s.objects);
    for (size_t i = 0; i < s.objects; i++) {
        const vd_bricks_node *n = &s.bricks->nodes[roots[i]];
        leaves += n->leaves;
        assert_true(n->leaves <= 1000);
    }
    assert_int_equal(leaves, COUNT); /* each particle once */
    for (size_t i = 0; i < vd_world_object_count(s.world); i++) {
        const vd_object *object = s.world->entries[i].object;
        if (object->kind == VD_OBJECT_PARTICLES) {
            const vd_bricks_node *n = &s.bricks->nodes[((const vd_cloud *)object)->root];
            vd_vec3 min, max, points[VD_OBJECT_KEY_POINTS];
            vd_object_bounds(object, &min, &max);
            assert_true(min.x <= n->min[0] - 0.5 && min.z <= n->min[2] - 0.5);
            assert_true(max.y >= n->max[1] + 0.5 && max.y < n->max[1] + 2.0);
            assert_int_equal(vd_object_key_points(object, points), 8);
        }
    }
    assert_string_equal(vd_object_kind_name(VD_OBJECT_PARTICLES), "particles");
    end(&s);
}

static void assert_refused(vd_status status, vd_code code, const char *part) {
    assert_int_equal(status.code, code);
    if (strstr(status.message, part) == NULL) {
        fail_msg("\"%s\" does not say \"%s\"", status.message, part);
    }
}

static void bad_input_is_refused(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_world *world = NULL;
    assert_ok(vd_world_create(context, NULL, &world));
    vd_bricks *bricks = open_cloud(context, "few.vdp", 500, cloud_middle, cloud_size, 64);
    uint32_t number = 0;
    const struct {
        vd_particle_look look;
        const char *part;
    } looks[] = {
        {{.color = VD_BRICK_COLOR_VALUE, .attribute = 7}, "attribute"},
        {{.color = VD_BRICK_COLOR_RGB}, "colours of their own"},
        {{.color = VD_BRICK_COLOR_COUNT}, "colour"},
        {{.opacity = 2.0}, "opacity"},
        {{.radius_m = NAN}, "radius"},
        {{.kernel = VD_SPLAT_KERNEL_COUNT}, "kernel"},
        {{.range_min = 3, .range_max = 2}, "range"},
        {{.range_min = -3, .range_max = 2, .log = true}, "range"},
        {{.range_max = INFINITY}, "range"},
    };
    for (size_t i = 0; i < sizeof looks / sizeof looks[0]; i++) {
        assert_refused(vd_world_add_bricks(world, &bricks, &looks[i].look, &number),
                       VD_ERROR_ARGUMENT, looks[i].part);
        assert_non_null(bricks);
    }
    assert_refused(vd_world_add_particles(world, 0, 0, NULL), VD_ERROR_ARGUMENT, "brick file 0");
    const uint32_t nodes = bricks->node_count;
    assert_ok(vd_world_add_bricks(world, &bricks, NULL, &number));
    assert_null(bricks);
    const struct {
        vd_cloud_def def;
        const char *part;
    } clouds[] = {
        {{.bricks = 1, .root = 0}, "brick file 1"},
        {{.bricks = 0, .root = nodes}, "root"},
    };
    for (size_t i = 0; i < 2; i++) {
        vd_object *object = NULL;
        assert_ok(vd_cloud_create(context, &clouds[i].def, &object));
        assert_refused(vd_world_add(world, &object), VD_ERROR_ARGUMENT, clouds[i].part);
        vd_object_destroy(context, &object);
    }
    vd_object *none = NULL;
    const vd_cloud_def turned = {.min = {1, 0, 0}}, endless = {.max = {0, INFINITY, 0}};
    assert_refused(vd_cloud_create(context, &turned, &none), VD_ERROR_ARGUMENT, "bounds");
    assert_int_equal(vd_cloud_create(context, &endless, &none).code, VD_ERROR_ARGUMENT);
    assert_null(none);
    size_t count = 0; /* a brick with more than asked for stays one */
    assert_ok(vd_world_add_particles(world, number, 1, &count));
    assert_true(count > 3);
    vd_world_destroy(&world);
    vd_context_destroy(&context);
}

static void blocks_are_checked(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const vd_cloud_def def = {3, 9, {-5, 2, 1}, {4, 3, 2}};
    vd_object *object = NULL, *copy = NULL;
    uint64_t random = 12;
    assert_ok(vd_cloud_create(context, &def, &object));
    const size_t bytes = object->size_bytes;
    assert_ok(vd_object_unpack(context, object, bytes, &copy));
    assert_memory_equal(copy, object, bytes);
    assert_int_equal(((const vd_cloud *)copy)->root, 9);
    for (size_t cut = 0; cut < bytes; cut++) {
        assert_int_equal(vd_object_validate(copy, cut).code, VD_ERROR_FORMAT);
    }
    for (int k = 0; k < 5000; k++) { /* found wrong, or harmless */
        memcpy(copy, object, bytes);
        ((uint8_t *)copy)[test_random(&random) % bytes] = (uint8_t)test_random(&random);
        const vd_status status = vd_object_validate(copy, bytes);
        assert_true(status.code == VD_OK || status.code == VD_ERROR_FORMAT);
    }
    vd_object_destroy(context, &copy);
    vd_object_destroy(context, &object);
    vd_context_destroy(&context);
}

/* ---- pictures ---------------------------------------------------------------------------------*/

/* A world's picture is that of all else with the particles drawn over it, whatever is culled. */
static void as_drawn_by_hand(void **state) {
    (void)state;
    const vd_camera cameras[] = {
        camera_from(-30, -420, 160, cloud_middle), /* all in view */
        camera_from(20, -120, 90, vd_vec3_make(60, 40, 30)),
        camera_from(10, 5, 62, vd_vec3_make(100, 20, 50)), /* within */
    };
    for (int kind = 0; kind < 3; kind++) {
        vd_particle_look look = cloud_look();
        look.detail_px = kind == 0 ? 0.5 : -1.0;
        look.color = kind == 2 ? VD_BRICK_COLOR_VALUE : VD_BRICK_COLOR_CONSTANT;
        look.attribute = 0;
        look.range_max = kind == 2 ? 1.5 : 0.0;
        scene s;
        begin(&s, 2, VD_ISA_AUTO, cloud_middle, 250, &look);
        for (int c = 0; c < (kind == 0 ? 1 : 3); c++) {
            vd_world_stats stats, bare;
            const unsigned planes = VD_PLANE_DEPTH | VD_PLANE_ID;
            vd_frame *frame = picture_of(&s, s.world, &cameras[c], planes, &stats);
            vd_frame *rgba = picture_of(&s, s.world, &cameras[c], 0, &stats);
            vd_frame *hand = picture_of(&s, s.without, &cameras[c], planes, &bare);
            assert_true(stats.particles > 1000 && stats.particles_for >= stats.particles);
            assert_true(bare.particles == 0 && vd_frame_hash(frame) != vd_frame_hash(hand));
            draw_by_hand(&s, &look, &cameras[c], NULL, 0, hand);
            for (int y = 0; y < HEIGHT; y++) { /* the trees differ, and with them the ids */
                const size_t at = (size_t)y * hand->stride;
                assert_memory_equal(frame->rgba + 4 * at, hand->rgba + 4 * at, 4 * WIDTH);
                assert_memory_equal(frame->depth + at, hand->depth + at, 4 * WIDTH);
            }
            assert_true(vd_frame_hash(rgba) == vd_frame_hash(frame)); /* with depth lent */
            assert_null(rgba->depth);
            vd_frame_destroy(&frame);
            vd_frame_destroy(&rgba);
            vd_frame_destroy(&hand);
        }
        end(&s);
    }
}

static void what_is_behind_a_hill_is_hidden(void **state) {
    (void)state;
    const vd_particle_look look = cloud_look();
    scene s;
    begin(&s, 2, VD_ISA_AUTO, vd_vec3_make(0, 0, -90), 50, &look); /* in the ground */
    const vd_camera camera = camera_from(-30, -420, 160, cloud_middle);
    vd_world_stats stats;
    vd_frame *frame = picture_of(&s, s.world, &camera, VD_PLANE_DEPTH, &stats);
    vd_frame *bare = picture_of(&s, s.without, &camera, VD_PLANE_DEPTH, NULL);
    assert_true(vd_frame_hash(frame) == vd_frame_hash(bare));
    vd_frame_destroy(&frame);
    vd_frame_destroy(&bare);
    end(&s);
}

static void threads_and_levels_change_no_byte(void **state) {
    (void)state;
    const vd_particle_look look = cloud_look();
    const vd_camera camera = camera_from(-30, -320, 100, cloud_middle);
    uint64_t hash = 0;
    for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
        for (int threads = 1; threads <= 3; threads += 2) {
            scene s;
            begin(&s, threads, (vd_isa)isa, cloud_middle, 300, &look);
            vd_frame *frame = picture_of(&s, s.world, &camera, 0, NULL);
            assert_true(hash == 0 || vd_frame_hash(frame) == hash);
            hash = vd_frame_hash(frame);
            vd_frame_destroy(&frame);
            end(&s);
        }
    }
}

static uint64_t particles_below(const scene *s, uint64_t id) {
    static uint32_t roots[COUNT];
    const size_t count = roots_below(s->world, id, roots);
    uint64_t sum = 0;
    for (size_t i = 0; i < count; i++) {
        sum += s->bricks->nodes[roots[i]].leaves;
    }
    return sum;
}

/* The group of the most particles, below an id, that holds nothing else. */
static uint64_t group_of_particles(const scene *s, uint64_t id) {
    static uint32_t roots[COUNT];
    const int children = vd_world_child_count(s->world, id);
    uint64_t best = 0;
    for (int i = 1; i <= children; i++) {
        const uint64_t child = vd_object_child_id(id, i);
        const vd_node *node = vd_world_node(s->world, child);
        const bool all = node->count > 1 && roots_below(s->world, child, roots) == node->placed;
        const uint64_t found = all ? child : group_of_particles(s, child);
        if (found != 0 && (best == 0 || particles_below(s, found) > particles_below(s, best))) {
            best = found;
        }
    }
    return best;
}

/* A group alone, over transparent black: premultiplied, so that blending it over the ground gives
 * what drawing it there gives, to the rounding. */
static void a_group_alone_is_premultiplied(void **state) {
    (void)state;
    static uint32_t roots[COUNT];
    const vd_particle_look look = cloud_look();
    scene s;
    begin(&s, 2, VD_ISA_AUTO, vd_vec3_make(0, 0, 150), 200, &look); /* above all else */
    const vd_camera camera = camera_from(-30, -320, 190, cloud_middle);
    const uint64_t id = group_of_particles(&s, 0);
    assert_true(id != 0);
    const size_t count = roots_below(s.world, id, roots);
    vd_world_renderer *renderer = renderer_of(&s, s.world);
    vd_frame *alone = frame_of(&s, 0), *hand = frame_of(&s, 0);
    vd_world_stats stats;
    assert_ok(vd_world_renderer_draw_object(renderer, NULL, &camera, id, alone, &stats));
    assert_true(stats.particles > 100 && stats.drawn == count);
    assert_true(vd_world_renderer_cost(renderer, id) > 0.0);
    draw_by_hand(&s, &look, &camera, roots, count, hand); /* over transparent black */
    assert_true(vd_frame_hash(alone) == vd_frame_hash(hand));
    vd_frame *over = picture_of(&s, s.without, &camera, 0, NULL);
    vd_frame *blended = picture_of(&s, s.without, &camera, 0, NULL);
    draw_by_hand(&s, &look, &camera, roots, count, over);
    size_t covered = 0;
    for (int y = 0; y < HEIGHT; y++) {
        for (int x = 0; x < WIDTH; x++) {
            const size_t at = 4 * ((size_t)y * alone->stride + (size_t)x);
            const uint8_t *from = alone->rgba + at;
            covered += from[3] > 0;
            for (int c = 0; c < 4; c++) {
                const double under = blended->rgba[at + (size_t)c] * (1.0 - from[3] / 255.0);
                assert_true(from[c] <= from[3]);
                assert_true(fabs(under + from[c] - over->rgba[at + (size_t)c]) < 1.6);
            }
        }
    }
    assert_true(covered > 100);
    vd_frame_destroy(&alone);
    vd_frame_destroy(&hand);
    vd_frame_destroy(&over);
    vd_frame_destroy(&blended);
    vd_world_renderer_destroy(&renderer);
    end(&s);
}

static void far_groups_are_drawn_coarsely(void **state) {
    (void)state;
    vd_particle_look look = cloud_look();
    look.detail_px = 0.2; /* small pictures, so that the near one is fine */
    scene s;
    begin(&s, 2, VD_ISA_AUTO, cloud_middle, 300, &look);
    const uint64_t id = group_of_particles(&s, 0);
    vd_vec3 middle;
    double radius;
    vd_object_sphere(vd_world_find(s.world, id), &middle, &radius);
    vd_world_renderer *renderer = renderer_of(&s, s.world);
    vd_frame *frame = frame_of(&s, 0);
    vd_world_stats near, far;
    const vd_camera from_near = camera_from(middle.x, middle.y - 2.5 * radius, middle.z, middle);
    const vd_camera from_far = camera_from(middle.x, middle.y - 100 * radius, middle.z, middle);
    assert_ok(vd_world_renderer_draw_object(renderer, NULL, &from_near, id, frame, &near));
    assert_ok(vd_world_renderer_draw_object(renderer, NULL, &from_far, id, frame, &far));
    assert_true(far.particles_for == near.particles_for);
    assert_true(3 * far.particles < near.particles);
    vd_frame_destroy(&frame);
    vd_world_renderer_destroy(&renderer);
    end(&s);
}

/* The whole, from afar: not each object coarsely, but what stands for all of them, though some are
 * culled. */
static void a_far_world_is_drawn_coarsely(void **state) {
    (void)state;
    const vd_particle_look look = cloud_look();
    scene s;
    vd_world_stats stats;
    begin(&s, 2, VD_ISA_AUTO, cloud_middle, 300, &look);
    const vd_camera camera = camera_from(0, -20000, 12000, cloud_middle);
    vd_frame *frame = picture_of(&s, s.world, &camera, 0, &stats);
    assert_true(stats.too_small > 0 && stats.drawn > s.objects / 2);
    assert_true(stats.particles_for == COUNT && stats.particles < 2 * s.objects);
    vd_frame_destroy(&frame);
    end(&s);
}

/* Two files, the farther first whichever was added first. */
static void files_are_drawn_farthest_first(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    const vd_vec3 size = {20, 2, 20};
    const vd_camera camera = camera_from(0, -60, 0, vd_vec3_make(0, 0, 0));
    for (int turn = 0; turn < 2; turn++) {
        vd_world *world = NULL;
        vd_world_renderer *renderer = NULL;
        vd_frame *frame = NULL;
        assert_ok(vd_world_create(context, NULL, &world));
        for (int i = 0; i < 2; i++) {
            const bool nearer = i == turn;
            char path[16];
            snprintf(path, sizeof path, "%d.vdp", i);
            vd_particle_look look = cloud_look();
            look.opacity = 1.0;
            look.constant = nearer ? (vd_rgba8){255, 0, 0, 255} : (vd_rgba8){0, 255, 0, 255};
            vd_bricks *bricks =
                open_cloud(context, path, 20000, vd_vec3_make(0, nearer ? -10 : 10, 0), size, 500);
            assert_true(add_cloud(world, bricks, &look, 0) == 1);
        }
        assert_ok(vd_world_arrange(world, NULL));
        assert_ok(vd_frame_create(context, WIDTH, HEIGHT, 0, &frame));
        assert_ok(vd_world_renderer_create(context, NULL, world, NULL, &renderer));
        assert_ok(vd_world_renderer_draw(renderer, NULL, &camera, frame, NULL));
        const uint8_t *middle = frame->rgba + 4 * ((HEIGHT / 2) * frame->stride + WIDTH / 2);
        assert_true(middle[0] == 255 && middle[1] == 0);
        vd_frame_destroy(&frame);
        vd_world_renderer_destroy(&renderer);
        vd_world_destroy(&world);
    }
    vd_context_destroy(&context);
}

/* Bricks are looked at when they are first drawn; then a sentence, and the world still draws what
 * does not need them. */
static void a_damaged_brick_is_said(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_bricks *bricks = open_cloud(context, "damaged.vdp", 3000, cloud_middle, cloud_size, 64);
    vd_bricks_close(&bricks);
    FILE *file = fopen("damaged.vdp", "r+b");
    assert_non_null(file);
    for (long at = 256; at < 20000; at += 64) {
        assert_int_equal(fseek(file, at, SEEK_SET), 0);
        (void)fputc(0x5A, file);
    }
    assert_int_equal(fclose(file), 0);
    assert_ok(vd_bricks_open(context, "damaged.vdp", &bricks));
    vd_world *world = NULL;
    vd_world_renderer *renderer = NULL;
    vd_frame *frame = NULL;
    vd_particle_look look = cloud_look();
    look.detail_px = -1.0;
    assert_ok(vd_world_create(context, NULL, &world));
    assert_true(add_cloud(world, bricks, &look, 500) > 1);
    assert_ok(vd_world_arrange(world, NULL));
    assert_ok(vd_frame_create(context, WIDTH, HEIGHT, 0, &frame));
    assert_ok(vd_world_renderer_create(context, NULL, world, NULL, &renderer));
    const vd_camera camera = camera_from(0, -200, 60, cloud_middle);
    const vd_camera away = camera_from(0, -200, 60, vd_vec3_make(0, -900, 60));
    assert_refused(vd_world_renderer_draw(renderer, NULL, &camera, frame, NULL), VD_ERROR_FORMAT,
                   "damaged.vdp");
    assert_null(frame->depth);
    assert_ok(vd_world_renderer_draw(renderer, NULL, &away, frame, NULL));
    vd_frame_destroy(&frame);
    vd_world_renderer_destroy(&renderer);
    vd_world_destroy(&world);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_file_becomes_objects),
        cmocka_unit_test(bad_input_is_refused),
        cmocka_unit_test(blocks_are_checked),
        cmocka_unit_test(as_drawn_by_hand),
        cmocka_unit_test(what_is_behind_a_hill_is_hidden),
        cmocka_unit_test(threads_and_levels_change_no_byte),
        cmocka_unit_test(a_group_alone_is_premultiplied),
        cmocka_unit_test(far_groups_are_drawn_coarsely),
        cmocka_unit_test(a_far_world_is_drawn_coarsely),
        cmocka_unit_test(a_damaged_brick_is_said),
        cmocka_unit_test(files_are_drawn_farthest_first),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
