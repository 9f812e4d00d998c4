/* Models that a client draws itself: chosen and sent by a session, held and drawn by a mirror. */
#include <stdlib.h>
#include "mirror_ends.h"

/* What a session said. */
static struct { int blocks, places, lights, orders; } said;

/* Near things are near when they are seen sharply. */
enum { WIDE = 480, HIGH = 352 };

static void count(const vd_packet *p) {
    vd_wire_envelope envelope;
    assert_ok(
        vd_wire_decode(e.wire, VD_WIRE_SERVER, p->data + VD_PACKET_HEAD, p->bytes, &envelope));
    for (int i = 0; i < envelope.count; i++) {
        said.blocks += envelope.messages[i].kind == VD_WIRE_GEOMETRY;
        said.places += envelope.messages[i].kind == VD_WIRE_INSTANCE;
        said.lights += envelope.messages[i].kind == VD_WIRE_LIGHT;
        said.orders += envelope.messages[i].kind == VD_WIRE_ORDER;
    }
}

static void begin(size_t memory_bytes, bool serve, bool no_models) {
    vd_mirror_def mirror = {.memory_bytes = memory_bytes,
                            .no_models = no_models,
                            .settings = vd_client_def_default().settings};
    mirror.settings.quality = 100; /* nothing but where things are is compared */
    begin_ends(&mirror, WIDE, HIGH, serve);
    memset(&said, 0, sizeof said);
    e.said = count;
}

/* The error of the lower two thirds: the line of the scene, which is far away and in the picture in
 * front, is above. */
static double compare_lower(const vd_camera *camera, vd_client_shown *shown) {
    (void)compare(camera, shown);
    vd_frame a = *e.frame, b = *e.perfect;
    a.rgba += 4 * a.stride * (HIGH / 3);
    b.rgba += 4 * b.stride * (HIGH / 3);
    a.height = b.height = HIGH - HIGH / 3;
    return vd_frame_error(&a, &b);
}

static void look(const vd_camera *camera) {
    vd_mirror_look(e.mirror, camera, WIDE, HIGH);
}

static vd_camera view(void) {
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    camera.lens = vd_lens_from_fov(0.9, WIDE, HIGH);
    return camera;
}

/* A camera that stands before the ball that has the most others before it. */
static vd_camera among_balls(void) {
    const vd_world *world = e.scene.world;
    vd_vec3 best = {0, 0, 0};
    int most = -1;
    for (size_t i = 0; i < world->entry_list.count; i++) {
        const vd_object *a = world->entries[i].object;
        int near = 0;
        for (size_t k = 0; k < world->entry_list.count; k++) {
            const vd_object *b = world->entries[k].object;
            const vd_vec3 way = vd_vec3_subtract(b->anchor, a->anchor);
            near += b->kind == VD_OBJECT_INSTANCE && way.y > -10 && way.y < 40 && fabs(way.x) < 25;
        }
        if (a->kind == VD_OBJECT_INSTANCE && near > most) {
            most = near;
            best = a->anchor;
        }
    }
    vd_camera camera = view();
    camera.eye = vd_vec3_make(best.x - 8, best.y - 20, 0);
    camera.eye.z = vd_world_ground(world, camera.eye.x, camera.eye.y) + 9;
    camera.orientation = vd_orientation_from_angles(0.1, -0.1, 0.0);
    return camera;
}

/* Walks sideways for a second, then on without a word; returns the mean error of that. */
static double walk(bool no_models, int *models) {
    begin((size_t)64 << 20, true, no_models);
    vd_camera camera = among_balls();
    look(&camera);
    pass(0.3);
    for (int i = 0; i < (test_is_reduced() ? 20 : 40); i++) {
        camera.eye.x += 0.1;
        look(&camera);
        pass(0.02);
    }
    const int steps = test_is_reduced() ? 5 : 20;
    double sum = 0.0;
    vd_client_shown shown;
    for (int i = 0; i < steps; i++) {
        camera.eye.x += 2.0 / steps;
        sum += compare_lower(&camera, &shown);
    }
    *models = shown.models;
    return sum / steps;
}

static void near_models_are_drawn_by_the_client(void **state) {
    (void)state;
    int models = 0;
    const double without = walk(true, &models);
    assert_int_equal(models, 0);
    assert_int_equal(said.blocks + said.places + said.lights, 0);
    end();
    const double with = walk(false, &models);
    assert_true(models > 0);
    assert_int_equal(said.blocks, 1); /* once, however many balls there are */
    assert_int_equal(said.lights, 1);
    assert_true(said.places >= models && said.places < 60);
    print_message("mean error %.4f with models, %.4f without\n", with, without);
    assert_true(with < 0.7 * without);
    end();
}

