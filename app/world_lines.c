/* world_lines.c: tracks and borders, laid on the ground. */
#include <math.h>
#include <stdlib.h>

#include "world_place.h"

/* Longer lines are cut: each piece is culled alone, and what is hidden costs nothing. */
enum { PIECE_POINTS = 512 };

static const size_t most_points = (size_t)1 << 24;

/* A line that is being laid. */
typedef struct draping {
    const vd_placer *placer;
    const vd_world_line *line; /* its look */
    double step;               /* metres between points: a quarter of a cell */
    size_t laid, lines;        /* points so far, pieces so far */
    size_t count;
    vd_vec3 points[PIECE_POINTS];
} draping;

/* Metres between the samples of the terrain; what is drawn between them is nearly straight. */
static double cell_of(const vd_scene *scene) {
    if (scene->terrain == NULL) {
        return INFINITY;
    }
    const double *m = scene->terrain->world_from_sample;
    return scene->function != NULL ? scene->cell_m : sqrt(fabs(m[1] * m[5] - m[2] * m[4]));
}

/* Ends the piece; with `go_on` the next one begins where it ended. */
static vd_status end_piece(draping *d, bool go_on) {
    const vd_line_def def = {.points = d->points,
                             .count = d->count,
                             .width_px = d->line->width_px,
                             .color = d->line->color};
    vd_object *object = NULL;
    vd_status status = vd_success();
    if (d->count >= 2) {
        status = vd_line_create(d->placer->scene->context, &def, &object);
        if (status.code == VD_OK) {
            status = vd_place_add(d->placer, object);
        }
        d->lines++;
    }
    if (go_on && d->count > 0) {
        d->points[0] = d->points[d->count - 1];
    }
    d->count = go_on && d->count > 0 ? 1 : 0;
    return status;
}

static vd_status lay_point(draping *d, double x, double y) {
    const double z = vd_place_ground(d->placer, x, y) + d->line->above_m;
    if (!isfinite(z)) {
        return end_piece(d, false);
    }
    vd_status status = d->count == PIECE_POINTS ? end_piece(d, true) : vd_success();
    d->points[d->count++] = vd_vec3_make(x, y, z);
    return status;
}

/* Lays the way from one point to the next, without the first. */
static vd_status lay_segment(draping *d, const double from[2], const double to[2]) {
    const double dx = to[0] - from[0], dy = to[1] - from[1];
    const double parts = ceil(sqrt(dx * dx + dy * dy) / d->step);
    if (!(parts + (double)d->laid <= (double)most_points)) {
        return vd_failure(VD_ERROR_LIMIT,
                          "it takes more than %zu points on the ground; leave some of it out",
                          most_points);
    }
    const size_t count = parts >= 1.0 ? (size_t)parts : 1;
    vd_status status = vd_success();
    for (size_t i = 1; i <= count && status.code == VD_OK; i++) {
        const double t = (double)i / (double)count;
        status = i < count ? lay_point(d, from[0] + t * dx, from[1] + t * dy)
                           : lay_point(d, to[0], to[1]);
    }
    d->laid += count;
    return status;
}

/* Lays a line through `count` points of the world. */
static vd_status lay(draping *d, const double (*at)[2], size_t count, bool closed) {
    vd_status status = lay_point(d, at[0][0], at[0][1]);
    for (size_t i = 1; i < count && status.code == VD_OK; i++) {
        status = lay_segment(d, at[i - 1], at[i]);
    }
    if (status.code == VD_OK && closed) {
        status = lay_segment(d, at[count - 1], at[0]);
    }
    return status.code == VD_OK ? end_piece(d, false) : status;
}

static vd_status out_of_memory(void) {
    return vd_failure(VD_ERROR_MEMORY, "out of memory while laying a line");
}

