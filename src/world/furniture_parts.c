/* furniture_parts.c: north arrow, scale bar, legend. */
#include <math.h>
#include <stdio.h>
#include "core/real.h"
#include "world/furniture_internal.h"

static double whole(double x) {
    return floor(x + 0.5);
}

/* The dark half of things that are light and dark, whatever the halo is. */
static const vd_rgba8 dark = {38, 46, 58, 255};

/* ---- north arrow --------------------------------------------------------------------------------
 */

/* The arrow turned, its middle at (x, y), `scale` pixels large from there to its tip. */
static vd_layer *add_turned(vd_furniture *f, const double (*points)[2], size_t count, double x,
                            double y, double scale, double angle_rad, vd_rgba8 color) {
    const double c = vd_cos(angle_rad) * scale, s = vd_sin(angle_rad) * scale;
    vd_layer *layer = vd_furniture_polygon(f, points, count, color);
    layer->picture_from_path = (vd_affine){c, -s, x, s, c, y};
    return layer;
}

vd_status vd_furniture_north(vd_furniture *f) {
    static const double kite[4][2] = {{0, -1}, {0.62, 0.8}, {0, 0.45}, {-0.62, 0.8}};
    static const double half[3][2] = {{0, -1}, {0.62, 0.8}, {0, 0.45}};
    const double side = VD_FURNITURE_NORTH_EMS * f->size;
    if (2 * side > f->width || 2 * side > f->height) {
        return vd_success();
    }
    const vd_status status = vd_furniture_outline(f, VD_TEXT_NORTH, "N", 1.25 * f->size);
    if (status.code != VD_OK) {
        return status;
    }
    double heading, pitch, roll;
    vd_orientation_to_angles(f->camera->orientation, &heading, &pitch, &roll);
    const double x = f->width - f->margin - 0.5 * side, y = f->margin + 0.5 * side;
    if (!vd_furniture_keep(f, x - 0.5 * side, y - 0.5 * side, x + 0.5 * side, y + 0.5 * side)) {
        return vd_success();
    }
    const double scale = 1.15 * f->size, line = f->size / 16;
    vd_layer *layer = add_turned(f, kite, 4, x, y, scale, -heading, dark);
    vd_furniture_stroke(f, layer, line + f->halo, f->def.halo);
    layer = add_turned(f, kite, 4, x, y, scale, -heading, f->def.color);
    vd_furniture_stroke(f, layer, line, f->def.color);
    layer->filled = true;
    add_turned(f, half, 3, x, y, scale, -heading, dark);
    /* The letter stays upright and goes around with the tip. */
    const double *ink = f->slots[VD_TEXT_NORTH].outline.ink;
    const double away = 2.0 * f->size;
    vd_furniture_write(f, VD_TEXT_NORTH, x - vd_sin(heading) * away - 0.5 * (ink[0] + ink[2]),
                       y - vd_cos(heading) * away - 0.5 * (ink[1] + ink[3]));
    return vd_success();
}

/* ---- scale bar ----------------------------------------------------------------------------------
 */

/* Picture pixels a metre; 0: not known. */
static double pixels_per_metre(const vd_furniture *f) {
    if (f->camera->projection == VD_PROJECTION_ORTHOGRAPHIC) {
        return f->camera->lens.fx;
    }
    return f->ground_m > 0 && isfinite(f->ground_m) ? f->camera->lens.fx / f->ground_m : 0;
}

/* Whether ground is at other distances elsewhere in the picture. */
static bool is_slanted(const vd_camera *camera) {
    double heading, pitch, roll;
    vd_orientation_to_angles(camera->orientation, &heading, &pitch, &roll);
    return camera->projection == VD_PROJECTION_PERSPECTIVE && pitch > vd_radians(-60.0);
}

