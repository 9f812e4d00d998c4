/* scene.c: which reader reads which file, and where on Earth a scene lies. */
#include "scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "geo_module.h"

/* Reads the first bytes of a file; what cannot be read gives zeros. Standard input and pipes are
 * not touched: what is read of them is gone. */
static void read_magic(const char *path, unsigned char magic[8]) {
    struct stat info;
    memset(magic, 0, 8);
    bool regular = strcmp(path, "-") != 0 && stat(path, &info) == 0 && S_ISREG(info.st_mode);
    FILE *file = regular ? fopen(path, "rb") : NULL;
    if (file != NULL) {
        if (fread(magic, 1, 8, file) == 0) {
            memset(magic, 0, 8);
        }
        fclose(file);
    }
}

/* Names the formats that the core reads by their contents; null for others. */
static const char *picture_format(const char *path) {
    unsigned char magic[8];
    read_magic(path, magic);
    if (memcmp(magic, "\x89PNG\r\n\x1a\n", 8) == 0) {
        return "PNG";
    }
    if (magic[0] == 'P' && magic[1] >= '1' && magic[1] <= '6') {
        return magic[1] == '2' || magic[1] == '5' ? "PGM" : "PPM";
    }
    return NULL;
}

static bool is_standard_input(const char *path) {
    return strcmp(path, "-") == 0;
}

/* True when a file of georeference stands beside `path`: GDAL reads it, the core does not. */
static bool has_sidecar(const char *path) {
    static const char *const replacing[] = {".prj", ".wld", ".pgw", ".tfw", ".jgw", ".aux"};
    char name[4096];
    size_t length = strlen(path);
    if (length + 16 > sizeof name || is_standard_input(path)) {
        return false;
    }
    snprintf(name, sizeof name, "%s.aux.xml", path);
    if (access(name, R_OK) == 0) {
        return true;
    }
    const char *slash = strrchr(path, '/');
    const char *dot = strrchr(slash != NULL ? slash : path, '.');
    size_t stem = dot != NULL ? (size_t)(dot - path) : length;
    for (size_t i = 0; i < sizeof replacing / sizeof replacing[0]; i++) {
        snprintf(name, sizeof name, "%.*s%s", (int)stem, path, replacing[i]);
        if (strcmp(name, path) != 0 && access(name, R_OK) == 0) {
            return true;
        }
    }
    return false;
}

/* ---- elevation --------------------------------------------------------------------------------
 */

static vd_status load_by_geo(vd_context *context, const vd_scene_def *def, vd_dem **out,
                             char *format, size_t format_bytes) {
    char purpose[256];
    snprintf(purpose, sizeof purpose, "read %.200s", def->inputs[0]);
    vd_geo_module geo;
    vd_status status = vd_geo_module_open(purpose, &geo);
    if (status.code != VD_OK) {
        return status;
    }
    vd_geo_def how = geo.def_default();
    how.band = def->band;
    how.height_scale = def->dem.height_scale;
    how.height_offset_m = def->dem.height_offset_m;
    how.has_nodata = def->dem.has_nodata;
    how.nodata = def->dem.nodata;
    status = geo.load_dem(context, def->inputs, def->input_count, &how, out);
    if (status.code != VD_OK) {
        return status;
    }
    if (format != NULL) {
        vd_status described = geo.describe(context, def->inputs[0], format, format_bytes);
        if (described.code != VD_OK) {
            snprintf(format, format_bytes, "read by GDAL");
        }
    }
    if (def->has_cell_size && (*out)->kind == VD_CRS_NONE) {
        for (int i = 0; i < 6; i++) {
            (*out)->transform[i] *= def->dem.cell_size_m;
        }
    }
    return vd_success();
}

