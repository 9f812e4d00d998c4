/* classic_quality.c: the options filter, mip and smooth of the classic picture, sample by sample as
 * <veduta/classic.h> defines them: what the march's kernels are equal to.
 */
#include <math.h>
#include "core/core.h"
#include "terrain/classic_internal.h"

/* Where a column meets a slice: a cell of the slice's level, its right and lower neighbours, and
 * how far it is to them. */
typedef struct spot {
    const vd_classic_level *level;
    int column[2], row[2];
    float across, down;
} spot;

static bool find_spot(const vd_classic_setup *setup, const vd_classic_slice *slice, int column,
                      spot *out) {
    const vd_classic_level *level = &setup->levels[slice->level];
    float x = (setup->eye_x + slice->z * setup->direction_x[column]) * level->scale;
    float y = (setup->eye_y + slice->z * setup->direction_y[column]) * level->scale;
    int cell_x = vd_classic_wrap(x, level->width, level->x_mask);
    int cell_y = vd_classic_wrap(y, level->height, level->y_mask);
    if ((cell_x | cell_y) < 0) {
        return false;
    }
    spot s = {level,
              {cell_x, cell_x + 1 == level->width ? 0 : cell_x + 1},
              {cell_y, cell_y + 1 == level->height ? 0 : cell_y + 1},
              x - floorf(x),
              y - floorf(y)};
    *out = s;
    return true;
}

static float height_of(const spot *s, vd_height_type type, int column, int row) {
    size_t index = (size_t)s->row[row] * s->level->height_stride + (size_t)s->column[column];
    switch (type) {
    case VD_HEIGHT_U8:
        return ((const uint8_t *)s->level->heights)[index];
    case VD_HEIGHT_U16:
        return ((const uint16_t *)s->level->heights)[index];
    default:
        return ((const float *)s->level->heights)[index];
    }
}

static float lerp(float a, float b, float f) {
    return a + f * (b - a);
}

static float greater(float a, float b) {
    return a < b ? b : a;
}

static float linear_height(const spot *s, vd_height_type type) {
    float h00 = height_of(s, type, 0, 0), h10 = height_of(s, type, 1, 0);
    float h01 = height_of(s, type, 0, 1), h11 = height_of(s, type, 1, 1);
    float h = lerp(lerp(h00, h10, s->across), lerp(h01, h11, s->across), s->down);
    float highest = greater(greater(h00, h10), greater(h01, h11));
    return highest < h ? highest : h;
}

static vd_rgba8 color_of(const spot *s, int column, int row) {
    vd_rgba8 color =
        s->level->colors[(size_t)s->row[row] * s->level->color_stride + (size_t)s->column[column]];
    color.a = 255;
    return color;
}

static vd_rgba8 linear_color(const spot *s) {
    uint32_t across = (uint32_t)(s->across * 256.0f), down = (uint32_t)(s->down * 256.0f);
    return vd_classic_mix(vd_classic_mix(color_of(s, 0, 0), color_of(s, 1, 0), across),
                          vd_classic_mix(color_of(s, 0, 1), color_of(s, 1, 1), across), down);
}

/* Paints a run, as a gradient down to `below` unless that has alpha 0. */
static void paint_run(const vd_classic_setup *setup, int column, int32_t top, int32_t hidden,
                      vd_rgba8 color, vd_rgba8 below, float z) {
    float depth = vd_classic_depth(setup, z);
    uint32_t slope = 65536u / (uint32_t)(hidden - top);
    for (int32_t row = top; row < hidden; row++) {
        vd_rgba8 here =
            below.a == 0 ? color : vd_classic_mix(color, below, (uint32_t)(row - top) * slope >> 8);
        vd_classic_put(setup->frame, column, row, here, depth);
    }
}

void vd_classic_draw_slice_quality(const vd_classic_setup *setup, const vd_classic_slice *slice,
                                   int first, int count, vd_classic_column *columns) {
    for (int i = 0; i < count; i++) {
        spot s;
        if (!find_spot(setup, slice, first + i, &s)) {
            continue;
        }
        vd_classic_column *column = &columns[i];
        float height = setup->linear ? linear_height(&s, setup->height_type)
                                     : height_of(&s, setup->height_type, 0, 0);
        int32_t row =
            vd_classic_truncate((setup->eye_height - height) * slice->rise + setup->horizon);
        int32_t top = row > 0 ? row : 0;
        if (top < column->hidden) {
            vd_rgba8 color = setup->linear ? linear_color(&s) : color_of(&s, 0, 0);
            vd_rgba8 flat = {0, 0, 0, 0};
            paint_run(setup, first + i, top, column->hidden, color,
                      setup->smooth ? column->color : flat, slice->z);
            column->hidden = top;
            column->color = color;
        }
    }
}
