/* geo_features.c: points, lines and polygons of vector files.
 *
 * OGR gives a tree of geometries for each feature of each layer; here all becomes flat arrays of
 * features, parts and points in one coordinate reference system. Layers of GPX that repeat others
 * point by point (route_points, track_points) are left out.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <veduta/geo.h>
#include "geo/geo_crs.h"

#define MAX_POINTS 10000000u
#define PATH_SHOWN 200 /* bytes of a path in a sentence that says more */

/* A layer while it is read. */
typedef struct layer {
    OGRLayerH handle;
    bool opened, left_out;
    OGRCoordinateTransformationH transform; /* null: coordinates stay as they are */
    bool unnamed;                           /* it names no CRS: coordinates must be degrees */
    double height_unit_m;
    int name_field; /* −1: none */
} layer;

typedef struct reader {
    vd_gdal_session session;
    vd_context *context;
    const char *path;
    const vd_geo_features_def *def;
    GDALDatasetH dataset;
    OGRSpatialReferenceH target;
    bool degrees; /* the target is longitude and latitude */
    size_t max_points;
    bool name_found;
    layer *layers;
    int layer_count;
    uint64_t skipped; /* features without a geometry of ours */
    vd_features *out;
    size_t feature_room, part_room, point_room, name_room;
    const layer *layer; /* of the feature that is being read */
    size_t name;
} reader;

vd_geo_features_def vd_geo_features_def_default(void) {
    vd_geo_features_def def;
    memset(&def, 0, sizeof def);
    return def;
}

void vd_features_destroy(vd_features **features) {
    vd_features *f = *features;
    if (f != NULL) {
        vd_release(f->context, f->features);
        vd_release(f->context, f->parts);
        vd_release(f->context, f->points);
        vd_release(f->context, f->names);
        vd_release(f->context, f);
        *features = NULL;
    }
}

static vd_status out_of_memory(size_t size_bytes) {
    return vd_failure(VD_ERROR_MEMORY,
                      "out of memory: the features of a vector file take %zu bytes more; free "
                      "memory or read fewer",
                      size_bytes);
}

/* ---- arrays that grow ------------------------------------------------------------------------ */

/* Makes room for `more` elements behind `used` in the array that the pointer at `array` leads to.
 */
static vd_status grow(vd_context *context, void *array, size_t *room, size_t used, size_t more,
                      size_t size_bytes) {
    if (more <= *room - used) {
        return vd_success();
    }
    size_t wanted = *room < 64 ? 64 : *room + *room / 2;
    wanted = wanted < used + more ? used + more : wanted;
    void *larger = vd_allocate(context, wanted, size_bytes), *old;
    if (larger == NULL) {
        return out_of_memory(wanted * size_bytes);
    }
    memcpy(&old, array, sizeof old);
    if (used > 0) {
        memcpy(larger, old, used * size_bytes);
    }
    vd_release(context, old);
    memcpy(array, &larger, sizeof larger);
    *room = wanted;
    return vd_success();
}

#define GROW(r, field, room, used, more)                                                           \
    grow((r)->context, &(r)->out->field, &(r)->room, used, more, sizeof *(r)->out->field)

static vd_status add_feature(reader *r, vd_feature_kind kind) {
    vd_features *f = r->out;
    const vd_status status = GROW(r, features, feature_room, f->count, 1);
    if (status.code == VD_OK) {
        f->features[f->count++] =
            (vd_feature){.kind = kind, .first_part = f->part_count, .name = r->name};
    }
    return status;
}

/* Keeps the name for the features to come: those of one record share its bytes. */
static vd_status add_name(reader *r, const char *name) {
    vd_features *f = r->out;
    r->name = 0;
    if (name == NULL || name[0] == '\0') {
        return vd_success();
    }
    char *ascii = CPLIsUTF8(name, -1) ? NULL : CPLForceToASCII(name, -1, '?');
    const char *text = ascii != NULL ? ascii : name;
    const size_t bytes = strlen(text) + 1;
    const vd_status status = GROW(r, names, name_room, f->name_bytes, bytes);
    if (status.code == VD_OK) {
        memcpy(f->names + f->name_bytes, text, bytes);
        r->name = f->name_bytes;
        f->name_bytes += bytes;
    }
    CPLFree(ascii);
    return status;
}

