/* object.c: what all objects have: head, bounds, id. */
#include <math.h>
#include <string.h>
#include "core/core.h"
#include "world/object_kinds.h"

static const uint8_t object_magic[8] = {'V', 'D', 'O', 'B', 'J', 'E', 'C', 'T'};

const vd_object_kind_entry *const vd_object_kinds[VD_OBJECT_KIND_COUNT] = {
    [VD_OBJECT_GROUP] = &vd_group_kind,       [VD_OBJECT_TERRAIN] = &vd_terrain_kind,
    [VD_OBJECT_INSTANCE] = &vd_instance_kind, [VD_OBJECT_SPRITE] = &vd_sprite_kind,
    [VD_OBJECT_LINE] = &vd_line_kind,         [VD_OBJECT_LABEL] = &vd_label_kind,
    [VD_OBJECT_PARTICLES] = &vd_cloud_kind,
};

const char *vd_object_kind_name(vd_object_kind kind) {
    return (unsigned)kind < VD_OBJECT_KIND_COUNT ? vd_object_kinds[kind]->name : "unknown";
}

/* ---- ids --------------------------------------------------------------------------------------*/

int vd_object_depth(uint64_t id) {
    int depth = 0;
    for (; id != 0; id <<= 8) {
        depth++;
    }
    return depth;
}

uint64_t vd_object_child_id(uint64_t parent, int number) {
    const int depth = vd_object_depth(parent);
    if (depth >= VD_OBJECT_MAX_DEPTH || number < 1 || number > VD_OBJECT_MAX_CHILDREN) {
        return 0;
    }
    return parent | (uint64_t)number << (56 - 8 * depth);
}

uint64_t vd_object_parent_id(uint64_t id) {
    const int depth = vd_object_depth(id);
    return depth <= 1 ? 0 : id & ~(uint64_t)0 << (64 - 8 * (depth - 1));
}

bool vd_object_is_within(uint64_t id, uint64_t ancestor) {
    const int depth = vd_object_depth(ancestor);
    return depth == 0 || (id & ~(uint64_t)0 << (64 - 8 * depth)) == ancestor;
}

/* ---- heads ------------------------------------------------------------------------------------*/

/* 2^-10 m: see vd_object. */
static double on_grid(double x) {
    return fabs(x) < 0x1p42 ? floor(x * 1024.0 + 0.5) / 1024.0 : x;
}

static bool is_place(vd_vec3 p) {
    return fabs(p.x) <= VD_OBJECT_MAX_METRES && fabs(p.y) <= VD_OBJECT_MAX_METRES &&
           fabs(p.z) <= VD_OBJECT_MAX_METRES;
}

vd_status vd_object_make(vd_context *context, vd_object_kind kind, size_t size_bytes,
                         vd_vec3 anchor, vd_object **out) {
    if (!is_place(anchor)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "a %s cannot stand at (%g, %g, %g); give finite numbers of at most %g m",
                          vd_object_kind_name(kind), anchor.x, anchor.y, anchor.z,
                          VD_OBJECT_MAX_METRES);
    }
    vd_object *object = vd_allocate_zero(context, 1, size_bytes);
    if (object == NULL) {
        return vd_out_of_memory("an object", size_bytes);
    }
    memcpy(object->magic, object_magic, sizeof object_magic);
    object->kind = (uint32_t)kind;
    object->version = 1;
    object->size_bytes = size_bytes;
    object->anchor = vd_vec3_make(on_grid(anchor.x), on_grid(anchor.y), on_grid(anchor.z));
    *out = object;
    return vd_success();
}

void vd_object_destroy(vd_context *context, vd_object **object) {
    if (object != NULL && *object != NULL) {
        vd_release(context, *object);
        *object = NULL;
    }
}

float vd_below(double x) {
    const float f = (float)x;
    return (double)f <= x ? f : nextafterf(f, -INFINITY);
}

float vd_above(double x) {
    const float f = (float)x;
    return (double)f >= x ? f : nextafterf(f, INFINITY);
}

