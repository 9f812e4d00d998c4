/* geo_color.c: imagery, placed on elevation.
 *
 * A chain of virtual datasets brings any image into one shape: a palette is expanded, control
 * points or a sensor model are straightened, another CRS is warped. What comes out of the chain
 * lies in the DEM's CRS by an affine transform, so that one step remains: read the window under the
 * DEM, and write down the affine map from samples to pixels. An image in the DEM's own CRS passes
 * through without being resampled.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <veduta/geo.h>
#include "geo/geo_crs.h"
#include "geo/geo_heights.h"
#include "geo/geo_pixels.h"

enum { MAX_IMAGE_SIDE = 8192 };

/* An image and what it was made into; each dataset of the chain reads through the one before. */
typedef struct image {
    const char *path;
    GDALDatasetH chain[4];
    int depth;
    int bands[3], band_count; /* in the last of the chain */
} image;

static GDALDatasetH last(const image *im) {
    return im->chain[im->depth - 1];
}

static void image_finish(image *im) {
    while (im->depth > 0) {
        GDALClose(im->chain[--im->depth]);
    }
}

/* ---- bands
 * --------------------------------------------------------------------------------------- */

static int find_color(GDALDatasetH dataset, GDALColorInterp color) {
    int count = GDALGetRasterCount(dataset);
    for (int b = 1; b <= count; b++) {
        if (GDALGetRasterColorInterpretation(GDALGetRasterBand(dataset, b)) == color) {
            return b;
        }
    }
    return 0;
}

static void choose_automatically(image *im) {
    GDALDatasetH dataset = last(im);
    const int rgb[3] = {find_color(dataset, GCI_RedBand), find_color(dataset, GCI_GreenBand),
                        find_color(dataset, GCI_BlueBand)};
    const int count = GDALGetRasterCount(dataset), alpha = find_color(dataset, GCI_AlphaBand);
    im->band_count = count - (alpha > 0 ? 1 : 0) >= 3 ? 3 : 1;
    for (int i = 0; i < im->band_count; i++) {
        im->bands[i] = i + 1;
    }
    if (rgb[0] > 0 && rgb[1] > 0 && rgb[2] > 0) {
        im->band_count = 3;
        memcpy(im->bands, rgb, sizeof rgb);
    }
}

static vd_status choose_bands(image *im, const int wanted[3]) {
    if (wanted == NULL || (wanted[0] == 0 && wanted[1] == 0 && wanted[2] == 0)) {
        choose_automatically(im);
        return vd_success();
    }
    const int count = GDALGetRasterCount(last(im));
    im->band_count = wanted[1] == 0 && wanted[2] == 0 ? 1 : 3;
    for (int i = 0; i < im->band_count; i++) {
        if (wanted[i] < 1 || wanted[i] > count) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "cannot read band %d of %s: it has %d; name bands of 1 … %d",
                              wanted[i], im->path, count, count);
        }
        im->bands[i] = wanted[i];
    }
    return vd_success();
}

/* Replaces a single band with a palette by its red, green, blue (and alpha where it has any). */
static vd_status expand_palette(vd_gdal_session *session, image *im) {
    GDALRasterBandH band = GDALGetRasterBand(last(im), im->bands[0]);
    GDALColorTableH table = GDALGetRasterColorTable(band);
    if (im->band_count != 1 || table == NULL ||
        GDALGetRasterColorInterpretation(band) != GCI_PaletteIndex) {
        return vd_success();
    }
    bool transparent = false;
    for (int i = 0; i < GDALGetColorEntryCount(table); i++) {
        transparent = transparent || GDALGetColorEntry(table, i)->c4 < 255;
    }
    char number[16];
    (void)snprintf(number, sizeof number, "%d", im->bands[0]);
    const char *arguments[] = {"-of", "VRT", "-b", number, "-expand", transparent ? "rgba" : "rgb",
                               NULL};
    vd_gdal_clear(session);
    GDALDatasetH expanded = vd_gdal_translate(last(im), arguments);
    if (expanded == NULL) {
        return vd_gdal_failure(session, VD_ERROR_FORMAT, im->path, "its palette cannot be expanded",
                               "convert it to RGB with gdal_translate -expand rgb");
    }
    im->chain[im->depth++] = expanded;
    choose_automatically(im);
    return vd_success();
}

