/* Particles that a client draws itself: chosen and sent by a session, held and drawn by a mirror.
 */
#include <stdlib.h>
#include <unistd.h>
#include "mirror_ends.h"
#include "particle_scenes.h"
#include "splat/brick_pack.h"

static char folder[] = VEDUTA_BINARY_DIR "/test-mirror-particles-XXXXXX";

static int set_up(void **state) {
    (void)state;
    return test_enter_folder(folder);
}

static int tear_down(void **state) {
    (void)state;
    return test_leave_folder(folder);
}

enum { WIDE = 320, HIGH = 240, COUNT = 60000, MOST_BRICKS = 4096 };

/* What a session said. */
static struct {
    int bricks, sent_again, orders, lights;
    uint64_t ids[MOST_BRICKS];
    uint32_t particles[MOST_BRICKS];
    uint64_t most_particles; /* of an order */
    int ordered;             /* bricks in the last one */
} said;

static int brick_at(uint64_t id) {
    int i = 0;
    while (i < said.bricks && said.ids[i] != id) {
        i++;
    }
    return i;
}

static void count_order(const vd_wire_order *order) {
    uint64_t particles = 0;
    said.orders++;
    said.ordered = 0;
    for (int i = 0; i < order->ids.count; i++) {
        if (order->ids.ids[i] >> 56 == 251) {
            const int at = brick_at(order->ids.ids[i]);
            assert_true(at < said.bricks); /* sent before it is ordered */
            particles += said.particles[at];
            said.ordered++;
        }
    }
    said.most_particles = particles > said.most_particles ? particles : said.most_particles;
}

static void count(const vd_packet *p) {
    vd_wire_envelope envelope;
    assert_ok(
        vd_wire_decode(e.wire, VD_WIRE_SERVER, p->data + VD_PACKET_HEAD, p->bytes, &envelope));
    for (int i = 0; i < envelope.count; i++) {
        const vd_wire_message *m = &envelope.messages[i];
        if (m->kind == VD_WIRE_GEOMETRY && m->as.geometry.kind == VD_WIRE_BRICK) {
            vd_brick_block_head head;
            memcpy(&head, m->as.geometry.block.data, sizeof head);
            const int at = brick_at(m->as.geometry.id);
            said.sent_again += at < said.bricks;
            said.bricks += at == said.bricks;
            assert_true(said.bricks < MOST_BRICKS);
            said.ids[at] = m->as.geometry.id;
            said.particles[at] = head.count;
        } else if (m->kind == VD_WIRE_ORDER) {
            count_order(&m->as.order);
        }
        said.lights += m->kind == VD_WIRE_LIGHT;
    }
}

static const vd_vec3 middle = {0, 0, 130}, size = {90, 80, 60};

static void begin(size_t memory_bytes, bool serve, uint32_t particles) {
    vd_mirror_def mirror = {.memory_bytes = memory_bytes,
                            .no_models = true,
                            .particles = particles,
                            .settings = vd_client_def_default().settings};
    const vd_vec3 origin = {0, 0, 0};
    mirror.settings.quality = 100; /* nothing but where things are is compared */
    begin_ends(&mirror, WIDE, HIGH, false);
    memset(&said, 0, sizeof said);
    e.said = count;
    if (!serve) {
        return;
    }
    vd_particle_look look = cloud_look();
    look.color = VD_BRICK_COLOR_HEIGHT;
    e.scene.map = hills(e.context, origin);
    e.scene.world = make_world(e.context, e.scene.map, origin, 5, 4);
    (void)add_cloud(e.scene.world, open_cloud(e.context, "cloud.vdp", COUNT, middle, size, 200),
                    &look, 2000);
    assert_ok(vd_world_arrange(e.scene.world, NULL));
    scene_serve(&e.scene, e.context, NULL);
    e.scene.def.seed = 1000;
    assert_ok(vd_session_create(&e.scene.def, e.now_s, &e.session));
}

static vd_camera view(double x, double y) {
    vd_camera camera = {.eye = vd_vec3_make(x, y, 130), .near_m = 1.0};
    camera.orientation = vd_orientation_from_angles(0.0, 0.0, 0.0);
    camera.lens = vd_lens_from_fov(0.9, WIDE, HIGH);
    return camera;
}

static void look(const vd_camera *camera) {
    vd_mirror_look(e.mirror, camera, WIDE, HIGH);
}

/* Walks sideways before the cloud for a second, then on without a word; returns the mean error of
 * that. */
