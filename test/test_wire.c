/* The wire: every message comes back as it was, every bound holds, and no bytes do harm. */
#include "support.h"
#include <veduta/wire.h>
#include "splat/brick_pack.h"

#include <math.h>
#include <stdio.h>

typedef struct fixture {
    vd_context *context;
    vd_wire *wire;
    vd_wire_buffer buffer;
    size_t bytes; /* that the context itself takes */
} fixture;

static fixture begin(void) {
    fixture f = {.context = test_context(1, VD_ISA_AUTO)};
    f.bytes = vd_context_memory(f.context).bytes_now;
    assert_ok(vd_wire_create(f.context, &f.wire));
    return f;
}

static void end(fixture *f) {
    vd_wire_buffer_release(f->context, &f->buffer);
    vd_wire_destroy(&f->wire);
    assert_null(f->wire);
    assert_int_equal(vd_context_memory(f->context).bytes_now, f->bytes);
    vd_context_destroy(&f->context);
}

/* ---- one good message of each kind ------------------------------------------------------------*/

static const uint64_t ids[5] = {1, 7, 9, UINT64_C(1) << 40, UINT64_MAX};
static const uint64_t others[2] = {2, 8};
static const uint32_t versions[5] = {1, 2, 3, 4, UINT32_MAX};
static const float heights[6] = {0, 1.5f, -9, 8848, VD_WIRE_NO_GROUND, 3};
static const float bad_heights[6] = {0, 0, 0, 0, 0, NAN};
static const uint8_t picture[4 * 6 * 4] = {1, 2, 3};

/* The block of a brick of one particle. */
static vd_wire_bytes brick(void) {
    static _Alignas(8) uint8_t block[320];
    vd_brick_block_head head = {.magic = {'V', 'D', 'B', 'R', 'I', 'C', 'K', 1},
                                .stands_for = 1.0,
                                .count = 1,
                                .color = {200, 100, 50, 255},
                                .step = {1.0f, 1.0f, 1.0f},
                                .radius = 0.5f,
                                .opacity = 1.0f};
    assert_int_equal(vd_brick_block_layout(1, 0).size_bytes, sizeof block);
    memcpy(block, &head, sizeof head);
    head.checksum = vd_brick_block_checksum(block, sizeof block);
    memcpy(block, &head, sizeof head);
    return (vd_wire_bytes){block, sizeof block};
}

static vd_wire_message make(vd_wire_side side, vd_wire_kind kind) {
    vd_wire_message m = {.kind = kind};
    const bool client = side == VD_WIRE_CLIENT;
    switch (kind) {
    case VD_WIRE_HELLO:
        m.as.hello = client ? (vd_wire_hello){1,
                                              VD_CODEC_ALL | VD_WIRE_MODELS,
                                              "s3cret",
                                              1u << 28,
                                              1280,
                                              720,
                                              "die Blätter",
                                              {ids, 5},
                                              versions,
                                              0}
                            : (vd_wire_hello){.version = 1, .capabilities = 6, .name = "alps"};
        break;
    case VD_WIRE_CAMERA:
        m.as.camera = (vd_wire_camera){.sequence = 12,
                                       .camera = {.eye = {1234567.125, -5.5, 1000.0625},
                                                  .orientation = {0.5, -0.5, 0.5, 0.5},
                                                  .lens = {800.25, 799.75, 640.5, 360},
                                                  .near_m = 0.1},
                                       .width = 1280,
                                       .height = 720,
                                       .time_s = 3.25};
        break;
    case VD_WIRE_IMPOSTOR:
        m.as.impostor = (vd_wire_impostor){.id = UINT64_MAX,
                                           .version = 3,
                                           .origin = {400000.125, 5e6, -3},
                                           .corners = {{0, 0, 8}, {4, 1, 8}, {4, 1, 0}, {0, 0, 0}},
                                           .nearer = 1.25f,
                                           .width = 6,
                                           .height = 4,
                                           .opaque = {1, 1, 5, 3},
                                           .codec = VD_CODEC_RAW,
                                           .picture = {picture, sizeof picture}};
        break;
    case VD_WIRE_ORDER:
        m.as.order = (vd_wire_order){12, {ids, 5}};
        break;
    case VD_WIRE_GEOMETRY:
        m.as.geometry = (vd_wire_geometry){5, 1, VD_WIRE_BRICK, {1, 2, 3}, brick()};
        break;
    case VD_WIRE_INSTANCE:
        m.as.instance = (vd_wire_instance){.id = UINT64_MAX - 1,
                                           .version = 3,
                                           .model = 5,
                                           .place = {{400000.125, 5e6, -3},
                                                     {{1, 0, 0}, {0, 2, 0.5f}, {0, -0.5f, 2}},
                                                     0.75f,
                                                     true,
                                                     {-0.5f, 0.25f, 0}}};
        break;
    case VD_WIRE_LIGHT:
        m.as.light.light = (vd_light){.sun_direction = {0.6, 0, 0.8},
                                      .sun = {3, 2.5f, 2},
                                      .ambient_up = {0.5f, 0.6f, 0.7f},
                                      .ambient_down = {0.1f, 0.2f, 0.15f},
                                      .horizon = {0.25f, 0.5f, 1},
                                      .haze_m = 30000};
        break;
    case VD_WIRE_GROUND:
        m.as.ground = (vd_wire_ground){400000.125, -5e6, 12.5, 3, 2, heights};
        break;
    case VD_WIRE_REPLACE:
        m.as.replace = (vd_wire_replace){{ids, 3}, {others, 2}};
        break;
    case VD_WIRE_DROP:
        m.as.drop = (vd_wire_ids){others, 2};
        break;
    case VD_WIRE_SCREEN:
        m.as.screen = (vd_wire_screen){12, VD_CODEC_PNG, true, 6, 4, {picture, sizeof picture}};
        break;
    case VD_WIRE_ACKNOWLEDGE:
        m.as.acknowledge = (vd_wire_acknowledge){UINT32_MAX, UINT64_C(1) << 33};
        break;
    case VD_WIRE_STATS:
        m.as.stats = (vd_wire_stats){59.9, 0.018, 0.001, 0.5, 1e7, 0.05, 4096, 700, 3};
        break;
    case VD_WIRE_ERROR:
        m.as.error = (vd_wire_error){VD_WIRE_FAULT_TOKEN, "the token is wrong"};
        break;
    case VD_WIRE_PING:
    case VD_WIRE_PONG:
        m.as.ping = (vd_wire_ping){UINT64_MAX};
        break;
    case VD_WIRE_BYE:
        m.as.bye = (vd_wire_bye){VD_WIRE_STOPPING, "the server stops"};
        break;
    case VD_WIRE_SETTINGS:
        m.as.settings =
            (vd_wire_settings){VD_WIRE_MODE_SCREENS, 1.5f, 80, VD_CODEC_BIT(VD_CODEC_RUNS), 1e6};
        break;
    default:
        break;
    }
    return m;
}