/* Comes back and goes on with the models that it holds; of another server it drops them. */
static void models_are_held_over_a_break(void **state) {
    (void)state;
    int models = 0;
    (void)walk(false, &models);
    vd_session *past = e.session;
    vd_mirror_lose(e.mirror, "the cable fell out");
    assert_ok(vd_session_create(&e.scene.def, e.now_s, &e.session));
    vd_mirror_open(e.mirror, e.now_s);
    vd_packet *hello = vd_mirror_take(e.mirror);
    vd_session_receive(e.session, hello->data + VD_PACKET_HEAD, hello->bytes, e.now_s);
    vd_release(e.context, hello);
    assert_true(vd_session_takes_past(e.session, past));
    vd_session_destroy(&past);
    vd_camera camera = among_balls();
    camera.eye.x += 6.0;
    for (int i = 0; i < 10; i++) {
        camera.eye.x += 0.05;
        look(&camera);
        pass(0.02);
    }
    vd_client_shown shown;
    assert_true(compare(&camera, &shown) < 0.15);
    assert_true(shown.models > 0);
    assert_int_equal(said.blocks, 1);
    vd_mirror_lose(e.mirror, "again");
    vd_session_destroy(&e.session);
    e.scene.def.seed = 500000;
    assert_ok(vd_session_create(&e.scene.def, e.now_s, &e.session));
    vd_mirror_open(e.mirror, e.now_s);
    for (int i = 0; i < 20; i++) {
        camera.eye.x -= 0.05;
        look(&camera);
        pass(0.02);
    }
    assert_true(compare(&camera, &shown) < 0.15);
    assert_true(shown.models > 0);
    assert_int_equal(said.blocks, 2);
    assert_true(news().held_bytes <= (size_t)64 << 20);
    end();
}

static void memory_is_kept(void **state) {
    (void)state;
    begin((size_t)8 << 20, true, false);
    vd_camera camera = among_balls();
    int most = 0;
    for (int i = 0; i < (test_is_reduced() ? 60 : 150); i++) {
        vd_client_shown shown;
        camera.eye.x += i < 50 ? 0.1 : 1.0;
        camera.eye.y += i < 50 ? 0.1 : 2.0;
        camera.eye.z = vd_world_ground(e.scene.world, camera.eye.x, camera.eye.y) + 9;
        look(&camera);
        pass(0.02);
        assert_ok(vd_mirror_draw(e.mirror, NULL, &camera, e.frame, &shown));
        most = shown.models > most ? shown.models : most;
    }
    assert_int_equal(news().state, VD_CLIENT_SHOWING);
    assert_true(news().most_held_bytes <= (size_t)8 << 20);
    assert_true(most > 0);
    end();
}

/* ---- a server that a test plays ---------------------------------------------------------------*/

static vd_camera start(void) {
    vd_camera camera = view();
    begin((size_t)4 << 20, false, false);
    look(&camera);
    say_hello();
    return camera;
}

static uint8_t *pack_ball(size_t *bytes) {
    vd_model *model = ball(e.context);
    *bytes = vd_model_packed_bytes(model);
    uint8_t *block = vd_allocate(e.context, 1, *bytes);
    vd_model_pack(model, block);
    vd_model_destroy(&model);
    return block;
}

static vd_wire_message block_message(const uint8_t *block, size_t bytes) {
    vd_wire_message m = {.kind = VD_WIRE_GEOMETRY};
    m.as.geometry =
        (vd_wire_geometry){.id = 70, .version = 1, .kind = VD_WIRE_MODEL, .block = {block, bytes}};
    return m;
}

static void say_ball_and_light(void) {
    size_t bytes = 0;
    uint8_t *block = pack_ball(&bytes);
    const vd_wire_message model = block_message(block, bytes);
    vd_wire_message light = {.kind = VD_WIRE_LIGHT};
    light.as.light.light = vd_light_daylight(2.0, 0.7);
    say(&model);
    say(&light);
    vd_release(e.context, block);
}

static vd_wire_message place_message(uint64_t id, vd_vec3 origin) {
    vd_wire_message m = {.kind = VD_WIRE_INSTANCE};
    m.as.instance = (vd_wire_instance){
        .id = id,
        .version = 1,
        .model = 70,
        .place = {.origin = origin, .axes = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .sun = 1.0f}};
    return m;
}

