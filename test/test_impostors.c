/* Which impostors are shown and drawn, without looking at their pixels. */
#include "impostor_scenes.h"

static void everything_is_shown_once(void **state) {
    (void)state;
    vd_impostor_def def = patient();
    for (int budget = 0; budget < 2; budget++) {
        scene s;
        uint64_t random = 9;
        def.budget_s = budget == 0 ? 1e-9 : 100.0; /* a picture an update; all */
        begin(&s, 300, &def);
        vd_camera camera = looking(vd_vec3_make(0, 0, 0));
        vd_vec3 motion = {2, 1, 0};
        uint64_t shown = 0, direct = 0, reused = 0, uploads = 0;
        for (int i = 0; i < (test_is_reduced() ? 50 : 150); i++) {
            if (i % 15 == 0) {
                motion.x = 8 * test_uniform(&random) - 4;
                motion.y = 8 * test_uniform(&random) - 4;
                motion.z = test_uniform(&random) - 0.5;
            }
            camera.eye = vd_vec3_add(camera.eye, motion);
            camera.orientation = vd_orientation_from_angles(0.1 + 0.01 * i, -0.25, 0.0);
            const vd_impostor_stats stats = step(&s, &camera);
            shown += stats.shown;
            direct += stats.direct;
            reused += stats.reused;
            /* What is not shown again has come since. */
            assert_true(stats.reused <= stats.shown &&
                        stats.shown - stats.reused <= stats.uploads - uploads);
            assert_true(i > 0 || stats.reused == 0);
            uploads = stats.uploads;
            check_once(&s, &camera);
        }
        assert_true(shown > (test_is_reduced() ? 150 : 500) &&
                    direct > (test_is_reduced() ? 15 : 50));
        assert_true(reused > shown / 4);
        end(&s);
    }
}

static void a_resting_camera_draws_nothing(void **state) {
    (void)state;
    scene s;
    const vd_impostor_def def = patient();
    begin(&s, 300, &def);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    vd_impostor_stats stats = step(&s, &camera);
    assert_true(stats.drawn > 3 && stats.waiting == 0);
    for (int i = 0; i < 5; i++) {
        stats = step(&s, &camera);
    }
    assert_int_equal(stats.drawn, 0);
    assert_true(stats.reused == stats.shown && stats.shown > 3);
    assert_true(stats.error_px <= def.tolerance_px);
    /* Turning: only what comes into the view. */
    uint64_t drawn = 0;
    for (int i = 0; i < 63; i++) {
        camera.orientation = vd_orientation_from_angles(0.1 + 0.1 * (i + 1), -0.25, 0.0);
        drawn += step(&s, &camera).drawn;
    }
    assert_true(drawn > 0);
    for (int i = 0; i < 63; i++) { /* once round again: it is all there */
        camera.orientation = vd_orientation_from_angles(0.1 + 0.1 * (i + 64), -0.25, 0.0);
        assert_int_equal(step(&s, &camera).drawn, 0);
    }
    end(&s);
}

/* With all the time that it takes, what is shown is right to the tolerance. */
static void moves_keep_to_the_tolerance(void **state) {
    (void)state;
    scene s;
    vd_impostor_def def = patient();
    def.tolerance_px = 0.7;
    begin(&s, 300, &def);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    uint64_t drawn = 0, shown = 0;
    for (int i = 0; i < (test_is_reduced() ? 40 : 120); i++) {
        camera.eye.x += 0.3;
        camera.eye.y += 0.2;
        const vd_impostor_stats stats = step(&s, &camera);
        drawn += stats.drawn;
        shown += stats.shown;
        const vd_impostor_view view = {.eye = camera.eye,
                                       .seen = camera.eye,
                                       .camera = camera,
                                       .width = WIDTH,
                                       .height = HEIGHT,
                                       .focal_px = camera.lens.fx};
        const uint32_t *list = s.set->shown.data;
        for (size_t k = 0; k < s.set->shown.count; k++) {
            const double error =
                vd_impostor_error(s.set, &view, vd_impostor_slot_at(s.set, list[k]));
            assert_true(error <= def.tolerance_px);
        }
    }
    assert_true(shown > 5 * drawn); /* reuse */
    end(&s);
}