static void check_ids(vd_wire_ids a, vd_wire_ids b) {
    assert_int_equal(a.count, b.count);
    assert_memory_equal(a.ids, b.ids, (size_t)a.count * sizeof *a.ids);
}

static void check_bytes(vd_wire_bytes a, vd_wire_bytes b) {
    assert_int_equal(a.bytes, b.bytes);
    assert_memory_equal(a.data, b.data, a.bytes);
}

static void check_text(const char *a, const char *b) {
    assert_string_equal(a != NULL ? a : "", b != NULL ? b : "");
}

/* Compares by encoding too: what was decoded encodes to the same bytes. */
static void check_same(const vd_wire_message *a, const vd_wire_message *b) {
    assert_int_equal(a->kind, b->kind);
    switch (a->kind) {
    case VD_WIRE_HELLO:
        check_text(a->as.hello.token, b->as.hello.token);
        check_text(a->as.hello.name, b->as.hello.name);
        assert_int_equal(a->as.hello.capabilities, b->as.hello.capabilities);
        assert_int_equal(a->as.hello.memory_bytes, b->as.hello.memory_bytes);
        assert_int_equal(a->as.hello.particles, b->as.hello.particles);
        if (a->as.hello.held.count > 0) {
            check_ids(a->as.hello.held, b->as.hello.held);
            assert_memory_equal(a->as.hello.held_versions, b->as.hello.held_versions,
                                (size_t)a->as.hello.held.count * sizeof(uint32_t));
        }
        break;
    case VD_WIRE_CAMERA:
        assert_memory_equal(&a->as.camera.camera.eye, &b->as.camera.camera.eye, sizeof(vd_vec3));
        assert_memory_equal(&a->as.camera.camera.orientation, &b->as.camera.camera.orientation,
                            sizeof(vd_quat));
        assert_memory_equal(&a->as.camera.camera.lens, &b->as.camera.camera.lens, sizeof(vd_lens));
        assert_true(a->as.camera.time_s == b->as.camera.time_s);
        break;
    case VD_WIRE_IMPOSTOR:
        assert_int_equal(a->as.impostor.id, b->as.impostor.id);
        assert_memory_equal(a->as.impostor.corners, b->as.impostor.corners,
                            sizeof a->as.impostor.corners);
        assert_memory_equal(a->as.impostor.opaque, b->as.impostor.opaque,
                            sizeof a->as.impostor.opaque);
        check_bytes(a->as.impostor.picture, b->as.impostor.picture);
        break;
    case VD_WIRE_ORDER:
        check_ids(a->as.order.ids, b->as.order.ids);
        break;
    case VD_WIRE_REPLACE:
        check_ids(a->as.replace.out, b->as.replace.out);
        check_ids(a->as.replace.in, b->as.replace.in);
        break;
    case VD_WIRE_INSTANCE:
        assert_memory_equal(&a->as.instance, &b->as.instance, sizeof a->as.instance);
        break;
    case VD_WIRE_LIGHT:
        assert_memory_equal(&a->as.light, &b->as.light, sizeof a->as.light);
        break;
    case VD_WIRE_GROUND:
        assert_true(a->as.ground.x == b->as.ground.x && a->as.ground.y == b->as.ground.y &&
                    a->as.ground.step_m == b->as.ground.step_m);
        assert_int_equal(a->as.ground.columns, b->as.ground.columns);
        assert_int_equal(a->as.ground.rows, b->as.ground.rows);
        assert_memory_equal(a->as.ground.heights, b->as.ground.heights, sizeof heights);
        break;
    case VD_WIRE_STATS:
        assert_memory_equal(&a->as.stats, &b->as.stats, sizeof a->as.stats);
        break;
    default:
        break;
    }
}

/* Of an older server's pictures none is fixed. */
static void test_fixed_pictures(void **state) {
    (void)state;
    fixture f = begin();
    for (int fixed = 0; fixed < 2; fixed++) {
        vd_wire_envelope got;
        vd_wire_message m = make(VD_WIRE_SERVER, VD_WIRE_IMPOSTOR);
        const size_t bytes = vd_wire_message_bytes(&m);
        m.as.impostor.fixed = fixed != 0;
        assert_int_equal(vd_wire_message_bytes(&m), bytes + (fixed != 0 ? 2 : 0));
        assert_ok(vd_wire_encode(f.wire, VD_WIRE_SERVER, 0, &m, 1, &f.buffer));
        assert_ok(vd_wire_decode(f.wire, VD_WIRE_SERVER, f.buffer.data, f.buffer.bytes, &got));
        assert_int_equal(got.messages[0].as.impostor.fixed, fixed);
    }
    end(&f);
}

