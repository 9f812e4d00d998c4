/* shader.h: what a programmer may put into the triangle pipeline: functions over batches of 16.
 *
 * A batch is sixteen vertices or sixteen fragments. Every component is a plain, 64-byte aligned
 * float[16]; lane i of all arrays belongs together, and lane i of what a shader writes may depend
 * on lane i of what it reads only. Lanes beyond the count or outside the mask hold some valid
 * numbers; what is written there is dropped. A loop `for (int i = 0; i < 16; i++)` over lanes is
 * what compilers turn into SIMD.
 *
 * Shaders run on several threads at once, any number of times and in any order: they must be pure
 * functions of what they are given. To give the same bytes everywhere, build them with
 * -ffp-contract=off and call nothing of libm beyond sqrtf, floorf and fabsf.
 *
 * Picture space, homogeneous: a vertex at (x, y, z, w) stands at the pixel position
 * (x / w, y / w), pixel centres at +½, with depth z / w: 1 at the near plane, 0 at infinity.
 * w is the distance along the view axis in metres (perspective) or 1 (orthographic).
 */
#ifndef VEDUTA_SHADER_H
#define VEDUTA_SHADER_H

#include <veduta/color.h>
#include <veduta/mesh.h>
#include <veduta/texture.h>

VD_BEGIN_DECLARATIONS

#define VD_BATCH 16
#define VD_MAX_VARYINGS 32
#define VD_MAX_USER_BYTES 256

/* How a draw's mesh space lies before the camera. Mesh space: relative to the mesh's anchor. */
typedef struct vd_mesh_view {
    float picture_from_mesh[4][4];  /* homogeneous picture space, see above */
    float camera_from_mesh[3][4];   /* x right, y down, z along the view axis, metres */
    float mesh_from_camera[3][4];   /* its inverse; the last column is the eye */
    float camera_from_normal[3][3]; /* mesh normals: the inverse transpose; not of unit length */
    float camera_from_world[3][3];  /* directions in the world, such as towards a light */
    float lens[4];                  /* fx, fy, cx, cy */
    float near_m;
    float far_m; /* orthographic: depth is 1 − z / far_m; 0 for perspective */
    int width, height;
} vd_mesh_view;

/* What a surface is made of. Colours are linear, alpha is straight. */
typedef struct vd_material {
    vd_linear albedo;
    float alpha;
    vd_linear emission; /* light that it gives off, added to what it reflects */
    vd_linear specular;
    float shininess;           /* exponent of the highlight, 1 … 1024; a whole number is used */
    const vd_texture *texture; /* multiplies albedo and alpha; null: none; not owned */
    vd_texture_filter filter;
    float alpha_test; /* fragments with less alpha than this are not there, sample by sample; what
                         is left is opaque unless `blend`. 0 … 1; 0: all are there */
    bool blend;       /* blended over what is behind by its alpha, farthest first; the frame's depth
                         and id stay those of what is behind. Without a fragment function: nothing */
} vd_material;

/* Alpha is what the fragment function leaves. Of shadings that do not look at the material (depth,
 * normals, uv, id) and where there is no fragment function it is the material's: its alpha times
 * the texture's at the mesh's texture coordinates. */

/* Grey 0.8, opaque, no emission, a faint highlight, trilinear. */
VD_API vd_material vd_material_default(void);

typedef struct vd_vertices {
    int count; /* 1 … 16 */
    const void *uniforms;
    const vd_mesh_view *view;
    const vd_mesh *mesh;
    uint32_t first;                      /* vertex number of lane 0 */
    const float (*position)[VD_BATCH];   /* [3]: mesh space */
    const float (*attributes)[VD_BATCH]; /* [mesh->component_count] */
    float (*picture)[VD_BATCH];          /* out [4]: x, y, z, w in picture space */
    float (*varyings)[VD_BATCH];         /* out [varying_count] */
    void *user;                          /* out [16][user_bytes] */
} vd_vertices;

