/* light.h: sun, sky and haze.
 *
 * A small model of daylight: one directional sun, a sky whose colour depends on the elevation of
 * the view ray, ambient light from that sky, and haze that mixes everything towards the horizon's
 * colour with distance. All colours are linear.
 */
#ifndef VEDUTA_LIGHT_H
#define VEDUTA_LIGHT_H

#include <veduta/color.h>
#include <veduta/vector.h>

VD_BEGIN_DECLARATIONS

typedef struct vd_light {
    vd_vec3 sun_direction;  /* unit vector towards the sun */
    vd_linear sun;          /* light on a surface that faces the sun */
    vd_linear ambient_up;   /* light from the sky on a surface that faces up */
    vd_linear ambient_down; /* light from the ground on a surface that faces down */
    vd_linear zenith;       /* sky colour straight up */
    vd_linear horizon;      /* sky colour at elevation 0; haze mixes towards it */
    vd_linear nadir;        /* colour below the horizon, straight down */
    double haze_m;          /* distance at which haze leaves 1/e of the contrast; 0: no haze */
} vd_light;

/* Returns daylight with the sun at `azimuth_rad` (clockwise from north) and `altitude_rad` above
 * the horizon. A low sun is redder; below the horizon the sun gives no light and the sky is dim. */
VD_API vd_light vd_light_daylight(double azimuth_rad, double altitude_rad);

/* Returns the unit vector towards azimuth and altitude. */
VD_API vd_vec3 vd_sun_direction(double azimuth_rad, double altitude_rad);

/* Returns the sky's colour along a ray whose elevation has the sine `sine_elevation` (−1 … 1). */
VD_API vd_linear vd_light_sky(const vd_light *light, float sine_elevation);

/* Returns albedo lit by sun and sky: `normal` is the unit surface normal, `sun_visible` the share
 * of the sun that is seen, 0 … 1. */
VD_API vd_linear vd_light_shade(const vd_light *light, vd_linear albedo, vd_vec3 normal,
                                float sun_visible);

/* Returns `color` seen through `distance_m` metres of haze. */
VD_API vd_linear vd_light_haze(const vd_light *light, vd_linear color, double distance_m);

VD_END_DECLARATIONS

#endif
