/* matrix.h: 4 × 4 matrices of doubles, for placing and projecting things.
 *
 * Points are columns: p' = M p, and multiply(a, b) applies b first. Exact arithmetic in a fixed
 * order, as in vector.h. What a matrix does to normals is vd_matrix_normal's: the inverse
 * transpose.
 */
#ifndef VEDUTA_MATRIX_H
#define VEDUTA_MATRIX_H

#include <veduta/vector.h>

VD_BEGIN_DECLARATIONS

typedef struct vd_matrix {
    double m[4][4]; /* [row][column] */
} vd_matrix;

VD_API vd_matrix vd_matrix_identity(void);

/* Returns the matrix that applies b first, then a. */
VD_API vd_matrix vd_matrix_multiply(const vd_matrix *a, const vd_matrix *b);

VD_API vd_matrix vd_matrix_translation(vd_vec3 offset);
VD_API vd_matrix vd_matrix_scaling(vd_vec3 factors);

/* Returns the rotation of a unit quaternion. */
VD_API vd_matrix vd_matrix_rotation(vd_quat q);

/* Returns the shear that adds xy·y + xz·z to x, yx·x + yz·z to y, and zx·x + zy·y to z. */
VD_API vd_matrix vd_matrix_shearing(double xy, double xz, double yx, double yz, double zx,
                                    double zy);

/* Returns the point moved by an affine matrix; the last row is not looked at. */
VD_API vd_vec3 vd_matrix_transform(const vd_matrix *matrix, vd_vec3 point);

/* Returns the matrix that normals go through when points go through `matrix`: the transposed
 * inverse of its upper 3 × 3, times |determinant|, so that a singular matrix has one too. Normals
 * come out unnormalized; a mirroring matrix keeps them on the outside. */
VD_API vd_matrix vd_matrix_normal(const vd_matrix *matrix);

VD_END_DECLARATIONS

#endif
