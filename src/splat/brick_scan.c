/* brick_scan.c: reading sources as one, and the first look at everything. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "core/core.h"
#include "splat/brick_import.h"

vd_status vd_import_begin(vd_context *context, vd_particle_source *const *sources, int count,
                          vd_import_input *out) {
    if (sources == NULL || count < 1) {
        return vd_failure(VD_ERROR_ARGUMENT, "there is nothing to import; name a file");
    }
    *out = (vd_import_input){.sources = sources, .source_count = count};
    for (int a = 0; a < sources[0]->attribute_count; a++) {
        const vd_attribute *attribute = &sources[0]->attributes[a];
        bool everywhere = true;
        for (int s = 1; s < count; s++) {
            everywhere &= vd_particle_source_find(sources[s], attribute->name) >= 0;
        }
        if (everywhere) {
            out->attributes[out->attribute_count++] = *attribute;
        }
    }
    for (int s = 0; s < count; s++) {
        if (sources[s]->attribute_count > out->attribute_count) {
            vd_log(context, VD_LOG_INFO,
                   "%.200s has attributes that not all files have; they are left out",
                   sources[s]->path);
        }
    }
    return vd_success();
}

vd_status vd_import_reader_init(vd_context *context, vd_import_input *input, size_t capacity,
                                vd_import_reader *out) {
    const size_t floats = (size_t)input->attribute_count + 1;
    *out = (vd_import_reader){.input = input};
    out->memory = vd_allocate(context, capacity, 24 + 4 * floats);
    if (out->memory == NULL) {
        return vd_out_of_memory("particles", capacity * (24 + 4 * floats));
    }
    double *at = out->memory;
    out->batch.capacity = capacity;
    out->batch.x = at;
    out->batch.y = at + capacity;
    out->batch.z = at + 2 * capacity;
    float *values = (float *)(at + 3 * capacity);
    for (int a = 0; a < input->attribute_count; a++) {
        out->batch.values[a] = values + (size_t)a * capacity;
    }
    out->unwanted = values + (size_t)input->attribute_count * capacity;
    return vd_import_reader_rewind(out);
}

void vd_import_reader_finish(vd_context *context, vd_import_reader *reader) {
    vd_release(context, reader->memory);
    reader->memory = NULL;
}

vd_status vd_import_reader_rewind(vd_import_reader *reader) {
    reader->source = 0;
    vd_status status = vd_success();
    for (int s = 0; s < reader->input->source_count && status.code == VD_OK; s++) {
        status = vd_particle_source_rewind(reader->input->sources[s]);
    }
    return status;
}

vd_status vd_import_reader_next(vd_import_reader *reader) {
    const vd_import_input *input = reader->input;
    vd_particle_batch *batch = &reader->batch;
    batch->count = 0;
    while (batch->count < batch->capacity && reader->source < input->source_count) {
        vd_particle_source *source = input->sources[reader->source];
        vd_particle_batch view = *batch;
        for (int a = 0; a < source->attribute_count; a++) {
            view.values[a] = reader->unwanted;
            for (int i = 0; i < input->attribute_count; i++) {
                if (strcmp(source->attributes[a].name, input->attributes[i].name) == 0) {
                    view.values[a] = batch->values[i];
                }
            }
        }
        vd_status status = vd_particle_source_read(source, &view);
        if (status.code != VD_OK) {
            return status;
        }
        batch->count = view.count;
        if (batch->count < batch->capacity) {
            reader->source++;
        }
    }
    return vd_success();
}

void vd_import_report(const vd_import_progress *progress, double share) {
    const double whole = progress->from + share * (progress->to - progress->from);
    vd_job_report(progress->job, (int)(whole * 1000000.0), 1000000);
}

/* ---- the scan -----------------------------------------------------------------------------------
 */

#define PIECE 65536

typedef struct scan_part {
    uint64_t count, skipped;
    double min[3], max[3];
    vd_import_range ranges[VD_MAX_ATTRIBUTES];
} scan_part;

typedef struct scan {
    const vd_particle_batch *batch;
    int attribute_count;
    scan_part *parts; /* one a piece, added up in order: sums do not depend on threads */
} scan;

static void empty_part(scan_part *part) {
    memset(part, 0, sizeof *part);
    for (int i = 0; i < 3; i++) {
        part->min[i] = (double)INFINITY;
        part->max[i] = -(double)INFINITY;
    }
    for (int a = 0; a < VD_MAX_ATTRIBUTES; a++) {
        part->ranges[a].min = (double)INFINITY;
        part->ranges[a].max = -(double)INFINITY;
    }
}

