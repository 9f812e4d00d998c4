/* world_labels.c: names of places and peaks. */
#include <math.h>
#include <stdlib.h>

#include "text_module.h"
#include "world_place.h"

/* The size of a world's names: a share of the picture's height, so that a larger picture of the
 * same view shows the same. */
static const double share_of_height = 1.0 / 54.0, least_px = 10.0, most_px = 96.0;

static const vd_rgba8 dark = {24, 24, 24, 255}, light = {255, 255, 255, 224};

/* What writing needs, opened with the first name. */
typedef struct lettering {
    const vd_placer *placer;
    bool open;
    vd_text_module text;
    vd_font *font;
    double size_px;
} lettering;

static vd_status open_font(lettering *l) {
    if (l->open) {
        return vd_success();
    }
    vd_status status = vd_text_module_open("write names", &l->text);
    if (status.code == VD_OK) {
        status = l->text.find(l->placer->scene->context, NULL, &l->font);
    }
    l->open = status.code == VD_OK;
    const double size = share_of_height * l->placer->settings->height;
    l->size_px = size < least_px ? least_px : size > most_px ? most_px : size;
    return status;
}

/* Adds a name; `look` says how it is shown. */
static vd_status write_name(lettering *l, const char *text, vd_vec3 at, double priority,
                            const vd_world_label *look) {
    vd_outline outline = {.context = NULL};
    vd_status status = open_font(l);
    if (status.code == VD_OK) {
        status = l->text.outline(l->font, text, l->size_px, &outline);
    }
    if (status.code != VD_OK) {
        return status;
    }
    const vd_label_def def = {.text = text,
                              .place = at,
                              .outline = outline.path,
                              .advance = (float)outline.advance,
                              .ascent = (float)outline.ascent,
                              .descent = (float)outline.descent,
                              .color = look->color.a > 0 ? look->color : dark,
                              .halo = light,
                              .priority = priority,
                              .hidden = look->hidden};
    vd_object *object = NULL;
    status = vd_label_create(l->placer->scene->context, &def, &object);
    if (status.code == VD_OK) {
        status = vd_place_add(l->placer, object);
    }
    vd_outline_finish(&outline);
    return status;
}

/* The middle of a feature: of a point itself, of others the mean of the first part's corners. */
static void middle_of(const vd_placer *p, const vd_features *features, const vd_feature *f,
                      double *x, double *y) {
    const size_t first = features->parts[f->first_part];
    size_t count = features->parts[f->first_part + 1] - first;
    count -= f->kind == VD_FEATURE_POLYGON && count > 1 ? 1 : 0; /* the last is the first again */
    *x = *y = 0.0;
    for (size_t i = 0; i < count; i++) {
        double px, py;
        vd_place_feature_point(p, features->points[first + i], &px, &py);
        *x += px / (double)count;
        *y += py / (double)count;
    }
}

static vd_status write_features(lettering *l, const vd_features *features,
                                const vd_world_label *label) {
    const vd_placer *p = l->placer;
    size_t named = 0, off = 0;
    vd_status status = vd_success();
    for (size_t i = 0; i < features->count && status.code == VD_OK; i++) {
        const vd_feature *f = &features->features[i];
        if (f->name == 0) {
            continue;
        }
        double x, y;
        middle_of(p, features, f, &x, &y);
        const double z = vd_place_height(p, &label->spot, x, y);
        named++;
        if (isfinite(z)) {
            status = write_name(l, features->names + f->name, vd_vec3_make(x, y, z),
                                label->priority, label);
        } else {
            off++;
        }
    }
    if (status.code != VD_OK) {
        return status;
    }
    if (named == 0 || off == named) {
        return vd_failure(VD_ERROR_FORMAT, "%.200s has %s; give another file", label->path,
                          named == 0 ? "nothing with a name" : "no name on the map");
    }
    if (off > 0) {
        vd_log(p->scene->context, VD_LOG_WARNING,
               "%.160s: %zu of %zu names are off the map and left out", label->path, off, named);
    }
    return status;
}

static vd_status write_file(lettering *l, const vd_world_label *label) {
    vd_features *features = NULL;
    vd_geo_module geo;
    vd_status status =
        vd_place_features(l->placer, label->key, label->path, label->property, &geo, &features);
    if (status.code == VD_OK) {
        status = write_features(l, features, label);
        status = status.code == VD_OK ? status : vd_place_failure(l->placer, label->key, &status);
        geo.features_destroy(&features);
    }
    return status;
}

/* The heights of the peaks that stand out most; the more they do, the sooner they are written. */
static vd_status write_peaks(lettering *l, int count, vd_label_hidden hidden) {
    const vd_placer *p = l->placer;
    const vd_world_label look = {.hidden = hidden};
    if (p->scene->scene.terrain == NULL) {
        const vd_status none = vd_failure(VD_ERROR_FORMAT, "there is no terrain to find peaks in; "
                                                           "leave them out, or give one");
        return vd_place_failure(p, "the labels of peaks", &none);
    }
    vd_peak *peaks = malloc((size_t)count * sizeof *peaks);
    if (peaks == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory for %d peaks", count);
    }
    int found = 0;
    vd_status status = vd_heightfield_peaks(p->scene->context, p->job, p->scene->scene.terrain,
                                            count, peaks, &found);
    for (int i = 0; i < found && status.code == VD_OK; i++) {
        const vd_peak *peak = &peaks[i];
        const double z = vd_place_ground(p, peak->x, peak->y);
        char text[32];
        snprintf(text, sizeof text, "%.0f m", peak->z);
        if (isfinite(z)) {
            status =
                write_name(l, text, vd_vec3_make(peak->x, peak->y, z), peak->prominence_m, &look);
        }
    }
    free(peaks);
    return status;
}

static vd_status write_label(lettering *l, const vd_world_label *label) {
    if (label->path != NULL) {
        return write_file(l, label);
    }
    if (label->text == NULL) {
        return vd_success(); /* peaks: --label-peaks */
    }
    vd_vec3 at;
    vd_status status = vd_place_spot(l->placer, label->key, &label->spot, &at);
    if (status.code == VD_OK) {
        status = write_name(l, label->text, at, label->priority, label);
        status = status.code == VD_OK ? status : vd_place_failure(l->placer, label->key, &status);
    }
    return status;
}

vd_status vd_place_labels(const vd_placer *placer, const vd_world_content *content) {
    const vd_render_settings *s = placer->settings;
    lettering l = {.placer = placer};
    vd_status status = vd_success();
    for (size_t i = 0; i < content->label_count && status.code == VD_OK; i++) {
        status = write_label(&l, &content->labels[i]);
    }
    if (s->labels != NULL && status.code == VD_OK) {
        const vd_world_label label = {.key = "--labels", .path = s->labels};
        status = write_file(&l, &label);
    }
    if (s->label_peaks > 0 && status.code == VD_OK) {
        status = write_peaks(&l, s->label_peaks, content->peaks_hidden);
    }
    if (l.open) {
        l.text.destroy(&l.font);
    }
    return status;
}
