/* colormap.h: colours by height.
 *
 * A colormap is a list of stops, each a value and a colour, interpolated in encoded sRGB. Relative
 * maps have values from 0 to 1 that are stretched over the range of the data; absolute ones have
 * metres. Of the built-in maps only "topo" is absolute. Files (GMT .cpt, gdaldem color-relief text)
 * say which they are.
 */
#ifndef VEDUTA_COLORMAP_H
#define VEDUTA_COLORMAP_H

#include <stdbool.h>
#include <veduta/color.h>
#include <veduta/context.h>

VD_BEGIN_DECLARATIONS

#define VD_COLORMAP_MAX_STOPS 1024

typedef struct vd_colormap_stop {
    double value;
    vd_rgba8 color;
} vd_colormap_stop;

typedef struct vd_colormap {
    int count;     /* stops in use, at least 1, values ascending (two equal values are a step) */
    bool relative; /* values are 0 … 1 of the data's range */
    vd_colormap_stop stops[VD_COLORMAP_MAX_STOPS];
} vd_colormap;

/* Returns the name of built-in map `index`, null past the last: terrain, viridis, grey, magma, topo
 * (sea and land, absolute metres), arid, white. */
VD_API const char *vd_colormap_name(int index);

/* Finds a built-in map by name; false when there is none. */
VD_API bool vd_colormap_find(const char *name, vd_colormap *out);

/* Reads a GMT .cpt (RGB, HSV, CMYK, grey and colour names; slices, B and F; N is passed over; maps
 * normalised to 0 … 1 or −1 … 1 are stretched to their RANGE about their HINGE, and are relative
 * without one) or a gdaldem color-relief text (values or percentages; colour names; nv is passed
 * over), told apart by contents. Returns VD_ERROR_IO, VD_ERROR_FORMAT (with the line's number),
 * VD_ERROR_LIMIT or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_colormap_load(vd_context *context, const char *path,
                                              vd_colormap *out);
VD_API VD_MUST_USE vd_status vd_colormap_decode(const char *text, size_t size_bytes,
                                                const char *name, vd_colormap *out);

/* Returns the colour of a value; below the first and above the last stop theirs. `min` and `max`
 * are the data's range, used by relative maps. */
VD_API vd_rgba8 vd_colormap_at(const vd_colormap *map, double value, double min, double max);

VD_END_DECLARATIONS

#endif
