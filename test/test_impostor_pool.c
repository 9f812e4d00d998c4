/* Sets that share pictures: who takes what, for how long it is there, how wrong it may be. */
#include <math.h>
#include "impostor/impostor_pool.h"
#include "impostor_scenes.h"

enum { MOST_SETS = 4 };

#define IDLE_BYTES ((size_t)1 << 18)

/* A world and several sets of it. */
typedef struct shared_scene {
    scene s; /* its set is null */
    vd_impostor_pool *pool;
    vd_impostors *sets[MOST_SETS];
    vd_frame *frame;
    double time_s;
} shared_scene;

static vd_impostor_def sharing(const shared_scene *t) {
    vd_impostor_def def = patient();
    def.settle = false;
    def.samples = 1;
    def.pool = t->pool;
    return def;
}

static void add_set(shared_scene *t, int index, const vd_impostor_def *def) {
    assert_ok(vd_impostors_create(t->s.context, t->s.world, t->s.renderer, def, &t->sets[index]));
}

static void begin_shared(shared_scene *t, int sets, size_t idle_bytes) {
    vd_impostor_def def = patient();
    memset(t, 0, sizeof *t);
    begin(&t->s, 100, &def);
    vd_impostors_destroy(&t->s.set);
    assert_ok(vd_frame_create(t->s.context, WIDTH, HEIGHT, VD_PLANE_DEPTH, &t->frame));
    assert_ok(vd_impostor_pool_create(t->s.context, idle_bytes, &t->pool));
    def = sharing(t);
    for (int i = 0; i < sets; i++) {
        add_set(t, i, &def);
    }
}

static void end_shared(shared_scene *t) {
    for (int i = 0; i < MOST_SETS; i++) {
        vd_impostors_destroy(&t->sets[i]);
    }
    assert_int_equal(vd_impostor_pool_bytes(t->pool), 0);
    vd_impostor_pool_destroy(&t->pool);
    assert_null(t->pool);
    vd_frame_destroy(&t->frame);
    end(&t->s);
}

static vd_impostor_stats turn(shared_scene *t, int set, const vd_camera *camera) {
    vd_impostor_stats stats;
    t->time_s += 1.0 / 60;
    assert_ok(vd_impostors_update(t->sets[set], NULL, camera, WIDTH, HEIGHT, t->time_s, &stats));
    return stats;
}

/* Updates until nothing is drawn or taken; returns how many pictures were drawn. */
static uint64_t rest(shared_scene *t, int set, const vd_camera *camera) {
    uint64_t drawn = 0, before = UINT64_MAX;
    for (int i = 0; i < 20; i++) {
        const vd_impostor_stats stats = turn(t, set, camera);
        drawn += stats.drawn;
        if (stats.drawn == 0 && stats.shared == before && stats.waiting == 0) {
            break;
        }
        before = stats.shared;
    }
    return drawn;
}

static uint64_t shown_hash(shared_scene *t, int set, const vd_camera *camera) {
    assert_ok(vd_impostors_draw(t->sets[set], NULL, camera, t->frame, NULL));
    return vd_frame_hash(t->frame);
}

/* Bytes of the pictures that sets have, each counted once. */
static size_t held_bytes(const shared_scene *t) {
    double sum = 0.0;
    for (int k = 0; k < MOST_SETS; k++) {
        const vd_impostors *set = t->sets[k];
        for (uint32_t i = 0; set != NULL && i < set->slots.count; i++) {
            const vd_impostor_picture *p = &vd_impostor_slot_at(set, i)->now;
            if (p->rgba != NULL) {
                assert_non_null(p->pooled);
                assert_true(p->pooled->holders > 0 && p->pooled->holders <= MOST_SETS);
                assert_ptr_equal(p->rgba, p->pooled->picture.rgba);
                sum += 4.0 * p->width * p->height / p->pooled->holders;
            }
        }
    }
    return (size_t)(sum + 0.5);
}

/* ---- who takes what ---------------------------------------------------------------------------*/

