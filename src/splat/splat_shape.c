/* splat_shape.c: kernels and their areas, and splats larger than a pixel. */
#include <math.h>
#include "core/real.h"
#include "splat/splat_internal.h"

/* Below this support, in pixels, a kernel read at pixel middles may add up to something else than
 * its area, and is scaled. Beyond, it is off by less than 1/500. */
#define SCALED_SUPPORT 8.0f

#define GAUSSIAN_SUPPORT 2.5
#define SPH_SUPPORT 2.0

double vd_splat_support(vd_splat_kernel kernel) {
    return kernel == VD_SPLAT_GAUSSIAN ? GAUSSIAN_SUPPORT
           : kernel == VD_SPLAT_SPH    ? SPH_SUPPORT
                                       : 1.0;
}

/* The cubic spline of smoothing length 1 (Monaghan 1992), 1 at the middle. */
static double spline(double q) {
    const double rest = 2.0 - q;
    return q < 1.0   ? 1.0 - 1.5 * q * q + 0.75 * q * q * q
           : q < 2.0 ? 0.25 * rest * rest * rest
                     : 0.0;
}

/* Its integral along a line that passes the middle at distance b. */
static double spline_along(double b) {
    enum { STEPS = 256 };
    const double reach = SPH_SUPPORT * SPH_SUPPORT - b * b;
    const double end = sqrt(reach > 0.0 ? reach : 0.0);
    double sum = 0.0;
    for (int i = 0; i < STEPS; i++) {
        const double z = end * (i + 0.5) / STEPS;
        sum += spline(sqrt(b * b + z * z));
    }
    return sum * end / STEPS;
}

void vd_splat_profile_init(vd_splat_profile *profile, vd_splat_kernel kernel) {
    const double middle = spline_along(0.0);
    for (int i = 0; i <= VD_PROFILE_STEPS; i++) {
        const double s = (double)i / VD_PROFILE_STEPS;
        profile->at[i] = kernel == VD_SPLAT_GAUSSIAN
                             ? (float)vd_exp(-GAUSSIAN_SUPPORT * GAUSSIAN_SUPPORT * s)
                             : (float)(spline_along(SPH_SUPPORT * sqrt(s)) / middle);
    }
    profile->at[VD_PROFILE_STEPS + 1] = profile->at[VD_PROFILE_STEPS];
}

/* With s = d²/support² a ring has the area π·support²·ds. */
static float profile_area(const vd_splat_profile *profile) {
    double sum = 0.0;
    for (int i = 0; i < VD_PROFILE_STEPS; i++) {
        sum += 0.5 * ((double)profile->at[i] + (double)profile->at[i + 1]);
    }
    return (float)(VD_PI * sum / VD_PROFILE_STEPS);
}

vd_splat_shape vd_splat_shape_of(vd_splat_kernel kernel, const vd_splat_profile profiles[2]) {
    vd_splat_shape shape = {kernel, 1.0f, 0.5f, 4.0f, NULL};
    if (kernel == VD_SPLAT_DISC) {
        shape.area = (float)VD_PI;
    } else if (kernel != VD_SPLAT_BOX) {
        const bool gaussian = kernel == VD_SPLAT_GAUSSIAN;
        shape.support = (float)vd_splat_support(kernel);
        shape.small = 0.5f * shape.support;
        shape.profile = &profiles[gaussian ? 0 : 1];
        shape.area = profile_area(shape.profile);
    }
    return shape;
}

static float clamp01(float v) {
    v = 0.0f < v ? v : 0.0f;
    return v < 1.0f ? v : 1.0f;
}

/* How much of [p, p + 1] lies in [low, high]. */
static float overlap(float p, float low, float high) {
    const float from = p < low ? low : p, to = p + 1.0f < high ? p + 1.0f : high;
    return clamp01(to - from);
}

