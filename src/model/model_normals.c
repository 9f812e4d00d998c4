/* model_normals.c: normals of a mesh that has none.
 *
 * A corner's normal is the sum over the triangles around its position that turn away from its own
 * by less than the crease angle, each weighted as in Max 1999: the cross product of its two sides
 * at that position over the product of their squared lengths. That needs no acos and no square root
 * and is exact for points of a sphere. Corners over the same set of triangles share one normal, so
 * a smooth vertex stays one vertex, and the corner of a cube becomes three.
 *
 * Around most vertices all triangles turn little from their sum: then one normal serves all and no
 * pair is looked at. A position with more than 64 triangles gets one normal whatever they turn:
 * pairs would be too many (a file may have one vertex in a million triangles).
 */
#include <math.h>
#include <string.h>
#include "model/model_build.h"

/* 40 degrees, and a little less than 20: eaves of a house are edges, a cylinder of 12 sides is
 * round. At 60 roofs ran into walls. */
#define CREASE_COSINE 0.766f
#define HALF_CREASE_COSINE 0.94f
#define MOST_AROUND 64

typedef struct normals {
    vd_context *context;
    const float *positions;
    const uint32_t *corners;
    float (*faces)[3];      /* unit normals of the triangles; 0 for those without area */
    uint32_t *first, *ring; /* corners around each position: ring[first[p] … first[p + 1]) */
    vd_list *out, *owner;
    uint32_t *corner_normals;
} normals;

static vd_vec3 place(const normals *n, uint32_t position) {
    const float *p = n->positions + 3 * (size_t)position;
    return vd_vec3_make((double)p[0], (double)p[1], (double)p[2]);
}

static void face_normals(normals *n, size_t corner_count) {
    for (size_t t = 0; t < corner_count / 3; t++) {
        const vd_vec3 a = place(n, n->corners[3 * t]);
        const vd_vec3 unit =
            vd_vec3_normalize(vd_vec3_cross(vd_vec3_subtract(place(n, n->corners[3 * t + 1]), a),
                                            vd_vec3_subtract(place(n, n->corners[3 * t + 2]), a)));
        n->faces[t][0] = (float)unit.x;
        n->faces[t][1] = (float)unit.y;
        n->faces[t][2] = (float)unit.z;
    }
}

/* A counting sort of the corners by position. */
static void make_rings(normals *n, size_t position_count, size_t corner_count) {
    for (size_t c = 0; c < corner_count; c++) {
        n->first[n->corners[c] + 1]++;
    }
    for (size_t p = 0; p < position_count; p++) {
        n->first[p + 1] += n->first[p];
    }
    for (size_t c = 0; c < corner_count; c++) {
        n->ring[n->first[n->corners[c]]++] = (uint32_t)c;
    }
    memmove(n->first + 1, n->first, position_count * sizeof *n->first);
    n->first[0] = 0;
}

/* What a triangle brings to the normal at one of its corners: its own normal, by Max's weight. */
static vd_vec3 share(const normals *n, uint32_t corner) {
    const uint32_t *t = n->corners + corner / 3 * 3;
    const uint32_t k = corner % 3;
    const vd_vec3 at = place(n, t[k]);
    const vd_vec3 u = vd_vec3_subtract(place(n, t[(k + 1) % 3]), at);
    const vd_vec3 v = vd_vec3_subtract(place(n, t[(k + 2) % 3]), at);
    const double squares = vd_vec3_dot(u, u) * vd_vec3_dot(v, v);
    return squares > 0.0 ? vd_vec3_scale(vd_vec3_cross(u, v), 1.0 / squares)
                         : vd_vec3_make(0.0, 0.0, 0.0);
}

static float dot(const float a[3], const float b[3]) {
    return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2];
}

