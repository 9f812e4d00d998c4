/* png_text.c: walking a PNG's chunks for text (PNG specification, third edition, §11.3.3). */
#include "png_text.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LONGEST = 1 << 16 };

static uint32_t big_endian(const unsigned char *b) {
    return (uint32_t)b[0] << 24 | (uint32_t)b[1] << 16 | (uint32_t)b[2] << 8 | b[3];
}

/* Takes one text chunk; `data` is followed by a NUL. */
static void take_text(json_t *out, const char *data, size_t length, int international) {
    size_t keyword = strlen(data) + 1;
    if (keyword >= length) {
        return;
    }
    const char *text = data + keyword;
    if (international) {
        /* compression flag and method, language, translated keyword */
        if (keyword + 4 > length || text[0] != 0) {
            return;
        }
        text += 2;
        for (int field = 0; field < 2; field++) {
            text += strlen(text) + 1;
            if ((size_t)(text - data) > length) {
                return;
            }
        }
    }
    json_object_set_new(out, data, json_string(text)); /* text that is not UTF-8 is left out */
}

json_t *vd_png_read_text(const char *path) {
    json_t *out = json_object();
    FILE *file = fopen(path, "rb");
    char *data = malloc(LONGEST + 1);
    unsigned char head[8];
    bool png = file != NULL && data != NULL && fread(head, 1, 8, file) == 8 &&
               memcmp(head, "\x89PNG\r\n\x1a\n", 8) == 0;
    while (png && out != NULL && fread(head, 1, 8, file) == 8) {
        uint32_t length = big_endian(head);
        int international = memcmp(head + 4, "iTXt", 4) == 0;
        if ((international || memcmp(head + 4, "tEXt", 4) == 0) && length <= LONGEST) {
            if (fread(data, 1, length, file) != length) {
                break;
            }
            data[length] = '\0';
            take_text(out, data, length, international);
            length = 0;
        }
        if (length > INT32_MAX || fseek(file, (long)length + 4, SEEK_CUR) != 0) {
            break;
        }
    }
    free(data);
    if (file != NULL) {
        fclose(file);
    }
    return out;
}
