/* raster_internal.h: what the files of this room share.
 *
 *   draws ─ vertices ─► projected vertices (16 bytes each)
 *                        │ cull, classify: 16 triangles at a time
 *                        ├─ small triangles: by number          ┐
 *                        └─ large, clipped, lines, points:      ├─► visibility buffer of a tile:
 *                           vd_setup, 64-bit                    ┘   depth and id per sample
 *                                                                    │ shade, 16 pixels at a time
 *                                                                    ▼
 *                                                                  frame or target
 *
 * The rules that make all methods agree, bit for bit:
 * - A vertex is snapped to 1/256 pixel; its coordinates are integers relative to pixel (0, 0)'s
 *   centre. Coverage is the sign of integers: no rounding anywhere.
 * - Depth is z0 + (dx·dz_dx + dy·dz_dy) with dx, dy the integer distance from vertex 0, in float,
 *   clamped to the triangle's own range: never incremental, the same wherever it is evaluated.
 * - The greater depth wins a sample, of equals the lower id; 0 is nothing. That is a maximum: the
 *   order in which triangles arrive does not matter.
 */
#ifndef VEDUTA_RASTER_RASTER_INTERNAL_H
#define VEDUTA_RASTER_RASTER_INTERNAL_H

#include <veduta/raster.h>
#include "core/core.h"

#define VD_SUBPIXELS 256
/* The largest tile, in pixels a side. */
#define VD_TILE_MAX 256
/* Half the guard band's width: coordinates stay within ±2^15 pixels of the picture's middle, so
 * that their differences fit 2^24 subpixels and one tile's edge values fit 32 bits. */
#define VD_GUARD_PIXELS 32767
/* Boxes below this many subpixels a side have edge values that fit 32 bits. */
#define VD_SMALL_SUBPIXELS 32768

/* A projected vertex. An x below VD_FLAGGED has no place in the picture; x − INT32_MIN says why. */
typedef struct vd_vertex {
    int32_t x, y; /* 1/256 pixel from the centre of pixel (0, 0) */
    float z;      /* depth */
    float rw;     /* 1 / w */
} vd_vertex;

#define VD_FLAGGED (INT32_MIN + 256)

enum {
    VD_OUT_LEFT = 1,
    VD_OUT_RIGHT = 2,
    VD_OUT_TOP = 4,
    VD_OUT_BOTTOM = 8,
    VD_OUT_NEAR = 16,
    VD_OUT_FAR = 32,
    VD_OUT_GUARD = 64, /* too far beside the picture for integers */
    VD_OUT_BAD = 128   /* not finite: what uses it is not drawn */
};

/* A triangle ready to be filled. Edges go from vertex i to i + 1 with the inside on the positive
 * side (clockwise in a picture whose y points down); vertex 0 is where depth is measured from. */
typedef struct vd_setup {
    int32_t x[3], y[3];
    float z0, dz_dx, dz_dy; /* per subpixel */
    float z_min, z_max;
    uint32_t id;
} vd_setup;

/* One draw, prepared. */
typedef struct vd_drawing {
    vd_draw draw;
    const vd_mesh *mesh;
    const vd_shader *shader;
    unsigned inputs;                /* the shader's, less what a plain material makes useless */
    vd_fragment_function *fragment; /* of the SIMD level in use; null: none */
    vd_mesh_view view;
    vd_topology topology; /* what is drawn: wireframes are lines */
    bool wireframe;       /* lines are the sides of triangles */
    bool by_vertex;       /* points are the mesh's vertices, not its indices */
    uint32_t first_id;    /* of primitive 0; ids begin at 1 */
    uint32_t primitive_count;
    uint32_t frame_id;
    bool keep_clockwise, keep_counter_clockwise; /* as seen in the picture */
    float depth_near, depth_far;                 /* what is drawn lies between */
    vd_vertex *vertices;                         /* [mesh->vertex_stride] */
    /* Where varyings come from: the mesh's attributes, or what the vertex function wrote. Varying k
     * is component[k] of groups[group_count][stride][4]. */
    const float *groups;
    size_t group_stride; /* floats from one group to the next */
    int varying_count;
    int8_t component[VD_MAX_VARYINGS]; /* −1: reads 0 */
    bool special;                      /* some material is tested or blended */
    bool alpha_of_material;            /* of those; else the fragment function's */
    int uv;         /* the varying that texture coordinates begin at; −1: none */
    float *written; /* by the vertex function; owned */
    uint8_t *user;  /* [vertex_stride][user_bytes]; owned */
} vd_drawing;

