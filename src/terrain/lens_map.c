/* lens_map.c: the lens map in parallel, around its kernels. What and why: lens_map_kernels.inl. */
#include <string.h>
#include "core/core.h"
#include "terrain/lens_map_internal.h"
#include "terrain/shadow_internal.h"

#define BANDS 64         /* of rows, of a level or a texture */
#define BAND_ROWS 8      /* and at least as many rows in one */
#define SMALL (64 << 10) /* elements that are not worth waking a thread for */

const vd_lens_kernels *vd_lens_kernels_for(vd_isa isa) {
#if defined(__x86_64__)
    if (isa == VD_ISA_V4) {
        return &vd_lens_kernels_v4;
    }
    if (isa == VD_ISA_V3) {
        return &vd_lens_kernels_v3;
    }
#endif
    (void)isa;
    return &vd_lens_kernels_v2;
}

/* Rows, cut into bands. */
typedef struct bands {
    int rows, each;
} bands;

static bands cut(int rows) {
    const int each = (rows + BANDS - 1) / BANDS;
    return (bands){rows, each > BAND_ROWS ? each : BAND_ROWS};
}

static int band_end(bands b, int index) {
    const int end = (index + 1) * b.each;
    return end < b.rows ? end : b.rows;
}

/* Runs a task over all bands; here when there is little to do. */
static vd_status run(vd_context *context, vd_job *job, bands b, size_t elements,
                     vd_task_function *task, void *user) {
    const int count = (b.rows + b.each - 1) / b.each;
    if (elements > SMALL) {
        return vd_parallel_for(context, job, count, task, user);
    }
    if (vd_job_stopped(job)) {
        return vd_failure(VD_ERROR_CANCELLED, "the job was cancelled or ran out of time");
    }
    for (int i = 0; i < count; i++) {
        task(user, i, 0);
    }
    return vd_success();
}

/* ---- heights and maxima -----------------------------------------------------------------------
 */

typedef struct build {
    const vd_lens_map *map;
    const vd_lens_kernels *kernels;
    int level;
    bands bands;
    float lowest[BANDS];
} build;

static float mean_or_hole(const vd_lens_ground *fine, int column, int row) {
    return fine->heights[(size_t)row * fine->stride + (size_t)column] > -INFINITY
               ? vd_lens_mean(fine, column, row)
               : -INFINITY;
}

static void build_heights(void *user, int index, int worker) {
    (void)worker;
    build *b = user;
    const vd_lens_ground *fine = &b->map->ground[b->level - 1], *coarse = fine + 1;
    const int inner = (fine->columns - 1) / 2; /* outputs from 1 on with both neighbours */
    float low = INFINITY;
    for (int row = index * b->bands.each; row < band_end(b->bands, index); row++) {
        float *to = vd_lens_heights(b->map, b->level) + (size_t)row * coarse->stride;
        const int r = 2 * row < fine->rows ? 2 * row : fine->rows;
        const float *here = fine->heights + (size_t)r * fine->stride;
        to[0] = mean_or_hole(fine, 0, r);
        const bool holes =
            b->kernels->mean(r > 0 ? here - fine->stride : NULL, here,
                             r < fine->rows ? here + fine->stride : NULL, 2, inner, to + 1);
        for (int column = 1; holes && column <= inner; column++) {
            if (!(to[column] > -INFINITY)) {
                to[column] = mean_or_hole(fine, 2 * column, r);
            }
        }
        for (int column = inner + 1; column <= coarse->columns; column++) {
            const int c = 2 * column < fine->columns ? 2 * column : fine->columns;
            to[column] = mean_or_hole(fine, c, r);
        }
        low = b->kernels->lowest(to, coarse->columns + 1, low);
    }
    b->lowest[index] = low;
}

