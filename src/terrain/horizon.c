/* horizon.c: walls, slopes, and what stands behind them; see horizon.h. */
#include "terrain/horizon_map.h"

#include <math.h>
#include <string.h>
#include "core/core.h"
#include "core/real.h"
#include "terrain/heightfield_block.h"

#define BUCKETS 256      /* of headings, over the view's spread */
#define DISTANCES 64     /* at which slopes are kept, logarithmic */
#define CHUNK 8          /* buckets a task */
#define STRIDE_STEPS 8   /* walls that are passed by at once when they cannot matter */
#define LEAST_STEP 0.004 /* of the distance, from wall to wall */
#define CELL_STEP 1.0    /* of a cell's side, at least */
/* What a picture's floats do not tell apart: positions, of the map's width; slopes, 1/64 pixel at
 * 1,000 pixels a radian. */
#define POSITION_MARGIN 0x1p-20
#define SLOPE_MARGIN 1.6e-5

struct vd_horizon {
    vd_context *context;
    bool aimed;
    vd_horizon_view view;
    double distance[DISTANCES]; /* metres, horizontal */
    float entry[BUCKETS];       /* lines of sight must be above this */
    float slope[BUCKETS][DISTANCES];
};

/* ---- a bucket's ground ----------------------------------------------------------------------- */

typedef struct aiming {
    vd_horizon *horizon;
    const vd_horizon_map *map;
    double from_world[6]; /* samples from metres, relative to sample (0, 0) */
    double u, v;          /* the eye, in samples */
    double cell;          /* metres, the side of a cell's square */
    double ground;        /* under the eye, exaggerated; −infinity: none */
    double depth;         /* between the eye's height and any ground's, at most */
    double begin, end;    /* distances of the first wall, and beyond all ground */
    bool before_map;      /* nothing of the map is nearer than `begin` */
    double ratio;         /* from wall to wall, of the distance */
    double flat;          /* the nearest point of a wall, of its distance */
    double margin;        /* samples */
} aiming;

/* The headings between which a bucket lies, as samples a metre. */
typedef struct bucket {
    double du[2], dv[2];
} bucket;

static double drop_at(const aiming *a, double distance) {
    return a->horizon->view.curvature ? vd_curvature_drop(distance) : 0.0;
}

/* Samples that a mean of coarser ground reaches beyond the place: level n is drawn from a distance
 * of 2^n·cell·focal on, and reaches over less than 2^(n+1) samples. */
static double widening(const aiming *a, double distance) {
    const vd_horizon_view *view = &a->horizon->view;
    if (!(view->focal_px > 0.0)) {
        return 0.0;
    }
    const double deep = a->depth + drop_at(a, distance);
    const double coarse =
        sqrt(distance * distance + deep * deep) / (a->cell * view->focal_px) * 1.001;
    return coarse < 2.0 ? 0.0 : 2.0 * coarse;
}

/* What lies between two walls, or on one (both the same), or between the eye and one (from 0). */
typedef struct strip {
    double u0, u1, v0, v1; /* around it, in samples */
    vd_cells cells;        /* all that its ground depends on; where any */
    bool whole;            /* it lies on the map */
    bool nothing;          /* it lies beside the map */
} strip;

