/* tree.c: trees of few triangles that read as trees from near and far.
 *
 * A conifer is a stack of skirts, each a star of branches that droop, with a dark underside. A
 * broadleaf's crown is many small faceted clumps over an ellipsoid, darker below; facets catch the
 * light differently, which does what leaves would.
 */
#include "random.h"
#include "tree.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TURN 6.283185307179586

enum { MOST_VERTICES = 1024, MOST_TRIANGLES = 640 };

typedef enum leaf {
    BARK = 0,
    WHITE_BARK,
    NEEDLES_DARK,
    NEEDLES,
    NEEDLES_LIGHT,
    LARCH_DARK,
    LARCH,
    LARCH_LIGHT,
    LEAVES_DARK,
    LEAVES,
    LEAVES_LIGHT,
    BIRCH_DARK,
    BIRCH,
    BIRCH_LIGHT,
    LEAF_COUNT
} leaf;

static const char *const leaf_names[LEAF_COUNT] = {
    "bark",         "white-bark", "needles-dark", "needles",     "needles-light",
    "larch-dark",   "larch",      "larch-light",  "leaves-dark", "leaves",
    "leaves-light", "birch-dark", "birch",        "birch-light"};

static const char mtl[] = "# trees of `veduta generate forest`\n"
                          "newmtl bark\nKd 0.36 0.28 0.21\n"
                          "newmtl white-bark\nKd 0.80 0.79 0.74\n"
                          "newmtl needles-dark\nKd 0.10 0.19 0.12\n"
                          "newmtl needles\nKd 0.17 0.31 0.18\n"
                          "newmtl needles-light\nKd 0.22 0.37 0.20\n"
                          "newmtl larch-dark\nKd 0.24 0.31 0.14\n"
                          "newmtl larch\nKd 0.37 0.48 0.21\n"
                          "newmtl larch-light\nKd 0.44 0.55 0.25\n"
                          "newmtl leaves-dark\nKd 0.17 0.28 0.11\n"
                          "newmtl leaves\nKd 0.27 0.42 0.16\n"
                          "newmtl leaves-light\nKd 0.35 0.50 0.19\n"
                          "newmtl birch-dark\nKd 0.28 0.38 0.16\n"
                          "newmtl birch\nKd 0.42 0.54 0.23\n"
                          "newmtl birch-light\nKd 0.50 0.62 0.28\n";

typedef struct tree {
    uint64_t random;
    double vertices[MOST_VERTICES][3]; /* z up */
    int triangles[MOST_TRIANGLES][3];
    leaf leaves[MOST_TRIANGLES];
    int vertex_count, triangle_count;
} tree;

static double between(tree *t, double low, double high) {
    return low + (high - low) * vd_uniform(&t->random);
}

static int add_vertex(tree *t, double x, double y, double z) {
    double *v = t->vertices[t->vertex_count];
    v[0] = x, v[1] = y, v[2] = z;
    return t->vertex_count++;
}

static void add_triangle(tree *t, int a, int b, int c, leaf of) {
    const int corners[3] = {a, b, c};
    memcpy(t->triangles[t->triangle_count], corners, sizeof corners);
    t->leaves[t->triangle_count++] = of;
}

/* A tapering tube through `count` points. */
static void add_tube(tree *t, const double (*points)[3], const double *radii, int count, int sides,
                     leaf of) {
    const int first = t->vertex_count;
    for (int i = 0; i < count; i++) {
        for (int s = 0; s < sides; s++) {
            const double angle = TURN * s / sides;
            add_vertex(t, points[i][0] + radii[i] * cos(angle),
                       points[i][1] + radii[i] * sin(angle), points[i][2]);
        }
    }
    for (int i = 0; i + 1 < count; i++) {
        for (int s = 0; s < sides; s++) {
            const int a = first + i * sides + s, b = first + i * sides + (s + 1) % sides;
            add_triangle(t, a, b, a + sides, of);
            add_triangle(t, b, b + sides, a + sides, of);
        }
    }
}

/* ---- conifers -------------------------------------------------------------------------------- */

typedef struct conifer {
    double height, radius, foot; /* of the crown, metres; the lowest branches */
    double droop;                /* of a branch's tip, of its length */
    double gap;                  /* how far the star goes in between branches, of its radius */
    int tiers, branches;
    leaf dark; /* then the two lighter ones */
} conifer;

