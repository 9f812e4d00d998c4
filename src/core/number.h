/* number.h: numbers of binary files. */
#ifndef VEDUTA_CORE_NUMBER_H
#define VEDUTA_CORE_NUMBER_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

typedef enum vd_number_type {
    VD_NUMBER_I8 = 0,
    VD_NUMBER_U8,
    VD_NUMBER_I16,
    VD_NUMBER_U16,
    VD_NUMBER_I32,
    VD_NUMBER_U32,
    VD_NUMBER_F32,
    VD_NUMBER_F64,
    VD_NUMBER_COUNT
} vd_number_type;

static inline int vd_number_bytes(vd_number_type type) {
    static const int bytes[VD_NUMBER_COUNT] = {1, 1, 2, 2, 4, 4, 4, 8};
    return bytes[type];
}

/* The type of a PLY header's name for it, old or new; false when there is none. */
static inline bool vd_number_of_ply(const char *name, vd_number_type *out) {
    static const char *const names[VD_NUMBER_COUNT][2] = {
        {"char", "int8"}, {"uchar", "uint8"}, {"short", "int16"},   {"ushort", "uint16"},
        {"int", "int32"}, {"uint", "uint32"}, {"float", "float32"}, {"double", "float64"}};
    for (int t = 0; t < VD_NUMBER_COUNT; t++) {
        if (strcmp(name, names[t][0]) == 0 || strcmp(name, names[t][1]) == 0) {
            *out = (vd_number_type)t;
            return true;
        }
    }
    return false;
}

/* Whether a file of this byte order is not of this machine's. */
static inline bool vd_number_is_swapped(bool big_endian) {
    static const uint16_t one = 1;
    return big_endian == (*(const uint8_t *)&one == 1);
}

/* Reads a number of any alignment. */
static inline double vd_number_read(const void *at, vd_number_type type, bool swapped) {
    uint8_t byte;
    uint16_t half;
    uint32_t word;
    uint64_t twice;
    float real;
    double large;
    switch (type) {
    case VD_NUMBER_I8:
    case VD_NUMBER_U8:
        memcpy(&byte, at, sizeof byte);
        return type == VD_NUMBER_U8 ? (double)byte : (double)(int8_t)byte;
    case VD_NUMBER_I16:
    case VD_NUMBER_U16:
        memcpy(&half, at, sizeof half);
        half = swapped ? __builtin_bswap16(half) : half;
        return type == VD_NUMBER_U16 ? (double)half : (double)(int16_t)half;
    case VD_NUMBER_F64:
        memcpy(&twice, at, sizeof twice);
        twice = swapped ? __builtin_bswap64(twice) : twice;
        memcpy(&large, &twice, sizeof large);
        return large;
    default:
        memcpy(&word, at, sizeof word);
        word = swapped ? __builtin_bswap32(word) : word;
        memcpy(&real, &word, sizeof real);
        return type == VD_NUMBER_F32   ? (double)real
               : type == VD_NUMBER_U32 ? (double)word
                                       : (double)(int32_t)word;
    }
}

#endif