/* Pixels that are drawn, and a hash of them. */
static int drawn_as(const vd_camera *camera, vd_client_shown *shown, uint64_t *hash) {
    const int pixels = drawn(camera, shown);
    *hash = vd_frame_hash(e.frame);
    return pixels;
}

static void what_is_ordered_is_drawn(void **state) {
    (void)state;
    const vd_camera camera = start();
    const vd_vec3 ahead = vd_quat_rotate(camera.orientation, vd_vec3_make(0, 6, 40));
    const vd_vec3 at = vd_vec3_add(camera.eye, ahead);
    const uint64_t ids[3] = {8, 9, 70}; /* a model is not shown by itself */
    size_t bytes = 0;
    uint8_t *block = pack_ball(&bytes);
    const vd_wire_message model = block_message(block, bytes);
    vd_wire_message first = place_message(8, at);
    const vd_wire_message second = place_message(9, vd_vec3_add(at, vd_vec3_make(5, 3, 0)));
    vd_wire_message light = {.kind = VD_WIRE_LIGHT};
    light.as.light.light = vd_light_daylight(2.0, 0.7);
    vd_wire_message order = {.kind = VD_WIRE_ORDER, .as.order = {.ids = {ids, 3}}};
    vd_client_shown shown;
    uint64_t hash = 0, alone = 0, both = 0, turned = 0;
    say(&order);
    say(&first); /* its model comes later */
    assert_int_equal(drawn_as(&camera, &shown, &hash), 0);
    say(&model);
    assert_int_equal(drawn_as(&camera, &shown, &hash), 0); /* in no light */
    say(&light);
    const int one = drawn_as(&camera, &shown, &alone);
    assert_true(one > 100 && shown.models == 1 && shown.quads == 0);
    say(&second);
    assert_true(drawn_as(&camera, &shown, &both) > one && shown.models == 2);
    /* By depth, whatever the order. */
    const uint64_t other[2] = {9, 8};
    order.as.order.ids = (vd_wire_ids){other, 2};
    say(&order);
    (void)drawn_as(&camera, &shown, &turned);
    assert_true(turned == both);
    /* Ground hides what is below. */
    first.as.instance.place.has_ground = true;
    first.as.instance.place.ground[0] = 6.0f;
    order.as.order.ids = (vd_wire_ids){ids, 1};
    say(&first);
    say(&order);
    const int half = drawn_as(&camera, &shown, &hash);
    print_message("%d of %d pixels over the ground\n", half, one);
    assert_true(half < one * 3 / 4 && half > one / 4);
    const size_t held = news().held_bytes;
    assert_int_equal(held, bytes + 2 * VD_WIRE_INSTANCE_BYTES);
    const uint64_t gone[1] = {70};
    const vd_wire_message drop = {.kind = VD_WIRE_DROP, .as.drop = {gone, 1}};
    say(&drop);
    assert_int_equal(drawn_as(&camera, &shown, &hash), 0);
    assert_int_equal(news().held_bytes, 2 * VD_WIRE_INSTANCE_BYTES);
    vd_release(e.context, block);
    end();
}

static void impossible_places_are_left_out(void **state) {
    (void)state;
    const vd_camera camera = start();
    say_ball_and_light();
    static uint64_t ids[60000];
    vd_wire_message m = place_message(1, camera.eye); /* around the eye */
    for (int i = 0; i < 8; i++) {
        vd_place *place = &m.as.instance.place;
        m.as.instance.id = ids[i] = (uint64_t)(i + 1);
        place->origin = i == 1 ? vd_vec3_make(1e9, -1e9, 1e9) : camera.eye;
        for (int k = 0; k < 9; k++) {
            const float values[8] = {0, 1, 1e6f, -1e6f, 1e-30f, 1, 1, (float)(k * k)};
            place->axes[k / 3][k % 3] = values[i];
        }
        place->has_ground = i >= 4;
        place->ground[0] = i == 5 ? 1e6f : -1e6f;
        place->ground[1] = place->ground[2] = i == 6 ? -1e6f : 1e6f;
        say(&m);
    }
    vd_wire_message order = {.kind = VD_WIRE_ORDER, .as.order = {.ids = {ids, 8}}};
    say(&order);
    vd_client_shown shown;
    uint64_t hash = 0;
    (void)drawn_as(&camera, &shown, &hash);
    /* So many that a frame would take minutes: what is beyond the bound is left out. */
    m = place_message(
        9, vd_vec3_add(camera.eye, vd_quat_rotate(camera.orientation, vd_vec3_make(0, 0, 400))));
    say(&m);
    for (int i = 0; i < 60000; i++) {
        ids[i] = 9;
    }
    order.as.order.ids.count = test_is_reduced() ? 500 : 60000;
    say(&order);
    (void)drawn_as(&camera, &shown, &hash);
    assert_true(shown.models > 100 && shown.models < 60000);
    static uint8_t dot[16] = {255, 255, 255, 255};
    vd_wire_message picture = {.kind = VD_WIRE_IMPOSTOR};
    picture.as.impostor =
        (vd_wire_impostor){.id = 10,
                           .version = 1,
                           .corners = {{-1, 9, 1}, {1, 9, 1}, {1, 9, -1}, {-1, 9, -1}},
                           .nearer = 1.0f,
                           .width = 2,
                           .height = 2,
                           .codec = VD_CODEC_RAW,
                           .picture = {dot, sizeof dot}};
    say(&picture);
    for (int i = 0; i < 60000; i++) { /* between pictures */
        ids[i] = i % 2 == 0 ? 9 : 10;
    }
    say(&order);
    (void)drawn_as(&camera, &shown, &hash);
    assert_int_equal(shown.models, VD_PLACED_RUNS);
    end();
}

