/* ply.h: what the two halves of the PLY reader share: the header's meaning. */
#ifndef VEDUTA_MODEL_PLY_H
#define VEDUTA_MODEL_PLY_H

#include "core/number.h"
#include "model/model_build.h"
#include "model/model_text.h"

#define VD_PLY_MOST_PROPERTIES 64
#define VD_PLY_MOST_ELEMENTS 32

/* What a property is for. */
typedef enum vd_ply_use {
    USE_NONE = 0,
    USE_X,
    USE_Y,
    USE_Z,
    USE_NX,
    USE_NY,
    USE_NZ,
    USE_U,
    USE_V,
    USE_RED,
    USE_GREEN,
    USE_BLUE,
    USE_CORNERS,  /* list: a face or strip */
    USE_TEXCOORD, /* list: u and v of each corner of a face */
    USE_FIRST,    /* of an edge */
    USE_SECOND,
    USE_COUNT
} vd_ply_use;

typedef struct vd_ply_property {
    vd_ply_use use;
    bool is_list;
    vd_number_type count_type, type;
} vd_ply_property;

typedef enum vd_ply_kind { OTHER = 0, VERTEX, FACE, STRIP, EDGE } vd_ply_kind;

typedef struct vd_ply_element {
    vd_ply_kind kind;
    char name[32];
    uint64_t count;
    vd_ply_property properties[VD_PLY_MOST_PROPERTIES];
    int property_count;
    bool has[USE_COUNT];
} vd_ply_element;

typedef struct vd_ply {
    vd_model_builder *builder;
    vd_text text;
    bool ascii, swapped; /* swapped: big-endian, on machines that are not */
    vd_ply_element elements[VD_PLY_MOST_ELEMENTS];
    int element_count;
    uint64_t at; /* the element that is being read, in its own kind */
    const vd_ply_element *now;
    char texture[256];
    vd_list list, texcoords; /* double: of the element that is being read */
    vd_list corners;         /* vd_corner: likewise */
    uint32_t vertex_count;
} vd_ply;

/* Reads the header; the text then stands at the first element. Returns VD_ERROR_FORMAT. */
VD_MUST_USE vd_status vd_ply_read_header(vd_ply *ply);

#endif