/* ---- placing
 * ------------------------------------------------------------------------------------- */

/* The DEM's side of the bargain. */
typedef struct ground {
    const vd_dem *dem;
    OGRSpatialReferenceH crs; /* null: unknown */
    vd_bounds bounds;         /* outer edges of its border samples, in its CRS */
} ground;

/* Names both places, in degrees where that can be said. */
static vd_status different_places(const image *im, const vd_georef *georef, const ground *g,
                                  vd_bounds image_bounds) {
    OGRSpatialReferenceH lonlat = vd_crs_open("EPSG:4326");
    vd_bounds a = image_bounds, b = g->bounds;
    OGRSpatialReferenceH of_image = georef->crs != NULL ? georef->crs : g->crs;
    bool degrees = lonlat != NULL && of_image != NULL && g->crs != NULL &&
                   vd_bounds_transform(image_bounds, of_image, lonlat, &a) &&
                   vd_bounds_transform(g->bounds, g->crs, lonlat, &b);
    if (!degrees) {
        a = image_bounds;
        b = g->bounds;
    }
    OSRDestroySpatialReference(lonlat);
    return vd_failure(
        VD_ERROR_ARGUMENT,
        "cannot place %s on the elevation: it covers %s %.6g … %.6g, %.6g … %.6g, the "
        "elevation %.6g … %.6g, %.6g … %.6g; give imagery of the same place",
        im->path, degrees ? "longitude, latitude" : "x, y", a.x0, a.x1, a.y0, a.y1, b.x0, b.x1,
        b.y0, b.y1);
}

/* Turns bounds in a geographic CRS by whole circles to where they lie nearest to others. */
static double turn_towards(vd_bounds from, vd_bounds to) {
    double apart = 0.5 * (to.x0 + to.x1) - 0.5 * (from.x0 + from.x1);
    return 360.0 * floor(apart / 360.0 + 0.5);
}

static int pixels_across(double pixels) {
    return pixels >= MAX_IMAGE_SIDE ? MAX_IMAGE_SIDE : (pixels > 1.0 ? (int)ceil(pixels) : 1);
}

/* Warps an image of another CRS to where it and the DEM meet, at its own resolution. */
static vd_status warp_to_ground(vd_gdal_session *session, image *im, const ground *g,
                                vd_georef *georef) {
    const vd_bounds whole = vd_bounds_of_grid(georef->corner, GDALGetRasterXSize(last(im)),
                                              GDALGetRasterYSize(last(im)));
    vd_bounds under, on_ground;
    vd_gdal_clear(session);
    if (!vd_bounds_transform(g->bounds, g->crs, georef->crs, &under)) {
        return different_places(im, georef, g, whole);
    }
    if (georef->kind == VD_CRS_GEOGRAPHIC) {
        double turn = turn_towards(under, whole);
        under.x0 += turn;
        under.x1 += turn;
    }
    vd_bounds meet = vd_bounds_intersection(under, whole);
    if (vd_bounds_empty(meet)) {
        return different_places(im, georef, g, whole);
    }
    if (!vd_bounds_transform(meet, georef->crs, g->crs, &on_ground)) {
        on_ground = g->bounds;
    }
    on_ground = vd_bounds_intersection(on_ground, g->bounds);
    if (vd_bounds_empty(on_ground)) {
        return different_places(im, georef, g, whole);
    }
    const double *t = georef->corner;
    char west[40], south[40], east[40], north[40], columns[16], rows[16];
    (void)snprintf(west, sizeof west, "%.17g", on_ground.x0);
    (void)snprintf(south, sizeof south, "%.17g", on_ground.y0);
    (void)snprintf(east, sizeof east, "%.17g", on_ground.x1);
    (void)snprintf(north, sizeof north, "%.17g", on_ground.y1);
    (void)snprintf(columns, sizeof columns, "%d",
                   pixels_across((meet.x1 - meet.x0) / sqrt(t[1] * t[1] + t[4] * t[4])));
    (void)snprintf(rows, sizeof rows, "%d",
                   pixels_across((meet.y1 - meet.y0) / sqrt(t[2] * t[2] + t[5] * t[5])));
    const char *arguments[] = {
        "-of",      "VRT",    "-r",
        "bilinear", "-t_srs", g->dem->crs,
        "-te",      west,     south,
        east,       north,    "-ts",
        columns,    rows,     find_color(last(im), GCI_AlphaBand) > 0 ? NULL : "-dstalpha",
        NULL};
    GDALDatasetH warped = vd_gdal_warp(last(im), arguments);
    if (warped == NULL) {
        return vd_gdal_failure(session, VD_ERROR_FORMAT, im->path,
                               "it cannot be warped to the elevation's CRS",
                               "warp it with gdalwarp first");
    }
    vd_log(session->context, VD_LOG_INFO, "%s: warped from %.60s to the elevation's CRS", im->path,
           georef->name[0] != '\0' ? georef->name : "its CRS");
    im->chain[im->depth++] = warped;
    (void)GDALGetGeoTransform(warped, georef->corner);
    OSRDestroySpatialReference(georef->crs);
    georef->crs = NULL; /* from here on, the elevation's */
    return vd_success();
}