static void memory_is_kept(void **state) {
    (void)state;
    scene s;
    vd_impostor_def def = patient();
    def.memory_bytes = (size_t)1 << 20;
    def.samples = 1;
    def.most_px = 1500.0;
    def.least_reuse = 0.0;
    begin(&s, 300, &def);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    camera.lens.fx *= 6; /* large pictures */
    camera.lens.fy *= 6;
    for (int i = 0; i < 40; i++) {
        camera.orientation = vd_orientation_from_angles(0.4 * i, -0.25, 0.0);
        const vd_impostor_stats stats = step(&s, &camera);
        assert_true(stats.bytes <= def.memory_bytes);
    }
    assert_true(s.set->stats.dropped > 0);
    end(&s);
}

static void bad_input_is_refused(void **state) {
    (void)state;
    scene s;
    begin(&s, 3, NULL);
    const vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    vd_impostor_def bad[6];
    for (int i = 0; i < 6; i++) {
        bad[i] = vd_impostor_def_default();
    }
    bad[0].budget_s = 0;
    bad[1].tolerance_px = NAN;
    bad[2].memory_bytes = 5;
    bad[3].samples = 3;
    bad[4].link_bytes_per_s = -1;
    bad[5].link_latency_s = INFINITY;
    for (int i = 0; i < 6; i++) {
        vd_impostors *set = NULL;
        assert_int_equal(vd_impostors_create(s.context, s.world, s.renderer, &bad[i], &set).code,
                         VD_ERROR_ARGUMENT);
        assert_null(set);
    }
    (void)step(&s, &camera);
    assert_int_equal(vd_impostors_update(s.set, NULL, &camera, WIDTH, HEIGHT, -1, NULL).code,
                     VD_ERROR_ARGUMENT);
    vd_camera parallel = camera;
    parallel.projection = VD_PROJECTION_ORTHOGRAPHIC;
    parallel.far_m = 100;
    assert_int_equal(vd_impostors_update(s.set, NULL, &parallel, WIDTH, HEIGHT, 9, NULL).code,
                     VD_ERROR_ARGUMENT);
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(s.context, WIDTH, HEIGHT, 0, &frame));
    assert_int_equal(vd_impostors_draw(s.set, NULL, &parallel, frame, NULL).code,
                     VD_ERROR_ARGUMENT);
    vd_frame_destroy(&frame);
    static const int sizes[4][2] = {{0, 5}, {5, 0}, {-1, 5}, {VD_MAX_SIDE + 1, 5}};
    for (int i = 0; i < 4; i++) {
        assert_int_equal(
            vd_impostors_update(s.set, NULL, &camera, sizes[i][0], sizes[i][1], 9, NULL).code,
            VD_ERROR_ARGUMENT);
    }
    end(&s);
}

/* What is kept as it is, or lies under an overlay, is not what vd_world_renderer_draw draws. */
static void only_the_still_picture_is_settled(void **state) {
    (void)state;
    scene s;
    const vd_impostor_def def = patient();
    begin(&s, 50, &def);
    const vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    for (int i = 0; i < 20 && !vd_impostors_settled(s.set); i++) {
        (void)step(&s, &camera);
    }
    assert_true(vd_impostors_settled(s.set));
    assert_non_null(vd_impostors_still(s.set));
    vd_impostors_freeze(s.set, true);
    assert_false(vd_impostors_settled(s.set));
    assert_null(vd_impostors_still(s.set));
    vd_impostors_freeze(s.set, false);
    assert_ok(vd_impostors_set_show(s.set, VD_IMPOSTOR_SHOW_BOUNDS));
    assert_false(vd_impostors_settled(s.set));
    assert_ok(vd_impostors_set_show(s.set, VD_IMPOSTOR_SHOW_PICTURES));
    assert_true(vd_impostors_settled(s.set));
    end(&s);
}

/* The worst of some places of a slot, on its ground and within the bounds of what has a picture. */
static double worst_place(const scene *s, const vd_impostor_slot *slot, const vd_camera *camera,
                          uint64_t *random) {
    const vd_impostor_view view = {.camera = *camera};
    double worst = 0.0;
    vd_vec3 min, max;
    vd_impostor_bounds(s->set, &view, slot->node, &min, &max);
    for (int i = 0; i < 6; i++) {
        vd_vec3 at = {min.x + (max.x - min.x) * test_uniform(random),
                      min.y + (max.y - min.y) * test_uniform(random),
                      min.z + (max.z - min.z) * test_uniform(random)};
        if (vd_impostor_is_patch(s->set, slot->node)) {
            at.z = vd_world_ground(s->world, at.x, at.y);
        }
        if (!(at.z >= min.z && at.z <= max.z)) {
            continue; /* beside the map */
        }
        const double error = vd_impostor_plane_error(&slot->now.plane, &at, 1, camera->eye,
                                                     fmax(camera->lens.fx, camera->lens.fy));
        worst = error > worst ? error : worst;
    }
    return worst;
}

