/* classic_columns.c: the classic picture with the columns spread over the threads.
 *
 * Columns never depend on each other, so one parallel loop is enough: a thread takes a block of
 * adjacent columns through all slices, then the next block. A block is as wide as a cache line of
 * the frame: no two threads write to one line, which is what made the published version slower with
 * more cores ("false sharing", docs/voxel-space.md). Inside a block the slices stay outside, so
 * that the divisions of a slice are shared by its columns and neighbours read neighbouring cells.
 */
#include <stdatomic.h>
#include "core/core.h"
#include "terrain/classic_internal.h"

/* Slices between two looks at the job, about 200 µs. */
#define POLL_SLICES 4096

typedef struct picture {
    const vd_classic_setup *setup;
    atomic_bool interrupted;
} picture;

VD_CLASSIC_INLINE void draw(picture *p, int index, vd_height_type type) {
    const vd_classic_setup *setup = p->setup;
    int first = index * VD_CLASSIC_BLOCK;
    int count = setup->frame->width - first;
    count = count < VD_CLASSIC_BLOCK ? count : VD_CLASSIC_BLOCK;
    vd_classic_column columns[VD_CLASSIC_BLOCK];
    for (int i = 0; i < VD_CLASSIC_BLOCK; i++) {
        columns[i] = vd_classic_column_first(setup);
    }
    vd_classic_slice slice = vd_classic_slice_first(setup);
    while (slice.k < setup->slice_count) {
        if (slice.k % POLL_SLICES == 0 && vd_job_stopped(setup->job)) {
            atomic_store(&p->interrupted, true);
            return;
        }
        vd_classic_draw_slice(setup, &slice, first, count, columns, type);
        vd_classic_slice_next(setup, &slice);
    }
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

vd_status vd_classic_draw_columns(const vd_classic_setup *setup, vd_classic_counts *counts) {
    static vd_task_function *const draws[VD_HEIGHT_TYPE_COUNT] = {draw_u8, draw_u16, draw_f32};
    (void)counts;
    picture p = {setup, false};
    int blocks = (setup->frame->width + VD_CLASSIC_BLOCK - 1) / VD_CLASSIC_BLOCK;
    vd_status status =
        vd_parallel_for(setup->context, setup->job, blocks, draws[setup->height_type], &p);
    if (status.code == VD_ERROR_CANCELLED || atomic_load(&p.interrupted)) {
        return vd_classic_cancelled();
    }
    return status;
}