/* Loads all inputs by the core's readers; VD_ERROR_UNSUPPORTED when one is not theirs. */
static vd_status load_by_core(vd_context *context, const vd_scene_def *def, vd_dem **out) {
    enum { MOST = 1024 };
    vd_dem *parts[MOST];
    int count = 0;
    vd_status status = vd_success();
    if (def->input_count > MOST) {
        return vd_failure(VD_ERROR_LIMIT,
                          "%d elevation files are more than %d at once; join them "
                          "with gdalbuildvrt first",
                          def->input_count, MOST);
    }
    for (; count < def->input_count && status.code == VD_OK; count++) {
        parts[count] = NULL;
        status = vd_dem_load(context, def->inputs[count], &def->dem, &parts[count]);
    }
    if (status.code == VD_OK && count == 1) {
        *out = parts[0];
        return status;
    }
    if (status.code == VD_OK) {
        status = vd_dem_mosaic(context, (const vd_dem *const *)parts, count, out);
    }
    for (int i = 0; i < count; i++) {
        vd_dem_destroy(&parts[i]);
    }
    return status;
}

/* True when the core's readers lose something that GDAL would find. */
static bool wants_geo(const vd_scene_def *def) {
    bool stored = def->dem.raw_width > 0 || def->dem.encoding != VD_ENCODING_GREY;
    bool wants = def->band > 0;
    for (int i = 0; i < def->input_count && !wants && !stored; i++) {
        wants = has_sidecar(def->inputs[i]);
    }
    return wants && !stored;
}

vd_status vd_scene_load_dem(vd_context *context, const vd_scene_def *def, vd_dem **out,
                            char *format, size_t format_bytes) {
    if (format != NULL) {
        const char *picture = picture_format(def->inputs[0]);
        const char *dot = strrchr(def->inputs[0], '.');
        bool standard = is_standard_input(def->inputs[0]);
        bool hgt = dot != NULL && (strcmp(dot, ".hgt") == 0 || strcmp(dot, ".HGT") == 0);
        snprintf(format, format_bytes, "%s",
                 def->dem.raw_width > 0 ? "raw numbers"
                 : picture != NULL      ? picture
                 : standard             ? "standard input"
                 : hgt                  ? "SRTM .hgt, EPSG:4326"
                                        : "ESRI ASCII grid");
    }
    bool core_can = true;
    if (wants_geo(def)) {
        vd_geo_module geo;
        core_can = vd_geo_module_open("", &geo).code != VD_OK && def->band == 0;
        if (core_can) {
            vd_log(context, VD_LOG_WARNING,
                   "%.200s has a georeference in a file beside it, which "
                   "only GDAL reads and which is not used",
                   def->inputs[0]);
        }
    }
    if (!core_can) {
        return load_by_geo(context, def, out, format, format_bytes);
    }
    vd_status status = load_by_core(context, def, out);
    for (int i = 0; i < def->input_count && status.code == VD_ERROR_UNSUPPORTED; i++) {
        if (is_standard_input(def->inputs[i])) {
            return vd_failure(VD_ERROR_UNSUPPORTED,
                              "cannot read standard input: it can be PNG, PGM, an ESRI ASCII grid "
                              "or raw numbers; .hgt, whose name says where it lies, and what only "
                              "GDAL reads need a name: save it to a file");
        }
    }
    if (status.code == VD_ERROR_UNSUPPORTED && def->dem.raw_width == 0) {
        return load_by_geo(context, def, out, format, format_bytes);
    }
    return status;
}

void vd_write_share(uint64_t part, uint64_t whole, char out[16]) {
    double percent = whole > 0 ? 100.0 * (double)part / (double)whole : 0.0;
    if (part < whole && percent > 99.9) {
        snprintf(out, 16, "> 99.9 %%");
    } else {
        snprintf(out, 16, "%.3g %%", percent);
    }
}