/* Finds the window under the DEM and the map from samples to its pixels. */
static vd_status fit_window(const image *im, const ground *g, const vd_georef *georef,
                            vd_pixel_window *window, double map[6]) {
    const int width = GDALGetRasterXSize(last(im)), height = GDALGetRasterYSize(last(im));
    double corner[6], dem_corner[6], inverse[6], under[6];
    memcpy(corner, georef->corner, sizeof corner);
    const vd_bounds whole = vd_bounds_of_grid(corner, width, height);
    if (g->dem->kind == VD_CRS_GEOGRAPHIC) {
        corner[0] += turn_towards(whole, g->bounds);
    }
    if (!GDALInvGeoTransform(corner, inverse)) {
        return different_places(im, georef, g, whole);
    }
    /* The DEM's grid in pixels: both maps are affine, so their composition is. */
    vd_dem_corner_transform(g->dem, dem_corner);
    for (int i = 0; i < 3; i++) {
        under[i] = inverse[1] * dem_corner[i] + inverse[2] * dem_corner[3 + i];
        under[3 + i] = inverse[4] * dem_corner[i] + inverse[5] * dem_corner[3 + i];
    }
    under[0] += inverse[0];
    under[3] += inverse[3];
    const vd_bounds pixels = vd_bounds_of_grid(under, g->dem->width, g->dem->height);
    const vd_bounds image_pixels = {0.0, 0.0, width, height};
    const vd_bounds meet = vd_bounds_intersection(pixels, image_pixels);
    if (vd_bounds_empty(meet)) {
        return different_places(im, georef, g, whole);
    }
    /* Where the image falls short by no more than a sample, its last pixels may stand in. */
    const double slack_x = 1.0 + fabs(under[1]) + fabs(under[2]);
    const double slack_y = 1.0 + fabs(under[4]) + fabs(under[5]);
    window->edge = pixels.x0 < -slack_x || pixels.x1 > width + slack_x || pixels.y0 < -slack_y ||
                   pixels.y1 > height + slack_y;
    const double x0 = floor(meet.x0) - 1.0, y0 = floor(meet.y0) - 1.0; /* one more, for filtering */
    const double x1 = ceil(meet.x1) + 1.0, y1 = ceil(meet.y1) + 1.0;
    window->x = x0 > 0.0 ? (int)x0 : 0;
    window->y = y0 > 0.0 ? (int)y0 : 0;
    window->width = (x1 < width ? (int)x1 : width) - window->x;
    window->height = (y1 < height ? (int)y1 : height) - window->y;
    vd_geo_fit(window->width, window->height, MAX_IMAGE_SIDE, &window->out_width,
               &window->out_height);
    const double scale_x = (double)window->out_width / window->width;
    const double scale_y = (double)window->out_height / window->height;
    const double edge = window->edge ? 1.0 : 0.0;
    map[1] = under[1] * scale_x;
    map[2] = under[2] * scale_x;
    map[4] = under[4] * scale_y;
    map[5] = under[5] * scale_y;
    map[0] = (under[0] - window->x) * scale_x + 0.5 * (map[1] + map[2]) + edge;
    map[3] = (under[3] - window->y) * scale_y + 0.5 * (map[4] + map[5]) + edge;
    return vd_success();
}