/* ---- geometries ------------------------------------------------------------------------------ */

static vd_status check_point(const reader *r, const double p[3]) {
    if (!isfinite(p[0]) || !isfinite(p[1])) {
        return vd_failure(
            VD_ERROR_FORMAT,
            "cannot read %.*s: feature %zu has a coordinate that is no number; repair "
            "or remove it",
            PATH_SHOWN, r->path, r->out->count);
    }
    if (r->degrees && !(fabs(p[1]) <= 90.0 + 1e-9 && fabs(p[0]) <= 360.0 + 1e-9)) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %.*s: feature %zu has the longitude %.10g and the latitude "
                          "%.10g, which is nowhere; check the order of the two, or the file's CRS",
                          PATH_SHOWN, r->path, r->out->count, p[0], p[1]);
    }
    return vd_success();
}

/* Adds a part to the last feature. */
static vd_status add_part(reader *r, OGRGeometryH g) {
    vd_features *f = r->out;
    const size_t count = (size_t)OGR_G_GetPointCount(g);
    if (count > r->max_points - f->point_count) {
        return vd_failure(VD_ERROR_LIMIT,
                          "cannot read %.*s: it has more than %zu points; simplify it, with "
                          "ogr2ogr -simplify for one, or raise the limit",
                          PATH_SHOWN, r->path, r->max_points);
    }
    vd_status status = GROW(r, points, point_room, f->point_count, count);
    if (status.code == VD_OK) {
        status = GROW(r, parts, part_room, f->part_count, 2);
    }
    if (status.code != VD_OK) {
        return status;
    }
    double(*p)[3] = f->points + f->point_count;
    for (size_t i = 0; i < count; i++) {
        OGR_G_GetPoint(g, (int)i, &p[i][0], &p[i][1], &p[i][2]);
        p[i][2] = OGR_G_Is3D(g) ? p[i][2] * r->layer->height_unit_m : 0.0;
        status = check_point(r, p[i]);
        if (status.code != VD_OK) {
            return status;
        }
    }
    f->parts[f->part_count++] = f->point_count;
    f->features[f->count - 1].part_count++;
    f->point_count += count;
    f->parts[f->part_count] = f->point_count;
    return status;
}

/* Decides whether the last feature has heights: one that is not 0, and none that is no number. */
static void settle_heights(vd_features *f) {
    vd_feature *last = &f->features[f->count - 1];
    const size_t from = f->parts[last->first_part];
    bool sound = true, some = false;
    for (size_t i = from; i < f->point_count; i++) {
        sound = sound && isfinite(f->points[i][2]);
        some = some || f->points[i][2] != 0.0;
    }
    last->has_z = sound && some;
    for (size_t i = from; i < f->point_count && !last->has_z; i++) {
        f->points[i][2] = 0.0;
    }
}

static vd_status add_one(reader *r, vd_feature_kind kind, OGRGeometryH g) {
    vd_status status = add_feature(r, kind);
    if (status.code == VD_OK) {
        status = add_part(r, g);
    }
    if (status.code == VD_OK) {
        settle_heights(r->out);
    }
    return status;
}

/* A line, or the lines of a multiline: those of two points and more are parts of one feature, the
 * others points of their own. */
static vd_status add_lines(reader *r, OGRGeometryH g) {
    const bool multi = wkbFlatten(OGR_G_GetGeometryType(g)) == wkbMultiLineString;
    const int count = multi ? OGR_G_GetGeometryCount(g) : 1;
    bool begun = false;
    vd_status status = vd_success();
    for (int i = 0; status.code == VD_OK && i < count; i++) {
        OGRGeometryH line = multi ? OGR_G_GetGeometryRef(g, i) : g;
        if (OGR_G_GetPointCount(line) < 2) {
            continue;
        }
        status = begun ? vd_success() : add_feature(r, VD_FEATURE_LINE);
        begun = true;
        if (status.code == VD_OK) {
            status = add_part(r, line);
        }
    }
    if (status.code == VD_OK && begun) {
        settle_heights(r->out);
    }
    for (int i = 0; status.code == VD_OK && i < count; i++) {
        OGRGeometryH line = multi ? OGR_G_GetGeometryRef(g, i) : g;
        if (OGR_G_GetPointCount(line) == 1) {
            status = add_one(r, VD_FEATURE_POINT, line);
        }
    }
    return status;
}

