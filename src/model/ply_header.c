/* ply_header.c: what elements a PLY file has, and what their numbers are for. */
#include <string.h>
#include "model/ply.h"

static vd_status bad_header(const vd_ply *p, const char *what) {
    return vd_failure(VD_ERROR_FORMAT,
                      "cannot read %.160s: line %d of its header %s; get the file again",
                      p->builder->path, p->text.line, what);
}

static vd_ply_use find_use(vd_ply_kind kind, const char *name, bool is_list) {
    static const struct {
        vd_ply_kind kind;
        bool is_list;
        const char *name;
        vd_ply_use use;
    } uses[] = {{VERTEX, false, "x", USE_X},
                {VERTEX, false, "y", USE_Y},
                {VERTEX, false, "z", USE_Z},
                {VERTEX, false, "nx", USE_NX},
                {VERTEX, false, "ny", USE_NY},
                {VERTEX, false, "nz", USE_NZ},
                {VERTEX, false, "s", USE_U},
                {VERTEX, false, "t", USE_V},
                {VERTEX, false, "u", USE_U},
                {VERTEX, false, "v", USE_V},
                {VERTEX, false, "texture_u", USE_U},
                {VERTEX, false, "texture_v", USE_V},
                {VERTEX, false, "red", USE_RED},
                {VERTEX, false, "green", USE_GREEN},
                {VERTEX, false, "blue", USE_BLUE},
                {VERTEX, false, "diffuse_red", USE_RED},
                {VERTEX, false, "diffuse_green", USE_GREEN},
                {VERTEX, false, "diffuse_blue", USE_BLUE},
                {FACE, true, "vertex_indices", USE_CORNERS},
                {FACE, true, "vertex_index", USE_CORNERS},
                {FACE, true, "texcoord", USE_TEXCOORD},
                {STRIP, true, "vertex_indices", USE_CORNERS},
                {STRIP, true, "vertex_index", USE_CORNERS},
                {EDGE, false, "vertex1", USE_FIRST},
                {EDGE, false, "vertex2", USE_SECOND}};
    for (size_t i = 0; i < sizeof uses / sizeof uses[0]; i++) {
        if (uses[i].kind == kind && uses[i].is_list == is_list && strcmp(uses[i].name, name) == 0) {
            return uses[i].use;
        }
    }
    return USE_NONE;
}

static vd_status read_element(vd_ply *p) {
    static const struct {
        const char *name;
        vd_ply_kind kind;
    } kinds[] = {{"vertex", VERTEX}, {"face", FACE}, {"tristrips", STRIP}, {"edge", EDGE}};
    int64_t count = 0;
    if (p->element_count == VD_PLY_MOST_ELEMENTS) {
        return bad_header(p, "has more than 32 kinds of elements");
    }
    vd_ply_element *e = &p->elements[p->element_count];
    memset(e, 0, sizeof *e);
    if (!vd_text_word(&p->text, e->name, sizeof e->name) || !vd_read_integer(&p->text, &count) ||
        count < 0) {
        return bad_header(p, "is no element with a count");
    }
    e->count = (uint64_t)count;
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        e->kind = strcmp(e->name, kinds[i].name) == 0 ? kinds[i].kind : e->kind;
    }
    for (int i = 0; i < p->element_count; i++) {
        if (e->kind != OTHER && p->elements[i].kind == e->kind) {
            return bad_header(p, "repeats an element");
        }
    }
    p->element_count++;
    return vd_success();
}

static vd_status read_property(vd_ply *p) {
    char type[16], count_type[16], name[64];
    vd_ply_property made = {USE_NONE, false, VD_NUMBER_U8, VD_NUMBER_F32};
    vd_ply_element *e = p->element_count > 0 ? &p->elements[p->element_count - 1] : NULL;
    if (e == NULL || e->property_count == VD_PLY_MOST_PROPERTIES) {
        return bad_header(p, e == NULL ? "is a property of no element"
                                       : "is the 65th property of an element");
    }
    bool right = vd_text_word(&p->text, type, sizeof type);
    made.is_list = right && strcmp(type, "list") == 0;
    if (made.is_list) {
        right = vd_text_word(&p->text, count_type, sizeof count_type) &&
                vd_number_of_ply(count_type, &made.count_type) && made.count_type < VD_NUMBER_F32 &&
                vd_text_word(&p->text, type, sizeof type);
    }
    right =
        right && vd_number_of_ply(type, &made.type) && vd_text_word(&p->text, name, sizeof name);
    if (!right) {
        return bad_header(p, "is no property with a type and a name");
    }
    made.use = find_use(e->kind, name, made.is_list);
    if (e->has[made.use]) {
        made.use = USE_NONE; /* a second name for the same: s beside u */
    }
    e->has[made.use] = true;
    e->properties[e->property_count++] = made;
    return vd_success();
}

static vd_status read_format(vd_ply *p) {
    char name[32];
    vd_text_word(&p->text, name, sizeof name);
    const bool big_file = strcmp(name, "binary_big_endian") == 0;
    p->ascii = strcmp(name, "ascii") == 0;
    if (!p->ascii && !big_file && strcmp(name, "binary_little_endian") != 0) {
        return bad_header(p, "names no format that there is (ascii, binary_little_endian or "
                             "binary_big_endian)");
    }
    p->swapped = !p->ascii && vd_number_is_swapped(big_file);
    strcpy(p->builder->model->format, p->ascii ? "PLY, ASCII" : "PLY, binary");
    return vd_success();
}

static void read_comment(vd_ply *p) {
    char word[32];
    if (vd_text_word(&p->text, word, sizeof word) && strcmp(word, "TextureFile") == 0) {
        vd_skip_spaces(&p->text);
        size_t n = 0;
        for (const char *c = p->text.at; c < p->text.end && *c != '\n' && *c != '\r'; c++) {
            p->texture[n] = *c;
            n += n + 1 < sizeof p->texture;
        }
        p->texture[n] = '\0';
    }
}

vd_status vd_ply_read_header(vd_ply *p) {
    char word[32];
    bool format = false;
    if (!vd_text_word(&p->text, word, sizeof word) || strcmp(word, "ply") != 0) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %.200s: it does not begin with \"ply\"; it is no PLY file",
                          p->builder->path);
    }
    for (;;) {
        vd_text_next_line(&p->text);
        if (vd_text_done(&p->text)) {
            return bad_header(p, "is the last: \"end_header\" is missing");
        }
        vd_status status = vd_success();
        if (!vd_text_word(&p->text, word, sizeof word)) {
            continue;
        }
        if (strcmp(word, "end_header") == 0) {
            vd_text_next_line(&p->text);
            return format ? status : bad_header(p, "ends it without a format");
        }
        if (strcmp(word, "format") == 0) {
            status = read_format(p);
            format = true;
        } else if (strcmp(word, "element") == 0) {
            status = read_element(p);
        } else if (strcmp(word, "property") == 0) {
            status = read_property(p);
        } else if (strcmp(word, "comment") == 0) {
            read_comment(p);
        } else if (strcmp(word, "obj_info") != 0) {
            status = bad_header(p, "begins with a word that no PLY header has");
        }
        if (status.code != VD_OK) {
            return status;
        }
    }
}