/* With all the time that it takes no place of what has a picture is shown wrong by more than the
 * tolerance and a quarter of a pixel, however the camera moves. */
static void all_that_is_shown_is_right(void **state) {
    (void)state;
    static const double tolerances[] = {0.5, 1.0, 2.0};
    uint64_t random = 11, places = 0;
    for (int t = 0; t < 3; t++) {
        scene s;
        vd_impostor_def def = patient();
        def.tolerance_px = tolerances[t];
        def.settle = false;
        begin(&s, test_is_reduced() ? 100 : 300, &def);
        vd_camera camera = looking(vd_vec3_make(0, 0, 0));
        vd_vec3 motion = {0, 0, 0};
        double heading = 0.1, turn = 0.0;
        for (int i = 0; i < (test_is_reduced() ? 30 : 400); i++) {
            if (i % 9 == 0) {
                motion.x = 4 * test_uniform(&random) - 2;
                motion.y = 4 * test_uniform(&random) - 2;
                motion.z = test_uniform(&random) - 0.5;
                turn = 0.04 * test_uniform(&random) - 0.02;
            }
            heading += turn;
            camera.eye = vd_vec3_add(camera.eye, motion);
            camera.eye.z = camera.eye.z < 60 ? 60 : camera.eye.z;
            camera.orientation = vd_orientation_from_angles(heading, -0.25, 0.0);
            (void)step(&s, &camera);
            const vd_list *lists[2] = {&s.set->shown, &s.set->far};
            for (int k = 0; k < 2; k++) {
                const uint32_t *slots = lists[k]->data;
                for (size_t j = 0; j < lists[k]->count; j++) {
                    const vd_impostor_slot *slot = vd_impostor_slot_at(s.set, slots[j]);
                    if (slot->now.rgba == NULL) {
                        continue;
                    }
                    const double worst = worst_place(&s, slot, &camera, &random);
                    places++;
                    if (!(worst <= def.tolerance_px + 0.25)) {
                        fail_msg("%g pixels at tolerance %g, step %d, node %u", worst,
                                 def.tolerance_px, i, slot->node);
                    }
                }
            }
        }
        end(&s);
    }
    assert_true(places > (test_is_reduced() ? 500u : 5000u));
}

/* ---- changes, planes and turns ----------------------------------------------------------------*/

/* A world of a box and nothing else, turned by an angle; `planed`: its pictures lie in the plane of
 * its y. */
static void begin_box(scene *s, vd_vec3 sides, double angle, bool planed,
                      const vd_impostor_def *def) {
    *s = (scene){.context = test_context(2, VD_ISA_AUTO)};
    assert_ok(vd_world_create(s->context, NULL, &s->world));
    vd_model *model = ball(s->context);
    const vd_matrix turn =
        vd_matrix_rotation(vd_quat_from_axis_angle(vd_vec3_make(0, 0, 1), angle));
    vd_instance_def box = {.plane = vd_vec3_make(0, 0, 0)};
    vd_model_bounds(model, &box.min, &box.max);
    const vd_vec3 size = vd_vec3_subtract(box.max, box.min);
    const vd_matrix flat =
        vd_matrix_scaling(vd_vec3_make(sides.x / size.x, sides.y / size.y, sides.z / size.z));
    box.transform = vd_matrix_multiply(&turn, &flat);
    const vd_vec3 middle =
        vd_matrix_transform(&box.transform, vd_vec3_scale(vd_vec3_add(box.min, box.max), 0.5));
    box.transform.m[0][3] -= middle.x;
    box.transform.m[1][3] -= middle.y;
    box.transform.m[2][3] -= middle.z;
    if (planed) {
        box.plane = vd_matrix_transform(&turn, vd_vec3_make(0, 7, 0));
    }
    assert_ok(vd_world_add_model(s->world, &model, &box.model));
    vd_object *object = NULL;
    assert_ok(vd_instance_create(s->context, &box, &object));
    assert_ok(vd_world_add(s->world, &object));
    assert_ok(vd_world_arrange(s->world, NULL));
    assert_ok(vd_world_renderer_create(s->context, NULL, s->world, NULL, &s->renderer));
    assert_ok(vd_impostors_create(s->context, s->world, s->renderer, def, &s->set));
}

