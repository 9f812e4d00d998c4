/* Impostors on long walks, at cracks, fading, and of what cannot be drawn. */
#include "impostor_scenes.h"

static double between(uint64_t *random, double low, double high) {
    return low + (high - low) * test_uniform(random);
}

/* ---- a long walk ------------------------------------------------------------------------------*/

/* A camera that changes its way and its speed now and then, over the hills and sometimes off them,
 * rests, and is somewhere else at once. */
typedef struct walker {
    vd_camera camera;
    vd_vec3 velocity;
    double heading, turn;
    uint64_t random;
} walker;

static void walk(walker *w, int number) {
    if (number % 120 == 0) {
        const double speed = number % 600 == 0 ? 0.0 : exp(between(&w->random, -3.0, 2.0));
        const double way = between(&w->random, 0.0, 6.3);
        w->velocity = vd_vec3_make(speed * cos(way), speed * sin(way), 0.1 * speed * cos(5 * way));
        w->turn = number % 240 == 0 ? 0.0 : between(&w->random, -0.03, 0.03);
    }
    vd_vec3 *eye = &w->camera.eye;
    *eye = vd_vec3_add(*eye, w->velocity);
    if (number % 5000 == 4999 || fabs(eye->x) > 900.0 || fabs(eye->y) > 900.0) {
        *eye = vd_vec3_make(between(&w->random, -600, 600), between(&w->random, -600, 600), 90.0);
    }
    eye->z = eye->z < 60.0 ? 60.0 : eye->z > 300.0 ? 300.0 : eye->z;
    w->heading += w->turn;
    w->camera.orientation = vd_orientation_from_angles(w->heading, -0.25, 0.0);
}

/* 100,000 updates: never more memory than was given, and every object on screen exactly once. */
static void a_long_walk_keeps_its_budgets(void **state) {
    (void)state;
    const int updates = test_is_reduced() ? 1500 : 100000;
    vd_impostor_def def = patient();
    def.memory_bytes = (size_t)1 << 20;
    def.budget_s = 1e9;
    def.budget_pixels = 1; /* a picture an update: much is always missing */
    def.samples = 1;
    def.settle = false;
    scene s;
    begin_with(&s, 1, 50, &def);
    walker w = {.camera = looking(vd_vec3_make(0, 0, 0)), .random = 77};
    w.camera.lens.fx *= 2; /* larger pictures: they do not all fit */
    w.camera.lens.fy *= 2;
    uint64_t drawn = 0, shown = 0;
    for (int i = 0; i < updates; i++) {
        walk(&w, i);
        const vd_impostor_stats stats = step(&s, &w.camera);
        drawn += stats.drawn;
        shown += stats.shown;
        assert_true(stats.bytes <= def.memory_bytes && stats.drawn <= 1 && stats.failed == 0);
        if (i % 100 == 0 || i > updates - 200) {
            check_once(&s, &w.camera);
        }
    }
    size_t bytes = 0, pictures = 0;
    for (uint32_t i = 0; i < s.set->slots.count; i++) {
        const vd_impostor_picture *p = &vd_impostor_slot_at(s.set, i)->now;
        pictures += p->rgba != NULL;
        bytes += p->rgba != NULL ? (size_t)p->width * (size_t)p->height * 4 : 0;
    }
    assert_int_equal(bytes, s.set->bytes); /* the counts are kept */
    assert_int_equal(pictures, s.set->stats.pictures);
    assert_true(s.set->stats.dropped > 10 && shown > drawn);
    print_message("%d updates: %llu pictures drawn, %llu shown, %llu dropped\n", updates,
                  (unsigned long long)drawn, (unsigned long long)shown,
                  (unsigned long long)s.set->stats.dropped);
    end(&s);
}

/* ---- cracks -----------------------------------------------------------------------------------*/

/* Ground alone, before nothing: where no ground is alpha is 0. */
static void begin_ground(scene *s, const vd_impostor_def *def) {
    const vd_vec3 middle = {0, 0, 0};
    s->context = test_context(2, VD_ISA_AUTO);
    s->map = hills(s->context, middle);
    s->time_s = 0.0;
    vd_world_def world = vd_world_def_default();
    world.terrain.heightfield = s->map;
    world.terrain.sky = false;
    world.terrain.light.haze_m = 0.0;
    assert_ok(vd_world_create(s->context, &world, &s->world));
    assert_ok(vd_world_arrange(s->world, NULL));
    assert_ok(vd_world_renderer_create(s->context, NULL, s->world, NULL, &s->renderer));
    assert_ok(vd_impostors_create(s->context, s->world, s->renderer, def, &s->set));
}