static strip strip_between(const aiming *a, const bucket *b, double from, double to) {
    const vd_horizon_map *map = a->map;
    double u0 = INFINITY, u1 = -INFINITY, v0 = INFINITY, v1 = -INFINITY;
    for (int i = 0; i < 4; i++) {
        const double t = i & 1 ? to : from;
        const double u = a->u + t * b->du[i >> 1], v = a->v + t * b->dv[i >> 1];
        u0 = u < u0 ? u : u0;
        u1 = u > u1 ? u : u1;
        v0 = v < v0 ? v : v0;
        v1 = v > v1 ? v : v1;
    }
    const double wide = a->margin + widening(a, to);
    strip s = {.u0 = u0, .u1 = u1, .v0 = v0, .v1 = v1};
    /* The map is convex, and so is the strip: its corners tell. */
    s.whole = u0 >= map->column + a->margin && u1 <= map->column_end - a->margin &&
              v0 >= map->row + a->margin && v1 <= map->row_end - a->margin;
    u0 = floor(u0 - wide), u1 = floor(u1 + wide);
    v0 = floor(v0 - wide), v1 = floor(v1 + wide);
    s.nothing = u1 < map->column || u0 >= map->column_end || v1 < map->row || v0 >= map->row_end;
    if (s.nothing) {
        return s;
    }
    /* Means do reach beyond a window, but not beyond the map. */
    const int last_c = map->field->width - 2, last_r = map->field->height - 2;
    s.cells.c0 = u0 > 0.0 ? (int)u0 : 0;
    s.cells.r0 = v0 > 0.0 ? (int)v0 : 0;
    s.cells.c1 = u1 < last_c ? (int)u1 : last_c;
    s.cells.r1 = v1 < last_r ? (int)v1 : last_r;
    return s;
}

/* The steepest line of sight that meets ground of at most `height` between two distances. */
static double slope_over(const aiming *a, double height, double from, double to) {
    const double rise = height * a->horizon->view.exaggeration - a->horizon->view.eye.z -
                        drop_at(a, from * a->flat);
    return (rise >= 0.0 ? rise / (from * a->flat) : rise / to);
}

/* The flattest line of sight that meets a wall of at least `height`. */
static double slope_of_wall(const aiming *a, double height, double distance) {
    const double rise =
        height * a->horizon->view.exaggeration - a->horizon->view.eye.z - drop_at(a, distance);
    return rise >= 0.0 ? rise / distance : rise / (distance * a->flat);
}

/* ---- walking out ----------------------------------------------------------------------------- */

/* A bucket on its way from wall to wall. */
typedef struct walk {
    double t;     /* the last wall */
    double best;  /* the steepest of all walls so far */
    double entry; /* the slope over all ground before it began */
    bool begun;   /* lines of sight above `entry` are in the air, and on the map */
    bool ended;
    int kept; /* distances whose slope is written */
} walk;

static void keep_up_to(const aiming *a, int index, walk *w, double distance) {
    while (w->kept < DISTANCES && a->horizon->distance[w->kept] < distance) {
        a->horizon->slope[index][w->kept++] = (float)w->best;
    }
}

/* The surface of a cell at a place within it. */
static double surface_at(const vd_heightfield *h, int column, int row, double u, double v) {
    const double h00 = (double)vd_heightfield_at(h, column, row);
    const double h10 = (double)vd_heightfield_at(h, column + 1, row);
    const double h01 = (double)vd_heightfield_at(h, column, row + 1);
    const double h11 = (double)vd_heightfield_at(h, column + 1, row + 1);
    const double x = u - column, y = v - row;
    return (h00 + x * (h10 - h00)) * (1.0 - y) + (h01 + x * (h11 - h01)) * y;
}

static double clamp(double x, double low, double high) {
    return x < low ? low : x > high ? high : x;
}

/* How high the ground gets up to near_m from the eye, at most; `high` when that is not near. What
 * is bilinear is highest at a corner of a rectangle. */
static double highest_near(const aiming *a, const bucket *b, double high) {
    const double to = a->horizon->view.near_m / a->flat;
    const strip near = strip_between(a, b, 0.0, to);
    const vd_cells in = near.cells;
    if (widening(a, to) > 0.0 || in.c1 - in.c0 > VD_HORIZON_DIRECT ||
        in.r1 - in.r0 > VD_HORIZON_DIRECT) {
        return high;
    }
    double most = -INFINITY;
    for (int r = in.r0; r <= in.r1; r++) {
        for (int c = in.c0; c <= in.c1; c++) {
            for (int i = 0; i < 4; i++) {
                const double u = i & 1 ? near.u1 + a->margin : near.u0 - a->margin;
                const double v = i & 2 ? near.v1 + a->margin : near.v0 - a->margin;
                const double up =
                    surface_at(a->map->field, c, r, clamp(u, c, c + 1.0), clamp(v, r, r + 1.0));
                most = up > most ? up : most;
            }
        }
    }
    return most;
}

