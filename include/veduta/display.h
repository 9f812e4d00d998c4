/* display.h: pictures on quads, blended into a frame: how impostors are shown.
 *
 * A quad is a picture on a parallelogram in space (the plane of an impostor: Lawlor 2004, §2.1 and
 * §3.1). Quads are blended in the order given, farthest first, with perspective, bilinear
 * filtering and the premultiplied "over" of Porter and Duff (1984) in integers. The same frame on
 * every machine, number of threads and SIMD level, and in WebAssembly (script/build-wasm).
 *
 * How a pixel comes about. Its centre is inside or not by four edges evaluated in doubles, ties by
 * the top-left rule: quads that share an edge (the same two corners, bit by bit) leave no gap and
 * count no pixel twice. Edges are not antialiased: a picture brings a transparent edge of one texel
 * along where its outline is to be smooth. The texture position is found with one division a pixel
 * to 1/256 texel, rounded; its error is below 1/256 + 2^-21 of the texels that the quad's row
 * crosses. Then, in integers, for every channel:
 *   left = (256·t00 + (t01 − t00)·fy + 128) >> 8; right alike; c = (256·left + (right − left)·fx +
 *   128) >> 8; c = min(c, alpha); a' = round(alpha·opacity / 255);
 *   new = round((c·opacity + old·(255 − a')) / 255)
 * One rounding for opacity and blending together: an opaque picture that fades in over itself
 * changes nothing.
 */
#ifndef VEDUTA_DISPLAY_H
#define VEDUTA_DISPLAY_H

#include <stdbool.h>
#include <veduta/camera.h>
#include <veduta/frame.h>
#include <veduta/job.h>

VD_BEGIN_DECLARATIONS

/* RGBA8, sRGB-encoded, alpha premultiplied; borrowed. */
typedef struct vd_quad_picture {
    const uint8_t *rgba; /* [height][stride][4] */
    int width, height;   /* 2 … VD_MAX_SIDE, the transparent edge included */
    size_t stride;       /* texels from one row to the next */
    int opaque[4];       /* texels left, top, right, bottom (exclusive) between which alpha is 255
                            everywhere; all 0: none. A promise: what lies behind is not drawn */
} vd_quad_picture;

/* A corner in homogeneous picture space, as vd_camera_matrix gives it: at the pixel (x/w, y/w), w
 * metres in front of the eye along the view axis (may be 0 or negative), or 1 by an orthographic
 * camera. */
typedef struct vd_quad_corner {
    float x, y, w;
} vd_quad_corner;

typedef struct vd_quad {
    vd_quad_corner corners[4]; /* of the picture: top left, top right, bottom right, bottom left.
                                  The third is the second plus the fourth less the first, to
                                  rounding: the picture's place is found from the other three */
    vd_quad_picture picture;
    uint8_t opacity; /* 255: as the picture is; 0: nothing is drawn */
    float nearer; /* where depth is tested the quad counts as so many times nearer than it is: what
                     it shows may stand before its plane. At least 1; 0: 1 */
} vd_quad;

typedef struct vd_display_def {
    float near_m;     /* what is nearer to the eye is cut off, metres; > 0, default 0.01 */
    bool draw_hidden; /* also draw what opaque pictures hide later: the same bytes, slower */
    bool test_depth;  /* leave pixels alone where the frame's depth (near_m / w, as a perspective
                         camera's) is nearer than the quad's; turns draw_hidden on, since what is
                         hidden hides nothing */
} vd_display_def;

VD_API vd_display_def vd_display_def_default(void);

/* Sets a quad's corners from points of the world, metres, in the order given above. Returns
 * VD_ERROR_ARGUMENT when a corner is not finite or out of the range of a float; *quad is then
 * unchanged. */
VD_API VD_MUST_USE vd_status vd_quad_place(vd_quad *quad, const vd_camera *camera,
                                           const vd_vec3 corners[4]);

/* Finds a large opaque rectangle of a picture for `opaque`: the middle's row and column grown as
 * far as alpha stays 255, in turns. Not the largest, but one pass over what it keeps. Zeros when
 * the middle is not opaque. */
VD_API void vd_quad_picture_find_opaque(vd_quad_picture *picture);

/* Holds the memory that drawing needs, so that a frame with no more quads than one before allocates
 * nothing. For one thread at a time. */
typedef struct vd_display vd_display;

/* Returns VD_ERROR_MEMORY. *out is owned by the caller. */
VD_API VD_MUST_USE vd_status vd_display_create(vd_context *context, vd_display **out);
VD_API void vd_display_destroy(vd_display **display);

/* Blends `count` quads over the frame's colours, the first one farthest; depth and id stay as they
 * are. `def` may be null for the defaults; `job` may be null. Quads seen from behind are drawn
 * (mirrored), those without area are not. Parallel in bands of rows over the context's executor.
 * Returns VD_ERROR_ARGUMENT (a corner that is not finite, a picture's or an opaque rectangle's
 * sides out of range, near_m not above 0: nothing is drawn), VD_ERROR_LIMIT (more than 2^24 quads),
 * VD_ERROR_MEMORY (nothing is drawn) or VD_ERROR_CANCELLED (some rows are drawn, others not). */
VD_API VD_MUST_USE vd_status vd_display_draw(vd_display *display, vd_job *job, vd_frame *frame,
                                             const vd_quad *quads, int count,
                                             const vd_display_def *def);

/* ---- for who draws what others order ----------------------------------------------------------
 * A server may order anything, such as one large picture ten thousand times. */

/* Most of a frame's pixels that a client's pictures cover, in times the frame: what is ordered
 * after that is left out. Worlds have an overdraw below 5. */
#define VD_DISPLAY_MOST_SCREENS 64

/* No sound server orders that much: a client leaves one that does. */
#define VD_DISPLAY_ABSURD_SCREENS 1024

/* Returns the area, pixels, of the rectangle around what a quad covers of a width × height frame:
 * what of it is not nearer than near_m. Corners that are not finite count as none. */
VD_API double vd_quad_pixels(const vd_quad *quad, float near_m, int width, int height);

VD_END_DECLARATIONS

#endif