static void build_maxima(void *user, int index, int worker) {
    (void)worker;
    const build *b = user;
    const vd_lens_ground *fine = &b->map->ground[b->level - 1], *coarse = fine + 1;
    const size_t pitch = (size_t)fine->pitch[1];
    /* Of level 1 from heights, whose rows are one more than the cells'. */
    const bool first = b->level == 1;
    const float *from = first ? fine->heights : vd_lens_maxima(b->map, b->level - 1);
    const size_t stride = first ? fine->stride : (size_t)fine[-1].pitch[1];
    const int last = first ? fine->rows : fine->rows - 1, reach = first ? 3 : 2;
    for (int row = index * b->bands.each; row < band_end(b->bands, index); row++) {
        const float *rows[3];
        for (int i = 0; i < 3; i++) {
            const int r = 2 * row + (i < reach ? i : 0);
            rows[i] = from + (size_t)(r < last ? r : last) * stride;
        }
        const float *const below[2] = {coarse->heights + (size_t)row * coarse->stride,
                                       coarse->heights + ((size_t)row + 1) * coarse->stride};
        b->kernels->maxima(rows, first ? fine->columns + 1 : fine->columns, reach, below,
                           coarse->columns, vd_lens_maxima(b->map, b->level) + (size_t)row * pitch);
    }
}

static vd_status build_levels(vd_job *job, const vd_heightfield *h, vd_lens_map *map) {
    const bool ground = h->holes < (uint64_t)h->width * (uint64_t)h->height;
    build b = {.map = map, .kernels = vd_lens_kernels_for(vd_context_isa(map->context))};
    float low = ground ? h->min : INFINITY, high = ground ? h->max : -INFINITY;
    vd_status status = vd_success();
    for (b.level = 1; status.code == VD_OK && b.level < map->levels; b.level++) {
        const vd_lens_ground *g = &map->ground[b.level];
        const size_t elements = g->stride * (size_t)g->rows;
        b.bands = cut(g->rows + 1);
        status = run(map->context, job, b.bands, elements, build_heights, &b);
        for (int i = 0; status.code == VD_OK && i * b.bands.each < b.bands.rows; i++) {
            low = b.lowest[i] < low ? b.lowest[i] : low;
        }
        if (status.code == VD_OK) {
            b.bands = cut(g->rows);
            status = run(map->context, job, b.bands, elements, build_maxima, &b);
        }
    }
    if (status.code == VD_OK && map->levels > 1) { /* the last bounds all levels */
        high = *vd_lens_maxima(map, map->levels - 1);
    }
    map->lowest = high > -INFINITY ? low + 0.0f : 0.0f;
    map->highest = high > -INFINITY ? high + 0.0f : 0.0f;
    return status;
}

vd_status vd_lens_map_init(vd_context *context, vd_job *job, const vd_terrain_def *def,
                           vd_lens_map *out) {
    vd_lens_map map;
    vd_status status = vd_lens_map_lay_out(context, def, &map);
    if (status.code != VD_OK) {
        return status;
    }
    status = build_levels(job, def->heightfield, &map);
    if (status.code != VD_OK) {
        vd_lens_map_finish(&map);
        return status;
    }
    *out = map;
    return status;
}

/* ---- light ------------------------------------------------------------------------------------
 */

/* Scratch of one worker where texels lie between samples. */
typedef struct between {
    int row;                        /* of the first pair below, −1: none yet */
    float *direct[2], *up[2];       /* of samples row and row + 1 */
    float *sample_row;              /* of one term or the heights, at the texels' row */
    float *texel_direct, *texel_up; /* at the texels */
    float *heights;
    uint32_t *albedo;
} between;

typedef struct lighting {
    vd_lens_map *map;
    const vd_terrain_def *def;
    const vd_lens_kernels *kernels;
    vd_lens_light light;
    bands bands;
    /* Where texels lie between samples, by texel column. */
    int32_t *first;
    float *weight;
    vd_lens_mix *mix;
    between *workers;
} lighting;

