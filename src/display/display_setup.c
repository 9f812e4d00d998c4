/* Quads to planes over the picture (Olano and Greer 1997: homogeneous coordinates need no clipping;
 * the near plane is one more edge). Doubles: products of two floats are exact in them, and an edge
 * turned around is exactly the negative. */
#include "display/display_rows.h"

typedef struct vec3 {
    double x, y, w;
} vec3;

static vec3 cross(vec3 p, vec3 q) {
    return (vec3){p.y * q.w - p.w * q.y, p.w * q.x - p.x * q.w, p.x * q.y - p.y * q.x};
}

static vec3 difference(vec3 p, vec3 q) {
    return (vec3){p.x - q.x, p.y - q.y, p.w - q.w};
}

static double dot(vec3 p, vec3 q) {
    return p.x * q.x + p.y * q.y + p.w * q.w;
}

static bool finite(double v) {
    return v - v == 0.0;
}

bool vd_display_check(const vd_quad *quad, const char **field) {
    const vd_quad_picture *p = &quad->picture;
    *field = "a corner is not finite";
    for (int i = 0; i < 4; i++) {
        const vd_quad_corner c = quad->corners[i];
        if (!finite(c.x) || !finite(c.y) || !finite(c.w)) {
            return false;
        }
    }
    *field = "its nearer is neither 0 nor at least 1";
    if (quad->nearer != 0.0f && !(quad->nearer >= 1.0f && finite(quad->nearer))) {
        return false;
    }
    *field = "its picture has no pixels";
    if (p->rgba == NULL) {
        return false;
    }
    *field = "its picture's width, height or stride is out of range (sides 2 to 65535)";
    if (p->width < 2 || p->height < 2 || p->width > VD_MAX_SIDE || p->height > VD_MAX_SIDE ||
        p->stride < (size_t)p->width || p->stride > VD_MAX_PIXELS / (size_t)p->height) {
        return false;
    }
    *field = "its opaque rectangle is not inside its picture";
    return p->opaque[0] >= 0 && p->opaque[1] >= 0 && p->opaque[0] <= p->opaque[2] &&
           p->opaque[1] <= p->opaque[3] && p->opaque[2] <= p->width && p->opaque[3] <= p->height;
}

/* Takes a point into the box that `low` and `high` are. */
static void widen(double low[2], double high[2], double x, double y) {
    const double at[2] = {x, y};
    for (int k = 0; k < 2; k++) {
        low[k] = at[k] < low[k] ? at[k] : low[k];
        high[k] = at[k] > high[k] ? at[k] : high[k];
    }
}

double vd_quad_pixels(const vd_quad *quad, float near_m, int width, int height) {
    const double near = (double)near_m, most[2] = {width, height};
    double low[2] = {width, height}, high[2] = {0, 0};
    for (int i = 0; i < 4; i++) {
        const vd_quad_corner c = quad->corners[i], d = quad->corners[(i + 1) & 3];
        const vec3 a = {c.x, c.y, c.w}, b = {d.x, d.y, d.w};
        if (a.w >= near) {
            widen(low, high, a.x / a.w, a.y / a.w);
        }
        if ((a.w >= near) != (b.w >= near)) { /* where the side comes through the near plane */
            const double t = (near - a.w) / (b.w - a.w);
            widen(low, high, (a.x + t * (b.x - a.x)) / near, (a.y + t * (b.y - a.y)) / near);
        }
    }
    for (int k = 0; k < 2; k++) {
        low[k] = low[k] > 0 ? low[k] : 0;
        high[k] = high[k] < most[k] ? high[k] : most[k];
        if (!(high[k] > low[k])) {
            return 0;
        }
    }
    return (high[0] - low[0]) * (high[1] - low[1]);
}

static vd_display_edge make_edge(double a, double b, double c, bool closed) {
    return (vd_display_edge){a, b, c, a != 0.0 ? 1.0 / a : 0.0, closed};
}

