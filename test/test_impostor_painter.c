/* Pictures that a thread draws while frames go on. */
#include <pthread.h>
#include "impostor_scenes.h"

static vd_impostor_def in_background(void) {
    vd_impostor_def def = patient();
    def.background = true;
    def.settle = false;
    return def;
}

/* Updates until nothing is left to be drawn. */
static vd_impostor_stats converge(scene *s, const vd_camera *camera) {
    vd_impostor_stats stats = step(s, camera);
    for (int i = 0; i < 10000 && stats.drawn + stats.waiting + stats.in_flight > 0; i++) {
        vd_impostors_wait(s->set);
        stats = step(s, camera);
    }
    assert_int_equal(stats.drawn + stats.waiting + stats.in_flight, 0);
    return stats;
}

/* No update draws a picture, all come, and what is shown in the end is what a set shows that draws
 * them itself. */
static void they_come_and_are_the_same(void **state) {
    (void)state;
    for (int threads = 1; threads <= 3; threads++) {
        scene s;
        const vd_impostor_def def = in_background();
        begin_with(&s, threads, 300, &def);
        vd_impostor_def own = def;
        own.background = false;
        vd_impostors *other = NULL;
        assert_ok(vd_impostors_create(s.context, s.world, s.renderer, &own, &other));
        const vd_camera camera = looking(vd_vec3_make(0, 0, 0));
        vd_impostor_stats stats = step(&s, &camera);
        assert_true(stats.drawn == 0 && stats.in_flight > 0);
        check_once(&s, &camera);
        stats = converge(&s, &camera);
        assert_true(stats.shown > 0 && stats.error_px <= def.tolerance_px);
        check_once(&s, &camera);
        stats.waiting = 1;
        for (int i = 0; i < 10 && stats.drawn + stats.waiting > 0; i++) {
            assert_ok(vd_impostors_update(other, NULL, &camera, WIDTH, HEIGHT, i / 60.0, &stats));
        }
        vd_frame *frames[2];
        for (int i = 0; i < 2; i++) {
            assert_ok(vd_frame_create(s.context, WIDTH, HEIGHT, 0, &frames[i]));
        }
        assert_ok(vd_impostors_draw(s.set, NULL, &camera, frames[0], NULL));
        assert_ok(vd_impostors_draw(other, NULL, &camera, frames[1], NULL));
        assert_true(vd_frame_error(frames[0], frames[1]) == 0.0);
        for (int i = 0; i < 2; i++) {
            vd_frame_destroy(&frames[i]);
        }
        vd_impostors_destroy(&other);
        end(&s);
    }
}

/* Sets are ended, and cameras jump, while pictures are being drawn. */
static void it_may_end_at_any_time(void **state) {
    (void)state;
    const vd_impostor_def def = in_background();
    for (int updates = 0; updates < 6; updates++) {
        scene s;
        begin(&s, 100, &def);
        vd_camera camera = looking(vd_vec3_make(0, 0, 0));
        for (int i = 0; i < updates; i++) {
            camera.orientation = vd_orientation_from_angles(1.3 * i, -0.25, 0.0);
            (void)step(&s, &camera);
            if (i % 2 != 0) {
                vd_impostors_wait(s.set);
            }
        }
        end(&s);
    }
}

/* A cancelled job ends an update, as it does where updates draw. */
static void cancelling_is_heard(void **state) {
    (void)state;
    scene s;
    vd_job *job = NULL;
    const vd_impostor_def def = in_background();
    begin(&s, 100, &def);
    const vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    assert_ok(vd_job_create(s.context, &job));
    vd_job_cancel(job);
    for (int i = 0; i < 3; i++) {
        s.time_s += 1.0 / 60;
        assert_int_equal(
            vd_impostors_update(s.set, job, &camera, WIDTH, HEIGHT, s.time_s, NULL).code,
            VD_ERROR_CANCELLED);
    }
    vd_job_destroy(&job);
    assert_true(converge(&s, &camera).shown > 0);
    end(&s);
}

/* What changes while its picture is being drawn is drawn once more. */
static void changes_are_not_lost(void **state) {
    (void)state;
    scene s;
    const vd_impostor_def def = in_background();
    begin(&s, 300, &def);
    const vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    (void)step(&s, &camera);
    for (size_t n = 1; n < s.world->node_count; n++) {
        vd_impostors_change(s.set, s.world->nodes[n].id);
    }
    (void)converge(&s, &camera);
    for (uint32_t i = 0; i < s.set->slots.count; i++) {
        const vd_impostor_slot *slot = vd_impostor_slot_at(s.set, i);
        assert_false(slot->changed && slot->used == s.set->update && slot->now.rgba != NULL);
        assert_true(slot->now.rgba == NULL || slot->now.version > slot->since);
    }
    end(&s);
}