static void scan_piece(void *user, int index, int worker) {
    (void)worker;
    const scan *s = user;
    scan_part *part = &s->parts[index];
    const vd_particle_batch *b = s->batch;
    const size_t from = (size_t)index * PIECE;
    const size_t to = from + PIECE < b->count ? from + PIECE : b->count;
    const double *const axes[3] = {b->x, b->y, b->z};
    empty_part(part);
    for (size_t i = from; i < to; i++) {
        /* The difference of a number that is not finite from itself is NaN. */
        if (!(b->x[i] - b->x[i] + (b->y[i] - b->y[i]) + (b->z[i] - b->z[i]) == 0.0)) {
            part->skipped++;
            continue;
        }
        for (int k = 0; k < 3; k++) {
            const double v = axes[k][i];
            part->min[k] = v < part->min[k] ? v : part->min[k];
            part->max[k] = v > part->max[k] ? v : part->max[k];
        }
        for (int a = 0; a < s->attribute_count; a++) {
            const float v = b->values[a][i];
            vd_import_range *r = &part->ranges[a];
            if (!isfinite(v)) {
                r->missing++;
                continue;
            }
            r->min = (double)v < r->min ? (double)v : r->min;
            r->max = (double)v > r->max ? (double)v : r->max;
            r->sum += (double)v;
            r->numbers++;
        }
    }
    part->count = to - from - part->skipped;
}

static void add_part(scan_part *all, const scan_part *part) {
    all->count += part->count;
    all->skipped += part->skipped;
    for (int k = 0; k < 3; k++) {
        all->min[k] = part->min[k] < all->min[k] ? part->min[k] : all->min[k];
        all->max[k] = part->max[k] > all->max[k] ? part->max[k] : all->max[k];
    }
    for (int a = 0; a < VD_MAX_ATTRIBUTES; a++) {
        const vd_import_range *from = &part->ranges[a];
        vd_import_range *to = &all->ranges[a];
        to->min = from->min < to->min ? from->min : to->min;
        to->max = from->max > to->max ? from->max : to->max;
        to->sum += from->sum;
        to->numbers += from->numbers;
        to->missing += from->missing;
    }
}

static vd_status settle(vd_import_input *input, const scan_part *all) {
    input->count = all->count;
    input->skipped = all->skipped;
    if (all->count == 0 && all->skipped > 0) {
        return vd_failure(VD_ERROR_EMPTY,
                          "there is nothing to draw in %.200s: the positions of all %llu particles "
                          "are NaN or infinite; check the columns",
                          input->sources[0]->path, (unsigned long long)all->skipped);
    }
    if (all->count == 0) {
        return vd_failure(VD_ERROR_EMPTY,
                          "there is nothing to draw in %.200s: it has 0 particles; check the file",
                          input->sources[0]->path);
    }
    double size = 0.0;
    for (int k = 0; k < 3; k++) {
        input->min[k] = all->min[k];
        input->max[k] = all->max[k];
        const double extent = all->max[k] - all->min[k];
        size = extent > size ? extent : size;
    }
    if (!(size < 1e300)) {
        return vd_failure(VD_ERROR_LIMIT,
                          "cannot import %.200s: its positions reach over more than 1e300 m; leave "
                          "the outliers out",
                          input->sources[0]->path);
    }
    /* A little more than the extent, so that the largest coordinate is inside. */
    input->cube_size = size > 1e-300 ? size * (1.0 + 0x1p-30) : 1.0;
    for (int a = 0; a < input->attribute_count; a++) {
        vd_import_range r = all->ranges[a];
        if (r.numbers == 0) {
            r.min = r.max = 0.0;
        }
        input->ranges[a] = r;
    }
    return vd_success();
}

vd_status vd_import_scan(vd_context *context, vd_import_reader *reader,
                         const vd_import_progress *progress) {
    const size_t pieces = (reader->batch.capacity + PIECE - 1) / PIECE;
    scan_part *parts = vd_allocate(context, pieces + 1, sizeof *parts);
    if (parts == NULL) {
        return vd_out_of_memory("ranges", (pieces + 1) * sizeof *parts);
    }
    scan_part *all = &parts[pieces];
    empty_part(all);
    scan s = {&reader->batch, reader->input->attribute_count, parts};
    vd_status status = vd_import_reader_rewind(reader);
    while (status.code == VD_OK) {
        status = vd_import_reader_next(reader);
        if (status.code != VD_OK || reader->batch.count == 0) {
            break;
        }
        const int count = (int)((reader->batch.count + PIECE - 1) / PIECE);
        status = vd_parallel_for(context, NULL, count, scan_piece, &s);
        for (int i = 0; i < count; i++) {
            add_part(all, &parts[i]);
        }
        const int source = reader->source < reader->input->source_count
                               ? reader->source
                               : reader->input->source_count - 1;
        const double share = vd_particle_source_progress(reader->input->sources[source]);
        vd_import_report(progress, (source + share) / reader->input->source_count);
        if (status.code == VD_OK && vd_job_stopped(progress->job)) {
            status = vd_failure(VD_ERROR_CANCELLED, "importing was cancelled");
        }
    }
    if (status.code == VD_OK) {
        status = settle(reader->input, all);
    }
    vd_release(context, parts);
    return status;
}
