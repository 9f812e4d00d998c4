/* raster_assemble.c: primitives of every kind to triangles that can be filled.
 *
 * This is the slow and complete way; the kernels take the short one for triangles whose three
 * vertices have a place in the picture, and come here for the rest. Clipping is in double, in
 * homogeneous space, always from the inside end of an edge towards its outside end: two triangles
 * that share an edge get the same new vertex, to the bit, and stay watertight.
 */
#include <math.h>
#include <string.h>
#include "raster/raster_internal.h"

/* ---- one triangle -----------------------------------------------------------------------------*/

static float smaller(float a, float b) {
    return a < b ? a : b;
}

static float larger(float a, float b) {
    return b < a ? a : b;
}

static bool set_up(const vd_vertex *a, const vd_vertex *b, const vd_vertex *c, bool clockwise,
                   bool counter_clockwise, uint32_t id, vd_setup *out) {
    const int64_t x1 = (int64_t)b->x - a->x, y1 = (int64_t)b->y - a->y;
    const int64_t x2 = (int64_t)c->x - a->x, y2 = (int64_t)c->y - a->y;
    const int64_t area = x1 * y2 - x2 * y1;
    if (area == 0 || !(area > 0 ? clockwise : counter_clockwise)) {
        return false;
    }
    const float z1 = b->z - a->z, z2 = c->z - a->z, f = (float)area;
    out->z0 = a->z;
    out->dz_dx = (z1 * (float)y2 - z2 * (float)y1) / f;
    out->dz_dy = (z2 * (float)x1 - z1 * (float)x2) / f;
    out->z_min = smaller(smaller(a->z, b->z), c->z);
    out->z_max = larger(larger(a->z, b->z), c->z);
    out->id = id;
    const vd_vertex *second = area > 0 ? b : c, *third = area > 0 ? c : b;
    const vd_vertex *corners[3] = {a, second, third};
    for (int i = 0; i < 3; i++) {
        out->x[i] = corners[i]->x;
        out->y[i] = corners[i]->y;
    }
    return true;
}

bool vd_setup_triangle(const vd_drawing *drawing, const vd_vertex *a, const vd_vertex *b,
                       const vd_vertex *c, uint32_t id, vd_setup *out) {
    return set_up(a, b, c, drawing->keep_clockwise, drawing->keep_counter_clockwise, id, out);
}

/* ---- planes -----------------------------------------------------------------------------------
 * near, far, then the four sides of the guard band. A point is inside where the value is >= 0. */

#define PLANES 6

static double plane_value(const vd_drawing *drawing, int plane, const double p[4]) {
    const double x = 0.5 * drawing->view.width, y = 0.5 * drawing->view.height;
    const double guard = VD_GUARD_PIXELS;
    switch (plane) {
    case 0:
        return (double)drawing->depth_near * p[3] - p[2];
    case 1:
        return p[2] - (double)drawing->depth_far * p[3];
    case 2:
        return p[0] - (x - guard) * p[3];
    case 3:
        return (x + guard) * p[3] - p[0];
    case 4:
        return p[1] - (y - guard) * p[3];
    default:
        return (y + guard) * p[3] - p[1];
    }
}

int vd_clip_polygon(const vd_drawing *drawing, double (*polygon)[4], int *vertex, int count) {
    for (int plane = 0; plane < PLANES && count > 0; plane++) {
        double kept[VD_CLIP_MAX][4], values[VD_CLIP_MAX];
        int kept_vertex[VD_CLIP_MAX], n = 0, outside = 0;
        for (int i = 0; i < count; i++) {
            values[i] = plane_value(drawing, plane, polygon[i]);
            outside += !(values[i] >= 0.0);
        }
        if (outside == 0) {
            continue;
        }
        for (int i = 0; i < count && outside < count; i++) {
            const int j = (i + 1) % count;
            const bool here = values[i] >= 0.0, there = values[j] >= 0.0;
            if (here && n < VD_CLIP_MAX) {
                memcpy(kept[n], polygon[i], sizeof kept[n]);
                kept_vertex[n++] = vertex[i];
            }
            if (here != there && n < VD_CLIP_MAX) {
                const int in = here ? i : j, out = here ? j : i;
                const double t = values[in] / (values[in] - values[out]);
                for (int k = 0; k < 4; k++) {
                    kept[n][k] = polygon[in][k] + t * (polygon[out][k] - polygon[in][k]);
                }
                kept_vertex[n++] = -1;
            }
        }
        count = n < 3 ? 0 : n;
        memcpy(polygon, kept, (size_t)count * sizeof polygon[0]);
        memcpy(vertex, kept_vertex, (size_t)count * sizeof vertex[0]);
    }
    return count;
}

