/* pnm.c: PGM and PPM files into pictures: P2, P3 (text) and P5, P6 (binary).
 *
 * Netpbm's formats (man 5 pgm, ppm). Values stay as they stand in the file, whatever its maxval:
 * heights mean what they say. Only the first of several concatenated pictures is read.
 */
#include <string.h>

#include "core/core.h"
#include "image/image.h"

typedef struct pnm_header {
    uint32_t width, height, maxval;
    int channels, bits;
    bool text;
} pnm_header;

/* A position within the file. */
typedef struct pnm_cursor {
    const uint8_t *at, *end;
    const char *name;
} pnm_cursor;

bool vd_pnm_matches(const void *data, size_t size_bytes) {
    const uint8_t *bytes = data;
    return size_bytes >= 3 && bytes[0] == 'P' && bytes[1] >= '1' && bytes[1] <= '7' &&
           (bytes[2] == ' ' || bytes[2] == '#' || (bytes[2] >= '\t' && bytes[2] <= '\r'));
}

static bool is_space(uint8_t byte) {
    return byte == ' ' || (byte >= '\t' && byte <= '\r');
}

static bool is_digit(uint8_t byte) {
    return byte >= '0' && byte <= '9';
}

/* Skips white space and comments, which run from # to the end of the line. */
static void skip_space(pnm_cursor *cursor) {
    while (cursor->at < cursor->end) {
        if (*cursor->at == '#') {
            while (cursor->at < cursor->end && *cursor->at != '\n' && *cursor->at != '\r') {
                cursor->at++;
            }
        } else if (is_space(*cursor->at)) {
            cursor->at++;
        } else {
            return;
        }
    }
}

/* Reads an unsigned number, held at 2^31 when it is larger. False when there is none. */
static bool read_number(pnm_cursor *cursor, uint32_t *out) {
    skip_space(cursor);
    if (cursor->at == cursor->end || !is_digit(*cursor->at)) {
        return false;
    }
    const uint32_t most = (uint32_t)1 << 31;
    uint32_t value = 0;
    for (; cursor->at < cursor->end && is_digit(*cursor->at); cursor->at++) {
        const uint32_t digit = (uint32_t)(*cursor->at - '0');
        value = value > (most - digit) / 10 ? most : value * 10 + digit;
    }
    *out = value;
    return true;
}

static vd_status read_header(pnm_cursor *cursor, pnm_header *out) {
    const char kind = (char)cursor->at[1];
    if (kind != '2' && kind != '3' && kind != '5' && kind != '6') {
        return vd_failure(
            VD_ERROR_FORMAT,
            "cannot read %s: P%c pictures are not supported, only PGM and PPM (P2, P3, "
            "P5, P6); convert it to PNG first",
            cursor->name, kind);
    }
    pnm_header header = {0};
    header.text = kind == '2' || kind == '3';
    header.channels = kind == '2' || kind == '5' ? 1 : 3;
    cursor->at += 2;
    uint32_t *fields[3] = {&header.width, &header.height, &header.maxval};
    const char *names[3] = {"width", "height", "maxval"};
    for (int i = 0; i < 3; i++) {
        if (!read_number(cursor, fields[i])) {
            return vd_failure(VD_ERROR_FORMAT,
                              "cannot read %s: its header has no %s; get the file again",
                              cursor->name, names[i]);
        }
    }
    if (header.maxval < 1 || header.maxval > 65535) {
        return vd_failure(
            VD_ERROR_FORMAT,
            "cannot read %s: its maxval is not within 1 and 65535; get the file again",
            cursor->name);
    }
    header.bits = header.maxval > 255 ? 16 : 8;
    /* Exactly one byte of white space stands between the header and binary values. */
    if (cursor->at < cursor->end && !is_space(*cursor->at)) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %s: its header does not end after the maxval; get the file "
                          "again",
                          cursor->name);
    }
    cursor->at += cursor->at < cursor->end;
    *out = header;
    return vd_check_file_size(cursor->name, header.width, header.height);
}

static vd_status truncated(const char *name, uint64_t row, uint32_t rows) {
    return vd_failure(VD_ERROR_FORMAT,
                      "cannot read %s: it is truncated after row %llu of %u; get the file again",
                      name, (unsigned long long)row, rows);
}

/* Checks, before memory is taken, that the file can hold what its header promises. */
static vd_status check_length(const pnm_cursor *cursor, const pnm_header *header) {
    const uint64_t left = (uint64_t)(cursor->end - cursor->at);
    const uint64_t row_values = (uint64_t)header->width * (uint64_t)header->channels;
    /* Text needs a digit and a space for each value but the last. */
    const uint64_t row_bytes = row_values * (header->text ? 2 : (uint64_t)header->bits / 8);
    if (left + header->text < row_bytes * header->height) {
        return truncated(cursor->name, left / row_bytes, header->height);
    }
    return vd_success();
}

static void read_binary_row(pnm_cursor *cursor, size_t values, int bits, void *row) {
    if (bits == 8) {
        memcpy(row, cursor->at, values);
        cursor->at += values;
        return;
    }
    uint16_t *out = row;
    for (size_t i = 0; i < values; i++, cursor->at += 2) {
        out[i] = (uint16_t)(cursor->at[0] << 8 | cursor->at[1]); /* big-endian in the file */
    }
}

static vd_status read_text_row(pnm_cursor *cursor, const pnm_header *header, size_t values, int y,
                               void *row) {
    for (size_t i = 0; i < values; i++) {
        uint32_t value;
        if (!read_number(cursor, &value)) {
            if (cursor->at == cursor->end) {
                return truncated(cursor->name, (uint64_t)y, header->height);
            }
            return vd_failure(
                VD_ERROR_FORMAT,
                "cannot read %s: row %d holds something that is not a number; get the "
                "file again",
                cursor->name, y + 1);
        }
        if (value > header->maxval) {
            return vd_failure(VD_ERROR_FORMAT,
                              "cannot read %s: row %d holds a value above the maxval of %u; raise "
                              "the maxval in its header",
                              cursor->name, y + 1, header->maxval);
        }
        if (header->bits == 8) {
            ((uint8_t *)row)[i] = (uint8_t)value;
        } else {
            ((uint16_t *)row)[i] = (uint16_t)value;
        }
    }
    return vd_success();
}

vd_status vd_pnm_decode(vd_context *context, const void *data, size_t size_bytes, const char *name,
                        vd_picture **out) {
    pnm_cursor cursor = {data, (const uint8_t *)data + size_bytes, name};
    pnm_header header = {0};
    vd_status status = read_header(&cursor, &header);
    if (status.code != VD_OK) {
        return status;
    }
    status = check_length(&cursor, &header);
    if (status.code != VD_OK) {
        return status;
    }
    vd_picture *picture = NULL;
    status = vd_picture_create(context, (int)header.width, (int)header.height, header.channels,
                               header.bits, &picture);
    if (status.code != VD_OK) {
        return status;
    }
    const size_t values = (size_t)header.width * (size_t)header.channels;
    for (int y = 0; y < picture->height && status.code == VD_OK; y++) {
        if (header.text) {
            status = read_text_row(&cursor, &header, values, y, vd_picture_row(picture, y));
        } else {
            read_binary_row(&cursor, values, header.bits, vd_picture_row(picture, y));
        }
    }
    if (status.code != VD_OK) {
        vd_picture_destroy(&picture);
        return status;
    }
    *out = picture;
    return vd_success();
}