static void test_round_trips(void **state) {
    (void)state;
    fixture f = begin();
    vd_wire_buffer again = {0};
    for (int side = 0; side < VD_WIRE_SIDE_COUNT; side++) {
        for (int kind = VD_WIRE_HELLO; kind < VD_WIRE_KIND_COUNT; kind++) {
            vd_wire_message m = make((vd_wire_side)side, (vd_wire_kind)kind);
            if (kind == VD_WIRE_HELLO && side == VD_WIRE_CLIENT) {
                m.as.hello.particles = 1u << 20;
            }
            const vd_status status =
                vd_wire_encode(f.wire, (vd_wire_side)side, 9, &m, 1, &f.buffer);
            if (!vd_wire_may_send((vd_wire_side)side, m.kind)) {
                assert_int_equal(status.code, VD_ERROR_ARGUMENT);
                assert_non_null(strstr(status.message, vd_wire_kind_name(m.kind)));
                assert_non_null(strstr(status.message, side == 0 ? "client" : "server"));
                assert_int_equal(f.buffer.bytes, 0);
                continue;
            }
            assert_ok(status);
            assert_int_equal(f.buffer.bytes, 2 + vd_wire_message_bytes(&m));
            vd_wire_envelope got;
            assert_ok(
                vd_wire_decode(f.wire, (vd_wire_side)side, f.buffer.data, f.buffer.bytes, &got));
            assert_int_equal(got.batch, 9);
            assert_int_equal(got.count, 1);
            check_same(&m, &got.messages[0]);
            assert_ok(
                vd_wire_encode(f.wire, (vd_wire_side)side, 9, got.messages, got.count, &again));
            assert_int_equal(again.bytes, f.buffer.bytes);
            assert_memory_equal(again.data, f.buffer.data, again.bytes);
            /* the other side may not have said it, unless it may */
            const vd_wire_side other = (vd_wire_side)(1 - side);
            const vd_status turned =
                vd_wire_decode(f.wire, other, f.buffer.data, f.buffer.bytes, &got);
            if (!vd_wire_may_send(other, m.kind)) {
                assert_int_equal(turned.code, VD_ERROR_FORMAT);
            }
        }
    }
    vd_wire_buffer_release(f.context, &again);
    end(&f);
}

/* Many messages in one envelope, in order; the buffer keeps a transport's head free. */
static void test_batches(void **state) {
    (void)state;
    fixture f = begin();
    f.buffer.head_bytes = 16;
    vd_wire_message messages[VD_WIRE_KIND_COUNT];
    int count = 0;
    for (int kind = VD_WIRE_HELLO; kind < VD_WIRE_KIND_COUNT; kind++) {
        if (vd_wire_may_send(VD_WIRE_SERVER, (vd_wire_kind)kind)) {
            messages[count++] = make(VD_WIRE_SERVER, (vd_wire_kind)kind);
        }
    }
    assert_ok(vd_wire_encode(f.wire, VD_WIRE_SERVER, 1, messages, count, &f.buffer));
    assert_true(f.buffer.data == f.buffer.memory + 16);
    vd_wire_envelope got;
    assert_ok(vd_wire_decode(f.wire, VD_WIRE_SERVER, f.buffer.data, f.buffer.bytes, &got));
    assert_int_equal(got.count, count);
    for (int i = 0; i < count; i++) {
        check_same(&messages[i], &got.messages[i]);
    }
    end(&f);
}

