/* text.h: fonts, and text as outlines (library veduta-text).
 *
 * FreeType reads fonts, HarfBuzz shapes: kerning, ligatures, marks, the joined forms of Arabic.
 * Outlines are taken in the font's own units, without hinting, and scaled here, so that a text has
 * the same shape at every size and place, and a picture the same bytes on every machine that has
 * the same font file and HarfBuzz. docs/text.md shows it.
 *
 *     status = vd_font_find(context, NULL, &font);
 *     status = vd_font_outline(font, "Mont Blanc 4806 m", 24.0, &outline);
 *     layer.path = outline.path;
 *     …
 *     vd_outline_finish(&outline);
 *     vd_font_destroy(&font);
 */
#ifndef VEDUTA_TEXT_H
#define VEDUTA_TEXT_H

#include <veduta/outline.h>

VD_BEGIN_DECLARATIONS

#define VD_TEXT_MAX_BYTES 4096                       /* of one text */
#define VD_FONT_MAX_BYTES ((size_t)64 * 1024 * 1024) /* of a font's file */

typedef struct vd_font vd_font;

/* Reads a TrueType or OpenType font (.ttf, .otf, of a .ttc the first), whole, into the context's
 * memory; HarfBuzz alone allocates past it. *out is owned by the caller. One thread at a time may
 * use a font. Returns VD_ERROR_ARGUMENT (a null pointer), VD_ERROR_IO, VD_ERROR_FORMAT (no font, or
 * damaged), VD_ERROR_UNSUPPORTED (a font of bitmaps, or of another format), VD_ERROR_LIMIT or
 * VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_font_create(vd_context *context, const char *path, vd_font **out);
VD_API void vd_font_destroy(vd_font **font);

/* Finds a font: `name` is a file, or one of the families below with or without " Bold", in any
 * case; null or empty: the first of them that is there. Looked for below /usr/share/fonts and
 * /usr/local/share/fonts where Debian, Fedora, Arch and openSUSE keep them: DejaVu Sans, Liberation
 * Sans, Noto Sans. Returns as vd_font_create; VD_ERROR_IO also when none of them is installed, with
 * the package that brings one. */
VD_API VD_MUST_USE vd_status vd_font_find(vd_context *context, const char *name, vd_font **out);

/* The file that the font came from, and the family's name that stands in it ("" where none does).
 * They live as long as the font. */
VD_API const char *vd_font_path(const vd_font *font);
VD_API const char *vd_font_family(const vd_font *font);

/* Shapes a line of text and gives its outlines. Line breaks and tabs are drawn as spaces; bytes
 * that are no UTF-8, one for each maximal part of a sequence, and control characters as U+FFFD.
 * Text that runs from right to left, or both ways, is ordered as readers of it expect (Unicode
 * Annex 9 without embeddings and the pairs of brackets; the line's direction is its first letter's)
 * and starts at the left as all does. `size_px` is the em, 1/64 … 65536 pixels. Cost: some
 * microseconds a glyph. Returns VD_ERROR_ARGUMENT (a null pointer, the size), VD_ERROR_LIMIT (a
 * text longer than VD_TEXT_MAX_BYTES), VD_ERROR_FORMAT (a glyph is damaged) or VD_ERROR_MEMORY; on
 * failure *out is untouched. */
VD_API VD_MUST_USE vd_status vd_font_outline(vd_font *font, const char *utf8, double size_px,
                                             vd_outline *out);

VD_END_DECLARATIONS

#endif