bool vd_clip_line(const vd_drawing *drawing, const double a[4], const double b[4], double t[2]) {
    t[0] = 0.0;
    t[1] = 1.0;
    for (int plane = 0; plane < PLANES; plane++) {
        const double from = plane_value(drawing, plane, a), to = plane_value(drawing, plane, b);
        if (!(from >= 0.0) && !(to >= 0.0)) {
            return false;
        }
        if (!(from >= 0.0)) {
            const double cut = to / (to - from); /* from the inside end, as for polygons */
            t[0] = t[0] < 1.0 - cut ? 1.0 - cut : t[0];
        } else if (!(to >= 0.0)) {
            const double cut = from / (from - to);
            t[1] = cut < t[1] ? cut : t[1];
        }
    }
    return t[0] <= t[1];
}

/* ---- triangles --------------------------------------------------------------------------------*/

/* Snaps a clipped place. What the planes let through is finite and in range, but for rounding. */
static vd_vertex snap(const vd_drawing *drawing, const double p[4]) {
    const double w = p[3] > 1e-300 ? p[3] : 1e-300;
    double at[2] = {p[0] / w, p[1] / w};
    const double middle[2] = {0.5 * drawing->view.width, 0.5 * drawing->view.height};
    for (int i = 0; i < 2; i++) {
        const double low = middle[i] - VD_GUARD_PIXELS, high = middle[i] + VD_GUARD_PIXELS;
        at[i] = at[i] > low ? at[i] : low;
        at[i] = at[i] < high ? at[i] : high;
    }
    double z = p[2] / w;
    z = z < (double)drawing->depth_near ? z : (double)drawing->depth_near;
    z = z > (double)drawing->depth_far ? z : (double)drawing->depth_far;
    return (vd_vertex){(int32_t)floor(at[0] * 256.0 - 127.5), (int32_t)floor(at[1] * 256.0 - 127.5),
                       (float)z, (float)(1.0 / w)};
}

static int32_t outside_code(const vd_vertex *vertex) {
    return vertex->x < VD_FLAGGED ? vertex->x - INT32_MIN : 0;
}

static bool clip_triangle(const vd_drawing *drawing, const uint32_t *corners, uint32_t id,
                          vd_setup_function *emit, void *user) {
    double polygon[VD_CLIP_MAX][4];
    int vertex[VD_CLIP_MAX];
    for (int i = 0; i < 3; i++) {
        float picture[4];
        vd_vertex_picture(drawing, corners[i], picture);
        for (int k = 0; k < 4; k++) {
            polygon[i][k] = (double)picture[k];
        }
        vertex[i] = i;
    }
    const int count = vd_clip_polygon(drawing, polygon, vertex, 3);
    vd_vertex snapped[VD_CLIP_MAX];
    for (int i = 0; i < count; i++) {
        const vd_vertex *old = vertex[i] < 0 ? NULL : &drawing->vertices[corners[vertex[i]]];
        snapped[i] = old != NULL && old->x >= VD_FLAGGED ? *old : snap(drawing, polygon[i]);
    }
    for (int i = 2; i < count; i++) {
        vd_setup setup;
        if (vd_setup_triangle(drawing, &snapped[0], &snapped[i - 1], &snapped[i], id, &setup)) {
            emit(user, &setup);
        }
    }
    return count > 0;
}

static bool assemble_triangle(const vd_drawing *drawing, uint32_t primitive,
                              vd_setup_function *emit, void *user) {
    const uint32_t *corners = vd_mesh_indices(drawing->mesh) + 3 * (size_t)primitive;
    const uint32_t id = drawing->first_id + primitive;
    const vd_vertex *v[3];
    int32_t any = 0, all = 255;
    for (int i = 0; i < 3; i++) {
        v[i] = &drawing->vertices[corners[i]];
        const int32_t code = outside_code(v[i]);
        any |= code;
        all &= code;
    }
    if (any == 0) {
        vd_setup setup;
        if (vd_setup_triangle(drawing, v[0], v[1], v[2], id, &setup)) {
            emit(user, &setup);
        }
        return false;
    }
    if ((any & VD_OUT_BAD) != 0 || (all & ~VD_OUT_GUARD) != 0) {
        return false;
    }
    return clip_triangle(drawing, corners, id, emit, user);
}

/* ---- lines and points ------------------------------------------------------------------------ */

/* Two triangles of a convex quadrilateral. */
static void emit_quad(const vd_vertex q[4], uint32_t id, vd_setup_function *emit, void *user) {
    for (int i = 2; i < 4; i++) {
        vd_setup setup;
        if (set_up(&q[0], &q[i - 1], &q[i], true, true, id, &setup)) {
            emit(user, &setup);
        }
    }
}

