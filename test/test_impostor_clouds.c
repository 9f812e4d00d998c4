/* Particles over ground, for a client that has pictures and nothing else. */
#include <stdlib.h>
#include <unistd.h>
#include "item_client.h"
#include "particle_scenes.h"

static char folder[] = VEDUTA_BINARY_DIR "/test-impostor-clouds-XXXXXX";

static int set_up(void **state) {
    (void)state;
    return test_enter_folder(folder);
}

static int tear_down(void **state) {
    (void)state;
    return test_leave_folder(folder);
}

/* A cloud that fills 200 m over the hills and goes into them, of 300 objects or so. */
static void add_cloud_over_hills(void) {
    const vd_vec3 middle = {0, 60, 60}, size = {220, 220, 160};
    vd_particle_look look = cloud_look();
    look.radius_m = 2.0;
    const size_t count = add_cloud(
        s.world, open_cloud(s.context, "cloud.vdp", 40000, middle, size, 100), &look, 200);
    assert_true(count > 100);
}

/* A small one, low over the ground. */
static void add_low_cloud(void) {
    const vd_vec3 middle = {0, 0, vd_world_ground(s.world, 0, 0) + 7}, size = {6, 6, 3};
    vd_particle_look look = cloud_look();
    look.radius_m = 0.15;
    (void)add_cloud(s.world, open_cloud(s.context, "low.vdp", 4000, middle, size, 100), &look, 100);
}

static bool is_object(uint64_t id) {
    return id >> 56 < 251;
}

/* Of what the client shows. */
static int count_objects(void) {
    int count = 0;
    for (int i = 0; i < s.client.order_count; i++) {
        count += is_object(s.client.order[i]);
    }
    return count;
}

/* From the hills before it, where ridges hide some of it, over it, and close to it. */
static void clouds_are_pictures_of_their_own(void **state) {
    (void)state;
    const vd_impostor_def def = shipping();
    begin_with(&def, 60, add_cloud_over_hills);
    double sum = 0.0, worst = 0.0;
    int compared = 0, objects = 0;
    uint64_t random = 11;
    const int places = test_is_reduced() ? 4 : 12;
    for (int k = 0; k < places; k++) {
        const double angle = 6.28 * test_uniform(&random), away = 200 + 250 * test_uniform(&random);
        const double height = 10 + 140 * test_uniform(&random);
        vd_camera camera = looking(vd_vec3_make(0, 0, 0));
        camera.eye = vd_vec3_make(away * sin(angle), 60 + away * cos(angle), 0);
        camera.eye.z = vd_world_ground(s.world, camera.eye.x, camera.eye.y) + height;
        camera.orientation = vd_orientation_from_angles(angle + 3.14159265358979,
                                                        atan2(60 - camera.eye.z, away), 0.0);
        const vd_vec3 step = vd_quat_rotate(camera.orientation, vd_vec3_make(0.4, 0.0, 0.5));
        for (int i = 0; i < 15; i++) {
            camera.eye = vd_vec3_add(camera.eye, step);
            if (serve(&camera, 1000) < 0.01 && i > 6) {
                const double error = show_error(&camera);
                sum += error;
                worst = error > worst ? error : worst;
                objects += count_objects();
                compared++;
            }
        }
    }
    print_message("error %.4f on average, %.4f at worst, %d objects of %d pictures\n",
                  sum / compared, worst, objects / compared, s.client.count);
    assert_true(compared > 4 * places && objects > 10 * compared);
    assert_true(sum / compared < 0.2 && worst < 0.35);
    end();
}

/* Behind a hill nothing of it is seen: what is ordered shows nothing. */
static void ground_hides_them(void **state) {
    (void)state;
    const vd_impostor_def def = shipping();
    begin_with(&def, 1, add_cloud_over_hills);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    double lowest = INFINITY;
    for (int x = -600; x <= 600; x += 20) { /* the deepest valley before it */
        const double z = vd_world_ground(s.world, x, -330);
        if (z < lowest) {
            lowest = z;
            camera.eye = vd_vec3_make(x, -330, z + 2.5);
        }
    }
    camera.orientation = vd_orientation_from_angles(atan2(-camera.eye.x, 390.0), 0.05, 0.0);
    double error = 0.0;
    for (int i = 0; i < 20; i++) {
        camera.eye.x += 0.05;
        if (serve(&camera, 1000) < 0.01) {
            error = show_error(&camera);
        }
    }
    print_message("error %.4f with %d objects\n", error, count_objects());
    assert_true(error > 0.0 && error < 0.2);
    end();
}

