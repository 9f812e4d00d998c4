/* geo_heights.c: see geo_heights.h.
 *
 * Why not GDALRasterIOEx with average resampling: it knows only the nodata value that the file
 * declares, and a DEM whose −9999 or −3.4e38 is not declared would come out with spikes and pits
 * where they were averaged in. Here every value passes the rule before it is averaged. Overviews
 * are used where the file has them. The peak is the grid plus a block of rows.
 */
#include "geo/geo_heights.h"

#include <float.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

/* ---- units
 * ---------------------------------------------------------------------------------------- */

typedef struct height_unit {
    const char *name; /* lower case */
    const char *short_name;
    double metres;
} height_unit;

static const double foot_m = 0.3048;
static const double survey_foot_m = 1200.0 / 3937.0;

/* Finds a unit by any of the names that files use; false when it is none of them. */
static bool find_unit(const char *name, height_unit *out) {
    const height_unit units[] = {
        {"m", "m", 1.0},
        {"metre", "m", 1.0},
        {"metres", "m", 1.0},
        {"meter", "m", 1.0},
        {"meters", "m", 1.0},
        {"meters above sea level", "m", 1.0},
        {"ft", "ft", foot_m},
        {"foot", "ft", foot_m},
        {"feet", "ft", foot_m},
        {"international foot", "ft", foot_m},
        {"ft_us", "us-ft", survey_foot_m},
        {"us-ft", "us-ft", survey_foot_m},
        {"ussft", "us-ft", survey_foot_m},
        {"us survey foot", "us-ft", survey_foot_m},
        {"us_survey_foot", "us-ft", survey_foot_m},
        {"us survey feet", "us-ft", survey_foot_m},
        {"foot_us", "us-ft", survey_foot_m},
        {"sfoot", "us-ft", survey_foot_m},
        {"sft", "us-ft", survey_foot_m},
        {"mm", "mm", 0.001},
        {"millimetre", "mm", 0.001},
        {"millimeter", "mm", 0.001},
        {"cm", "cm", 0.01},
        {"centimetre", "cm", 0.01},
        {"centimetres", "cm", 0.01},
        {"centimeter", "cm", 0.01},
        {"centimeters", "cm", 0.01},
        {"dm", "dm", 0.1},
        {"decimetre", "dm", 0.1},
        {"decimeter", "dm", 0.1},
        {"decimeters", "dm", 0.1},
        {"km", "km", 1000.0},
        {"kilometre", "km", 1000.0},
        {"kilometer", "km", 1000.0},
        {"yd", "yd", 3.0 * foot_m},
        {"yard", "yd", 3.0 * foot_m},
        {"fathom", "fathom", 6.0 * foot_m},
        {"fathoms", "fathom", 6.0 * foot_m},
    };
    for (size_t i = 0; i < sizeof units / sizeof units[0]; i++) {
        if (strcasecmp(name, units[i].name) == 0) {
            *out = units[i];
            return true;
        }
    }
    return false;
}

static const char *unit_of_metres(double metres) {
    if (fabs(metres - 1.0) < 1e-9) {
        return "m";
    }
    if (fabs(metres - foot_m) < 1e-9) {
        return "ft";
    }
    return fabs(metres - survey_foot_m) < 1e-9 ? "us-ft" : "other";
}

/* Fills rule->unit and rule->unit_m: the band's word, else the vertical CRS, else metres. */
static void find_height_unit(vd_gdal_session *session, GDALRasterBandH band, const char *path,
                             double crs_height_unit_m, vd_height_rule *rule) {
    const char *said = GDALGetRasterUnitType(band);
    height_unit unit;
    rule->unit_m = 1.0;
    rule->unit[0] = '\0';
    if (said != NULL && said[0] != '\0') {
        if (find_unit(said, &unit)) {
            (void)snprintf(rule->unit, sizeof rule->unit, "%s", unit.short_name);
            rule->unit_m = unit.metres;
        } else {
            (void)snprintf(rule->unit, sizeof rule->unit, "%.15s", said);
            vd_log(session->context, VD_LOG_WARNING,
                   "%s: its height unit \"%.40s\" is unknown and taken as metres", path, said);
        }
    } else if (crs_height_unit_m > 0.0 && isfinite(crs_height_unit_m)) {
        (void)snprintf(rule->unit, sizeof rule->unit, "%s", unit_of_metres(crs_height_unit_m));
        rule->unit_m = crs_height_unit_m;
    }
}

