/* object_instance.c: models placed in the world. */
#include <math.h>
#include "world/object_kinds.h"
#include "world/world_internal.h"

static bool is_small(const double m[3][3]) {
    bool fine = true;
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) {
            fine = fine && fabs(m[r][c]) <= VD_OBJECT_MAX_METRES;
        }
    }
    return fine;
}

/* False for what has no direction, zero aside. */
static bool set_plane(vd_object *object, vd_vec3 normal) {
    const double length = vd_vec3_length(normal);
    if (!isfinite(length)) {
        return false;
    }
    const double scale = length > 0.0 ? 32767.0 / length : 0.0;
    const double n[3] = {scale * normal.x, scale * normal.y, scale * normal.z};
    for (int i = 0; i < 3; i++) {
        object->plane[i] = (int16_t)floor(n[i] + 0.5);
    }
    return true;
}

/* The corners of the model's bounds: tighter than those of the object's. */
static int key_points(const vd_object *object, vd_vec3 out[VD_OBJECT_KEY_POINTS]) {
    const vd_instance *instance = (const vd_instance *)object;
    const vd_matrix place = vd_instance_place(instance, 0.0);
    for (int i = 0; i < 8; i++) {
        double p[3];
        for (int axis = 0; axis < 3; axis++) {
            p[axis] = (double)((i >> axis & 1) != 0 ? instance->most : instance->least)[axis];
        }
        out[i] = vd_matrix_transform(&place, vd_vec3_make(p[0], p[1], p[2]));
    }
    return 8;
}

vd_status vd_instance_create(vd_context *context, const vd_instance_def *def, vd_object **out) {
    const double(*m)[4] = def->transform.m;
    vd_object *object = NULL;
    vd_status status = vd_object_make(context, VD_OBJECT_INSTANCE, sizeof(vd_instance),
                                      vd_vec3_make(m[0][3], m[1][3], m[2][3]), &object);
    if (status.code != VD_OK) {
        return status;
    }
    vd_instance *instance = (vd_instance *)object;
    instance->model = def->model;
    instance->shadowless = def->shadowless;
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) {
            instance->linear[r][c] = m[r][c];
        }
    }
    for (int i = 0; i < 8; i++) {
        const double p[3] = {(i & 1) != 0 ? def->max.x : def->min.x,
                             (i & 2) != 0 ? def->max.y : def->min.y,
                             (i & 4) != 0 ? def->max.z : def->min.z};
        double at[3];
        for (int r = 0; r < 3; r++) {
            at[r] = (m[r][0] * p[0] + m[r][1] * p[1]) + m[r][2] * p[2];
        }
        (i == 0 ? vd_object_bound_first : vd_object_bound_more)(object, at);
    }
    /* A minimum and a maximum do not see what is no number. */
    const vd_vec3 a = def->min, b = def->max;
    const bool finite = isfinite(a.x + a.y + a.z) && isfinite(b.x + b.y + b.z);
    const double least[3] = {a.x, a.y, a.z}, most[3] = {b.x, b.y, b.z};
    for (int i = 0; i < 3; i++) {
        instance->least[i] = vd_below(least[i]);
        instance->most[i] = vd_above(most[i]);
    }
    status =
        finite && set_plane(object, def->plane) && is_small((const double(*)[3])instance->linear)
            ? vd_object_validate(object, sizeof *instance)
            : vd_failure(VD_ERROR_ARGUMENT, "%s", "");
    if (status.code != VD_OK) {
        vd_object_destroy(context, &object);
        return vd_failure(
            VD_ERROR_ARGUMENT,
            "a model's transform, bounds or plane are not finite, or beyond %g m; give other "
            "numbers",
            VD_OBJECT_MAX_METRES);
    }
    *out = object;
    return vd_success();
}

static const char *check(const vd_object *object) {
    const vd_instance *instance = (const vd_instance *)object;
    bool bounded = true;
    for (int i = 0; i < 3; i++) {
        bounded = bounded && isfinite(instance->least[i]) && isfinite(instance->most[i]);
    }
    return object->size_bytes != sizeof *instance            ? "the size"
           : !is_small((const double(*)[3])instance->linear) ? "the transform"
           : !bounded                                        ? "the bounds"
                                                             : NULL;
}

static uint32_t asset(const vd_object *object, vd_asset_kind *kind) {
    *kind = VD_ASSET_MODEL;
    return ((const vd_instance *)object)->model;
}

vd_matrix vd_instance_place(const vd_instance *instance, double drop_m) {
    vd_matrix m = vd_matrix_identity();
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) {
            m.m[r][c] = instance->linear[r][c];
        }
    }
    m.m[0][3] = instance->head.anchor.x;
    m.m[1][3] = instance->head.anchor.y;
    m.m[2][3] = instance->head.anchor.z - drop_m;
    return m;
}

static vd_status draw(vd_pass *pass, const vd_object *object, const void *live) {
    const vd_instance *instance = (const vd_instance *)object;
    const vd_asset *model = &pass->world->assets[instance->model];
    const vd_matrix place = vd_instance_place(instance, vd_pass_drop(pass, object->anchor));
    vd_status status = vd_success();
    (void)live;
    for (int i = 0; i < model->draw_count && status.code == VD_OK; i++) {
        vd_draw draw = model->draws[i];
        draw.world_from_mesh = place;
        draw.shader = pass->shading ? model->shaders[i] : vd_shader_find(VD_SHADING_ALBEDO);
        draw.uniforms = pass->shading ? pass->uniforms : NULL;
        draw.object_id = object->id;
        status = vd_pass_add_draw(pass, &draw);
    }
    pass->stats->triangles += model->triangles;
    return status;
}

const vd_object_kind_entry vd_instance_kind = {.name = "instance",
                                               .least_bytes = sizeof(vd_instance),
                                               .check = check,
                                               .asset = asset,
                                               .key_points = key_points,
                                               .draw = draw};
