/* object_sprite.c: pictures that face the viewer.
 *
 * Where the picture covers wholly it is drawn as what is opaque, with depth and id; its soft edges
 * are blended over what is behind. Where both are drawn they are of one colour, so blending the one
 * over the other changes nothing. */
#include <math.h>
#include "core/real.h"
#include "world/object_kinds.h"
#include "world/world_internal.h"
#include "world/world_shader.h"

vd_status vd_sprite_create(vd_context *context, const vd_sprite_def *def, vd_object **out) {
    const double most = VD_OBJECT_MAX_METRES;
    if (!(def->width_m > 0.0 && def->width_m <= most) ||
        !(def->height_m > 0.0 && def->height_m <= most)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "a sprite of %g × %g m cannot be drawn; give sides above 0", def->width_m,
                          def->height_m);
    }
    vd_object *object = NULL;
    const vd_status status =
        vd_object_make(context, VD_OBJECT_SPRITE, sizeof(vd_sprite), def->foot, &object);
    if (status.code != VD_OK) {
        return status;
    }
    vd_sprite *sprite = (vd_sprite *)object;
    sprite->picture = def->picture;
    sprite->tilts = def->tilts;
    sprite->width_m = def->width_m;
    sprite->height_m = def->height_m;
    /* Whichever way it faces. */
    const double side = 0.5 * def->width_m;
    const double reach = def->tilts ? sqrt(side * side + def->height_m * def->height_m) : side;
    const double low[3] = {-reach, -reach, def->tilts ? -reach : 0.0};
    const double high[3] = {reach, reach, def->tilts ? reach : def->height_m};
    vd_object_bound_first(object, low);
    vd_object_bound_more(object, high);
    *out = object;
    return vd_success();
}

static const char *check(const vd_object *object) {
    const vd_sprite *sprite = (const vd_sprite *)object;
    return object->size_bytes != sizeof *sprite ? "the size"
           : !(sprite->width_m > 0.0 && sprite->height_m > 0.0 &&
               sprite->width_m <= VD_OBJECT_MAX_METRES && sprite->height_m <= VD_OBJECT_MAX_METRES)
               ? "the sprite's sides"
               : NULL;
}

static uint32_t asset(const vd_object *object, vd_asset_kind *kind) {
    *kind = VD_ASSET_PICTURE;
    return ((const vd_sprite *)object)->picture;
}

/* Turns the quad (x along the width, z up, the foot at the origin) towards the eye. */
static vd_matrix face(const vd_sprite *sprite, const vd_camera *camera, double drop_m) {
    const vd_vec3 foot = sprite->head.anchor;
    const vd_vec3 view = vd_quat_rotate(camera->orientation, vd_vec3_make(0, 0, 1));
    vd_vec3 away = camera->projection == VD_PROJECTION_ORTHOGRAPHIC
                       ? view
                       : vd_vec3_subtract(foot, camera->eye);
    const vd_vec3 level = vd_vec3_make(away.x, away.y, 0.0);
    vd_vec3 right = vd_vec3_normalize(vd_vec3_cross(level, vd_vec3_make(0, 0, 1)));
    if (vd_vec3_dot(right, right) < 0.5) { /* straight from above: as the picture lies */
        right = vd_quat_rotate(camera->orientation, vd_vec3_make(1, 0, 0));
    }
    vd_vec3 up = vd_vec3_make(0, 0, 1);
    if (sprite->tilts) {
        up = vd_vec3_normalize(vd_vec3_cross(right, away));
        up = vd_vec3_dot(up, up) < 0.5 ? vd_vec3_make(0, 0, 1) : up;
    }
    vd_matrix m = vd_matrix_identity();
    const vd_vec3 behind = vd_vec3_cross(up, right); /* so that normals point up */
    const double axes[3][3] = {
        {right.x, right.y, right.z}, {behind.x, behind.y, behind.z}, {up.x, up.y, up.z}};
    for (int r = 0; r < 3; r++) {
        m.m[r][0] = axes[0][r] * sprite->width_m;
        m.m[r][1] = axes[1][r];
        m.m[r][2] = axes[2][r] * sprite->height_m;
    }
    m.m[0][3] = foot.x;
    m.m[1][3] = foot.y;
    m.m[2][3] = foot.z - drop_m;
    return m;
}

static vd_status draw(vd_pass *pass, const vd_object *object, const void *live) {
    const vd_sprite *sprite = (const vd_sprite *)object;
    const vd_asset *picture = &pass->world->assets[sprite->picture];
    vd_draw draw = vd_draw_default();
    (void)live;
    draw.mesh = pass->world->quad;
    draw.world_from_mesh = face(sprite, pass->camera, vd_pass_drop(pass, object->anchor));
    draw.shader = pass->shading ? &vd_world_shader : vd_shader_find(VD_SHADING_ALBEDO);
    draw.uniforms = pass->shading ? pass->uniforms : NULL;
    draw.cull = VD_CULL_NONE;
    draw.object_id = object->id;
    draw.material_count = 1;
    draw.materials = &picture->solid;
    vd_status status = vd_pass_add_draw(pass, &draw);
    draw.materials = &picture->soft;
    pass->stats->triangles += 2;
    return status.code == VD_OK ? vd_pass_add_draw(pass, &draw) : status;
}

const vd_object_kind_entry vd_sprite_kind = {.name = "sprite",
                                             .least_bytes = sizeof(vd_sprite),
                                             .check = check,
                                             .asset = asset,
                                             .draw = draw};
