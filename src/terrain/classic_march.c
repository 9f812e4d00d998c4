/* classic_march.c: the renderer behind the method "march": what it keeps from picture to picture,
 * and which of its ways a picture takes.
 *
 *     growth or few slices ──► sweep    every slice, 16 columns at once, until nothing can be seen
 *     else                 ──► march    cells of the pyramid (classic_march.inl)
 *     out of safe range    ──► columns  classic_columns.c
 *
 * Safe is what both kernels can compute in float without saturating, rounding a whole number or
 * losing small bits: map positions below 2^22, slice numbers below 2^23, rises in float's normal
 * range, nothing but 0 that is tiny: positions are sums of numbers that are 0 or at least 2^−80, so
 * they are multiples of 2^−104, and 2^−15 of one is still a normal float.
 */
#include <float.h>
#include <math.h>
#include <string.h>
#include "core/core.h"
#include "terrain/classic_march.h"

#define MAX_POSITION 0x1p22
#define MIN_NUMBER 0x1p-60
#define MIN_Z0 0x1p-20
#define MAX_SLICES (1u << 23)
#define MAX_SWEEP_SLICES (1u << 20)

/* Heights of a map, maxima included, that are fetched ahead: more than a second cache holds. */
#define AHEAD_MAP_BYTES ((size_t)4 << 20)

/* Below this many slices a constant schedule is swept. */
#define FEW_SLICES 256

struct vd_classic_renderer {
    vd_context *context;
    const vd_heightfield *heightfield;
    vd_march_map map;
    const vd_march_kernels *kernels;
    int threads;
    vd_march_scratch *workers;
    size_t columns, tile_pixels, depth_pixels, slices; /* what the arrays below have room for */
    float *directions;                                 /* [2][columns] */
    float *slice_z, *slice_rise;                       /* [slices] */
};

const vd_march_kernels *vd_march_kernels_for(vd_isa isa) {
#if defined(__x86_64__)
    return isa == VD_ISA_V4   ? &vd_march_kernels_v4
           : isa == VD_ISA_V3 ? &vd_march_kernels_v3
                              : &vd_march_kernels_v2;
#else
    (void)isa;
    return &vd_march_kernels_v2;
#endif
}

static vd_status create(vd_context *context, const vd_heightfield *map, vd_classic_renderer **out) {
    vd_classic_renderer *renderer = vd_allocate_zero(context, 1, sizeof *renderer);
    if (renderer == NULL) {
        return vd_out_of_memory("a renderer", sizeof *renderer);
    }
    renderer->context = context;
    renderer->heightfield = map;
    renderer->kernels = vd_march_kernels_for(vd_context_isa(context));
    renderer->threads = vd_context_threads(context);
    size_t threads = (size_t)renderer->threads;
    renderer->workers = vd_allocate_zero(context, threads, sizeof *renderer->workers);
    vd_status status =
        renderer->workers == NULL
            ? vd_out_of_memory("the renderer's workers", threads * sizeof *renderer->workers)
            : vd_march_map_init(context, map, &renderer->map);
    if (status.code != VD_OK) {
        vd_classic_renderer_destroy(&renderer);
        return status;
    }
    *out = renderer;
    return status;
}

vd_status vd_classic_renderer_create(vd_context *context, const vd_heightfield *map,
                                     vd_classic_renderer **out) {
    if (context == NULL || map == NULL || out == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "classic: a renderer needs a context, a map and a place to put it");
    }
    vd_status status = vd_classic_check_map(map);
    return status.code == VD_OK ? create(context, map, out) : status;
}

void vd_classic_renderer_use(vd_classic_renderer *renderer, const vd_march_kernels *kernels) {
    renderer->kernels = kernels;
}

static void release_tiles(vd_classic_renderer *renderer) {
    for (int i = 0; i < renderer->threads && renderer->workers != NULL; i++) {
        vd_release(renderer->context, renderer->workers[i].tiles);
        vd_release(renderer->context, renderer->workers[i].depths);
        renderer->workers[i].tiles = NULL;
        renderer->workers[i].depths = NULL;
    }
    renderer->tile_pixels = renderer->depth_pixels = 0;
}

