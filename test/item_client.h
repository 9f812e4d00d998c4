/* item_client.h: a client that has pictures and nothing else, and what it is sent. */
#ifndef VEDUTA_TEST_ITEM_CLIENT_H
#define VEDUTA_TEST_ITEM_CLIENT_H

#include <math.h>
#include "held.h"
#include "impostor/impostor_set.h"
#include "world_scenes.h"

typedef struct client {
    held items[MOST_HELD];
    int count;
    uint64_t order[MOST_HELD];
    int order_count;
    vd_display *display;
    size_t bytes;
} client;

typedef struct scene {
    vd_context *context;
    vd_heightfield *map;
    vd_world *world;
    vd_world_renderer *renderer;
    vd_impostors *set;
    vd_frame *frame, *perfect;
    client client;
    double time_s;
} scene;

static scene s;

static vd_impostor_def shipping(void) {
    vd_impostor_def def = vd_impostor_def_default();
    def.ship = true;
    def.spare = 0.1;
    def.budget_s = 100.0;
    def.least_reuse = 2.0;
    return def;
}

/* `add` places more in the world; null: there is no more. */
static void begin_with(const vd_impostor_def *def, int balls, void (*add)(void)) {
    const vd_vec3 middle = {0, 0, 0};
    memset(&s, 0, sizeof s);
    s.context = test_context(2, VD_ISA_AUTO);
    s.map = hills(s.context, middle);
    s.world = make_world(s.context, s.map, middle, balls, 3);
    if (add != NULL) {
        add();
        assert_ok(vd_world_arrange(s.world, NULL));
    }
    assert_ok(vd_world_renderer_create(s.context, NULL, s.world, NULL, &s.renderer));
    assert_ok(vd_impostors_create(s.context, s.world, s.renderer, def, &s.set));
    assert_ok(vd_frame_create(s.context, WIDTH, HEIGHT, 0, &s.frame));
    assert_ok(vd_frame_create(s.context, WIDTH, HEIGHT, 0, &s.perfect));
    assert_ok(vd_display_create(s.context, &s.client.display));
}

static void end(void) {
    for (int i = 0; i < s.client.count; i++) {
        free(s.client.items[i].rgba);
    }
    vd_display_destroy(&s.client.display);
    vd_frame_destroy(&s.frame);
    vd_frame_destroy(&s.perfect);
    vd_impostors_destroy(&s.set);
    vd_world_renderer_destroy(&s.renderer);
    vd_world_destroy(&s.world);
    vd_heightfield_destroy(s.context, &s.map);
    assert_int_equal(vd_context_memory(s.context).bytes_now > 0, 1); /* the context itself */
    vd_context_destroy(&s.context);
}

static held *find(uint64_t id) {
    for (int i = 0; i < s.client.count; i++) {
        if (s.client.items[i].id == id) {
            return &s.client.items[i];
        }
    }
    return NULL;
}

static void forget(uint64_t id) {
    held *h = find(id);
    assert_non_null(h);
    s.client.bytes -= 4 * h->picture.stride * (size_t)h->picture.height;
    free(h->rgba);
    *h = s.client.items[--s.client.count];
}

static void receive(const vd_impostor_item *item) {
    held *h = find(item->id);
    if (h != NULL) {
        assert_true(item->version > h->version);
        forget(item->id);
    }
    assert_true(s.client.count < MOST_HELD);
    h = &s.client.items[s.client.count++];
    const size_t bytes = 4 * item->picture.stride * (size_t)item->picture.height;
    *h = (held){.id = item->id, .version = item->version, .picture = item->picture};
    memcpy(h->corners, item->corners, sizeof h->corners);
    h->picture.rgba = h->rgba = malloc(bytes);
    memcpy(h->rgba, item->picture.rgba, bytes);
    s.client.bytes += bytes;
}

/* One turn of a server: at most `most` pictures are sent. Returns how much is missing. */
static double serve(const vd_camera *camera, int most) {
    const vd_impostor_item *items;
    const uint64_t *gone;
    int count;
    vd_impostor_order order;
    s.time_s += 1.0 / 60;
    assert_ok(vd_impostors_update(s.set, NULL, camera, WIDTH, HEIGHT, s.time_s, NULL));
    assert_ok(vd_impostors_fresh(s.set, &items, &count));
    for (int i = 0; i < count && i < most; i++) {
        receive(&items[i]);
        vd_impostors_deliver(s.set, items[i].id, items[i].version);
    }
    assert_ok(vd_impostors_finish_order(s.set, NULL, &items, &count));
    for (int i = 0; i < count; i++) {
        receive(&items[i]);
        vd_impostors_deliver(s.set, items[i].id, items[i].version);
    }
    assert_ok(vd_impostors_order(s.set, &order));
    s.client.order_count = order.count;
    memcpy(s.client.order, order.ids, (size_t)order.count * sizeof(uint64_t));
    assert_ok(vd_impostors_gone(s.set, &gone, &count));
    for (int i = 0; i < count; i++) {
        assert_true(i == 0 || gone[i] > gone[i - 1]);
        forget(gone[i]);
    }
    return order.missing;
}

/* What the client shows; every id must be one that it has. */
static double show_error(const vd_camera *camera) {
    static vd_quad quads[MOST_HELD];
    for (int i = 0; i < s.client.order_count; i++) {
        const held *h = find(s.client.order[i]);
        assert_non_null(h);
        quads[i] = (vd_quad){.picture = h->picture, .opacity = 255};
        assert_ok(vd_quad_place(&quads[i], camera, h->corners));
    }
    memset(s.frame->rgba, 0, 4 * s.frame->stride * (size_t)s.frame->height);
    assert_ok(vd_display_draw(s.client.display, NULL, s.frame, quads, s.client.order_count, NULL));
    for (int y = 0; y < HEIGHT; y++) { /* everything is covered: the sky is */
        for (int x = 0; x < WIDTH; x++) {
            assert_int_equal(s.frame->rgba[4 * ((size_t)y * s.frame->stride + (size_t)x) + 3], 255);
        }
    }
    assert_ok(vd_world_renderer_draw(s.renderer, NULL, camera, s.perfect, NULL));
    return vd_frame_error(s.frame, s.perfect);
}

#endif