static void fill_table(void *user, int index, int worker) {
    (void)worker;
    lighting *l = user;
    vd_lens_light_fill(&l->light, l->def, index * l->bands.each, band_end(l->bands, index));
}

/* The two terms of all samples of a row. */
static void row_terms(const lighting *l, int row, float *direct, float *up) {
    const int last = l->map->width - 1;
    l->kernels->terms(&l->light, row, 1, last - 1, direct + 1, up + 1);
    for (int column = 0; column <= last; column += last) {
        const vd_lens_terms t = vd_lens_terms_at(&l->light, column, row);
        direct[column] = t.direct;
        up[column] = t.up;
    }
}

static const uint32_t *color_row(const lighting *l, int row) {
    const vd_heightfield *h = l->light.map;
    return (const uint32_t *)(const void *)(vd_heightfield_colors(h) +
                                            (size_t)row * h->color_stride);
}

static uint32_t opaque(uint32_t color) {
    return color | 0xFF000000u;
}

/* Replaces colours of a run by those of heights where imagery has nothing. */
static void fill_gaps(const lighting *l, const float *heights, int count, uint32_t *albedo) {
    uint32_t by_height[256];
    for (int from = 0; from < count; from += 256) {
        const int some = count - from < 256 ? count - from : 256;
        l->kernels->table(&l->light, heights + from, some, by_height);
        for (int i = 0; i < some; i++) {
            albedo[from + i] = albedo[from + i] >> 24 < 128 ? by_height[i] : albedo[from + i];
        }
    }
}

static bool has_gaps(const uint32_t *albedo, int count) {
    uint32_t all = 0xFFFFFFFFu;
    for (int i = 0; i < count; i++) {
        all &= albedo[i];
    }
    return all >> 31 == 0;
}

#define RUN 256 /* texels at a time, whose terms stay in the first-level cache */

/* A row of texels at the samples. */
static void light_at_samples(const lighting *l, int row, uint32_t *to) {
    const int width = l->map->width;
    const float *heights = l->light.heights + (size_t)row * l->light.stride;
    const bool has_colors = l->light.map->color_width > 0;
    for (int from = 1; from < width - 1; from += RUN) {
        const int count = width - 1 - from < RUN ? width - 1 - from : RUN;
        float direct[RUN], up[RUN];
        uint32_t albedo[RUN];
        for (int i = 0; has_colors && i < count; i++) {
            albedo[i] = color_row(l, row)[from + i];
        }
        for (int i = 0; !has_colors && i < count; i++) {
            albedo[i] = 0x00BEBEBEu;
        }
        if (l->light.has_table && !has_colors) {
            l->kernels->table(&l->light, heights + from, count, albedo);
        } else if (l->light.has_table && has_gaps(albedo, count)) {
            fill_gaps(l, heights + from, count, albedo);
        }
        if (l->light.shading) {
            l->kernels->terms(&l->light, row, from, count, direct, up);
            l->kernels->shade(&l->light, albedo, direct, up, count, to + from);
        } else {
            for (int i = 0; i < count; i++) {
                to[from + i] = opaque(albedo[i]);
            }
        }
    }
    to[0] = vd_lens_texel(&l->light, 0, row);
    to[width - 1] = vd_lens_texel(&l->light, width - 1, row);
}

/* Makes the terms of sample rows `row` and `row + 1`, one of which is often there already. */
static void seek(const lighting *l, between *w, int row) {
    if (row == w->row) {
        return;
    }
    const bool next = w->row >= 0 && row == w->row + 1;
    if (next) {
        float *direct = w->direct[0], *up = w->up[0];
        w->direct[0] = w->direct[1];
        w->up[0] = w->up[1];
        w->direct[1] = direct;
        w->up[1] = up;
    } else {
        row_terms(l, row, w->direct[0], w->up[0]);
    }
    row_terms(l, row + 1, w->direct[1], w->up[1]);
    w->row = row;
}