static double walk(uint32_t particles, int *bricks) {
    begin((size_t)64 << 20, true, particles);
    vd_camera camera = view(-6, -75);
    look(&camera);
    pass(0.3);
    for (int i = 0; i < 40; i++) {
        camera.eye.x += 0.1;
        look(&camera);
        pass(0.02);
    }
    const int steps = test_is_reduced() ? 4 : 10;
    double sum = 0.0;
    vd_client_shown shown = {0};
    for (int i = 0; i < steps; i++) {
        camera.eye.x += 4.0 / steps;
        sum += compare(&camera, &shown);
    }
    *bricks = shown.models;
    return sum / steps;
}

static void near_particles_are_drawn_by_the_client(void **state) {
    (void)state;
    int bricks = 0;
    const double without = walk(0, &bricks);
    assert_int_equal(bricks, 0);
    assert_int_equal(said.bricks, 0); /* who does not say that it draws them gets none */
    end();
    const double with = walk(1u << 20, &bricks);
    assert_true(bricks > 10);
    assert_int_equal(said.sent_again, 0); /* each once */
    assert_int_equal(said.lights, 0);
    print_message("mean error %.4f with %d bricks, %.4f without\n", with, bricks, without);
    assert_true(with < 0.4 * without);
    end();
}

/* Once all is there, the client's own picture is that of the world but for roundings. */
static void the_picture_is_the_same(void **state) {
    (void)state;
    begin((size_t)64 << 20, true, 1u << 20);
    vd_camera camera = view(0, -75);
    for (int i = 0; i < 60; i++) {
        camera.eye.x += 0.002;
        look(&camera);
        pass(0.02);
    }
    vd_client_shown shown;
    camera.eye.x += 1e-4; /* not the camera of the exact picture */
    const double error = compare(&camera, &shown);
    print_message("error %.4f of %d bricks\n", error, shown.models);
    assert_true(shown.models > 10 && !shown.exact);
    assert_true(error < 0.05);
    end();
}

/* From far to near: coarse bricks give way to fine ones, and at no moment is something missing or
 * there twice. */
static void what_is_refined_changes_at_once(void **state) {
    (void)state;
    begin((size_t)64 << 20, true, 1u << 20);
    vd_camera camera = view(0, -260);
    look(&camera);
    pass(0.5);
    double worst = 0.0;
    int most = 0;
    for (int i = 0; i < 100; i++) {
        camera.eye.y += 2.0;
        look(&camera);
        for (int k = 0; k < 4; k++) {
            vd_client_shown shown;
            pass(0.005);
            if (test_is_reduced() && (i + k) % 8 != 0) {
                continue; /* a direct picture for each takes the time */
            }
            const double error = compare(&camera, &shown);
            worst = error > worst ? error : worst;
            most = shown.models > most ? shown.models : most;
        }
    }
    print_message("worst error %.4f, %d bricks, %d orders\n", worst, most, said.orders);
    assert_true(most > 50);
    assert_true(said.bricks > most); /* some were replaced */
    assert_true(worst < 0.6);
    end();
}

static void budgets_are_kept(void **state) {
    (void)state;
    const uint32_t most = 18000;
    begin((size_t)8 << 20, true, most);
    int seen = 0;
    for (int i = 0; i < (test_is_reduced() ? 40 : 120); i++) {
        vd_client_shown shown;
        const vd_camera camera = view(1.5 * i - 60, -75 + 0.3 * i);
        look(&camera);
        pass(0.02);
        assert_ok(vd_mirror_draw(e.mirror, NULL, &camera, e.frame, &shown));
        seen = shown.models > seen ? shown.models : seen;
    }
    assert_true(seen > 0);
    assert_true(said.most_particles > most / 4 && said.most_particles <= most);
    assert_int_equal(news().state, VD_CLIENT_SHOWING);
    assert_true(news().most_held_bytes <= (size_t)8 << 20);
    end();
    /* So little memory that bricks have to go. */
    begin((size_t)4 << 20, true, 1u << 20);
    for (int i = 0; i < (test_is_reduced() ? 20 : 200); i++) {
        const vd_camera camera = view(60 * sin(0.1 * i), -90 + 0.9 * i);
        look(&camera);
        pass(0.02);
    }
    assert_int_equal(news().state, VD_CLIENT_SHOWING);
    assert_true(news().most_held_bytes <= (size_t)4 << 20);
    end();
}