/* Makes a rectangle of the line's width around it. */
static bool widen_line(const vd_drawing *drawing, uint32_t from, uint32_t to, uint32_t id,
                       vd_setup_function *emit, void *user) {
    float picture[2][4];
    double ends[2][4], t[2];
    const uint32_t vertices[2] = {from, to};
    for (int i = 0; i < 2; i++) {
        vd_vertex_picture(drawing, vertices[i], picture[i]);
        for (int k = 0; k < 4; k++) {
            ends[i][k] = (double)picture[i][k];
            if (!isfinite(ends[i][k])) {
                return false;
            }
        }
    }
    if (!vd_clip_line(drawing, ends[0], ends[1], t)) {
        return false;
    }
    vd_vertex v[2];
    for (int i = 0; i < 2; i++) {
        double p[4];
        for (int k = 0; k < 4; k++) {
            p[k] = ends[0][k] + t[i] * (ends[1][k] - ends[0][k]);
        }
        v[i] = snap(drawing, p);
    }
    const double dx = (double)v[1].x - v[0].x, dy = (double)v[1].y - v[0].y;
    const double length = sqrt(dx * dx + dy * dy);
    const double half = 128.0 * drawing->draw.line_width;
    const double sx = length > 0.0 ? -dy / length * half : 0.0;
    const double sy = length > 0.0 ? dx / length * half : half;
    vd_vertex q[4] = {v[0], v[1], v[1], v[0]};
    for (int i = 0; i < 4; i++) {
        const double side = i < 2 ? 1.0 : -1.0;
        q[i].x = (int32_t)floor(q[i].x + side * sx + 0.5);
        q[i].y = (int32_t)floor(q[i].y + side * sy + 0.5);
    }
    emit_quad(q, id, emit, user);
    return t[0] > 0.0 || t[1] < 1.0;
}

static void widen_point(const vd_drawing *drawing, uint32_t vertex, uint32_t id,
                        vd_setup_function *emit, void *user) {
    const vd_vertex *v = &drawing->vertices[vertex];
    if (v->x < VD_FLAGGED) {
        return;
    }
    const int32_t size = (int32_t)floor(256.0 * drawing->draw.point_size + 0.5);
    const int32_t low = size / 2, high = size - low;
    vd_vertex q[4] = {*v, *v, *v, *v};
    for (int i = 0; i < 4; i++) {
        q[i].x += i == 1 || i == 2 ? high : -low;
        q[i].y += i >= 2 ? high : -low;
    }
    emit_quad(q, id, emit, user);
}

/* Whether a wireframe's triangle faces the right way, by the sign of the homogeneous area (Olano &
 * Greer 1997), which holds for vertices behind the eye too. */
static bool faces_right(const vd_drawing *drawing, const uint32_t *corners) {
    double p[3][4];
    for (int i = 0; i < 3; i++) {
        float picture[4];
        vd_vertex_picture(drawing, corners[i], picture);
        for (int k = 0; k < 4; k++) {
            p[i][k] = (double)picture[k];
        }
    }
    const vd_vec3 a = {p[0][0], p[0][1], p[0][3]}, b = {p[1][0], p[1][1], p[1][3]};
    const vd_vec3 c = {p[2][0], p[2][1], p[2][3]};
    const double area = vd_vec3_dot(a, vd_vec3_cross(b, c));
    return area > 0.0   ? drawing->keep_clockwise
           : area < 0.0 ? drawing->keep_counter_clockwise
                        : drawing->keep_clockwise && drawing->keep_counter_clockwise;
}

bool vd_assemble(const vd_drawing *drawing, uint32_t primitive, vd_setup_function *emit,
                 void *user) {
    const uint32_t *indices = vd_mesh_indices(drawing->mesh);
    const uint32_t id = drawing->first_id + primitive;
    if (drawing->topology == VD_TOPOLOGY_TRIANGLES) {
        return assemble_triangle(drawing, primitive, emit, user);
    }
    if (drawing->topology == VD_TOPOLOGY_POINTS) {
        widen_point(drawing, drawing->by_vertex ? primitive : indices[primitive], id, emit, user);
        return false;
    }
    if (!drawing->wireframe) {
        const uint32_t *ends = indices + 2 * (size_t)primitive;
        return widen_line(drawing, ends[0], ends[1], id, emit, user);
    }
    const uint32_t *corners = indices + 3 * (size_t)primitive;
    bool clipped = false;
    for (int i = 0; i < 3 && (i > 0 || faces_right(drawing, corners)); i++) {
        clipped |= widen_line(drawing, corners[i], corners[(i + 1) % 3], id, emit, user);
    }
    return clipped;
}
