/* geo_pixels.c: see geo_pixels.h. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "geo/geo_pixels.h"

enum { MAX_SAMPLES = 1 << 18 }; /* for percentiles: their error is then about 0.03 % */

/* One reading of a window. */
typedef struct pixel_reader {
    vd_gdal_session *session;
    const char *path;
    const vd_pixel_window *window;
    GDALDatasetH dataset;
    const int *bands;
    int count;
    vd_picture *picture;
    uint8_t *first; /* of the picture, inside the edge */
    uint8_t *alpha; /* [out_height][out_width]; null: opaque */
    float *plane;   /* [out_height][out_width]; null while all bands are 8-bit */
    float *samples; /* [MAX_SAMPLES]; null likewise */
} pixel_reader;

static vd_status out_of_memory(size_t size_bytes) {
    return vd_failure(VD_ERROR_MEMORY,
                      "out of memory: imagery takes %zu bytes; free memory or use a smaller image",
                      size_bytes);
}

static size_t plane_pixels(const pixel_reader *r) {
    return (size_t)r->window->out_width * (size_t)r->window->out_height;
}

/* Reads one band's window. `type` is that of `out`; spacings in bytes. */
static vd_status read_band(const pixel_reader *r, GDALRasterBandH band, void *out,
                           GDALDataType type, size_t pixel_bytes, size_t line_bytes) {
    const vd_pixel_window *w = r->window;
    GDALRasterIOExtraArg extra;
    INIT_RASTERIO_EXTRA_ARG(extra);
    bool smaller = w->out_width < w->width || w->out_height < w->height;
    extra.eResampleAlg = smaller ? GRIORA_Average : GRIORA_NearestNeighbour;
    vd_gdal_clear(r->session);
    CPLErr failed =
        GDALRasterIOEx(band, GF_Read, w->x, w->y, w->width, w->height, out, w->out_width,
                       w->out_height, type, (GSpacing)pixel_bytes, (GSpacing)line_bytes, &extra);
    if (failed != CE_None) {
        return vd_gdal_failure(r->session, VD_ERROR_FORMAT, r->path, "its pixels cannot be read",
                               "get the file again");
    }
    return vd_success();
}

/* Reads the masks of all bands: a pixel is there where any of them has it. (With nodata 0, a pure
 * green pixel is missing in red and blue, and still a pixel.) */
static vd_status read_alpha(pixel_reader *r) {
    const size_t pixels = plane_pixels(r), width = (size_t)r->window->out_width;
    uint8_t *other = NULL;
    r->alpha = vd_allocate(r->session->context, pixels, 1);
    if (r->alpha == NULL) {
        return out_of_memory(pixels);
    }
    GDALRasterBandH band = GDALGetRasterBand(r->dataset, r->bands[0]);
    GDALRasterBandH alpha = vd_gdal_alpha(r->dataset);
    const bool per_band = alpha == NULL && (GDALGetMaskFlags(band) & GMF_PER_DATASET) == 0;
    vd_status status =
        read_band(r, alpha != NULL ? alpha : GDALGetMaskBand(band), r->alpha, GDT_Byte, 1, width);
    for (int i = 1; i < r->count && per_band && status.code == VD_OK; i++) {
        other = other != NULL ? other : vd_allocate(r->session->context, pixels, 1);
        if (other == NULL) {
            return out_of_memory(pixels);
        }
        band = GDALGetRasterBand(r->dataset, r->bands[i]);
        status = read_band(r, GDALGetMaskBand(band), other, GDT_Byte, 1, width);
        for (size_t k = 0; k < pixels && status.code == VD_OK; k++) {
            r->alpha[k] = other[k] > r->alpha[k] ? other[k] : r->alpha[k];
        }
    }
    vd_release(r->session->context, other);
    return status;
}

