/* hill_shade.c: rays towards the sun over the pyramid of maxima. */
#include "world/hill_shade.h"
#include <math.h>
#include "terrain/heightfield_block.h"

/* How often a map that wraps is crossed towards a sun on the horizon. */
#define MOST_REPEATS 16.0

/* A ray in sample space: column u + s·du, row v + s·dv, height w + s·dw, at s metres. */
typedef struct sun_ray {
    const vd_heightfield *map;
    double u, v, w, du, dv, dw;
    double soft; /* height units a metre that the sun is wide */
} sun_ray;

/* A block of cells [c0, c1) × [r0, r1), counted on over the repeats of a map that wraps. */
typedef struct block {
    int64_t c0, r0, c1, r1;
} block;

static int64_t floor_divide(int64_t a, int64_t b) {
    const int64_t q = a / b;
    return q * b > a ? q - 1 : q;
}

static double greater(double a, double b) {
    return b < a ? a : b;
}

/* The highest of a block's samples. Beyond the seam of a map that wraps lie the samples of column 0
 * or row 0, which the pyramid does not count to the last block. */
static double highest_of(const vd_heightfield *map, int level, int column, int row) {
    const vd_heightfield_level *l = &map->levels[level];
    double high = (double)vd_heightfield_sample(map, map, level, column, row);
    if (map->wraps != 0) {
        const bool right = column == l->width - 1, bottom = row == l->height - 1;
        if (right) {
            high = greater(high, (double)vd_heightfield_sample(map, map, level, 0, row));
        }
        if (bottom) {
            high = greater(high, (double)vd_heightfield_sample(map, map, level, column, 0));
        }
        if (right && bottom) {
            high = greater(high, (double)vd_heightfield_sample(map, map, level, 0, 0));
        }
    }
    return high;
}

/* The block of a level that holds a cell, and its highest sample. False outside the map. */
static bool block_at(const vd_heightfield *map, int level, int64_t column, int64_t row, block *out,
                     double *high) {
    int64_t left = 0, top = 0, columns = map->width - 1, rows = map->height - 1;
    if (map->wraps != 0) {
        columns = map->width;
        rows = map->height;
        left = floor_divide(column, columns) * columns;
        top = floor_divide(row, rows) * rows;
    }
    const int64_t c = column - left, r = row - top;
    if (c < 0 || r < 0 || c >= columns || r >= rows) {
        return false;
    }
    const int64_t bc = c >> level, br = r >> level, size = (int64_t)1 << level;
    *high = highest_of(map, level, (int)bc, (int)br);
    out->c0 = left + bc * size;
    out->r0 = top + br * size;
    out->c1 = left + (bc * size + size < columns ? bc * size + size : columns);
    out->r1 = top + (br * size + size < rows ? br * size + size : rows);
    return true;
}

/* The corners of a cell that lies in the map. False where one is a hole. */
static bool corners_of(const vd_heightfield *map, int64_t column, int64_t row, double h[4]) {
    int c[2], r[2];
    if (map->wraps != 0) {
        const int64_t width = map->width, height = map->height;
        c[0] = (int)(column - floor_divide(column, width) * width);
        r[0] = (int)(row - floor_divide(row, height) * height);
        c[1] = c[0] + 1 < map->width ? c[0] + 1 : 0;
        r[1] = r[0] + 1 < map->height ? r[0] + 1 : 0;
    } else {
        c[0] = (int)column, c[1] = c[0] + 1;
        r[0] = (int)row, r[1] = r[0] + 1;
    }
    bool whole = true;
    for (int i = 0; i < 4; i++) {
        h[i] = (double)vd_heightfield_at(map, c[i % 2], r[i / 2]);
        whole = whole && isfinite(h[i]);
    }
    return whole;
}

/* The bilinear height at a sample position; −infinity outside the map and in holes. */
static double ground_at(const vd_heightfield *map, double u, double v) {
    int64_t column = (int64_t)floor(u), row = (int64_t)floor(v);
    if (map->wraps == 0) {
        if (!(u >= 0.0 && v >= 0.0 && u <= map->width - 1 && v <= map->height - 1)) {
            return -(double)INFINITY;
        }
        column = column < map->width - 1 ? column : map->width - 2;
        row = row < map->height - 1 ? row : map->height - 2;
        if (column < 0 || row < 0) {
            return -(double)INFINITY;
        }
    }
    double h[4];
    if (!corners_of(map, column, row, h)) {
        return -(double)INFINITY;
    }
    const double a = u - (double)column, b = v - (double)row;
    const double north = h[0] + a * (h[1] - h[0]), south = h[2] + a * (h[3] - h[2]);
    return north + b * (south - north);
}

