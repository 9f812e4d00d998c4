/* object_label.c: names at places. Their letters are outlines already. */
#include <math.h>
#include <string.h>
#include "world/object_kinds.h"
#include "world/world_internal.h"

#define MOST_TEXT_BYTES 1025u
#define MOST_POINTS ((size_t)1 << 20)

static size_t block_bytes(size_t points, size_t verbs, size_t text_bytes) {
    const size_t bytes = sizeof(vd_label) + points * 2 * sizeof(double) + verbs + text_bytes;
    return (bytes + 7) / 8 * 8;
}

vd_status vd_label_create(vd_context *context, const vd_label_def *def, vd_object **out) {
    const size_t text_bytes = strlen(def->text) + 1;
    const size_t points = def->outline.point_count, verbs = def->outline.verb_count;
    if (text_bytes > MOST_TEXT_BYTES || points > MOST_POINTS || verbs > MOST_POINTS) {
        return vd_failure(VD_ERROR_LIMIT, "the label \"%.40s…\" is too long; give at most %u bytes",
                          def->text, MOST_TEXT_BYTES - 1);
    }
    if (!(def->advance >= 0.0f && isfinite(def->advance) && isfinite(def->ascent) &&
          isfinite(def->descent) && isfinite(def->priority))) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the label \"%.40s\" has a size or priority that is not finite",
                          def->text);
    }
    vd_object *object = NULL;
    const vd_status status = vd_object_make(
        context, VD_OBJECT_LABEL, block_bytes(points, verbs, text_bytes), def->place, &object);
    if (status.code != VD_OK) {
        return status;
    }
    vd_label *label = (vd_label *)object;
    label->text_bytes = (uint32_t)text_bytes;
    label->point_count = (uint32_t)points;
    label->verb_count = (uint32_t)verbs;
    label->hidden = (uint32_t)def->hidden;
    label->advance = def->advance;
    label->ascent = def->ascent;
    label->descent = def->descent;
    label->color = def->color;
    label->halo = def->halo;
    label->priority = def->priority;
    if (points > 0) {
        memcpy(label->points, def->outline.points, points * 2 * sizeof(double));
        memcpy(label->points + 2 * points, def->outline.verbs, verbs);
    }
    memcpy((char *)(label->points + 2 * points) + verbs, def->text, text_bytes);
    *out = object;
    return vd_success();
}

/* Points that a path's verbs take. */
static bool verbs_fit(const vd_label *label) {
    static const uint8_t takes[VD_PATH_VERB_COUNT] = {1, 1, 2, 3, 0};
    const uint8_t *verbs = vd_label_verbs(label);
    size_t sum = 0;
    for (size_t i = 0; i < label->verb_count; i++) {
        if (verbs[i] >= VD_PATH_VERB_COUNT || (i == 0 && verbs[i] != VD_PATH_MOVE)) {
            return false;
        }
        sum += takes[verbs[i]];
    }
    return sum == label->point_count;
}

static const char *check(const vd_object *object) {
    const vd_label *label = (const vd_label *)object;
    if (label->text_bytes < 1 || label->text_bytes > MOST_TEXT_BYTES ||
        label->point_count > MOST_POINTS || label->verb_count > MOST_POINTS ||
        object->size_bytes !=
            block_bytes(label->point_count, label->verb_count, label->text_bytes)) {
        return "the size";
    }
    if (vd_label_text(label)[label->text_bytes - 1] != '\0' ||
        label->hidden >= VD_LABEL_HIDDEN_COUNT || !verbs_fit(label)) {
        return "the label";
    }
    for (size_t i = 0; i < 2 * (size_t)label->point_count; i++) {
        if (!(fabs(label->points[i]) < 1e6)) {
            return "an outline";
        }
    }
    return isfinite(label->priority) && label->advance >= 0.0f && label->advance < 1e6f &&
                   fabsf(label->ascent) < 1e6f && fabsf(label->descent) < 1e6f
               ? NULL
               : "the label's size";
}

static vd_status draw(vd_pass *pass, const vd_object *object, const void *live) {
    (void)live;
    const vd_label **to = vd_list_add(pass->context, pass->labels, 1, sizeof *to);
    if (to == NULL) {
        return vd_out_of_memory("labels", sizeof *to);
    }
    *to = (const vd_label *)object;
    return vd_success();
}

const vd_object_kind_entry vd_label_kind = {
    .name = "label", .least_bytes = sizeof(vd_label), .check = check, .draw = draw};
