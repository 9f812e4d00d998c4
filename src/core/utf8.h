/* utf8.h: where characters end. */
#ifndef VEDUTA_CORE_UTF8_H
#define VEDUTA_CORE_UTF8_H

#include <stdint.h>

/* Bytes of the UTF-8 sequence at `text`, which ends in a NUL; 0 when it is none (Unicode 15, table
 * 3-7). */
static inline int vd_utf8_bytes(const char *at) {
    const uint8_t *text = (const uint8_t *)at;
    const uint8_t first = text[0];
    if (first < 0x80) {
        return 1;
    }
    const int count = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
    const uint8_t low = first == 0xe0 ? 0xa0 : first == 0xf0 ? 0x90 : 0x80;
    const uint8_t high = first == 0xed ? 0x9f : first == 0xf4 ? 0x8f : 0xbf;
    if (first < 0xc2 || first > 0xf4 || text[1] < low || text[1] > high) {
        return 0;
    }
    for (int i = 2; i < count; i++) {
        if ((text[i] & 0xc0) != 0x80) { /* also the NUL of a cut sequence */
            return 0;
        }
    }
    return count;
}

#endif