static void bricks_are_held_over_a_break(void **state) {
    (void)state;
    int bricks = 0;
    (void)walk(1u << 20, &bricks);
    const int before = said.bricks;
    vd_session *past = e.session;
    vd_mirror_lose(e.mirror, "the cable fell out");
    assert_ok(vd_session_create(&e.scene.def, e.now_s, &e.session));
    vd_mirror_open(e.mirror, e.now_s);
    vd_packet *hello = vd_mirror_take(e.mirror);
    vd_session_receive(e.session, hello->data + VD_PACKET_HEAD, hello->bytes, e.now_s);
    vd_release(e.context, hello);
    assert_true(vd_session_takes_past(e.session, past));
    vd_session_destroy(&past);
    vd_camera camera = view(2, -75);
    vd_client_shown shown;
    for (int i = 0; i < 10; i++) {
        camera.eye.x += 0.05;
        look(&camera);
        pass(0.02);
    }
    assert_true(compare(&camera, &shown) < 0.1);
    assert_true(shown.models > 10);
    assert_int_equal(said.sent_again, 0);
    assert_true(said.bricks < before + before / 2);
    end();
}

/* ---- a server that a test plays ---------------------------------------------------------------*/

static vd_camera start(uint32_t particles) {
    const vd_camera camera = view(0, 0);
    begin((size_t)8 << 20, false, particles);
    look(&camera);
    say_hello();
    return camera;
}

static _Alignas(64) uint8_t block[1 << 20];

/* A cube of red particles, 1,000 unless it is to be more, 20 m wide. */
static size_t make_block(uint32_t particles, uint32_t parts) {
    const vd_brick_layout l = vd_brick_block_layout(particles, parts);
    vd_brick_block_head head = {.magic = {'V', 'D', 'B', 'R', 'I', 'C', 'K', 1},
                                .stands_for = 2.0,
                                .count = particles,
                                .kernel = VD_SPLAT_DISC,
                                .parts = parts,
                                .color = {255, 0, 0, 255},
                                .step = {20 / 65535.0f, 20 / 65535.0f, 20 / 65535.0f},
                                .radius = 0.5f,
                                .radius_step = 1.0f / 65535.0f,
                                .opacity = 1.0f};
    uint64_t seed = 5;
    assert_true(l.size_bytes <= sizeof block);
    memset(block, 0, l.size_bytes);
    for (size_t i = sizeof head; i < l.size_bytes; i++) {
        block[i] = (uint8_t)(255 * test_uniform(&seed));
    }
    memcpy(block, &head, sizeof head);
    return l.size_bytes;
}

/* Makes the block's checksum hold, and a message of it. */
static vd_wire_message brick_message(uint64_t id, size_t bytes, vd_vec3 origin) {
    vd_wire_message m = {.kind = VD_WIRE_GEOMETRY};
    const uint64_t checksum = vd_brick_block_checksum(block, bytes);
    memcpy(block + offsetof(vd_brick_block_head, checksum), &checksum, sizeof checksum);
    m.as.geometry = (vd_wire_geometry){
        .id = id, .version = 1, .kind = VD_WIRE_BRICK, .origin = origin, .block = {block, bytes}};
    return m;
}

static void what_is_ordered_is_drawn(void **state) {
    (void)state;
    const vd_camera camera = start(1u << 20);
    const size_t bytes = make_block(1000, VD_BLOCK_PARTS);
    const vd_wire_message m = brick_message(9, bytes, vd_vec3_make(-10, 30, 120));
    uint64_t ids[2] = {9, 9};
    vd_wire_message order = {.kind = VD_WIRE_ORDER, .as.order = {.ids = {ids, 1}}};
    vd_client_shown shown;
    say(&order);
    assert_int_equal(drawn(&camera, &shown), 0);
    say(&m);
    const int one = drawn(&camera, &shown);
    assert_true(one > 1000 && shown.models == 1); /* without a light */
    assert_int_equal(news().held_bytes, bytes);
    order.as.order.ids.count = 2;
    say(&order);
    const int twice = drawn(&camera, &shown);
    assert_true(twice >= one && twice < one + one / 100); /* a little denser */
    assert_int_equal(shown.models, 2);
    const vd_wire_message drop = {.kind = VD_WIRE_DROP, .as.drop = {ids, 1}};
    say(&drop);
    assert_int_equal(drawn(&camera, &shown), 0);
    assert_int_equal(news().held_bytes, 0);
    end();
}