static void the_same_camera_needs_no_drawing(void **state) {
    (void)state;
    shared_scene t;
    begin_shared(&t, 3, 0);
    const vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    assert_true(rest(&t, 0, &camera) > 10);
    const size_t one = vd_impostor_pool_bytes(t.pool);
    assert_int_equal(one, t.sets[0]->bytes);
    for (int i = 1; i < 3; i++) {
        assert_int_equal(rest(&t, i, &camera), 0);
        assert_int_equal(t.sets[i]->stats.shared, t.sets[i]->stats.pictures);
        assert_int_equal(t.sets[i]->bytes, one); /* its client has them all */
        assert_int_equal(vd_impostor_pool_bytes(t.pool), one);
        assert_true(shown_hash(&t, i, &camera) == shown_hash(&t, 0, &camera));
    }
    /* The maker goes; what it made stays as long as others have it. */
    const uint64_t hash = shown_hash(&t, 1, &camera);
    vd_impostors_destroy(&t.sets[0]);
    assert_int_equal(vd_impostor_pool_bytes(t.pool), one);
    vd_impostors_destroy(&t.sets[2]);
    assert_true(shown_hash(&t, 1, &camera) == hash);
    assert_int_equal(held_bytes(&t), one);
    end_shared(&t);
}

static void another_place_shares_nothing(void **state) {
    (void)state;
    shared_scene t;
    begin_shared(&t, 2, 0);
    const vd_camera here = looking(vd_vec3_make(0, 0, 0));
    vd_camera there = here;
    there.eye = vd_vec3_make(30, 420, 130);
    there.orientation = vd_orientation_from_angles(0.1 + 3.14159265358979, -0.25, 0.0);
    assert_true(rest(&t, 0, &here) > 10);
    assert_true(rest(&t, 1, &there) > 10);
    assert_int_equal(t.sets[1]->stats.shared, 0);
    assert_int_equal(vd_impostor_pool_bytes(t.pool), t.sets[0]->bytes + t.sets[1]->bytes);
    end_shared(&t);
}

/* Of other samples, for a wider tolerance, without reuse, or alone. */
static void what_does_not_fit_is_not_shared(void **state) {
    (void)state;
    shared_scene t;
    begin_shared(&t, 1, 0);
    const vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    (void)rest(&t, 0, &camera);
    vd_impostor_def defs[3] = {sharing(&t), sharing(&t), sharing(&t)};
    defs[0].samples = 4;
    defs[1].tolerance_px = 1.5;
    defs[2].no_reuse = true;
    for (int i = 0; i < 3; i++) {
        add_set(&t, 1, &defs[i]);
        assert_true(turn(&t, 1, &camera).drawn > 10);
        assert_int_equal(t.sets[1]->stats.shared, 0);
        vd_impostors_destroy(&t.sets[1]);
    }
    defs[0] = sharing(&t); /* a finer tolerance does with edges that reach farther */
    defs[0].tolerance_px = 0.5;
    add_set(&t, 1, &defs[0]);
    (void)rest(&t, 1, &camera);
    assert_true(t.sets[1]->stats.shared > 10);
    end_shared(&t);
}

/* With a pool of its own a set does to the byte what it does without. */
static void alone_nothing_changes(void **state) {
    (void)state;
    shared_scene t;
    begin_shared(&t, 1, IDLE_BYTES);
    vd_impostor_def def = sharing(&t);
    def.pool = NULL;
    add_set(&t, 1, &def);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    for (int i = 0; i < 60; i++) {
        /* To and fro: pictures made before would do again. */
        camera.eye.x += i % 20 < 10 ? 1.5 : -1.5;
        const vd_impostor_stats a = turn(&t, 0, &camera), b = turn(&t, 1, &camera);
        assert_int_equal(a.drawn, b.drawn);
        assert_int_equal(a.bytes, b.bytes);
        assert_int_equal(a.shared, 0);
        assert_true(shown_hash(&t, 0, &camera) == shown_hash(&t, 1, &camera));
    }
    assert_int_equal(vd_impostor_pool_bytes(t.pool), t.sets[0]->bytes);
    end_shared(&t);
}

