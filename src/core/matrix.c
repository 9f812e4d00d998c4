#include <math.h>
#include <string.h>
#include <veduta/matrix.h>

vd_matrix vd_matrix_identity(void) {
    return vd_matrix_scaling(vd_vec3_make(1.0, 1.0, 1.0));
}

vd_matrix vd_matrix_multiply(const vd_matrix *a, const vd_matrix *b) {
    vd_matrix out;
    for (int i = 0; i < 4; i++) {
        for (int j = 0; j < 4; j++) {
            out.m[i][j] = (a->m[i][0] * b->m[0][j] + a->m[i][1] * b->m[1][j]) +
                          (a->m[i][2] * b->m[2][j] + a->m[i][3] * b->m[3][j]);
        }
    }
    return out;
}

vd_matrix vd_matrix_translation(vd_vec3 offset) {
    vd_matrix out = vd_matrix_identity();
    out.m[0][3] = offset.x;
    out.m[1][3] = offset.y;
    out.m[2][3] = offset.z;
    return out;
}

vd_matrix vd_matrix_scaling(vd_vec3 factors) {
    vd_matrix out;
    memset(&out, 0, sizeof out);
    out.m[0][0] = factors.x;
    out.m[1][1] = factors.y;
    out.m[2][2] = factors.z;
    out.m[3][3] = 1.0;
    return out;
}

vd_matrix vd_matrix_rotation(vd_quat q) {
    vd_matrix out = vd_matrix_identity();
    const vd_vec3 axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int j = 0; j < 3; j++) {
        const vd_vec3 image = vd_quat_rotate(q, axes[j]);
        out.m[0][j] = image.x;
        out.m[1][j] = image.y;
        out.m[2][j] = image.z;
    }
    return out;
}

vd_matrix vd_matrix_shearing(double xy, double xz, double yx, double yz, double zx, double zy) {
    vd_matrix out = vd_matrix_identity();
    out.m[0][1] = xy;
    out.m[0][2] = xz;
    out.m[1][0] = yx;
    out.m[1][2] = yz;
    out.m[2][0] = zx;
    out.m[2][1] = zy;
    return out;
}

vd_vec3 vd_matrix_transform(const vd_matrix *matrix, vd_vec3 p) {
    double out[3];
    for (int i = 0; i < 3; i++) {
        const double *row = matrix->m[i];
        out[i] = ((row[0] * p.x + row[1] * p.y) + row[2] * p.z) + row[3];
    }
    return vd_vec3_make(out[0], out[1], out[2]);
}

/* The transposed inverse times the determinant is the matrix of cofactors: the cross products of
 * the columns. The determinant's sign puts a mirrored normal outside again. */
vd_matrix vd_matrix_normal(const vd_matrix *matrix) {
    vd_vec3 columns[3];
    for (int j = 0; j < 3; j++) {
        columns[j] = vd_vec3_make(matrix->m[0][j], matrix->m[1][j], matrix->m[2][j]);
    }
    const double determinant = vd_vec3_dot(columns[0], vd_vec3_cross(columns[1], columns[2]));
    vd_matrix out = vd_matrix_identity();
    for (int j = 0; j < 3; j++) {
        vd_vec3 cofactor = vd_vec3_cross(columns[(j + 1) % 3], columns[(j + 2) % 3]);
        cofactor = vd_vec3_scale(cofactor, determinant < 0.0 ? -1.0 : 1.0);
        out.m[0][j] = cofactor.x;
        out.m[1][j] = cofactor.y;
        out.m[2][j] = cofactor.z;
    }
    return out;
}
