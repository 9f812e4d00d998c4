/* dem_ascii.c: ESRI ASCII grids (.asc).
 *
 * A few lines of key and value in any order, then the heights as text, north row first. The corner
 * is that of the lower left cell (xllcorner) or its centre (xllcenter); cells are square (cellsize)
 * or not (dx, dy). (ESRI 2006, "ASCII to Raster"; dx and dy as GDAL's AAIGrid writes them.)
 */
#include <stdio.h>
#include <string.h>
#include "core/core.h"
#include "core/text.h"
#include "terrain/dem_internal.h"

typedef enum ascii_key {
    KEY_NCOLS = 0,
    KEY_NROWS,
    KEY_XLLCORNER,
    KEY_YLLCORNER,
    KEY_XLLCENTER,
    KEY_YLLCENTER,
    KEY_CELLSIZE,
    KEY_DX,
    KEY_DY,
    KEY_NODATA,
    KEY_COUNT
} ascii_key;

static const char *const key_names[KEY_COUNT] = {
    "ncols",     "nrows",    "xllcorner", "yllcorner", "xllcenter",
    "yllcenter", "cellsize", "dx",        "dy",        "nodata_value"};

typedef struct ascii_header {
    bool has[KEY_COUNT];
    double value[KEY_COUNT];
} ascii_header;

static vd_status bad_number(const char *name, const vd_text *text, const char *what) {
    char word[24];
    vd_text copy = *text;
    if (!vd_text_word(&copy, word, sizeof word)) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %s: line %d has no number for %s; correct the line", name,
                          text->line, what);
    }
    for (char *c = word; *c; c++) {
        if ((unsigned char)*c < 0x20 || (unsigned char)*c > 0x7e) {
            *c = '?';
        }
    }
    return vd_failure(
        VD_ERROR_FORMAT,
        strchr(word, ',')
            ? "cannot read %s: line %d has \"%s\" for %s, with a decimal comma; write "
              "decimal points"
            : "cannot read %s: line %d has \"%s\" for %s where a number must stand; "
              "correct the line",
        name, text->line, word, what);
}

static bool is_space(char c) {
    return c == ' ' || (c >= '\t' && c <= '\r');
}

/* Reads a number that ends at white space. */
static bool read_number(vd_text *text, double *out) {
    vd_text start = *text;
    if (vd_text_number(text, out) && (vd_text_done(text) || is_space(*text->at))) {
        return true;
    }
    *text = start;
    return false;
}

static void lower_case(char *word) {
    for (; *word; word++) {
        *word = *word >= 'A' && *word <= 'Z' ? (char)(*word + ('a' - 'A')) : *word;
    }
}

/* Reads the keys up to the first height. */
static vd_status read_header(vd_text *text, const char *name, ascii_header *header) {
    memset(header, 0, sizeof *header);
    for (;;) {
        vd_text_skip_lines(text);
        vd_text number = *text;
        double ignored;
        if (vd_text_done(text) || vd_text_number(&number, &ignored)) {
            return vd_success(); /* "nan" is a height, not a key */
        }
        char word[32];
        vd_text before = *text;
        (void)vd_text_word(text, word, sizeof word);
        lower_case(word);
        int key = 0;
        while (key < KEY_COUNT && strcmp(word, key_names[key]) != 0) {
            key++;
        }
        if (key == KEY_COUNT) {
            return bad_number(name, &before, "a header key or a height");
        }
        vd_text_skip_blanks(text);
        if (!read_number(text, &header->value[key])) {
            return bad_number(name, text, key_names[key]);
        }
        header->has[key] = true;
    }
}

static vd_status read_side(const ascii_header *header, ascii_key key, const char *name, int *out) {
    double value = header->value[key];
    if (!header->has[key]) {
        return vd_failure(VD_ERROR_FORMAT, "cannot read %s: its header has no %s; add the line",
                          name, key_names[key]);
    }
    if (!(value >= 1.0) || value > 1e15 || floor(value) != value) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %s: %s is %g, it must be a whole number from 1 to %d", name,
                          key_names[key], value, VD_MAX_SIDE);
    }
    if (value > VD_MAX_SIDE) {
        return vd_failure(
            VD_ERROR_LIMIT,
            "cannot read %s: %s is %.0f, more than the %d this program takes; crop it", name,
            key_names[key], value, VD_MAX_SIDE);
    }
    *out = (int)value;
    return vd_success();
}

/* The transform of sample centres, from the lower left corner or centre and the cell sizes. */
static vd_status read_placement(const ascii_header *header, const char *name, int height,
                                double transform[6]) {
    const bool *has = header->has;
    const double *value = header->value;
    double dx = value[has[KEY_DX] ? KEY_DX : KEY_CELLSIZE];
    double dy = value[has[KEY_DY] ? KEY_DY : KEY_CELLSIZE];
    if (!(has[KEY_CELLSIZE] || (has[KEY_DX] && has[KEY_DY]))) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %s: its header has no cellsize; add the line", name);
    }
    if (!(dx > 0.0) || !(dy > 0.0) || !isfinite(dx) || !isfinite(dy)) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %s: the cell size is %g × %g, it must be positive", name, dx,
                          dy);
    }
    if (!(has[KEY_XLLCORNER] || has[KEY_XLLCENTER]) ||
        !(has[KEY_YLLCORNER] || has[KEY_YLLCENTER])) {
        return vd_failure(VD_ERROR_FORMAT, "cannot read %s: its header has no %s; add the line",
                          name,
                          has[KEY_XLLCORNER] || has[KEY_XLLCENTER] ? "yllcorner" : "xllcorner");
    }
    double x = has[KEY_XLLCENTER] ? value[KEY_XLLCENTER] : value[KEY_XLLCORNER] + 0.5 * dx;
    double y = has[KEY_YLLCENTER] ? value[KEY_YLLCENTER] : value[KEY_YLLCORNER] + 0.5 * dy;
    y += (height - 1) * dy;
    if (!isfinite(x) || !isfinite(y)) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %s: its lower left corner is not a finite place", name);
    }
    const double t[6] = {x, dx, 0.0, y, 0.0, -dy};
    memcpy(transform, t, sizeof t);
    return vd_success();
}

