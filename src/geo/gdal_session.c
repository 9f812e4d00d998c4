/* gdal_session.c: see gdal_session.h. */
#include "geo/gdal_session.h"

#include <errno.h>
#include <gdal_utils.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static pthread_once_t drivers_once = PTHREAD_ONCE_INIT;

static void register_drivers(void) {
    GDALAllRegister();
}

/* Copies one line of GDAL's prose: line breaks become spaces, a closing full stop goes. */
static void copy_sentence(char *out, size_t out_bytes, const char *in) {
    size_t n = 0;
    for (; in[n] != '\0' && n + 1 < out_bytes; n++) {
        out[n] = (unsigned char)in[n] < ' ' ? ' ' : in[n];
    }
    /* Do not leave half a UTF-8 sequence at a cut. */
    while (in[n] != '\0' && n > 0 && ((unsigned char)in[n] & 0xC0) == 0x80) {
        n--;
    }
    while (n > 0 && (out[n - 1] == '.' || out[n - 1] == ' ')) {
        n--;
    }
    out[n] = '\0';
}

static void CPL_STDCALL keep_error(CPLErr severity, CPLErrorNum number, const char *text) {
    (void)number;
    vd_gdal_session *session = CPLGetErrorHandlerUserData();
    if (session == NULL) {
        return;
    }
    if (severity >= CE_Failure) {
        if (session->message[0] == '\0') {
            copy_sentence(session->message, sizeof session->message, text);
        }
    } else {
        char line[300];
        copy_sentence(line, sizeof line, text);
        vd_gdal_log(session, VD_LOG_DEBUG, "GDAL: %s", line);
    }
}

void vd_gdal_begin(vd_gdal_session *session, vd_context *context) {
    session->context = context;
    session->quiet = false;
    session->message[0] = '\0';
    CPLPushErrorHandlerEx(keep_error, session);
    (void)pthread_once(&drivers_once, register_drivers);
    vd_gdal_clear(session); /* a plugin that does not load is nobody's failure here */
}

void vd_gdal_end(vd_gdal_session *session) {
    CPLErrorReset();
    CPLPopErrorHandler();
    session->context = NULL;
}

void vd_gdal_clear(vd_gdal_session *session) {
    session->message[0] = '\0';
    CPLErrorReset();
}

void vd_gdal_log(vd_gdal_session *session, vd_log_level level, const char *format, ...) {
    if (session->quiet) {
        return;
    }
    char sentence[512]; /* as long as vd_log's own */
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(sentence, sizeof sentence, format, arguments);
    va_end(arguments);
    vd_log(session->context, level, "%s", sentence);
}

vd_status vd_gdal_failure(const vd_gdal_session *session, vd_code code, const char *path,
                          const char *what, const char *remedy) {
    if (session->message[0] == '\0') {
        return vd_failure(code, "cannot read %s: %s; %s", path, what, remedy);
    }
    return vd_failure(code, "cannot read %s: %s (GDAL says: %s); %s", path, what, session->message,
                      remedy);
}

const char *vd_gdal_type_name(GDALRasterBandH band) {
    const char *pixel_type = GDALGetMetadataItem(band, "PIXELTYPE", "IMAGE_STRUCTURE");
    GDALDataType type = GDALGetRasterDataType(band);
    if (GDALDataTypeIsComplex(type)) {
        return "complex";
    }
    switch (type) {
    case GDT_Byte:
        return pixel_type != NULL && strcmp(pixel_type, "SIGNEDBYTE") == 0 ? "int8" : "uint8";
#if GDAL_VERSION_NUM >= 3070000
    case GDT_Int8:
        return "int8";
#endif
    case GDT_UInt16:
        return "uint16";
    case GDT_Int16:
        return "int16";
    case GDT_UInt32:
        return "uint32";
    case GDT_Int32:
        return "int32";
    case GDT_UInt64:
        return "uint64";
    case GDT_Int64:
        return "int64";
    case GDT_Float32:
        return "float32";
    case GDT_Float64:
        return "float64";
    default:
        return "unknown";
    }
}