/* Appends the normal of a sum; where that is nothing, the triangle's own, else up. */
static bool emit(normals *n, uint32_t position, vd_vec3 sum, const float *own, uint32_t *id) {
    float *to = vd_list_add(n->context, n->out, 1, 3 * sizeof *to);
    uint32_t *owner = vd_list_add(n->context, n->owner, 1, sizeof *owner);
    if (to == NULL || owner == NULL) {
        return false;
    }
    const vd_vec3 unit = vd_vec3_normalize(sum);
    const float summed[3] = {(float)unit.x, (float)unit.y, (float)unit.z}, up[3] = {0, 0, 1};
    const float *found = dot(summed, summed) > 0.5f ? summed : dot(own, own) > 0.5f ? own : up;
    memcpy(to, found, 3 * sizeof *to);
    *owner = position;
    *id = (uint32_t)(n->owner->count - 1);
    return true;
}

/* Each corner over what it is smooth with, told apart by the set of those. */
static bool divide(normals *n, uint32_t position, const uint32_t *ring, uint32_t count,
                   const vd_vec3 *shares) {
    uint64_t sets[MOST_AROUND];
    uint32_t ids[MOST_AROUND], known = 0;
    for (uint32_t i = 0; i < count; i++) {
        const float *mine = n->faces[ring[i] / 3];
        uint64_t set = 0;
        vd_vec3 sum = {0.0, 0.0, 0.0};
        for (uint32_t k = 0; k < count; k++) {
            if (k == i || dot(mine, n->faces[ring[k] / 3]) > CREASE_COSINE) {
                set |= UINT64_C(1) << k;
                sum = vd_vec3_add(sum, shares[k]);
            }
        }
        if (!(dot(mine, mine) > 0.5f)) {
            set = 0; /* a triangle without area: any normal does */
        }
        uint32_t found = 0;
        while (found < known && sets[found] != set && set != 0) {
            found++;
        }
        if (found == known) {
            sets[known] = set;
            if (!emit(n, position, sum, mine, &ids[known])) {
                return false;
            }
            known++;
        }
        n->corner_normals[ring[i]] = ids[found];
    }
    return true;
}

static bool around_position(normals *n, uint32_t position) {
    const uint32_t *ring = n->ring + n->first[position];
    const uint32_t count = n->first[position + 1] - n->first[position];
    if (count == 0) {
        return true;
    }
    vd_vec3 shares[MOST_AROUND], sum = {0.0, 0.0, 0.0};
    for (uint32_t i = 0; i < count; i++) {
        const vd_vec3 s = share(n, ring[i]);
        if (i < MOST_AROUND) {
            shares[i] = s;
        }
        sum = vd_vec3_add(sum, s);
    }
    const vd_vec3 unit = vd_vec3_normalize(sum);
    const float mean[3] = {(float)unit.x, (float)unit.y, (float)unit.z};
    bool smooth = true;
    for (uint32_t i = 0; i < count && count <= MOST_AROUND && smooth; i++) {
        const float *face = n->faces[ring[i] / 3];
        smooth = dot(mean, face) > HALF_CREASE_COSINE || !(dot(face, face) > 0.5f);
    }
    if (!smooth) {
        return divide(n, position, ring, count, shares);
    }
    uint32_t id = 0;
    if (!emit(n, position, sum, n->faces[ring[0] / 3], &id)) {
        return false;
    }
    for (uint32_t i = 0; i < count; i++) {
        n->corner_normals[ring[i]] = id;
    }
    return true;
}

vd_status vd_model_normals(vd_context *context, const float *positions, size_t position_count,
                           const uint32_t *corners, size_t corner_count, vd_list *out,
                           vd_list *owner, uint32_t *corner_normals) {
    normals n = {context, positions, corners, NULL, NULL, NULL, out, owner, corner_normals};
    n.faces = vd_allocate(context, corner_count / 3, sizeof *n.faces);
    n.first = vd_allocate_zero(context, position_count + 1, sizeof *n.first);
    n.ring = vd_allocate(context, corner_count, sizeof *n.ring);
    bool fits = n.faces != NULL && n.first != NULL && n.ring != NULL;
    if (fits) {
        face_normals(&n, corner_count);
        make_rings(&n, position_count, corner_count);
    }
    for (size_t p = 0; p < position_count && fits; p++) {
        fits = around_position(&n, (uint32_t)p);
    }
    vd_release(context, n.faces);
    vd_release(context, n.first);
    vd_release(context, n.ring);
    return fits ? vd_success()
                : vd_out_of_memory("a model's normals", corner_count * 2 * sizeof(uint32_t));
}
