/* outline.h: a line of text as a path.
 *
 * What fonts make of text (text.h, in the library veduta-text) and what draws text without knowing
 * of fonts (furniture.h) agree on this. A layer takes the path as it is:
 *
 *     vd_layer layer = vd_layer_default();
 *     layer.path = outline.path;
 *     layer.picture_from_path.x0 = x;
 *     layer.picture_from_path.y0 = baseline_y;
 */
#ifndef VEDUTA_OUTLINE_H
#define VEDUTA_OUTLINE_H

#include <veduta/color.h>
#include <veduta/coverage.h>

VD_BEGIN_DECLARATIONS

/* Pixels, x to the right, y down; the baseline begins at (0, 0). All zero: an empty text. */
typedef struct vd_outline {
    vd_context *context;    /* whose memory the path's arrays are; null: they are borrowed */
    vd_path path;           /* glyphs from left to right, filled by the non-zero rule; its points
                               and verbs are one block that begins with the points */
    double advance;         /* where the next text would begin */
    double ascent, descent; /* of every line of this font and size, above and below the baseline;
                               both as lengths: a font's descent is usually positive */
    double ink[4];          /* x0, y0, x1, y1 of what is inked; all 0: nothing is */
    int missing;            /* glyphs that the font lacks: boxes stand in their places */
    int replaced;           /* bytes or characters that are no text, drawn as U+FFFD */
} vd_outline;

/* Outlines a line of text (NUL-terminated UTF-8) at a size in pixels an em. *out is owned by the
 * caller and ended by vd_outline_finish; on failure it is untouched. */
typedef vd_status vd_outline_function(void *user, const char *utf8, double size_px,
                                      vd_outline *out);

/* Frees the arrays and sets everything to zero. Null and all zero are accepted. */
VD_API void vd_outline_finish(vd_outline *outline);

/* How letters look over a picture: both colours straight sRGB. */
typedef struct vd_letters {
    vd_rgba8 color;
    vd_rgba8 halo;     /* around the letters; alpha 0: none */
    double halo_width; /* on each side, picture pixels, at most 1024; 0: none */
} vd_letters;

/* White letters, readable on snow by a dark halo and on forest by themselves. A halo is a tenth of
 * an em at small sizes; large letters need less. */
VD_API vd_letters vd_letters_default(double size_px);

/* Makes the layers that draw an outline with its baseline beginning at (x, y): the halo's, then the
 * letters'. Returns how many: 1 or 2. The layers borrow the outline's path and *stroke. */
VD_API int vd_outline_layers(const vd_outline *outline, double x, double y,
                             const vd_letters *letters, vd_stroke *stroke, vd_layer layers[2]);

/* A straight 8-bit colour as layers have it: premultiplied, 65535 = 1. */
VD_API void vd_layer_color(vd_rgba8 color, uint16_t out[4]);

VD_END_DECLARATIONS

#endif