static int alpha_at(const vd_frame *frame, int x, int y) {
    return frame->rgba[4 * ((size_t)y * frame->stride + (size_t)x) + 3];
}

/* Whether all pixels within `radius` of one are ground, and the picture's edge is not near. */
static bool is_inside(const vd_frame *frame, int x, int y, int radius) {
    for (int v = y - radius; v <= y + radius; v++) {
        for (int u = x - radius; u <= x + radius; u++) {
            if (u < 0 || v < 0 || u >= frame->width || v >= frame->height ||
                alpha_at(frame, u, v) != 255) {
                return false;
            }
        }
    }
    return true;
}

/* Of pixels inside ground how many are how opaque by impostors. */
static void count_opacity(const vd_frame *direct, const vd_frame *frame, uint64_t counts[256]) {
    for (int y = 0; y < HEIGHT; y++) {
        for (int x = 0; x < WIDTH; x++) {
            if (is_inside(direct, x, y, 1)) {
                counts[alpha_at(frame, x, y)]++;
            }
        }
    }
}

/* Somewhere else at once every 20 pictures, and from there straight on. */
static void fly(int number, uint64_t *random, vd_camera *camera, vd_vec3 *motion) {
    if (number % 20 == 0) {
        camera->eye = vd_vec3_make(between(random, -600, 600), between(random, -600, 600),
                                   between(random, 60, 250));
        *motion = vd_vec3_make(between(random, -2, 2), between(random, -2, 2),
                               between(random, -0.3, 0.3));
        const double heading = between(random, 0, 6.3), pitch = between(random, -0.6, 0.1);
        camera->orientation = vd_orientation_from_angles(heading, pitch, 0.0);
    }
    camera->eye = vd_vec3_add(camera->eye, *motion);
}

/* No sky shows between neighbouring patches, however wrong each may be, also in the first picture
 * after the camera was put somewhere else. */
static void no_sky_shows_between_patches(void **state) {
    (void)state;
    static const double tolerances[] = {0.5, 1.0, 2.0};
    const int moves = test_is_reduced() ? 40 : 500;
    for (int t = 0; t < 3; t++) {
        vd_impostor_def def = patient();
        def.tolerance_px = tolerances[t];
        def.settle = false;
        def.most_px = 64.0; /* many edges */
        scene s;
        begin_ground(&s, &def);
        vd_frame *frame = NULL, *direct = NULL;
        assert_ok(vd_frame_create(s.context, WIDTH, HEIGHT, 0, &frame));
        assert_ok(vd_frame_create(s.context, WIDTH, HEIGHT, 0, &direct));
        uint64_t random = 5, shown = 0, drawn = 0, counts[256] = {0}, all = 0, thin = 0, sky = 0;
        vd_camera camera = looking(vd_vec3_make(0, 0, 0));
        vd_vec3 motion = {0, 0, 0};
        for (int i = 0; i < moves; i++) {
            fly(i, &random, &camera, &motion);
            const vd_impostor_stats stats = step(&s, &camera);
            shown += stats.shown;
            drawn += stats.drawn;
            assert_ok(vd_impostors_draw(s.set, NULL, &camera, frame, NULL));
            assert_ok(vd_world_renderer_draw(s.renderer, NULL, &camera, direct, NULL));
            count_opacity(direct, frame, counts);
        }
        for (int alpha = 0; alpha < 256; alpha++) {
            all += counts[alpha];
            thin += alpha < 230 ? counts[alpha] : 0;
            sky += alpha < 128 ? counts[alpha] : 0;
        }
        /* Behind a ridge that is seen along its slope the soft edge of what is nearer may lie over
         * that of what is farther. All else is closed: of a crack there would be thousands. */
        if (sky * 25000 > all || thin * 5000 > all || all < (uint64_t)moves * 1000) {
            fail_msg("tolerance %g: of %llu pixels inside ground %llu show sky, %llu more of it",
                     tolerances[t], (unsigned long long)all, (unsigned long long)thin,
                     (unsigned long long)sky);
        }
        assert_true(shown > 2 * drawn && shown > (uint64_t)moves);
        vd_frame_destroy(&frame);
        vd_frame_destroy(&direct);
        end(&s);
    }
}

