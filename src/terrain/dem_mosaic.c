/* dem_mosaic.c: several DEMs of one grid joined into one. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "core/core.h"
#include "terrain/dem_internal.h"

/* How far samples of two parts that should coincide may lie apart, in cells. */
static const double tolerance_cells = 0.01;

/* The most samples a union may have for each that the parts have, per part. Tiles of one size that
 * touch each other need at most 1 per part, in a chain along the diagonal; two tiles may lie some
 * ten of their sides apart. */
static const double sparseness_per_part = 32.0;

/* A part on the common grid: north row first, west column first. */
typedef struct placed_part {
    double x, y;           /* of the north-west sample */
    double dx, dy;         /* cell size, positive */
    bool mirrored, turned; /* stored east to west, south to north */
    int64_t column, row;   /* of the north-west sample in the union */
} placed_part;

static vd_status refuse(int index, int count, const char *why) {
    return vd_failure(VD_ERROR_UNSUPPORTED,
                      "cannot join the elevation files: number %d of %d %s; warp it to the grid of "
                      "the first (with GDAL this happens by itself)",
                      index + 1, count, why);
}

static placed_part place(const vd_dem *dem) {
    const double *t = dem->transform;
    placed_part part = {.dx = fabs(t[1]), .dy = fabs(t[5])};
    part.mirrored = t[1] < 0.0;
    part.turned = t[5] > 0.0;
    part.x = part.mirrored ? t[0] + (dem->width - 1) * t[1] : t[0];
    part.y = part.turned ? t[3] + (dem->height - 1) * t[5] : t[3];
    return part;
}

/* x of the middle, in CRS units. */
static double middle_x(const placed_part *part, const vd_dem *dem) {
    return part->x + 0.5 * (dem->width - 1) * part->dx;
}

static bool same_crs(const vd_dem *a, const vd_dem *b) {
    bool same_name = !a->crs || !b->crs || strcmp(a->crs, b->crs) == 0;
    return a->kind == b->kind && a->crs_unit_m == b->crs_unit_m && same_name;
}

/* Checks one part against the first and finds its whole-cell offset from it. */
static vd_status align(const vd_dem *const *parts, int count, int index, placed_part *placed) {
    const vd_dem *dem = parts[index];
    const double *t = dem->transform;
    const placed_part *first = &placed[0];
    placed_part *part = &placed[index];
    if (t[2] != 0.0 || t[4] != 0.0) {
        return refuse(index, count, "is rotated");
    }
    if (dem->kind == VD_CRS_NONE) {
        return refuse(index, count, "does not say where it lies");
    }
    if (!same_crs(parts[0], dem)) {
        return refuse(index, count, "has another coordinate system than the first");
    }
    *part = place(dem);
    if (!(part->dx > 0.0) || !(part->dy > 0.0) ||
        !(fabs(part->dx - first->dx) * dem->width <= tolerance_cells * first->dx) ||
        !(fabs(part->dy - first->dy) * dem->height <= tolerance_cells * first->dy)) {
        return refuse(index, count, "has another cell size than the first");
    }
    if (dem->kind == VD_CRS_GEOGRAPHIC) {
        /* Tiles on both sides of the date line, or in 0 … 360°, meet on the shorter way round. */
        double apart = middle_x(part, dem) - middle_x(first, parts[0]);
        part->x -= 360.0 * floor(apart / 360.0 + 0.5);
    }
    double column = (part->x - first->x) / first->dx, row = (first->y - part->y) / first->dy;
    if (!(fabs(column) < 1e9) || !(fabs(row) < 1e9)) {
        return refuse(index, count, "lies too far from the first");
    }
    part->column = (int64_t)floor(column + 0.5);
    part->row = (int64_t)floor(row + 0.5);
    if (fabs(column - (double)part->column) > tolerance_cells ||
        fabs(row - (double)part->row) > tolerance_cells) {
        return refuse(index, count, "lies between the samples of the first");
    }
    return vd_success();
}

/* Copies a part's samples to where the union has none yet. */
static void paste(const vd_dem *part, const placed_part *placed, vd_dem *out) {
    for (int row = 0; row < part->height; row++) {
        int from_row = placed->turned ? part->height - 1 - row : row;
        const float *from = part->heights + (size_t)from_row * part->stride;
        float *to = out->heights + (size_t)(placed->row + row) * out->stride + placed->column;
        for (int column = 0; column < part->width; column++) {
            if (isnan(to[column])) {
                to[column] = from[placed->mirrored ? part->width - 1 - column : column];
            }
        }
    }
}

static vd_status describe(const vd_dem *const *parts, int count, vd_dem *out) {
    const vd_dem *first = parts[0];
    out->kind = first->kind;
    out->crs_unit_m = first->crs_unit_m;
    snprintf(out->height_type, sizeof out->height_type, "%s", first->height_type);
    snprintf(out->height_unit, sizeof out->height_unit, "%s", first->height_unit);
    for (int i = 0; i < count; i++) {
        if (strcmp(parts[i]->height_type, first->height_type) != 0) {
            snprintf(out->height_type, sizeof out->height_type, "mixed");
        }
        if (parts[i]->crs && !out->crs) {
            out->crs = vd_copy_string(out->context, parts[i]->crs);
            if (!out->crs) {
                return vd_out_of_memory("a coordinate system's name", strlen(parts[i]->crs) + 1);
            }
        }
    }
    return vd_success();
}

