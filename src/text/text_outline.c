/* text_outline.c: a line of text shaped, and its glyphs as one path. */
#include "text/font.h"
#include "text/text_runs.h"

#include <math.h>
#include <string.h>
#include FT_BBOX_H
#include FT_OUTLINE_H

/* The path while it is made. In a first round nothing is written, only counted. */
typedef struct pen {
    double (*points)[2]; /* null in the first round */
    uint8_t *verbs;
    size_t point_count, verb_count;
    double scale;      /* pixels a font unit */
    int64_t x, y;      /* where the glyph begins, font units, y up */
    bool open;         /* a contour has begun */
    int64_t bounds[4]; /* of what is inked, font units, y up: x0, y0, x1, y1 */
    bool inked;
    int missing;
} pen;

/* ---- glyphs -------------------------------------------------------------------------------------
 */

static void add(pen *p, vd_path_verb verb, int count, const FT_Vector *const at[]) {
    if (p->points != NULL) {
        for (int i = 0; i < count; i++) {
            double *to = p->points[p->point_count + (size_t)i];
            to[0] = (double)(p->x + at[i]->x) * p->scale;
            to[1] = (double)(p->y + at[i]->y) * -p->scale;
        }
        p->verbs[p->verb_count] = (uint8_t)verb;
    }
    p->point_count += (size_t)count;
    p->verb_count++;
}

static void close_contour(pen *p) {
    if (p->open) {
        add(p, VD_PATH_CLOSE, 0, NULL);
    }
    p->open = false;
}

static int move_to(const FT_Vector *to, void *user) {
    close_contour(user);
    add(user, VD_PATH_MOVE, 1, &to);
    ((pen *)user)->open = true;
    return 0;
}

static int line_to(const FT_Vector *to, void *user) {
    add(user, VD_PATH_LINE, 1, &to);
    return 0;
}

static int conic_to(const FT_Vector *control, const FT_Vector *to, void *user) {
    const FT_Vector *const at[] = {control, to};
    add(user, VD_PATH_QUADRATIC, 2, at);
    return 0;
}

static int cubic_to(const FT_Vector *first, const FT_Vector *second, const FT_Vector *to,
                    void *user) {
    const FT_Vector *const at[] = {first, second, to};
    add(user, VD_PATH_CUBIC, 3, at);
    return 0;
}

/* Takes a glyph's bounds into those of the text. */
static void take_bounds(pen *p, FT_Outline *outline) {
    FT_BBox box;
    if (outline->n_points == 0 || FT_Outline_Get_BBox(outline, &box) != FT_Err_Ok) {
        return;
    }
    const int64_t found[4] = {p->x + box.xMin, p->y + box.yMin, p->x + box.xMax, p->y + box.yMax};
    for (int i = 0; i < 4; i++) {
        const bool beyond = i < 2 ? found[i] < p->bounds[i] : found[i] > p->bounds[i];
        p->bounds[i] = !p->inked || beyond ? found[i] : p->bounds[i];
    }
    p->inked = true;
}

static vd_status draw_glyph(vd_font *font, pen *p, uint32_t glyph) {
    static const FT_Outline_Funcs functions = {move_to, line_to, conic_to, cubic_to, 0, 0};
    FT_Error error = FT_Load_Glyph(font->face, glyph, FT_LOAD_NO_SCALE);
    if (error == FT_Err_Ok && font->face->glyph->format == FT_GLYPH_FORMAT_OUTLINE) {
        FT_Outline *outline = &font->face->glyph->outline;
        take_bounds(p, outline);
        error = FT_Outline_Decompose(outline, &functions, p);
        close_contour(p);
    }
    if (error == FT_Err_Out_Of_Memory) {
        return vd_text_out_of_memory("a glyph");
    }
    if (error != FT_Err_Ok) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot draw with the font %.200s: its glyph %u is damaged (FreeType's "
                          "error %d); get the file again",
                          font->path, (unsigned)glyph, (int)error);
    }
    return vd_success();
}

/* ---- shaping ------------------------------------------------------------------------------------
 */

/* A glyph where it stands, font units. */
typedef struct placed {
    uint32_t glyph;
    int64_t x, y;
} placed;

/* A text while it is shaped: arrays of one block, for as many characters as it has bytes. */
typedef struct line {
    uint32_t *characters;
    vd_text_note *notes;
    vd_text_run *runs;
    size_t count, run_count;
    placed *glyphs; /* grows */
    size_t glyph_count, glyph_capacity;
    int64_t x; /* where the next run begins */
    int replaced;
} line;

static vd_status add_glyphs(vd_font *font, line *l) {
    unsigned count = 0;
    const hb_glyph_info_t *infos = hb_buffer_get_glyph_infos(font->buffer, &count);
    const hb_glyph_position_t *positions = hb_buffer_get_glyph_positions(font->buffer, &count);
    if (l->glyph_count + count > l->glyph_capacity) {
        const size_t capacity = 2 * (l->glyph_count + count);
        placed *made = vd_allocate(font->context, capacity, sizeof *made);
        if (made == NULL) {
            return vd_text_out_of_memory("a text's glyphs");
        }
        if (l->glyph_count > 0) {
            memcpy(made, l->glyphs, l->glyph_count * sizeof *made);
        }
        vd_release(font->context, l->glyphs);
        l->glyphs = made;
        l->glyph_capacity = capacity;
    }
    for (unsigned i = 0; i < count; i++) {
        l->glyphs[l->glyph_count++] =
            (placed){infos[i].codepoint, l->x + positions[i].x_offset, positions[i].y_offset};
        l->x += positions[i].x_advance;
    }
    return vd_success();
}

