/* raster.h: drawing meshes.
 *
 *     vd_draw draw = vd_draw_default();
 *     draw.mesh = mesh;
 *     status = vd_raster_create(context, &raster);
 *     status = vd_raster_render(raster, NULL, &def, &camera, &draw, 1, frame, NULL);
 *
 * The nearest primitive wins each sample (the greatest depth; of equals the one that comes first in
 * the draws), and each visible pixel is shaded once. Materials may be alpha-tested or blended.
 * Coverage is by the top-left rule at sample positions, vertices snapped to 1/256 pixel: of
 * triangles that share an edge exactly one has a sample on it. All methods give the same bytes, at
 * every SIMD level and number of threads.
 */
#ifndef VEDUTA_RASTER_H
#define VEDUTA_RASTER_H

#include <veduta/camera.h>
#include <veduta/job.h>
#include <veduta/matrix.h>
#include <veduta/shader.h>
#include <veduta/target.h>

VD_BEGIN_DECLARATIONS

typedef enum vd_raster_method {
    VD_RASTER_AUTO = 0,  /* what is fastest for the picture */
    VD_RASTER_SCANLINE,  /* triangle by triangle, spans between two edges (Wylie et al. 1967) */
    VD_RASTER_IMMEDIATE, /* bins → coarse tiles → fine tiles → pixels by masked expansion */
    VD_RASTER_TILED,     /* triangles sorted into tiles; each tile drawn by one thread */
    VD_RASTER_HYBRID,    /* small triangles at once, large ones by tiles */
    VD_RASTER_REFERENCE, /* one pixel at a time, 64-bit, brute force */
    VD_RASTER_METHOD_COUNT
} vd_raster_method;

/* Returns "auto", "scanline", "immediate", "tiled", "hybrid" or "reference". */
VD_API const char *vd_raster_method_name(vd_raster_method method);

typedef enum vd_cull { VD_CULL_BACK = 0, VD_CULL_FRONT, VD_CULL_NONE, VD_CULL_COUNT } vd_cull;

/* Which way a front face's vertices go round, seen from in front. */
typedef enum vd_winding {
    VD_WINDING_COUNTER_CLOCKWISE = 0,
    VD_WINDING_CLOCKWISE,
    VD_WINDING_EITHER, /* every face is a front face */
    VD_WINDING_COUNT
} vd_winding;

/* How a mesh of triangles is drawn; others are drawn as what they are. */
typedef enum vd_fill {
    VD_FILL_SOLID = 0,
    VD_FILL_WIREFRAME, /* the edges of the triangles, as lines */
    VD_FILL_POINTS,    /* the vertices, as points */
    VD_FILL_COUNT
} vd_fill;

/* One mesh, placed and dressed. */
typedef struct vd_draw {
    const vd_mesh *mesh;       /* not owned */
    vd_matrix world_from_mesh; /* affine; applied to anchor + position */
    const vd_shader *shader;   /* null: phong, or flat where the mesh has no normals; not owned */
    const void *uniforms;      /* handed to the shader; not owned */
    const vd_material
        *materials; /* by the parts' numbers; null: vd_material_default(); not owned */
    int material_count;
    vd_cull cull;
    vd_winding winding;
    vd_fill fill;
    double line_width;  /* pixels */
    double point_size;  /* pixels */
    uint64_t object_id; /* in the frame's table of ids */
} vd_draw;

/* Identity placement, back faces culled, counter-clockwise, solid, lines and points 1 pixel wide,
 * object id 1. */
VD_API vd_draw vd_draw_default(void);

typedef struct vd_raster_def {
    vd_raster_method method;
    int samples;         /* 1, 4 or 8 a pixel */
    vd_rgba8 background; /* straight; alpha 0 is transparent */
    double far_m; /* perspective: nothing farther along the view axis is drawn; 0: no limit */
    /* For measuring; 0 is what was found best. Powers of two: tiles of the methods that sort; bins
     * of the immediate one and their fine tiles, 4 to 16 pixels and at most 16 a bin's side. */
    int bin_pixels, fine_pixels, tile_pixels;
    int small_pixels; /* bounding boxes up to this many pixels count as small triangles */
    /* For what others have sent, which may take any time to draw; 0: no limit. Pixels of the boxes
     * around primitives; those of tested materials count 16 times, of ones that blend 32 times.
     * From the draw on with which it is more, draws are left out. And how many things that blend a
     * sample shows, rounded up to a multiple of 8: the farthest. */
    uint64_t most_pixels;
    int most_layers;
} vd_raster_def;

/* Automatic method, 1 sample, transparent black. */
VD_API vd_raster_def vd_raster_def_default(void);

typedef struct vd_raster_stats {
    uint64_t primitives; /* given */
    uint64_t clipped;    /* cut at the near or far plane or the guard band */
    uint64_t drawn;      /* neither culled nor outside nor between samples; 0 when unknown */
    uint64_t hits;       /* samples that show something */
    uint64_t covered; /* pixels as most_pixels counts them, of what was left out too; 0 without */
    int left_out;     /* draws */
} vd_raster_stats;

/* A renderer: the memory that drawing needs, kept from frame to frame. One call at a time. */
typedef struct vd_raster vd_raster;

/* *out is owned by the caller. Returns VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_raster_create(vd_context *context, vd_raster **out);
VD_API void vd_raster_destroy(vd_raster **raster);

/* Draws `count` draws into the frame (all planes it has), over the background. A second call with
 * the same sizes and meshes allocates nothing. `job` and `stats` may be null.
 * Returns VD_ERROR_ARGUMENT (names the field), VD_ERROR_LIMIT (more than 2^32 − 2 primitives, or
 * more object ids than the frame's table holds), VD_ERROR_MEMORY,
 * VD_ERROR_CANCELLED (the frame then holds the tiles that were finished). A picture without
 * anything is a success with stats->hits 0; vd_raster_explain_empty then says why. */
VD_API VD_MUST_USE vd_status vd_raster_render(vd_raster *raster, vd_job *job,
                                              const vd_raster_def *def, const vd_camera *camera,
                                              const vd_draw *draws, int count, vd_frame *frame,
                                              vd_raster_stats *stats);

/* ---- together with others in one target -----------------------------------------------------
 * vd_raster_prepare does what concerns the whole picture; then vd_raster_draw composites into
 * targets that hold windows of it, each sample by depth against what is there (of equals, what is
 * there stays). Several threads may draw at once into targets of their own, `worker` in
 * [0, threads of the context) different for each. The frame ids are those that `frame` gave.
 * vd_raster_draw leaves out materials that blend: when all that is opaque is drawn, vd_raster_blend
 * adds them to the target's list (target.h); a target without one, or of other samples, is left
 * as it is. */
VD_API VD_MUST_USE vd_status vd_raster_prepare(vd_raster *raster, vd_job *job,
                                               const vd_raster_def *def, const vd_camera *camera,
                                               const vd_draw *draws, int count, vd_frame *frame);
VD_API void vd_raster_draw(vd_raster *raster, vd_target *target, int worker);
VD_API void vd_raster_blend(vd_raster *raster, vd_target *target, int worker);

/* Returns one sentence on why the draws show nothing: no primitives, all behind the camera or
 * nearer than the near plane, beside the view, culled, or too small for any sample. */
VD_API vd_status vd_raster_explain_empty(const vd_raster_def *def, const vd_camera *camera,
                                         const vd_draw *draws, int count, int width, int height);

VD_END_DECLARATIONS

#endif
