/* dem_load.c: which of the core's formats a file is, and handing it to that format's reader. */
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include "core/file.h"
#include "terrain/dem_internal.h"

/* 2^29 samples of eight bytes each are 4 GiB: nothing that could be accepted is larger. */
static const size_t limit_bytes = 4294967295u;

static char lower(char c) {
    return c >= 'A' && c <= 'Z' ? (char)(c + ('a' - 'A')) : c;
}

static bool starts_as_picture(const char *head, size_t size) {
    if (size >= 8 && memcmp(head, "\x89PNG\r\n\x1a\n", 8) == 0) {
        return true;
    }
    return size >= 3 && head[0] == 'P' && strchr("2356", head[1]) && head[1] != '\0' &&
           strchr(" \t\r\n#", head[2]) && head[2] != '\0';
}

/* An ESRI ASCII grid opens with one of its keys (ESRI 2006, "ASCII to Raster"). */
static bool starts_as_ascii(const char *head, size_t size) {
    static const char *const keys[] = {"ncols",    "nrows", "xll", "yll",
                                       "cellsize", "dx",    "dy",  "nodata_value"};
    size_t i = 0;
    while (i < size && strchr(" \t\r\n", head[i]) && head[i] != '\0') {
        i++;
    }
    for (size_t k = 0; k < sizeof keys / sizeof keys[0]; k++) {
        size_t n = strlen(keys[k]), j = 0;
        while (j < n && i + j < size && lower(head[i + j]) == keys[k][j]) {
            j++;
        }
        bool whole = keys[k][0] == 'x' || keys[k][0] == 'y' ||
                     (i + n < size && strchr(" \t\r\n", head[i + n]) && head[i + n] != '\0');
        if (j == n && whole) {
            return true;
        }
    }
    return false;
}

vd_dem_format vd_dem_recognize(const void *head, size_t size_bytes, const char *name,
                               const vd_dem_def *def) {
    if (def->raw_width != 0 || def->raw_height != 0) {
        return VD_DEM_RAW;
    }
    if (starts_as_picture(head, size_bytes)) {
        return VD_DEM_PICTURE;
    }
    if (vd_path_ends_in(name, ".hgt")) {
        return VD_DEM_HGT;
    }
    return starts_as_ascii(head, size_bytes) ? VD_DEM_ASCII : VD_DEM_UNKNOWN;
}

vd_status vd_dem_create_for(vd_context *context, const char *name, int width, int height,
                            vd_dem **out) {
    vd_status status = vd_dem_create(context, width, height, out);
    if (status.code == VD_ERROR_LIMIT || status.code == VD_ERROR_ARGUMENT) {
        return vd_failure(status.code, "cannot read %s: %s", name, status.message);
    }
    return status;
}

static vd_status check_def(const vd_dem_def *def) {
    if (!isfinite(def->height_scale)) {
        return vd_failure(VD_ERROR_ARGUMENT, "height_scale must be a finite number");
    }
    if (!isfinite(def->height_offset_m)) {
        return vd_failure(VD_ERROR_ARGUMENT, "height_offset_m must be a finite number");
    }
    if (!isfinite(def->cell_size_m) || def->cell_size_m < 0.0) {
        return vd_failure(VD_ERROR_ARGUMENT, "cell_size_m must be positive, or 0 for 1 m");
    }
    if ((unsigned)def->encoding >= VD_ENCODING_COUNT) {
        return vd_failure(VD_ERROR_ARGUMENT, "encoding must be one of vd_height_encoding");
    }
    return vd_success();
}

static vd_status unknown_format(const char *name) {
    return vd_failure(VD_ERROR_UNSUPPORTED,
                      "cannot read %s: it is not PNG, PGM, .hgt or an ESRI ASCII grid; give a raw "
                      "file's size and type, other formats need GDAL",
                      name);
}

vd_status vd_dem_decode(vd_context *context, const void *data, size_t size_bytes, const char *name,
                        const vd_dem_def *def, vd_dem **out) {
    if (!context || (!data && size_bytes > 0) || !name || !out) {
        return vd_failure(VD_ERROR_ARGUMENT, "vd_dem_decode: no argument but def may be null");
    }
    vd_dem_def defaults = vd_dem_def_default();
    def = def ? def : &defaults;
    vd_status status = check_def(def);
    if (status.code != VD_OK) {
        return status;
    }
    if (size_bytes == 0) {
        return vd_failure(VD_ERROR_FORMAT, "cannot read %s: it is empty; get the file again", name);
    }
    switch (vd_dem_recognize(data, size_bytes, name, def)) {
    case VD_DEM_HGT:
        return vd_dem_decode_hgt(context, data, size_bytes, name, def, out);
    case VD_DEM_ASCII:
        return vd_dem_decode_ascii(context, data, size_bytes, name, def, out);
    case VD_DEM_PICTURE:
        return vd_dem_decode_picture(context, data, size_bytes, name, def, out);
    case VD_DEM_RAW:
        return vd_dem_decode_raw(context, data, size_bytes, name, def, out);
    default:
        return unknown_format(name);
    }
}

/* True when the first bytes of a regular file show that no reader here knows it, so that a large
 * GeoTIFF is not read whole only to be refused. Anything doubtful is left to the full reading. */
static bool surely_unknown(const char *path, const vd_dem_def *def) {
    struct stat info;
    if (strcmp(path, "-") == 0 || stat(path, &info) != 0 || !S_ISREG(info.st_mode)) {
        return false;
    }
    FILE *file = fopen(path, "rb");
    if (!file) {
        return false;
    }
    char head[VD_DEM_PEEK_BYTES];
    size_t size = fread(head, 1, sizeof head, file);
    fclose(file);
    return size > 0 && vd_dem_recognize(head, size, path, def) == VD_DEM_UNKNOWN;
}

vd_status vd_dem_load(vd_context *context, const char *path, const vd_dem_def *def, vd_dem **out) {
    if (!context || !path || !out) {
        return vd_failure(VD_ERROR_ARGUMENT, "vd_dem_load: no argument but def may be null");
    }
    vd_dem_def defaults = vd_dem_def_default();
    def = def ? def : &defaults;
    if (surely_unknown(path, def)) {
        return unknown_format(path);
    }
    void *data = NULL;
    size_t size_bytes = 0;
    vd_status status = vd_file_read(context, path, limit_bytes, &data, &size_bytes);
    if (status.code != VD_OK) {
        return status;
    }
    const char *name = strcmp(path, "-") == 0 ? "standard input" : path;
    status = vd_dem_decode(context, data, size_bytes, name, def, out);
    vd_release(context, data);
    return status;
}