static vd_status add_polygon(reader *r, OGRGeometryH g) {
    bool begun = false;
    vd_status status = vd_success();
    OGR_G_CloseRings(g);
    for (int i = 0; status.code == VD_OK && i < OGR_G_GetGeometryCount(g); i++) {
        OGRGeometryH ring = OGR_G_GetGeometryRef(g, i);
        if (OGR_G_GetPointCount(ring) < 4) {
            if (i == 0) {
                break; /* no outline */
            }
            continue;
        }
        status = begun ? vd_success() : add_feature(r, VD_FEATURE_POLYGON);
        begun = true;
        if (status.code == VD_OK) {
            status = add_part(r, ring);
        }
    }
    if (status.code == VD_OK && begun) {
        settle_heights(r->out);
    }
    return status;
}

/* Adds a geometry that has no curves. Collections hold collections: they are walked to a depth that
 * no honest file has. */
static vd_status add_geometry(reader *r, OGRGeometryH g, int depth) {
    if (OGR_G_IsEmpty(g)) {
        return vd_success();
    }
    switch (wkbFlatten(OGR_G_GetGeometryType(g))) {
    case wkbPoint:
        return add_one(r, VD_FEATURE_POINT, g);
    case wkbLineString:
    case wkbMultiLineString:
        return add_lines(r, g);
    case wkbPolygon:
    case wkbTriangle:
        return add_polygon(r, g);
    default:
        break;
    }
    vd_status status = vd_success();
    for (int i = 0; status.code == VD_OK && depth < 16 && i < OGR_G_GetGeometryCount(g); i++) {
        status = add_geometry(r, OGR_G_GetGeometryRef(g, i), depth + 1);
    }
    return status;
}

/* ---- layers ---------------------------------------------------------------------------------- */

static int find_name_field(const reader *r, OGRFeatureDefnH definition) {
    static const char *const usual[] = {"name", "title", "label"};
    if (r->def->name_field != NULL) {
        return OGR_FD_GetFieldIndex(definition, r->def->name_field);
    }
    int field = -1; /* case does not count */
    for (size_t i = 0; field < 0 && i < sizeof usual / sizeof usual[0]; i++) {
        field = OGR_FD_GetFieldIndex(definition, usual[i]);
    }
    return field;
}

static bool can_be_degrees(OGRLayerH handle) {
    OGREnvelope e;
    return OGR_L_GetExtent(handle, &e, TRUE) != OGRERR_NONE ||
           (e.MinX >= -360.0 && e.MaxX <= 360.0 && e.MinY >= -90.0 && e.MaxY <= 90.0);
}

/* Makes the way from a layer's CRS to the target. */
static vd_status find_transform(reader *r, layer *l) {
    OGRSpatialReferenceH given = OGR_L_GetSpatialRef(l->handle);
    l->height_unit_m = 1.0;
    l->unnamed = given == NULL;
    OGRSpatialReferenceH from = NULL;
    if (given != NULL) {
        from = OSRClone(given);
        if (OSRIsCompound(from)) {
            const double unit = OSRGetTargetLinearUnits(from, "VERT_CS", NULL);
            l->height_unit_m = isfinite(unit) && unit > 0.0 ? unit : 1.0;
        }
        (void)OSRStripVertical(from);
        (void)OSRDemoteTo2D(from, NULL);
        OSRSetAxisMappingStrategy(from, OAMS_TRADITIONAL_GIS_ORDER);
    } else if (can_be_degrees(l->handle)) {
        vd_gdal_log(
            &r->session, VD_LOG_WARNING,
            "%s: layer %s names no CRS; its coordinates are taken as longitude and latitude",
            r->path, OGR_L_GetName(l->handle));
        from = vd_crs_open("EPSG:4326");
    } else if (!r->degrees) {
        vd_gdal_log(&r->session, VD_LOG_WARNING,
                    "%s: layer %s names no CRS; its coordinates are taken as they are wanted",
                    r->path, OGR_L_GetName(l->handle));
        return vd_success();
    } else {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %.*s: it names no coordinate reference system, and its "
                          "coordinates are not degrees; set one, with ogr2ogr -a_srs",
                          PATH_SHOWN, r->path);
    }
    vd_status status = vd_success();
    if (!vd_crs_same(from, r->target)) {
        l->transform = OCTNewCoordinateTransformation(from, r->target);
        if (l->transform == NULL) {
            status = vd_gdal_failure(&r->session, VD_ERROR_FORMAT, r->path,
                                     "its CRS cannot be converted", "convert it with ogr2ogr");
        }
    }
    OSRDestroySpatialReference(from);
    return status;
}

