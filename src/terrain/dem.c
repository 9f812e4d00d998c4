/* dem.c: the grid of heights itself: making it, its range, and where it lies in the world. */
#include <math.h>
#include <string.h>
#include <veduta/dem.h>
#include "core/core.h"
#include "core/real.h"

/* WGS 84 (NIMA TR8350.2): semi-major axis in metres and first eccentricity squared. */
static const double wgs84_a = 6378137.0;
static const double wgs84_e2 = 6.69437999014131699e-3;

vd_dem_def vd_dem_def_default(void) {
    vd_dem_def def;
    memset(&def, 0, sizeof def);
    return def;
}

vd_status vd_dem_create(vd_context *context, int width, int height, vd_dem **out) {
    if (!context || !out) {
        return vd_failure(VD_ERROR_ARGUMENT, "vd_dem_create: the context and out must not be null");
    }
    if (width < 1 || height < 1) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "vd_dem_create: the size %d × %d must be at least 1 × 1", width, height);
    }
    size_t stride = vd_row_stride((size_t)width, sizeof(float));
    if (width > VD_MAX_SIDE || height > VD_MAX_SIDE ||
        (size_t)width * (size_t)height > VD_MAX_PIXELS) {
        return vd_failure(
            VD_ERROR_LIMIT,
            "elevation of %d × %d samples is more than this program takes (%d a side, "
            "%zu in all); crop it or reduce its resolution",
            width, height, VD_MAX_SIDE, VD_MAX_PIXELS);
    }
    size_t count = stride * (size_t)height;
    vd_dem *dem = vd_allocate_zero(context, 1, sizeof *dem);
    float *heights = vd_allocate(context, count, sizeof *heights);
    if (!dem || !heights) {
        vd_release(context, heights);
        vd_release(context, dem);
        return vd_out_of_memory("elevation", count * sizeof *heights);
    }
    for (size_t i = 0; i < count; i++) {
        heights[i] = NAN;
    }
    dem->context = context;
    dem->width = width;
    dem->height = height;
    dem->stride = stride;
    dem->heights = heights;
    dem->transform[1] = 1.0;
    dem->transform[5] = -1.0;
    dem->crs_unit_m = 1.0;
    dem->min = dem->max = NAN;
    dem->missing = (uint64_t)width * (uint64_t)height;
    *out = dem;
    return vd_success();
}

void vd_dem_destroy(vd_dem **dem) {
    if (!dem || !*dem) {
        return;
    }
    vd_context *context = (*dem)->context;
    vd_release(context, (*dem)->crs);
    vd_release(context, (*dem)->heights);
    vd_release(context, *dem);
    *dem = NULL;
}

void vd_dem_update_range(vd_dem *dem) {
    float min = INFINITY, max = -INFINITY;
    uint64_t missing = 0;
    for (int row = 0; row < dem->height; row++) {
        float *heights = dem->heights + (size_t)row * dem->stride;
        for (int column = 0; column < dem->width; column++) {
            float h = heights[column];
            if (!isfinite(h)) {
                heights[column] = NAN;
                missing++;
                continue;
            }
            min = h < min ? h : min;
            max = h > max ? h : max;
        }
    }
    bool empty = missing == (uint64_t)dem->width * (uint64_t)dem->height;
    dem->min = empty ? NAN : min;
    dem->max = empty ? NAN : max;
    dem->missing = missing;
}

/* Metres per degree at a latitude: radii of curvature in the meridian, M = a(1 − e²)/w³, and in the
 * prime vertical, N = a/w, with w² = 1 − e² sin²φ (Snyder 1987, USGS PP 1395, eq. 4-18 … 4-20). */
static void metres_per_degree(double latitude_deg, double *east, double *north) {
    double phi = vd_radians(latitude_deg);
    double sine = vd_sin(phi);
    double w2 = 1.0 - wgs84_e2 * sine * sine;
    double w = sqrt(w2);
    *north = vd_radians(wgs84_a * (1.0 - wgs84_e2) / (w2 * w));
    *east = vd_radians(wgs84_a / w * vd_cos(phi));
}

vd_placement vd_dem_placement(const vd_dem *dem) {
    vd_placement placement = {0.0, 0.0, 1.0, 1.0};
    if (dem->kind == VD_CRS_GEOGRAPHIC) {
        const double *t = dem->transform;
        double column = 0.5 * (dem->width - 1), row = 0.5 * (dem->height - 1);
        placement.origin_x = t[0] + column * t[1] + row * t[2];
        placement.origin_y = t[3] + column * t[4] + row * t[5];
        metres_per_degree(placement.origin_y, &placement.scale_x, &placement.scale_y);
    } else if (dem->kind == VD_CRS_PROJECTED) {
        placement.scale_x = placement.scale_y = dem->crs_unit_m;
    }
    return placement;
}

void vd_dem_world_from_sample(const vd_dem *dem, double out[6]) {
    vd_placement p = vd_dem_placement(dem);
    const double *t = dem->transform;
    out[0] = (t[0] - p.origin_x) * p.scale_x;
    out[1] = t[1] * p.scale_x;
    out[2] = t[2] * p.scale_x;
    out[3] = (t[3] - p.origin_y) * p.scale_y;
    out[4] = t[4] * p.scale_y;
    out[5] = t[5] * p.scale_y;
}
