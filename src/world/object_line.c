/* object_line.c: polylines, such as tracks and borders. */
#include <math.h>
#include <string.h>
#include "world/object_kinds.h"
#include "world/world_internal.h"

#define MOST_POINTS ((size_t)1 << 26)

vd_status vd_line_create(vd_context *context, const vd_line_def *def, vd_object **out) {
    if (def->count < 2 || def->count > MOST_POINTS) {
        return vd_failure(def->count < 2 ? VD_ERROR_ARGUMENT : VD_ERROR_LIMIT,
                          "a line of %zu points cannot be drawn; give 2 to %zu", def->count,
                          MOST_POINTS);
    }
    if (!(def->width_px > 0.0 && def->width_px <= 64.0)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "a line %g pixels wide cannot be drawn; give more than 0, at most 64",
                          def->width_px);
    }
    vd_object *object = NULL;
    const size_t bytes = sizeof(vd_line) + def->count * 3 * sizeof(float);
    vd_status status = vd_object_make(context, VD_OBJECT_LINE, bytes, def->points[0], &object);
    if (status.code != VD_OK) {
        return status;
    }
    vd_line *line = (vd_line *)object;
    line->count = (uint32_t)def->count;
    line->closed = def->closed;
    line->width_px = def->width_px;
    line->color = def->color;
    for (size_t i = 0; i < def->count; i++) {
        const vd_vec3 at = vd_vec3_subtract(def->points[i], object->anchor);
        const double p[3] = {at.x, at.y, at.z};
        for (int k = 0; k < 3; k++) {
            line->points[3 * i + (size_t)k] = (float)p[k];
        }
        (i == 0 ? vd_object_bound_first : vd_object_bound_more)(object, p);
        if (!(fabs(p[0]) <= VD_OBJECT_MAX_METRES && fabs(p[1]) <= VD_OBJECT_MAX_METRES &&
              fabs(p[2]) <= VD_OBJECT_MAX_METRES)) {
            vd_object_destroy(context, &object);
            return vd_failure(VD_ERROR_ARGUMENT,
                              "point %zu of a line is not finite or too far away; leave it out", i);
        }
    }
    *out = object;
    return vd_success();
}

static const char *check(const vd_object *object) {
    const vd_line *line = (const vd_line *)object;
    if (line->count < 2 ||
        object->size_bytes != sizeof *line + (size_t)line->count * 3 * sizeof(float)) {
        return "the number of points";
    }
    if (!(line->width_px > 0.0 && line->width_px <= 64.0)) {
        return "the line's width";
    }
    for (size_t i = 0; i < 3 * (size_t)line->count; i++) {
        if (!(fabsf(line->points[i]) <= (float)VD_OBJECT_MAX_METRES)) {
            return "a point";
        }
    }
    return NULL;
}

/* The line as a mesh. */
static vd_status open(vd_world *world, const vd_object *object, void **live) {
    const vd_line *line = (const vd_line *)object;
    const size_t count = line->count - 1 + (line->closed != 0);
    uint32_t *indices = vd_allocate(world->context, count, 2 * sizeof *indices);
    if (indices == NULL) {
        return vd_out_of_memory("a line", count * 2 * sizeof *indices);
    }
    for (size_t i = 0; i < count; i++) {
        indices[2 * i] = (uint32_t)i;
        indices[2 * i + 1] = i + 1 < line->count ? (uint32_t)i + 1 : 0;
    }
    vd_mesh_def def = vd_mesh_def_default();
    def.anchor = object->anchor;
    def.topology = VD_TOPOLOGY_LINES;
    def.vertex_count = line->count;
    def.positions = line->points;
    def.index_count = 2 * count;
    def.indices = indices;
    vd_line_live *made = vd_allocate_zero(world->context, 1, sizeof *made);
    vd_status status = made != NULL ? vd_mesh_create(world->context, &def, &made->mesh)
                                    : vd_out_of_memory("a line", sizeof *made);
    vd_release(world->context, indices);
    if (status.code != VD_OK) {
        vd_release(world->context, made);
        return status;
    }
    made->material = vd_material_default();
    made->material.albedo = vd_linear_from_rgba8(line->color);
    made->material.alpha = (float)line->color.a / 255.0f;
    made->material.blend = line->color.a < 255;
    *live = made;
    return status;
}

static void close(vd_world *world, void *live) {
    vd_line_live *made = live;
    vd_mesh_destroy(world->context, &made->mesh);
    vd_release(world->context, made);
}

static vd_status draw(vd_pass *pass, const vd_object *object, const void *live) {
    const vd_line *line = (const vd_line *)object;
    const vd_line_live *made = live;
    vd_draw draw = vd_draw_default();
    draw.mesh = made->mesh;
    draw.shader = &vd_line_shader;
    draw.uniforms = pass->lines;
    draw.materials = &made->material;
    draw.material_count = 1;
    draw.line_width = line->width_px;
    draw.object_id = object->id;
    return vd_pass_add_draw(pass, &draw);
}

const vd_object_kind_entry vd_line_kind = {.name = "line",
                                           .least_bytes = sizeof(vd_line),
                                           .check = check,
                                           .open = open,
                                           .close = close,
                                           .draw = draw};