/* p − k·q of two planes. */
static vd_display_edge edge_between(const double p[3], double k, const double q[3], double sign) {
    return make_edge(sign * (p[0] - k * q[0]), sign * (p[1] - k * q[1]), sign * (p[2] - k * q[2]),
                     false);
}

/* What is a little more than half a texel inside the opaque rectangle reads opaque texels only. */
static void add_opaque_edges(vd_display_setup *s) {
    const vd_quad_picture *p = &s->quad->picture;
    const double inside = 0.5 + 1.0 / 32;
    if (s->quad->opacity != 255 || p->opaque[2] - p->opaque[0] < 2 ||
        p->opaque[3] - p->opaque[1] < 2) {
        return;
    }
    s->opaque[0] = edge_between(s->u, p->opaque[0] + inside, s->inverse_w, 1);
    s->opaque[1] = edge_between(s->v, p->opaque[1] + inside, s->inverse_w, 1);
    s->opaque[2] = edge_between(s->u, p->opaque[2] - inside, s->inverse_w, -1);
    s->opaque[3] = edge_between(s->v, p->opaque[3] - inside, s->inverse_w, -1);
    s->opaque_count = VD_DISPLAY_OPAQUE_EDGES;
}

/* The rows whose centres may lie between the highest and the lowest corner, all of which are before
 * the eye. Edges decide: this only saves asking them, so it may be a little wide. */
static void find_rows(const vec3 p[4], int height, vd_display_entry *entry) {
    const double slack = 1.0 / 1024;
    double low = p[0].y / p[0].w, high = low;
    for (int i = 1; i < 4; i++) {
        const double y = p[i].y / p[i].w;
        low = y < low ? y : low;
        high = high < y ? y : high;
    }
    low += 0.5 - slack;
    high += 0.5 + slack;
    entry->first_row = low > 0.0 ? low < height ? (int)low : height : 0;
    entry->end_row = high > 0.0 ? high < height ? (int)high : height : 0;
}

bool vd_display_prepare(const vd_quad *quad, float near_m, int height, vd_display_setup *setup,
                        vd_display_entry *entry) {
    vec3 p[4];
    int behind = 0;
    for (int i = 0; i < 4; i++) {
        p[i] = (vec3){quad->corners[i].x, quad->corners[i].y, quad->corners[i].w};
        behind += p[i].w < near_m ? 1 : 0;
    }
    const vec3 along = difference(p[1], p[0]), down = difference(p[3], p[0]);
    const vec3 normal = cross(along, down);
    const double det = dot(p[0], normal);
    if (quad->opacity == 0 || behind == 4 || det == 0.0 || !finite(1.0 / det)) {
        return false;
    }
    const vec3 u = cross(down, p[0]), v = cross(p[0], along);
    const double wide = quad->picture.width / det, high = quad->picture.height / det;
    *entry = (vd_display_entry){setup, 0, height};
    *setup = (vd_display_setup){
        .quad = quad,
        .u = {u.x * wide, u.y * wide, u.w * wide},
        .v = {v.x * high, v.y * high, v.w * high},
        .inverse_w = {normal.x / det, normal.y / det, normal.w / det},
    };
    const double sign = det < 0.0 ? -1.0 : 1.0;
    for (int i = 0; i < 4; i++) {
        const vec3 e = cross(p[i], p[(i + 1) & 3]);
        const double a = sign * e.x, b = sign * e.y, c = sign * e.w;
        /* Two corners in one place bound nothing. */
        if (a != 0.0 || b != 0.0 || c != 0.0) {
            setup->edges[setup->edge_count++] =
                make_edge(a, b, c, a > 0.0 || (a == 0.0 && b > 0.0));
        }
    }
    if (behind > 0) {
        const double *q = setup->inverse_w;
        setup->edges[setup->edge_count++] = make_edge(-q[0], -q[1], 1.0 / near_m - q[2], true);
        setup->edges[setup->edge_count++] = make_edge(q[0], q[1], q[2], false);
    } else {
        find_rows(p, height, entry);
    }
    add_opaque_edges(setup);
    return entry->first_row < entry->end_row;
}
