/* raster_interpolate.c: what a fragment function sees of one pixel, the plain way.
 *
 * A place in a triangle is given by its distances from two sides as shares of the whole, b1 and b2;
 * divided by depth and normalized they are the shares c1 and c2 of vertices 1 and 2 in the surface
 * itself, and any attribute is a0 + (c1·(a1 − a0) + c2·(a2 − a0)) (Blinn 1992). b1 and b2 are
 * clamped to 0 … 1: a sample that is covered lies inside, whatever rounding says about slivers.
 *
 * Where a vertex has no place in the picture (behind the near plane), the shares come from the
 * homogeneous coordinates of all three vertices instead (Olano & Greer 1997), in double: clipping
 * needs no new attributes.
 */
#include <math.h>
#include <string.h>
#include "raster/raster_internal.h"

/* Shares of up to three vertices in one place. */
typedef struct shares {
    float c1, c2;
} shares;

static float clamp(float v) {
    v = v > 0.0f ? v : 0.0f;
    return v < 1.0f ? v : 1.0f;
}

static shares projected_shares(const vd_vertex *v0, const vd_vertex *v1, const vd_vertex *v2,
                               int32_t x, int32_t y, bool inside) {
    const float x1 = (float)(v1->x - v0->x), y1 = (float)(v1->y - v0->y);
    const float x2 = (float)(v2->x - v0->x), y2 = (float)(v2->y - v0->y);
    const float dx = (float)(x - v0->x), dy = (float)(y - v0->y);
    const float inverse = 1.0f / (x1 * y2 - x2 * y1);
    float b1 = (dx * y2 - dy * x2) * inverse;
    float b2 = (dy * x1 - dx * y1) * inverse;
    if (inside) {
        b1 = clamp(b1);
        b2 = clamp(b2);
    }
    const float w = 1.0f / (v0->rw + (b1 * (v1->rw - v0->rw) + b2 * (v2->rw - v0->rw)));
    return (shares){b1 * v1->rw * w, b2 * v2->rw * w};
}

static vd_vec3 homogeneous(const vd_drawing *drawing, uint32_t vertex) {
    float p[4];
    vd_vertex_picture(drawing, vertex, p);
    return vd_vec3_make((double)p[0], (double)p[1], (double)p[3]);
}

static shares clipped_shares(const vd_drawing *drawing, const uint32_t *corners, int32_t x,
                             int32_t y, bool inside) {
    vd_vec3 p[3];
    for (int i = 0; i < 3; i++) {
        p[i] = homogeneous(drawing, corners[i]);
    }
    const vd_vec3 at = vd_vec3_make(x / 256.0 + 0.5, y / 256.0 + 0.5, 1.0);
    const double e0 = vd_vec3_dot(vd_vec3_cross(p[1], p[2]), at);
    const double e1 = vd_vec3_dot(vd_vec3_cross(p[2], p[0]), at);
    const double e2 = vd_vec3_dot(vd_vec3_cross(p[0], p[1]), at);
    const double sum = (e0 + e1) + e2;
    const float c1 = (float)(e1 / sum), c2 = (float)(e2 / sum);
    return inside ? (shares){clamp(c1), clamp(c2)} : (shares){c1, c2};
}

static shares triangle_shares(const vd_drawing *drawing, const uint32_t *corners, int32_t x,
                              int32_t y, bool inside) {
    const vd_vertex *v0 = &drawing->vertices[corners[0]], *v1 = &drawing->vertices[corners[1]];
    const vd_vertex *v2 = &drawing->vertices[corners[2]];
    if (v0->x < VD_FLAGGED || v1->x < VD_FLAGGED || v2->x < VD_FLAGGED) {
        return clipped_shares(drawing, corners, x, y, inside);
    }
    return projected_shares(v0, v1, v2, x, y, inside);
}

/* The place on the line that is nearest to the pixel: where the line through the pixel across the
 * line's direction in the picture meets it. */
static shares line_shares(const vd_drawing *drawing, const uint32_t *ends, int32_t x, int32_t y) {
    const vd_vec3 a = homogeneous(drawing, ends[0]), b = homogeneous(drawing, ends[1]);
    const double px = x / 256.0 + 0.5, py = y / 256.0 + 0.5;
    const double nx = b.x * a.z - a.x * b.z, ny = b.y * a.z - a.y * b.z;
    const double from = nx * (px * a.z - a.x) + ny * (py * a.z - a.y);
    const double to = nx * ((b.x - a.x) - px * (b.z - a.z)) + ny * ((b.y - a.y) - py * (b.z - a.z));
    const double t = to != 0.0 ? from / to : 0.0;
    return (shares){clamp((float)t), 0.0f};
}