/* ---- what a stored value means
 * ------------------------------------------------------------------- */

/* The value as the band can hold it: a float band cannot hold -3.4028234663852886e+38 of a header
 * that was written in double. */
static double stored_as(GDALDataType type, double value) {
    return type == GDT_Float32 && fabs(value) <= (double)FLT_MAX ? (double)(float)value : value;
}

static bool file_nodata(GDALRasterBandH band, double *out) {
    int has = FALSE;
    switch (GDALGetRasterDataType(band)) {
    case GDT_Int64:
        *out = (double)GDALGetRasterNoDataValueAsInt64(band, &has);
        break;
    case GDT_UInt64:
        *out = (double)GDALGetRasterNoDataValueAsUInt64(band, &has);
        break;
    default:
        *out = stored_as(GDALGetRasterDataType(band), GDALGetRasterNoDataValue(band, &has));
        break;
    }
    return has;
}

static bool has_own_mask(GDALRasterBandH band) {
    return (GDALGetMaskFlags(band) & (GMF_ALL_VALID | GMF_NODATA)) == 0;
}

/* The band that says which samples are there; null when none does. */
static GDALRasterBandH mask_of(GDALRasterBandH band) {
    if (has_own_mask(band)) {
        return GDALGetMaskBand(band);
    }
    GDALRasterBandH alpha = vd_gdal_alpha(GDALGetBandDataset(band));
    return alpha != band ? alpha : NULL;
}

vd_height_rule vd_height_rule_of(vd_gdal_session *session, GDALRasterBandH band, const char *path,
                                 double crs_height_unit_m, const vd_geo_def *def) {
    vd_height_rule rule = {.scale = 1.0};
    int given = FALSE;
    double scale = GDALGetRasterScale(band, &given);
    if (!given || !isfinite(scale) || scale == 0.0) {
        scale = 1.0;
    }
    double offset = GDALGetRasterOffset(band, &given);
    if (!given || !isfinite(offset)) {
        offset = 0.0;
    }
    find_height_unit(session, band, path, crs_height_unit_m, &rule);
    if (def->height_scale != 0.0) {
        rule.unit_m = def->height_scale;
    } else if (rule.unit_m != 1.0) {
        vd_log(session->context, VD_LOG_INFO, "%s: heights are in %s and become metres (× %.6g)",
               path, rule.unit, rule.unit_m);
    }
    rule.scale = scale * rule.unit_m;
    rule.offset_m = offset * rule.unit_m + def->height_offset_m;
    rule.signed_byte =
        GDALGetRasterDataType(band) == GDT_Byte && strcmp(vd_gdal_type_name(band), "int8") == 0;
    double nodata;
    if (file_nodata(band, &nodata)) {
        rule.nodata[rule.nodata_count++] = nodata;
    }
    if (def->has_nodata) {
        rule.nodata[rule.nodata_count++] = stored_as(GDALGetRasterDataType(band), def->nodata);
    }
    rule.guess = rule.nodata_count == 0 && mask_of(band) == NULL;
    return rule;
}

/* Turns stored values into metres in place, NaN where missing; returns how many were missing only
 * by guess. `mask` may be null. Without branches, since files of 2048² samples are read cold. */
static uint64_t apply_rule(const vd_height_rule *rule, double *values, const uint8_t *mask,
                           size_t count) {
    const double first = rule->nodata_count > 0 ? rule->nodata[0] : NAN;
    const double second = rule->nodata_count > 1 ? rule->nodata[1] : NAN;
    const double fold = rule->signed_byte ? 127.0 : INFINITY;
    const double scale = rule->scale, offset_m = rule->offset_m;
    uint64_t guessed = 0;
    for (size_t i = 0; i < count; i++) {
        double v = values[i];
        v = v > fold ? v - 256.0 : v;
        const double height = v * scale + offset_m;
        const int missing =
            (v != v) | (v == first) | (v == second) | (mask != NULL && mask[i] == 0);
        /* Nothing on Earth is 1,000 km high: -3.4e38, 1e20 and their kin, declared or not. */
        int sentinel = !(fabs(height) <= 1e6);
        if (rule->guess) {
            sentinel |= (v == -9999.0) | (v == -32768.0) | (v == -32767.0) | (v == -99999.0);
        }
        guessed += (uint64_t)(sentinel & ~missing);
        values[i] = missing | sentinel ? NAN : height;
    }
    return guessed;
}

/* ---- reading
 * ------------------------------------------------------------------------------------- */