/* The ground between the eye and the first wall. */
static void walk_first(const aiming *a, const bucket *b, walk *w) {
    const vd_horizon_view *view = &a->horizon->view;
    w->t = a->begin;
    if (a->before_map) {
        return;
    }
    const strip s = strip_between(a, b, 0.0, a->begin);
    if (s.nothing) {
        return;
    }
    double high = (double)vd_horizon_highest(a->map, s.cells);
    w->begun = s.whole && a->ground > -INFINITY && vd_horizon_lowest(a->map, s.cells) > -INFINITY;
    if (w->begun && !(view->near_m > 0.0)) {
        return; /* every line of sight begins in the air */
    }
    high = w->begun ? highest_near(a, b, high) : high;
    /* Over all of that ground as far as it is not drawn, or may have a gap. */
    const double rise = high * view->exaggeration - view->eye.z;
    const double by = w->begun ? view->near_m : a->begin;
    w->entry = rise < 0.0 ? rise / by : high > -INFINITY ? INFINITY : -INFINITY;
}

/* Passes by several walls at once when no ground up to the last of them is above the horizon. */
static bool walk_far(const aiming *a, const bucket *b, walk *w) {
    if (!w->begun || !(w->best > -INFINITY)) {
        return false;
    }
    double to = w->t;
    for (int i = 0; i < STRIDE_STEPS; i++) {
        const double step = a->ratio * to;
        to += step > CELL_STEP * a->cell ? step : CELL_STEP * a->cell;
    }
    const strip s = strip_between(a, b, w->t, to);
    if (!s.nothing &&
        slope_over(a, (double)vd_horizon_highest(a->map, s.cells), w->t, to) > w->best) {
        return false;
    }
    w->t = to;
    return true;
}

/* Ground with a gap, or beside the map: lines of sight begin after it, or end before it. */
static void walk_gap(const aiming *a, const strip *between, double from, walk *w) {
    w->ended = w->begun || w->t > a->end;
    if (!w->begun && !between->nothing) {
        const double high = (double)vd_horizon_highest(a->map, between->cells);
        const double over = slope_over(a, high, from, w->t);
        w->entry = over > w->entry ? over : w->entry;
    }
}

static void walk_on(const aiming *a, const bucket *b, int index, walk *w) {
    const double from = w->t, step = a->ratio * from;
    w->t += step > CELL_STEP * a->cell ? step : CELL_STEP * a->cell;
    const strip wall = strip_between(a, b, w->t, w->t);
    const bool holes = a->map->field->holes > 0;
    if (!wall.whole || !w->begun || holes) {
        const strip between = strip_between(a, b, from, w->t);
        if (!between.whole || (holes && !(vd_horizon_lowest(a->map, between.cells) > -INFINITY))) {
            walk_gap(a, &between, from, w);
            return;
        }
    }
    w->begun = true;
    keep_up_to(a, index, w, w->t); /* what is nearer than this wall */
    const double slope = slope_of_wall(a, (double)vd_horizon_lowest(a->map, wall.cells), w->t);
    w->best = slope > w->best ? slope : w->best;
}