void vd_classic_renderer_destroy(vd_classic_renderer **renderer) {
    if (renderer == NULL || *renderer == NULL) {
        return;
    }
    vd_classic_renderer *r = *renderer;
    vd_context *context = r->context;
    release_tiles(r);
    vd_release(context, r->workers);
    vd_release(context, r->directions);
    vd_release(context, r->slice_z);
    vd_release(context, r->slice_rise);
    vd_march_map_finish(context, &r->map);
    vd_release(context, r);
    *renderer = NULL;
}

/* ---- memory that grows with the picture ------------------------------------------------------ */

/* Makes *array hold `count` values; on failure it holds none. */
static vd_status grow(vd_context *context, float **array, size_t count) {
    vd_release(context, *array);
    *array = vd_allocate(context, count, sizeof **array);
    return *array == NULL ? vd_out_of_memory("a row of the picture", count * sizeof **array)
                          : vd_success();
}

static vd_status reserve_columns(vd_classic_renderer *renderer, size_t columns) {
    if (columns <= renderer->columns) {
        return vd_success();
    }
    renderer->columns = 0;
    vd_status status = grow(renderer->context, &renderer->directions, 2 * columns);
    renderer->columns = status.code == VD_OK ? columns : 0;
    return status;
}

static vd_status reserve_slices(vd_classic_renderer *renderer, size_t slices) {
    if (slices <= renderer->slices) {
        return vd_success();
    }
    renderer->slices = 0;
    vd_status status = grow(renderer->context, &renderer->slice_z, slices);
    if (status.code == VD_OK) {
        status = grow(renderer->context, &renderer->slice_rise, slices);
    }
    renderer->slices = status.code == VD_OK ? slices : 0;
    return status;
}

/* Tiles are empty between pictures: a kernel leaves them as it found them. */
static vd_status reserve_tiles(vd_classic_renderer *renderer, int height, bool deep) {
    size_t pixels = (size_t)VD_MARCH_SLOTS * VD_MARCH_TILE * (size_t)height;
    if (pixels <= renderer->tile_pixels && (!deep || pixels <= renderer->depth_pixels)) {
        return vd_success();
    }
    pixels = pixels > renderer->tile_pixels ? pixels : renderer->tile_pixels;
    deep = deep || renderer->depth_pixels != 0;
    release_tiles(renderer);
    for (int i = 0; i < renderer->threads; i++) {
        vd_march_scratch *worker = &renderer->workers[i];
        worker->tiles = vd_allocate_zero(renderer->context, pixels, sizeof *worker->tiles);
        worker->depths =
            deep ? vd_allocate(renderer->context, pixels, sizeof *worker->depths) : NULL;
        if (worker->tiles == NULL || (deep && worker->depths == NULL)) {
            release_tiles(renderer);
            return vd_out_of_memory("a worker's tiles", pixels * sizeof *worker->tiles);
        }
    }
    renderer->tile_pixels = pixels;
    renderer->depth_pixels = deep ? pixels : 0;
    return vd_success();
}

static vd_status reserve(vd_classic_renderer *renderer, const vd_frame *frame, size_t slices) {
    vd_status status = reserve_columns(renderer, (size_t)frame->width);
    if (status.code == VD_OK) {
        status = reserve_tiles(renderer, frame->height, frame->depth != NULL);
    }
    return status.code == VD_OK ? reserve_slices(renderer, slices) : status;
}

/* ---- a picture ------------------------------------------------------------------------------- */

static bool is_sweep(const vd_classic_setup *setup) {
    return setup->growth != 0.0 || setup->slice_count < FEW_SLICES;
}

/* The farthest slice of a constant schedule; slices never come nearer. A growing one ends before
 * the distance. */
static double farthest(const vd_classic_setup *setup, const vd_classic_def *def) {
    if (setup->growth != 0.0) {
        return (float)def->distance;
    }
    return setup->z0 + (float)(setup->slice_count - 1) * setup->step;
}

static bool is_tiny(double v) {
    return v != 0.0 && fabs(v) < MIN_NUMBER;
}

