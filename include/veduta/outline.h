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

VD_END_DECLARATIONS

#endif