/* Says how much of the terrain is missing, and fills it where asked. */
static vd_status settle_missing(vd_context *context, const vd_scene_def *def, vd_dem *dem) {
    uint64_t samples = (uint64_t)dem->width * (uint64_t)dem->height;
    const char *name = def->inputs[0];
    if (dem->missing == samples) {
        return vd_failure(VD_ERROR_EMPTY,
                          "%.200s: all %llu samples are missing; check --nodata and "
                          "--band, or the file",
                          name, (unsigned long long)samples);
    }
    if (dem->missing == 0) {
        return vd_success();
    }
    char share[16];
    vd_write_share(dem->missing, samples, share);
    vd_log(context, VD_LOG_WARNING,
           "%.200s: %llu of %llu samples (%s) are missing; they are "
           "%s",
           name, (unsigned long long)dem->missing, (unsigned long long)samples, share,
           def->fill_missing ? "filled from their neighbours"
                             : "left as holes (--missing fill closes them)");
    return def->fill_missing ? vd_dem_fill(dem) : vd_success();
}

/* ---- imagery ----------------------------------------------------------------------------------
 */

static vd_status load_color(vd_context *context, const vd_scene_def *def, const vd_dem *dem,
                            vd_picture **out, double color_from_sample[6], bool *placed) {
    /* What cannot be opened goes to the core's reader, which says best what is wrong with it. */
    bool own = is_standard_input(def->color) || access(def->color, R_OK) != 0 ||
               picture_format(def->color) != NULL;
    bool needs_geo = !own || def->bands[0] > 0;
    bool by_geo = false;
    vd_geo_module geo;
    vd_status status;
    if (needs_geo || has_sidecar(def->color)) {
        char purpose[256];
        snprintf(purpose, sizeof purpose, "read %.200s", def->color);
        status = vd_geo_module_open(purpose, &geo);
        if (status.code != VD_OK && needs_geo) {
            return status;
        }
        by_geo = status.code == VD_OK;
    }
    *placed = false;
    const int *bands = def->bands[0] > 0 ? def->bands : NULL;
    status = by_geo
                 ? geo.load_color(context, def->color, dem, bands, out, color_from_sample, placed)
                 : vd_picture_load(context, def->color, out);
    if (status.code == VD_OK && !*placed && dem->kind != VD_CRS_NONE) {
        vd_log(context, VD_LOG_WARNING,
               "%.200s says nothing about where it lies; it is stretched "
               "over the whole terrain",
               def->color);
    }
    return status;
}

/* ---- the scene --------------------------------------------------------------------------------
 */

static void remember(vd_scene *scene, vd_dem *dem) {
    scene->kind = dem->kind;
    scene->crs_unit_m = dem->crs_unit_m;
    scene->placement = vd_dem_placement(dem);
    scene->missing = dem->missing;
    memcpy(scene->crs_from_sample, dem->transform, sizeof scene->crs_from_sample);
    memcpy(scene->height_type, dem->height_type, sizeof scene->height_type);
    memcpy(scene->height_unit, dem->height_unit, sizeof scene->height_unit);
    scene->crs = dem->crs; /* the context's memory: taken over from the DEM */
    dem->crs = NULL;
}

/* Samples along the longer side of a formula's extent when --cell-size is not given. */
#define FUNCTION_SAMPLES 1024

/* Samples along a side of what stands for an endless formula, and cells between them. */
#define ORIGIN_SAMPLES 257
#define ORIGIN_STEP 16

static vd_status check_heights(vd_scene *scene, const char *where) {
    const vd_heightfield *t = scene->terrain;
    if (t->holes < (uint64_t)t->width * (uint64_t)t->height) {
        return vd_success();
    }
    vd_heightfield_destroy(scene->context, &scene->terrain);
    return vd_failure(VD_ERROR_EMPTY,
                      "--function gives no height anywhere %s (every value is infinite or not a "
                      "number); change %s",
                      where, scene->function == NULL ? "one of them" : "it");
}

static void describe_function(vd_scene *scene) {
    scene->kind = VD_CRS_NONE;
    scene->crs_unit_m = 1.0;
    scene->placement = (vd_placement){0.0, 0.0, 1.0, 1.0};
    memcpy(scene->crs_from_sample, scene->terrain->world_from_sample,
           sizeof scene->crs_from_sample);
    snprintf(scene->height_type, sizeof scene->height_type, "formula");
}

