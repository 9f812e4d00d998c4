/* geo_crs.c: see geo_crs.h.
 *
 * What files say is untidy, and each of these was met in the wild: no CRS but coordinates that are
 * plainly degrees; degrees that are grads; an identity geotransform that means "none"; ground
 * control points; a map unit that is not a metre on the ground. Here all of it becomes one of three
 * kinds, so that the rest of the library needs to know nothing about it.
 */
#include "geo/geo_crs.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>
#include <veduta/geo.h>

#define DEGREE_RAD 0.017453292519943295

/* ---- CRS by name
 * --------------------------------------------------------------------------------- */

OGRSpatialReferenceH vd_crs_open(const char *text) {
    /* OSRSetFromUserInput also takes file names and addresses: a CRS must not make it open either.
     */
    if (text == NULL || text[0] == '\0' || strncmp(text, "http", 4) == 0 ||
        strncmp(text, "/vsi", 4) == 0 || access(text, F_OK) == 0) {
        return NULL;
    }
    OGRSpatialReferenceH crs = OSRNewSpatialReference(NULL);
    if (crs != NULL && OSRSetFromUserInput(crs, text) != OGRERR_NONE) {
        OSRDestroySpatialReference(crs);
        crs = NULL;
    }
    if (crs != NULL) {
        OSRSetAxisMappingStrategy(crs, OAMS_TRADITIONAL_GIS_ORDER);
    }
    return crs;
}

bool vd_crs_same(OGRSpatialReferenceH a, OGRSpatialReferenceH b) {
    static const char *const options[] = {"CRITERION=EQUIVALENT_EXCEPT_AXIS_ORDER_GEOGCRS",
                                          "IGNORE_DATA_AXIS_TO_SRS_AXIS_MAPPING=YES", NULL};
    return a != NULL && b != NULL && OSRIsSameEx(a, b, options);
}

/* Writes the authority code when it means the same CRS (files carry codes beside parameters that
 * contradict them), else WKT; empty when neither fits. */
static void name_crs(OGRSpatialReferenceH crs, char *out, size_t out_bytes) {
    const char *authority = OSRGetAuthorityName(crs, NULL);
    const char *code = OSRGetAuthorityCode(crs, NULL);
    out[0] = '\0';
    if (authority != NULL && code != NULL) {
        char name[64];
        (void)snprintf(name, sizeof name, "%s:%s", authority, code);
        OGRSpatialReferenceH check = vd_crs_open(name);
        bool same = vd_crs_same(crs, check);
        OSRDestroySpatialReference(check);
        if (same) {
            (void)snprintf(out, out_bytes, "%s", name);
            return;
        }
    }
    static const char *const options[] = {"FORMAT=WKT2_2018", "MULTILINE=NO", NULL};
    char *wkt = NULL;
    if (OSRExportToWktEx(crs, &wkt, options) == OGRERR_NONE && wkt != NULL &&
        strlen(wkt) < out_bytes) {
        (void)snprintf(out, out_bytes, "%s", wkt);
    }
    CPLFree(wkt);
}

/* ---- bounds
 * --------------------------------------------------------------------------------------- */

vd_bounds vd_bounds_union(vd_bounds a, vd_bounds b) {
    vd_bounds out = {a.x0 < b.x0 ? a.x0 : b.x0, a.y0 < b.y0 ? a.y0 : b.y0,
                     a.x1 > b.x1 ? a.x1 : b.x1, a.y1 > b.y1 ? a.y1 : b.y1};
    return out;
}

vd_bounds vd_bounds_intersection(vd_bounds a, vd_bounds b) {
    vd_bounds out = {a.x0 > b.x0 ? a.x0 : b.x0, a.y0 > b.y0 ? a.y0 : b.y0,
                     a.x1 < b.x1 ? a.x1 : b.x1, a.y1 < b.y1 ? a.y1 : b.y1};
    return out;
}

bool vd_bounds_empty(vd_bounds a) {
    return !(a.x1 > a.x0 && a.y1 > a.y0);
}

vd_bounds vd_bounds_of_grid(const double corner[6], double width, double height) {
    vd_bounds out = {corner[0], corner[3], corner[0], corner[3]};
    for (int i = 1; i < 4; i++) {
        double column = i & 1 ? width : 0.0, row = i & 2 ? height : 0.0;
        double x = corner[0] + column * corner[1] + row * corner[2];
        double y = corner[3] + column * corner[4] + row * corner[5];
        vd_bounds point = {x, y, x, y};
        out = vd_bounds_union(out, point);
    }
    return out;
}

