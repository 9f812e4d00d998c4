/* framing.c: the eye that sees everything. */
#include "framing.h"

vd_framing vd_framing_start(vd_quat orientation, vd_lens lens, int width, int height, double side,
                            double top, double bottom) {
    vd_framing made = {
        .x_axis = vd_quat_rotate(orientation, vd_vec3_make(1, 0, 0)),
        .y_axis = vd_quat_rotate(orientation, vd_vec3_make(0, 1, 0)),
        .z_axis = vd_quat_rotate(orientation, vd_vec3_make(0, 0, 1)),
        .side = side * width / (2.0 * lens.fx),
        .top = top * height / (2.0 * lens.fy),
        .bottom = bottom * height / (2.0 * lens.fy),
        .low_share = 0.5,
    };
    vd_framing_clear(&made);
    return made;
}

void vd_framing_clear(vd_framing *f) {
    f->left = f->lower = -INFINITY;
    f->right = f->upper = INFINITY;
    f->reach = 0.0;
    for (int i = 0; i < 3; i++) {
        f->box[i][0] = INFINITY;
        f->box[i][1] = -INFINITY;
    }
}

vd_vec3 vd_framing_eye(const vd_framing *f, bool flat, vd_vec3 middle) {
    double ez =
        fmin((f->right - f->left) / (2.0 * f->side), (f->upper - f->lower) / (f->top + f->bottom));
    double ex = 0.5 * ((f->left + f->side * ez) + (f->right - f->side * ez));
    double ey = f->low_share * (f->lower + f->bottom * ez) +
                (1.0 - f->low_share) * (f->upper - f->top * ez);
    if (flat) {
        ex = 0.5 * (f->box[0][0] + f->box[0][1]);
        ey = 0.5 * (f->box[1][0] + f->box[1][1]);
        ez = vd_vec3_dot(f->z_axis, middle) -
             fmax((f->box[0][1] - f->box[0][0]) / (2.0 * f->side),
                  (f->box[1][1] - f->box[1][0]) / (f->top + f->bottom));
    }
    return vd_vec3_add(vd_vec3_add(vd_vec3_scale(f->x_axis, ex), vd_vec3_scale(f->y_axis, ey)),
                       vd_vec3_scale(f->z_axis, ez));
}