static void test_limits_of_envelopes(void **state) {
    (void)state;
    fixture f = begin();
    vd_wire_message *many = calloc(VD_WIRE_MAX_MESSAGES + 1, sizeof *many);
    for (int i = 0; i <= VD_WIRE_MAX_MESSAGES; i++) {
        many[i] = make(VD_WIRE_CLIENT, VD_WIRE_PING);
    }
    assert_ok(vd_wire_encode(f.wire, VD_WIRE_CLIENT, 0, many, VD_WIRE_MAX_MESSAGES, &f.buffer));
    vd_wire_envelope got;
    assert_ok(vd_wire_decode(f.wire, VD_WIRE_CLIENT, f.buffer.data, f.buffer.bytes, &got));
    vd_status status =
        vd_wire_encode(f.wire, VD_WIRE_CLIENT, 0, many, VD_WIRE_MAX_MESSAGES + 1, &f.buffer);
    assert_int_equal(status.code, VD_ERROR_ARGUMENT);
    assert_int_equal(vd_wire_encode(f.wire, VD_WIRE_CLIENT, 0, many, 0, &f.buffer).code,
                     VD_ERROR_ARGUMENT);
    free(many);
    /* one large picture may go alone, two messages of which one is large may not */
    const size_t large = VD_WIRE_BATCH_BYTES + 100;
    uint8_t *block = calloc(1, VD_WIRE_SCREEN_BYTES);
    vd_wire_message two[2] = {make(VD_WIRE_SERVER, VD_WIRE_GEOMETRY),
                              make(VD_WIRE_SERVER, VD_WIRE_PING)};
    two[0].as.geometry.block = (vd_wire_bytes){block, large};
    assert_ok(vd_wire_encode(f.wire, VD_WIRE_SERVER, 1, two, 1, &f.buffer));
    assert_ok(vd_wire_decode(f.wire, VD_WIRE_SERVER, f.buffer.data, f.buffer.bytes, &got));
    assert_int_equal(got.messages[0].as.geometry.block.bytes, large);
    status = vd_wire_encode(f.wire, VD_WIRE_SERVER, 1, two, 2, &f.buffer);
    assert_int_equal(status.code, VD_ERROR_LIMIT);
    assert_non_null(strstr(status.message, "apart"));
    /* the same by hand: a ping behind the large envelope */
    assert_ok(vd_wire_encode(f.wire, VD_WIRE_SERVER, 1, two, 1, &f.buffer));
    uint8_t *joined = malloc(f.buffer.bytes + 4);
    memcpy(joined, f.buffer.data, f.buffer.bytes);
    memcpy(joined + f.buffer.bytes, "\x12\x02\x62\x00", 4);
    status = vd_wire_decode(f.wire, VD_WIRE_SERVER, joined, f.buffer.bytes + 4, &got);
    assert_int_equal(status.code, VD_ERROR_LIMIT);
    free(joined);
    /* the largest screen */
    vd_wire_message screen = make(VD_WIRE_SERVER, VD_WIRE_SCREEN);
    screen.as.screen.width = screen.as.screen.height = 4096;
    screen.as.screen.picture = (vd_wire_bytes){block, VD_WIRE_SCREEN_BYTES};
    assert_ok(vd_wire_encode(f.wire, VD_WIRE_SERVER, 1, &screen, 1, &f.buffer));
    assert_ok(vd_wire_decode(f.wire, VD_WIRE_SERVER, f.buffer.data, f.buffer.bytes, &got));
    status = vd_wire_decode(f.wire, VD_WIRE_SERVER, block, VD_WIRE_ENVELOPE_BYTES + 1, &got);
    assert_int_equal(status.code, VD_ERROR_LIMIT);
    free(block);
    f.buffer.head_bytes = 5000;
    assert_int_equal(vd_wire_encode(f.wire, VD_WIRE_SERVER, 1, &two[1], 1, &f.buffer).code,
                     VD_ERROR_ARGUMENT);
    end(&f);
}

/* ---- bounds -----------------------------------------------------------------------------------*/

/* Checks that a changed message is refused with a sentence that has `says`. */
static void refuse(vd_wire_side side, vd_wire_message m, const char *says) {
    const vd_status status = vd_wire_check(side, &m);
    if (status.code != VD_ERROR_ARGUMENT || strstr(status.message, says) == NULL) {
        fail_msg("wanted '%s', got '%s'", says, status.message);
    }
}

#define REFUSE(side, the_kind, change, says)                                                       \
    do {                                                                                           \
        vd_wire_message m_ = make(side, the_kind);                                                 \
        assert_ok(vd_wire_check(side, &m_));                                                       \
        m_.as.change;                                                                              \
        refuse(side, m_, says);                                                                    \
    } while (0)

static void test_bounds_of_clients(void **state) {
    (void)state;
    const vd_wire_side c = VD_WIRE_CLIENT;
    static const uint64_t falling[2] = {8, 2};
    char long_text[400];
    memset(long_text, 'a', sizeof long_text);
    long_text[399] = '\0';
    REFUSE(c, VD_WIRE_HELLO, hello.version = 0, "hello.version is 0");
    REFUSE(c, VD_WIRE_HELLO, hello.token = long_text, "hello.token is longer than 256");
    REFUSE(c, VD_WIRE_HELLO, hello.token = "\xff", "hello.token is not UTF-8");
    REFUSE(c, VD_WIRE_HELLO, hello.name = "a\xc3", "hello.name is not UTF-8 at byte 1");
    REFUSE(c, VD_WIRE_HELLO, hello.memory_bytes = 5, "hello.memory_bytes");
    REFUSE(c, VD_WIRE_HELLO, hello.memory_bytes = UINT64_MAX, "hello.memory_bytes");
    REFUSE(c, VD_WIRE_HELLO, hello.particles = (1u << 20) + 1, "hello.particles");
    REFUSE(c, VD_WIRE_HELLO, hello.width = 0, "hello.width");
    REFUSE(c, VD_WIRE_HELLO, hello.height = 16384, "hello.height");
    REFUSE(c, VD_WIRE_HELLO, hello.held.ids = falling, "hello.held_ids");
    REFUSE(c, VD_WIRE_HELLO, hello.held.count = -1, "hello.held_ids");
    REFUSE(c, VD_WIRE_HELLO, hello.held_versions = NULL, "hello.held_versions");
    REFUSE(c, VD_WIRE_CAMERA, camera.sequence = 0, "camera.sequence");
    REFUSE(c, VD_WIRE_CAMERA, camera.camera.eye.y = NAN, "camera.eye");
    REFUSE(c, VD_WIRE_CAMERA, camera.camera.eye.z = 1e10, "camera.eye");
    REFUSE(c, VD_WIRE_CAMERA, camera.camera.orientation.w = 0.6, "camera.orientation");
    REFUSE(c, VD_WIRE_CAMERA, camera.camera.orientation.w = (double)INFINITY, "camera.orientation");
    REFUSE(c, VD_WIRE_CAMERA, camera.camera.projection = VD_PROJECTION_ORTHOGRAPHIC,
           "camera.projection");
    REFUSE(c, VD_WIRE_CAMERA, camera.camera.lens.fx = 0, "camera.fx");
    REFUSE(c, VD_WIRE_CAMERA, camera.camera.lens.fy = -1, "camera.fy");
    REFUSE(c, VD_WIRE_CAMERA, camera.camera.lens.cx = NAN, "camera.cx");
    REFUSE(c, VD_WIRE_CAMERA, camera.camera.lens.cy = 1e7, "camera.cy");
    REFUSE(c, VD_WIRE_CAMERA, camera.camera.near_m = 0, "camera.near");
    REFUSE(c, VD_WIRE_CAMERA, camera.width = -1, "camera.width");
    REFUSE(c, VD_WIRE_CAMERA, camera.height = 99999, "camera.height");
    REFUSE(c, VD_WIRE_CAMERA, camera.time_s = -1, "camera.time");
    REFUSE(c, VD_WIRE_ACKNOWLEDGE, acknowledge.batch = 0, "acknowledge.batch");
    REFUSE(c, VD_WIRE_ACKNOWLEDGE, acknowledge.held_bytes = UINT64_MAX, "acknowledge.held_bytes");
    REFUSE(c, VD_WIRE_STATS, stats.decode_s = NAN, "stats.decode_s");
    REFUSE(c, VD_WIRE_STATS, stats.shown = UINT64_MAX, "stats.shown");
    REFUSE(c, VD_WIRE_ERROR, error.code = 0, "error.code");
    REFUSE(c, VD_WIRE_ERROR, error.sentence = long_text, "error.sentence");
    REFUSE(c, VD_WIRE_BYE, bye.reason = VD_WIRE_REASON_COUNT, "bye.reason");
    REFUSE(c, VD_WIRE_SETTINGS, settings.mode = 0, "settings.mode");
    REFUSE(c, VD_WIRE_SETTINGS, settings.tolerance_px = NAN, "settings.tolerance_px");
    REFUSE(c, VD_WIRE_SETTINGS, settings.quality = 101, "settings.quality");
    REFUSE(c, VD_WIRE_SETTINGS, settings.codecs = 1, "settings.codecs");
    REFUSE(c, VD_WIRE_SETTINGS, settings.bytes_per_s = -1, "settings.bytes_per_s");
    vd_wire_message none = {.kind = VD_WIRE_NONE};
    refuse(c, none, "none");
    none.kind = VD_WIRE_KIND_COUNT;
    refuse(c, none, "unknown kind");
}