static void aim_bucket(const aiming *a, int index) {
    vd_horizon *horizon = a->horizon;
    const vd_horizon_view *view = &horizon->view;
    bucket b;
    for (int i = 0; i < 2; i++) {
        const double heading =
            view->heading_rad + view->spread_rad * ((index + i) / (double)BUCKETS - 0.5);
        const double x = vd_sin(heading), y = vd_cos(heading);
        b.du[i] = a->from_world[1] * x + a->from_world[2] * y;
        b.dv[i] = a->from_world[4] * x + a->from_world[5] * y;
    }
    walk w = {.best = -INFINITY, .entry = -INFINITY};
    walk_first(a, &b, &w);
    while (!w.ended && w.t < a->end && w.entry < INFINITY) {
        const bool far = walk_far(a, &b, &w);
        for (int i = 0; !far && i < STRIDE_STEPS && !w.ended; i++) {
            walk_on(a, &b, index, &w);
        }
    }
    keep_up_to(a, index, &w, INFINITY);
    horizon->entry[index] = (float)w.entry;
}

static void aim_chunk(void *user, int index, int worker) {
    (void)worker;
    for (int i = 0; i < CHUNK; i++) {
        aim_bucket(user, index * CHUNK + i);
    }
}

/* ---- aiming ---------------------------------------------------------------------------------- */

/* The distance of a point at the origin from a segment. */
static double distance_to_segment(double ax, double ay, double bx, double by) {
    const double dx = bx - ax, dy = by - ay, length = dx * dx + dy * dy;
    double s = length > 0.0 ? -(ax * dx + ay * dy) / length : 0.0;
    s = s < 0.0 ? 0.0 : s > 1.0 ? 1.0 : s;
    const double x = ax + s * dx, y = ay + s * dy;
    return sqrt(x * x + y * y);
}

/* Nearest and farthest distance of the window's outline from the eye. */
static void outline_distances(const aiming *a, double *nearest, double *farthest) {
    static const int next[5][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}};
    const vd_horizon_map *map = a->map;
    const double *m = map->field->world_from_sample;
    const vd_vec3 eye = a->horizon->view.eye;
    double x[5], y[5];
    *nearest = INFINITY;
    *farthest = 0.0;
    for (int i = 0; i < 5; i++) {
        const double c = next[i][0] ? map->column_end : map->column;
        const double r = next[i][1] ? map->row_end : map->row;
        x[i] = m[0] - eye.x + c * m[1] + r * m[2];
        y[i] = m[3] - eye.y + c * m[4] + r * m[5];
        const double far = sqrt(x[i] * x[i] + y[i] * y[i]);
        *farthest = far > *farthest ? far : *farthest;
        if (i > 0) {
            const double near = distance_to_segment(x[i - 1], y[i - 1], x[i], y[i]);
            *nearest = near < *nearest ? near : *nearest;
        }
    }
}

/* Fills the rest of `a`; false when nothing can be hidden. */
static bool prepare(aiming *a) {
    const vd_horizon_view *view = &a->horizon->view;
    const vd_heightfield *h = a->map->field;
    const double *m = h->world_from_sample;
    if (!(view->spread_rad > 0.0) || h->width < 2 || h->height < 2 ||
        !vd_heightfield_invert(m, a->from_world)) {
        return false;
    }
    const double x = view->eye.x - m[0], y = view->eye.y - m[3], *inverse = a->from_world;
    a->u = inverse[1] * x + inverse[2] * y;
    a->v = inverse[4] * x + inverse[5] * y;
    const bool over = a->u >= a->map->column && a->u <= a->map->column_end && a->v >= a->map->row &&
                      a->v <= a->map->row_end;
    a->ground = over && !h->wraps
                    ? view->exaggeration * vd_heightfield_height_at(h, view->eye.x, view->eye.y)
                    : -(double)INFINITY;
    if (a->ground >= view->eye.z) {
        return false; /* lines of sight begin in the ground */
    }
    const double below = fabs(view->eye.z - (double)h->min * view->exaggeration);
    const double above = fabs((double)h->max * view->exaggeration - view->eye.z);
    a->depth = below > above ? below : above;
    a->margin = POSITION_MARGIN * (h->width > h->height ? h->width : h->height) + 1e-6;
    a->cell = sqrt(fabs(m[1] * m[5] - m[2] * m[4]));
    double nearest;
    outline_distances(a, &nearest, &a->end);
    a->begin = view->near_m > CELL_STEP * a->cell ? view->near_m : CELL_STEP * a->cell;
    const double outside = 0.999 * nearest - a->cell - widening(a, nearest) * a->cell;
    a->before_map = !over && outside > a->begin;
    a->begin = a->before_map ? outside : a->begin;
    const double width = view->spread_rad / BUCKETS;
    a->ratio = width > LEAST_STEP ? width : LEAST_STEP;
    a->flat = vd_cos(0.5 * width) * (1.0 - 1e-12);
    return a->begin < a->end && isfinite(a->end) && isfinite(a->depth);
}

