/* font.c: fonts from files. */
#include "text/font.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include FT_MODULE_H

vd_status vd_text_out_of_memory(const char *what) {
    return vd_failure(VD_ERROR_MEMORY, "out of memory for %s; close other programs", what);
}

/* ---- FreeType's memory --------------------------------------------------------------------------
 */

static void *allocate(FT_Memory memory, long size) {
    return vd_allocate(memory->user, (size_t)size, 1);
}

static void release(FT_Memory memory, void *block) {
    vd_release(memory->user, block);
}

static void *reallocate(FT_Memory memory, long old_size, long size, void *block) {
    void *made = vd_allocate(memory->user, (size_t)size, 1);
    if (made != NULL) {
        memcpy(made, block, (size_t)(old_size < size ? old_size : size));
        vd_release(memory->user, block);
    }
    return made;
}

/* ---- reading ------------------------------------------------------------------------------------
 */

static vd_status read_file(vd_font *font, const char *path) {
    struct stat about;
    FILE *file = fopen(path, "rb");
    if (file == NULL || fstat(fileno(file), &about) != 0 || !S_ISREG(about.st_mode)) {
        const vd_status status =
            vd_failure(VD_ERROR_IO, "cannot open the font %.200s: %s; give a .ttf or .otf file",
                       path, file == NULL ? strerror(errno) : "it is not a file");
        if (file != NULL) {
            fclose(file);
        }
        return status;
    }
    vd_status status = vd_success();
    font->size_bytes = (size_t)about.st_size;
    if (font->size_bytes > VD_FONT_MAX_BYTES) {
        status = vd_failure(VD_ERROR_LIMIT,
                            "the font %.200s has %zu bytes; fonts of at most 64 MiB are read", path,
                            font->size_bytes);
    } else {
        font->data = vd_allocate(font->context, font->size_bytes, 1);
        if (font->data == NULL) {
            status = vd_text_out_of_memory("a font's file");
        } else if (fread(font->data, 1, font->size_bytes, file) != font->size_bytes) {
            status = vd_failure(VD_ERROR_IO, "cannot read the font %.200s: %s", path,
                                ferror(file) ? strerror(errno) : "it became shorter meanwhile");
        }
    }
    fclose(file);
    return status;
}

static vd_status open_face(vd_font *font) {
    font->memory = (struct FT_MemoryRec_){
        .user = font->context, .alloc = allocate, .free = release, .realloc = reallocate};
    FT_Error error = FT_New_Library(&font->memory, &font->library);
    if (error == FT_Err_Ok) {
        FT_Add_Default_Modules(font->library);
        error = FT_New_Memory_Face(font->library, font->data, (FT_Long)font->size_bytes, 0,
                                   &font->face);
    }
    if (error == FT_Err_Out_Of_Memory) {
        return vd_text_out_of_memory("a font");
    }
    if (error != FT_Err_Ok) {
        return vd_failure(
            VD_ERROR_FORMAT,
            "cannot read the font %.200s: it is no font, or damaged (FreeType's error "
            "%d); give a .ttf or .otf file",
            font->path, (int)error);
    }
    if (!FT_IS_SCALABLE(font->face) || !FT_IS_SFNT(font->face) || font->face->units_per_EM == 0) {
        return vd_failure(VD_ERROR_UNSUPPORTED,
                          "cannot use the font %.200s: its letters are not TrueType or OpenType "
                          "outlines; give a .ttf or .otf file",
                          font->path);
    }
    return vd_success();
}

static vd_status open_shaper(vd_font *font) {
    hb_blob_t *blob =
        hb_blob_create(font->data, (unsigned)font->size_bytes, HB_MEMORY_MODE_READONLY, NULL, NULL);
    hb_face_t *face = hb_face_create(blob, 0);
    hb_blob_destroy(blob);
    font->shaper = hb_font_create(face);
    hb_face_destroy(face);
    /* Whole font units: no rounding depends on the size. */
    hb_font_set_scale(font->shaper, font->face->units_per_EM, font->face->units_per_EM);
    font->buffer = hb_buffer_create();
    if (font->shaper == hb_font_get_empty() || !hb_buffer_allocation_successful(font->buffer)) {
        return vd_text_out_of_memory("a font's shaper");
    }
    return vd_success();
}

vd_status vd_font_create(vd_context *context, const char *path, vd_font **out) {
    if (context == NULL || path == NULL || out == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "vd_font_create: context, path and out must be given");
    }
    vd_font *font = vd_allocate(context, 1, sizeof *font);
    if (font == NULL) {
        return vd_text_out_of_memory("a font");
    }
    memset(font, 0, sizeof *font);
    font->context = context;
    const size_t path_bytes = strlen(path) + 1;
    font->path = vd_allocate(context, path_bytes, 1);
    vd_status status = vd_text_out_of_memory("a font's path");
    if (font->path != NULL) {
        memcpy(font->path, path, path_bytes);
        status = read_file(font, path);
    }
    if (status.code == VD_OK) {
        status = open_face(font);
    }
    if (status.code == VD_OK) {
        status = open_shaper(font);
    }
    if (status.code == VD_OK) {
        *out = font;
    } else {
        vd_font_destroy(&font);
    }
    return status;
}

void vd_font_destroy(vd_font **font) {
    if (font == NULL || *font == NULL) {
        return;
    }
    vd_font *f = *font;
    hb_buffer_destroy(f->buffer); /* null is accepted by both */
    hb_font_destroy(f->shaper);
    if (f->face != NULL) {
        FT_Done_Face(f->face);
    }
    if (f->library != NULL) {
        FT_Done_Library(f->library);
    }
    vd_release(f->context, f->data);
    vd_release(f->context, f->path);
    vd_release(f->context, f);
    *font = NULL;
}

const char *vd_font_path(const vd_font *font) {
    return font->path;
}

const char *vd_font_family(const vd_font *font) {
    return font->face->family_name != NULL ? font->face->family_name : "";
}
