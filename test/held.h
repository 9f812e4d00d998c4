/* held.h: a picture that a client of a test holds. */
#ifndef VEDUTA_TEST_HELD_H
#define VEDUTA_TEST_HELD_H

#include <veduta/display.h>

enum { MOST_HELD = 4096 };

typedef struct held {
    uint64_t id;
    uint32_t version;
    vd_vec3 corners[4];
    uint8_t *rgba;
    vd_quad_picture picture;
} held;

#endif