vd_status vd_horizon_aim(vd_horizon *horizon, vd_job *job, const vd_horizon_map *map,
                         const vd_horizon_view *view) {
    horizon->aimed = false;
    horizon->view = *view;
    if (view->spread_rad > 2.0 * VD_PI) {
        horizon->view.spread_rad = 2.0 * VD_PI;
    }
    aiming a = {.horizon = horizon, .map = map};
    if (!prepare(&a)) {
        return vd_success();
    }
    const double doublings = vd_log2(a.end / a.begin) / (DISTANCES - 1);
    for (int i = 0; i < DISTANCES; i++) {
        horizon->distance[i] = a.begin * vd_exp(0.6931471805599453 * doublings * i);
    }
    const vd_status status = vd_parallel_for(horizon->context, job, BUCKETS / CHUNK, aim_chunk, &a);
    horizon->aimed = status.code == VD_OK;
    return status;
}

vd_status vd_horizon_create(vd_context *context, vd_horizon **out) {
    vd_horizon *horizon = vd_allocate_zero(context, 1, sizeof *horizon);
    if (horizon == NULL) {
        return vd_out_of_memory("the horizon", sizeof *horizon);
    }
    horizon->context = context;
    *out = horizon;
    return vd_success();
}

void vd_horizon_destroy(vd_horizon **horizon) {
    if (*horizon != NULL) {
        vd_release((*horizon)->context, *horizon);
        *horizon = NULL;
    }
}

/* ---- a picture's view ------------------------------------------------------------------------ */

static double turn_of(double angle) {
    return angle - 2.0 * VD_PI * floor(angle / (2.0 * VD_PI) + 0.5);
}

void vd_horizon_view_of(const vd_terrain_def *def, const vd_camera *camera, int width, int height,
                        vd_horizon_view *out) {
    vd_horizon_view view = {.eye = camera->eye,
                            .focal_px = def->mip ? sqrt(camera->lens.fx * camera->lens.fy) : 0.0,
                            .exaggeration = def->exaggeration,
                            .curvature = def->curvature};
    if (camera->projection != VD_PROJECTION_PERSPECTIVE) {
        *out = view;
        return;
    }
    const vd_vec3 middle = vd_camera_ray(camera, 0.5 * width, 0.5 * height).direction;
    view.heading_rad = vd_atan2(middle.x, middle.y);
    double left = 0.0, right = 0.0;
    for (int i = 0; i < 4; i++) {
        const vd_vec3 corner =
            vd_camera_ray(camera, i & 1 ? width : 0, i & 2 ? height : 0).direction;
        const double turn = turn_of(vd_atan2(corner.x, corner.y) - view.heading_rad);
        left = turn < left ? turn : left;
        right = turn > right ? turn : right;
        const double near = camera->near_m * vd_vec3_length(corner);
        view.near_m = near > view.near_m ? near : view.near_m;
    }
    /* Unless straight up or down is in the picture, its headings are between its corners'. */
    const vd_frustum frustum = vd_camera_frustum(camera, width, height);
    bool up = true, down = true;
    for (int i = 0; i < 4; i++) {
        up = up && frustum.planes[i].normal.z >= -1e-9;
        down = down && frustum.planes[i].normal.z <= 1e-9;
    }
    view.heading_rad += 0.5 * (left + right);
    view.spread_rad = up || down ? 2.0 * VD_PI : right - left + 1e-9;
    *out = view;
}

