/* furniture_internal.h: what furniture is made of. For the files that make it only. */
#ifndef VEDUTA_WORLD_FURNITURE_INTERNAL_H
#define VEDUTA_WORLD_FURNITURE_INTERNAL_H

#include <veduta/furniture.h>
#include "world/round_numbers.h"

#define VD_FURNITURE_SLICES 256 /* of the legend's bar */

/* The texts there can be. */
typedef enum vd_furniture_text {
    VD_TEXT_TITLE = 0,
    VD_TEXT_NORTH,
    VD_TEXT_SCALE_BEGIN,
    VD_TEXT_SCALE_END,
    VD_TEXT_SCALE_NOTE,
    VD_TEXT_LEGEND_TITLE,
    VD_TEXT_LEGEND_LABEL, /* and those after it */
    VD_FURNITURE_TEXTS = VD_TEXT_LEGEND_LABEL + VD_ROUND_LABELS
} vd_furniture_text;

/* The slices, and for everything else: a halo, a shape and another one. */
#define VD_FURNITURE_LAYERS (VD_FURNITURE_SLICES + 2 * VD_FURNITURE_TEXTS + 40)
#define VD_FURNITURE_POINTS (4 * VD_FURNITURE_LAYERS)
#define VD_FURNITURE_STROKES 64
#define VD_FURNITURE_KEPT 4
#define VD_FURNITURE_NORTH_EMS 5.2 /* side of the square in which the arrow turns */

/* A text as it was outlined last. */
typedef struct vd_furniture_slot {
    char *text; /* null: none yet */
    double size_px;
    vd_outline outline;
} vd_furniture_slot;

struct vd_furniture {
    vd_context *context;
    vd_furniture_def def; /* title and legend point into this block */
    char *title, *legend_title;
    double title_width; /* of what is inked, in ems; below 0: not measured yet */
    vd_colormap legend;
    vd_furniture_slot slots[VD_FURNITURE_TEXTS];

    /* Of the picture that is being arranged. */
    const vd_camera *camera;
    int width, height;
    double size, margin, halo; /* picture pixels: em of the letters, to the edge, around things */
    double ground_m;
    vd_layer layers[VD_FURNITURE_LAYERS];
    double points[VD_FURNITURE_POINTS][2];
    vd_stroke strokes[VD_FURNITURE_STROKES];
    float kept[VD_FURNITURE_KEPT][4];
    size_t layer_count, point_count, stroke_count, kept_count;
};

/* Outlines a text, unless it is the slot's already. */
VD_MUST_USE vd_status vd_furniture_outline(vd_furniture *furniture, vd_furniture_text slot,
                                           const char *text, double size_px);

/* Draws a slot's text with its baseline beginning at (x, y), which are rounded to whole pixels. */
void vd_furniture_write(vd_furniture *furniture, vd_furniture_text slot, double x, double y);

/* Adds a polygon of `count` points, filled; the layer may be changed. */
vd_layer *vd_furniture_polygon(vd_furniture *furniture, const double (*points)[2], size_t count,
                               vd_rgba8 color);
vd_layer *vd_furniture_rectangle(vd_furniture *furniture, double x0, double y0, double x1,
                                 double y1, vd_rgba8 color);

/* Makes a layer an outline only, `width` pixels on each side. */
void vd_furniture_stroke(vd_furniture *furniture, vd_layer *layer, double width, vd_rgba8 color);

/* Labels keep out of this; false when something stands there already: the picture is too small. */
bool vd_furniture_keep(vd_furniture *furniture, double x0, double y0, double x1, double y1);

/* The parts. Each leaves itself out where the picture is too small for it. */
VD_MUST_USE vd_status vd_furniture_north(vd_furniture *furniture);
VD_MUST_USE vd_status vd_furniture_scale(vd_furniture *furniture);
VD_MUST_USE vd_status vd_furniture_legend(vd_furniture *furniture);

#endif