static vd_status shape_run(vd_font *font, line *l, const vd_text_run *run) {
    /* Named, or HarfBuzz would look into the environment. */
    static const char *const shapers[] = {"ot", "fallback", NULL};
    hb_buffer_t *buffer = font->buffer;
    hb_buffer_clear_contents(buffer);
    hb_buffer_add_codepoints(buffer, l->characters, (int)l->count, (unsigned)run->begin,
                             (int)run->count);
    hb_buffer_set_content_type(buffer, HB_BUFFER_CONTENT_TYPE_UNICODE);
    hb_buffer_set_script(buffer, run->script);
    hb_buffer_set_direction(buffer, run->right_to_left ? HB_DIRECTION_RTL : HB_DIRECTION_LTR);
    if (!hb_buffer_allocation_successful(buffer) ||
        !hb_shape_full(font->shaper, buffer, NULL, 0, shapers)) {
        return vd_text_out_of_memory("a text's shaper");
    }
    return add_glyphs(font, l);
}

static vd_status shape(vd_font *font, line *l, const char *utf8, size_t size_bytes) {
    l->notes = vd_allocate(font->context, size_bytes + 1,
                           sizeof *l->notes + sizeof *l->runs + sizeof *l->characters);
    if (l->notes == NULL) {
        return vd_text_out_of_memory("a text");
    }
    /* The runs first: they are aligned to more than the others. */
    l->runs = (vd_text_run *)l->notes;
    l->notes = (vd_text_note *)(l->runs + size_bytes + 1);
    l->characters = (uint32_t *)(l->notes + size_bytes + 1);
    l->count = vd_text_decode(utf8, size_bytes, l->characters, &l->replaced);
    l->run_count = vd_text_split(l->characters, l->count, l->notes, l->runs);
    vd_status status = vd_success();
    for (size_t i = 0; i < l->run_count && status.code == VD_OK; i++) {
        status = shape_run(font, l, &l->runs[i]);
    }
    return status;
}

/* ---- the whole ----------------------------------------------------------------------------------
 */

/* Draws all glyphs with the pen, which counts or writes. */
static vd_status draw_line(vd_font *font, const line *l, pen *p) {
    p->point_count = p->verb_count = 0;
    p->missing = 0;
    vd_status status = vd_success();
    for (size_t i = 0; i < l->glyph_count && status.code == VD_OK; i++) {
        p->x = l->glyphs[i].x;
        p->y = l->glyphs[i].y;
        p->missing += l->glyphs[i].glyph == 0;
        status = draw_glyph(font, p, l->glyphs[i].glyph);
    }
    return status;
}

static vd_status make_outline(vd_font *font, const line *l, double scale, vd_outline *out) {
    pen p = {.scale = scale};
    vd_status status = draw_line(font, l, &p);
    if (status.code != VD_OK) {
        return status;
    }
    if (p.point_count > 0) {
        p.points = vd_allocate(font->context, p.point_count * sizeof *p.points + p.verb_count, 1);
        if (p.points == NULL) {
            return vd_text_out_of_memory("a text's outline");
        }
        p.verbs = (uint8_t *)(p.points + p.point_count);
        status = draw_line(font, l, &p);
        if (status.code != VD_OK) {
            vd_release(font->context, p.points);
            return status;
        }
    }
    const FT_Face face = font->face;
    *out = (vd_outline){.context = font->context,
                        .path = {.points = (const double(*)[2])p.points,
                                 .point_count = p.point_count,
                                 .verbs = p.verbs,
                                 .verb_count = p.verb_count},
                        .advance = (double)l->x * scale,
                        .ascent = face->ascender * scale,
                        .descent = -face->descender * scale,
                        .missing = p.missing,
                        .replaced = l->replaced};
    if (p.inked) {
        out->ink[0] = (double)p.bounds[0] * scale;
        out->ink[1] = (double)-p.bounds[3] * scale;
        out->ink[2] = (double)p.bounds[2] * scale;
        out->ink[3] = (double)-p.bounds[1] * scale;
    }
    return vd_success();
}

vd_status vd_font_outline(vd_font *font, const char *utf8, double size_px, vd_outline *out) {
    if (font == NULL || utf8 == NULL || out == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "vd_font_outline: font, text and out must be given");
    }
    if (!(size_px >= 1.0 / 64 && size_px <= 65536)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "vd_font_outline: a size of %g pixels; give 1/64 to 65536", size_px);
    }
    const size_t size_bytes = strnlen(utf8, VD_TEXT_MAX_BYTES + 1);
    if (size_bytes > VD_TEXT_MAX_BYTES) {
        return vd_failure(VD_ERROR_LIMIT,
                          "the text \"%.40s…\" is longer than %d bytes; give it in parts", utf8,
                          VD_TEXT_MAX_BYTES);
    }
    line l = {0};
    vd_status status = shape(font, &l, utf8, size_bytes);
    if (status.code == VD_OK) {
        status = make_outline(font, &l, size_px / font->face->units_per_EM, out);
    }
    vd_release(font->context, l.glyphs);
    vd_release(font->context, l.runs); /* the block begins with them */
    return status;
}