/* A wall, 10 m × 3 m, that stands askew. */
static void begin_wall(scene *s, bool planed, const vd_impostor_def *def) {
    begin_box(s, vd_vec3_make(10, 0.2, 3), 0.785, planed, def);
}

static void end_wall(scene *s) {
    vd_impostors_destroy(&s->set);
    vd_world_renderer_destroy(&s->renderer);
    vd_world_destroy(&s->world);
    vd_context_destroy(&s->context);
}

/* The measured, area-averaged reuse follows R = z (z − d) Δs H / (k d V) over distance and depth
 * (eq. 2.4, figure 2.5), here of a block that the camera goes past at right angles. */
static void reuse_follows_the_formula(void **state) {
    (void)state;
    enum { WIDE = 800, HIGH = 600, LIVES = 6 };
    static const double distances[] = {100, 200, 400}, depths[] = {0.5, 1, 2, 4};
    const double speed = 40.0; /* metres a second: lives of frames, not of minutes */
    vd_impostor_def def = patient();
    def.settle = false;
    def.most_px = 1e4;
    int cases = 0;
    for (int i = 0; i < 12; i++) {
        scene s;
        vd_frame *frame = NULL;
        const double z = distances[i % 3], d = depths[i / 3];
        vd_camera camera = looking(vd_vec3_make(0, 0, 0));
        camera.lens = vd_lens_from_fov(0.9, WIDE, HIGH);
        const double focal = fmax(camera.lens.fx, camera.lens.fy);
        const double formula = z * (z - d) * def.tolerance_px * def.rate_hz / (focal * d * speed);
        if (formula < 2.0 * def.least_reuse || formula > (test_is_reduced() ? 30 : 200)) {
            continue;
        }
        begin_box(&s, vd_vec3_make(2 * d, 2 * d, 2 * d), 0.0, false, &def);
        assert_ok(vd_frame_create(s.context, WIDE, HIGH, 0, &frame));
        vd_impostor_stats first = {0}, last = {0};
        for (int f = 0; f < LIVES * (int)formula; f++) { /* around it: always at right angles */
            const double angle = speed / def.rate_hz * f / z;
            camera.eye = vd_vec3_make(z * sin(angle), -z * cos(angle), 0);
            camera.orientation = vd_orientation_from_angles(-angle, 0.0, 0.0);
            assert_ok(vd_impostors_update(s.set, NULL, &camera, WIDE, HIGH, f / def.rate_hz, NULL));
            assert_ok(vd_impostors_draw(s.set, NULL, &camera, frame, &last));
            first = f == 10 ? last : first;
        }
        const double drawn = (double)(last.pixels_drawn - first.pixels_drawn);
        const double reuse = (double)(last.pixels_shown - first.pixels_shown) / drawn;
        if (!(reuse > 0.7 * formula && reuse < 1.3 * formula)) {
            fail_msg("z %g m, d %g m: reuse %.1f, formula %.1f", z, d, reuse, formula);
        }
        print_message("| %g | %g | %.1f | %.1f |\n", z, d, formula, reuse);
        cases++;
        vd_frame_destroy(&frame);
        end_wall(&s);
    }
    assert_true(cases >= (test_is_reduced() ? 3 : 6));
}

/* What is told to have changed is made anew at once, once; what changes all the time is drawn
 * itself. */
