/* colormap.c: the built-in colour maps, and looking a colour up. */
#include <math.h>
#include <string.h>
#include "terrain/colormap_internal.h"

typedef struct builtin {
    const char *name;
    bool relative;
    int count;
    const vd_colormap_stop *stops;
} builtin;

/* Hypsometric tints in the manner of Patterson and Kelso's cross-blended ones (Cartographic
 * Perspectives 2004): a green valley, straw and tan slopes, grey rock, snow. Pale, because shading
 * still darkens them. */
static const vd_colormap_stop terrain[] = {
    {0.00, {103, 141, 96, 255}},  {0.09, {129, 161, 107, 255}}, {0.20, {165, 184, 126, 255}},
    {0.31, {202, 202, 151, 255}}, {0.43, {213, 194, 151, 255}}, {0.54, {192, 168, 132, 255}},
    {0.64, {169, 151, 129, 255}}, {0.74, {172, 165, 156, 255}}, {0.84, {208, 207, 204, 255}},
    {0.94, {241, 242, 244, 255}}, {1.00, {252, 252, 254, 255}},
};

/* The same for dry land: sand, ochre, red rock, pale crests. */
static const vd_colormap_stop arid[] = {
    {0.00, {188, 170, 132, 255}}, {0.20, {214, 192, 148, 255}}, {0.40, {216, 174, 124, 255}},
    {0.60, {188, 132, 96, 255}},  {0.78, {158, 108, 88, 255}},  {0.90, {184, 152, 134, 255}},
    {1.00, {236, 226, 212, 255}},
};

/* Sea and land in metres. The sea keeps height 0, where elevation models put it; land begins just
 * above. */
static const vd_colormap_stop topo[] = {
    {-8000, {22, 42, 84, 255}},   {-6000, {34, 66, 118, 255}},   {-4000, {54, 96, 152, 255}},
    {-2000, {88, 136, 184, 255}}, {-1000, {114, 162, 202, 255}}, {-200, {150, 192, 220, 255}},
    {-50, {176, 210, 230, 255}},  {0, {196, 222, 236, 255}},     {0.1, {98, 142, 96, 255}},
    {100, {120, 157, 103, 255}},  {300, {150, 176, 117, 255}},   {700, {190, 196, 142, 255}},
    {1200, {212, 194, 150, 255}}, {1800, {194, 168, 132, 255}},  {2400, {170, 150, 128, 255}},
    {3000, {166, 160, 154, 255}}, {3600, {196, 196, 196, 255}},  {4400, {238, 240, 242, 255}},
    {6000, {255, 255, 255, 255}},
};

/* Every 17th of the 256 colours of matplotlib's viridis and magma (Smith & van der Walt 2015,
 * CC0). */
static const vd_colormap_stop viridis[] = {
    {0.0 / 15, {68, 1, 84, 255}},     {1.0 / 15, {72, 26, 108, 255}},
    {2.0 / 15, {71, 47, 125, 255}},   {3.0 / 15, {65, 68, 135, 255}},
    {4.0 / 15, {57, 86, 140, 255}},   {5.0 / 15, {49, 104, 142, 255}},
    {6.0 / 15, {42, 120, 142, 255}},  {7.0 / 15, {35, 136, 142, 255}},
    {8.0 / 15, {31, 152, 139, 255}},  {9.0 / 15, {34, 168, 132, 255}},
    {10.0 / 15, {53, 183, 121, 255}}, {11.0 / 15, {84, 197, 104, 255}},
    {12.0 / 15, {122, 209, 81, 255}}, {13.0 / 15, {165, 219, 54, 255}},
    {14.0 / 15, {210, 226, 27, 255}}, {15.0 / 15, {253, 231, 37, 255}},
};

static const vd_colormap_stop magma[] = {
    {0.0 / 15, {0, 0, 4, 255}},        {1.0 / 15, {11, 9, 36, 255}},
    {2.0 / 15, {32, 17, 75, 255}},     {3.0 / 15, {59, 15, 112, 255}},
    {4.0 / 15, {87, 21, 126, 255}},    {5.0 / 15, {114, 31, 129, 255}},
    {6.0 / 15, {140, 41, 129, 255}},   {7.0 / 15, {168, 50, 125, 255}},
    {8.0 / 15, {196, 60, 117, 255}},   {9.0 / 15, {222, 73, 104, 255}},
    {10.0 / 15, {241, 96, 93, 255}},   {11.0 / 15, {250, 127, 94, 255}},
    {12.0 / 15, {254, 159, 109, 255}}, {13.0 / 15, {254, 191, 132, 255}},
    {14.0 / 15, {253, 222, 160, 255}}, {15.0 / 15, {252, 253, 191, 255}},
};

static const vd_colormap_stop grey[] = {{0.0, {0, 0, 0, 255}}, {1.0, {255, 255, 255, 255}}};

static const vd_colormap_stop white[] = {{0.0, {255, 255, 255, 255}}};

#define COUNT(array) ((int)(sizeof(array) / sizeof((array)[0])))

static const builtin builtins[] = {
    {"terrain", true, COUNT(terrain), terrain}, {"viridis", true, COUNT(viridis), viridis},
    {"grey", true, COUNT(grey), grey},          {"magma", true, COUNT(magma), magma},
    {"topo", false, COUNT(topo), topo},         {"arid", true, COUNT(arid), arid},
    {"white", true, COUNT(white), white},
};

const char *vd_colormap_name(int index) {
    return index >= 0 && index < COUNT(builtins) ? builtins[index].name : NULL;
}

bool vd_colormap_find(const char *name, vd_colormap *out) {
    for (int i = 0; name && out && i < COUNT(builtins); i++) {
        if (strcmp(builtins[i].name, name) == 0) {
            out->count = builtins[i].count;
            out->relative = builtins[i].relative;
            memcpy(out->stops, builtins[i].stops,
                   (size_t)builtins[i].count * sizeof builtins[i].stops[0]);
            return true;
        }
    }
    return false;
}

static uint8_t mix(uint8_t a, uint8_t b, double t) {
    return (uint8_t)floor((double)a + t * ((double)b - (double)a) + 0.5);
}

vd_rgba8 vd_colormap_at(const vd_colormap *map, double value, double min, double max) {
    if (map->relative) {
        value = max > min ? (value - min) / (max - min) : 0.0;
    }
    const vd_colormap_stop *stops = map->stops;
    if (!(value >= stops[0].value)) {
        return stops[0].color; /* below, or NaN */
    }
    /* The last stop at or below the value: of two equal ones the upper side of the step. */
    int low = 0, high = map->count;
    while (high - low > 1) {
        int middle = low + (high - low) / 2;
        if (stops[middle].value <= value) {
            low = middle;
        } else {
            high = middle;
        }
    }
    const vd_colormap_stop *a = &stops[low];
    if (low == map->count - 1 || a->value == value) {
        return a->color;
    }
    const vd_colormap_stop *b = a + 1;
    double t = (value - a->value) / (b->value - a->value);
    t = t > 0.0 ? t : 0.0; /* infinities among the values may give NaN */
    t = t < 1.0 ? t : 1.0;
    vd_rgba8 color = {mix(a->color.r, b->color.r, t), mix(a->color.g, b->color.g, t),
                      mix(a->color.b, b->color.b, t), mix(a->color.a, b->color.a, t)};
    return color;
}