static void test_bounds_of_servers(void **state) {
    (void)state;
    const vd_wire_side s = VD_WIRE_SERVER;
    static const uint64_t zero[1] = {0};
    REFUSE(s, VD_WIRE_HELLO, hello.token = "x", "hello.token");
    REFUSE(s, VD_WIRE_HELLO, hello.memory_bytes = 1, "hello.memory_bytes");
    REFUSE(s, VD_WIRE_HELLO, hello.particles = 1, "hello.particles");
    REFUSE(s, VD_WIRE_HELLO, hello.width = 1, "hello.width");
    REFUSE(s, VD_WIRE_IMPOSTOR, impostor.id = 0, "impostor.id");
    REFUSE(s, VD_WIRE_IMPOSTOR, impostor.version = 0, "impostor.version");
    REFUSE(s, VD_WIRE_IMPOSTOR, impostor.origin.x = -2e9, "impostor.origin");
    REFUSE(s, VD_WIRE_IMPOSTOR, impostor.corners[2][1] = NAN, "impostor.corners");
    REFUSE(s, VD_WIRE_IMPOSTOR, impostor.corners[2][1] = 5, "no parallelogram");
    REFUSE(s, VD_WIRE_IMPOSTOR, impostor.corners[0][0] = 2e7f, "impostor.corners");
    REFUSE(s, VD_WIRE_IMPOSTOR, impostor.nearer = 0.5f, "impostor.nearer");
    REFUSE(s, VD_WIRE_IMPOSTOR, impostor.width = 1, "impostor.width");
    REFUSE(s, VD_WIRE_IMPOSTOR, impostor.height = 20000, "impostor.height");
    REFUSE(s, VD_WIRE_IMPOSTOR, impostor.width = 7, "impostor.picture");
    REFUSE(s, VD_WIRE_IMPOSTOR, impostor.opaque[2] = 7, "impostor.opaque");
    REFUSE(s, VD_WIRE_IMPOSTOR, impostor.opaque[1] = -1, "impostor.opaque");
    REFUSE(s, VD_WIRE_IMPOSTOR, impostor.opaque[1] = 4, "impostor.opaque");
    REFUSE(s, VD_WIRE_IMPOSTOR, impostor.codec = VD_CODEC_AUTO, "impostor.codec");
    REFUSE(s, VD_WIRE_IMPOSTOR, impostor.codec = VD_CODEC_COUNT, "impostor.codec");
    REFUSE(s, VD_WIRE_IMPOSTOR, impostor.picture.bytes = 95, "impostor.picture has 95 bytes");
    REFUSE(s, VD_WIRE_IMPOSTOR, impostor.picture.data = NULL, "impostor.picture");
    REFUSE(s, VD_WIRE_ORDER, order.ids.ids = zero, "order.ids has the id 0");
    REFUSE(s, VD_WIRE_ORDER, order.ids.count = VD_WIRE_MAX_IDS + 1, "order.ids has 65537");
    REFUSE(s, VD_WIRE_GEOMETRY, geometry.id = 0, "geometry.id");
    REFUSE(s, VD_WIRE_GEOMETRY, geometry.version = 0, "geometry.version");
    REFUSE(s, VD_WIRE_GEOMETRY, geometry.kind = 3, "geometry.kind");
    REFUSE(s, VD_WIRE_GEOMETRY, geometry.origin.z = NAN, "geometry.origin");
    REFUSE(s, VD_WIRE_GEOMETRY, geometry.block.bytes = 0, "geometry.block");
    REFUSE(s, VD_WIRE_GEOMETRY, geometry.block.bytes = SIZE_MAX, "geometry.block");
    REFUSE(s, VD_WIRE_INSTANCE, instance.id = 0, "instance.id");
    REFUSE(s, VD_WIRE_INSTANCE, instance.version = 0, "instance.version");
    REFUSE(s, VD_WIRE_INSTANCE, instance.model = 0, "instance.model");
    REFUSE(s, VD_WIRE_INSTANCE, instance.place.origin.x = 2e9, "instance.origin");
    REFUSE(s, VD_WIRE_INSTANCE, instance.place.axes[2][1] = NAN, "instance.axes");
    REFUSE(s, VD_WIRE_INSTANCE, instance.place.axes[0][0] = 2e6f, "instance.axes");
    REFUSE(s, VD_WIRE_INSTANCE, instance.place.sun = 1.5f, "instance.sun");
    REFUSE(s, VD_WIRE_INSTANCE, instance.place.ground[2] = INFINITY, "instance.ground");
    REFUSE(s, VD_WIRE_LIGHT, light.light.sun_direction.z = 1, "light.sun_direction");
    REFUSE(s, VD_WIRE_LIGHT, light.light.sun_direction.z = NAN, "light.sun_direction");
    REFUSE(s, VD_WIRE_LIGHT, light.light.horizon.b = -1, "light.colors");
    REFUSE(s, VD_WIRE_LIGHT, light.light.ambient_up.g = NAN, "light.colors");
    REFUSE(s, VD_WIRE_LIGHT, light.light.haze_m = -1, "light.haze_m");
    REFUSE(s, VD_WIRE_GROUND, ground.x = NAN, "ground.x");
    REFUSE(s, VD_WIRE_GROUND, ground.y = 2e9, "ground.y");
    REFUSE(s, VD_WIRE_GROUND, ground.step_m = 0, "ground.step");
    REFUSE(s, VD_WIRE_GROUND, ground.columns = 130, "ground.columns");
    REFUSE(s, VD_WIRE_GROUND, ground.rows = 1, "ground.rows");
    REFUSE(s, VD_WIRE_GROUND, ground.heights = NULL, "ground.heights is missing");
    REFUSE(s, VD_WIRE_GROUND, ground.heights = bad_heights, "ground.heights");
    REFUSE(s, VD_WIRE_REPLACE, replace.in = m_.as.replace.out, "both have the id 1");
    REFUSE(s, VD_WIRE_REPLACE, replace.in.count = m_.as.replace.out.count = 0, "both empty");
    REFUSE(s, VD_WIRE_REPLACE, replace.out.count = 4097, "replace.out has 4097");
    REFUSE(s, VD_WIRE_DROP, drop.count = 0, "drop.ids has 0");
    REFUSE(s, VD_WIRE_SCREEN, screen.camera = 0, "screen.camera");
    REFUSE(s, VD_WIRE_SCREEN, screen.codec = VD_CODEC_JPEG, "screen.exact");
    REFUSE(s, VD_WIRE_SCREEN, screen.width = 0, "screen.width");
    REFUSE(s, VD_WIRE_SCREEN, screen.picture.bytes = 0, "screen.picture");
}

