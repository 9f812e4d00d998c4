/* placed.h: models and bricks of particles that a client draws itself, over what it shows.
 *
 *     light ─────┐
 *     models ────┴► the rasterizer and the shaders of a world ──┐
 *     bricks ─────► the splatter, hidden by those ──────────────┴► transparent ──► over the window
 *
 * Models of one call hide each other by depth; what was drawn before lies behind all of it. Of the
 * ground each may bring the plane that it stands on, which hides what of it is below. Materials,
 * textures and haze are those of a world's own pictures; of the shadows that things and hills throw
 * on a model there is one number. Bricks come last, as particles of a world do, in the order given:
 * back to front. How large and dense their particles are is what brick_view.h has for the camera.
 *
 * The native client and the page in a browser are made of the same file (src/world/placed.c): no
 * threads, files or clock but those of the context, and the same bytes. Numbers may come from a
 * hostile server: whatever they are, a frame ends in time in proportion to the window and the
 * limits below.
 */
#ifndef VEDUTA_PLACED_H
#define VEDUTA_PLACED_H

#include <veduta/brick_block.h>
#include <veduta/light.h>
#include <veduta/model.h>

VD_BEGIN_DECLARATIONS

/* Of a frame's calls together: primitives and vertices; calls; particles; and pixels of the boxes
 * around primitives (vd_raster_def.most_pixels) and of particles in times the window's. What comes
 * after that is left out, or a server could ask for the work of a minute. Of things that blend a
 * pixel shows so many. */
#define VD_PLACED_MOST ((uint64_t)1 << 20)
#define VD_PLACED_RUNS 16
#define VD_PLACED_PARTICLES ((uint64_t)1 << 20)
#define VD_PLACED_OVERDRAW 64
#define VD_PLACED_SCREENS 256
#define VD_PLACED_LAYERS 32

/* So many times as much no sound server asks for: a client leaves one that does. */
#define VD_PLACED_ABSURD 4

typedef struct vd_place {
    vd_vec3 origin;   /* where the model's own origin stands: world, metres */
    float axes[3][3]; /* where its x, y and z axis lead, one after the other */
    float sun;        /* share of the sun that it gets, 0 … 1 */
    bool has_ground;  /* which hides what of it is below: */
    float ground[3];  /* height over origin; how much it rises a metre to the east, to the north */
} vd_place;

/* Neither is owned. */
typedef struct vd_placed {
    const vd_model *model; /* and where it stands; null: */
    vd_place place;
    const vd_brick_block *brick; /* which knows that itself */
} vd_placed;

/* Part of a frame, or one that is the caller's own. */
typedef struct vd_placed_window {
    uint8_t *rgba; /* [height][stride][4], premultiplied in encoded space */
    int width, height;
    size_t stride; /* pixels */
} vd_placed_window;

/* The memory that drawing takes, kept from call to call. One call at a time. */
typedef struct vd_placer vd_placer;

/* *out is owned by the caller. Returns VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_placer_create(vd_context *context, vd_placer **out);
VD_API void vd_placer_destroy(vd_placer **placer);

/* What was asked for in a frame so far, drawn or not. Zeros before its first call. */
typedef struct vd_placed_account {
    int runs;
    uint64_t primitives, pixels;
    uint64_t particles, dots; /* dots: pixels of particles */
} vd_placed_account;

/* Whether that is more than any sound server asks for. */
VD_API bool vd_placed_is_absurd(const vd_placed_account *account, int width, int height);

/* Draws `count` models, 4 samples a pixel, and bricks over the window. Of `light`, which models
 * alone need, zenith and nadir do not matter. `account` is that of the frame; null: the call is all
 * of it. `drawn` gets how many were in sight (may be null), and so may `job` be. Returns
 * VD_ERROR_MEMORY, VD_ERROR_ARGUMENT (the camera) or VD_ERROR_CANCELLED; the window is then as it
 * was. */
VD_API VD_MUST_USE vd_status vd_placer_draw(vd_placer *placer, vd_job *job, const vd_light *light,
                                            const vd_camera *camera, const vd_placed *placed,
                                            int count, const vd_placed_window *window,
                                            vd_placed_account *account, int *drawn);

VD_END_DECLARATIONS

#endif