void vd_geo_fit(int width, int height, int max_side, int *out_width, int *out_height) {
    int side = width > height ? width : height;
    *out_width = width;
    *out_height = height;
    if (side > max_side) {
        double factor = (double)max_side / (double)side;
        *out_width = (int)(width * factor + 0.5);
        *out_height = (int)(height * factor + 0.5);
        *out_width = *out_width < 1 ? 1 : *out_width;
        *out_height = *out_height < 1 ? 1 : *out_height;
    }
}

/* The smallest overview that is not smaller than the wanted grid, else the band itself. */
static GDALRasterBandH pick_overview(GDALRasterBandH band, int width, int height) {
    GDALRasterBandH best = band;
    const bool masked = has_own_mask(band);
    if (!masked && mask_of(band) != NULL) {
        return band; /* its overviews do not lead to theirs of the alpha band */
    }
    int count = GDALGetOverviewCount(band);
    for (int i = 0; i < count; i++) {
        GDALRasterBandH overview = GDALGetOverview(band, i);
        if (overview == NULL || GDALGetRasterBandXSize(overview) < width ||
            GDALGetRasterBandYSize(overview) < height ||
            GDALGetRasterBandXSize(overview) >= GDALGetRasterBandXSize(best)) {
            continue;
        }
        if (masked) {
            GDALRasterBandH mask = GDALGetMaskBand(overview);
            if (mask == NULL || (GDALGetMaskFlags(overview) & GMF_ALL_VALID) != 0) {
                continue; /* the overview lost the mask */
            }
        }
        best = overview;
    }
    return best;
}

/* A grid being filled row by row from a band that may be larger. */
typedef struct reader {
    const vd_height_rule *rule;
    vd_dem *dem;
    GDALRasterBandH band, mask; /* mask may be null */
    int width, height;          /* of the band */
    int rows;                   /* in a block */
    double *values;             /* [rows][width] */
    uint8_t *masks;             /* [rows][width]; null without mask */
    double *sums, *weights;     /* [dem->width] each; null unless decimating */
    uint64_t guessed;
} reader;

/* Adds `share` of one source row (in units of 1 / dem->height of a row) to the open output row.
 * In units of 1 / dem->width, source column x covers [x·dem->width, (x+1)·dem->width) and output
 * column c [c·width, (c+1)·width): integers, so that shares add up exactly. */
static void add_row(reader *r, const double *line, int64_t share) {
    const int64_t out_width = r->dem->width, width = r->width;
    int64_t x = 0;
    for (int64_t c = 0; c < out_width; c++) {
        int64_t begin = c * width, end = begin + width;
        double sum = 0.0, weight = 0.0;
        for (;; x++) {
            int64_t from = x * out_width, to = from + out_width;
            int64_t overlap = (to < end ? to : end) - (from > begin ? from : begin);
            if (!isnan(line[x])) {
                sum += line[x] * (double)overlap;
                weight += (double)overlap;
            }
            if (to >= end) {
                x += to == end;
                break;
            }
        }
        r->sums[c] += sum * (double)share;
        r->weights[c] += weight * (double)share;
    }
}

static void close_row(reader *r, int row) {
    float *out = r->dem->heights + (size_t)row * r->dem->stride;
    /* A full sample weighs width × height of the band in these units. */
    const double half = 0.5 * (double)r->width * (double)r->height;
    for (int c = 0; c < r->dem->width; c++) {
        out[c] = r->weights[c] >= half ? (float)(r->sums[c] / r->weights[c]) : NAN;
        r->sums[c] = 0.0;
        r->weights[c] = 0.0;
    }
}

/* Takes one source row to where it belongs. */
static void put_row(reader *r, int y, const double *line) {
    if (r->sums == NULL) {
        float *out = r->dem->heights + (size_t)y * r->dem->stride;
        for (int x = 0; x < r->width; x++) {
            out[x] = (float)line[x];
        }
        return;
    }
    const int64_t out_height = r->dem->height, height = r->height;
    int64_t from = (int64_t)y * out_height, to = from + out_height;
    while (from < to) {
        int64_t row = from / height, end = (row + 1) * height;
        add_row(r, line, (to < end ? to : end) - from);
        if (to >= end) {
            close_row(r, (int)row);
        }
        from = to < end ? to : end;
    }
}

static void reader_finish(reader *r) {
    vd_context *context = r->dem->context;
    vd_release(context, r->values);
    vd_release(context, r->masks);
    vd_release(context, r->sums);
    vd_release(context, r->weights);
}

