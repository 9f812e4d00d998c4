/* font.h: what a font is made of. For the files of this room only. */
#ifndef VEDUTA_TEXT_FONT_H
#define VEDUTA_TEXT_FONT_H

#include <ft2build.h>
#include FT_FREETYPE_H
#include <hb.h>
#include <veduta/text.h>

struct vd_font {
    vd_context *context;
    char *path;
    void *data; /* the file; the face and the shaper read from it as long as they live */
    size_t size_bytes;
    struct FT_MemoryRec_ memory; /* FreeType's allocator: the context's */
    FT_Library library;
    FT_Face face;
    hb_font_t *shaper; /* in font units */
    hb_buffer_t *buffer;
};

/* Looks for a font below each of `roots` (ended by null); else as vd_font_find. */
VD_MUST_USE vd_status vd_font_find_below(vd_context *context, const char *const *roots,
                                         const char *name, vd_font **out);

vd_status vd_text_out_of_memory(const char *what);

#endif
