/* text_runs.h: from bytes to characters, and from characters to runs of one script and direction.
 */
#ifndef VEDUTA_TEXT_TEXT_RUNS_H
#define VEDUTA_TEXT_TEXT_RUNS_H

#include <hb.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Decodes a text into `out`, which has room for size_bytes characters; returns how many they are.
 * Tabs, line breaks and the like become spaces. What is no UTF-8 becomes U+FFFD, one for each
 * maximal part of a sequence (Unicode 15, §3.9, as browsers do), and so does a control character;
 * *replaced counts them. */
size_t vd_text_decode(const char *utf8, size_t size_bytes, uint32_t *out, int *replaced);

/* Characters that are shaped together. */
typedef struct vd_text_run {
    size_t begin, count; /* characters, in the order in which they are read */
    hb_script_t script;
    bool right_to_left;
} vd_text_run;

/* Per-character notes of vd_text_split, which the caller makes room for. */
typedef struct vd_text_note {
    hb_script_t script;
    uint8_t kind;  /* of text_runs.c */
    uint8_t level; /* of embedding, as in Unicode Annex 9 */
} vd_text_note;

/* Splits `count` characters into runs, in the order in which they stand from left to right; at most
 * `count` of them. Returns how many. `notes` is [count]. */
size_t vd_text_split(const uint32_t *characters, size_t count, vd_text_note *notes,
                     vd_text_run *runs);

#endif