typedef struct vd_fragments {
    uint32_t mask; /* bit i: lane i is wanted */
    const void *uniforms;
    const vd_mesh_view *view;
    const vd_mesh *mesh;
    const vd_material *material;
    const float (*varyings)[VD_BATCH];    /* [varying_count], perspective-correct */
    const float (*varyings_dx)[VD_BATCH]; /* change to the next pixel; null unless asked for */
    const float (*varyings_dy)[VD_BATCH];
    const float (*normal)[VD_BATCH]; /* [3]: of the triangle's plane, mesh space, unit length,
                                        towards the viewer; null unless asked for */
    const void *user;                /* [16][user_bytes] */
    const uint32_t *primitive;       /* [16] number within the mesh */
    const float *x, *y;              /* [16] pixel position of the sample */
    const float *depth;              /* [16] */
    const float *w;                  /* [16] distance along the view axis, or 1 */
    float (*color)[VD_BATCH]; /* out [4]: red, green, blue, alpha; sRGB-encoded, straight (alpha not
                                 multiplied in), 0 … 1, clamped; alpha comes in as 1 */
} vd_fragments;

typedef void vd_vertex_function(const vd_vertices *batch);
typedef void vd_fragment_function(const vd_fragments *batch);

enum {
    /* Without a vertex function the varyings are the mesh's attributes, those of these in this
     * order. Texture coordinates and extra components that a mesh lacks read as 0; a mesh without
     * normals is refused by a shader that wants them. */
    VD_INPUT_NORMAL = 1, /* 3 components, as interpolated: not of unit length */
    VD_INPUT_UV = 2,     /* 2 components */
    VD_INPUT_EXTRA = 4,  /* as many as the mesh has */
    /* What else the fragment function wants. */
    VD_INPUT_DERIVATIVES = 8,  /* varyings_dx, varyings_dy */
    VD_INPUT_FACE_NORMAL = 16, /* normal */
};

typedef struct vd_shader {
    vd_vertex_function *vertex;     /* null: positions go through view->picture_from_mesh */
    vd_fragment_function *fragment; /* null: no colour; depth and id only */
    unsigned inputs;                /* VD_INPUT_ bits */
    int varying_count;              /* with a vertex function; at most VD_MAX_VARYINGS */
    /* A varying that is not made of floats: `user_bytes` (at most VD_MAX_USER_BYTES) written by the
     * vertex function, interpolated as the sum of three scaled values. `out` may be `a` or `b`. */
    size_t user_bytes;
    void (*user_add)(void *out, const void *a, const void *b);
    void (*user_scale)(void *out, const void *a, float factor);
} vd_shader;

/* ---- shaders that are there ----------------------------------------------------------------- */

typedef enum vd_shading {
    VD_SHADING_PHONG =
        0,            /* lit by vd_phong with the mesh's normals; textured where the material is */
    VD_SHADING_FLAT,  /* the same with the triangle's own normal */
    VD_SHADING_DEPTH, /* grey = depth³, as vd_depth_range spreads it */
    VD_SHADING_NORMALS, /* (n + 1) / 2 of the interpolated normal, camera space, z and y flipped:
                           what faces the viewer is blue, what faces up is green */
    VD_SHADING_UV,      /* red = u, green = v, their fractional parts */
    VD_SHADING_ID,      /* a colour of its own for each primitive */
    VD_SHADING_ALBEDO,  /* the material's colour and texture, unlit */
    VD_SHADING_COUNT
} vd_shading;

/* Returns a shader that is there; null for a value outside the enumeration. */
VD_API const vd_shader *vd_shader_find(vd_shading shading);

/* Returns "phong", "flat", "depth", "normals", "uv", "id" or "albedo". */
VD_API const char *vd_shading_name(vd_shading shading);

/* Uniforms of phong and flat; null uniforms mean vd_phong_default(). Phong 1975: ambient + diffuse
 * n·l + specular (r·v)^shininess, in linear light, summed over lights; both sides are lit alike. */
typedef struct vd_phong_light {
    float direction[3]; /* unit vector towards the light, in the world */
    vd_linear color;
} vd_phong_light;

typedef struct vd_phong {
    vd_linear ambient;
    vd_phong_light lights[4];
    int light_count;
} vd_phong;

/* A light from the upper left behind the viewer's shoulder for a view along +y, a weaker one from
 * the right, and some ambient light. */
VD_API vd_phong vd_phong_default(void);

/* Uniforms of depth: depth `nearest` is white, `farthest` black; null: 1 and 0. */
typedef struct vd_depth_range {
    float nearest, farthest;
} vd_depth_range;

VD_END_DECLARATIONS

#endif