/* ---- bytes from outside -----------------------------------------------------------------------*/

/* Decodes from memory that ends with the bytes. */
static vd_status decode(fixture *f, vd_wire_side side, const uint8_t *data, size_t bytes,
                        vd_wire_envelope *got) {
    uint8_t *exact = malloc(bytes > 0 ? bytes : 1);
    memcpy(exact, data, bytes);
    const vd_status status = vd_wire_decode(f->wire, side, exact, bytes, got);
    free(exact);
    return status;
}

/* Whatever is accepted is in bounds and encodes again. */
static void check_accepted(fixture *f, vd_wire_side side, const vd_wire_envelope *got) {
    bool known = true;
    for (int i = 0; i < got->count; i++) {
        known = known && got->messages[i].kind != VD_WIRE_NONE;
    }
    if (known) {
        vd_wire_buffer again = {0};
        assert_ok(vd_wire_encode(f->wire, side, got->batch, got->messages, got->count, &again));
        vd_wire_buffer_release(f->context, &again);
    }
}

static void test_truncations_and_mutations(void **state) {
    (void)state;
    fixture f = begin();
    uint64_t seed = 1;
    int accepted = 0;
    for (int side = 0; side < VD_WIRE_SIDE_COUNT; side++) {
        for (int kind = VD_WIRE_HELLO; kind < VD_WIRE_KIND_COUNT; kind++) {
            const vd_wire_message m = make((vd_wire_side)side, (vd_wire_kind)kind);
            if (!vd_wire_may_send((vd_wire_side)side, m.kind)) {
                continue;
            }
            assert_ok(vd_wire_encode(f.wire, (vd_wire_side)side, 3, &m, 1, &f.buffer));
            const size_t bytes = f.buffer.bytes;
            vd_wire_envelope got;
            for (size_t cut = 0; cut < bytes; cut++) {
                const vd_status status = decode(&f, (vd_wire_side)side, f.buffer.data, cut, &got);
                assert_int_equal(status.code, VD_ERROR_FORMAT);
                assert_true(strlen(status.message) > 20);
            }
            uint8_t *changed = malloc(bytes);
            for (int trial = 0; trial < 3000; trial++) {
                memcpy(changed, f.buffer.data, bytes);
                for (uint64_t n = 1 + test_random(&seed) % 3; n > 0; n--) {
                    const size_t at = test_random(&seed) % bytes;
                    changed[at] = test_random(&seed) % 2 == 0
                                      ? (uint8_t)test_random(&seed)
                                      : (uint8_t)(changed[at] ^ 1u << test_random(&seed) % 8);
                }
                const vd_status status = decode(&f, (vd_wire_side)side, changed, bytes, &got);
                if (status.code == VD_OK) {
                    accepted++;
                    check_accepted(&f, (vd_wire_side)side, &got);
                } else {
                    assert_int_equal(status.code, VD_ERROR_FORMAT);
                }
            }
            free(changed);
        }
    }
    assert_true(accepted > 1000);
    end(&f);
}

