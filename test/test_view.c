/* Cameras: angles, lenses, rays and their inverse, frusta. */
#include <math.h>
#include "core/real.h"
#include "support.h"
#include <veduta/camera.h>

static void assert_close(double a, double b, double tolerance) {
    if (!(fabs(a - b) <= tolerance)) {
        fail_msg("%.17g is not within %g of %.17g", a, tolerance, b);
    }
}

static vd_camera any_camera(uint64_t *random, vd_projection projection) {
    vd_camera camera;
    memset(&camera, 0, sizeof camera);
    camera.eye = vd_vec3_make(test_uniform(random) * 1e6, test_uniform(random) * 1e6,
                              test_uniform(random) * 1e4);
    camera.orientation =
        vd_orientation_from_angles(test_uniform(random) * 6.28, (test_uniform(random) - 0.5) * 3.1,
                                   (test_uniform(random) - 0.5) * 6.2);
    camera.projection = projection;
    camera.lens = vd_lens_from_fov(0.2 + 2 * test_uniform(random), 640, 480);
    camera.lens.cx += 100 * (test_uniform(random) - 0.5);
    camera.lens.fx *= 0.5 + test_uniform(random);
    camera.near_m = 0.5;
    camera.far_m = 1e5;
    return camera;
}

static void angles_point_where_they_say(void **state) {
    (void)state;
    const struct {
        double heading, pitch, roll;
        vd_vec3 forward, right;
    } cases[] = {{0, 0, 0, {0, 1, 0}, {1, 0, 0}},      {90, 0, 0, {1, 0, 0}, {0, -1, 0}},
                 {180, 0, 0, {0, -1, 0}, {-1, 0, 0}},  {0, -90, 0, {0, 0, -1}, {1, 0, 0}},
                 {90, -90, 0, {0, 0, -1}, {0, -1, 0}}, {0, 90, 0, {0, 0, 1}, {1, 0, 0}},
                 {0, 0, 90, {0, 1, 0}, {0, 0, -1}}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        vd_quat q = vd_orientation_from_angles(
            vd_radians(cases[i].heading), vd_radians(cases[i].pitch), vd_radians(cases[i].roll));
        vd_vec3 f = vd_quat_rotate(q, vd_vec3_make(0, 0, 1));
        vd_vec3 r = vd_quat_rotate(q, vd_vec3_make(1, 0, 0));
        assert_close(vd_vec3_length(vd_vec3_subtract(f, cases[i].forward)), 0, 1e-15);
        assert_close(vd_vec3_length(vd_vec3_subtract(r, cases[i].right)), 0, 1e-15);
    }
}

static void angles_come_back(void **state) {
    (void)state;
    uint64_t random = 1;
    for (int i = 0; i < 2000; i++) {
        double heading = test_uniform(&random) * 2 * VD_PI;
        double pitch = (test_uniform(&random) - 0.5) * 3.14;
        double roll = (test_uniform(&random) - 0.5) * 6.28;
        double h, p, r;
        vd_orientation_to_angles(vd_orientation_from_angles(heading, pitch, roll), &h, &p, &r);
        assert_close(h, heading, 1e-10);
        assert_close(p, pitch, 1e-10);
        assert_close(r, roll, 1e-10);
    }
    double h, p, r;
    vd_orientation_to_angles(vd_orientation_from_angles(1.25, -VD_PI / 2, 0), &h, &p, &r);
    assert_close(h, 1.25, 1e-9);
    assert_close(p, -VD_PI / 2, 1e-9);
    assert_true(r == 0.0);
    vd_orientation_to_angles(vd_orientation_from_angles(4.5, VD_PI / 2, 0), &h, &p, &r);
    assert_close(h, 4.5, 1e-9);
}

static void look_at_centres_the_target(void **state) {
    (void)state;
    uint64_t random = 2;
    for (int i = 0; i < 500; i++) {
        vd_camera camera = any_camera(&random, VD_PROJECTION_PERSPECTIVE);
        vd_vec3 target = vd_vec3_make(test_uniform(&random) * 1e6, test_uniform(&random) * 1e6, 0);
        camera.orientation = vd_orientation_look_at(camera.eye, target);
        double x, y, z;
        assert_true(vd_camera_project(&camera, target, &x, &y, &z));
        assert_close(x, camera.lens.cx, 1e-6);
        assert_close(y, camera.lens.cy, 1e-6);
    }
    vd_quat down = vd_orientation_look_at(vd_vec3_make(5, 5, 9), vd_vec3_make(5, 5, 0));
    vd_vec3 top = vd_quat_rotate(down, vd_vec3_make(0, -1, 0));
    assert_close(top.y, 1, 1e-15); /* north is up in a map's view */
    vd_quat same = vd_orientation_look_at(vd_vec3_make(1, 1, 1), vd_vec3_make(1, 1, 1));
    assert_close(vd_quat_rotate(same, vd_vec3_make(0, 0, 1)).y, 1, 1e-15);
}