GDALRasterBandH vd_gdal_alpha(GDALDatasetH dataset) {
    int count = dataset != NULL ? GDALGetRasterCount(dataset) : 0;
    for (int b = count; b > 1; b--) {
        GDALRasterBandH band = GDALGetRasterBand(dataset, b);
        if (GDALGetRasterColorInterpretation(band) == GCI_AlphaBand) {
            return band;
        }
    }
    return NULL;
}

/* Says why GDAL opened nothing. */
static vd_status explain_open(const vd_gdal_session *session, const char *path, bool vector) {
    struct stat info;
    if (stat(path, &info) != 0) {
        if (errno == ENOENT && strchr(path, ':') == NULL && strncmp(path, "/vsi", 4) != 0) {
            return vd_failure(VD_ERROR_IO, "cannot read %s: there is no such file; check the path",
                              path);
        }
        return vd_gdal_failure(session, VD_ERROR_IO, path, "it cannot be opened",
                               "check the name and that it may be read");
    }
    if (S_ISDIR(info.st_mode)) {
        return vd_failure(VD_ERROR_IO,
                          "cannot read %s: it is a folder, and not one that GDAL knows as a "
                          "%s; give a file",
                          path, vector ? "vector file" : "raster");
    }
    if (access(path, R_OK) != 0) {
        return vd_failure(
            VD_ERROR_IO, "cannot read %s: permission denied; make it readable for this user", path);
    }
    if (S_ISREG(info.st_mode) && info.st_size == 0) {
        return vd_failure(VD_ERROR_FORMAT, "cannot read %s: it is empty; get the file again", path);
    }
    if (strstr(session->message, "not recognized as a supported") == NULL &&
        session->message[0] != '\0') {
        return vd_gdal_failure(session, VD_ERROR_FORMAT, path, "it is damaged",
                               "get the file again");
    }
    return vd_failure(VD_ERROR_FORMAT,
                      "cannot read %s: GDAL does not know its format; convert it to %s", path,
                      vector ? "GeoJSON or GPX" : "GeoTIFF or PNG");
}

/* True when the file holds vector data; fills the sentence for it. */
static bool explain_vector(const char *path, vd_status *out) {
    GDALDatasetH vector = GDALOpenEx(path, GDAL_OF_VECTOR | GDAL_OF_READONLY, NULL, NULL, NULL);
    if (vector == NULL) {
        return false;
    }
    *out = vd_failure(VD_ERROR_FORMAT,
                      "cannot read %s: it is a vector file (%s), not a raster; make a raster of it "
                      "with gdal_rasterize or gdal_grid",
                      path, GDALGetDriverLongName(GDALGetDatasetDriver(vector)));
    GDALClose(vector);
    return true;
}

/* Names the first subdatasets of a container in the failure. */
static vd_status explain_subdatasets(const char *path, char **subdatasets, int count) {
    char names[200] = "";
    size_t used = 0;
    for (int i = 0; i < count && i < 4; i++) {
        char key[40];
        (void)snprintf(key, sizeof key, "SUBDATASET_%d_NAME", i + 1);
        const char *name = CSLFetchNameValueDef(subdatasets, key, "?");
        size_t length = strlen(name);
        if (used + length + 3 > sizeof names) {
            break;
        }
        used +=
            (size_t)snprintf(names + used, sizeof names - used, "%s%s", i > 0 ? ", " : "", name);
    }
    return vd_failure(VD_ERROR_FORMAT, "cannot read %s: it holds %d rasters; name one of them: %s",
                      path, count, names[0] != '\0' ? names : "gdalinfo lists them");
}

