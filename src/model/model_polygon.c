/* model_polygon.c: polygons into triangles. */
#include "model/model_build.h"

/* Cutting off an ear looks at all corners: a polygon of n takes up to n³ / 6 steps, which 256 keep
 * below 3 million. Files have polygons that large for caps of cylinders, where a fan is right. */
#define MOST_EARS 256

/* A polygon laid on one of the coordinate planes, counter-clockwise seen from in front. */
typedef struct flat {
    const double (*points)[3];
    int u, v;
} flat;

static double cross(const flat *f, uint32_t a, uint32_t b, uint32_t c) {
    const double *p = f->points[a], *q = f->points[b], *r = f->points[c];
    return (q[f->u] - p[f->u]) * (r[f->v] - p[f->v]) - (q[f->v] - p[f->v]) * (r[f->u] - p[f->u]);
}

/* The normal by Newell's sum (Sutherland, Sproull, Schumacker 1974); the axis that it is longest
 * along is dropped. */
static flat lay_flat(const double (*points)[3], size_t count) {
    double normal[3] = {0.0, 0.0, 0.0};
    for (size_t i = 0; i < count; i++) {
        const double *p = points[i], *q = points[i + 1 < count ? i + 1 : 0], *o = points[0];
        for (int k = 0; k < 3; k++) {
            const int u = (k + 1) % 3, v = (k + 2) % 3;
            normal[k] += (p[u] - o[u]) * (q[v] - o[v]) - (p[v] - o[v]) * (q[u] - o[u]);
        }
    }
    int longest = 0;
    for (int k = 1; k < 3; k++) {
        const double now = normal[k] < 0.0 ? -normal[k] : normal[k];
        const double best = normal[longest] < 0.0 ? -normal[longest] : normal[longest];
        longest = now > best ? k : longest;
    }
    flat f = {points, (longest + 1) % 3, (longest + 2) % 3};
    if (normal[longest] < 0.0) {
        const int u = f.u;
        f.u = f.v;
        f.v = u;
    }
    return f;
}

/* Whether corner i of the `count` left is convex and no other corner lies in its triangle. */
static bool is_ear(const flat *f, const uint32_t *left, size_t count, size_t i) {
    const uint32_t a = left[i > 0 ? i - 1 : count - 1], b = left[i];
    const uint32_t c = left[i + 1 < count ? i + 1 : 0];
    if (!(cross(f, a, b, c) > 0.0)) {
        return false;
    }
    for (size_t k = 0; k < count; k++) {
        const uint32_t p = left[k];
        if (p != a && p != b && p != c && cross(f, a, b, p) >= 0.0 && cross(f, b, c, p) >= 0.0 &&
            cross(f, c, a, p) >= 0.0) {
            return false;
        }
    }
    return true;
}

static void fan(const uint32_t *left, size_t count, uint32_t (*out)[3]) {
    for (size_t i = 0; i + 2 < count; i++) {
        out[i][0] = left[0];
        out[i][1] = left[i + 1];
        out[i][2] = left[i + 2];
    }
}

void vd_triangulate(const double (*points)[3], size_t count, uint32_t *left, uint32_t (*out)[3]) {
    for (size_t i = 0; i < count; i++) {
        left[i] = (uint32_t)i;
    }
    const flat f = lay_flat(points, count);
    while (count > 3 && count <= MOST_EARS) {
        size_t ear = 0;
        while (ear < count && !is_ear(&f, left, count, ear)) {
            ear++;
        }
        if (ear == count) {
            break; /* crosses itself, or has no area */
        }
        (*out)[0] = left[ear > 0 ? ear - 1 : count - 1];
        (*out)[1] = left[ear];
        (*out)[2] = left[ear + 1 < count ? ear + 1 : 0];
        out++;
        count--;
        for (size_t k = ear; k < count; k++) {
            left[k] = left[k + 1];
        }
    }
    fan(left, count, out);
}