/* The sky is there once, and is what each would have drawn from where it is. */
static void all_see_one_sky(void **state) {
    (void)state;
    shared_scene t;
    begin_shared(&t, 0, 0);
    vd_impostor_def def = sharing(&t);
    def.ship = true;
    add_set(&t, 0, &def);
    add_set(&t, 1, &def);
    def.pool = NULL;
    add_set(&t, 2, &def);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    for (int i = 0; i < 3; i++) {
        const vd_impostor_item *items = NULL;
        int count = 0, skies = 0;
        camera.eye = i > 0 ? vd_vec3_make(5000, -300, 2500) : camera.eye;
        (void)turn(&t, i, &camera);
        assert_ok(vd_impostors_finish_order(t.sets[i], NULL, &items, &count));
        for (int k = 0; k < count; k++) {
            skies += items[k].picture.rgba == t.sets[i]->extras[skies % VD_SKY_SIDES].rgba;
            assert_true(i == 2 ? items[k].shared == 0 : k >= VD_SKY_SIDES || items[k].shared != 0);
        }
        assert_int_equal(skies, VD_SKY_SIDES);
    }
    for (int i = 0; i < VD_SKY_SIDES; i++) {
        const vd_impostor_extra *a = &t.sets[0]->extras[i], *b = &t.sets[1]->extras[i];
        const vd_impostor_extra *c = &t.sets[2]->extras[i];
        assert_ptr_equal(a->rgba, b->rgba);
        assert_true(a->shared == b->shared && a->shared != 0);
        assert_memory_equal(b->rgba, c->rgba, 4 * (size_t)c->width * (size_t)c->height);
        assert_memory_equal(b->corners, c->corners, sizeof b->corners);
        assert_true(b->corners[0].x != a->corners[0].x);
    }
    end_shared(&t);
}

/* One frame for the still pictures of all clients: whose was drawn over is drawn again. */
static void still_pictures_take_turns(void **state) {
    (void)state;
    shared_scene t;
    begin_shared(&t, 0, 0);
    vd_impostor_def def = sharing(&t);
    def.settle = true;
    add_set(&t, 2, &def); /* without `ship` it keeps its own */
    def.ship = true;
    vd_camera cameras[3];
    uint64_t hashes[3];
    int drew_last = 0;
    for (int i = 0; i < 3; i++) {
        cameras[i] = looking(vd_vec3_make(0, 0, 0));
        cameras[i].eye.x += 40.0 * i;
        assert_ok(vd_world_renderer_draw(t.s.renderer, NULL, &cameras[i], t.frame, NULL));
        hashes[i] = vd_frame_hash(t.frame);
    }
    for (int k = 0; k < 6; k++) {
        const int i = k % 3;
        if (k < 2) {
            add_set(&t, k, &def);
        }
        for (int n = 0; n < 20 && !vd_impostors_settled(t.sets[i]); n++) {
            const vd_impostor_item *items = NULL;
            int count = 0;
            (void)turn(&t, i, &cameras[i]);
            assert_ok(vd_impostors_fresh(t.sets[i], &items, &count));
            for (int m = 0; m < count; m++) {
                vd_impostors_deliver(t.sets[i], items[m].id, items[m].version);
            }
        }
        assert_non_null(vd_impostors_still(t.sets[i]));
        assert_true(vd_frame_hash(vd_impostors_still(t.sets[i])) == hashes[i]);
        drew_last = i < 2 ? i : drew_last;
        assert_non_null(vd_impostors_still(t.sets[drew_last])); /* whatever 2 did */
        assert_true(k == 0 || vd_impostors_still(t.sets[1 - drew_last]) == NULL);
        assert_true(k == 0 || !vd_impostors_settled(t.sets[1 - drew_last]));
    }
    end_shared(&t);
}