static void texel_heights(const lighting *l, vd_lens_place r, int width, float *out) {
    const float *a = l->light.heights + (size_t)r.first * l->light.stride, *b = a + l->light.stride;
    const float *nearest = r.weight >= 0.5f ? b : a;
    for (int i = 0; i < width; i++) {
        const int c = l->first[i];
        const float left = a[c] + (b[c] - a[c]) * r.weight;
        const float right = a[c + 1] + (b[c + 1] - a[c + 1]) * r.weight;
        const bool whole =
            a[c] > -INFINITY && a[c + 1] > -INFINITY && b[c] > -INFINITY && b[c + 1] > -INFINITY;
        out[i] = whole ? left + (right - left) * l->weight[i]
                       : nearest[c + (l->weight[i] >= 0.5f ? 1 : 0)];
    }
}

/* A row of texels between samples, along their rows and columns. */
static void light_between(const lighting *l, between *w, int y, uint32_t *to) {
    const vd_lens_light *light = &l->light;
    const double *m = light->sample_from_texture, v = y + 0.5;
    const int width = l->map->texture[0].width, samples = l->map->width;
    const vd_lens_place r = vd_lens_place_at(m[3] + (0.0 * m[4] + v * m[5]), l->map->height);
    const vd_lens_mix rows = vd_lens_mix_at(y, light->factor, light->map->color_height);
    l->kernels->mix(color_row(l, rows.first), color_row(l, rows.second), rows.weight, l->mix, width,
                    w->albedo);
    if (light->has_table && has_gaps(w->albedo, width)) {
        texel_heights(l, r, width, w->heights);
        fill_gaps(l, w->heights, width, w->albedo);
    }
    if (!light->shading) {
        for (int i = 0; i < width; i++) {
            to[i] = opaque(w->albedo[i]);
        }
        return;
    }
    seek(l, w, r.first);
    l->kernels->blend(w->direct[0], w->direct[1], r.weight, samples, w->sample_row);
    l->kernels->spread(w->sample_row, l->first, l->weight, width, w->texel_direct);
    l->kernels->blend(w->up[0], w->up[1], r.weight, samples, w->sample_row);
    l->kernels->spread(w->sample_row, l->first, l->weight, width, w->texel_up);
    l->kernels->shade(light, w->albedo, w->texel_direct, w->texel_up, width, to);
}

/* Repeats the outermost texels of finished rows [first, end), and the rows above the first and
 * below the last. */
static void close_rows(const vd_lens_texture *t, uint32_t *texels, int first, int end) {
    const size_t bytes = ((size_t)t->width + 2) * sizeof *texels;
    for (int y = first; y < end; y++) {
        uint32_t *row = texels + (ptrdiff_t)y * t->stride;
        row[-1] = row[0];
        row[t->width] = row[t->width - 1];
        if (y == 0) {
            memcpy(row - t->stride - 1, row - 1, bytes);
        }
        if (y == t->height - 1) {
            memcpy(row + t->stride - 1, row - 1, bytes);
        }
    }
}

static void light_rows(void *user, int index, int worker) {
    const lighting *l = user;
    const vd_lens_texture *t = l->map->texture;
    const int first = index * l->bands.each, end = band_end(l->bands, index);
    if (l->workers != NULL) {
        l->workers[worker].row = -1; /* counts may have changed */
    }
    for (int y = first; y < end; y++) {
        uint32_t *to = vd_lens_texels(l->map, 0) + (ptrdiff_t)y * t->stride;
        if (l->light.coincide) {
            light_at_samples(l, y, to);
        } else if (l->workers != NULL) {
            light_between(l, &l->workers[worker], y, to);
        } else {
            for (int x = 0; x < t->width; x++) {
                to[x] = vd_lens_texel(&l->light, x, y);
            }
        }
    }
    close_rows(t, vd_lens_texels(l->map, 0), first, end);
}