static vd_status reader_init(reader *r, const char *path, GDALRasterBandH samples,
                             const vd_height_rule *rule, vd_dem *dem) {
    vd_context *context = dem->context;
    *r = (reader){.rule = rule, .dem = dem};
    r->band = pick_overview(samples, dem->width, dem->height);
    r->mask = mask_of(r->band);
    r->width = GDALGetRasterBandXSize(r->band);
    r->height = GDALGetRasterBandYSize(r->band);
    if (r->width > VD_GEO_MAX_WIDTH_READ ||
        (double)r->width * (double)r->height > VD_GEO_MAX_SAMPLES_READ) {
        return vd_failure(VD_ERROR_LIMIT,
                          "cannot read %s: %d × %d samples without overviews are too many; build "
                          "overviews with gdaladdo, or cut a part out with gdal_translate -projwin",
                          path, r->width, r->height);
    }
    int block_width, block_height;
    GDALGetBlockSize(r->band, &block_width, &block_height);
    /* Rows that the second cache holds, 1 MiB; whole blocks, as long as these stay within 64 MiB.
     */
    int64_t fit = ((int64_t)1 << 17) / r->width, most = ((int64_t)1 << 23) / r->width;
    fit = fit > block_height ? fit - fit % block_height : block_height;
    r->rows = (int)(fit < most ? fit : most);
    r->rows = r->rows < 1 ? 1 : (r->rows > r->height ? r->height : r->rows);
    size_t samples_held = (size_t)r->rows * (size_t)r->width;
    r->values = vd_allocate(context, samples_held, sizeof *r->values);
    bool complete = r->values != NULL;
    if (r->mask != NULL) {
        r->masks = vd_allocate(context, samples_held, 1);
        complete = complete && r->masks != NULL;
    }
    if (r->width != dem->width || r->height != dem->height) {
        size_t width = (size_t)dem->width;
        r->sums = vd_allocate(context, width, sizeof *r->sums);
        r->weights = vd_allocate(context, width, sizeof *r->weights);
        complete = complete && r->sums != NULL && r->weights != NULL;
        for (size_t c = 0; complete && c < width; c++) {
            r->sums[c] = 0.0;
            r->weights[c] = 0.0;
        }
    }
    if (!complete) {
        reader_finish(r);
        return vd_failure(VD_ERROR_MEMORY,
                          "out of memory: reading rows of %d samples takes %zu bytes; free memory "
                          "or use a smaller raster",
                          r->width, samples_held * sizeof *r->values);
    }
    return vd_success();
}

vd_status vd_geo_read_heights(vd_gdal_session *session, const char *path, GDALRasterBandH samples,
                              const vd_height_rule *rule, vd_dem *dem) {
    reader r;
    vd_status status = reader_init(&r, path, samples, rule, dem);
    if (status.code != VD_OK) {
        return status;
    }
    vd_gdal_clear(session);
    for (int y = 0; y < r.height; y += r.rows) {
        int n = r.height - y < r.rows ? r.height - y : r.rows;
        CPLErr failed = GDALRasterIO(r.band, GF_Read, 0, y, r.width, n, r.values, r.width, n,
                                     GDT_Float64, 0, 0);
        if (failed == CE_None && r.mask != NULL) {
            failed = GDALRasterIO(r.mask, GF_Read, 0, y, r.width, n, r.masks, r.width, n, GDT_Byte,
                                  0, 0);
        }
        if (failed != CE_None) {
            char what[80];
            (void)snprintf(what, sizeof what, "its samples cannot be read beyond row %d of %d", y,
                           r.height);
            reader_finish(&r);
            return vd_gdal_failure(session, VD_ERROR_FORMAT, path, what, "get the file again");
        }
        /* They are not read again: GDAL would keep a copy of the whole. */
        GDALFlushRasterCache(r.band);
        r.guessed += apply_rule(rule, r.values, r.masks, (size_t)n * (size_t)r.width);
        for (int k = 0; k < n; k++) {
            put_row(&r, y + k, r.values + (size_t)k * (size_t)r.width);
        }
    }
    if (r.guessed > 0) {
        vd_log(session->context, VD_LOG_WARNING,
               "%s: %" PRIu64 " samples hold a value that no place on Earth has (such as −9999 or "
               "−3.4e38) and count as missing though the file does not say so",
               path, r.guessed);
    }
    reader_finish(&r);
    return vd_success();
}