static vd_status outline_scale(vd_furniture *f, double length_m) {
    char number[40], text[48];
    const double unit = length_m >= 1000 ? 1000 : 1;
    vd_round_text(length_m / unit, length_m / unit, number, sizeof number);
    snprintf(text, sizeof text, "%s %s", number, unit > 1 ? "km" : "m");
    vd_status status = vd_furniture_outline(f, VD_TEXT_SCALE_BEGIN, "0", f->size);
    if (status.code == VD_OK) {
        status = vd_furniture_outline(f, VD_TEXT_SCALE_END, text, f->size);
    }
    if (status.code == VD_OK) {
        status = vd_furniture_outline(f, VD_TEXT_SCALE_NOTE, "in the middle of the picture",
                                      floor(0.75 * f->size));
    }
    return status;
}

/* The bar itself, light with dark parts, from (x0, y0) to (x1, y1). */
static void add_bar(vd_furniture *f, double x0, double y0, double x1, double y1, int parts) {
    const double line = whole(f->size / 14) > 1 ? whole(f->size / 14) : 1;
    vd_layer *layer = vd_furniture_rectangle(f, x0, y0, x1, y1, dark);
    vd_furniture_stroke(f, layer, f->halo, f->def.halo);
    vd_furniture_rectangle(f, x0, y0, x1, y1, f->def.color);
    for (int i = 0; i < parts; i += 2) {
        const double from = x0 + (x1 - x0) * i / parts, to = x0 + (x1 - x0) * (i + 1) / parts;
        vd_furniture_rectangle(f, i == 0 ? from + line : from, y0 + line,
                               i + 1 == parts ? to - line : to, y1 - line, dark);
    }
}

vd_status vd_furniture_scale(vd_furniture *f) {
    const double scale = pixels_per_metre(f);
    const double room = 0.22 * f->width < 18 * f->size ? 0.22 * f->width : 18 * f->size;
    if (!(scale > 0) || !(room / scale > 1e-3) || !(room / scale < 1e12) || room < 4 * f->size ||
        12 * f->size > f->height) {
        return vd_success();
    }
    int parts;
    const double length_m = vd_round_length(room / scale, &parts), length = length_m * scale;
    const vd_status status = outline_scale(f, length_m);
    if (status.code != VD_OK) {
        return status;
    }
    const bool note = is_slanted(f->camera);
    const vd_outline *begin = &f->slots[VD_TEXT_SCALE_BEGIN].outline;
    const vd_outline *end = &f->slots[VD_TEXT_SCALE_END].outline;
    const vd_outline *below = &f->slots[VD_TEXT_SCALE_NOTE].outline;
    const double x = f->margin + whole(0.5 * begin->advance);
    const double bottom = f->height - f->margin - (note ? whole(0.95 * f->size) : 0);
    const double top = bottom - whole(0.42 * f->size);
    const double baseline = top - whole(0.4 * f->size);
    const double half = length + 0.5 * end->advance;
    const double right = x + (note && below->ink[2] > half ? below->ink[2] : half);
    if (!vd_furniture_keep(f, 0, baseline - f->size, right + 0.5 * f->size, f->height)) {
        return vd_success();
    }
    add_bar(f, x, top, x + length, bottom, parts);
    vd_furniture_write(f, VD_TEXT_SCALE_BEGIN, x - 0.5 * begin->advance, baseline);
    vd_furniture_write(f, VD_TEXT_SCALE_END, x + length - 0.5 * end->advance, baseline);
    if (note) {
        vd_furniture_write(f, VD_TEXT_SCALE_NOTE, x - below->ink[0], f->height - f->margin);
    }
    return vd_success();
}

/* ---- legend -------------------------------------------------------------------------------------
 */

/* The bar's colours, the highest on top, in slices of whole pixels: neighbours have no seam. */
static void add_colors(vd_furniture *f, double x0, double y0, double x1, int rows) {
    const vd_furniture_def *def = &f->def;
    const int slices = rows < VD_FURNITURE_SLICES ? rows : VD_FURNITURE_SLICES;
    for (int i = 0; i < slices; i++) {
        const double from = (double)((long)rows * i / slices);
        const double to = (double)((long)rows * (i + 1) / slices);
        const double height =
            def->legend_max - (def->legend_max - def->legend_min) * (0.5 * (from + to) / rows);
        vd_furniture_rectangle(
            f, x0, y0 + from, x1, y0 + to,
            vd_colormap_at(&f->legend, height, def->legend_min, def->legend_max));
    }
}