/* Models whose triangles all fill the screen: a few are drawn in time, thousands are refused. */
static void what_fills_the_screen_has_a_bound(void **state) {
    (void)state;
    const vd_camera camera = start();
    say_ball_and_light();
    static uint64_t ids[8192];
    /* All around the eye: a ball's middle is 6 m above its origin. */
    vd_wire_message m =
        place_message(9, vd_vec3_subtract(camera.eye, vd_vec3_make(0, 0, 6 * 500.0)));
    for (int k = 0; k < 3; k++) {
        m.as.instance.place.axes[k][k] = 500.0f;
    }
    say(&m);
    for (int i = 0; i < 8192; i++) {
        ids[i] = 9;
    }
    vd_wire_message order = {.kind = VD_WIRE_ORDER, .as.order = {.ids = {ids, 20}}};
    vd_client_shown shown;
    uint64_t few = 0, hash = 0;
    say(&order);
    assert_true(drawn_as(&camera, &shown, &few) > 0);
    order.as.order.ids.count = 300; /* those after are left out, and hidden anyway */
    say(&order);
    (void)drawn_as(&camera, &shown, &hash);
    assert_true(hash == few);
    pass(0.01);
    assert_int_equal(news().state, VD_CLIENT_SHOWING);
    order.as.order.ids.count = 8192;
    say(&order);
    (void)drawn_as(&camera, &shown, &hash);
    pass(0.01);
    const vd_client_news n = news();
    assert_int_equal(n.state, VD_CLIENT_REFUSED);
    assert_non_null(strstr(n.sentence, "a thousand times"));
    assert_int_equal(drawn_as(&camera, &shown, &hash), 0);
    end();
}

static void damaged_blocks_are_refused(void **state) {
    (void)state;
    size_t bytes = 0;
    static uint8_t copy[1 << 20];
    (void)start();
    uint8_t *block = pack_ball(&bytes);
    assert_true(bytes <= sizeof copy);
    memcpy(copy, block, bytes);
    vd_release(e.context, block);
    end();
    for (int i = 0; i < 40; i++) { /* any change is found */
        (void)start();
        const size_t at = bytes * (size_t)i / 40;
        copy[at] ^= 0x40;
        const vd_wire_message m = block_message(copy, bytes);
        refuse(&m, "block is damaged");
        copy[at] ^= 0x40;
    }
    (void)start();
    const vd_wire_message cut = block_message(copy, bytes - 1);
    refuse(&cut, "block is damaged");
    (void)start();
    const vd_wire_message tiny = block_message(copy, 1);
    refuse(&tiny, "block is damaged");
    (void)start();
    vd_wire_message brick = block_message(copy, bytes);
    brick.as.geometry.kind = VD_WIRE_BRICK;
    refuse(&brick, "brick");
    (void)start();
    static uint8_t large[(4 << 20) + 1];
    const vd_wire_message more = block_message(large, sizeof large);
    refuse(&more, "more memory");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(near_models_are_drawn_by_the_client),
        cmocka_unit_test(models_are_held_over_a_break),
        cmocka_unit_test(memory_is_kept),
        cmocka_unit_test(what_is_ordered_is_drawn),
        cmocka_unit_test(impossible_places_are_left_out),
        cmocka_unit_test(what_fills_the_screen_has_a_bound),
        cmocka_unit_test(damaged_blocks_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