static vd_status open_layer(reader *r, layer *l) {
    OGRFeatureDefnH definition = OGR_L_GetLayerDefn(l->handle);
    const char *driver = GDALGetDriverShortName(GDALGetDatasetDriver(r->dataset));
    const char *name = OGR_L_GetName(l->handle);
    l->left_out = strcmp(driver, "GPX") == 0 &&
                  (strcmp(name, "route_points") == 0 || strcmp(name, "track_points") == 0);
    l->name_field = find_name_field(r, definition);
    r->name_found = r->name_found || (l->name_field >= 0 && !l->left_out);
    const bool no_geometry = OGR_FD_GetGeomFieldCount(definition) == 0;
    l->left_out = l->left_out || no_geometry;
    l->opened = true;
    return l->left_out ? vd_success() : find_transform(r, l);
}

/* Fails when a property was asked for that no layer has. */
static vd_status check_name_field(const reader *r) {
    if (r->def->name_field == NULL || r->name_found) {
        return vd_success();
    }
    char names[160] = "";
    size_t used = 0;
    for (int i = 0; i < r->layer_count; i++) {
        OGRFeatureDefnH definition = OGR_L_GetLayerDefn(r->layers[i].handle);
        for (int k = 0; !r->layers[i].left_out && k < OGR_FD_GetFieldCount(definition); k++) {
            const char *name = OGR_Fld_GetNameRef(OGR_FD_GetFieldDefn(definition, k));
            if (used + strlen(name) + 3 < sizeof names) {
                used += (size_t)snprintf(names + used, sizeof names - used, "%s%s",
                                         used > 0 ? ", " : "", name);
            }
        }
    }
    return vd_failure(VD_ERROR_ARGUMENT, "%.120s has no property %.40s; it has %s", r->path,
                      r->def->name_field, used > 0 ? names : "none");
}

static vd_status open_layers(reader *r) {
    r->layer_count = GDALDatasetGetLayerCount(r->dataset);
    r->layers = vd_allocate(r->context, (size_t)r->layer_count, sizeof *r->layers);
    if (r->layers == NULL) {
        const size_t count = (size_t)r->layer_count;
        r->layer_count = 0;
        return out_of_memory(count * sizeof *r->layers);
    }
    memset(r->layers, 0, (size_t)r->layer_count * sizeof *r->layers);
    vd_status status = vd_success();
    for (int i = 0; status.code == VD_OK && i < r->layer_count; i++) {
        r->layers[i].handle = GDALDatasetGetLayer(r->dataset, i);
        status = open_layer(r, &r->layers[i]);
    }
    return status.code == VD_OK ? check_name_field(r) : status;
}

/* ---- reading --------------------------------------------------------------------------------- */

static vd_status add_record(reader *r, OGRFeatureH record) {
    OGRGeometryH g = OGR_F_GetGeometryRef(record);
    if (g == NULL || OGR_G_IsEmpty(g)) {
        r->skipped++;
        return vd_success();
    }
    OGRGeometryH linear =
        OGR_G_HasCurveGeometry(g, FALSE) ? OGR_G_GetLinearGeometry(g, 0.0, NULL) : OGR_G_Clone(g);
    if (linear == NULL) {
        return out_of_memory((size_t)OGR_G_WkbSize(g));
    }
    const layer *l = r->layer;
    vd_status status = vd_success();
    if (l->transform != NULL && OGR_G_Transform(linear, l->transform) != OGRERR_NONE) {
        status = vd_gdal_failure(&r->session, VD_ERROR_FORMAT, r->path,
                                 "a position of it lies outside what the projection covers",
                                 "check the file's CRS");
    }
    if (status.code == VD_OK) {
        const bool named = l->name_field >= 0 && OGR_F_IsFieldSetAndNotNull(record, l->name_field);
        status = add_name(r, named ? OGR_F_GetFieldAsString(record, l->name_field) : NULL);
    }
    if (status.code == VD_OK) {
        status = add_geometry(r, linear, 0);
    }
    OGR_G_DestroyGeometry(linear);
    return status;
}