/* What a material does to visibility. */
typedef enum vd_kind {
    VD_KIND_SOLID,
    VD_KIND_TESTED,  /* a sample shows it if its alpha passes */
    VD_KIND_BLENDED, /* has no part in visibility */
    VD_KIND_COUNT
} vd_kind;

static inline vd_kind vd_material_kind(const vd_material *material) {
    return material->blend               ? VD_KIND_BLENDED
           : material->alpha_test > 0.0f ? VD_KIND_TESTED
                                         : VD_KIND_SOLID;
}

/* Sixteen pixels of one draw and material on their way through a fragment function. */
typedef struct vd_batch {
    float x[VD_BATCH], y[VD_BATCH], depth[VD_BATCH], w[VD_BATCH];
    uint32_t primitive[VD_BATCH];
    float color[4][VD_BATCH];
    float normal[3][VD_BATCH];
    float varyings[VD_MAX_VARYINGS][VD_BATCH];
    float varyings_dx[VD_MAX_VARYINGS][VD_BATCH];
    float varyings_dy[VD_MAX_VARYINGS][VD_BATCH];
    uint8_t user[VD_BATCH * VD_MAX_USER_BYTES];
} __attribute__((aligned(64))) vd_batch;

/* ---- raster_project.c ------------------------------------------------------------------------ */

/* Fills in everything of a prepared draw but its memory. Returns VD_ERROR_ARGUMENT. */
VD_MUST_USE vd_status vd_drawing_init(vd_drawing *drawing, const vd_draw *draw,
                                      const vd_raster_def *def, const vd_camera *camera, int width,
                                      int height);

/* Projects one place in homogeneous picture space, as all kernels do. */
vd_vertex vd_project(const vd_drawing *drawing, const float picture[4]);

/* Runs `count` (1 … 16) vertices from `first` (a multiple of 16) through the vertex function or the
 * matrix: picture [4][16]; varyings and user data to the drawing's own memory when `store`. */
void vd_vertices_run(const vd_drawing *drawing, uint32_t first, int count, bool store,
                     float (*picture)[VD_BATCH]);

/* The same for one vertex again, for clipping: nothing is stored. */
void vd_vertex_picture(const vd_drawing *drawing, uint32_t vertex, float picture[4]);

/* ---- raster_assemble.c ----------------------------------------------------------------------- */

typedef void vd_setup_function(void *user, const vd_setup *setup);

/* Sets up a triangle of three projected vertices, none flagged. False when it is culled or has no
 * area. */
bool vd_setup_triangle(const vd_drawing *drawing, const vd_vertex *a, const vd_vertex *b,
                       const vd_vertex *c, uint32_t id, vd_setup *out);

/* Sets up primitive `primitive` of any kind: clips, widens lines and points, and hands over the
 * triangles that result, at most 8. Returns whether it was clipped. */
bool vd_assemble(const vd_drawing *drawing, uint32_t primitive, vd_setup_function *emit,
                 void *user);

/* Clips a polygon in homogeneous picture space (Sutherland & Hodgman 1974) against the drawing's
 * near and far planes and its guard band. `polygon` [VD_CLIP_MAX][4] is clipped in place, `vertex`
 * [VD_CLIP_MAX] says which of the original vertices each is, −1 for new ones. Returns how many are
 * left, 0 or 3 … VD_CLIP_MAX. */
#define VD_CLIP_MAX 10
int vd_clip_polygon(const vd_drawing *drawing, double (*polygon)[4], int *vertex, int count);

/* Clips the line from a to b (Liang & Barsky 1984, in homogeneous space): the part that is left is
 * t[0] … t[1]. False when nothing is. */
bool vd_clip_line(const vd_drawing *drawing, const double a[4], const double b[4], double t[2]);

/* ---- raster_interpolate.c -------------------------------------------------------------------- */

/* Fills lane `lane` of the batch for the fragment of `primitive` at pixel position (x, y), given in
 * subpixels: everything that the drawing's shader wants, except depth. */
void vd_interpolate(const vd_drawing *drawing, uint32_t primitive, int32_t x, int32_t y, int lane,
                    vd_batch *batch);

