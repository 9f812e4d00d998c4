/* furniture.h: what stands around a map: title, north arrow, scale bar, legend of heights.
 *
 * All of it is layers of vector paths (coverage.h) that are drawn over a finished picture, and
 * rectangles that labels keep out of (label_layout.h). Letters come from a function of the caller's
 * which outlines text; vd_font_outline (text.h) is one.
 *
 *     status = vd_furniture_create(context, &def, &furniture);
 *     status = vd_furniture_arrange(furniture, &camera, width, height, ground_m, &overlay);
 *     status = vd_coverage_draw_frame(coverage, NULL, NULL, overlay.layers, overlay.layer_count,
 *                                     frame);
 *
 * The title stands at the top in the middle, the arrow at the top right, the bar at the bottom
 * left, the legend at the bottom right. What a picture is too small for is left out.
 */
#ifndef VEDUTA_FURNITURE_H
#define VEDUTA_FURNITURE_H

#include <veduta/camera.h>
#include <veduta/colormap.h>
#include <veduta/outline.h>

VD_BEGIN_DECLARATIONS

/* What lies over a picture. Layers are drawn in order; labels keep out of the `kept` rectangles. */
typedef struct vd_overlay {
    const vd_layer *layers;
    size_t layer_count;
    const float (*kept)[4]; /* [kept_count]: x0, y0, x1, y1, picture pixels */
    size_t kept_count;
} vd_overlay;

typedef struct vd_furniture_def {
    const char *title;         /* UTF-8; null or empty: none. Made smaller where it is too long */
    bool north;                /* an arrow to the north */
    bool scale;                /* a bar of a round length: 1, 2 or 5 × 10ⁿ m or km */
    const vd_colormap *legend; /* null: none. A bar of its colours with 4 to 6 round heights */
    double legend_min, legend_max; /* heights, metres: the range of the data, min < max, or the
                                      legend is left out */
    const char *legend_title;      /* null: "Height (m)" */
    double size_px; /* of the letters, pixels an em; 0: a 48th of the picture's height, 11 to 96 */
    vd_rgba8 color, halo;         /* straight; halo alpha 0: none */
    vd_outline_function *outline; /* required where there is any text: for all but no furniture */
    void *outline_user;
} vd_furniture_def;

/* Nothing, in the colours of vd_letters_default. */
VD_API vd_furniture_def vd_furniture_def_default(void);

typedef struct vd_furniture vd_furniture;

/* Copies the def with its title and legend. *out is owned by the caller. Returns VD_ERROR_ARGUMENT
 * (names the field), VD_ERROR_LIMIT (a title above 4,096 bytes) or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_furniture_create(vd_context *context, const vd_furniture_def *def,
                                                 vd_furniture **out);
VD_API void vd_furniture_destroy(vd_furniture **furniture);

/* Arranges the furniture for a picture. What *out points to lives until the next call. Text is
 * outlined again only where it has changed; a picture of the same size allocates nothing here.
 *
 * The arrow shows where north is as seen from above, whatever the pitch. The bar is exact for
 * orthographic cameras; for others it is right for ground that lies `ground_m` metres from the eye
 * along the view axis (the distance of what is in the picture's middle; 0: not known, and no bar),
 * which a note below it says, unless the camera looks down by 60° or more.
 *
 * Returns VD_ERROR_ARGUMENT (the camera, the picture's size), VD_ERROR_MEMORY, or what the outline
 * function does; *out is then untouched, and nothing of the last call may be used any more. */
VD_API VD_MUST_USE vd_status vd_furniture_arrange(vd_furniture *furniture, const vd_camera *camera,
                                                  int width, int height, double ground_m,
                                                  vd_overlay *out);

VD_END_DECLARATIONS

#endif