static shares shares_at(const vd_drawing *drawing, const uint32_t *corners, int32_t x, int32_t y,
                        bool inside) {
    if (drawing->topology == VD_TOPOLOGY_POINTS) {
        return (shares){0.0f, 0.0f};
    }
    if (drawing->topology == VD_TOPOLOGY_LINES && !drawing->wireframe) {
        return line_shares(drawing, corners, x, y);
    }
    return triangle_shares(drawing, corners, x, y, inside && !drawing->wireframe);
}

static void fill_normal(const vd_drawing *drawing, const uint32_t *corners, int lane,
                        vd_batch *batch) {
    float p[3][3];
    for (int i = 0; i < 3; i++) {
        for (int axis = 0; axis < 3; axis++) {
            p[i][axis] = vd_mesh_positions(drawing->mesh, axis)[corners[i]];
        }
    }
    float u[3], v[3];
    for (int axis = 0; axis < 3; axis++) {
        u[axis] = p[1][axis] - p[0][axis];
        v[axis] = p[2][axis] - p[0][axis];
    }
    float n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
    /* Towards the viewer: the eye in perspective, against the view axis in parallel projection. */
    const vd_mesh_view *view = &drawing->view;
    float towards = 0.0f;
    for (int axis = 0; axis < 3; axis++) {
        const float back = view->far_m > 0.0f ? -view->mesh_from_camera[axis][2]
                                              : view->mesh_from_camera[axis][3] - p[0][axis];
        towards = towards + n[axis] * back;
    }
    const float length = sqrtf((n[0] * n[0] + n[1] * n[1]) + n[2] * n[2]);
    const float scale = (towards < 0.0f ? -1.0f : 1.0f) / (length > 0.0f ? length : 1.0f);
    for (int axis = 0; axis < 3; axis++) {
        batch->normal[axis][lane] = n[axis] * scale;
    }
}

static void fill_user(const vd_drawing *drawing, const uint32_t *corners, int count, shares s,
                      int lane, vd_batch *batch) {
    const vd_shader *shader = drawing->shader;
    const size_t bytes = shader->user_bytes;
    const float factors[3] = {(1.0f - s.c1) - s.c2, s.c1, s.c2};
    uint8_t sum[VD_MAX_USER_BYTES] __attribute__((aligned(64)));
    uint8_t part[VD_MAX_USER_BYTES] __attribute__((aligned(64)));
    for (int i = 0; i < count; i++) {
        uint8_t *to = i == 0 ? sum : part;
        shader->user_scale(to, drawing->user + (size_t)corners[i] * bytes, factors[i]);
        if (i > 0) {
            shader->user_add(sum, sum, part);
        }
    }
    memcpy(batch->user + (size_t)lane * bytes, sum, bytes);
}

static void fill_varyings(const vd_drawing *drawing, const uint32_t *corners, shares s,
                          float (*out)[VD_BATCH], int lane, bool difference) {
    for (int k = 0; k < drawing->varying_count; k++) {
        const int c = drawing->component[k];
        if (c < 0) {
            out[k][lane] = 0.0f;
            continue;
        }
        const float *group = drawing->groups + (size_t)(c / 4) * drawing->group_stride + c % 4;
        const float a0 = group[4 * (size_t)corners[0]], a1 = group[4 * (size_t)corners[1]];
        const float a2 = group[4 * (size_t)corners[2]];
        const float change = s.c1 * (a1 - a0) + s.c2 * (a2 - a0);
        out[k][lane] = difference ? change : a0 + change;
    }
}

