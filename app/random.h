/* random.h: numbers at random that are the same on every machine. */
#ifndef VEDUTA_APP_RANDOM_H
#define VEDUTA_APP_RANDOM_H

#include <stdint.h>

/* SplitMix64 (Steele, Lea, Flood 2014): uniform in [0, 1). */
static inline double vd_uniform(uint64_t *state) {
    uint64_t z = (*state += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

#endif