/* Decides once more what is shown, with or without the horizon, and draws it. Returns how many
 * pictures that are. */
static size_t draw_decided(scene *s, const vd_camera *camera, bool horizon, vd_frame *frame) {
    vd_impostor_view view = vd_impostors_view(s->set, camera, WIDTH, HEIGHT);
    if (horizon) {
        assert_ok(vd_world_aim_horizon(s->renderer, NULL, camera, WIDTH, HEIGHT, &view.horizon));
        assert_non_null(view.horizon);
    }
    assert_ok(vd_impostors_decide(s->set, &view));
    assert_ok(vd_impostors_draw(s->set, NULL, camera, frame, NULL));
    return s->set->far.count + s->set->shown.count;
}

/* What stands behind the horizon, and is not shown, is not missed, low over the hills. */
static void what_the_horizon_hides_is_not_seen(void **state) {
    (void)state;
    static const double tolerances[] = {0.5, 1.0, 2.0};
    const int moves = test_is_reduced() ? 40 : 400;
    for (int t = 0; t < 3; t++) {
        vd_impostor_def def = patient();
        def.tolerance_px = tolerances[t];
        def.settle = false;
        def.budget_pixels = (size_t)1 << 30; /* the front is as fine as the screen */
        def.most_px = 32.0;
        scene s;
        begin(&s, 300, &def);
        vd_frame *all = NULL, *left = NULL;
        assert_ok(vd_frame_create(s.context, WIDTH, HEIGHT, 0, &all));
        assert_ok(vd_frame_create(s.context, WIDTH, HEIGHT, 0, &left));
        uint64_t random = 5, shown = 0, hidden = 0, differing = 0, much = 0;
        vd_camera camera = looking(vd_vec3_make(0, 0, 0));
        vd_vec3 motion = {0, 0, 0};
        for (int i = 0; i < moves; i++) {
            fly(i, &random, &camera, &motion);
            camera.eye.z = vd_world_ground(s.world, camera.eye.x, camera.eye.y) + 6.0;
            camera.orientation = vd_orientation_from_angles(0.1 * (i / 20), -0.05, 0.0);
            (void)step(&s, &camera);
            const size_t with = draw_decided(&s, &camera, false, all);
            const size_t without = draw_decided(&s, &camera, true, left);
            assert_true(without <= with);
            shown += with;
            hidden += with - without;
            for (int y = 0; y < HEIGHT; y++) {
                const uint8_t *a = all->rgba + 4 * (size_t)y * all->stride;
                const uint8_t *b = left->rgba + 4 * (size_t)y * left->stride;
                for (int x = 0; x < 4 * WIDTH; x += 4) {
                    int most = 0;
                    for (int k = 0; k < 3; k++) {
                        const int apart = abs(a[x + k] - b[x + k]);
                        most = apart > most ? apart : most;
                    }
                    differing += most > 0;
                    much += most > 16;
                }
            }
        }
        const double pixels = (double)moves * WIDTH * HEIGHT;
        print_message("tolerance %g: %llu of %llu pictures hidden; %.2g of all pixels differ, %.2g "
                      "by more than 16\n",
                      tolerances[t], (unsigned long long)hidden, (unsigned long long)shown,
                      (double)differing / pixels, (double)much / pixels);
        /* A ridge's soft edge lets a little through of what stands right behind it. */
        assert_true(hidden * 50 > shown);
        assert_true((double)differing * 2500 < pixels && (double)much * 2e5 < pixels);
        vd_frame_destroy(&all);
        vd_frame_destroy(&left);
        end(&s);
    }
}

/* With all the time that it takes even the first picture after a jump is right to the tolerance,
 * and a jump is no speed: pictures are made for where the camera is. */