bool vd_bounds_transform(vd_bounds in, OGRSpatialReferenceH from, OGRSpatialReferenceH to,
                         vd_bounds *out) {
    OGRCoordinateTransformationH transform = OCTNewCoordinateTransformation(from, to);
    vd_bounds b = in;
    /* 21 points a side: PROJ's own choice for edges that bend. */
    bool done = transform != NULL && OCTTransformBounds(transform, in.x0, in.y0, in.x1, in.y1,
                                                        &b.x0, &b.y0, &b.x1, &b.y1, 21);
    OCTDestroyCoordinateTransformation(transform);
    if (!done || !isfinite(b.x0) || !isfinite(b.y0) || !isfinite(b.x1) || !isfinite(b.y1)) {
        return false;
    }
    if (OSRIsGeographic(to) && b.x1 < b.x0) {
        b.x1 += 360.0; /* PROJ's way to say that it crosses the date line */
    }
    *out = b;
    return true;
}

void vd_dem_corner_transform(const vd_dem *dem, double corner[6]) {
    memcpy(corner, dem->transform, sizeof dem->transform);
    corner[0] -= 0.5 * (corner[1] + corner[2]);
    corner[3] -= 0.5 * (corner[4] + corner[5]);
}

/* ---- ground scale
 * -------------------------------------------------------------------------------- */

/* Metres per degree of longitude and latitude, by the same rule as everywhere (dem.h). */
static vd_placement degree_metres(double lon, double lat) {
    vd_dem point = {.width = 1,
                    .height = 1,
                    .kind = VD_CRS_GEOGRAPHIC,
                    .transform = {lon, 1.0, 0.0, lat, 0.0, -1.0},
                    .crs_unit_m = 1.0};
    return vd_dem_placement(&point);
}

static double ground_length(double lon0, double lat0, double lon1, double lat1) {
    vd_placement metres = degree_metres(lon0, lat0);
    double turn = lon1 - lon0;
    turn -= 360.0 * floor((turn + 180.0) / 360.0);
    double east = turn * metres.scale_x, north = (lat1 - lat0) * metres.scale_y;
    return sqrt(east * east + north * north);
}

double vd_crs_ground_scale(OGRSpatialReferenceH crs, double x, double y, double crs_unit_m) {
    OGRSpatialReferenceH geographic = vd_crs_open("EPSG:4326");
    OGRCoordinateTransformationH transform =
        geographic != NULL && crs != NULL ? OCTNewCoordinateTransformation(crs, geographic) : NULL;
    double scale = 1.0;
    if (transform != NULL) {
        const double step =
            100.0 / crs_unit_m; /* 100 m: long against rounding, short against Earth */
        double lon[3] = {x, x + step, x}, lat[3] = {y, y, y + step};
        if (OCTTransform(transform, 3, lon, lat, NULL)) {
            double area = ground_length(lon[0], lat[0], lon[1], lat[1]) *
                          ground_length(lon[0], lat[0], lon[2], lat[2]);
            double mean = sqrt(area) / 100.0;
            if (isfinite(mean) && mean > 1e-3 && mean < 1e3) {
                /* PROJ's last bits differ between builds; a picture must not. */
                scale = floor(mean * 1048576.0 + 0.5) / 1048576.0;
            }
        }
        OCTDestroyCoordinateTransformation(transform);
    }
    OSRDestroySpatialReference(geographic);
    return scale;
}

/* ---- a dataset's georeference
 * -------------------------------------------------------------------- */

/* Gets the geotransform and the CRS it belongs to (GDAL's, not owned; may be null). Ground control
 * points that lie exactly on an affine grid count as one. False when the file has none. */