/* Places the image on the DEM where both say where they lie; else the window is all of it. */
static vd_status place(vd_gdal_session *session, image *im, const vd_dem *dem,
                       vd_pixel_window *window, double map[6], bool *placed) {
    vd_georef georef = {.crs = NULL};
    ground g = {.dem = dem};
    GDALDatasetH straight = vd_georef_straighten(session, last(im), im->path);
    if (straight != last(im)) {
        im->chain[im->depth++] = straight;
    }
    *placed = false;
    window->width = GDALGetRasterXSize(last(im));
    window->height = GDALGetRasterYSize(last(im));
    vd_geo_fit(window->width, window->height, MAX_IMAGE_SIDE, &window->out_width,
               &window->out_height);
    if (dem == NULL || dem->kind == VD_CRS_NONE) {
        return vd_success();
    }
    vd_status status = vd_georef_init(session, last(im), im->path, &georef);
    if (status.code != VD_OK || georef.kind == VD_CRS_NONE) {
        vd_georef_finish(&georef);
        return status;
    }
    double corner[6];
    vd_dem_corner_transform(dem, corner);
    g.bounds = vd_bounds_of_grid(corner, dem->width, dem->height);
    g.crs = vd_crs_open(dem->crs);
    if (georef.crs != NULL && g.crs != NULL && !vd_crs_same(georef.crs, g.crs)) {
        status = warp_to_ground(session, im, &g, &georef);
    }
    if (status.code == VD_OK) {
        status = fit_window(im, &g, &georef, window, map);
    }
    *placed = status.code == VD_OK;
    OSRDestroySpatialReference(g.crs);
    vd_georef_finish(&georef);
    return status;
}

/* ---- public
 * -------------------------------------------------------------------------------------- */

static vd_status load(vd_gdal_session *session, image *im, const vd_dem *dem, const int bands[3],
                      vd_picture **out, double color_from_sample[6], bool *placed) {
    vd_pixel_window window = {.edge = false};
    double map[6];
    bool found = false;
    vd_status status = vd_gdal_open(session, im->path, &im->chain[0]);
    if (status.code != VD_OK) {
        return status;
    }
    im->depth = 1;
    status = choose_bands(im, bands);
    if (status.code == VD_OK) {
        status = expand_palette(session, im);
    }
    if (status.code == VD_OK) {
        status = place(session, im, dem, &window, map, &found);
    }
    if (status.code == VD_OK) {
        status = vd_geo_read_pixels(session, im->path, last(im), im->bands, im->band_count, &window,
                                    out);
    }
    if (status.code != VD_OK) {
        return status;
    }
    if (window.out_width != window.width || window.out_height != window.height) {
        vd_log(session->context, VD_LOG_INFO, "%s: %d × %d pixels are averaged to %d × %d",
               im->path, window.width, window.height, window.out_width, window.out_height);
    }
    if (found) {
        memcpy(color_from_sample, map, sizeof map);
    }
    *placed = found;
    return status;
}

vd_status vd_geo_load_color(vd_context *context, const char *path, const vd_dem *dem,
                            const int bands[3], vd_picture **out, double color_from_sample[6],
                            bool *placed) {
    vd_gdal_session session;
    image im = {.path = path};
    vd_gdal_begin(&session, context);
    vd_status status = load(&session, &im, dem, bands, out, color_from_sample, placed);
    image_finish(&im);
    vd_gdal_end(&session);
    return status;
}