static void what_changes_is_made_anew(void **state) {
    (void)state;
    scene s;
    vd_impostor_def def = patient();
    def.settle = false;
    begin(&s, 300, &def);
    const vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    for (int i = 0; i < 4; i++) {
        (void)step(&s, &camera);
    }
    assert_int_equal(step(&s, &camera).drawn, 0);
    /* On a patch: its pictures, of which one is shown. */
    const uint32_t *far = s.set->far.data;
    uint64_t id = 0;
    for (size_t i = 0; i < s.set->far.count && id == 0; i++) {
        const vd_cells cells = vd_ground_cells(
            &s.set->ground, vd_impostor_patch(s.set, vd_impostor_slot_at(s.set, far[i])->node));
        for (size_t n = 1; n < s.world->node_count && id == 0; n++) {
            const vd_node *node = &s.world->nodes[n];
            const vd_cells at =
                vd_world_node_cells(s.set->ground.sample_from_world, &s.set->ground.map, node);
            id = node->count == 0 && node->grounded && vd_cells_hold(&cells, &at) ? node->id : 0;
        }
    }
    assert_true(id != 0);
    vd_impostors_change(s.set, id);
    vd_impostors_change(s.set, ~(uint64_t)0); /* there is none */
    const uint64_t drawn = step(&s, &camera).drawn;
    assert_in_range(drawn, 1, 3);
    assert_int_equal(step(&s, &camera).drawn, 0);
    end(&s);
    /* On none: drawn itself while it changes, and a picture again after a while. */
    scene w;
    begin_wall(&w, false, &def);
    vd_camera across = looking(vd_vec3_make(0, 0, 0));
    across.eye = vd_vec3_make(0, -50, 2);
    across.orientation = vd_orientation_from_angles(0.0, 0.0, 0.0);
    assert_int_equal(step(&w, &across).shown, 1);
    const uint64_t wall = w.world->nodes[w.world->nodes[0].first].id;
    for (int i = 0; i < 5; i++) {
        vd_impostors_change(w.set, wall);
        const vd_impostor_stats stats = step(&w, &across);
        assert_int_equal(stats.direct, i > 0);
        assert_int_equal(stats.drawn, i == 0);
    }
    vd_impostor_stats stats = {0};
    for (int i = 0; i < 12; i++) {
        stats = step(&w, &across);
    }
    assert_true(stats.direct == 0 && stats.shown == 1);
    end_wall(&w);
}

static void a_walls_picture_lies_in_its_plane(void **state) {
    (void)state;
    vd_impostor_def def = patient();
    def.settle = false;
    uint64_t drawn[2] = {0, 0};
    for (int planed = 0; planed < 2; planed++) {
        scene s;
        begin_wall(&s, planed == 1, &def);
        vd_camera camera = looking(vd_vec3_make(0, 0, 0));
        camera.orientation = vd_orientation_from_angles(0.0, 0.0, 0.0);
        for (int i = 0; i < 120; i++) { /* past it, at 6 m a second */
            camera.eye = vd_vec3_make(-6 + 0.1 * i, -50, 2);
            const vd_impostor_stats stats = step(&s, &camera);
            assert_true(stats.error_px <= def.tolerance_px + 0.25);
            drawn[planed] += stats.drawn;
        }
        const vd_impostor_slot *slot = vd_impostor_slot_at(s.set, 0);
        const double along =
            fabs(vd_vec3_dot(slot->now.plane.normal, vd_vec3_make(sin(0.785), -cos(0.785), 0)));
        assert_true((along > 1 - 1e-6) == (planed == 1));
        end_wall(&s);
    }
    if (!(2 * drawn[1] < drawn[0])) {
        fail_msg("%d pictures in its plane, %d in others", (int)drawn[1], (int)drawn[0]);
    }
}

/* What a camera that turns evenly will see comes over a slow link before it is seen. */
static void a_turn_is_foreseen(void **state) {
    (void)state;
    vd_impostor_def def = patient();
    def.link_bytes_per_s = 1e8;
    def.link_latency_s = 0.1;
    def.settle = false;
    scene s;
    begin(&s, 300, &def);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    uint64_t late = 0, seen = 0;
    for (int i = 0; i < 90; i++) { /* 45 degrees a second */
        camera.orientation = vd_orientation_from_angles(0.1 + i * 0.0131, -0.25, 0.0);
        const vd_impostor_stats stats = step(&s, &camera);
        if (i >= 30) {
            late += s.set->missing;
            seen += stats.shown;
        }
        check_once(&s, &camera);
    }
    if (late > 0 || seen < 100) {
        fail_msg("%d of %d came late", (int)late, (int)seen);
    }
    end(&s);
}