void vd_interpolate(const vd_drawing *drawing, uint32_t primitive, int32_t x, int32_t y, int lane,
                    vd_batch *batch) {
    const vd_mesh *mesh = drawing->mesh;
    const uint32_t *indices = vd_mesh_indices(mesh);
    uint32_t corners[3];
    int count = mesh->topology == VD_TOPOLOGY_TRIANGLES ? 3
                : mesh->topology == VD_TOPOLOGY_LINES   ? 2
                                                        : 1;
    count = drawing->by_vertex ? 1 : count;
    for (int i = 0; i < 3; i++) {
        const size_t at = (size_t)primitive * (size_t)count + (size_t)(i < count ? i : 0);
        corners[i] = drawing->by_vertex ? primitive : indices[at];
    }
    const unsigned inputs = drawing->inputs;
    const shares s = shares_at(drawing, corners, x, y, true);
    batch->primitive[lane] = primitive;
    batch->x[lane] = (float)x * (1.0f / 256.0f) + 0.5f;
    batch->y[lane] = (float)y * (1.0f / 256.0f) + 0.5f;
    fill_varyings(drawing, corners, s, batch->varyings, lane, false);
    if ((inputs & VD_INPUT_DERIVATIVES) != 0) {
        const shares here = shares_at(drawing, corners, x, y, false);
        const shares right = shares_at(drawing, corners, x + VD_SUBPIXELS, y, false);
        const shares below = shares_at(drawing, corners, x, y + VD_SUBPIXELS, false);
        const shares to_right = {right.c1 - here.c1, right.c2 - here.c2};
        const shares down = {below.c1 - here.c1, below.c2 - here.c2};
        fill_varyings(drawing, corners, to_right, batch->varyings_dx, lane, true);
        fill_varyings(drawing, corners, down, batch->varyings_dy, lane, true);
    }
    if ((inputs & VD_INPUT_FACE_NORMAL) != 0) {
        fill_normal(drawing, corners, lane, batch);
    }
    if (drawing->shader->user_bytes > 0) {
        fill_user(drawing, corners, count, s, lane, batch);
    }
}

/* The part that a primitive belongs to; points of all vertices belong to the first. */
static const vd_mesh_part *find_part(const vd_drawing *drawing, uint32_t primitive) {
    const vd_mesh_part *parts = vd_mesh_parts(drawing->mesh);
    uint32_t low = 0, high = drawing->by_vertex ? 0 : drawing->mesh->part_count;
    while (high - low > 1 && high > 0) { /* the last part that begins at or before the primitive */
        const uint32_t middle = (low + high) / 2;
        if (parts[middle].first <= primitive) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return &parts[low];
}

const vd_material *vd_drawing_material(const vd_drawing *drawing, uint32_t primitive) {
    static const vd_material standard = {.albedo = {0.8f, 0.8f, 0.8f},
                                         .alpha = 1.0f,
                                         .specular = {0.1f, 0.1f, 0.1f},
                                         .shininess = 32.0f};
    if (drawing->draw.materials == NULL) {
        return &standard;
    }
    return &drawing->draw.materials[find_part(drawing, primitive)->material];
}

vd_kind vd_drawing_kind(const vd_drawing *drawing, uint32_t primitive, uint32_t *end) {
    *end = drawing->primitive_count;
    if (!drawing->special) {
        return VD_KIND_SOLID;
    }
    const vd_mesh_part *part = find_part(drawing, primitive);
    if (!drawing->by_vertex) {
        *end = part->first + part->count;
    }
    return vd_material_kind(&drawing->draw.materials[part->material]);
}

vd_material vd_material_default(void) {
    static const vd_drawing none;
    return *vd_drawing_material(&none, 0);
}

void vd_batch_run(const vd_drawing *drawing, const vd_material *material, uint32_t mask,
                  vd_batch *batch) {
    const unsigned inputs = drawing->inputs;
    const vd_mesh_view *view = &drawing->view;
    for (int i = 0; i < VD_BATCH; i++) {
        batch->color[0][i] = batch->color[1][i] = batch->color[2][i] = 0.0f;
        batch->color[3][i] = 1.0f;
        batch->w[i] = view->far_m > 0.0f ? 1.0f : view->near_m / batch->depth[i];
    }
    const bool change = (inputs & VD_INPUT_DERIVATIVES) != 0;
    const bool normal = (inputs & VD_INPUT_FACE_NORMAL) != 0;
    const vd_fragments fragments = {mask,
                                    drawing->draw.uniforms,
                                    view,
                                    drawing->mesh,
                                    material,
                                    (const float(*)[VD_BATCH])batch->varyings,
                                    change ? (const float(*)[VD_BATCH])batch->varyings_dx : NULL,
                                    change ? (const float(*)[VD_BATCH])batch->varyings_dy : NULL,
                                    normal ? (const float(*)[VD_BATCH])batch->normal : NULL,
                                    batch->user,
                                    batch->primitive,
                                    batch->x,
                                    batch->y,
                                    batch->depth,
                                    batch->w,
                                    batch->color};
    if (drawing->fragment != NULL) {
        drawing->fragment(&fragments);
    }
    if (vd_alpha_of_material(drawing, material)) {
        vd_surface_alpha(&fragments, drawing->uv);
    }
    for (int c = 0; c < 4; c++) {
        for (int i = 0; i < VD_BATCH; i++) {
            float v = batch->color[c][i];
            v = v > 0.0f ? v : 0.0f; /* NaN too */
            batch->color[c][i] = v < 1.0f ? v : 1.0f;
        }
    }
}
