/* gdal_session.h: one call into GDAL, its errors kept instead of printed.
 *
 * GDAL reports through a per-thread stack of handlers. A session pushes one for the duration of a
 * public call: it keeps the first failure (the root cause; what follows is usually "IReadBlock
 * failed") and sends warnings to the context's log. Nothing reaches stderr.
 */
#ifndef VEDUTA_GEO_GDAL_SESSION_H
#define VEDUTA_GEO_GDAL_SESSION_H

#include <cpl_conv.h>
#include <cpl_error.h>
#include <cpl_string.h>
#include <gdal.h>
#include <ogr_srs_api.h>
#include <stdbool.h>
#include <veduta/context.h>

typedef struct vd_gdal_session {
    vd_context *context;
    bool quiet;        /* vd_gdal_log says nothing: the file is only looked at */
    char message[160]; /* GDAL's first failure since vd_gdal_clear; empty: none */
} vd_gdal_session;

/* Registers GDAL's drivers (once per process) and pushes the handler. Every begin is matched by one
 * end on the same thread; a session must not move meanwhile. */
void vd_gdal_begin(vd_gdal_session *session, vd_context *context);
void vd_gdal_end(vd_gdal_session *session);

/* Forgets the failure kept so far. */
void vd_gdal_clear(vd_gdal_session *session);

/* Sends a sentence to the context's log unless the session is quiet. */
void vd_gdal_log(vd_gdal_session *session, vd_log_level level, const char *format, ...)
    VD_PRINTF(3, 4);

/* Opens a raster with at least one band; of a container with a single subdataset, that one. *out is
 * closed by GDALClose. Returns VD_ERROR_ARGUMENT (no path), VD_ERROR_IO or VD_ERROR_FORMAT. */
VD_MUST_USE vd_status vd_gdal_open(vd_gdal_session *session, const char *path, GDALDatasetH *out);

/* Opens a file of points, lines and polygons. *out is closed by GDALClose. Returns as vd_gdal_open.
 */
VD_MUST_USE vd_status vd_gdal_open_vector(vd_gdal_session *session, const char *path,
                                          GDALDatasetH *out);

/* Returns the failure of an operation on a file, with GDAL's words. `what` is a clause such as
 * "its heights cannot be read"; `remedy` follows a semicolon. */
vd_status vd_gdal_failure(const vd_gdal_session *session, vd_code code, const char *path,
                          const char *what, const char *remedy);

/* Returns "uint8", "int16", "float32" …, "complex" or "unknown". */
const char *vd_gdal_type_name(GDALRasterBandH band);

/* Returns the dataset's alpha band, null when it has none. GDAL itself counts it as the mask of the
 * others only in datasets of two or four bands. */
GDALRasterBandH vd_gdal_alpha(GDALDatasetH dataset);

/* Makes a virtual copy of a dataset by GDALTranslate or GDALWarp with the given arguments; it reads
 * through `source`, which must be closed after it. Null when GDAL cannot. */
GDALDatasetH vd_gdal_translate(GDALDatasetH source, const char *const *arguments);
GDALDatasetH vd_gdal_warp(GDALDatasetH source, const char *const *arguments);

#endif
