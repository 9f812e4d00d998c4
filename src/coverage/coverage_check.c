/* coverage_check.c: whether layers can be drawn, and where they lie. */
#include <math.h>
#include "coverage/coverage_check.h"

static bool refuse(vd_status *why, vd_status status) {
    if (why != NULL) {
        *why = status;
    }
    return false;
}

static bool check_verbs(const vd_path *path, size_t index, vd_status *why) {
    static const size_t counts[VD_PATH_VERB_COUNT] = {1, 1, 2, 3, 0};
    size_t points = 0;
    for (size_t i = 0; i < path->verb_count; i++) {
        if (path->verbs[i] >= VD_PATH_VERB_COUNT) {
            return refuse(why, vd_failure(VD_ERROR_ARGUMENT,
                                          "layer %zu: verb %zu of the path is %d, which is none",
                                          index, i, path->verbs[i]));
        }
        points += counts[path->verbs[i]];
    }
    if (path->verb_count > 0 && path->verbs[0] != VD_PATH_MOVE) {
        return refuse(
            why, vd_failure(VD_ERROR_ARGUMENT,
                            "layer %zu: the path must begin with VD_PATH_MOVE, not with verb %d",
                            index, path->verbs[0]));
    }
    if (points != path->point_count) {
        return refuse(why, vd_failure(VD_ERROR_ARGUMENT,
                                      "layer %zu: the path's verbs take %zu points, but it has %zu",
                                      index, points, path->point_count));
    }
    return true;
}

static bool check_stroke(const vd_stroke *stroke, size_t index, vd_status *why) {
    if (!(stroke->width > 0 && stroke->width <= 65536)) {
        return refuse(
            why,
            vd_failure(VD_ERROR_ARGUMENT,
                       "layer %zu: the stroke's width is %g pixels; give above 0, at most 65536",
                       index, stroke->width));
    }
    if ((unsigned)stroke->join >= VD_JOIN_COUNT || (unsigned)stroke->cap >= VD_CAP_COUNT) {
        return refuse(why, vd_failure(VD_ERROR_ARGUMENT,
                                      "layer %zu: the stroke's join %d or cap %d is unknown", index,
                                      (int)stroke->join, (int)stroke->cap));
    }
    if (!(stroke->miter_limit == 0 || (stroke->miter_limit >= 1 && stroke->miter_limit <= 64))) {
        return refuse(
            why, vd_failure(VD_ERROR_ARGUMENT,
                            "layer %zu: the stroke's miter limit is %g; give 1 to 64, or 0 for 4",
                            index, stroke->miter_limit));
    }
    if (stroke->dash_count < 0 || stroke->dash_count > VD_MAX_DASHES ||
        stroke->dash_count % 2 != 0 || !(fabs(stroke->dash_offset) <= VD_MOST_PIXELS)) {
        return refuse(
            why,
            vd_failure(VD_ERROR_ARGUMENT,
                       "layer %zu: the stroke has %d dashes from %g on; give an even number, at "
                       "most %d, and an offset within 2^29 pixels",
                       index, stroke->dash_count, stroke->dash_offset, VD_MAX_DASHES));
    }
    double total = stroke->dash_count == 0 ? 1 : 0;
    for (int i = 0; i < stroke->dash_count; i++) {
        total = stroke->dashes[i] >= 0 ? total + stroke->dashes[i] : NAN;
    }
    if (!(total >= 0.0625 && total <= VD_MOST_PIXELS)) {
        return refuse(
            why,
            vd_failure(VD_ERROR_ARGUMENT,
                       "layer %zu: the stroke's dashes must not be negative, and together at least "
                       "1/16 pixel long and at most 2^29; a paler colour looks like finer ones",
                       index));
    }
    return true;
}

static bool check_fields(const vd_layer *layer, size_t index, vd_status *why) {
    const vd_path *path = &layer->path;
    if ((path->points == NULL && path->point_count > 0) ||
        (path->verbs == NULL && path->verb_count > 0)) {
        return refuse(
            why, vd_failure(VD_ERROR_ARGUMENT, "layer %zu: the path's %s are null", index,
                            path->points == NULL && path->point_count > 0 ? "points" : "verbs"));
    }
    if ((unsigned)layer->rule >= VD_FILL_RULE_COUNT) {
        return refuse(why, vd_failure(VD_ERROR_ARGUMENT, "layer %zu: the fill rule %d is unknown",
                                      index, (int)layer->rule));
    }
    if (!(layer->expand >= 0 && layer->expand <= 16)) {
        return refuse(
            why, vd_failure(VD_ERROR_ARGUMENT,
                            "layer %zu: the fill cannot be expanded by %g pixels; give 0 to 16",
                            index, layer->expand));
    }
    return (path->verbs == NULL || check_verbs(path, index, why)) &&
           (layer->stroke == NULL || check_stroke(layer->stroke, index, why));
}

static bool refuse_point(size_t index, size_t point, double x, double y, vd_status *why) {
    if (isfinite(x) && isfinite(y)) {
        return refuse(
            why,
            vd_failure(VD_ERROR_LIMIT,
                       "layer %zu: point %zu of the path lies at (%g, %g) pixels; positions may go "
                       "to 2^29 (536870912) at most: clip before drawing",
                       index, point, x, y));
    }
    return refuse(
        why,
        vd_failure(VD_ERROR_ARGUMENT,
                   "layer %zu: point %zu of the path is not finite after the transform: (%g, %g)",
                   index, point, x, y));
}

bool vd_check_layer(const vd_layer *layer, size_t index, vd_box *box, vd_status *why) {
    if (!check_fields(layer, index, why)) {
        return false;
    }
    const vd_affine m = layer->picture_from_path;
    vd_box own = vd_box_empty();
    for (size_t i = 0; i < layer->path.point_count; i++) {
        const double *p = layer->path.points[i];
        const double x = m.xx * p[0] + m.xy * p[1] + m.x0;
        const double y = m.yx * p[0] + m.yy * p[1] + m.y0;
        if (!(fabs(x) <= VD_MOST_PIXELS && fabs(y) <= VD_MOST_PIXELS)) {
            return refuse_point(index, i, x, y, why);
        }
        own.min_x = x < own.min_x ? x : own.min_x;
        own.max_x = own.max_x < x ? x : own.max_x;
        own.min_y = y < own.min_y ? y : own.min_y;
        own.max_y = own.max_y < y ? y : own.max_y;
    }
    double margin = 4 * layer->expand;
    if (layer->stroke != NULL) {
        margin =
            margin < vd_stroke_margin(layer->stroke) ? vd_stroke_margin(layer->stroke) : margin;
    }
    own.min_x -= margin;
    own.min_y -= margin;
    own.max_x += margin;
    own.max_y += margin;
    vd_box_add(box, &own);
    return true;
}