/* One skirt: branches around the trunk at `z`, gathered at `top`. */
static void add_skirt(tree *t, const conifer *c, double z, double top, double radius) {
    const int points = 2 * c->branches, apex = add_vertex(t, 0, 0, top);
    const int below = add_vertex(t, 0, 0, z + 0.25 * (top - z)), ring = t->vertex_count;
    const double turn = between(t, 0, TURN);
    for (int i = 0; i < points; i++) {
        const bool tip = i % 2 == 0;
        const double angle = turn + TURN * (i + between(t, -0.2, 0.2)) / points;
        const double out = radius * (tip ? between(t, 0.85, 1.12) : c->gap);
        const double down = tip ? c->droop * radius : -0.12 * (top - z);
        add_vertex(t, out * cos(angle), out * sin(angle), z - down);
    }
    for (int i = 0; i < points; i++) {
        const int a = ring + i, b = ring + (i + 1) % points;
        const leaf of = (leaf)(c->dark + (vd_uniform(&t->random) < 0.6 ? 1 : 2));
        add_triangle(t, a, b, apex, of);
        add_triangle(t, b, a, below, c->dark);
    }
}

static void grow_conifer(tree *t, const conifer *c) {
    const double trunk[3][3] = {{0, 0, -0.5}, {0, 0, c->foot}, {0, 0, 0.9 * c->height}};
    const double radii[3] = {0.035 * c->height * 0.6, 0.016 * c->height, 0.002 * c->height};
    add_tube(t, trunk, radii, 3, 6, BARK);
    for (int i = 0; i < c->tiers; i++) {
        const double up = (double)i / (c->tiers - 1), left = 1.0 - up;
        const double z = c->foot + (c->height - c->foot) * (0.94 * up + 0.02 * left * up);
        const double radius = c->radius * (left * (0.8 + 0.2 * left)) + 0.06 * c->radius;
        const double rise = (c->height - c->foot) / c->tiers * (1.1 + 1.3 * left);
        const double top = z + rise < c->height ? z + rise : c->height;
        add_skirt(t, c, z, top, radius * between(t, 0.9, 1.1));
    }
}

/* ---- broadleaves ----------------------------------------------------------------------------- */

typedef struct broadleaf {
    double height, foot; /* of the crown's top and bottom, metres */
    double radius;       /* of the crown */
    double clump;        /* radius of a clump */
    int clumps;
    leaf bark, dark;
} broadleaf;

/* An icosahedron, pulled out of shape. */
static void add_clump(tree *t, const double centre[3], double radius, leaf of) {
    static const double corners[12][3] = {
        {-0.526, 0, 0.851}, {0.526, 0, 0.851},  {-0.526, 0, -0.851}, {0.526, 0, -0.851},
        {0, 0.851, 0.526},  {0, 0.851, -0.526}, {0, -0.851, 0.526},  {0, -0.851, -0.526},
        {0.851, 0.526, 0},  {-0.851, 0.526, 0}, {0.851, -0.526, 0},  {-0.851, -0.526, 0}};
    static const int sides[20][3] = {{0, 1, 4},  {0, 4, 9},  {9, 4, 5},  {4, 8, 5},  {4, 1, 8},
                                     {8, 1, 10}, {8, 10, 3}, {5, 8, 3},  {5, 3, 2},  {2, 3, 7},
                                     {7, 3, 10}, {7, 10, 6}, {7, 6, 11}, {11, 6, 0}, {0, 6, 1},
                                     {6, 10, 1}, {9, 11, 0}, {9, 2, 11}, {9, 5, 2},  {7, 11, 2}};
    const int first = t->vertex_count;
    const double turn = between(t, 0, TURN), c = cos(turn), s = sin(turn);
    for (int i = 0; i < 12; i++) {
        const double out = radius * between(t, 0.75, 1.25);
        const double x = out * corners[i][0], y = out * corners[i][1];
        add_vertex(t, centre[0] + c * x - s * y, centre[1] + s * x + c * y,
                   centre[2] + 0.85 * out * corners[i][2]);
    }
    for (int i = 0; i < 20; i++) {
        add_triangle(t, first + sides[i][0], first + sides[i][1], first + sides[i][2], of);
    }
}