/* What no struct of ours could say, by hand: field 2 is a message, its field 3 an impostor … */
static void test_foreign_bytes(void **state) {
    (void)state;
    fixture f = begin();
    const struct {
        const char *bytes;
        size_t count;
        vd_wire_side side;
        const char *says; /* null: taken */
    } cases[] = {
        {"", 0, VD_WIRE_CLIENT, "0 messages"},
        {"\x08\x05", 2, VD_WIRE_CLIENT, "0 messages"},
        {"GET / HTTP/1.1\r\n", 16, VD_WIRE_CLIENT, "not an envelope"},
        {"\x12\x00", 2, VD_WIRE_CLIENT, NULL},                 /* a message of no kind */
        {"\x12\x04\xfa\x01\x01\x00", 6, VD_WIRE_CLIENT, NULL}, /* of a newer kind, 31 */
        {"\x12\x04\x62\x02\x10\x07", 6, VD_WIRE_CLIENT, NULL}, /* a ping with a newer field */
        {"\x12\x02\x62\x00\xfa\x01\x01\x00", 8, VD_WIRE_CLIENT, NULL}, /* a newer envelope */
        {"\x12\x02\x12\x00", 4, VD_WIRE_CLIENT, "camera.eye is missing"},
        {"\x12\x02\x1a\x00", 4, VD_WIRE_SERVER, "impostor.corners has 0 numbers"},
        {"\x12\x02\x2a\x00", 4, VD_WIRE_SERVER, "geometry.origin is missing"},
        {"\x12\x03\x82\x01\x00", 5, VD_WIRE_SERVER, "instance.axes has 0 numbers"},
        {"\x12\x03\x8a\x01\x00", 5, VD_WIRE_SERVER, "light.colors has 0 numbers"},
        {"\x12\x07\x92\x01\x04\x20\x03\x28\x02", 9, VD_WIRE_SERVER, "ground.heights has 0 numbers"},
        {"\x12\x0c\x0a\x0a\x42\x08\1\0\0\0\0\0\0\0", 14, VD_WIRE_CLIENT,
         "hello.held_versions has 0"},
        {"\x12\x04\x5a\x02\x08\x63", 6, VD_WIRE_SERVER, NULL}, /* an error of a newer code */
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        vd_wire_envelope got;
        const vd_status status =
            decode(&f, cases[i].side, (const uint8_t *)cases[i].bytes, cases[i].count, &got);
        if (cases[i].says == NULL) {
            assert_ok(status);
            assert_int_equal(got.count, 1);
        } else if (status.code != VD_ERROR_FORMAT ||
                   strstr(status.message, cases[i].says) == NULL) {
            fail_msg("%zu: wanted '%s', got '%s'", i, cases[i].says, status.message);
        }
    }
    end(&f);
}

/* Few bytes that promise many parts take no more memory than they may. */
static void test_memory_is_bounded(void **state) {
    (void)state;
    fixture f = begin();
    const size_t bytes = 8u << 20;
    uint8_t *data = malloc(bytes);
    vd_wire_envelope got;
    for (size_t i = 0; i < bytes; i += 2) { /* 4 M empty messages */
        data[i] = 0x12;
        data[i + 1] = 0;
    }
    vd_status status = vd_wire_decode(f.wire, VD_WIRE_CLIENT, data, bytes, &got);
    assert_int_equal(status.code, VD_ERROR_FORMAT);
    assert_non_null(strstr(status.message, "more parts"));
    assert_true(vd_context_memory(f.context).bytes_peak < f.bytes + bytes + (3u << 20));
    memset(data, 1, bytes); /* a million ids */
    memcpy(data, "\x12\xfb\xff\xff\x03\x22\xf6\xff\xff\x03\x12\xf1\xff\xff\x03", 15);
    status = vd_wire_decode(f.wire, VD_WIRE_SERVER, data, bytes, &got);
    assert_int_equal(status.code, VD_ERROR_FORMAT);
    assert_true(vd_context_memory(f.context).bytes_peak < f.bytes + bytes + (3u << 20));
    free(data);
    end(&f);
}

static void test_out_of_memory(void **state) {
    (void)state;
    const vd_wire_message m = make(VD_WIRE_SERVER, VD_WIRE_IMPOSTOR);
    bool failed = true;
    for (int n = 1; failed; n++) {
        test_allocator allocator = {0};
        vd_context *context = test_failing_context(&allocator);
        const int live = allocator.live;
        allocator.fail_at = allocator.calls + n;
        vd_wire *wire = NULL;
        vd_wire_buffer buffer = {0};
        vd_wire_envelope got;
        vd_status status = vd_wire_create(context, &wire);
        if (status.code == VD_OK) {
            status = vd_wire_encode(wire, VD_WIRE_SERVER, 1, &m, 1, &buffer);
        }
        if (status.code == VD_OK) {
            status = vd_wire_decode(wire, VD_WIRE_SERVER, buffer.data, buffer.bytes, &got);
        }
        failed = status.code != VD_OK;
        if (failed) {
            assert_int_equal(status.code, VD_ERROR_MEMORY);
        }
        vd_wire_buffer_release(context, &buffer);
        vd_wire_destroy(&wire);
        assert_int_equal(allocator.live, live);
        vd_context_destroy(&context);
    }
}

