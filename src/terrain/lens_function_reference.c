/* lens_function_reference.c: the windows of an endless function as lens_function.h says them, all
 * of every window, one sample at a time. Maxima are left out: the plain method walks every cell. */
#include <string.h>
#include "terrain/lens_function.h"

#define RUN 256 /* samples a call */

static void sample_row(const vd_lens_function *f, const vd_terrain_def *def, const vd_lens_map *map,
                       int level, int row) {
    const vd_lens_ground *g = &map->ground[level];
    float *heights = vd_lens_heights(map, level) + (size_t)row * g->stride;
    uint32_t *texels = vd_lens_texels(map, level) + (ptrdiff_t)row * map->texture[level].stride;
    const double north = -vd_lens_function_at(f->first_row, g->row, row, level, f->cell);
    for (int from = 0; from <= g->columns; from += RUN) {
        const int count = g->columns + 1 - from < RUN ? g->columns + 1 - from : RUN;
        float x[RUN], y[RUN], color[3][RUN];
        float *const planes[3] = {color[0], color[1], color[2]};
        for (int i = 0; i < count; i++) {
            x[i] = (float)vd_lens_function_at(f->first_column, g->column, from + i, level, f->cell);
            y[i] = (float)north;
        }
        vd_function_evaluate(def->function, (size_t)count, x, y, heights + from, planes);
        for (int i = 0; i < count; i++) {
            texels[from + i] = vd_lens_function_color(color[0][i], color[1][i], color[2][i]);
        }
    }
}

static void light_row(const vd_lens_function *f, const vd_terrain_def *def, const vd_lens_map *map,
                      int level, int row) {
    const vd_lens_light *l = f->light;
    uint32_t *texels = vd_lens_texels(map, level) + (ptrdiff_t)row * map->texture[level].stride;
    for (int i = 0; i <= map->ground[level].columns; i++) {
        uint32_t albedo = texels[i];
        if (!vd_function_has_color(def->function)) {
            albedo = l->has_table
                         ? vd_lens_color_at(l, l->heights[(size_t)row * l->stride + (size_t)i])
                         : 0x00BEBEBEu; /* grey */
        }
        texels[i] =
            l->shading ? vd_lens_lit(l, albedo, vd_lens_terms_at(l, i, row)) : albedo | 0xFF000000u;
    }
}

vd_status vd_lens_function_aim_reference(vd_lens_function *f, vd_job *job,
                                         const vd_terrain_def *def, const vd_camera *camera,
                                         int width, int height, vd_lens_map *map) {
    const vd_status status = vd_lens_function_lay_out(f, def, camera, width, height, map);
    map->lowest = map->highest = 0.0f; /* margins of skipping, which there is none of */
    for (int level = 0; status.code == VD_OK && level < map->levels; level++) {
        vd_lens_function_turn(f, def, map, level);
        for (int row = 0; row <= map->ground[level].rows; row++) {
            if (vd_job_stopped(job)) {
                return vd_failure(VD_ERROR_CANCELLED, "the job was cancelled or ran out of time");
            }
            sample_row(f, def, map, level, row);
        }
        for (int row = 0; row <= map->ground[level].rows; row++) {
            light_row(f, def, map, level, row);
        }
    }
    return status;
}