/* ---- asking ---------------------------------------------------------------------------------- */

/* Slopes between which all lines of sight to a box are, and the headings around it. */
typedef struct sight {
    double nearest, steepest, flattest;
    double from, to; /* headings, from the middle of the view's; to − from < π */
} sight;

/* False when the eye stands over or under the box. */
static bool sight_of(const vd_horizon_view *view, vd_vec3 min, vd_vec3 max, sight *out) {
    const double x[2] = {min.x - view->eye.x, max.x - view->eye.x};
    const double y[2] = {min.y - view->eye.y, max.y - view->eye.y};
    const double near_x = x[0] > 0.0 ? x[0] : x[1] < 0.0 ? x[1] : 0.0;
    const double near_y = y[0] > 0.0 ? y[0] : y[1] < 0.0 ? y[1] : 0.0;
    const double far_x = fabs(x[0]) > fabs(x[1]) ? x[0] : x[1];
    const double far_y = fabs(y[0]) > fabs(y[1]) ? y[0] : y[1];
    const double nearest = sqrt(near_x * near_x + near_y * near_y);
    const double farthest = sqrt(far_x * far_x + far_y * far_y);
    const double top = max.z - view->eye.z, bottom = min.z - view->eye.z;
    if (!(nearest > 0.0) || !(farthest < INFINITY) || !isfinite(top) || !isfinite(bottom)) {
        return false;
    }
    out->nearest = nearest;
    out->steepest = top / (top >= 0.0 ? nearest : farthest);
    out->flattest = bottom / (bottom >= 0.0 ? farthest : nearest);
    const double middle = vd_atan2(0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1]));
    double from = 0.0, to = 0.0;
    for (int i = 0; i < 4; i++) {
        const double turn = turn_of(vd_atan2(x[i & 1], y[i >> 1]) - middle);
        from = turn < from ? turn : from;
        to = turn > to ? turn : to;
    }
    const double place = turn_of(middle - view->heading_rad);
    out->from = place + from - 1e-9;
    out->to = place + to + 1e-9;
    return true;
}

/* The last distance that is at most `nearest`; −1: none. */
static int last_distance(const vd_horizon *horizon, double nearest) {
    int low = -1, high = DISTANCES; /* distance[low] <= nearest < distance[high] */
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (horizon->distance[middle] <= nearest) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

bool vd_horizon_hides(const vd_horizon *horizon, vd_vec3 min, vd_vec3 max) {
    sight s;
    if (!horizon->aimed || !sight_of(&horizon->view, min, max, &s)) {
        return false;
    }
    const int at = last_distance(horizon, s.nearest * (1.0 - 1e-9));
    if (at < 0) {
        return false;
    }
    const double steepest = s.steepest + SLOPE_MARGIN * (1.0 + fabs(s.steepest));
    const double flattest = s.flattest - SLOPE_MARGIN * (1.0 + fabs(s.flattest));
    const double spread = horizon->view.spread_rad, a_bucket = BUCKETS / spread;
    bool judged = false;
    /* A heading is also a heading a turn away. */
    for (int turn = -1; turn <= 1; turn++) {
        const double shift = 2.0 * VD_PI * turn + 0.5 * spread;
        const double first = floor((s.from + shift) * a_bucket);
        const double last = floor((s.to + shift) * a_bucket);
        const int b0 = first > 0.0 ? first < BUCKETS ? (int)first : BUCKETS : 0;
        const int b1 = last < BUCKETS - 1 ? last < 0.0 ? -1 : (int)last : BUCKETS - 1;
        for (int b = b0; b <= b1; b++) {
            if (!((double)horizon->entry[b] < flattest) ||
                !((double)horizon->slope[b][at] > steepest)) {
                return false;
            }
            judged = true;
        }
    }
    return judged;
}