static vd_status outline_legend(vd_furniture *f, const double *heights, int count, double step) {
    vd_status status = vd_furniture_outline(f, VD_TEXT_LEGEND_TITLE, f->def.legend_title, f->size);
    for (int i = 0; i < count && status.code == VD_OK; i++) {
        char text[40];
        vd_round_text(heights[i], step, text, sizeof text);
        status =
            vd_furniture_outline(f, (vd_furniture_text)(VD_TEXT_LEGEND_LABEL + i), text, f->size);
    }
    return status;
}

/* Where the bar and the numbers beside it stand, picture pixels. */
typedef struct legend_place {
    double x0, y0, x1, y1; /* the bar's colours */
    double line;           /* width of its frame and of the ticks */
    double tick;           /* where ticks begin, at the left */
    double title_x, title_y;
} legend_place;

/* Where a number begins that ends beside its tick. */
static double number_x(const vd_furniture *f, const legend_place *p, int i) {
    return p->tick - 0.35 * f->size - f->slots[VD_TEXT_LEGEND_LABEL + i].outline.advance;
}

/* False: something else stands there. */
static bool place_legend(vd_furniture *f, double rows, int count, legend_place *p) {
    p->line = whole(f->size / 14) > 1 ? whole(f->size / 14) : 1;
    p->x1 = f->width - f->margin - p->line;
    p->x0 = p->x1 - whole(0.9 * f->size);
    p->y1 = f->height - f->margin - p->line;
    p->y0 = p->y1 - rows;
    p->tick = p->x0 - p->line - whole(0.4 * f->size);
    p->title_x = f->width - f->margin - f->slots[VD_TEXT_LEGEND_TITLE].outline.ink[2];
    p->title_y = p->y0 - p->line - 0.8 * f->size;
    double left = p->title_x;
    for (int i = 0; i < count; i++) {
        const double x = number_x(f, p, i);
        left = x < left ? x : left;
    }
    return vd_furniture_keep(f, left - 0.5 * f->size, p->title_y - 1.2 * f->size, f->width,
                             f->height);
}

static void add_frame(vd_furniture *f, const legend_place *p) {
    const double x0 = p->x0 - p->line, y0 = p->y0 - p->line;
    const double x1 = p->x1 + p->line, y1 = p->y1 + p->line;
    vd_layer *halo = vd_furniture_rectangle(f, x0, y0, x1, y1, f->def.halo);
    vd_furniture_stroke(f, halo, f->halo, f->def.halo);
    vd_furniture_rectangle(f, x0, y0, x1, y1, f->def.color);
}

vd_status vd_furniture_legend(vd_furniture *f) {
    const double min = f->def.legend_min, max = f->def.legend_max;
    double heights[VD_ROUND_LABELS], step = 1;
    const int count = vd_round_labels(min, max, heights, &step);
    const double most = whole(0.36 * f->height), least = 7 * f->size;
    const double rows = 11 * f->size < most ? whole(11 * f->size) : most;
    if (count == 0 || rows < least || 16 * f->size > f->width) {
        return vd_success();
    }
    const vd_status status = outline_legend(f, heights, count, step);
    legend_place p;
    if (status.code != VD_OK || !place_legend(f, rows, count, &p)) {
        return status;
    }
    add_frame(f, &p);
    add_colors(f, p.x0, p.y0, p.x1, (int)rows);
    for (int i = 0; i < count; i++) {
        const double y = p.y1 - rows * (heights[i] - min) / (max - min);
        const double top = whole(y - 0.5 * p.line), right = p.x0 - p.line;
        vd_layer *halo = vd_furniture_rectangle(f, p.tick, top, right, top + p.line, f->def.halo);
        vd_furniture_stroke(f, halo, f->halo, f->def.halo);
        vd_furniture_rectangle(f, p.tick, top, right, top + p.line, f->def.color);
        vd_furniture_write(f, (vd_furniture_text)(VD_TEXT_LEGEND_LABEL + i), number_x(f, &p, i),
                           y + 0.36 * f->size);
    }
    vd_furniture_write(f, VD_TEXT_LEGEND_TITLE, p.title_x, p.title_y);
    return vd_success();
}