/* A half size in the making, where the light may have stood. */
typedef struct halving {
    const vd_lens_map *map;
    const vd_lens_kernels *kernels;
    int size;
    bands bands;
} halving;

static void half_rows(void *user, int index, int worker) {
    (void)worker;
    const halving *l = user;
    const vd_lens_texture *fine = &l->map->texture[l->size - 1], *coarse = fine + 1;
    const int first = index * l->bands.each, end = band_end(l->bands, index);
    for (int y = first; y < end; y++) {
        const uint32_t *top = fine->texels + (ptrdiff_t)(2 * y) * fine->stride;
        const uint32_t *bottom = 2 * y + 1 < fine->height ? top + fine->stride : top;
        uint32_t *to = vd_lens_texels(l->map, l->size) + (ptrdiff_t)y * coarse->stride;
        l->kernels->half(top, bottom, fine->width / 2, to);
        if (fine->width % 2 != 0) {
            const uint32_t above[2] = {top[fine->width - 1], top[fine->width - 1]};
            const uint32_t below[2] = {bottom[fine->width - 1], bottom[fine->width - 1]};
            l->kernels->half(above, below, 1, to + coarse->width - 1);
        }
    }
    close_rows(coarse, vd_lens_texels(l->map, l->size), first, end);
}

/* The full size, and then the others, during which *l is no more. */
static vd_status write_textures(lighting *l, vd_job *job) {
    vd_context *context = l->map->context;
    const vd_lens_texture *t = l->map->texture;
    halving h = {.map = l->map, .kernels = l->kernels};
    vd_status status = vd_success();
    if (l->light.table_count > 0) {
        l->bands = cut(l->light.table_count);
        status = run(context, job, l->bands, SMALL + 1, fill_table, l);
    }
    if (status.code == VD_OK) {
        l->bands = cut(t->height);
        status = run(context, job, l->bands, (size_t)t->width * (size_t)t->height, light_rows, l);
    }
    for (h.size = 1; status.code == VD_OK && h.size < h.map->textures; h.size++) {
        h.bands = cut(t[h.size].height);
        status = run(context, job, h.bands, (size_t)t[h.size].width * (size_t)t[h.size].height,
                     half_rows, &h);
    }
    return status;
}

/* Room for what lies between samples: the places of all texel columns, and rows for every worker.
 */
static vd_status make_room(lighting *l, void **memory) {
    vd_context *context = l->map->context;
    const size_t texels = (size_t)l->map->texture[0].width, samples = (size_t)l->map->width;
    const size_t threads = (size_t)vd_context_threads(context);
    const size_t per_worker = 5 * samples + 4 * texels;
    const size_t words = texels * 5 + threads * per_worker;
    uint8_t *at = vd_allocate(context, 1, words * 4 + threads * sizeof(between) + 64);
    if (at == NULL) {
        return vd_out_of_memory("the terrain's light", words * 4);
    }
    *memory = at;
    l->workers = (between *)(void *)at;
    float *row = (float *)(void *)(at + threads * sizeof(between));
    l->first = (int32_t *)(void *)row;
    l->weight = row + texels;
    l->mix = (vd_lens_mix *)(void *)(row + 2 * texels);
    row += 5 * texels;
    for (size_t i = 0; i < threads; i++) {
        float **const rows[] = {&l->workers[i].direct[0], &l->workers[i].direct[1],
                                &l->workers[i].up[0], &l->workers[i].up[1],
                                &l->workers[i].sample_row};
        for (size_t j = 0; j < 5; j++) {
            *rows[j] = row;
            row += samples;
        }
        l->workers[i].texel_direct = row;
        l->workers[i].texel_up = row + texels;
        l->workers[i].heights = row + 2 * texels;
        l->workers[i].albedo = (uint32_t *)(void *)(row + 3 * texels);
        row += 4 * texels;
    }
    const double *m = l->light.sample_from_texture;
    for (size_t x = 0; x < texels; x++) {
        const double u = (double)x + 0.5;
        const vd_lens_place c = vd_lens_place_at(m[0] + (u * m[1] + 0.0 * m[2]), l->map->width);
        l->first[x] = c.first;
        l->weight[x] = c.weight;
        l->mix[x] = vd_lens_mix_at((int)x, l->light.factor, l->light.map->color_width);
    }
    return vd_success();
}