float vd_splat_large_at(const vd_splat_large *large, const vd_splat_shape *shape, int px, int py) {
    const float r = large->support;
    if (shape->kernel == VD_SPLAT_BOX) {
        return overlap((float)px, large->x - r, large->x + r) *
               overlap((float)py, large->y - r, large->y + r);
    }
    const float dx = ((float)px + 0.5f) - large->x, dy = ((float)py + 0.5f) - large->y;
    const float square = dx * dx + dy * dy;
    if (shape->kernel == VD_SPLAT_DISC) {
        return clamp01((r + 0.5f) - sqrtf(square));
    }
    const float s = square * large->inverse;
    if (!(s < 1.0f)) {
        return 0.0f;
    }
    const float t = s * (float)VD_PROFILE_STEPS;
    const int i = (int)t;
    const float *at = shape->profile->at;
    return at[i] + (at[i + 1] - at[i]) * (t - (float)i);
}

bool vd_splat_large_holds(const vd_splat_large *large, const vd_splat_shape *shape, int px,
                          int py) {
    const float r = large->support / shape->support;
    const float dx = ((float)px + 0.5f) - large->x, dy = ((float)py + 0.5f) - large->y;
    if (shape->kernel == VD_SPLAT_BOX) {
        return dx >= -r && dx < r && dy >= -r && dy < r;
    }
    return dx * dx + dy * dy <= r * r;
}

/* floor(v), at least 0 and at most `most`; 0 for NaN. */
static int pixel_of(float v, int most) {
    return !(v > 0.0f) ? 0 : v >= (float)most ? most : (int)v;
}

void vd_splat_large_box(const vd_splat_large *large, const vd_splat_picture *picture, int box[4]) {
    const float reach = large->support + 1.0f;
    box[0] = pixel_of(large->x - reach, picture->width);
    box[1] = pixel_of(large->x + reach + 1.0f, picture->width);
    box[2] = pixel_of(large->y - reach, picture->height);
    box[3] = pixel_of(large->y + reach + 1.0f, picture->height);
}

float vd_splat_large_sum(const vd_splat_large *large, const vd_splat_shape *shape, int first,
                         int side) {
    float parts[VD_SUM_LANES] = {0}, sum = 0.0f;
    for (int y = first; y < first + side; y++) {
        for (int i = 0; i < side; i++) {
            parts[i % VD_SUM_LANES] += vd_splat_large_at(large, shape, first + i, y);
        }
    }
    for (int i = 0; i < VD_SUM_LANES; i++) {
        sum += parts[i];
    }
    return sum;
}

/* What the kernel adds up to over all pixels around the splat, in the picture or not. */
static float add_up(const vd_splat_large *large, const vd_splat_shape *shape,
                    vd_splat_sum_function *add) {
    vd_splat_large moved = *large;
    moved.x = (large->x - floorf(large->x)) + 16.0f;
    moved.y = (large->y - floorf(large->y)) + 16.0f;
    const int reach = (int)(large->support + 1.5f);
    return add(&moved, shape, 16 - reach, 2 * reach + 1);
}

void vd_splat_large_init(vd_splat_large *large, const vd_splat_picture *picture, float x, float y,
                         float support, float amount, vd_splat_sum_function *add) {
    const vd_splat_shape *shape = &picture->shape;
    large->x = floorf(x * 256.0f + 0.5f) * (1.0f / 256.0f);
    large->y = floorf(y * 256.0f + 0.5f) * (1.0f / 256.0f);
    large->support = support;
    large->inverse = 1.0f / (support * support);
    const float area = shape->area * (support * support);
    float sum = area;
    if (picture->mode != VD_SPLAT_NEAREST && shape->kernel != VD_SPLAT_BOX &&
        support < SCALED_SUPPORT) {
        sum = add_up(large, shape, add);
    }
    if (picture->mode == VD_SPLAT_DENSITY) {
        large->amount = amount * 128.0f / sum;
    } else {
        large->amount = amount * (area / sum);
    }
}
