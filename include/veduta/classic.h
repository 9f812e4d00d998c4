/* classic.h: the classic Voxel Space picture (Comanche, 1992), to the bit.
 *
 * Everything is in map samples; the map wraps. The picture is defined by this header and by
 * `reference`, in float32 without contraction; every other method gives the same bytes.
 *
 *   s, c       sin and cos of yaw, computed in double, rounded to float
 *   left       (−c − s·view, s − c·view),  right = (c − s·view, −s − c·view)
 *   d_i        left + (float)i·((right − left)/W), for column i of W
 *   z_k        growth 0: z0 + (float)k·step, while z_k < distance in float
 *              growth g: in double, z = z0, δ = step; each time δ += g, then z += δ; while
 *              z < distance in double; the slice uses (float)z
 *   p          eye + z_k·d_i; cell (floor p.x mod width, floor p.y mod height), exact for every
 *              finite p; an infinite or NaN p is not visible
 *   row        trunc((height − h)·(scale/z_k) + horizon), saturated to int32; NaN is never visible
 *
 * Front to back, the pixels from max(row, 0) down to the column's last hidden row take the cell's
 * colour; what is left is the background. As a lens: fx = view·W/2, fy = scale·view, axial depth
 * view·z_k, cx = W/2 + ½, cy = horizon − ½.
 *
 * Four options, all off unless asked for, change it as follows; they go together in any way. All
 * mixing is mix(a, b, w) = (a·(256 − w) + b·w + 128) >> 8 in integers, channel by channel.
 *
 *   mip       slice k reads level L of the map: the least with 2^L >= z_k·(view·2/W), at most the
 *             last. Level L + 1 is the mean of 2 × 2 samples of level L (integers: (sum + 2) >> 2;
 *             float: ((a + b) + (c + d))·¼), as long as both sides are even and L < 15. p is
 *             multiplied by 2^−L, and wraps at the level's size.
 *   filter    linear: with c, r = floor p and f = p − floor p, the height is lerp(lerp(h00, h10,
 *             f.x), lerp(h01, h11, f.x), f.y), lerp(a, b, f) = a + f·(b − a), h10 that of the cell
 *             c + 1, and so on; never above the greatest of the four; where it is NaN, as next to a
 *             hole, nothing is visible. Colours are mixed the same way, with w = trunc(f·256). (The
 *             thesis, eq. 6.9, weighs with ceil p − p, which with p − floor p makes 0 where p is
 *             whole: the height would vanish there. Here the first weight is 1 − f.)
 *   smooth    of a run of n pixels that a sample adds above the column's previous visible sample,
 *             the one at j from its top takes mix(colour, previous colour, j·(65536 / n) >> 8):
 *             curtains become gradients. The column's first run stays flat.
 *   samples   S = 4 or 8: a pixel with a neighbour (left, right, above or below) that is across an
 *             edge takes the mean, (sum + S/2)/S, of S pictures whose columns are at i + o.x − ½
 *             and whose horizon is ½ − o.y lower, o of vd_sample_offsets(S). An edge is where one
 *             of the two is background or the greater depth is above 1⅛ of the other (in float,
 *             from the picture with one sample). Depth and id stay that picture's.
 *
 * (Freeman 1996, US patent 5,550,959; FutSpace thesis 2020, ch. 2, 6.3 and listing A.1.)
 */
#ifndef VEDUTA_CLASSIC_H
#define VEDUTA_CLASSIC_H

#include <veduta/camera.h>
#include <veduta/heightfield.h>
#include <veduta/job.h>
#include <veduta/terrain.h>

VD_BEGIN_DECLARATIONS

typedef enum vd_classic_method {
    VD_CLASSIC_REFERENCE = 0, /* serial, slices outside, as published */
    VD_CLASSIC_SLICES,        /* parallel inside each slice: the published OpenMP version */
    VD_CLASSIC_COLUMNS,       /* parallel over columns */
    VD_CLASSIC_SCAN,          /* data-parallel: occlude scan, scatter, fill scan per column */
    VD_CLASSIC_MARCH,         /* cost follows what is seen: a vd_classic_renderer for one picture */
    VD_CLASSIC_METHOD_COUNT
} vd_classic_method;

/* Returns "reference", "slices", "columns", "scan" or "march". */
VD_API const char *vd_classic_method_name(vd_classic_method method);