vd_status vd_gdal_open(vd_gdal_session *session, const char *path, GDALDatasetH *out) {
    if (path == NULL || path[0] == '\0') {
        return vd_failure(VD_ERROR_ARGUMENT, "the path of a raster is empty; name a file");
    }
    vd_gdal_clear(session);
    const unsigned flags = GDAL_OF_RASTER | GDAL_OF_READONLY;
    GDALDatasetH dataset = GDALOpenEx(path, flags | GDAL_OF_VERBOSE_ERROR, NULL, NULL, NULL);
    if (dataset == NULL) {
        vd_status status = explain_open(session, path, false);
        if (status.code == VD_ERROR_FORMAT) {
            (void)explain_vector(path, &status);
        }
        return status;
    }
    if (GDALGetRasterCount(dataset) < 1) {
        char **subdatasets = GDALGetMetadata(dataset, "SUBDATASETS");
        int count = CSLCount(subdatasets) / 2; /* a name and a description each */
        vd_status status = vd_success();
        GDALDatasetH only = NULL;
        if (count == 1) {
            only = GDALOpenEx(CSLFetchNameValueDef(subdatasets, "SUBDATASET_1_NAME", ""), flags,
                              NULL, NULL, NULL);
        }
        if (only == NULL && count > 0) {
            status = explain_subdatasets(path, subdatasets, count);
        } else if (only == NULL || GDALGetRasterCount(only) < 1) {
            status = vd_failure(VD_ERROR_FORMAT,
                                "cannot read %s: it holds no raster band; give another file", path);
        }
        GDALClose(dataset);
        if (status.code != VD_OK) {
            if (only != NULL) {
                GDALClose(only);
            }
            return status;
        }
        dataset = only;
    }
    vd_gdal_clear(session);
    *out = dataset;
    return vd_success();
}

vd_status vd_gdal_open_vector(vd_gdal_session *session, const char *path, GDALDatasetH *out) {
    if (path == NULL || path[0] == '\0') {
        return vd_failure(VD_ERROR_ARGUMENT, "the path of a vector file is empty; name a file");
    }
    vd_gdal_clear(session);
    GDALDatasetH dataset = GDALOpenEx(
        path, GDAL_OF_VECTOR | GDAL_OF_READONLY | GDAL_OF_VERBOSE_ERROR, NULL, NULL, NULL);
    if (dataset == NULL) {
        vd_status status = explain_open(session, path, true);
        GDALDatasetH raster =
            status.code == VD_ERROR_FORMAT
                ? GDALOpenEx(path, GDAL_OF_RASTER | GDAL_OF_READONLY, NULL, NULL, NULL)
                : NULL;
        if (raster != NULL) {
            status = vd_failure(VD_ERROR_FORMAT,
                                "cannot read %s: it is a raster (%s), and holds no points, lines "
                                "or polygons; give a vector file, such as GeoJSON or GPX",
                                path, GDALGetDriverLongName(GDALGetDatasetDriver(raster)));
            GDALClose(raster);
        }
        return status;
    }
    vd_gdal_clear(session);
    *out = dataset;
    return vd_success();
}

/* GDAL wants char ** and copies it. */
static char **argument_list(const char *const *arguments) {
    char **list = NULL;
    for (int i = 0; arguments[i] != NULL; i++) {
        list = CSLAddString(list, arguments[i]);
    }
    return list;
}

GDALDatasetH vd_gdal_translate(GDALDatasetH source, const char *const *arguments) {
    char **list = argument_list(arguments);
    GDALTranslateOptions *options = GDALTranslateOptionsNew(list, NULL);
    GDALDatasetH out = options != NULL ? GDALTranslate("", source, options, NULL) : NULL;
    GDALTranslateOptionsFree(options);
    CSLDestroy(list);
    return out;
}

GDALDatasetH vd_gdal_warp(GDALDatasetH source, const char *const *arguments) {
    char **list = argument_list(arguments);
    GDALWarpAppOptions *options = GDALWarpAppOptionsNew(list, NULL);
    GDALDatasetH out = options != NULL ? GDALWarp("", NULL, 1, &source, options, NULL) : NULL;
    GDALWarpAppOptionsFree(options);
    CSLDestroy(list);
    return out;
}