/* Over near ground: only flat patches far away, and small things, last for long enough. */
static vd_camera begin_over_near_ground(bool settle) {
    vd_impostor_def def = shipping();
    def.least_reuse = 60.0;
    def.settle = settle;
    begin_with(&def, 1, add_low_cloud);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    camera.eye = vd_vec3_make(0, -22, vd_world_ground(s.world, 0, 0) + 19);
    camera.orientation = vd_orientation_from_angles(0.0, -0.55, 0.0);
    return camera;
}

/* Near ground behind it is in the picture in front, and so is it then. */
static void what_comes_before_near_ground_is_seen(void **state) {
    (void)state;
    vd_camera camera = begin_over_near_ground(true);
    double worst = 0.0;
    int compared = 0, in_front = 0;
    for (int i = 0; i < 60; i++) {
        camera.eye = vd_vec3_add(camera.eye, vd_vec3_make(0.02, 0.01, 0.0));
        if (serve(&camera, 1000) < 0.01 && i > 6) {
            const double error = show_error(&camera);
            worst = error > worst ? error : worst;
            compared++;
        }
        for (uint32_t k = 0; k < s.set->slots.count; k++) {
            in_front += vd_impostor_slot_at(s.set, k)->in_front;
        }
    }
    print_message("error %.4f at worst of %d, %d in front\n", worst, compared, in_front);
    assert_true(compared > 30 && in_front > 0);
    assert_true(worst < 0.1);
    end();
}

/* So it is when it comes after the ground, to a camera that rests. */
static void what_comes_late_is_seen(void **state) {
    (void)state;
    const vd_camera camera = begin_over_near_ground(false);
    double worst = 0.0;
    int compared = 0;
    for (int i = 0; i < 300; i++) {
        if (serve(&camera, 1) == 0.0 && i % 10 == 9) {
            worst = fmax(worst, show_error(&camera));
            compared++;
        }
    }
    print_message("error %.4f at worst of %d\n", worst, compared);
    assert_true(compared > 5 && worst < 0.1);
    end();
}

/* A server that draws one picture a turn shows the whole first, then finer and finer parts; and
 * while the camera goes on, larger parts than when it rests. */
static void a_slow_server_begins_with_wholes(void **state) {
    (void)state;
    vd_impostor_def def = shipping();
    def.budget_pixels = 1;
    def.settle = false;
    begin_with(&def, 1, add_cloud_over_hills);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    camera.eye = vd_vec3_make(-40, -500, 140);
    uint32_t first = 0, last = 0;
    double most_haste = 1.0;
    for (int i = 0; i < 1500; i++) {
        (void)serve(&camera, 1000);
        for (int k = 0; k < s.client.count; k++) {
            if (is_object(s.client.items[k].id)) {
                last = vd_world_node(s.world, s.client.items[k].id)->placed;
                first = first == 0 ? last : first;
            }
        }
    }
    const int at_rest = count_objects();
    assert_true(first > 16);
    assert_true(at_rest > 4);
    for (int i = 0; i < 150; i++) {
        camera.eye.x += i / 25 % 2 == 0 ? 8.0 : -8.0;
        (void)serve(&camera, 1000);
        most_haste = fmax(most_haste, s.set->haste);
    }
    print_message("first of %u objects, then %d; haste %.2f, then %d\n", first, at_rest, most_haste,
                  count_objects());
    assert_true(most_haste > 1.5);
    for (int i = 0; i < 1500; i++) {
        camera.eye.x += 0.001;
        (void)serve(&camera, 1000);
    }
    assert_true(s.set->haste == 1.0);
    end();
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(clouds_are_pictures_of_their_own),
                                       cmocka_unit_test(ground_hides_them),
                                       cmocka_unit_test(what_comes_before_near_ground_is_seen),
                                       cmocka_unit_test(what_comes_late_is_seen),
                                       cmocka_unit_test(a_slow_server_begins_with_wholes)};
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
