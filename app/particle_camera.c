/* particle_camera.c: framing particles. */
#include "particle_camera.h"

#include "framing.h"

#define FILLED 0.94 /* of the picture */
#define FEW 1000000 /* particles that are looked at one by one */

static vd_status frame_brick(const vd_bricks *b, uint32_t node, vd_framing *f) {
    vd_brick brick;
    vd_status status = vd_bricks_brick(b, node, &brick);
    for (uint32_t i = 0; status.code == VD_OK && i < brick.count; i++) {
        vd_framing_add(f, vd_vec3_make(brick.origin[0] + brick.step[0] * brick.x[i],
                                       brick.origin[1] + brick.step[1] * brick.y[i],
                                       brick.origin[2] + brick.step[2] * brick.z[i]));
    }
    return status;
}

/* Adds the particles of few, the corners of the bricks of many; as spheres. */
static vd_status frame_all(const vd_bricks *b, double radius, vd_framing *f) {
    vd_status status = vd_success();
    for (uint32_t i = 0; i < b->node_count && status.code == VD_OK; i++) {
        const vd_bricks_node *n = &b->nodes[i];
        if (n->child_count > 0) {
            continue;
        }
        if (b->count <= FEW) {
            status = frame_brick(b, i, f);
            continue;
        }
        for (int c = 0; c < 8; c++) {
            vd_framing_add(f, vd_vec3_make(c & 1 ? n->max[0] : n->min[0],
                                           c & 2 ? n->max[1] : n->min[1],
                                           c & 4 ? n->max[2] : n->min[2]));
        }
    }
    const double beside = radius * sqrt(1.0 + f->side * f->side);
    const double above = radius * sqrt(1.0 + f->top * f->top);
    f->left += beside;
    f->right -= beside;
    f->lower += above;
    f->upper -= above;
    f->reach += radius * (1.0 + 1.0 / vd_smaller(f->side, f->top));
    for (int k = 0; k < 3; k++) {
        f->box[k][0] -= radius;
        f->box[k][1] += radius;
    }
    return status;
}

/* Places the eye of an orbit without a distance. */
static vd_status place(const vd_bricks *b, const vd_particle_settings *s, double radius,
                       double size, vd_vec3 target, vd_camera *c) {
    vd_framing f =
        vd_framing_start(c->orientation, c->lens, s->width, s->height, FILLED, FILLED, FILLED);
    f.target = target;
    vd_status status = frame_all(b, radius, &f);
    if (s->has_target) {
        const double reach = vd_larger(f.reach, 0.05 * size);
        c->eye = vd_vec3_subtract(target, vd_vec3_scale(f.z_axis, reach));
        return status;
    }
    c->eye = vd_framing_eye(&f, s->projection == VD_PROJECTION_ORTHOGRAPHIC, target);
    const double front = f.box[2][0] - vd_vec3_dot(f.z_axis, c->eye);
    if (s->projection != VD_PROJECTION_ORTHOGRAPHIC && front < 0.01 * size) {
        c->eye = vd_vec3_subtract(c->eye, vd_vec3_scale(f.z_axis, 0.01 * size - front));
    }
    return status;
}

vd_status vd_particle_camera(const vd_bricks *b, const vd_particle_settings *s, double radius,
                             vd_camera *out) {
    double size = radius;
    for (int k = 0; k < 3; k++) {
        size = vd_larger(size, b->max[k] - b->min[k]);
    }
    size = size > 0.0 ? size : 1.0;
    const double radians = 3.14159265358979323846 / 180.0;
    const vd_vec3 middle = {0.5 * (b->min[0] + b->max[0]), 0.5 * (b->min[1] + b->max[1]),
                            0.5 * (b->min[2] + b->max[2])};
    const vd_vec3 target = s->has_target ? s->target : middle;
    vd_camera c = {.projection = s->projection,
                   .lens = vd_lens_from_fov(s->fov * radians, s->width, s->height),
                   .near_m = 1e-6 * size,
                   .far_m = 100.0 * size};
    c.orientation =
        s->has_eye ? vd_orientation_look_at(s->eye, target)
                   : vd_orientation_from_angles(s->azimuth * radians, -s->elevation * radians, 0.0);
    const vd_vec3 forward = vd_quat_rotate(c.orientation, vd_vec3_make(0.0, 0.0, 1.0));
    vd_status status = vd_success();
    if (s->has_eye) {
        c.eye = s->eye;
    } else if (s->distance_m > 0.0) {
        c.eye = vd_vec3_subtract(target, vd_vec3_scale(forward, s->distance_m));
    } else {
        status = place(b, s, radius, size, target, &c);
    }
    if (s->projection == VD_PROJECTION_ORTHOGRAPHIC) {
        /* The scale is that of a perspective picture at the target; nothing is behind the eye. */
        const double z = vd_vec3_dot(forward, vd_vec3_subtract(target, c.eye));
        const double scale = 1.0 / vd_larger(z, 1e-9 * size);
        c.lens.fx *= scale;
        c.lens.fy *= scale;
        c.eye = vd_vec3_subtract(c.eye, vd_vec3_scale(forward, 2.0 * size));
    }
    *out = c;
    return status;
}