static void jumps_are_no_motion(void **state) {
    (void)state;
    vd_impostor_def def = patient();
    def.settle = false;
    scene s;
    uint64_t random = 31;
    begin(&s, 200, &def);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    for (int i = 0; i < (test_is_reduced() ? 24 : 60); i++) {
        camera.eye = vd_vec3_make(between(&random, -500, 500), between(&random, -500, 500),
                                  between(&random, 80, 250));
        camera.orientation = vd_orientation_from_angles(between(&random, 0, 6.3), -0.3, 0.0);
        const vd_impostor_stats stats = step(&s, &camera);
        assert_int_equal(stats.waiting, 0);
        if (i > 0) {
            assert_true(vd_vec3_length(s.set->velocity) == 0.0);
        }
        if (!(stats.error_px <= 4.0 * def.tolerance_px)) {
            fail_msg("jump %d: %g pixels", i, stats.error_px);
        }
        check_once(&s, &camera);
        assert_int_equal(step(&s, &camera).drawn, 0);
    }
    end(&s);
}

/* ---- fading -----------------------------------------------------------------------------------*/

/* While pictures fade in over others no colour is more than its alpha. */
static void fading_keeps_premultiplied_sums(void **state) {
    (void)state;
    vd_impostor_def def = patient();
    def.fade_s = 0.3;
    def.settle = false;
    def.tolerance_px = 0.3;
    scene s;
    begin_ground(&s, &def);
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(s.context, WIDTH, HEIGHT, 0, &frame));
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    uint64_t fading = 0, partly = 0;
    for (int i = 0; i < (test_is_reduced() ? 40 : 300); i++) {
        camera.eye = vd_vec3_add(camera.eye, vd_vec3_make(0.4, 0.7, 0.02));
        camera.orientation = vd_orientation_from_angles(0.01 * i, -0.1, 0.0);
        (void)step(&s, &camera);
        for (uint32_t k = 0; k < s.set->slots.count; k++) {
            fading += vd_impostor_slot_at(s.set, k)->before.rgba != NULL;
        }
        assert_ok(vd_impostors_draw(s.set, NULL, &camera, frame, NULL));
        for (int y = 0; y < HEIGHT; y++) {
            for (int x = 0; x < WIDTH; x++) {
                const uint8_t *p = frame->rgba + 4 * ((size_t)y * frame->stride + (size_t)x);
                assert_true(p[0] <= p[3] && p[1] <= p[3] && p[2] <= p[3]);
                partly += p[3] > 0 && p[3] < 255;
            }
        }
    }
    assert_true(fading > 50 && partly > 1000);
    vd_frame_destroy(&frame);
    end(&s);
}

/* With less memory than all pictures take, and behind hills, a resting camera comes to rest: what
 * there is no room for is not made to be given up again, and nothing comes and goes. */
static void rest_comes_with_any_memory(void **state) {
    (void)state;
    enum { WIDE = 600, HIGH = 440, UPDATES = 120, RESTING = 20 };
    size_t memory = (size_t)256 << 20;
    for (int i = 0; i < (test_is_reduced() ? 2 : 8); i++) {
        scene s;
        vd_impostor_def def = patient();
        def.settle = false;
        def.most_px = 28.0;
        def.least_reuse = 0.1;
        def.memory_bytes = memory;
        begin(&s, 3000, &def);
        vd_camera camera = looking(vd_vec3_make(0, 0, 0));
        camera.lens = vd_lens_from_fov(0.9, WIDE, HIGH);
        camera.eye.z = vd_world_ground(s.world, camera.eye.x, camera.eye.y) + 6.0;
        camera.orientation = vd_orientation_from_angles(0.0, -0.05, 0.0);
        vd_impostor_stats stats = {0};
        uint64_t shown = 0;
        for (int k = 0; k < UPDATES; k++) {
            s.time_s += 1.0 / 60;
            assert_ok(vd_impostors_update(s.set, NULL, &camera, WIDE, HIGH, s.time_s, &stats));
            assert_true(stats.bytes <= memory);
            if (k >= UPDATES - RESTING) {
                assert_int_equal(stats.drawn, 0);
                assert_int_equal(stats.waiting, 0);
                assert_true(shown == 0 || stats.shown == shown);
                shown = stats.shown;
            }
        }
        assert_true(i > 0 || (shown > 200 && s.set->by_horizon && s.set->hidden > 0));
        memory = i == 0 ? stats.bytes : (size_t)(0.93 * (double)memory);
        memory = memory < ((size_t)1 << 20) ? (size_t)1 << 20 : memory;
        end(&s);
    }
}

