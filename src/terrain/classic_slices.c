/* classic_slices.c: the published OpenMP version of the classic picture.
 *
 * The loop over the columns of each slice is cut into as many equal runs as there are threads, as
 * `#pragma omp parallel for` does. That makes one parallel region per slice: 99,990 in the
 * published scene, each with a microsecond or two of work and a wait at its end. It is here to be
 * measured against; docs/voxel-space.md says what it costs.
 */
#include "core/core.h"
#include "terrain/classic_internal.h"

typedef struct region {
    const vd_classic_setup *setup;
    const vd_classic_slice *slice;
    vd_classic_column *columns;
    int pieces;
} region;

VD_CLASSIC_INLINE void draw(const region *r, int index, vd_height_type type) {
    int64_t width = r->setup->frame->width;
    int first = (int)(width * index / r->pieces);
    int end = (int)(width * (index + 1) / r->pieces);
    vd_classic_draw_slice(r->setup, r->slice, first, end - first, r->columns + first, type);
}

static void draw_u8(void *user, int index, int worker) {
    (void)worker;
    draw(user, index, VD_HEIGHT_U8);
}

static void draw_u16(void *user, int index, int worker) {
    (void)worker;
    draw(user, index, VD_HEIGHT_U16);
}

static void draw_f32(void *user, int index, int worker) {
    (void)worker;
    draw(user, index, VD_HEIGHT_F32);
}

vd_status vd_classic_draw_slices(const vd_classic_setup *setup, vd_classic_counts *counts) {
    static vd_task_function *const draws[VD_HEIGHT_TYPE_COUNT] = {draw_u8, draw_u16, draw_f32};
    (void)counts;
    vd_classic_column *columns = vd_classic_columns_create(setup);
    if (columns == NULL) {
        return vd_out_of_memory("the hidden rows", (size_t)setup->frame->width * sizeof *columns);
    }
    vd_status status = vd_success();
    vd_classic_slice slice = vd_classic_slice_first(setup);
    region r = {setup, &slice, columns, vd_context_threads(setup->context)};
    while (slice.k < setup->slice_count && status.code == VD_OK) {
        if (vd_job_stopped(setup->job)) {
            status = vd_classic_cancelled();
        } else {
            /* Without the job: a slice is drawn whole or not at all, and the job's progress would
             * run from 0 to 1 in every slice. */
            status = vd_parallel_for(setup->context, NULL, r.pieces, draws[setup->height_type], &r);
            vd_classic_slice_next(setup, &slice);
            vd_job_report(setup->job, (int)slice.k, (int)setup->slice_count);
        }
    }
    vd_release(setup->context, columns);
    return status;
}
