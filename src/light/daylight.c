#include <math.h>
#include <veduta/light.h>
#include "core/real.h"

static vd_linear linear(double r, double g, double b) {
    vd_linear c = {(float)r, (float)g, (float)b};
    return c;
}

static vd_linear mix(vd_linear a, vd_linear b, float t) {
    vd_linear c = {a.r + (b.r - a.r) * t, a.g + (b.g - a.g) * t, a.b + (b.b - a.b) * t};
    return c;
}

static vd_linear scaled(vd_linear a, float s) {
    vd_linear c = {a.r * s, a.g * s, a.b * s};
    return c;
}

static double clamp01(double x) {
    return x < 0.0 ? 0.0 : x > 1.0 ? 1.0 : x;
}

vd_vec3 vd_sun_direction(double azimuth_rad, double altitude_rad) {
    double level = vd_cos(altitude_rad);
    return vd_vec3_make(level * vd_sin(azimuth_rad), level * vd_cos(azimuth_rad),
                        vd_sin(altitude_rad));
}

/* Sunlight through the atmosphere: the optical depth grows with the air mass, 1 at the zenith and
 * about 38 at the horizon (Rozenberg 1966), and blue is scattered out first. */
static vd_linear sunlight(double sine_altitude) {
    if (sine_altitude <= 0.0) {
        return linear(0, 0, 0);
    }
    double mass = 1.0 / (sine_altitude + 0.025 * vd_exp(-11.0 * sine_altitude));
    double r = vd_exp(-0.030 * (mass - 1.0));
    double g = vd_exp(-0.065 * (mass - 1.0));
    double b = vd_exp(-0.130 * (mass - 1.0));
    return linear(1.06 * r, 1.00 * g, 0.93 * b);
}

vd_light vd_light_daylight(double azimuth_rad, double altitude_rad) {
    vd_light light;
    light.sun_direction = vd_sun_direction(azimuth_rad, altitude_rad);
    double sine = light.sun_direction.z;
    /* From day (sun 20° up) over dusk to night (sun 12° down). */
    float day = (float)clamp01((sine + 0.21) / 0.55);
    float low = (float)(1.0 - clamp01(fabs(sine) / 0.35));
    light.sun = sunlight(sine);
    light.zenith = scaled(linear(0.085, 0.215, 0.50), day * day);
    light.horizon = mix(linear(0.56, 0.68, 0.80), linear(0.85, 0.52, 0.32), 0.7f * low);
    light.horizon = scaled(light.horizon, day);
    light.nadir = scaled(linear(0.60, 0.64, 0.68), day);
    light.ambient_up = scaled(linear(0.155, 0.195, 0.265), 0.15f + 0.85f * day);
    light.ambient_down = scaled(linear(0.075, 0.07, 0.06), 0.15f + 0.85f * day);
    light.haze_m = 0.0;
    return light;
}

/* 0 at the horizon, 1 straight up or down; steep near the horizon, but without a visible line. */
static float away_from_horizon(float sine) {
    float x = sine > 1.0f ? 1.0f : sine;
    return 1.25f * x / (x + 0.25f);
}

vd_linear vd_light_sky(const vd_light *light, float sine_elevation) {
    return sine_elevation >= 0.0f
               ? mix(light->horizon, light->zenith, away_from_horizon(sine_elevation))
               : mix(light->horizon, light->nadir, away_from_horizon(-sine_elevation));
}

vd_linear vd_light_shade(const vd_light *light, vd_linear albedo, vd_vec3 normal,
                         float sun_visible) {
    float facing = (float)vd_vec3_dot(normal, light->sun_direction);
    float direct = facing > 0.0f ? facing * sun_visible : 0.0f;
    float up = 0.5f + 0.5f * (float)normal.z;
    vd_linear ambient = mix(light->ambient_down, light->ambient_up, up);
    vd_linear c = {albedo.r * (light->sun.r * direct + ambient.r),
                   albedo.g * (light->sun.g * direct + ambient.g),
                   albedo.b * (light->sun.b * direct + ambient.b)};
    return c;
}

vd_linear vd_light_haze(const vd_light *light, vd_linear color, double distance_m) {
    if (!(light->haze_m > 0.0)) {
        return color;
    }
    return mix(light->horizon, color, (float)vd_exp(-distance_m / light->haze_m));
}