/* Clumps over an ellipsoid, by the golden angle; branches to some of them. */
static void grow_broadleaf(tree *t, const broadleaf *b) {
    const double middle = 0.5 * (b->foot + b->height), half = 0.5 * (b->height - b->foot);
    const double lean = between(t, -0.03, 0.03) * b->height;
    const double trunk[4][3] = {
        {0, 0, -0.5}, {0.3 * lean, 0, 0.5 * b->foot}, {lean, 0, b->foot}, {lean, 0, middle}};
    const double thick = 0.02 * b->height;
    const double radii[4] = {1.5 * thick, thick, 0.8 * thick, 0.3 * thick};
    add_tube(t, trunk, radii, 4, 6, b->bark);
    const double turn = between(t, 0, TURN);
    for (int i = 0; i < b->clumps; i++) {
        const double up = 1.0 - 2.0 * (i + 0.5) / b->clumps, angle = turn + 2.399963 * i;
        /* Fuller below the middle than an ellipsoid. */
        const double wide = sqrt(1.0 - up * up) * (up < 0.0 ? 1.08 : 1.0) * between(t, 0.62, 0.9);
        const double centre[3] = {lean + b->radius * wide * cos(angle),
                                  b->radius * wide * sin(angle),
                                  middle + half * 0.82 * up + between(t, -0.3, 0.3)};
        const double shade = 0.5 + 0.6 * up + between(t, -0.35, 0.35);
        const leaf of = (leaf)(b->dark + (shade < 0.2 ? 0 : shade < 0.8 ? 1 : 2));
        add_clump(t, centre, b->clump * between(t, 0.8, 1.2), of);
        if (i % 5 == 3) {
            const double z = b->foot + 0.4 * (centre[2] - b->foot);
            const double branch[2][3] = {{lean, 0, z < 0.8 * b->foot ? 0.8 * b->foot : z},
                                         {centre[0], centre[1], centre[2]}};
            const double ends[2] = {0.45 * thick, 0.1 * thick};
            add_tube(t, branch, ends, 2, 4, b->bark);
        }
    }
    for (int i = 0; i < 2; i++) { /* so that one does not see through it */
        const double heart[3] = {lean, 0, middle + (i - 0.5) * 0.7 * half};
        add_clump(t, heart, 0.62 * b->radius, b->dark);
    }
}

/* ---- text ------------------------------------------------------------------------------------ */

static void grow(tree *t, vd_tree_kind kind) {
    static const conifer conifers[2] = {{21.0, 3.6, 2.2, 0.20, 0.58, 14, 8, NEEDLES_DARK},
                                        {19.0, 3.3, 3.4, 0.06, 0.36, 14, 8, LARCH_DARK}};
    static const broadleaf broadleaves[2] = {{16.0, 4.2, 5.4, 2.1, 20, BARK, LEAVES_DARK},
                                             {15.0, 4.2, 2.9, 1.45, 20, WHITE_BARK, BIRCH_DARK}};
    if (kind == VD_TREE_CONIFER || kind == VD_TREE_LARCH) {
        grow_conifer(t, &conifers[kind == VD_TREE_LARCH]);
    } else {
        grow_broadleaf(t, &broadleaves[kind == VD_TREE_BIRCH]);
    }
}

const char *vd_tree_name(vd_tree_kind kind) {
    static const char *const names[VD_TREE_KIND_COUNT] = {"conifer", "larch", "broadleaf", "birch"};
    return names[kind];
}

const char *vd_tree_mtl(void) {
    return mtl;
}

char *vd_tree_obj(vd_tree_kind kind, uint64_t seed) {
    char *text = NULL;
    size_t bytes = 0;
    tree *t = calloc(1, sizeof *t);
    FILE *out = t != NULL ? open_memstream(&text, &bytes) : NULL;
    if (out == NULL) {
        free(t);
        return NULL;
    }
    t->random = seed * VD_TREE_KIND_COUNT + (uint64_t)kind;
    grow(t, kind);
    fprintf(out, "# %s: %d triangles, metres, y up; veduta generate forest\nmtllib tree.mtl\n",
            vd_tree_name(kind), t->triangle_count);
    for (int i = 0; i < t->vertex_count; i++) {
        const double *v = t->vertices[i];
        fprintf(out, "v %.3f %.3f %.3f\n", v[0], v[2], -v[1]);
    }
    for (int l = 0; l < LEAF_COUNT; l++) {
        bool named = false;
        for (int i = 0; i < t->triangle_count; i++) {
            const int *c = t->triangles[i];
            if ((int)t->leaves[i] != l) {
                continue;
            }
            if (!named) {
                fprintf(out, "usemtl %s\n", leaf_names[l]);
                named = true;
            }
            fprintf(out, "f %d %d %d\n", c[0] + 1, c[1] + 1, c[2] + 1);
        }
    }
    free(t);
    const bool failed = ferror(out) != 0;
    if (fclose(out) != 0 || failed) {
        free(text);
        text = NULL;
    }
    return text;
}