/* Runs the fragment function on the lanes of the mask, all of one material, and clamps colours. */
void vd_batch_run(const vd_drawing *drawing, const vd_material *material, uint32_t mask,
                  vd_batch *batch);

/* The material of a primitive. */
const vd_material *vd_drawing_material(const vd_drawing *drawing, uint32_t primitive);

/* The kind of a primitive's material, and where the run of primitives of the same one ends. */
vd_kind vd_drawing_kind(const vd_drawing *drawing, uint32_t primitive, uint32_t *end);

extern const vd_phong vd_phong_standard;

/* The material's albedo under its texture, linear, of 16 fragments, and alpha into their color[3].
 * `uv` is the first of the texture coordinates among the varyings. */
void vd_surface_albedo(const vd_fragments *fragments, int uv, float (*albedo)[VD_BATCH]);

/* The material's alpha times its texture's, into color[3]. */
void vd_surface_alpha(const vd_fragments *fragments, int uv);

/* Whether a fragment function's alpha gives way to the material's. */
static inline bool vd_alpha_of_material(const vd_drawing *drawing, const vd_material *material) {
    return drawing->alpha_of_material && vd_material_kind(material) != VD_KIND_SOLID;
}

/* What a thing of a sample is told apart by in a target's blended list. */
static inline uint64_t vd_blended_order(const vd_drawing *drawing, uint32_t id) {
    return (uint64_t)drawing->frame_id << 32 | id;
}

/* ---- the visibility buffer ------------------------------------------------------------------- */

/* Samples of small triangles on their way into a window. */
#define VD_PENDING 1024
typedef struct vd_pending {
    int count;
    int32_t at[VD_PENDING]; /* index into the planes */
    float depth[VD_PENDING];
    uint32_t id[VD_PENDING];
} vd_pending;

#define VD_HIDE_BLOCKS 4

/* Depth and id of the samples of a window of the picture, one plane a sample, as in vd_target. */
typedef struct vd_visible {
    int x, y, width, height;
    int samples;
    size_t stride, plane;
    float *depth;
    uint32_t *id;
    bool bare;           /* nobody asks for ids: they may be anything */
    vd_pending *pending; /* null: only the reference fills it */
    float hidden[8];     /* by sample: all depths of the window are at least this */
    /* The same of its VD_HIDE_BLOCKS² blocks of 2^block_shift pixels a side, in rows. */
    float hidden_blocks[8][VD_HIDE_BLOCKS * VD_HIDE_BLOCKS] __attribute__((aligned(64)));
    int block_shift;
    bool hides; /* one of them is above 0 */
    int since;  /* triangles that were filled since they were found */
} vd_visible;

/* A drawing and its nearest depth. */
typedef struct vd_order {
    float nearest;
    int drawing;
} vd_order;

/* What a picture is made of, once prepared. */
typedef struct vd_scene {
    vd_drawing *drawings;
    struct vd_order *order; /* [drawing_count], farthest first */
    int drawing_count;
    int samples;
    int width, height;
    uint16_t background[4]; /* encoded, premultiplied */
    bool blended;           /* something in it blends */
} vd_scene;

/* The draw that an id belongs to. */
const vd_drawing *vd_scene_drawing(const vd_scene *scene, uint32_t id);

/* Offset of a sample from its pixel's centre, in subpixels. */
static inline void vd_sample_shift(int samples, int sample, int32_t *x, int32_t *y) {
    const float *offset = vd_sample_offsets(samples)[sample];
    *x = (int32_t)((offset[0] - 0.5f) * (float)VD_SUBPIXELS);
    *y = (int32_t)((offset[1] - 0.5f) * (float)VD_SUBPIXELS);
}

/* ---- raster_reference.c ---------------------------------------------------------------------- */

/* Depth and id of all samples of the window. */
void vd_reference_visibility(const vd_scene *scene, vd_visible *visible, vd_batch *batch);

/* Colours the window's samples that show something into the target, a window of the same place and
 * size: colour, depth, frame id. */
void vd_reference_shade(const vd_scene *scene, const vd_visible *visible, vd_target *target,
                        vd_batch *batch);

/* Adds what blends to the target's list. */
void vd_reference_blend(const vd_scene *scene, vd_target *target, vd_batch *batch);

/* The plain way from vertices to projected ones, 16 at a time. */
void vd_project_reference(const vd_drawing *drawing, uint32_t first, uint32_t count);

#endif