/* ---- what cannot be drawn ---------------------------------------------------------------------*/

/* A cloud of which some bricks are damaged, and whole things beside it. */
static void begin_damaged(scene *s, const char *path, const vd_impostor_def *def) {
    const vd_vec3 middle = {0, 0, 80}, origin = {0, 0, 0};
    const vd_particle_look look = cloud_look();
    s->context = test_context(2, VD_ISA_AUTO);
    s->map = hills(s->context, origin);
    s->world = make_world(s->context, s->map, origin, 20, 3);
    s->time_s = 0.0;
    vd_bricks *bricks =
        open_cloud(s->context, path, 20000, middle, vd_vec3_make(200, 200, 60), 200);
    vd_bricks_close(&bricks);
    FILE *file = fopen(path, "r+b");
    assert_non_null(file);
    for (long at = 20000; at < 60000; at += 64) {
        assert_int_equal(fseek(file, at, SEEK_SET), 0);
        (void)fputc(0x5A, file);
    }
    assert_int_equal(fclose(file), 0);
    assert_ok(vd_bricks_open(s->context, path, &bricks));
    assert_true(add_cloud(s->world, bricks, &look, 1000) > 10);
    assert_ok(vd_world_arrange(s->world, NULL));
    assert_ok(vd_world_renderer_create(s->context, NULL, s->world, NULL, &s->renderer));
    assert_ok(vd_impostors_create(s->context, s->world, s->renderer, def, &s->set));
}

/* It is skipped, counted, and tried again after longer and longer times; all else is shown. */
static void what_fails_is_skipped(void **state) {
    (void)state;
    static const char path[] = VEDUTA_BINARY_DIR "/test-impostor-walk.vdp";
    const vd_impostor_def def = patient();
    scene s;
    begin_damaged(&s, path, &def);
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(s.context, WIDTH, HEIGHT, 0, &frame));
    const vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    assert_int_equal(vd_world_renderer_draw(s.renderer, NULL, &camera, frame, NULL).code,
                     VD_ERROR_FORMAT);
    vd_impostor_stats stats = step(&s, &camera);
    const uint64_t once = stats.failed;
    assert_true(once > 0 && stats.shown > 3);
    for (int i = 0; i < 60 * 8; i++) {
        (void)step(&s, &camera);
        if (!test_is_reduced() || i % 8 == 7) {
            assert_ok(vd_impostors_draw(s.set, NULL, &camera, frame, &stats));
        }
    }
    assert_false(vd_impostors_settled(s.set)); /* that would be a picture without it */
    uint64_t tries = 0, failing = 0;
    for (uint32_t i = 0; i < s.set->slots.count; i++) {
        const uint32_t failures = vd_impostor_slot_at(s.set, i)->failures;
        assert_true(failures <= 5); /* at 0, 0.5, 1.5, 3.5 and 7.5 s */
        tries += failures;
        failing += failures > 0;
    }
    assert_true(failing > 0 && tries >= 4 * failing - 3 && tries == stats.failed);
    assert_true(stats.shown > 3 && stats.direct > 0); /* all else is there */
    vd_frame_destroy(&frame);
    end(&s);
    (void)unlink(path);
}

/* Nor is it one of an update that would reissue the whole, when the camera rests amidst it. */
static void what_fails_nearby_is_no_failure_of_an_update(void **state) {
    (void)state;
    static const char path[] = VEDUTA_BINARY_DIR "/test-impostor-walk.vdp";
    vd_impostor_def def = patient();
    def.least_reuse = 1e9; /* all is drawn itself */
    scene s;
    begin_damaged(&s, path, &def);
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(s.context, WIDTH, HEIGHT, 0, &frame));
    const vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    vd_impostor_stats stats = {.failed = 0};
    for (int i = 0; i < (test_is_reduced() ? 60 : 60 * 4); i++) {
        stats = step(&s, &camera);
        if (i > 30) {
            assert_ok(vd_impostors_draw(s.set, NULL, &camera, frame, &stats));
        }
    }
    assert_true(stats.failed > 0);
    assert_false(vd_impostors_settled(s.set));
    vd_frame_destroy(&frame);
    end(&s);
    (void)unlink(path);
}