static void tolerance_zero_always_draws(void **state) {
    (void)state;
    scene s;
    vd_impostor_def def = patient();
    def.tolerance_px = 0.0;
    begin(&s, 100, &def);
    const vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    for (int i = 0; i < 4; i++) {
        const vd_impostor_stats stats = step(&s, &camera);
        assert_true(stats.drawn >= stats.shown);
    }
    end(&s);
}

/* ---- the link ---------------------------------------------------------------------------------*/

static vd_impostor_def linked(double bytes_per_s, double latency_s) {
    vd_impostor_def def = patient();
    def.link_bytes_per_s = bytes_per_s;
    def.link_latency_s = latency_s;
    return def;
}

/* Nothing comes before it can, nor more of it than the link carries; then it is all there. */
static void a_link_takes_its_time(void **state) {
    (void)state;
    static const double rates[] = {3e4, 4e5, 1e7};
    const int balls = test_is_reduced() ? 60 : 300;
    for (int i = 0; i < 6; i++) {
        scene s;
        const double rate = rates[i / 2], latency = i % 2 == 0 ? 0.0 : 0.25;
        const vd_impostor_def def = linked(rate, latency);
        begin(&s, balls, &def);
        vd_camera camera = looking(vd_vec3_make(0, 0, 0));
        vd_impostor_stats stats = step(&s, &camera);
        const double first_s = s.time_s;
        assert_true(stats.shown == 0 && stats.direct > 10 && stats.uploads == 0);
        assert_true(stats.drawn > 0 && stats.in_flight == stats.drawn);
        uint64_t last = 0;
        for (int k = 0; k < 4000 && (stats.in_flight > 0 || stats.drawn > 0); k++) {
            camera.eye.x += k < 30 ? 0.5 : 0.0;
            stats = step(&s, &camera);
            check_once(&s, &camera);
            const double passed = s.time_s - first_s - latency;
            assert_true((double)stats.bytes_sent <= (passed > 0 ? rate * passed : 0.0) + 1e-6);
            assert_true(stats.bytes_sent >= last);
            assert_true(s.set->link_free_s - s.time_s <
                        0.1 + 4.0 * 1e6 / rate); /* a picture more than the queue holds */
            last = stats.bytes_sent;
        }
        assert_true(stats.in_flight == 0 && stats.drawn == 0 && stats.waiting == 0);
        assert_true(stats.shown > 3 && stats.error_px <= def.tolerance_px);
        assert_int_equal(s.set->sending_bytes, 0);
        end(&s);
    }
}

/* With a link that takes no time what another machine draws still takes its drawing. */
static void a_remote_picture_comes_after_it_was_drawn(void **state) {
    (void)state;
    vd_impostor_def def = linked(1e15, 0.0);
    def.remote = true;
    scene s;
    begin(&s, 20, &def);
    const vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    const vd_impostor_stats stats = step(&s, &camera);
    const vd_impostor_sending *sending = s.set->sending.data;
    assert_true(stats.drawn >= 1 && s.set->sending.count == stats.drawn);
    for (size_t i = 0; i < s.set->sending.count; i++) {
        assert_true(sending[i].arrives_s > (i > 0 ? sending[i - 1].arrives_s : s.time_s) + 1e-7);
        assert_true(sending[i].arrives_s <= s.time_s + stats.draw_s);
    }
    end(&s);
}

/* Ends while pictures are on their way, and keeps its memory while they are. */
static void a_full_link_keeps_the_memory(void **state) {
    (void)state;
    scene s;
    vd_impostor_def def = linked(1e8, 30.0);
    def.memory_bytes = (size_t)1 << 20;
    def.samples = 1;
    def.most_px = 1500.0;
    def.least_reuse = 0.0;
    begin(&s, 300, &def);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    camera.lens.fx *= 3;
    camera.lens.fy *= 3;
    for (int i = 0; i < 60; i++) {
        camera.orientation = vd_orientation_from_angles(0.3 * i, -0.25, 0.0);
        const vd_impostor_stats stats = step(&s, &camera);
        assert_true(stats.bytes <= def.memory_bytes);
    }
    assert_true(s.set->sending.count > 0);
    end(&s);
}

