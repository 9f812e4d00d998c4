/* function_error.c: pointing at what is wrong in a text. */
#include <stdio.h>
#include <string.h>
#include "terrain/function_program.h"

#define EXCERPT_BYTES 64 /* at most this much of the line, so that all fits a message */

static bool continues(char c) {
    return ((unsigned char)c & 0xC0u) == 0x80u;
}

/* Bytes of the well-formed UTF-8 character at `at`, or 0. (Overlong forms pass: they do no harm.)
 */
static size_t character_bytes(const char *text, size_t end, size_t at) {
    const unsigned char c = (unsigned char)text[at];
    const size_t n = c < 0x80 ? 1 : c >= 0xC2 && c < 0xE0 ? 2 : c >= 0xE0 && c < 0xF0 ? 3 : 4;
    if ((c >= 0x80 && c < 0xC2) || c >= 0xF5 || at + n > end) {
        return 0;
    }
    for (size_t i = 1; i < n; i++) {
        if (!continues(text[at + i])) {
            return 0;
        }
    }
    return n;
}

/* Copies text[begin, end) with what cannot be shown as '?'; returns the number of characters. */
static size_t copy_shown(const char *text, size_t begin, size_t end, char *out) {
    size_t count = 0, n = 0;
    for (size_t i = begin; i < end; count++) {
        const size_t bytes = character_bytes(text, end, i);
        if (bytes > 1) {
            memcpy(out + n, text + i, bytes);
            n += bytes;
        } else {
            const unsigned char c = (unsigned char)text[i];
            out[n++] = c == '\t' || c == '\r'             ? ' '
                       : bytes == 0 || c < 32 || c == 127 ? '?'
                                                          : text[i];
        }
        i += bytes > 0 ? bytes : 1;
    }
    out[n] = '\0';
    return count;
}

vd_status vd_function_error(vd_code code, const char *text, size_t size_bytes, size_t at,
                            const char *sentence) {
    size_t line_begin = 0, line_end = at;
    int line = 1;
    for (size_t i = 0; i < at; i++) {
        if (text[i] == '\n') {
            line_begin = i + 1;
            line++;
        }
    }
    while (line_end < size_bytes && text[line_end] != '\n') {
        line_end++;
    }
    size_t begin = at - line_begin > EXCERPT_BYTES / 2 ? at - EXCERPT_BYTES / 2 : line_begin;
    size_t end = line_end - begin > EXCERPT_BYTES ? begin + EXCERPT_BYTES : line_end;
    /* Not in the middle of a character, unless the text has nothing but middles. */
    for (int i = 0; i < 3 && begin < at && begin > line_begin && continues(text[begin]); i++) {
        begin++;
    }
    for (int i = 0; i < 3 && end > at && end < line_end && continues(text[end]); i++) {
        end--;
    }
    char excerpt[EXCERPT_BYTES + 8], before[EXCERPT_BYTES + 8];
    (void)copy_shown(text, begin, end, excerpt);
    const size_t caret = copy_shown(text, begin, at, before);
    size_t column = 1 + caret;
    for (size_t i = line_begin; i < begin; column++) {
        const size_t bytes = character_bytes(text, begin, i);
        i += bytes > 0 ? bytes : 1;
    }
    const char *left = begin > line_begin ? "…" : "", *right = end < line_end ? "…" : "";
    return vd_failure(code, "function, line %d, column %zu: %s\n  %s%s%s\n  %*s^", line, column,
                      sentence, left, excerpt, right, (int)(caret + (begin > line_begin)), "");
}
