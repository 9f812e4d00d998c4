/* What a client that has pictures and nothing else is sent: what it shows of them. */
#include "item_client.h"

static void begin(const vd_impostor_def *def, int balls) {
    begin_with(def, balls, NULL);
}

static void a_client_shows_what_there_is(void **state) {
    (void)state;
    const vd_impostor_def def = shipping();
    begin(&def, 300);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    uint64_t random = 5;
    vd_vec3 motion = {1, 0.5, 0};
    double sum = 0.0, worst = 0.0;
    const int turns = test_is_reduced() ? 40 : 120;
    for (int i = 0; i < turns; i++) {
        if (i % 20 == 0) {
            motion = vd_vec3_make(2 * test_uniform(&random) - 1, 2 * test_uniform(&random) - 1,
                                  0.3 * test_uniform(&random));
        }
        camera.eye = vd_vec3_add(camera.eye, motion);
        camera.orientation = vd_orientation_from_angles(0.1 + 0.004 * i, -0.25, 0.0);
        const double missing = serve(&camera, 1000);
        assert_true(missing >= 0.0 && missing <= 1.0);
        if (missing < 0.01) {
            const double error = show_error(&camera);
            sum += error;
            worst = error > worst ? error : worst;
        }
    }
    print_message("error %.4f on average, %.4f at worst, %d pictures, %zu bytes\n", sum / turns,
                  worst, s.client.count, s.client.bytes);
    /* A second filter at 150 × 110 pixels is most of it: vd_impostors_draw has 0.11. */
    assert_true(sum / turns < 0.2 && worst < 0.3);
    end();
}

/* A slow link: one picture a turn. What is shown is always there, and in the end all is. */
static void a_slow_client_is_never_wrong(void **state) {
    (void)state;
    const vd_impostor_def def = shipping();
    begin(&def, 200);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    double missing = 1.0;
    for (int i = 0; i < 400 && !vd_impostors_settled(s.set); i++) {
        if (i < 60) {
            camera.eye = vd_vec3_add(camera.eye, vd_vec3_make(0.5, 0.7, 0.0));
        }
        missing = serve(&camera, 1);
        if (i % (test_is_reduced() ? 30 : 10) == 0) {
            (void)show_error(&camera);
        }
    }
    assert_true(missing == 0.0 && vd_impostors_settled(s.set));
    assert_true(show_error(&camera) < 0.25);
    const vd_frame *still = vd_impostors_still(s.set);
    assert_non_null(still);
    assert_true(vd_frame_hash(still) == vd_frame_hash(s.perfect));
    end();
}

static void what_a_client_forgets_is_sent_again(void **state) {
    (void)state;
    const vd_impostor_def def = shipping();
    begin(&def, 100);
    const vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    for (int i = 0; i < 5; i++) {
        (void)serve(&camera, 1000);
    }
    const int before = s.client.order_count;
    while (s.client.count > 0) {
        vd_impostors_lose(s.set, s.client.items[0].id);
        forget(s.client.items[0].id);
    }
    vd_impostors_lose(s.set, 0);
    vd_impostors_lose(s.set, 12345);
    vd_impostors_lose(s.set, UINT64_MAX);
    for (int i = 0; i < 5; i++) {
        (void)serve(&camera, 1000);
    }
    assert_int_equal(s.client.order_count, before);
    (void)show_error(&camera);
    end();
}

static void memory_is_kept(void **state) {
    (void)state;
    vd_impostor_def def = shipping();
    def.memory_bytes = (size_t)1 << 20;
    begin(&def, 300);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    for (int i = 0; i < (test_is_reduced() ? 25 : 60); i++) {
        camera.orientation = vd_orientation_from_angles(0.1 * i, -0.25, 0.0);
        (void)serve(&camera, 1000);
        /* Sky and front, and what waits to be sent, are beside it. */
        assert_true(s.client.bytes < def.memory_bytes + 6 * 128 * 128 * 4 + 4 * 180 * 132 * 4);
    }
    end();
}

static void what_cannot_be_is_refused(void **state) {
    (void)state;
    vd_impostor_def def = shipping();
    begin(&def, 1);
    vd_impostors *set = NULL;
    def.link_bytes_per_s = 1e6;
    assert_int_equal(vd_impostors_create(s.context, s.world, s.renderer, &def, &set).code,
                     VD_ERROR_ARGUMENT);
    def = shipping();
    def.spare = 1.5;
    assert_int_equal(vd_impostors_create(s.context, s.world, s.renderer, &def, &set).code,
                     VD_ERROR_ARGUMENT);
    def = shipping();
    def.like = s.set;
    assert_ok(vd_impostors_create(s.context, s.world, s.renderer, &def, &set));
    assert_ptr_equal(set->ground.patches, s.set->ground.patches);
    vd_impostors_destroy(&set);
    vd_world_renderer *other = NULL;
    assert_ok(vd_world_renderer_create(s.context, NULL, s.world, NULL, &other));
    assert_int_equal(vd_impostors_create(s.context, s.world, other, &def, &set).code,
                     VD_ERROR_ARGUMENT);
    vd_world_renderer_destroy(&other);
    def = shipping();
    def.spare = -1.0;
    assert_int_equal(vd_impostors_create(s.context, s.world, s.renderer, &def, &set).code,
                     VD_ERROR_ARGUMENT);
    end();
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_client_shows_what_there_is),
                                       cmocka_unit_test(a_slow_client_is_never_wrong),
                                       cmocka_unit_test(what_a_client_forgets_is_sent_again),
                                       cmocka_unit_test(memory_is_kept),
                                       cmocka_unit_test(what_cannot_be_is_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