typedef struct vd_classic_def {
    double x, y, height;               /* eye, in samples and height units */
    double yaw_rad;                    /* turning left; heading is its negative */
    double horizon;                    /* picture row of the horizon */
    double scale;                      /* pixels of height at distance 1 */
    double view;                       /* 1: a 90° field of view */
    double distance, z0, step, growth; /* the slices, see above */
    vd_rgba8 background;
    vd_filter filter; /* linear: heights and colours between the samples */
    bool mip;         /* far away, means of the map's samples */
    bool smooth;      /* gradients in place of flat curtains */
    int samples;      /* 4 or 8: smooth edges; 0 is 1 */
} vd_classic_def;

/* The published scene: 512, 800, 78, yaw 0, horizon 100, scale 240, view 1, distance 10,000, z0 1,
 * step 0.1, growth 0, background 9090E0; no options. */
VD_API vd_classic_def vd_classic_def_default(void);

/* What the scan method did, counted; for the work-and-span comparison in docs/voxel-space.md. */
typedef struct vd_classic_counts {
    uint64_t slices;  /* n */
    uint64_t columns; /* m */
    uint64_t rows;    /* l */
    uint64_t pairs;   /* colour-height pairs computed */
    uint64_t occlude; /* applications of the occlude operator */
    uint64_t scatter; /* scattered pairs */
    uint64_t fill;    /* applications of the fill operator */
    uint64_t span;    /* longest chain of dependent scan steps: levels of both scan trees */
} vd_classic_counts;

/* Returns the number of slices, at most 2^31 − 1; 0 for a def that vd_classic_render refuses for
 * another reason than too many slices. */
VD_API uint64_t vd_classic_slice_count(const vd_classic_def *def);

/* Draws the classic picture into the frame: opaque colours (the map's alpha is ignored); where the
 * frame has them, depth near/(view·z_k) with near = view·z0, computed as (float)z0 / z_k, and id 1,
 * object id 1. The heightfield must wrap and have colours of its own size. `job` and `counts` may
 * be null; counts are filled by VD_CLASSIC_SCAN only. Returns VD_ERROR_ARGUMENT (a NaN, step or
 * growth that never reaches the distance, z0 <= 0, view <= 0, missing colours, samples or filter
 * that do not exist, an option that the method does not draw: VD_CLASSIC_SCAN draws samples only),
 * VD_ERROR_LIMIT
 * (more than 2^31 − 1 slices; for VD_CLASSIC_SCAN, which keeps a column's slices in memory, 16
 * bytes each and thread, 2^24), VD_ERROR_MEMORY, VD_ERROR_CANCELLED (the frame is then unfinished).
 */
VD_API VD_MUST_USE vd_status vd_classic_render(vd_context *context, vd_job *job,
                                               const vd_heightfield *map, const vd_classic_def *def,
                                               vd_classic_method method, vd_frame *frame,
                                               vd_classic_counts *counts);

/* Draws many pictures of one map by the method "march": what it derives from the map is kept from
 * picture to picture, as is its scratch memory. With the map's block it takes at most 2.2 times the
 * bytes of heights and colours, beside what grows with the picture; the option mip adds, when a
 * picture first wants it, about a third of that. Of an 8-bit map something is kept for one filter
 * at a time: where both take turns, a renderer for each is faster. */
typedef struct vd_classic_renderer vd_classic_renderer;

/* Creates a renderer; *out is owned by the caller. The map must wrap, have colours of its own size,
 * and outlive the renderer unchanged. Cost: a few passes over the map.
 * Returns VD_ERROR_ARGUMENT or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_classic_renderer_create(vd_context *context,
                                                        const vd_heightfield *map,
                                                        vd_classic_renderer **out);

/* Ends a renderer and sets *renderer to null. Null is accepted. */
VD_API void vd_classic_renderer_destroy(vd_classic_renderer **renderer);

/* Draws as vd_classic_render does, the same bytes in every case. Allocates only when a picture is
 * larger, or has more slices of a growing schedule, than any before, or is the first with an
 * option. One thread at a time. Pictures
 * that the march does not take are drawn by VD_CLASSIC_COLUMNS: scale not above 0, rises scale / z
 * outside float's normal range, positions 2^22 samples or more from the origin, coordinates and
 * directions below 2^−60 but not 0, z0 below 2^−20, more than 2^23 slices of a constant schedule or
 * 2^20 of a growing one.
 * Returns what vd_classic_render does. */
VD_API VD_MUST_USE vd_status vd_classic_renderer_draw(vd_classic_renderer *renderer, vd_job *job,
                                                      const vd_classic_def *def, vd_frame *frame);

/* Returns the camera whose lens sees what the classic picture shows, in a world whose x is the
 * column and whose y is minus the row, in samples. */
VD_API vd_camera vd_classic_camera(const vd_classic_def *def, int width, int height);

VD_END_DECLARATIONS

#endif
