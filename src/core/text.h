/* text.h: reading numbers and words from text, independent of the process' locale. */
#ifndef VEDUTA_CORE_TEXT_H
#define VEDUTA_CORE_TEXT_H

#include <stdbool.h>
#include <stddef.h>

/* A position in a text of known end. The text need not be NUL-terminated. */
typedef struct vd_text {
    const char *at, *end;
    int line; /* 1-based, counted by the skip functions */
} vd_text;

static inline vd_text vd_text_make(const char *text, size_t size_bytes) {
    vd_text t = {text, text + size_bytes, 1};
    return t;
}

/* Skips spaces, tabs, carriage returns; vd_text_skip_lines also line breaks. */
void vd_text_skip_blanks(vd_text *text);
void vd_text_skip_lines(vd_text *text);

/* Moves behind the next line break (or to the end). */
void vd_text_next_line(vd_text *text);

/* True at the end of the text. */
static inline bool vd_text_done(const vd_text *text) {
    return text->at >= text->end;
}

/* Reads a decimal number (optional sign, digits, point, exponent; also "nan" and "inf" in any case)
 * after blanks, correctly rounded. False, and nothing consumed, when there is none. */
bool vd_text_number(vd_text *text, double *out);

/* Reads a run of bytes that are not white space, after blanks, into `out` (NUL-terminated, cut at
 * out_bytes − 1). False when there is none on this line. */
bool vd_text_word(vd_text *text, char *out, size_t out_bytes);

#endif
