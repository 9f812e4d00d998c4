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
    vd_classic_mips mips;                     /* level 0 alone until a picture wants more */
    vd_march_map maps[VD_CLASSIC_MAX_LEVELS]; /* of the levels */
    vd_classic_resolver resolver;
    const vd_march_kernels *kernels;
    int threads;
    vd_march_scratch *workers;
    size_t columns, tile_pixels, slices; /* what the arrays below have room for */
    bool deep, smooth;                   /* and a worker's tiles are for */
    float *directions;                   /* [2][columns] */
    float *slice_z, *slice_rise;         /* [slices] */
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
            : vd_classic_mips_init(context, map, false, &renderer->mips);
    if (status.code == VD_OK) {
        status = vd_march_map_init(context, &renderer->mips.levels[0],
                                   (vd_height_type)map->height_type, &renderer->maps[0]);
    }
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
        vd_march_scratch *worker = &renderer->workers[i];
        vd_release(renderer->context, worker->tiles);
        vd_release(renderer->context, worker->depths);
        vd_release(renderer->context, worker->below);
        worker->tiles = NULL;
        worker->depths = NULL;
        worker->below = NULL;
    }
    renderer->tile_pixels = 0;
}

/* Forgets the levels above 0. */
static void release_levels(vd_classic_renderer *renderer) {
    for (int i = 1; i < VD_CLASSIC_MAX_LEVELS; i++) {
        vd_march_map_finish(renderer->context, &renderer->maps[i]);
    }
    vd_classic_mips_finish(renderer->context, &renderer->mips);
    renderer->mips.count = 1;
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
    release_levels(r);
    vd_march_map_finish(context, &r->maps[0]);
    vd_classic_resolver_finish(context, &r->resolver);
    vd_release(context, r);
    *renderer = NULL;
}

static bool is_sweep(const vd_classic_setup *setup) {
    return setup->growth != 0.0 || setup->slice_count < FEW_SLICES;
}

