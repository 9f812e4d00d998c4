/* geo_spread.c: see geo_spread.h. */
#include "geo/geo_spread.h"

#include <math.h>

/* As in dem_mosaic.c: tiles of one size that touch each other need at most 1 per raster. */
static const double sparseness_per_raster = 32.0;

static double area_of(vd_bounds b) {
    return (b.x1 - b.x0) * (b.y1 - b.y0);
}

double vd_spread_add(vd_spread *spread, vd_bounds b) {
    if (spread->count == 0) {
        spread->first = spread->all = b;
    }
    const vd_bounds *first = &spread->first;
    double east = 0.5 * (b.x0 + b.x1 - first->x0 - first->x1);
    double north = 0.5 * (b.y0 + b.y1 - first->y0 - first->y1);
    double turn = spread->geographic ? -360.0 * floor(east / 360.0 + 0.5) : 0.0;
    b.x0 += turn;
    b.x1 += turn;
    east += turn;
    double distance = east * east + north * north;
    if (distance > spread->distance) {
        spread->distance = distance;
        spread->farthest = spread->count;
    }
    spread->all = vd_bounds_union(spread->all, b);
    spread->area += area_of(b);
    spread->count++;
    return turn;
}

vd_status vd_spread_check(const vd_spread *spread, const char *const *paths) {
    double sparseness = area_of(spread->all) / spread->area;
    if (sparseness <= sparseness_per_raster * spread->count) {
        return vd_success();
    }
    return vd_failure(VD_ERROR_LIMIT,
                      "cannot join %.150s with %.150s: they lie far apart, in a rectangle %.0f "
                      "times as large as all that is given; render them one by one",
                      paths[spread->farthest], paths[0], sparseness);
}

/* ---- survey -------------------------------------------------------------------------------------
 */

typedef struct survey {
    vd_gdal_session *session;
    vd_spread spread;
    OGRSpatialReferenceH crs; /* of the first; owned; may be null */
    double cell_x, cell_y;    /* of the first, in CRS units */
} survey;

/* Adds an open raster; false when this needs more than a look. *extent is its longer side in cells
 * of the first. */
static bool add_dataset(survey *s, GDALDatasetH dataset, const char *path, double *extent) {
    vd_georef georef = {.crs = NULL};
    if (vd_georef_needs_warp(dataset) ||
        vd_georef_init(s->session, dataset, path, &georef).code != VD_OK) {
        return false;
    }
    const double *t = georef.corner;
    vd_bounds b = vd_bounds_of_grid(t, GDALGetRasterXSize(dataset), GDALGetRasterYSize(dataset));
    bool known = georef.kind != VD_CRS_NONE;
    if (s->spread.count == 0) {
        s->spread.geographic = georef.kind == VD_CRS_GEOGRAPHIC;
        s->crs = georef.crs != NULL ? OSRClone(georef.crs) : NULL;
        s->cell_x = sqrt(t[1] * t[1] + t[4] * t[4]);
        s->cell_y = sqrt(t[2] * t[2] + t[5] * t[5]);
    } else if (georef.crs == NULL || s->crs == NULL) {
        known = known && georef.crs == s->crs;
    } else if (!vd_crs_same(georef.crs, s->crs)) {
        known = known && vd_bounds_transform(b, georef.crs, s->crs, &b);
    }
    if (known) {
        double columns = (b.x1 - b.x0) / s->cell_x, rows = (b.y1 - b.y0) / s->cell_y;
        *extent = columns > rows ? columns : rows;
        (void)vd_spread_add(&s->spread, b);
    }
    vd_georef_finish(&georef);
    return known;
}

static bool add_path(survey *s, const char *path, double *extent) {
    GDALDatasetH dataset = NULL;
    if (vd_gdal_open(s->session, path, &dataset).code != VD_OK) {
        return false;
    }
    bool known = add_dataset(s, dataset, path, extent);
    GDALClose(dataset);
    return known;
}

/* The side at which a raster is read when everything is reduced by a factor. */
static int reduced_side(double extent, double reduction, int max_side) {
    /* A millionth of a sample is rounding: tiles of one size must stay so. */
    double side = ceil(extent / reduction - 1e-6);
    return side < 1.0 ? 1 : (side > max_side ? max_side : (int)side);
}

vd_status vd_geo_survey(vd_gdal_session *session, const char *const *paths, int count, int max_side,
                        int *sides) {
    double *extents = vd_allocate(session->context, (size_t)count, sizeof *extents);
    if (extents == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory: the extents of %d files; free memory",
                          count);
    }
    survey s = {.session = session, .cell_x = 1.0, .cell_y = 1.0};
    bool known = true, was_quiet = session->quiet;
    session->quiet = true; /* what there is to say about a file, reading it says */
    for (int i = 0; i < count && known; i++) {
        known = add_path(&s, paths[i], &extents[i]);
    }
    session->quiet = was_quiet;
    OSRDestroySpatialReference(s.crs);
    vd_gdal_clear(session);
    const vd_bounds *all = &s.spread.all;
    double columns = (all->x1 - all->x0) / s.cell_x, rows = (all->y1 - all->y0) / s.cell_y;
    double reduction = (columns > rows ? columns : rows) / max_side;
    for (int i = 0; i < count; i++) {
        sides[i] =
            known && reduction > 1.0 ? reduced_side(extents[i], reduction, max_side) : max_side;
    }
    vd_release(session->context, extents);
    return known ? vd_spread_check(&s.spread, paths) : vd_success();
}