static void rays_and_projection_are_inverse(void **state) {
    (void)state;
    uint64_t random = 3;
    for (int i = 0; i < 4000; i++) {
        vd_camera camera = any_camera(&random, (vd_projection)(i % 2));
        assert_ok(vd_camera_validate(&camera));
        double x = test_uniform(&random) * 640, y = test_uniform(&random) * 480;
        double t = 1 + test_uniform(&random) * 1e4;
        vd_ray ray = vd_camera_ray(&camera, x, y);
        vd_vec3 p = vd_vec3_add(ray.origin, vd_vec3_scale(ray.direction, t));
        double px, py, pz;
        assert_true(vd_camera_project(&camera, p, &px, &py, &pz));
        assert_close(px, x, 1e-4);
        assert_close(py, y, 1e-4);
        assert_close(pz, t, 1e-6);
        float depth = vd_camera_depth(&camera, t);
        assert_true(depth > 0 && depth <= 1);
        assert_close(vd_camera_distance(&camera, depth) / t, 1, 1e-2);
    }
}

static void depth_is_reversed(void **state) {
    (void)state;
    uint64_t random = 4;
    vd_camera camera = any_camera(&random, VD_PROJECTION_PERSPECTIVE);
    assert_true(vd_camera_depth(&camera, camera.near_m) == 1.0f);
    assert_true(vd_camera_depth(&camera, INFINITY) == 0.0f);
    assert_true(isinf(vd_camera_distance(&camera, 0.0f)));
    assert_true(vd_camera_depth(&camera, 10) > vd_camera_depth(&camera, 11));
    camera.projection = VD_PROJECTION_ORTHOGRAPHIC;
    assert_true(vd_camera_depth(&camera, camera.far_m) == 0.0f);
    double x, y, z;
    camera.projection = VD_PROJECTION_PERSPECTIVE;
    vd_vec3 behind = vd_quat_rotate(camera.orientation, vd_vec3_make(0, 0, -5));
    assert_false(vd_camera_project(&camera, vd_vec3_add(camera.eye, behind), &x, &y, &z));
}

static void bad_cameras_are_named(void **state) {
    (void)state;
    uint64_t random = 5;
    const vd_camera good = any_camera(&random, VD_PROJECTION_ORTHOGRAPHIC);
    assert_ok(vd_camera_validate(&good));
    vd_camera camera = good;
    camera.eye.y = NAN;
    vd_status status = vd_camera_validate(&camera);
    assert_int_equal(status.code, VD_ERROR_ARGUMENT);
    assert_non_null(strstr(status.message, "eye y"));
    camera = good;
    camera.lens.fy = 0;
    assert_int_equal(vd_camera_validate(&camera).code, VD_ERROR_ARGUMENT);
    camera = good;
    camera.near_m = -1;
    assert_non_null(strstr(vd_camera_validate(&camera).message, "near"));
    camera = good;
    camera.far_m = 0;
    assert_non_null(strstr(vd_camera_validate(&camera).message, "far"));
    camera = good;
    camera.orientation.w += 1;
    assert_non_null(strstr(vd_camera_validate(&camera).message, "unit quaternion"));
    camera = good;
    camera.projection = (vd_projection)9;
    assert_int_equal(vd_camera_validate(&camera).code, VD_ERROR_ARGUMENT);
}

static void frustum_agrees_with_projection(void **state) {
    (void)state;
    uint64_t random = 6;
    int inside = 0;
    for (int i = 0; i < 20000; i++) {
        vd_camera camera = any_camera(&random, (vd_projection)(i % 2));
        vd_frustum frustum = vd_camera_frustum(&camera, 640, 480);
        double px = (test_uniform(&random) * 3 - 1) * 640,
               py = (test_uniform(&random) * 3 - 1) * 480;
        vd_ray ray = vd_camera_ray(&camera, px, py);
        double t = (test_uniform(&random) - 0.3) * 1000;
        vd_vec3 p = vd_vec3_add(ray.origin, vd_vec3_scale(ray.direction, t));
        const bool seen =
            t > camera.near_m + 1e-3 && px > 0.01 && px < 639.99 && py > 0.01 && py < 479.99;
        const bool unseen =
            t < camera.near_m - 1e-3 || px < -0.01 || px > 640.01 || py < -0.01 || py > 480.01;
        if (seen) {
            assert_true(vd_frustum_touches_box(&frustum, p, p));
            inside++;
        } else if (unseen && t > 0.6) {
            assert_false(vd_frustum_touches_box(&frustum, p, p));
        }
        vd_vec3 one = vd_vec3_make(1, 1, 1);
        if (seen) {
            assert_true(
                vd_frustum_touches_box(&frustum, vd_vec3_subtract(p, one), vd_vec3_add(p, one)));
        }
    }
    assert_true(inside > 500);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(angles_point_where_they_say),
        cmocka_unit_test(angles_come_back),
        cmocka_unit_test(look_at_centres_the_target),
        cmocka_unit_test(rays_and_projection_are_inverse),
        cmocka_unit_test(depth_is_reversed),
        cmocka_unit_test(bad_cameras_are_named),
        cmocka_unit_test(frustum_agrees_with_projection),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
