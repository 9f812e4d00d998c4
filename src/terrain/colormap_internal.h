/* colormap_internal.h: what the colour map readers share. */
#ifndef VEDUTA_TERRAIN_COLORMAP_INTERNAL_H
#define VEDUTA_TERRAIN_COLORMAP_INTERNAL_H

#include <stddef.h>
#include <veduta/colormap.h>

/* The two kinds of file; a few colour names differ between them. */
typedef enum vd_colormap_dialect {
    VD_COLORMAP_GMT = 0, /* X11 names */
    VD_COLORMAP_GDALDEM
} vd_colormap_dialect;

/* A run of bytes in a text. */
typedef struct vd_field {
    const char *at;
    size_t length;
} vd_field;

/* Finds a colour by name, in any case; "gray0" … "gray100" too. */
bool vd_color_find(vd_field name, vd_colormap_dialect dialect, vd_rgba8 *out);

/* A colour as a file gives it; HSV kept for interpolation. */
typedef struct vd_file_color {
    vd_rgba8 rgba;
    bool is_hsv;
    double hsv[3]; /* degrees, 0 … 1, 0 … 1 */
} vd_file_color;

/* Reads a whole field as a number. */
bool vd_field_number(vd_field field, double *out);

/* Reads one field as a colour: a name, #RGB, #RRGGBB, r/g/b, c/m/y/k in percent, h-s-v, a grey
 * level, "-" (transparent); each but the last may end in @ and a transparency in percent. */
bool vd_field_color(vd_field field, vd_colormap_dialect dialect, vd_file_color *out);

/* Three fields as red, green, blue (0 … 255) or hue, saturation, value. */
bool vd_fields_color(const vd_field fields[3], bool hsv, vd_file_color *out);

vd_rgba8 vd_color_from_hsv(double hue_deg, double saturation, double value);

#endif