static const layer *layer_of(const reader *r, OGRLayerH handle) {
    for (int i = 0; i < r->layer_count; i++) {
        if (r->layers[i].handle == handle) {
            return &r->layers[i];
        }
    }
    return NULL;
}

/* Reads all features of all layers, in the order that the driver gives them in (some files hold
 * several layers interleaved). */
static vd_status read_records(reader *r) {
    vd_gdal_clear(&r->session);
    GDALDatasetResetReading(r->dataset);
    vd_status status = vd_success();
    OGRLayerH handle = NULL;
    OGRFeatureH record;
    while (status.code == VD_OK &&
           (record = GDALDatasetGetNextFeature(r->dataset, &handle, NULL, NULL, NULL)) != NULL) {
        r->layer = layer_of(r, handle);
        if (r->layer != NULL && !r->layer->left_out) {
            status = add_record(r, record);
        }
        OGR_F_Destroy(record);
    }
    if (status.code == VD_OK && r->session.message[0] != '\0') {
        status = vd_gdal_failure(&r->session, VD_ERROR_FORMAT, r->path, "it is damaged",
                                 "get the file again");
    }
    if (status.code == VD_OK && r->out->count == 0) {
        status = vd_failure(VD_ERROR_EMPTY,
                            "cannot read %.*s: it holds no points, lines or polygons; give another "
                            "file",
                            PATH_SHOWN, r->path);
    }
    if (status.code == VD_OK && r->skipped > 0) {
        vd_gdal_log(&r->session, VD_LOG_INFO, "%s: %llu of its features have no place", r->path,
                    (unsigned long long)r->skipped);
    }
    return status;
}

static vd_status read_file(reader *r) {
    r->target = vd_crs_open(r->def->crs != NULL ? r->def->crs : "EPSG:4326");
    if (r->target == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "cannot use the coordinate reference system %.80s: PROJ does not know "
                          "it; give WKT or a code such as EPSG:4326",
                          r->def->crs != NULL ? r->def->crs : "EPSG:4326");
    }
    r->degrees = OSRIsGeographic(r->target);
    vd_status status = vd_gdal_open_vector(&r->session, r->path, &r->dataset);
    if (status.code == VD_OK) {
        r->out = vd_allocate(r->context, 1, sizeof *r->out);
        if (r->out == NULL) {
            return out_of_memory(sizeof *r->out);
        }
        memset(r->out, 0, sizeof *r->out);
        r->out->context = r->context;
        status = GROW(r, names, name_room, 0, 1);
    }
    if (status.code == VD_OK) {
        r->out->names[r->out->name_bytes++] = '\0';
        status = open_layers(r);
    }
    return status.code == VD_OK ? read_records(r) : status;
}

vd_status vd_geo_load_features(vd_context *context, const char *path,
                               const vd_geo_features_def *def, vd_features **out) {
    const vd_geo_features_def usual = vd_geo_features_def_default();
    reader r = {.context = context, .path = path, .def = def != NULL ? def : &usual};
    r.max_points = r.def->max_points > 0 ? r.def->max_points : MAX_POINTS;
    vd_gdal_begin(&r.session, context);
    /* Of GPX, heights are a field unless asked for; the thread's own setting leaves others alone.
     */
    const char *before = CPLGetThreadLocalConfigOption("GPX_ELE_AS_25D", NULL);
    char *kept = before != NULL ? CPLStrdup(before) : NULL;
    CPLSetThreadLocalConfigOption("GPX_ELE_AS_25D", "YES");
    const vd_status status = read_file(&r);
    CPLSetThreadLocalConfigOption("GPX_ELE_AS_25D", kept);
    CPLFree(kept);
    for (int i = 0; i < r.layer_count; i++) {
        OCTDestroyCoordinateTransformation(r.layers[i].transform);
    }
    vd_release(context, r.layers);
    if (r.dataset != NULL) {
        GDALClose(r.dataset);
    }
    OSRDestroySpatialReference(r.target);
    vd_gdal_end(&r.session);
    if (status.code == VD_OK) {
        *out = r.out;
    } else {
        vd_features_destroy(&r.out);
    }
    return status;
}