static bool dataset_transform(GDALDatasetH dataset, double out[6], OGRSpatialReferenceH *crs) {
    static const double none[6] = {0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
    *crs = GDALGetSpatialRef(dataset);
    if (GDALGetGeoTransform(dataset, out) == CE_None) {
        /* Some drivers report "no georeference" as the identity, in either row direction. */
        double magnitude[6];
        memcpy(magnitude, out, sizeof magnitude);
        magnitude[5] = fabs(out[5]);
        return *crs != NULL || memcmp(magnitude, none, sizeof none) != 0;
    }
    int count = GDALGetGCPCount(dataset);
    if (count >= 3 && GDALGCPsToGeoTransform(count, GDALGetGCPs(dataset), out, FALSE)) {
        *crs = GDALGetGCPSpatialRef(dataset);
        return true;
    }
    memcpy(out, none, sizeof none);
    return false;
}

bool vd_georef_needs_warp(GDALDatasetH dataset) {
    double transform[6];
    OGRSpatialReferenceH crs = NULL;
    if (dataset_transform(dataset, transform, &crs)) {
        return crs != NULL && OSRIsDerivedGeographic(crs);
    }
    return GDALGetGCPCount(dataset) > 0 || GDALGetMetadata(dataset, "RPC") != NULL ||
           GDALGetMetadata(dataset, "GEOLOCATION") != NULL;
}

GDALDatasetH vd_georef_straighten(vd_gdal_session *session, GDALDatasetH dataset,
                                  const char *path) {
    if (!vd_georef_needs_warp(dataset)) {
        return dataset;
    }
    const char *arguments[12] = {"-of", "VRT", "-r", "bilinear"};
    int n = 4, has_nodata = FALSE;
    (void)GDALGetRasterNoDataValue(GDALGetRasterBand(dataset, 1), &has_nodata);
    if (!has_nodata) {
        arguments[n++] = "-dstalpha"; /* what lies outside the source must not become height 0 */
    }
    OGRSpatialReferenceH crs = GDALGetSpatialRef(dataset);
    if (crs != NULL && OSRIsDerivedGeographic(crs)) {
        arguments[n++] = "-t_srs";
        arguments[n++] = "EPSG:4326";
    }
    vd_gdal_clear(session);
    GDALDatasetH warped = vd_gdal_warp(dataset, arguments);
    if (warped == NULL) {
        vd_gdal_log(session, VD_LOG_WARNING,
                    "%s: its control points cannot be used (%s), so it counts as not georeferenced",
                    path, session->message);
        vd_gdal_clear(session);
        return dataset;
    }
    vd_gdal_log(
        session, VD_LOG_INFO,
        "%s: warped to a north-up grid from its control points, sensor model or rotated pole",
        path);
    return warped;
}

/* Without a CRS, small coordinates with small cells can only be degrees. */
static bool looks_geographic(GDALDatasetH dataset, const double t[6]) {
    vd_bounds b = vd_bounds_of_grid(t, GDALGetRasterXSize(dataset), GDALGetRasterYSize(dataset));
    double cell = sqrt(fabs(t[1] * t[5] - t[2] * t[4]));
    /* A cell of grace: global grids of points stand over the poles by half of one. */
    return b.x0 >= -360.0 - cell && b.x1 <= 360.0 + cell && b.y0 >= -90.0 - cell &&
           b.y1 <= 90.0 + cell && cell < 0.1;
}

static void scale_transform(double t[6], double factor) {
    for (int i = 0; i < 6; i++) {
        t[i] *= factor;
    }
}

/* Fills kind, units and name for a file that names its CRS. */
static void classify_named(vd_georef *out, OGRSpatialReferenceH given) {
    out->crs = OSRClone(given);
    if (OSRIsCompound(out->crs)) {
        out->height_unit_m = OSRGetTargetLinearUnits(out->crs, "VERT_CS", NULL);
    }
    (void)OSRStripVertical(out->crs);
    (void)OSRDemoteTo2D(out->crs, NULL);
    OSRSetAxisMappingStrategy(out->crs, OAMS_TRADITIONAL_GIS_ORDER);
    if (OSRIsLocal(out->crs)) {
        out->kind = VD_CRS_NONE;
        double unit = OSRGetLinearUnits(out->crs, NULL);
        scale_transform(out->corner, isfinite(unit) && unit > 0.0 ? unit : 1.0);
        OSRDestroySpatialReference(out->crs);
        out->crs = NULL;
        return;
    }
    if (OSRIsGeographic(out->crs)) {
        out->kind = VD_CRS_GEOGRAPHIC;
        double unit_rad = OSRGetAngularUnits(out->crs, NULL);
        if (unit_rad > 0.0 && fabs(unit_rad / DEGREE_RAD - 1.0) > 1e-9) {
            scale_transform(out->corner, unit_rad / DEGREE_RAD);
            (void)OSRSetAngularUnits(out->crs, SRS_UA_DEGREE, DEGREE_RAD);
        }
    } else {
        out->kind = VD_CRS_PROJECTED;
        double unit = OSRGetLinearUnits(out->crs, NULL);
        out->crs_unit_m = isfinite(unit) && unit > 0.0 ? unit : 1.0;
    }
    name_crs(out->crs, out->name, sizeof out->name);
}

/* The same for a file that has a geotransform but does not say of what. */
static void classify_unnamed(vd_gdal_session *session, GDALDatasetH dataset, const char *path,
                             vd_georef *out) {
    if (looks_geographic(dataset, out->corner)) {
        vd_gdal_log(
            session, VD_LOG_WARNING,
            "%s: it names no CRS; its coordinates look like degrees and are taken as longitude "
            "and latitude (EPSG:4326)",
            path);
        out->kind = VD_CRS_GEOGRAPHIC;
        out->crs = vd_crs_open("EPSG:4326");
        (void)snprintf(out->name, sizeof out->name, "EPSG:4326");
        return;
    }
    vd_gdal_log(session, VD_LOG_WARNING, "%s: it names no CRS; its coordinates are taken as metres",
                path);
    out->kind = VD_CRS_PROJECTED;
}

vd_status vd_georef_init(vd_gdal_session *session, GDALDatasetH dataset, const char *path,
                         vd_georef *out) {
    vd_georef georef = {.kind = VD_CRS_NONE, .crs_unit_m = 1.0};
    OGRSpatialReferenceH given = NULL;
    georef.placed = dataset_transform(dataset, georef.corner, &given);
    if (!georef.placed) {
        /* Nothing said: samples at whole numbers, row 0 at the north (dem.h). */
        static const double samples[6] = {-0.5, 1.0, 0.0, 0.5, 0.0, -1.0};
        memcpy(georef.corner, samples, sizeof samples);
        *out = georef;
        return vd_success();
    }
    double area = georef.corner[1] * georef.corner[5] - georef.corner[2] * georef.corner[4];
    bool sound = isfinite(georef.corner[0]) && isfinite(georef.corner[3]);
    if (!sound || !isfinite(area) || area == 0.0) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %s: its geotransform (%g, %g, %g, %g, %g, %g) has no area; "
                          "repair it with gdal_edit.py -a_ullr",
                          path, georef.corner[0], georef.corner[1], georef.corner[2],
                          georef.corner[3], georef.corner[4], georef.corner[5]);
    }
    if (given != NULL && (OSRIsCompound(given) || !OSRIsVertical(given))) {
        classify_named(&georef, given);
    } else {
        classify_unnamed(session, dataset, path, &georef);
    }
    *out = georef;
    return vd_success();
}

