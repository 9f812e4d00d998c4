/* impostor_tint.c: colours over impostors that tell what they are.
 *
 * Over each picture lies another of one colour, with a firm edge, on the same four corners.
 */
#include <math.h>
#include "core/core.h"
#include "impostor/impostor_set.h"

enum { SIDE = 64, EDGE = 2, SHADES = 16 };

/* The age of the last shade, seconds. */
#define OLDEST_S 4.0

/* How opaque a tint is inside: of 255. */
#define INSIDE 96u

/* After Smith and van der Walt (2015), viridis, so that colour-blind people tell them apart. */
static const uint8_t shades[SHADES][3] = {
    {68, 1, 84},    {72, 26, 108},  {71, 47, 125},  {65, 68, 135},  {57, 86, 140},  {49, 104, 142},
    {42, 120, 142}, {35, 136, 142}, {31, 152, 139}, {34, 168, 132}, {53, 183, 121}, {84, 197, 104},
    {122, 209, 81}, {165, 219, 54}, {210, 226, 27}, {253, 231, 37}};

vd_status vd_impostor_make_tints(vd_impostors *set) {
    if (set->tints != NULL) {
        return vd_success();
    }
    set->tints = vd_allocate(set->context, (size_t)SHADES * SIDE * SIDE, 4);
    if (set->tints == NULL) {
        return vd_out_of_memory("impostors' colours", (size_t)SHADES * SIDE * SIDE * 4);
    }
    for (int shade = 0; shade < SHADES; shade++) {
        for (int at = 0; at < SIDE * SIDE; at++) {
            const int x = at % SIDE, y = at / SIDE;
            const bool edge = x < EDGE || y < EDGE || x >= SIDE - EDGE || y >= SIDE - EDGE;
            const unsigned alpha = edge ? 255u : INSIDE;
            uint8_t *to = set->tints + 4 * ((size_t)shade * SIDE * SIDE + (size_t)at);
            for (int k = 0; k < 3; k++) {
                to[k] = (uint8_t)((shades[shade][k] * alpha + 127u) / 255u);
            }
            to[3] = (uint8_t)alpha;
        }
    }
    return vd_success();
}

/* How much of what is shown: 0 … 1. Bounds: of patches and of things. */
static double amount_of(const vd_impostors *set, const vd_impostor_slot *slot) {
    switch (set->def.show) {
    case VD_IMPOSTOR_SHOW_AGE:
        return (set->time_s - slot->born_s) / OLDEST_S;
    case VD_IMPOSTOR_SHOW_ERROR:
        return slot->error_px / (2.0 * fmax(set->def.tolerance_px, 0.5));
    default:
        return vd_impostor_is_patch(set, slot->node) ? 0.5 : 1.0;
    }
}

vd_quad_picture vd_impostor_tint(const vd_impostors *set, const vd_impostor_slot *slot) {
    const double amount = amount_of(set, slot) * SHADES;
    const int shade = amount < SHADES - 1 ? (amount > 0.0 ? (int)amount : 0) : SHADES - 1;
    return (vd_quad_picture){.rgba = set->tints + 4 * (size_t)shade * SIDE * SIDE,
                             .width = SIDE,
                             .height = SIDE,
                             .stride = SIDE};
}