/* Walks keep every object on screen once, and the memory. */
static void walks_keep_bounds(void **state) {
    (void)state;
    scene s;
    uint64_t random = 4;
    vd_impostor_def def = in_background();
    def.memory_bytes = (size_t)1 << 20;
    def.budget_s = 1e-9; /* one between two updates */
    begin(&s, 300, &def);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    uint64_t drawn = 0;
    for (int i = 0; i < (test_is_reduced() ? 100 : 400); i++) {
        camera.eye.x += 4 * test_uniform(&random) - 2;
        camera.eye.y += 4 * test_uniform(&random) - 2;
        camera.orientation = vd_orientation_from_angles(0.05 * i, -0.25, 0.0);
        const vd_impostor_stats stats = step(&s, &camera);
        assert_true(stats.bytes <= def.memory_bytes);
        assert_true(stats.in_flight <= 17);
        drawn += stats.drawn;
        check_once(&s, &camera);
        if (i % 4 == 0) {
            vd_impostors_wait(s.set);
        }
    }
    assert_true(drawn > 10);
    end(&s);
}

/* Particles are read by both at once. */
static void particles_come_too(void **state) {
    (void)state;
    static const char path[] = VEDUTA_BINARY_DIR "/test-impostor-painter.vdp";
    const vd_vec3 middle = {0, 900, 120}, origin = {0, 0, 0};
    const vd_impostor_def def = in_background();
    scene s;
    begin_cloud(&s, path, middle, vd_vec3_make(200, 200, 80), &def);
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(s.context, WIDTH, HEIGHT, 0, &frame));
    vd_camera camera = looking(origin);
    camera.orientation = vd_orientation_look_at(camera.eye, middle);
    for (int i = 0; i < 10; i++) {
        (void)step(&s, &camera);
        check_once(&s, &camera);
        assert_ok(vd_impostors_draw(s.set, NULL, &camera, frame, NULL));
    }
    assert_true(converge(&s, &camera).shown > 0);
    vd_frame_destroy(&frame);
    end(&s);
    (void)unlink(path);
}

/* An allocator that has nothing for other threads than this one. */
static pthread_t this_thread;

static void *allocate_here(void *user, size_t size_bytes) {
    void *memory = NULL;
    (void)user;
    return pthread_equal(pthread_self(), this_thread) != 0 &&
                   posix_memalign(&memory, 64, size_bytes) == 0
               ? memory
               : NULL;
}

static void release_here(void *user, void *memory, size_t size_bytes) {
    (void)user;
    (void)size_bytes;
    free(memory);
}

/* Where the thread cannot begin, updates draw as without. */
static void without_memory_updates_draw(void **state) {
    (void)state;
    const vd_impostor_def def = in_background();
    const vd_vec3 origin = {0, 0, 0};
    vd_context_def own = vd_context_def_default();
    own.threads = 1;
    own.allocator = (vd_allocator){NULL, allocate_here, release_here};
    this_thread = pthread_self();
    scene s = {.context = NULL};
    assert_ok(vd_context_create(&own, &s.context));
    s.map = hills(s.context, origin);
    s.world = make_world(s.context, s.map, origin, 100, 3);
    assert_ok(vd_world_renderer_create(s.context, NULL, s.world, NULL, &s.renderer));
    assert_ok(vd_impostors_create(s.context, s.world, s.renderer, &def, &s.set));
    const vd_camera camera = looking(origin);
    vd_impostor_stats stats = step(&s, &camera);
    for (int i = 0; i < 2000 && s.set->painter != NULL; i++) {
        vd_impostors_wait(s.set);
        stats = step(&s, &camera);
    }
    assert_null(s.set->painter);
    assert_int_equal(stats.in_flight, 0);
    for (int i = 0; i < 3; i++) {
        stats = step(&s, &camera);
    }
    assert_true(stats.shown > 0 && stats.waiting == 0 && stats.pictures > 0);
    end(&s);
}

static void what_it_cannot_be_is_refused(void **state) {
    (void)state;
    scene s;
    begin(&s, 3, NULL);
    vd_impostors_wait(s.set); /* there is no thread to wait for */
    vd_impostor_def bad[5];
    for (int i = 0; i < 5; i++) {
        bad[i] = in_background();
    }
    bad[0].link_bytes_per_s = 1e6;
    bad[1].ship = true;
    bad[2].no_reuse = true;
    bad[3].budget_pixels = 1000;
    bad[4].background_threads = -1;
    for (int i = 0; i < 5; i++) {
        vd_impostors *set = NULL;
        const vd_status status = vd_impostors_create(s.context, s.world, s.renderer, &bad[i], &set);
        assert_int_equal(status.code, VD_ERROR_ARGUMENT);
        assert_non_null(strstr(status.message, "background"));
        assert_null(set);
    }
    end(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(they_come_and_are_the_same),
        cmocka_unit_test(it_may_end_at_any_time),
        cmocka_unit_test(cancelling_is_heard),
        cmocka_unit_test(changes_are_not_lost),
        cmocka_unit_test(walks_keep_bounds),
        cmocka_unit_test(particles_come_too),
        cmocka_unit_test(without_memory_updates_draw),
        cmocka_unit_test(what_it_cannot_be_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
