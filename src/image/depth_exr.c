/* depth_exr.c: distances into OpenEXR files, through the C part of OpenEXR.
 *
 * The library puts the table of chunk offsets, near the file's beginning, in place last. So the
 * file grows in memory and is written when it is whole. The library's own scratch comes from
 * malloc: its hooks carry no user pointer.
 */
#include "image/depth_exr.h"

#include "core/core.h"
#include "core/file.h"

#ifndef VEDUTA_HAVE_EXR

vd_status vd_exr_write(const vd_distance_source *source, const char *path) {
    (void)source;
    return vd_failure(
        VD_ERROR_UNSUPPORTED,
        "cannot write %s: this build has no OpenEXR; write .pfm or .png, or build with "
        "OpenEXR installed",
        path);
}

#else

#include <OpenEXR/openexr.h>
#include <string.h>

#define ZIP_ROWS 16 /* rows that EXR_COMPRESSION_ZIP packs together */

/* The file so far. */
typedef struct exr_memory {
    vd_context *context;
    uint8_t *data;
    size_t size, capacity;
    bool out_of_memory;
} exr_memory;

static bool reserve(exr_memory *memory, size_t size) {
    if (size <= memory->capacity) {
        return true;
    }
    size_t capacity = memory->capacity ? memory->capacity : (size_t)64 << 10;
    while (capacity < size) {
        capacity *= 2;
    }
    uint8_t *grown = vd_allocate_zero(memory->context, capacity, 1);
    if (!grown) {
        memory->out_of_memory = true;
        return false;
    }
    if (memory->size > 0) {
        memcpy(grown, memory->data, memory->size);
    }
    vd_release(memory->context, memory->data);
    memory->data = grown;
    memory->capacity = capacity;
    return true;
}

static int64_t write_bytes(exr_const_context_t exr, void *user, const void *data, uint64_t size,
                           uint64_t offset, exr_stream_error_func_ptr_t report) {
    (void)exr;
    (void)report;
    exr_memory *memory = user;
    const size_t end = (size_t)offset + (size_t)size;
    if (!reserve(memory, end)) {
        return -1;
    }
    memcpy(memory->data + offset, data, size);
    memory->size = end > memory->size ? end : memory->size;
    return (int64_t)size;
}

/* Without a handler the library prints to standard error. */
static void ignore_error(exr_const_context_t exr, exr_result_t error, const char *message) {
    (void)exr;
    (void)error;
    (void)message;
}

static exr_result_t write_header(exr_context_t exr, int width, int height) {
    int part = 0;
    exr_result_t error = exr_add_part(exr, "depth", EXR_STORAGE_SCANLINE, &part);
    if (!error) {
        error = exr_initialize_required_attr_simple(exr, part, width, height, EXR_COMPRESSION_ZIP);
    }
    if (!error) {
        error = exr_add_channel(exr, part, "Z", EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LINEAR, 1, 1);
    }
    return error ? error : exr_write_header(exr);
}

/* Writes the rows in chunks of ZIP_ROWS, through `rows`, which holds as many. */
static exr_result_t write_chunks(exr_context_t exr, const vd_distance_source *source, float *rows) {
    const int height = source->frame->height;
    const size_t width = (size_t)source->frame->width;
    exr_encode_pipeline_t encoder = EXR_ENCODE_PIPELINE_INITIALIZER;
    exr_result_t error = EXR_ERR_SUCCESS;
    for (int y = 0; y < height && !error; y += ZIP_ROWS) {
        exr_chunk_info_t chunk;
        error = exr_write_scanline_chunk_info(exr, 0, y, &chunk);
        if (error) {
            break;
        }
        for (int i = 0; i < chunk.height; i++) {
            vd_distance_row(source, y + i, rows + (size_t)i * width);
        }
        error = y == 0 ? exr_encoding_initialize(exr, 0, &chunk, &encoder)
                       : exr_encoding_update(exr, 0, &chunk, &encoder);
        if (error) {
            break;
        }
        encoder.channels[0].encode_from_ptr = (const uint8_t *)rows;
        encoder.channels[0].user_pixel_stride = (int32_t)sizeof *rows;
        encoder.channels[0].user_line_stride = (int32_t)(width * sizeof *rows);
        encoder.channels[0].user_bytes_per_element = (int16_t)sizeof *rows;
        encoder.channels[0].user_data_type = EXR_PIXEL_FLOAT;
        if (y == 0) {
            error = exr_encoding_choose_default_routines(exr, 0, &encoder);
        }
        if (!error) {
            error = exr_encoding_run(exr, 0, &encoder);
        }
    }
    exr_encoding_destroy(exr, &encoder);
    return error;
}

/* Encodes the whole file into memory. */
static exr_result_t encode(const vd_distance_source *source, float *rows, exr_memory *memory) {
    exr_context_initializer_t hooks = EXR_DEFAULT_CONTEXT_INITIALIZER;
    hooks.user_data = memory;
    hooks.write_fn = write_bytes;
    hooks.error_handler_fn = ignore_error;
    exr_context_t exr = NULL;
    exr_result_t error = exr_start_write(&exr, "depth.exr", EXR_WRITE_FILE_DIRECTLY, &hooks);
    if (error) {
        return error;
    }
    error = write_header(exr, source->frame->width, source->frame->height);
    if (!error) {
        error = write_chunks(exr, source, rows);
    }
    const exr_result_t finished = exr_finish(&exr);
    return error ? error : finished;
}

static vd_status write_memory(const exr_memory *memory, const char *path) {
    vd_file file;
    vd_status status = vd_file_create(memory->context, path, &file);
    if (status.code != VD_OK) {
        return status;
    }
    vd_file_write(&file, memory->data, memory->size);
    return vd_file_commit(&file);
}

vd_status vd_exr_write(const vd_distance_source *source, const char *path) {
    vd_context *context = source->frame->context;
    const size_t values = (size_t)source->frame->width * ZIP_ROWS;
    float *rows = vd_allocate(context, values, sizeof *rows);
    if (!rows) {
        return vd_out_of_memory("rows of depth", values * sizeof *rows);
    }
    exr_memory memory = {context, NULL, 0, 0, false};
    const exr_result_t error = encode(source, rows, &memory);
    vd_status status;
    if (memory.out_of_memory || error == EXR_ERR_OUT_OF_MEMORY) {
        status = vd_out_of_memory("an OpenEXR file", 2 * memory.capacity);
    } else if (error) {
        status = vd_failure(VD_ERROR_IO, "cannot write %s: OpenEXR says \"%s\"; write .pfm instead",
                            path, exr_get_default_error_message(error));
    } else {
        status = write_memory(&memory, path);
    }
    vd_release(context, memory.data);
    vd_release(context, rows);
    return status;
}

#endif