static int compare_floats(const void *a, const void *b) {
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* Finds the 2nd and 98th percentile of the plane's pixels that are there, from evenly spread ones.
 */
static void find_stretch(const pixel_reader *r, float *low, float *high) {
    const size_t pixels = plane_pixels(r);
    size_t step = pixels / MAX_SAMPLES + 1, n = 0;
    for (size_t i = 0; i < pixels; i += step) {
        if ((r->alpha == NULL || r->alpha[i] != 0) && isfinite(r->plane[i])) {
            r->samples[n++] = r->plane[i];
        }
    }
    *low = *high = 0.0f;
    if (n == 0) {
        return;
    }
    qsort(r->samples, n, sizeof *r->samples, compare_floats);
    *low = r->samples[(n - 1) * 2 / 100];
    *high = r->samples[(n - 1) * 98 / 100];
    if (!(*low < *high)) {
        *low = r->samples[0];
        *high = r->samples[n - 1];
    }
}

/* Reads a band that is not 8-bit into channel `channel`, stretched. */
static vd_status read_stretched(const pixel_reader *r, GDALRasterBandH band, int channel) {
    const size_t width = (size_t)r->window->out_width, step = (size_t)r->picture->channels;
    vd_status status = read_band(r, band, r->plane, GDT_Float32, 4, width * 4);
    if (status.code != VD_OK) {
        return status;
    }
    float low, high;
    find_stretch(r, &low, &high);
    const double scale = low < high ? 255.0 / ((double)high - (double)low) : 0.0;
    for (int y = 0; y < r->window->out_height; y++) {
        uint8_t *out = r->first + (size_t)y * r->picture->stride_bytes + channel;
        const float *in = r->plane + (size_t)y * width;
        for (size_t x = 0; x < width; x++) {
            double v = scale > 0.0 ? ((double)in[x] - (double)low) * scale + 0.5 : 128.0;
            out[x * step] = v >= 255.0 ? 255 : (v > 0.0 ? (uint8_t)v : 0);
        }
    }
    vd_log(r->session->context, VD_LOG_INFO,
           "%s: %s values %.6g … %.6g of band %d are stretched to black … white", r->path,
           vd_gdal_type_name(band), (double)low, (double)high, r->bands[channel]);
    return vd_success();
}

/* Surrounds the picture by a row or column of its outermost colours with alpha 0, so that filtering
 * across the edge brings in no other colour. */
static void draw_edge(const pixel_reader *r) {
    const vd_picture *p = r->picture;
    const size_t channels = (size_t)p->channels;
    uint8_t *rows = p->data;
    for (int y = 1; y < p->height - 1; y++) {
        uint8_t *row = rows + (size_t)y * p->stride_bytes;
        uint8_t *end = row + (size_t)(p->width - 1) * channels;
        memcpy(row, row + channels, channels);
        memcpy(end, end - channels, channels);
        row[channels - 1] = end[channels - 1] = 0;
    }
    for (int y = 0; y < p->height; y += p->height - 1) {
        uint8_t *row = rows + (size_t)y * p->stride_bytes;
        size_t bytes = (size_t)p->width * channels;
        memcpy(row, y == 0 ? row + p->stride_bytes : row - p->stride_bytes, bytes);
        for (size_t x = 0; x < bytes; x += channels) {
            row[x + channels - 1] = 0;
        }
    }
}

/* Writes the alpha channel: the masks, or opaque where only the edge needs one. */
static void write_alpha(const pixel_reader *r) {
    const size_t width = (size_t)r->window->out_width, step = (size_t)r->picture->channels;
    for (int y = 0; y < r->window->out_height; y++) {
        uint8_t *out = r->first + (size_t)y * r->picture->stride_bytes + r->count;
        for (size_t x = 0; x < width; x++) {
            out[x * step] = r->alpha != NULL ? r->alpha[(size_t)y * width + x] : 255;
        }
    }
}

static vd_status allocate(pixel_reader *r, bool masked, bool stretched) {
    vd_context *context = r->session->context;
    const vd_pixel_window *w = r->window;
    const int edge = w->edge ? 1 : 0, channels = r->count + (masked || w->edge ? 1 : 0);
    vd_status status = vd_picture_create(context, w->out_width + 2 * edge, w->out_height + 2 * edge,
                                         channels, 8, &r->picture);
    if (status.code != VD_OK) {
        return status;
    }
    r->first = (uint8_t *)r->picture->data + (size_t)edge * r->picture->stride_bytes +
               (size_t)(edge * channels);
    if (stretched) {
        r->plane = vd_allocate(context, plane_pixels(r), sizeof *r->plane);
        r->samples = vd_allocate(context, MAX_SAMPLES, sizeof *r->samples);
        if (r->plane == NULL || r->samples == NULL) {
            return out_of_memory(plane_pixels(r) * sizeof *r->plane);
        }
    }
    return vd_success();
}

static vd_status read_channels(pixel_reader *r) {
    bool masked = vd_gdal_alpha(r->dataset) != NULL, stretched = false;
    for (int i = 0; i < r->count; i++) {
        GDALRasterBandH band = GDALGetRasterBand(r->dataset, r->bands[i]);
        if (strcmp(vd_gdal_type_name(band), "complex") == 0) {
            return vd_failure(VD_ERROR_FORMAT,
                              "cannot read %s: band %d is complex, which is no colour; choose "
                              "another band",
                              r->path, r->bands[i]);
        }
        masked = masked || (GDALGetMaskFlags(band) & GMF_ALL_VALID) == 0;
        stretched = stretched || GDALGetRasterDataType(band) != GDT_Byte;
    }
    vd_status status = allocate(r, masked, stretched);
    if (status.code == VD_OK && masked) {
        status = read_alpha(r);
    }
    for (int i = 0; i < r->count && status.code == VD_OK; i++) {
        GDALRasterBandH band = GDALGetRasterBand(r->dataset, r->bands[i]);
        if (GDALGetRasterDataType(band) == GDT_Byte) {
            status = read_band(r, band, r->first + i, GDT_Byte, (size_t)r->picture->channels,
                               r->picture->stride_bytes);
        } else {
            status = read_stretched(r, band, i);
        }
    }
    if (status.code == VD_OK && r->picture->channels > r->count) {
        write_alpha(r);
    }
    if (status.code == VD_OK && r->window->edge) {
        draw_edge(r);
    }
    return status;
}

vd_status vd_geo_read_pixels(vd_gdal_session *session, const char *path, GDALDatasetH dataset,
                             const int *bands, int count, const vd_pixel_window *window,
                             vd_picture **out) {
    pixel_reader r = {.session = session,
                      .path = path,
                      .window = window,
                      .dataset = dataset,
                      .bands = bands,
                      .count = count};
    vd_status status = read_channels(&r);
    vd_release(session->context, r.alpha);
    vd_release(session->context, r.plane);
    vd_release(session->context, r.samples);
    if (status.code != VD_OK) {
        vd_picture_destroy(&r.picture);
        return status;
    }
    *out = r.picture;
    return vd_success();
}
