/* Daylight: directions, monotone behaviour, limits. */
#include <math.h>
#include "core/real.h"
#include "support.h"
#include <veduta/light.h>

static void sun_stands_where_it_should(void **state) {
    (void)state;
    vd_vec3 east = vd_sun_direction(vd_radians(90), 0);
    assert_true(fabs(east.x - 1) < 1e-15 && fabs(east.y) < 1e-15 && fabs(east.z) < 1e-15);
    vd_vec3 usual = vd_sun_direction(vd_radians(315), vd_radians(45));
    assert_true(usual.x < 0 && usual.y > 0 && fabs(usual.z - sqrt(0.5)) < 1e-15);
    assert_true(fabs(vd_vec3_length(usual) - 1) < 1e-15);
}

static void lower_suns_are_dimmer_and_redder(void **state) {
    (void)state;
    float last = INFINITY, last_ratio = 0;
    for (int altitude = 90; altitude >= 1; altitude--) {
        vd_light light = vd_light_daylight(0, vd_radians(altitude));
        assert_true(light.sun.g <= last);
        assert_true(light.sun.r / light.sun.b >= last_ratio);
        last = light.sun.g;
        last_ratio = light.sun.r / light.sun.b;
    }
    vd_light night = vd_light_daylight(0, vd_radians(-5));
    assert_true(night.sun.r == 0 && night.sun.g == 0 && night.sun.b == 0);
    assert_true(night.ambient_up.g > 0); /* still some light to see by */
}

static void surfaces_facing_the_sun_are_brightest(void **state) {
    (void)state;
    vd_light light = vd_light_daylight(vd_radians(315), vd_radians(45));
    vd_linear white = {1, 1, 1};
    vd_linear facing = vd_light_shade(&light, white, light.sun_direction, 1);
    vd_linear shaded = vd_light_shade(&light, white, light.sun_direction, 0);
    vd_linear away = vd_light_shade(&light, white, vd_vec3_scale(light.sun_direction, -1), 1);
    vd_linear up = vd_light_shade(&light, white, vd_vec3_make(0, 0, 1), 1);
    assert_true(facing.g > up.g && up.g > shaded.g && shaded.g > away.g && away.g > 0);
    assert_true(shaded.b > shaded.r); /* shadows are lit by the blue sky */
    vd_linear black = vd_light_shade(&light, (vd_linear){0, 0, 0}, vd_vec3_make(0, 0, 1), 1);
    assert_true(black.r == 0 && black.g == 0 && black.b == 0);
}

static void sky_is_continuous_and_bounded(void **state) {
    (void)state;
    for (int altitude = -20; altitude <= 90; altitude += 5) {
        vd_light light = vd_light_daylight(1, vd_radians(altitude));
        vd_linear last = vd_light_sky(&light, -1);
        for (int i = -1000; i <= 1000; i++) {
            vd_linear c = vd_light_sky(&light, (float)i / 1000);
            assert_true(c.r >= 0 && c.g >= 0 && c.b >= 0 && c.r <= 1 && c.g <= 1 && c.b <= 1);
            assert_true(fabsf(c.g - last.g) < 0.06f);
            last = c;
        }
        vd_linear over = vd_light_sky(&light, 1.0000001f), zenith = vd_light_sky(&light, 1);
        assert_true(over.b == zenith.b);
    }
}

static void haze_goes_from_nothing_to_the_horizon(void **state) {
    (void)state;
    vd_light light = vd_light_daylight(1, 1);
    vd_linear red = {0.8f, 0.1f, 0.1f};
    vd_linear none = vd_light_haze(&light, red, 1e6);
    assert_true(none.r == red.r && none.g == red.g && none.b == red.b);
    light.haze_m = 1000;
    vd_linear near = vd_light_haze(&light, red, 0), one = vd_light_haze(&light, red, 1000),
              far = vd_light_haze(&light, red, 1e9);
    assert_true(near.r == red.r && far.r == light.horizon.r);
    const double left = (double)(one.g - light.horizon.g) / (double)(red.g - light.horizon.g);
    assert_true(fabs(left - exp(-1)) < 1e-5);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sun_stands_where_it_should),
        cmocka_unit_test(lower_suns_are_dimmer_and_redder),
        cmocka_unit_test(surfaces_facing_the_sun_are_brightest),
        cmocka_unit_test(sky_is_continuous_and_bounded),
        cmocka_unit_test(haze_goes_from_nothing_to_the_horizon),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