void vd_object_bound_first(vd_object *object, const double point[3]) {
    for (int i = 0; i < 3; i++) {
        object->min[i] = vd_below(point[i]);
        object->max[i] = vd_above(point[i]);
    }
}

void vd_object_bound_more(vd_object *object, const double point[3]) {
    for (int i = 0; i < 3; i++) {
        const float low = vd_below(point[i]), high = vd_above(point[i]);
        object->min[i] = low < object->min[i] ? low : object->min[i];
        object->max[i] = high > object->max[i] ? high : object->max[i];
    }
}

void vd_object_bounds(const vd_object *object, vd_vec3 *min, vd_vec3 *max) {
    const vd_vec3 a = object->anchor;
    *min = vd_vec3_make(a.x + (double)object->min[0], a.y + (double)object->min[1],
                        a.z + (double)object->min[2]);
    *max = vd_vec3_make(a.x + (double)object->max[0], a.y + (double)object->max[1],
                        a.z + (double)object->max[2]);
}

void vd_object_sphere(const vd_object *object, vd_vec3 *centre, double *radius) {
    vd_vec3 min, max;
    vd_object_bounds(object, &min, &max);
    *centre = vd_vec3_scale(vd_vec3_add(min, max), 0.5);
    *radius = 0.5 * vd_vec3_length(vd_vec3_subtract(max, min));
}

int vd_object_key_points(const vd_object *object, vd_vec3 out[VD_OBJECT_KEY_POINTS]) {
    const vd_object_kind_entry *kind = vd_object_kinds[object->kind];
    if (kind->key_points != NULL) {
        return kind->key_points(object, out);
    }
    vd_vec3 min, max;
    vd_object_bounds(object, &min, &max);
    for (int i = 0; i < 8; i++) {
        out[i] = vd_vec3_make((i & 1) != 0 ? max.x : min.x, (i & 2) != 0 ? max.y : min.y,
                              (i & 4) != 0 ? max.z : min.z);
    }
    return 8;
}

/* ---- packing ----------------------------------------------------------------------------------*/

static const char *wrong_head(const vd_object *object) {
    if (!is_place(object->anchor)) {
        return "the anchor";
    }
    for (int i = 0; i < 3; i++) {
        if (!(object->min[i] <= object->max[i]) ||
            !(fabsf(object->min[i]) <= (float)VD_OBJECT_MAX_METRES) ||
            !(fabsf(object->max[i]) <= (float)VD_OBJECT_MAX_METRES)) {
            return "the bounds";
        }
    }
    return NULL;
}

vd_status vd_object_validate(const void *block, size_t size_bytes) {
    const vd_object *object = block;
    const char *wrong = NULL;
    if (size_bytes < sizeof *object ||
        memcmp(object->magic, object_magic, sizeof object_magic) != 0) {
        wrong = "the beginning";
    } else if (object->kind >= VD_OBJECT_KIND_COUNT) {
        wrong = "the kind";
    } else if (object->size_bytes != size_bytes ||
               size_bytes < vd_object_kinds[object->kind]->least_bytes) {
        wrong = "the size";
    } else {
        wrong = wrong_head(object);
    }
    if (wrong == NULL && vd_object_kinds[object->kind]->check != NULL) {
        wrong = vd_object_kinds[object->kind]->check(object);
    }
    return wrong == NULL ? vd_success()
                         : vd_failure(VD_ERROR_FORMAT,
                                      "an object's block is damaged: %s is wrong; send or write it "
                                      "again",
                                      wrong);
}

vd_status vd_object_unpack(vd_context *context, const void *block, size_t size_bytes,
                           vd_object **out) {
    const vd_status status = vd_object_validate(block, size_bytes);
    if (status.code != VD_OK) {
        return status;
    }
    vd_object *copy = vd_allocate(context, 1, size_bytes);
    if (copy == NULL) {
        return vd_out_of_memory("an object", size_bytes);
    }
    memcpy(copy, block, size_bytes);
    *out = copy;
    return vd_success();
}