/* ---- a recorded exchange ----------------------------------------------------------------------
 * test/wire/exchange.vdx: what a client and a server said, as docs/wire.md describes recordings.
 * Written by this test where VEDUTA_RECORD=FILE is set. */

static void store_u32(uint8_t *out, uint32_t value) {
    for (int i = 0; i < 4; i++) {
        out[i] = (uint8_t)(value >> 8 * i);
    }
}

static uint32_t load_u32(const uint8_t *at) {
    return at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

typedef struct step {
    vd_wire_side side;
    uint32_t batch;
    vd_wire_kind kinds[4];
} step;

static const step exchange[] = {
    {VD_WIRE_CLIENT, 0, {VD_WIRE_HELLO, VD_WIRE_SETTINGS}},
    {VD_WIRE_SERVER, 0, {VD_WIRE_HELLO}},
    {VD_WIRE_CLIENT, 0, {VD_WIRE_CAMERA}},
    {VD_WIRE_SERVER, 1, {VD_WIRE_IMPOSTOR, VD_WIRE_GEOMETRY, VD_WIRE_ORDER}},
    {VD_WIRE_CLIENT, 0, {VD_WIRE_ACKNOWLEDGE, VD_WIRE_STATS}},
    {VD_WIRE_SERVER, 2, {VD_WIRE_REPLACE, VD_WIRE_DROP, VD_WIRE_STATS}},
    {VD_WIRE_SERVER, 0, {VD_WIRE_LIGHT, VD_WIRE_INSTANCE, VD_WIRE_GROUND}},
    {VD_WIRE_SERVER, 0, {VD_WIRE_PING}},
    {VD_WIRE_CLIENT, 0, {VD_WIRE_PONG}},
    {VD_WIRE_SERVER, 3, {VD_WIRE_SCREEN}},
    {VD_WIRE_CLIENT, 0, {VD_WIRE_DROP, VD_WIRE_BYE}},
    {VD_WIRE_SERVER, 0, {VD_WIRE_ERROR, VD_WIRE_BYE}},
};
enum { STEPS = sizeof exchange / sizeof exchange[0] };

/* The recording anew, into out; returns its bytes. */
static size_t record(fixture *f, uint8_t *out, size_t room) {
    size_t used = 8;
    memcpy(out, "VDX\0\1\0\0\0", 8);
    for (int i = 0; i < STEPS; i++) {
        vd_wire_message messages[4];
        int count = 0;
        while (count < 4 && exchange[i].kinds[count] != VD_WIRE_NONE) {
            messages[count] = make(exchange[i].side, exchange[i].kinds[count]);
            count++;
        }
        assert_ok(vd_wire_encode(f->wire, exchange[i].side, exchange[i].batch, messages, count,
                                 &f->buffer));
        assert_true(used + 12 + f->buffer.bytes <= room);
        store_u32(out + used, (uint32_t)exchange[i].side);
        store_u32(out + used + 4, (uint32_t)(16 * i));
        store_u32(out + used + 8, (uint32_t)f->buffer.bytes);
        memcpy(out + used + 12, f->buffer.data, f->buffer.bytes);
        used += 12 + f->buffer.bytes;
    }
    return used;
}

static void test_recorded_exchange(void **state) {
    (void)state;
    fixture f = begin();
    static uint8_t made[4096], read[4097];
    const size_t made_bytes = record(&f, made, sizeof made);
    const char *path = getenv("VEDUTA_RECORD");
    if (path != NULL) {
        FILE *out = fopen(path, "wb");
        assert_non_null(out);
        assert_int_equal(fwrite(made, 1, made_bytes, out), made_bytes);
        assert_int_equal(fclose(out), 0);
    }
    FILE *in = fopen(VEDUTA_SOURCE_DIR "/test/wire/exchange.vdx", "rb");
    assert_non_null(in);
    const size_t bytes = fread(read, 1, sizeof read, in);
    fclose(in);
    /* what was said once is understood for ever, and said the same way today */
    size_t at = 8;
    for (int i = 0; i < STEPS; i++) {
        assert_true(at + 12 <= bytes);
        const uint32_t length = load_u32(read + at + 8);
        assert_true(at + 12 + length <= bytes);
        vd_wire_envelope got;
        assert_int_equal(load_u32(read + at), exchange[i].side);
        assert_ok(decode(&f, exchange[i].side, read + at + 12, length, &got));
        assert_int_equal(got.batch, exchange[i].batch);
        for (int k = 0; k < got.count; k++) {
            const vd_wire_message m = make(exchange[i].side, exchange[i].kinds[k]);
            check_same(&m, &got.messages[k]);
        }
        at += 12 + length;
    }
    assert_int_equal(at, bytes);
    assert_int_equal(bytes, made_bytes);
    assert_memory_equal(read, made, bytes);
    end(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trips),
        cmocka_unit_test(test_fixed_pictures),
        cmocka_unit_test(test_batches),
        cmocka_unit_test(test_limits_of_envelopes),
        cmocka_unit_test(test_bounds_of_clients),
        cmocka_unit_test(test_bounds_of_servers),
        cmocka_unit_test(test_truncations_and_mutations),
        cmocka_unit_test(test_foreign_bytes),
        cmocka_unit_test(test_memory_is_bounded),
        cmocka_unit_test(test_out_of_memory),
        cmocka_unit_test(test_recorded_exchange),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