/* Bounds that are empty or infinite are refused where they are made; those of no volume are not,
 * and such a thing is shown as any other. */
static void bounds_may_be_flat_but_finite(void **state) {
    (void)state;
    const vd_vec3 zero = {0, 0, 0};
    const vd_impostor_def def = patient();
    scene s = {.context = test_context(2, VD_ISA_AUTO)};
    static const double flat[4][3] = {{-5, 0, 0}, {5, 0, 0}, {5, 0, 9}, {-5, 0, 9}};
    static const uint32_t triangles[2][3] = {{0, 1, 2}, {0, 2, 3}};
    const vd_model_source source = {.name = "flat",
                                    .format = "test",
                                    .vertex_count = 4,
                                    .positions = flat,
                                    .triangle_count = 2,
                                    .triangles = triangles};
    vd_model *model = NULL;
    vd_object *object = NULL;
    vd_instance_def instance = {0};
    assert_ok(vd_world_create(s.context, NULL, &s.world));
    assert_ok(vd_model_create(s.context, &source, &model));
    vd_model_bounds(model, &instance.min, &instance.max);
    assert_true(instance.min.y == instance.max.y);
    assert_ok(vd_world_add_model(s.world, &model, &instance.model));
    const vd_vec3 least = instance.min, most = instance.max;
    const double bad[] = {(double)INFINITY, (double)-INFINITY, (double)NAN};
    instance.transform = vd_matrix_translation(zero);
    for (int i = 0; i < 3; i++) {
        instance.max.x = bad[i];
        assert_int_equal(vd_instance_create(s.context, &instance, &object).code, VD_ERROR_ARGUMENT);
        instance.max = most;
        instance.min.z = -bad[i];
        assert_int_equal(vd_instance_create(s.context, &instance, &object).code, VD_ERROR_ARGUMENT);
        instance.min = least;
    }
    for (int i = 0; i < 12; i++) { /* the last ones are a point */
        instance.max = i < 8 ? most : least;
        const double turn = 0.3 * i;
        const vd_matrix moved = vd_matrix_translation(vd_vec3_make(30.0 * i - 200, 10.0 * i, 0));
        const vd_matrix turned =
            vd_matrix_rotation(vd_quat_from_axis_angle(vd_vec3_make(0, 0, 1), turn));
        instance.transform = vd_matrix_multiply(&moved, &turned);
        assert_ok(vd_instance_create(s.context, &instance, &object));
        assert_ok(vd_world_add(s.world, &object));
    }
    assert_ok(vd_world_arrange(s.world, NULL));
    assert_ok(vd_world_renderer_create(s.context, NULL, s.world, NULL, &s.renderer));
    assert_ok(vd_impostors_create(s.context, s.world, s.renderer, &def, &s.set));
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(s.context, WIDTH, HEIGHT, 0, &frame));
    vd_camera camera = looking(zero);
    vd_impostor_stats stats = {.shown = 0};
    for (int i = 0; i < (test_is_reduced() ? 24 : 60); i++) {
        camera.eye.x += 3.0;
        stats = step(&s, &camera);
        assert_ok(vd_impostors_draw(s.set, NULL, &camera, frame, NULL));
        assert_true(isfinite(stats.error_px) && stats.failed == 0);
        check_once(&s, &camera);
    }
    assert_true(stats.shown + stats.direct > 3);
    vd_frame_destroy(&frame);
    end(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_long_walk_keeps_its_budgets),
        cmocka_unit_test(no_sky_shows_between_patches),
        cmocka_unit_test(what_the_horizon_hides_is_not_seen),
        cmocka_unit_test(jumps_are_no_motion),
        cmocka_unit_test(fading_keeps_premultiplied_sums),
        cmocka_unit_test(rest_comes_with_any_memory),
        cmocka_unit_test(what_fails_is_skipped),
        cmocka_unit_test(what_fails_nearby_is_no_failure_of_an_update),
        cmocka_unit_test(bounds_may_be_flat_but_finite),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