/* What the ray's height over a cell's surface is least, per metre from the ray's origin, between
 * `begin` and `end`; below 0 where it is under the surface. The height is a parabola in s: 0 or
 * less at an end or at its lowest point, or else over s least at an end or where its slope is that
 * of the line from the origin. */
static double least_clearance(const sun_ray *ray, int64_t column, int64_t row, double begin,
                              double end) {
    double h[4];
    if (!corners_of(ray->map, column, row, h)) {
        return (double)INFINITY;
    }
    const double a = (ray->u - (double)column) + begin * ray->du;
    const double b = (ray->v - (double)row) + begin * ray->dv;
    const double across = h[1] - h[0], along = h[2] - h[0], twist = (h[3] - h[2]) - across;
    const double ground = h[0] + (a * across + (b * along + a * b * twist));
    const double over = (ray->w + begin * ray->dw) - ground;
    const double slope = ray->dw - (ray->du * (across + b * twist) + ray->dv * (along + a * twist));
    const double bend = -(ray->du * ray->dv) * twist;
    if (!(over > 0.0)) {
        return -1.0;
    }
    if (!(end < (double)INFINITY)) {
        return (double)INFINITY; /* straight up */
    }
    const double length = end - begin, last = over + length * (slope + length * bend);
    const double lowest = bend > 0.0 ? -slope / (2.0 * bend) : 0.0;
    if (!(last > 0.0) || (lowest > 0.0 && lowest < length && over + 0.5 * lowest * slope <= 0.0)) {
        return -1.0;
    }
    double least = last / end;
    least = begin > 0.0 && over / begin < least ? over / begin : least;
    const double start = over - begin * (slope - begin * bend); /* the parabola at s = 0 */
    const double touch = bend > 0.0 && start > 0.0 ? sqrt(start / bend) : 0.0;
    if (touch > begin && touch < end) {
        const double there = (slope - 2.0 * begin * bend) + 2.0 * sqrt(start * bend);
        least = there < least ? there : least;
    }
    return least;
}

/* Where the ray leaves a block, and the cell that it enters. */
static double leave(const sun_ray *ray, const block *b, int64_t *column, int64_t *row) {
    const double to_column = ray->du > 0.0   ? ((double)b->c1 - ray->u) / ray->du
                             : ray->du < 0.0 ? ((double)b->c0 - ray->u) / ray->du
                                             : (double)INFINITY;
    const double to_row = ray->dv > 0.0   ? ((double)b->r1 - ray->v) / ray->dv
                          : ray->dv < 0.0 ? ((double)b->r0 - ray->v) / ray->dv
                                          : (double)INFINITY;
    const double s = to_column < to_row ? to_column : to_row;
    if (s == (double)INFINITY) {
        return s;
    }
    /* The cell is counted on, never found again from a rounded place: the ray cannot get stuck. */
    if (to_column <= to_row) {
        const double at = floor(ray->v + s * ray->dv);
        *column = ray->du > 0.0 ? b->c1 : b->c0 - 1;
        *row = at < (double)b->r0 ? b->r0 : at >= (double)b->r1 ? b->r1 - 1 : (int64_t)at;
    } else {
        const double at = floor(ray->u + s * ray->du);
        *row = ray->dv > 0.0 ? b->r1 : b->r0 - 1;
        *column = at < (double)b->c0 ? b->c0 : at >= (double)b->c1 ? b->c1 - 1 : (int64_t)at;
    }
    return s;
}

/* Where the ray comes over the map; false when it never does. Before that nothing hides the sun. */
static bool enter(const sun_ray *ray, double *begin, int64_t *column, int64_t *row) {
    const double place[2] = {ray->u, ray->v}, speed[2] = {ray->du, ray->dv};
    const double last[2] = {ray->map->width - 1, ray->map->height - 1};
    double from = 0.0, to = (double)INFINITY;
    int64_t cell[2];
    for (int i = 0; i < 2 && ray->map->wraps == 0; i++) {
        if (speed[i] != 0.0) {
            const double a = -place[i] / speed[i], b = (last[i] - place[i]) / speed[i];
            from = greater(from, a < b ? a : b);
            to = a < b ? (b < to ? b : to) : (a < to ? a : to);
        } else if (!(place[i] >= 0.0 && place[i] <= last[i])) {
            return false;
        }
    }
    if (!(from <= to) || !isfinite(ray->u) || !isfinite(ray->v)) {
        return false;
    }
    for (int i = 0; i < 2; i++) {
        double at = floor(place[i] + from * speed[i]);
        if (ray->map->wraps == 0) {
            at = at > 0.0 ? (at < last[i] ? at : last[i] - 1.0) : 0.0;
        }
        cell[i] = (int64_t)at;
    }
    *begin = from;
    *column = cell[0];
    *row = cell[1];
    return true;
}