static uint64_t hash_of_run(int threads, const vd_impostor_def *def) {
    scene s;
    begin_with(&s, threads, 200, def);
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(s.context, WIDTH, HEIGHT, VD_PLANE_DEPTH, &frame));
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    uint64_t hash = 1469598103934665603u;
    for (int i = 0; i < (test_is_reduced() ? 10 : 40); i++) {
        camera.eye.x += 1.5;
        camera.eye.z += 0.3;
        vd_impostor_stats stats = step(&s, &camera);
        assert_ok(vd_impostors_draw(s.set, NULL, &camera, frame, &stats));
        assert_true(stats.overdraw >= 0.0 && stats.overdraw < 50.0);
        assert_true(stats.overdraw == 0.0 || stats.shown > 0);
        for (int y = 0; y < HEIGHT; y++) {
            const uint8_t *row = frame->rgba + 4 * (size_t)y * frame->stride;
            for (int x = 0; x < 4 * WIDTH; x++) {
                hash = (hash ^ row[x]) * 1099511628211u;
            }
        }
        hash = (hash ^ stats.bytes_sent) * 1099511628211u;
    }
    vd_frame_destroy(&frame);
    end(&s);
    return hash;
}

/* Of a virtual clock and a budget of pixels, threads change nothing. */
static void replays_are_the_same(void **state) {
    (void)state;
    vd_impostor_def def = linked(3e6, 0.05);
    def.budget_pixels = 4000;
    def.fade_s = 0.1;
    const uint64_t once = hash_of_run(1, &def);
    assert_true(hash_of_run(2, &def) == once);
    assert_true(hash_of_run(7, &def) == once);
    def.link_bytes_per_s = 3e5;
    assert_true(hash_of_run(1, &def) != once);
}

static void without_reuse_all_is_drawn_anew(void **state) {
    (void)state;
    scene s;
    vd_impostor_def def = patient();
    def.no_reuse = true;
    begin(&s, 300, &def);
    const vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    (void)step(&s, &camera);
    for (int i = 0; i < 4; i++) {
        const vd_impostor_stats stats = step(&s, &camera);
        assert_true(stats.shown > 3 && stats.drawn >= stats.shown);
    }
    assert_int_equal(s.set->stats.uploads, s.set->stats.drawn * 5);
    end(&s);
}

static void a_budget_of_pixels_is_kept(void **state) {
    (void)state;
    scene s;
    vd_impostor_def def = patient();
    def.budget_pixels = 1;
    begin(&s, 300, &def);
    const vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    const vd_impostor_stats stats = step(&s, &camera);
    assert_true(stats.drawn == 1 && stats.waiting > 2);
    end(&s);
}

/* Particles have pictures as other things have, far ones of many objects, and look as they do when
 * they are drawn themselves. */
static void particles_have_pictures(void **state) {
    (void)state;
    static const char path[] = VEDUTA_BINARY_DIR "/test-impostors.vdp";
    const vd_vec3 middle = {0, 900, 120}, origin = {0, 0, 0};
    vd_impostor_def def = patient();
    def.settle = false;
    def.direct_samples = 4;
    scene s;
    begin_cloud(&s, path, middle, vd_vec3_make(200, 200, 80), &def);
    vd_camera camera = looking(origin);
    camera.orientation = vd_orientation_look_at(camera.eye, middle);
    for (int i = 0; i < 5; i++) {
        (void)step(&s, &camera);
        check_once(&s, &camera);
    }
    size_t pictures = 0, objects = 0;
    const uint32_t *shown = s.set->shown.data;
    for (size_t i = 0; i < s.set->shown.count; i++) {
        const vd_node *node = &s.world->nodes[vd_impostor_slot_at(s.set, shown[i])->node];
        const vd_node *leaf = node;
        while (leaf->count > 0) {
            leaf = &s.world->nodes[leaf->first];
        }
        if (s.world->entries[leaf->entry].object->kind == VD_OBJECT_PARTICLES) {
            pictures++;
            objects += node->placed;
        }
    }
    assert_true(pictures > 0 && objects > 2 * pictures);
    vd_frame *frames[3];
    for (int i = 0; i < 3; i++) {
        assert_ok(vd_frame_create(s.context, WIDTH, HEIGHT, 0, &frames[i]));
    }
    assert_ok(vd_impostors_draw(s.set, NULL, &camera, frames[0], NULL));
    assert_ok(vd_world_renderer_draw(s.renderer, NULL, &camera, frames[1], NULL));
    assert_true(vd_frame_error(frames[0], frames[1]) < 0.1);
    /* Without them it is another picture: that above is no success of drawing nothing. */
    s.set->shown.count = 0;
    assert_ok(vd_impostors_draw(s.set, NULL, &camera, frames[2], NULL));
    assert_true(vd_frame_error(frames[2], frames[1]) > 2.0 * vd_frame_error(frames[0], frames[1]));
    for (int i = 0; i < 3; i++) {
        vd_frame_destroy(&frames[i]);
    }
    end(&s);
    (void)unlink(path);
}

