/* classic_reference.c: the classic picture as published, and nothing more.
 *
 * Front to back, slice by slice; in each slice column by column from left to right; a hidden row
 * per column (Freeman 1996; FutSpace thesis 2020, listing A.1; the serial version of the
 * OpenMP/CUDA report). It does not stop when a column is full, because the published loop does not.
 * Every other method is measured against its time and compared with its bytes.
 */
#include "core/core.h"
#include "terrain/classic_internal.h"

VD_CLASSIC_INLINE bool draw(const vd_classic_setup *setup, vd_classic_column *columns,
                            vd_height_type type) {
    int width = setup->frame->width;
    vd_classic_slice slice = vd_classic_slice_first(setup);
    while (slice.k < setup->slice_count) {
        if (vd_job_stopped(setup->job)) {
            return false;
        }
        vd_classic_draw_slice(setup, &slice, 0, width, columns, type);
        vd_classic_slice_next(setup, &slice);
        vd_job_report(setup->job, (int)slice.k, (int)setup->slice_count);
    }
    return true;
}

/* One copy of the loop per height type. */
static bool draw_u8(const vd_classic_setup *setup, vd_classic_column *columns) {
    return draw(setup, columns, VD_HEIGHT_U8);
}

static bool draw_u16(const vd_classic_setup *setup, vd_classic_column *columns) {
    return draw(setup, columns, VD_HEIGHT_U16);
}

static bool draw_f32(const vd_classic_setup *setup, vd_classic_column *columns) {
    return draw(setup, columns, VD_HEIGHT_F32);
}

vd_status vd_classic_draw_reference(const vd_classic_setup *setup, vd_classic_counts *counts) {
    static bool (*const draws[VD_HEIGHT_TYPE_COUNT])(
        const vd_classic_setup *, vd_classic_column *) = {draw_u8, draw_u16, draw_f32};
    (void)counts;
    vd_classic_column *columns = vd_classic_columns_create(setup);
    if (columns == NULL) {
        return vd_out_of_memory("the hidden rows", (size_t)setup->frame->width * sizeof *columns);
    }
    bool finished = draws[setup->height_type](setup, columns);
    vd_release(setup->context, columns);
    return finished ? vd_success() : vd_classic_cancelled();
}