/* Where the half sizes will stand, and how many bytes they take. */
static uint8_t *half_sizes(const vd_lens_map *map, size_t *bytes) {
    if (map->textures < 2) {
        *bytes = 0;
        return NULL;
    }
    const vd_lens_texture *first = &map->texture[1], *last = &map->texture[map->textures - 1];
    const uint32_t *from = first->texels - first->stride - 1;
    const uint32_t *end = last->texels - 1 + 2 * (ptrdiff_t)last->stride;
    *bytes = (size_t)(end - from) * sizeof *end;
    return (uint8_t *)(vd_lens_texels(map, 1) - first->stride - 1);
}

/* What lighting needs until the half sizes are written, and mostly fits in their place: the counts
 * of the shadows, then the lighting itself. Null: it does not. */
typedef struct lent {
    uint8_t *counts;
    lighting *lighting;
} lent;

static lent borrow(const vd_lens_map *map) {
    const size_t counts = (size_t)map->width * (size_t)map->height;
    size_t bytes;
    uint8_t *half = half_sizes(map, &bytes);
    lent out = {NULL, NULL};
    if (half != NULL && bytes >= counts) {
        out.counts = half;
        const size_t at = counts + 63 - (size_t)((uintptr_t)half + counts + 63) % 64;
        if (bytes >= at + sizeof *out.lighting) {
            out.lighting = (lighting *)(void *)(half + at);
        }
    }
    return out;
}

/* Counts shadows. The copy of the map that they are made from mostly fits in the full size's place.
 */
static vd_status count_shadows(lighting *l, vd_job *job, void **memory) {
    vd_lens_map *map = l->map;
    const size_t stride = (size_t)map->width, wanted = stride * (size_t)map->height;
    uint8_t *counts = borrow(map).counts;
    if (counts == NULL) {
        counts = *memory = vd_allocate(map->context, wanted, 1);
        if (counts == NULL) {
            return vd_out_of_memory("the terrain's shadows", wanted);
        }
    }
    l->light.counts = counts;
    l->light.counts_stride = stride;
    size_t bytes;
    uint8_t *full = map->memory[2], *half = half_sizes(map, &bytes);
    return vd_shadow_count_with(map->context, job, l->light.map, &l->light.shadow, counts, stride,
                                full, half != NULL ? (size_t)(half - full) : 0);
}

vd_status vd_lens_map_light(vd_lens_map *map, vd_job *job, const vd_terrain_def *def) {
    void *own = NULL, *counts = NULL, *room = NULL;
    lighting *l = borrow(map).lighting;
    if (l == NULL) {
        l = own = vd_allocate(map->context, 1, sizeof *l);
    }
    if (l == NULL) {
        return vd_out_of_memory("the terrain's light", sizeof *l);
    }
    l->map = map;
    l->def = def;
    l->kernels = vd_lens_kernels_for(vd_context_isa(map->context));
    l->workers = NULL;
    vd_status status = vd_lens_light_init(map, def, &l->light);
    const double *m = l->light.sample_from_texture;
    if (status.code == VD_OK && l->light.shadows) {
        status = count_shadows(l, job, &counts);
    }
    if (status.code == VD_OK && !l->light.coincide && m[2] == 0.0 && m[4] == 0.0) {
        status = make_room(l, &room);
    }
    if (status.code == VD_OK) {
        status = write_textures(l, job);
    }
    vd_release(map->context, room);
    vd_release(map->context, counts);
    vd_release(map->context, own);
    return status;
}