/* The measure: 0 for equal frames, and eq. 5.1 for others. */
/* Particles that are drawn themselves and take too long are drawn smaller: that is a little softer,
 * and hidden by the same hills. */
static void particles_may_be_coarse(void **state) {
    (void)state;
    static const char path[] = VEDUTA_BINARY_DIR "/test-impostors.vdp";
    const vd_vec3 middle = {0, 300, 60}, origin = {0, 0, 0};
    vd_impostor_def def = patient();
    def.settle = false;
    def.least_reuse = 1e9; /* all is drawn itself */
    scene s;
    begin_cloud(&s, path, middle, vd_vec3_make(300, 200, 150), &def);
    vd_camera camera = looking(origin);
    camera.orientation = vd_orientation_look_at(camera.eye, middle);
    vd_frame *frames[4];
    for (int i = 0; i < 4; i++) {
        assert_ok(vd_frame_create(s.context, WIDTH, HEIGHT, 0, &frames[i]));
        s.set->clouds_pace.level = i;
        (void)step(&s, &camera);
        assert_ok(vd_impostors_draw(s.set, NULL, &camera, frames[i], NULL));
    }
    s.set->direct.count = 0; /* without particles it is another picture */
    vd_frame *bare = NULL;
    assert_ok(vd_frame_create(s.context, WIDTH, HEIGHT, 0, &bare));
    assert_ok(vd_impostors_draw(s.set, NULL, &camera, bare, NULL));
    const double far = vd_frame_error(bare, frames[0]);
    for (int i = 1; i < 4; i++) {
        const double error = vd_frame_error(frames[i], frames[0]);
        assert_true(error > 0.0 && error < 0.25 * far);
        vd_frame_destroy(&frames[i]);
    }
    vd_frame_destroy(&frames[0]);
    vd_frame_destroy(&bare);
    end(&s);
    (void)unlink(path);
}

static void the_measure_is_the_published_one(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_frame *a = NULL, *b = NULL;
    assert_ok(vd_frame_create(context, 37, 20, 0, &a));
    assert_ok(vd_frame_create(context, 37, 20, 0, &b));
    assert_true(vd_frame_error(a, b) == 0.0);
    for (int y = 0; y < 20; y++) {
        for (int x = 0; x < 37; x++) {
            b->rgba[4 * ((size_t)y * b->stride + (size_t)x)] = 51; /* a fifth in red */
        }
    }
    assert_true(fabs(vd_frame_error(a, b) - sqrt(0.04 / 0.1)) < 1e-12);
    vd_frame_destroy(&a);
    vd_frame_destroy(&b);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(everything_is_shown_once),
        cmocka_unit_test(a_resting_camera_draws_nothing),
        cmocka_unit_test(moves_keep_to_the_tolerance),
        cmocka_unit_test(memory_is_kept),
        cmocka_unit_test(bad_input_is_refused),
        cmocka_unit_test(only_the_still_picture_is_settled),
        cmocka_unit_test(all_that_is_shown_is_right),
        cmocka_unit_test(reuse_follows_the_formula),
        cmocka_unit_test(what_changes_is_made_anew),
        cmocka_unit_test(a_walls_picture_lies_in_its_plane),
        cmocka_unit_test(a_turn_is_foreseen),
        cmocka_unit_test(tolerance_zero_always_draws),
        cmocka_unit_test(a_link_takes_its_time),
        cmocka_unit_test(a_remote_picture_comes_after_it_was_drawn),
        cmocka_unit_test(a_full_link_keeps_the_memory),
        cmocka_unit_test(replays_are_the_same),
        cmocka_unit_test(without_reuse_all_is_drawn_anew),
        cmocka_unit_test(a_budget_of_pixels_is_kept),
        cmocka_unit_test(particles_have_pictures),
        cmocka_unit_test(particles_may_be_coarse),
        cmocka_unit_test(the_measure_is_the_published_one),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