/* Whether the slices of a sample are to be told apart: by depth, or by where gradients begin. */
static bool is_deep(const vd_classic_setup *setup) {
    return setup->frame->depth != NULL || setup->smooth;
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

static bool reserve_worker(vd_classic_renderer *renderer, vd_march_scratch *worker, size_t pixels) {
    vd_context *context = renderer->context;
    worker->tiles = vd_allocate_zero(context, pixels, sizeof *worker->tiles);
    if (renderer->deep) {
        worker->depths = vd_allocate(context, pixels, sizeof *worker->depths);
    }
    if (renderer->smooth) {
        worker->below = vd_allocate(context, pixels / VD_MARCH_SLOTS, sizeof *worker->below);
    }
    return worker->tiles != NULL && (worker->depths != NULL || !renderer->deep) &&
           (worker->below != NULL || !renderer->smooth);
}

/* Tiles are empty between pictures: a kernel leaves them as it found them. */
static vd_status reserve_tiles(vd_classic_renderer *renderer, int height, bool deep, bool smooth) {
    size_t pixels = (size_t)VD_MARCH_SLOTS * VD_MARCH_TILE * (size_t)height;
    if (pixels <= renderer->tile_pixels && deep <= renderer->deep && smooth <= renderer->smooth) {
        return vd_success();
    }
    pixels = pixels > renderer->tile_pixels ? pixels : renderer->tile_pixels;
    renderer->deep |= deep;
    renderer->smooth |= smooth;
    release_tiles(renderer);
    for (int i = 0; i < renderer->threads; i++) {
        if (!reserve_worker(renderer, &renderer->workers[i], pixels)) {
            release_tiles(renderer);
            return vd_out_of_memory("a worker's tiles", pixels * sizeof(uint32_t));
        }
    }
    renderer->tile_pixels = pixels;
    return vd_success();
}

/* The levels above 0, when the first picture wants them. */
static vd_status reserve_levels(vd_classic_renderer *renderer) {
    const vd_height_type type = (vd_height_type)renderer->heightfield->height_type;
    if (renderer->mips.count > 1) {
        return vd_success();
    }
    vd_status status =
        vd_classic_mips_init(renderer->context, renderer->heightfield, true, &renderer->mips);
    for (int i = 1; i < renderer->mips.count && status.code == VD_OK; i++) {
        status = vd_march_map_init(renderer->context, &renderer->mips.levels[i], type,
                                   &renderer->maps[i]);
    }
    if (status.code != VD_OK) {
        release_levels(renderer);
    }
    return status;
}

static vd_status reserve(vd_classic_renderer *renderer, const vd_classic_setup *setup) {
    vd_status status = reserve_tiles(renderer, setup->frame->height, is_deep(setup), setup->smooth);
    for (int i = 0; i < setup->level_count && status.code == VD_OK; i++) {
        status = vd_march_map_prepare(renderer->context, &renderer->maps[i], setup->linear);
    }
    return status.code == VD_OK && is_sweep(setup) ? reserve_slices(renderer, setup->slice_count)
                                                   : status;
}

/* ---- a picture ------------------------------------------------------------------------------- */

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

static float constant_z(const vd_classic_setup *setup, uint32_t k) {
    return setup->z0 + (float)k * setup->step;
}

static void list_slices(const vd_classic_setup *setup, float *z, float *rise) {
    vd_classic_slice slice = vd_classic_slice_first(setup);
    for (; slice.k < setup->slice_count; vd_classic_slice_next(setup, &slice)) {
        z[slice.k] = slice.z;
        rise[slice.k] = slice.rise;
    }
}

/* The first slice from `low` on that is beyond a level; z never falls. */
static uint32_t level_end(const vd_classic_setup *setup, const float *z, uint32_t low, int level) {
    uint32_t high = setup->slice_count;
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        const float here = z != NULL ? z[middle] : constant_z(setup, middle);
        if (vd_classic_level_at(setup, here, 0) <= level) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return low;
}

/* Cuts the slices by the level of the map that they read. `z`: all slices', or null for those of
 * the constant schedule. */
static void cut_segments(const vd_classic_renderer *renderer, const float *z,
                         vd_march_picture *picture) {
    const vd_classic_setup *setup = picture->setup;
    picture->segment_count = 0;
    for (uint32_t first = 0, level = 0; level < (uint32_t)setup->level_count; level++) {
        const uint32_t end = level_end(setup, z, first, (int)level);
        if (end == first) {
            continue;
        }
        const float scale = setup->levels[level].scale;
        const vd_march_segment segment = {.map = &renderer->maps[level],
                                          .scale = scale,
                                          .eye_x = setup->eye_x * scale,
                                          .eye_y = setup->eye_y * scale,
                                          .first = (float)first,
                                          .last = (float)(end - 1)};
        picture->segments[picture->segment_count++] = segment;
        first = end;
    }
}

/* One kernel draws all levels: the one for any sides unless all are powers of two, which they are
 * if level 0's are. */
static vd_kernel_march *find_kernel(const vd_classic_renderer *renderer,
                                    const vd_classic_setup *setup) {
    const vd_march_kernels *kernels = renderer->kernels;
    const vd_march_map *map = &renderer->maps[0];
    const bool deep = is_deep(setup), sweeps = is_sweep(setup);
    if (setup->linear) {
        return (sweeps ? kernels->linear_sweep
                       : kernels->linear)[map->height_type][map->power_of_two];
    }
    return (sweeps ? kernels->sweep
            : map->bytes > AHEAD_MAP_BYTES
                ? kernels->ahead
                : kernels->march)[map->height_type][map->power_of_two][deep];
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
    vd_status status = reserve(renderer, setup);
    if (status.code != VD_OK) {
        return status;
    }
    if (is_sweep(setup)) {
        list_slices(setup, renderer->slice_z, renderer->slice_rise);
    }
    crew c = {
        .picture = {.setup = setup,
                    .slice_z = renderer->slice_z,
                    .slice_rise = renderer->slice_rise,
                    .workers = renderer->workers,
                    .tiles = tiles,
                    .inverse_scale = 1.0f / setup->scale},
        .kernel = find_kernel(renderer, setup),
    };
    cut_segments(renderer, is_sweep(setup) ? renderer->slice_z : NULL, &c.picture);
    int workers = renderer->threads < tiles ? renderer->threads : tiles;
    status = vd_parallel_for(renderer->context, setup->job, workers, work, &c);
    if (status.code == VD_ERROR_CANCELLED || atomic_load(&c.picture.interrupted)) {
        return vd_classic_cancelled();
    }
    return status;
}

typedef struct drawing {
    vd_classic_renderer *renderer;
    vd_job *job;
    uint64_t slices;
} drawing;

static vd_status draw_view(void *user, const vd_classic_view *view) {
    const drawing *d = user;
    vd_classic_renderer *renderer = d->renderer;
    const vd_classic_setup setup =
        vd_classic_make_setup(renderer->context, d->job, renderer->heightfield, &renderer->mips,
                              view, d->slices, renderer->directions);
    if (d->slices != 0 && is_safe(&setup, view->def)) {
        vd_classic_set_objects(view->frame);
        return draw(renderer, &setup);
    }
    vd_classic_clear(view->frame, view->def->background);
    vd_classic_counts unwanted;
    return vd_classic_draw_columns(&setup, &unwanted);
}

vd_status vd_classic_renderer_draw(vd_classic_renderer *renderer, vd_job *job,
                                   const vd_classic_def *def, vd_frame *frame) {
    if (renderer == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "classic: vd_classic_renderer_draw needs a renderer");
    }
    vd_context *context = renderer->context;
    drawing d = {renderer, job, 0};
    vd_status status = vd_classic_check(context, renderer->heightfield, def, frame, &d.slices);
    if (status.code == VD_OK) {
        status = reserve_columns(renderer, (size_t)frame->width);
    }
    if (status.code == VD_OK && def->mip) {
        status = reserve_levels(renderer);
    }
    return status.code == VD_OK
               ? vd_classic_resolve(context, &renderer->resolver, def, frame, draw_view, &d)
               : status;
}