static bool is_safe(const vd_classic_setup *setup, const vd_classic_def *def) {
    if (setup->slice_count > (is_sweep(setup) ? MAX_SWEEP_SLICES : MAX_SLICES)) {
        return false;
    }
    double z = farthest(setup, def), reach = 0.0;
    bool tiny = setup->z0 < MIN_Z0 || is_tiny(setup->eye_x) || is_tiny(setup->eye_y);
    for (int i = 0; i < setup->frame->width; i++) {
        double x = fabs((double)setup->direction_x[i]), y = fabs((double)setup->direction_y[i]);
        tiny = tiny || is_tiny(x) || is_tiny(y);
        reach = reach < x ? x : reach;
        reach = reach < y ? y : reach;
    }
    double eye_x = fabs((double)setup->eye_x), eye_y = fabs((double)setup->eye_y);
    double position = (eye_x < eye_y ? eye_y : eye_x) + reach * z;
    float nearest = setup->scale / setup->z0, least = setup->scale / (float)z;
    return !tiny && position < MAX_POSITION && nearest <= FLT_MAX && least >= FLT_MIN;
}

static void list_slices(const vd_classic_setup *setup, float *z, float *rise) {
    vd_classic_slice slice = vd_classic_slice_first(setup);
    for (; slice.k < setup->slice_count; vd_classic_slice_next(setup, &slice)) {
        z[slice.k] = slice.z;
        rise[slice.k] = slice.rise;
    }
}

typedef struct crew {
    vd_march_picture picture;
    vd_kernel_march *kernel;
} crew;

static void work(void *user, int index, int worker) {
    (void)index;
    crew *c = user;
    c->kernel(&c->picture, &c->picture.workers[worker]);
}

static vd_status draw(vd_classic_renderer *renderer, const vd_classic_setup *setup) {
    int tiles = (setup->frame->width + VD_MARCH_TILE - 1) / VD_MARCH_TILE;
    bool sweeps = is_sweep(setup), deep = setup->frame->depth != NULL;
    vd_status status = reserve(renderer, setup->frame, sweeps ? setup->slice_count : 0);
    if (status.code != VD_OK) {
        return status;
    }
    if (sweeps) {
        list_slices(setup, renderer->slice_z, renderer->slice_rise);
    }
    const vd_march_kernels *kernels = renderer->kernels;
    const vd_march_map *map = &renderer->map;
    crew c = {
        .picture = {.setup = setup,
                    .map = map,
                    .slice_z = renderer->slice_z,
                    .slice_rise = renderer->slice_rise,
                    .workers = renderer->workers,
                    .tiles = tiles,
                    .last = (float)(setup->slice_count - 1)},
        .kernel = (sweeps ? kernels->sweep
                   : map->bytes > AHEAD_MAP_BYTES
                       ? kernels->ahead
                       : kernels->march)[map->height_type][map->power_of_two][deep],
    };
    int workers = renderer->threads < tiles ? renderer->threads : tiles;
    status = vd_parallel_for(renderer->context, setup->job, workers, work, &c);
    if (status.code == VD_ERROR_CANCELLED || atomic_load(&c.picture.interrupted)) {
        return vd_classic_cancelled();
    }
    return status;
}

vd_status vd_classic_renderer_draw(vd_classic_renderer *renderer, vd_job *job,
                                   const vd_classic_def *def, vd_frame *frame) {
    if (renderer == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "classic: vd_classic_renderer_draw needs a renderer");
    }
    vd_context *context = renderer->context;
    uint64_t slices = 0;
    vd_status status = vd_classic_check(context, renderer->heightfield, def, frame, &slices);
    if (status.code == VD_OK) {
        status = reserve_columns(renderer, (size_t)frame->width);
    }
    if (status.code != VD_OK) {
        return status;
    }
    vd_classic_setup setup = vd_classic_make_setup(context, job, renderer->heightfield, def, slices,
                                                   frame, renderer->directions);
    if (slices != 0 && is_safe(&setup, def)) {
        vd_classic_set_objects(frame);
        return draw(renderer, &setup);
    }
    vd_classic_clear(frame, def->background);
    vd_classic_counts unwanted;
    return vd_classic_draw_columns(&setup, &unwanted);
}