/* A single rotated DEM, or one without a place, is its own mosaic. */
static vd_status copy_one(vd_context *context, const vd_dem *part, vd_dem **out) {
    vd_dem *dem = NULL;
    vd_status status = vd_dem_create(context, part->width, part->height, &dem);
    if (status.code == VD_OK) {
        status = describe(&part, 1, dem);
    }
    if (status.code != VD_OK) {
        vd_dem_destroy(&dem);
        return status;
    }
    memcpy(dem->transform, part->transform, sizeof dem->transform);
    const placed_part whole = {.column = 0};
    paste(part, &whole, dem);
    vd_dem_update_range(dem);
    *out = dem;
    return vd_success();
}

/* The union of the parts, in samples from the first one's north-west sample. */
typedef struct span {
    int64_t west, north, east, south;
} span;

static vd_status check_span(const span *all, const vd_dem *const *parts, int count,
                            const placed_part *placed) {
    const long long columns = all->east - all->west, rows = all->south - all->north;
    double held = 0.0;
    int farthest = 0;
    int64_t farthest_samples = -1;
    for (int i = 0; i < count; i++) {
        held += (double)parts[i]->width * (double)parts[i]->height;
        int64_t away = llabs(placed[i].column) + llabs(placed[i].row);
        if (away > farthest_samples) {
            farthest = i;
            farthest_samples = away;
        }
    }
    double sparseness = (double)columns * (double)rows / held;
    if (sparseness > sparseness_per_part * count) {
        return vd_failure(VD_ERROR_LIMIT,
                          "cannot join the elevation files: number %d of %d lies far from the "
                          "first: together they span %lld × %lld samples, %.0f times as many as "
                          "they hold; render them one by one",
                          farthest + 1, count, columns, rows, sparseness);
    }
    if (columns > VD_MAX_SIDE || rows > VD_MAX_SIDE) {
        return vd_failure(
            VD_ERROR_LIMIT,
            "cannot join the elevation files: together they span %lld × %lld samples, "
            "more than %d a side; give fewer, closer together",
            columns, rows, VD_MAX_SIDE);
    }
    return vd_success();
}

static vd_status join(vd_context *context, const vd_dem *const *parts, int count,
                      placed_part *placed, vd_dem **out) {
    span all = {.west = 0};
    placed[0] = place(parts[0]);
    for (int i = 0; i < count; i++) {
        vd_status status = align(parts, count, i, placed);
        if (status.code != VD_OK) {
            return status;
        }
        const placed_part *part = &placed[i];
        int64_t east = part->column + parts[i]->width, south = part->row + parts[i]->height;
        all.west = part->column < all.west ? part->column : all.west;
        all.north = part->row < all.north ? part->row : all.north;
        all.east = east > all.east ? east : all.east;
        all.south = south > all.south ? south : all.south;
    }
    vd_status status = check_span(&all, parts, count, placed);
    if (status.code != VD_OK) {
        return status;
    }
    vd_dem *dem = NULL;
    status = vd_dem_create(context, (int)(all.east - all.west), (int)(all.south - all.north), &dem);
    if (status.code == VD_OK) {
        status = describe(parts, count, dem);
    }
    if (status.code != VD_OK) {
        vd_dem_destroy(&dem);
        return status;
    }
    for (int i = 0; i < count; i++) {
        placed[i].column -= all.west;
        placed[i].row -= all.north;
        paste(parts[i], &placed[i], dem);
    }
    dem->transform[0] = placed[0].x + (double)all.west * placed[0].dx;
    dem->transform[1] = placed[0].dx;
    dem->transform[3] = placed[0].y - (double)all.north * placed[0].dy;
    dem->transform[5] = -placed[0].dy;
    vd_dem_update_range(dem);
    *out = dem;
    return vd_success();
}

vd_status vd_dem_mosaic(vd_context *context, const vd_dem *const *parts, int count, vd_dem **out) {
    if (!context || !parts || count < 1 || !out) {
        return vd_failure(VD_ERROR_ARGUMENT, "vd_dem_mosaic: at least one part is needed");
    }
    for (int i = 0; i < count; i++) {
        if (!parts[i]) {
            return vd_failure(VD_ERROR_ARGUMENT, "vd_dem_mosaic: part %d must not be null", i);
        }
    }
    const double *t = parts[0]->transform;
    if (count == 1 && (parts[0]->kind == VD_CRS_NONE || t[2] != 0.0 || t[4] != 0.0)) {
        return copy_one(context, parts[0], out);
    }
    placed_part *placed = vd_allocate_zero(context, (size_t)count, sizeof *placed);
    if (!placed) {
        return vd_out_of_memory("the places of the parts", (size_t)count * sizeof *placed);
    }
    vd_status status = join(context, parts, count, placed, out);
    vd_release(context, placed);
    return status;
}