static vd_status load_endless(vd_context *context, const vd_scene_def *def, vd_scene *scene) {
    scene->cell_m = def->has_cell_size ? def->dem.cell_size_m : 1.0;
    const double step = ORIGIN_STEP * scene->cell_m, edge = 0.5 * (ORIGIN_SAMPLES - 1) * step;
    const vd_function_grid grid = {-edge, edge, step, ORIGIN_SAMPLES, ORIGIN_SAMPLES};
    vd_status status = vd_function_compile(context, def->function, &scene->function);
    if (status.code == VD_OK) {
        status = vd_function_heightfield(context, NULL, scene->function, &grid, &scene->terrain);
    }
    if (status.code == VD_OK) {
        status = check_heights(scene, "around the origin");
    }
    if (status.code != VD_OK) {
        vd_function_destroy(context, &scene->function);
        return status;
    }
    describe_function(scene);
    snprintf(scene->format, sizeof scene->format, "formula without end, cells of %.6g m and more",
             scene->cell_m);
    return status;
}

static int compare_floats(const void *a, const void *b) {
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

void vd_scene_origin(const vd_scene *scene, double *ground, double *relief) {
    static const double tail = 0.02;
    const vd_heightfield *t = scene->terrain;
    const size_t all = (size_t)t->width * (size_t)t->height, count = all - (size_t)t->holes;
    *relief = (double)t->max - t->min;
    float *sorted = vd_allocate(scene->context, all, sizeof *sorted);
    for (size_t i = 0; sorted != NULL && i < all; i++) {
        sorted[i] = vd_heightfield_at(t, (int)(i % (size_t)t->width), (int)(i / (size_t)t->width));
    }
    double middle = 0.5 * ((double)t->max + t->min);
    if (sorted != NULL) {
        qsort(sorted, all, sizeof *sorted, compare_floats); /* holes, −infinity, come first */
        const float *first = sorted + t->holes;
        const size_t low = (size_t)(tail * (double)(count - 1)), high = count - 1 - low;
        *relief = (double)first[high] - first[low];
        middle = 0.5 * ((double)first[high] + first[low]);
    }
    vd_release(scene->context, sorted);
    const double here = vd_heightfield_height_at(t, 0.0, 0.0);
    *ground = isfinite(here) && fabs(here - middle) <= *relief ? here : middle;
}

static vd_status load_function(vd_context *context, const vd_scene_def *def, vd_scene *scene) {
    const double *e = def->extent;
    if (!(e[0] < e[2])) {
        return load_endless(context, def, scene);
    }
    const double wide = e[2] - e[0], high = e[3] - e[1];
    double cell = (wide > high ? wide : high) / FUNCTION_SAMPLES;
    if (def->has_cell_size) {
        cell = def->dem.cell_size_m;
    }
    if (wide / cell >= VD_MAX_SIDE || high / cell >= VD_MAX_SIDE) {
        return vd_failure(VD_ERROR_LIMIT,
                          "--extent is %.10g × %.10g cells, more than %d a side; give a larger "
                          "--cell-size",
                          wide / cell, high / cell, VD_MAX_SIDE);
    }
    const vd_function_grid grid = {e[0], e[3], cell, (int)floor(wide / cell) + 1,
                                   (int)floor(high / cell) + 1};
    vd_function *function = NULL;
    vd_status status = vd_function_compile(context, def->function, &function);
    if (status.code == VD_OK) {
        status = vd_function_heightfield(context, NULL, function, &grid, &scene->terrain);
    }
    vd_function_destroy(context, &function);
    if (status.code != VD_OK) {
        return status;
    }
    status = check_heights(scene, "in --extent");
    if (status.code != VD_OK) {
        return status;
    }
    describe_function(scene);
    scene->missing = scene->terrain->holes;
    snprintf(scene->format, sizeof scene->format, "formula, %d × %d samples %.6g m apart",
             grid.width, grid.height, cell);
    return vd_success();
}

vd_status vd_scene_load(vd_context *context, const vd_scene_def *def, vd_scene *out) {
    vd_scene scene = {.context = context};
    if (def->function != NULL) {
        vd_status made = load_function(context, def, &scene);
        if (made.code == VD_OK) {
            *out = scene;
        }
        return made;
    }
    vd_dem *dem = NULL;
    vd_picture *colors = NULL;
    double color_from_sample[6];
    bool placed = false;
    vd_status status = vd_scene_load_dem(context, def, &dem, scene.format, sizeof scene.format);
    if (status.code != VD_OK) {
        return status;
    }
    if (def->has_cell_size && dem->kind != VD_CRS_NONE) {
        vd_log(context, VD_LOG_WARNING,
               "--cell-size is not used: %.200s says itself how far apart "
               "its samples are",
               def->inputs[0]);
    }
    uint64_t missing = dem->missing;
    status = settle_missing(context, def, dem);
    if (status.code == VD_OK && def->color != NULL) {
        status = load_color(context, def, dem, &colors, color_from_sample, &placed);
    }
    if (status.code == VD_OK) {
        status =
            vd_heightfield_from_dem(dem, colors, placed ? color_from_sample : NULL, &scene.terrain);
    }
    if (status.code == VD_OK) {
        remember(&scene, dem);
        scene.missing = missing;
        *out = scene;
    }
    vd_picture_destroy(&colors);
    vd_dem_destroy(&dem);
    return status;
}

void vd_scene_finish(vd_scene *scene) {
    if (scene->context != NULL) {
        vd_release(scene->context, scene->crs);
        vd_heightfield_destroy(scene->context, &scene->terrain);
        vd_function_destroy(scene->context, &scene->function);
        *scene = (vd_scene){0};
    }
}

bool vd_scene_is_curved(const vd_scene *scene) {
    vd_vec3 low, high;
    vd_heightfield_bounds(scene->terrain, &low, &high);
    return scene->kind != VD_CRS_NONE && vd_vec3_length(vd_vec3_subtract(high, low)) < 1e6;
}

vd_status vd_scene_world_from_latlon(const vd_scene *scene, double latitude, double longitude,
                                     double *x, double *y) {
    double crs_x = longitude, crs_y = latitude;
    if (scene->kind == VD_CRS_NONE || (scene->kind == VD_CRS_PROJECTED && scene->crs == NULL)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the elevation has no georeference, so %.10g,%.10g is "
                          "nowhere; give X,Y,Z in metres",
                          latitude, longitude);
    }
    if (scene->kind == VD_CRS_GEOGRAPHIC) {
        /* The same meridian may be written as 350 or as -10. */
        crs_x -= 360.0 * floor((crs_x - scene->placement.origin_x) / 360.0 + 0.5);
    } else {
        vd_geo_module geo;
        longitude -= 360.0 * floor((longitude + 180.0) / 360.0);
        vd_status status = vd_geo_module_open("convert latitude and longitude", &geo);
        if (status.code == VD_OK) {
            status =
                geo.from_lonlat(scene->context, scene->crs, longitude, latitude, &crs_x, &crs_y);
        }
        if (status.code != VD_OK) {
            return status;
        }
    }
    *x = (crs_x - scene->placement.origin_x) * scene->placement.scale_x;
    *y = (crs_y - scene->placement.origin_y) * scene->placement.scale_y;
    return vd_success();
}

vd_status vd_scene_latlon_from_world(const vd_scene *scene, double x, double y, double *latitude,
                                     double *longitude) {
    double crs_x = x / scene->placement.scale_x + scene->placement.origin_x;
    double crs_y = y / scene->placement.scale_y + scene->placement.origin_y;
    if (scene->kind == VD_CRS_GEOGRAPHIC) {
        *latitude = crs_y;
        *longitude = crs_x;
        return vd_success();
    }
    if (scene->kind == VD_CRS_NONE || scene->crs == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "the elevation has no georeference");
    }
    vd_geo_module geo;
    vd_status status = vd_geo_module_open("convert to latitude and longitude", &geo);
    if (status.code == VD_OK) {
        status = geo.to_lonlat(scene->context, scene->crs, crs_x, crs_y, longitude, latitude);
    }
    return status;
}