static void pools_are_of_one_world(void **state) {
    (void)state;
    shared_scene t;
    begin_shared(&t, 1, 0);
    vd_world_renderer *other = NULL;
    vd_impostors *set = NULL;
    const vd_impostor_def def = sharing(&t);
    assert_ok(vd_world_renderer_create(t.s.context, NULL, t.s.world, NULL, &other));
    const vd_status status = vd_impostors_create(t.s.context, t.s.world, other, &def, &set);
    assert_int_equal(status.code, VD_ERROR_ARGUMENT);
    assert_non_null(strstr(status.message, "pool"));
    assert_null(set);
    vd_world_renderer_destroy(&other);
    end_shared(&t);
    vd_impostor_pool_destroy(&t.pool);
    vd_impostor_pool_destroy(NULL);
}

/* ---- walks ------------------------------------------------------------------------------------*/

/* How wrong what a set shows is, after it has drawn all it wished for. */
static double worst_of(const vd_impostors *set, const vd_camera *camera) {
    const vd_impostor_view view = vd_impostors_view(set, camera, WIDTH, HEIGHT);
    double worst = 0.0;
    for (uint32_t i = 0; i < set->slots.count; i++) {
        const vd_impostor_slot *slot = vd_impostor_slot_at(set, i);
        if (slot->used == set->update && slot->now.rgba != NULL && slot->failures == 0) {
            vd_vec3 points[VD_IMPOSTOR_POINTS];
            const int count = vd_impostor_key_points(set, &view, slot->node, points);
            const double error = vd_impostor_plane_error(&slot->now.plane, points, count,
                                                         camera->eye, view.focal_px);
            worst = error > worst ? error : worst;
        }
    }
    return worst;
}

/* Four walk after each other, each a few steps behind. */
static void walking_apart_keeps_bounds(void **state) {
    (void)state;
    shared_scene t;
    begin_shared(&t, MOST_SETS, IDLE_BYTES);
    enum { STEPS = 150, BEHIND = 5, LONGEST = STEPS + MOST_SETS * BEHIND };
    static vd_camera path[LONGEST];
    uint64_t random = 9, drawn = 0;
    double worst = 0.0;
    size_t most = 0;
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    vd_vec3 motion = {0.3, 0.2, 0};
    for (int i = 0; i < LONGEST; i++) {
        if (i % 30 == 0) {
            motion = vd_vec3_make(test_uniform(&random) - 0.5, test_uniform(&random) - 0.5, 0.02);
        }
        camera.eye = vd_vec3_add(camera.eye, motion);
        camera.orientation = vd_orientation_from_angles(0.1 + 0.004 * i, -0.25, 0.0);
        path[i] = camera;
    }
    for (int i = 0; i < STEPS; i++) {
        size_t all = 0;
        for (int k = 0; k < MOST_SETS; k++) {
            const vd_camera *at = &path[i + (MOST_SETS - 1 - k) * BEHIND];
            drawn += turn(&t, k, at).drawn;
            if (i > 0) {
                const double error = worst_of(t.sets[k], at);
                worst = error > worst ? error : worst;
            }
        }
        for (int k = 0; k < MOST_SETS; k++) {
            all += t.sets[k]->bytes;
        }
        const size_t bytes = vd_impostor_pool_bytes(t.pool), held = held_bytes(&t);
        assert_true(bytes >= held && bytes <= held + IDLE_BYTES);
        assert_true(held <= all);
        most = bytes > most ? bytes : most;
    }
    uint64_t shared = 0;
    for (int k = 0; k < MOST_SETS; k++) {
        shared += t.sets[k]->stats.shared;
        assert_int_equal(t.sets[k]->stats.failed, 0);
    }
    print_message("%d drawn, %d taken; %zu bytes at most; %.3f pixels wrong\n", (int)drawn,
                  (int)shared, most, worst);
    assert_true(shared > drawn / 4);
    assert_true(worst <= 1.25);
    end_shared(&t);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_same_camera_needs_no_drawing),
                                       cmocka_unit_test(another_place_shares_nothing),
                                       cmocka_unit_test(what_does_not_fit_is_not_shared),
                                       cmocka_unit_test(alone_nothing_changes),
                                       cmocka_unit_test(all_see_one_sky),
                                       cmocka_unit_test(still_pictures_take_turns),
                                       cmocka_unit_test(pools_are_of_one_world),
                                       cmocka_unit_test(walking_apart_keeps_bounds)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