/* Numbers that no server of ours would send, in blocks that are whole. */
static void hostile_blocks_take_no_longer(void **state) {
    (void)state;
    static uint64_t ids[60000];
    const vd_camera camera = start(1u << 20);
    vd_wire_message order = {.kind = VD_WIRE_ORDER, .as.order = {.ids = {ids, 1}}};
    vd_client_shown shown;
    const float steps[4] = {0.0f, 1e-30f, 1.0f, 1e6f}, radii[4] = {0.0f, 1e-30f, 30.0f, 1e6f};
    const double each[3] = {1.0, 1e3, 1e15};
    ids[0] = 7;
    say(&order);
    for (int i = 0; i < (test_is_reduced() ? 96 : 768); i++) {
        const size_t bytes = make_block(1 + 40 * (uint32_t)(i % 7), i % 2 ? VD_BLOCK_RADII : 0);
        vd_brick_block_head *head = (vd_brick_block_head *)(void *)block;
        head->step[0] = steps[i & 3];
        head->step[1] = steps[i >> 2 & 3];
        head->step[2] = steps[i >> 1 & 3];
        head->radius = head->radius_step = radii[i >> 4 & 3];
        head->kernel = (uint32_t)(i >> 6) & 3;
        head->stands_for = each[i % 3];
        const vd_vec3 at = i % 5 == 0 ? camera.eye : vd_vec3_make(0, i % 5 == 1 ? 1e9 : 5, 130);
        const vd_wire_message m = brick_message(7, bytes, at);
        say(&m);
        (void)drawn(&camera, &shown);
    }
    assert_int_equal(news().state, VD_CLIENT_SHOWING);
    /* Each particle as large as the window: as many as the bound has. */
    const size_t bytes = make_block(65536, 0);
    ((vd_brick_block_head *)(void *)block)->radius = 1000.0f;
    const vd_wire_message large = brick_message(8, bytes, vd_vec3_make(-10, 30, 120));
    say(&large);
    ids[0] = 8;
    order.as.order.ids.count = 1;
    say(&order);
    (void)drawn(&camera, &shown);
    /* So many that a frame would take minutes. */
    (void)make_block(65536, 0);
    ((vd_brick_block_head *)(void *)block)->radius = 0.01f;
    const vd_wire_message many = brick_message(8, bytes, vd_vec3_make(-10, 30, 120));
    say(&many);
    for (int i = 0; i < 60000; i++) {
        ids[i] = 8;
    }
    order.as.order.ids.count = 60000;
    say(&order);
    (void)drawn(&camera, &shown);
    assert_int_equal(shown.models, VD_PLACED_PARTICLES / 65536);
    end();
}

static void damaged_blocks_are_refused(void **state) {
    (void)state;
    const vd_vec3 origin = {0, 0, 0};
    const size_t bytes = make_block(500, VD_BLOCK_PARTS);
    for (int i = 0; i < 60; i++) { /* any change is found */
        (void)start(1u << 20);
        (void)make_block(500, VD_BLOCK_PARTS);
        const vd_wire_message m = brick_message(3, bytes, origin);
        block[i < 20 ? 4 * (size_t)i : bytes * (size_t)i / 60] ^= 0x40;
        refuse(&m, "block is damaged");
    }
    for (int i = 0; i < 10; i++) { /* whole, but out of range */
        (void)start(1u << 20);
        (void)make_block(500, VD_BLOCK_PARTS);
        vd_brick_block_head *h = (vd_brick_block_head *)(void *)block;
        float *const numbers[7] = {&h->step[0],     &h->step[1], &h->step[2], &h->radius,
                                   &h->radius_step, &h->opacity, &h->opacity};
        if (i < 7) {
            *numbers[i] = i == 3 ? NAN : i == 4 ? INFINITY : i == 5 ? 1.5f : -1.0f;
        }
        h->kernel = i == 7 ? 4 : h->kernel;
        h->stands_for = i == 8 ? 0.5 : i == 9 ? (double)NAN : h->stands_for;
        const vd_wire_message m = brick_message(3, bytes, origin);
        refuse(&m, "out of its range");
    }
    const size_t cuts[3] = {1, 127, bytes - 64};
    for (int i = 0; i < 3; i++) {
        (void)start(1u << 20);
        (void)make_block(500, VD_BLOCK_PARTS);
        vd_wire_message m = brick_message(3, bytes, origin);
        m.as.geometry.block.bytes = cuts[i];
        refuse(&m, "block is damaged");
    }
    (void)start(0);
    const vd_wire_message unasked = brick_message(3, bytes, origin);
    refuse(&unasked, "brick");
    (void)start(1u << 20);
    static uint8_t large[(8 << 20) - 64];
    vd_wire_message more = brick_message(3, bytes, origin);
    more.as.geometry.block = (vd_wire_bytes){large, sizeof large};
    refuse(&more, "block is damaged"); /* as much as the memory, but none of ours */
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(near_particles_are_drawn_by_the_client),
        cmocka_unit_test(the_picture_is_the_same),
        cmocka_unit_test(what_is_refined_changes_at_once),
        cmocka_unit_test(budgets_are_kept),
        cmocka_unit_test(bricks_are_held_over_a_break),
        cmocka_unit_test(what_is_ordered_is_drawn),
        cmocka_unit_test(hostile_blocks_take_no_longer),
        cmocka_unit_test(damaged_blocks_are_refused),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