static float follow(const sun_ray *ray) {
    const vd_heightfield *map = ray->map;
    double s = 0.0, share = 1.0;
    int64_t column, row;
    if (!enter(ray, &s, &column, &row)) {
        return 1.0f;
    }
    const double rise = ray->dw - ray->soft; /* of the lower rim of the sun */
    const double repeats = greater(fabs(ray->du) / map->width, fabs(ray->dv) / map->height);
    int level = 0;
    while (s * repeats < MOST_REPEATS) {
        /* A sun lower than its width would dip for ever: then only the ray itself ends it. */
        if ((rise > 0.0 ? ray->w + s * rise : ray->w + s * ray->dw) > (double)map->max) {
            return (float)share;
        }
        block b;
        double high;
        if (!block_at(map, level, column, row, &b, &high)) {
            return (float)share;
        }
        int64_t next_column = column, next_row = row;
        double end = leave(ray, &b, &next_column, &next_row);
        end = end > s ? end : s; /* rounding may put it before */
        const double lowest = ray->w + (rise > 0.0 ? s : end) * rise;
        /* A cell's highest corner, of level 0, is not known: cells are looked at. */
        if (level > 0 && !(lowest > high)) {
            level--;
            continue;
        }
        if (level == 0) {
            const double clear = least_clearance(ray, column, row, s, end) / ray->soft;
            share = clear < share ? clear : share;
            if (share <= 0.0) {
                return 0.0f;
            }
        }
        if (end == (double)INFINITY) {
            return (float)share;
        }
        s = end;
        column = next_column;
        row = next_row;
        level = level + 1 < map->level_count ? level + 1 : level;
    }
    return (float)share;
}

float vd_hill_shade(const vd_heightfield *map, double exaggeration, vd_vec3 sun, vd_vec3 point) {
    const double *m = map->world_from_sample;
    double inverse[6];
    if (!(sun.z > 0.0)) {
        return 0.0f;
    }
    if (!vd_heightfield_invert(m, inverse)) {
        return 1.0f;
    }
    const double x = point.x - m[0], y = point.y - m[3], per_metre = 1.0 / exaggeration;
    sun_ray ray = {.map = map};
    ray.u = inverse[1] * x + inverse[2] * y;
    ray.v = inverse[4] * x + inverse[5] * y;
    ray.du = inverse[1] * sun.x + inverse[2] * sun.y;
    ray.dv = inverse[4] * sun.x + inverse[5] * sun.y;
    ray.dw = sun.z * per_metre;
    ray.soft = VD_SUN_WIDTH * per_metre;
    const double cell = sqrt(fabs(m[1] * m[5] - m[2] * m[4]));
    const double ground = ground_at(map, ray.u, ray.v) + 0.001 * cell * per_metre;
    ray.w = greater(point.z * per_metre, ground);
    return follow(&ray);
}

vd_hill_shade_kind vd_hill_shade_box(const vd_heightfield *map, double exaggeration, vd_vec3 sun,
                                     vd_vec3 min, vd_vec3 max, float *least, float *most) {
    const vd_vec3 middle = vd_vec3_scale(vd_vec3_add(min, max), 0.5);
    float low = 1.0f, high = 0.0f;
    for (int i = 0; i < 10; i++) {
        vd_vec3 at = {(i & 1) != 0 ? max.x : min.x, (i & 2) != 0 ? max.y : min.y,
                      (i & 4) != 0 ? max.z : min.z};
        if (i >= 8) {
            at = vd_vec3_make(middle.x, middle.y, i == 8 ? middle.z : min.z);
        }
        const float share = vd_hill_shade(map, exaggeration, sun, at);
        low = share < low ? share : low;
        high = share > high ? share : high;
    }
    *least = low;
    *most = high;
    return low >= 1.0f    ? VD_HILL_SHADE_LIT
           : high <= 0.0f ? VD_HILL_SHADE_DARK
                          : VD_HILL_SHADE_MIXED;
}