void vd_georef_finish(vd_georef *georef) {
    OSRDestroySpatialReference(georef->crs);
    georef->crs = NULL;
}

/* ---- points -------------------------------------------------------------------------------------
 */

/* Transforms one point between WGS 84 longitude, latitude and `crs`. */
static vd_status convert_point(vd_context *context, const char *crs, bool to_lonlat, double *x,
                               double *y) {
    vd_gdal_session session;
    vd_gdal_begin(&session, context);
    vd_status status = vd_success();
    OGRSpatialReferenceH lonlat = vd_crs_open("EPSG:4326");
    OGRSpatialReferenceH other = vd_crs_open(crs);
    OGRCoordinateTransformationH transform = NULL;
    if (other == NULL || lonlat == NULL) {
        status = vd_failure(VD_ERROR_ARGUMENT,
                            "cannot use the coordinate reference system %.80s: PROJ does not know "
                            "it; give WKT or a code such as EPSG:4326",
                            crs != NULL ? crs : "(none)");
    } else {
        transform = to_lonlat ? OCTNewCoordinateTransformation(other, lonlat)
                              : OCTNewCoordinateTransformation(lonlat, other);
        double px = *x, py = *y;
        if (transform == NULL || !isfinite(px) || !isfinite(py) ||
            !OCTTransform(transform, 1, &px, &py, NULL) || !isfinite(px) || !isfinite(py)) {
            status =
                vd_failure(VD_ERROR_ARGUMENT,
                           "cannot convert the position %.10g, %.10g %s %.80s: it lies outside "
                           "what the projection covers; check the order of the two numbers",
                           *x, *y, to_lonlat ? "from" : "to", crs);
        } else {
            *x = px;
            *y = py;
        }
    }
    OCTDestroyCoordinateTransformation(transform);
    OSRDestroySpatialReference(other);
    OSRDestroySpatialReference(lonlat);
    vd_gdal_end(&session);
    return status;
}

vd_status vd_geo_from_lonlat(vd_context *context, const char *crs, double lon, double lat,
                             double *x, double *y) {
    double px = lon, py = lat;
    vd_status status = convert_point(context, crs, false, &px, &py);
    if (status.code == VD_OK) {
        *x = px;
        *y = py;
    }
    return status;
}

vd_status vd_geo_to_lonlat(vd_context *context, const char *crs, double x, double y, double *lon,
                           double *lat) {
    double px = x, py = y;
    vd_status status = convert_point(context, crs, true, &px, &py);
    if (status.code == VD_OK) {
        *lon = px;
        *lat = py;
    }
    return status;
}