/* The format has no place for a coordinate system, yet many grids are in degrees. */
static bool looks_geographic(const vd_dem *dem) {
    const double *t = dem->transform;
    double east = t[0] + (dem->width - 1) * t[1], south = t[3] + (dem->height - 1) * t[5];
    return fabs(t[0]) <= 360.0 && fabs(east) <= 360.0 && fabs(t[3]) <= 90.0 &&
           fabs(south) <= 90.0 && t[1] < 0.1 && -t[5] < 0.1;
}

static vd_status read_heights(vd_text *text, const char *name, const vd_dem_rule *rule,
                              vd_dem *dem) {
    for (int row = 0; row < dem->height; row++) {
        float *heights = dem->heights + (size_t)row * dem->stride;
        for (int column = 0; column < dem->width; column++) {
            vd_text_skip_lines(text);
            if (vd_text_done(text)) {
                return vd_failure(VD_ERROR_FORMAT,
                                  "cannot read %s: it ends in row %d of %d after %d of %d values; "
                                  "get the file again",
                                  name, row + 1, dem->height, column, dem->width);
            }
            double value;
            if (!read_number(text, &value)) {
                char what[64];
                snprintf(what, sizeof what, "row %d, column %d", row + 1, column + 1);
                return bad_number(name, text, what);
            }
            heights[column] = vd_dem_rule_height(rule, value);
        }
    }
    vd_text_skip_lines(text);
    if (!vd_text_done(text) && *text->at != '\0' && *text->at != '\x1a') { /* an old end mark */
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %s: line %d goes on after %d rows of %d values; check ncols "
                          "and nrows",
                          name, text->line, dem->height, dem->width);
    }
    return vd_success();
}

/* A header may promise more samples than the rest of the file can hold, each taking at least a
 * digit and a blank: refused before memory is taken for them. */
static vd_status check_length(vd_text text, const char *name, int width, int height) {
    uint64_t samples = (uint64_t)width * (uint64_t)height;
    if (2 * samples - 1 <= (uint64_t)(text.end - text.at)) {
        return vd_success();
    }
    uint64_t count = 0;
    char word[2];
    for (vd_text_skip_lines(&text); vd_text_word(&text, word, sizeof word); count++) {
        vd_text_skip_lines(&text);
    }
    return vd_failure(VD_ERROR_FORMAT,
                      "cannot read %s: it ends in row %llu of %d after %llu of %d values; get the "
                      "file again",
                      name, (unsigned long long)(count / (uint64_t)width + 1), height,
                      (unsigned long long)(count % (uint64_t)width), width);
}

vd_status vd_dem_decode_ascii(vd_context *context, const void *data, size_t size_bytes,
                              const char *name, const vd_dem_def *def, vd_dem **out) {
    vd_text text = vd_text_make(data, size_bytes);
    ascii_header header;
    vd_dem *dem = NULL;
    int width = 0, height = 0;
    double transform[6];
    vd_status status = read_header(&text, name, &header);
    if (status.code == VD_OK) {
        status = read_side(&header, KEY_NCOLS, name, &width);
    }
    if (status.code == VD_OK) {
        status = read_side(&header, KEY_NROWS, name, &height);
    }
    if (status.code == VD_OK) {
        status = read_placement(&header, name, height, transform);
    }
    if (status.code == VD_OK) {
        status = check_length(text, name, width, height);
    }
    if (status.code == VD_OK) {
        status = vd_dem_create_for(context, name, width, height, &dem);
    }
    if (status.code != VD_OK) {
        return status;
    }
    vd_dem_rule rule = vd_dem_rule_make(def);
    rule.as_float = true;
    rule.nodata[1] = header.has[KEY_NODATA] ? header.value[KEY_NODATA] : -9999.0;
    memcpy(dem->transform, transform, sizeof transform);
    snprintf(dem->height_type, sizeof dem->height_type, "text");
    dem->kind = looks_geographic(dem) ? VD_CRS_GEOGRAPHIC : VD_CRS_PROJECTED;
    status = read_heights(&text, name, &rule, dem);
    if (status.code == VD_OK && dem->kind == VD_CRS_GEOGRAPHIC) {
        dem->crs = vd_copy_string(context, "EPSG:4326");
        if (!dem->crs) {
            status = vd_out_of_memory("a coordinate system's name", sizeof "EPSG:4326");
        }
    }
    if (status.code != VD_OK) {
        vd_dem_destroy(&dem);
        return status;
    }
    if (dem->kind == VD_CRS_GEOGRAPHIC) {
        vd_log(
            context, VD_LOG_WARNING,
            "%s names no coordinate system; its numbers look like longitude and latitude and are "
            "taken as degrees",
            name);
    }
    vd_dem_update_range(dem);
    *out = dem;
    return vd_success();
}