/* The line that a world file spells out. */
static vd_status lay_points(draping *d) {
    const vd_world_line *line = d->line;
    const vd_scene *scene = &d->placer->scene->scene;
    double(*at)[2] = malloc(line->count * sizeof *at);
    vd_status status = at != NULL ? vd_success() : out_of_memory();
    for (size_t i = 0; i < line->count && status.code == VD_OK; i++) {
        at[i][0] = line->points[i][0];
        at[i][1] = line->points[i][1];
        if (line->geographic) {
            status = vd_scene_world_from_latlon(scene, line->points[i][1], line->points[i][0],
                                                &at[i][0], &at[i][1]);
        }
    }
    if (status.code == VD_OK) {
        status = lay(d, at, line->count, line->closed);
    }
    if (status.code == VD_OK && d->lines == 0) {
        status = vd_failure(VD_ERROR_FORMAT, "no part of it is on the map; give other points");
    }
    free(at);
    return status;
}

/* Lays one part of a file's feature. */
static vd_status lay_part(draping *d, const vd_features *features, size_t part) {
    const size_t first = features->parts[part], count = features->parts[part + 1] - first;
    double(*at)[2] = malloc(count * sizeof *at);
    if (at == NULL) {
        return out_of_memory();
    }
    for (size_t i = 0; i < count; i++) {
        vd_place_feature_point(d->placer, features->points[first + i], &at[i][0], &at[i][1]);
    }
    const vd_status status = lay(d, at, count, false);
    free(at);
    return status;
}

static vd_status lay_features(draping *d, const vd_features *features) {
    size_t found = 0, off = 0;
    vd_status status = vd_success();
    for (size_t i = 0; i < features->count && status.code == VD_OK; i++) {
        const vd_feature *f = &features->features[i];
        if (f->kind == VD_FEATURE_POINT) {
            continue;
        }
        const size_t before = d->lines;
        for (size_t part = 0; part < f->part_count && status.code == VD_OK; part++) {
            status = lay_part(d, features, f->first_part + part);
        }
        found++;
        off += d->lines == before ? 1u : 0u;
    }
    if (status.code != VD_OK) {
        return status;
    }
    if (found == 0 || off == found) {
        return vd_failure(VD_ERROR_FORMAT, "%.200s has %s; give another file", d->line->path,
                          found == 0 ? "no line of two points or more" : "no line on the map");
    }
    if (off > 0) {
        vd_log(d->placer->scene->context, VD_LOG_WARNING,
               "%.160s: %zu of %zu lines are off the map and left out", d->line->path, off, found);
    }
    return status;
}

static vd_status place_line(const vd_placer *placer, const vd_world_line *line) {
    draping *d = calloc(1, sizeof *d);
    if (d == NULL) {
        return out_of_memory();
    }
    d->placer = placer;
    d->line = line;
    d->step = 0.25 * cell_of(&placer->scene->scene);
    vd_status status = vd_success();
    if (line->path == NULL) {
        status = lay_points(d);
        status = status.code == VD_OK ? status : vd_place_failure(placer, line->key, &status);
    } else {
        vd_features *features = NULL;
        vd_geo_module geo;
        status = vd_place_features(placer, line->key, line->path, NULL, &geo, &features);
        if (status.code == VD_OK) {
            status = lay_features(d, features);
            status = status.code == VD_OK ? status : vd_place_failure(placer, line->key, &status);
            geo.features_destroy(&features);
        }
    }
    free(d);
    return status;
}

vd_status vd_place_lines(const vd_placer *placer, const vd_world_content *content) {
    const char *flag = placer->settings->lines;
    vd_status status = vd_success();
    for (size_t i = 0; i < content->line_count && status.code == VD_OK; i++) {
        status = place_line(placer, &content->lines[i]);
    }
    if (flag != NULL && status.code == VD_OK) {
        const vd_world_line line = {.key = "--lines",
                                    .path = flag,
                                    .color = vd_world_line_color,
                                    .width_px = vd_world_line_width_px};
        status = place_line(placer, &line);
    }
    return status;
}
