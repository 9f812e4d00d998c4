/* terrain.c: the lens methods' def, the call that draws one picture, and what it will take. */
#include <math.h>
#include <string.h>
#include "core/core.h"
#include "terrain/heightfield_block.h"
#include "terrain/lens_renderer.h"

vd_terrain_def vd_terrain_def_default(void) {
    vd_terrain_def def;
    memset(&def, 0, sizeof def);
    def.light = vd_light_daylight(5.497787143782138, 0.7853981633974483);
    def.method = VD_TERRAIN_MARCH;
    def.filter = VD_FILTER_LINEAR;
    def.mip = true;
    def.samples = 4;
    def.cell_m = 1.0;
    def.exaggeration = 1.0;
    def.shading = true;
    def.shadows = true;
    def.sky = true;
    def.object_id = 1;
    return def;
}

const char *vd_terrain_method_name(vd_terrain_method method) {
    static const char *const names[VD_TERRAIN_METHOD_COUNT] = {"march", "raycast"};
    return method >= 0 && method < VD_TERRAIN_METHOD_COUNT ? names[method] : "unknown";
}

double vd_curvature_drop(double distance_m) {
    return (1.0 - 0.13) / (2.0 * 6371008.8) * distance_m * distance_m;
}

static vd_status check_window(const vd_terrain_def *def) {
    const vd_terrain_window *w = &def->window;
    const vd_heightfield *h = def->heightfield;
    const bool all = w->columns == 0 && w->rows == 0;
    if (h == NULL) {
        return all ? vd_success()
                   : vd_failure(VD_ERROR_ARGUMENT, "the terrain is a function, which has no window "
                                                   "of cells; leave the window 0");
    }
    if (all || (w->column >= 0 && w->row >= 0 && w->columns > 0 && w->rows > 0 &&
                w->columns <= h->width - 1 - w->column && w->rows <= h->height - 1 - w->row)) {
        return vd_success();
    }
    return vd_failure(VD_ERROR_ARGUMENT,
                      "the terrain's window is %d x %d cells at (%d, %d), but the map has %d x %d; "
                      "give a part of it, or 0 for all",
                      w->columns, w->rows, w->column, w->row, h->width - 1, h->height - 1);
}

static vd_status check_ground(const vd_terrain_def *def) {
    if ((def->heightfield == NULL) == (def->function == NULL)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the terrain has %s a heightfield %s a function; set "
                          "one of them",
                          def->function == NULL ? "neither" : "both",
                          def->function == NULL ? "nor" : "and");
    }
    if (def->function != NULL && !(def->cell_m > 0.0 && def->cell_m < 1e9)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the terrain's cell_m is %g m; give the size of the function's finest "
                          "cells, above 0 and below 1e9",
                          def->cell_m);
    }
    if (def->function != NULL && !(def->far_m >= 0.0 && def->far_m < 1e9)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the terrain's far_m is %g m; give 0 (automatic) to 1e9", def->far_m);
    }
    return vd_success();
}

vd_status vd_terrain_check(const vd_terrain_def *def) {
    const vd_status ground = check_ground(def);
    if (ground.code != VD_OK) {
        return ground;
    }
    if ((unsigned)def->method >= VD_TERRAIN_METHOD_COUNT) {
        return vd_failure(VD_ERROR_ARGUMENT, "the terrain's method %d is unknown",
                          (int)def->method);
    }
    if ((unsigned)def->filter >= VD_FILTER_COUNT) {
        return vd_failure(VD_ERROR_ARGUMENT, "the terrain's filter %d is unknown",
                          (int)def->filter);
    }
    if ((unsigned)def->antialias >= VD_ANTIALIAS_COUNT) {
        return vd_failure(VD_ERROR_ARGUMENT, "the terrain's antialias %d is unknown",
                          (int)def->antialias);
    }
    if (vd_sample_offsets(def->samples) == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "the terrain's samples are %d; give 1, 4 or 8",
                          def->samples);
    }
    if (!(def->exaggeration > 0.0) || !isfinite(def->exaggeration)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the terrain's exaggeration is %g; give a finite number above 0",
                          def->exaggeration);
    }
    if (!(def->light.haze_m >= 0.0)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the terrain's haze distance is %g m; give 0 (no haze) or more",
                          def->light.haze_m);
    }
    return check_window(def);
}

vd_status vd_terrain_render(vd_context *context, vd_job *job, const vd_terrain_def *def,
                            const vd_camera *camera, vd_frame *frame, vd_frame_stats *stats) {
    vd_terrain_renderer *renderer = NULL;
    vd_status status = vd_camera_validate(camera);
    if (status.code == VD_OK) {
        status = vd_terrain_renderer_create(context, job, def, &renderer);
    }
    if (status.code == VD_OK) {
        status = vd_terrain_renderer_draw(renderer, job, camera, frame, stats);
    }
    vd_terrain_renderer_destroy(&renderer);
    return status;
}

/* ---- what a picture will take ---------------------------------------------------------------- */

/* Draws every step-th of `tiles` tiles, in batches that are each spread over the whole picture, and
 * tells how long all tiles would take. What the tiles cost is their processor time, which hardly
 * depends on what else runs; how much longer that takes on the clock is the median of the batches,
 * so that a pause in one of them does not count. */
static vd_status measure_tiles(vd_terrain_renderer *renderer, vd_job *job, const vd_camera *camera,
                               vd_frame *frame, int tiles, int step, double *seconds) {
    enum { MOST = 9, TILES_A_BATCH = 16 };
    const int count = (tiles + step - 1) / step;
    int batches = count / TILES_A_BATCH < MOST ? count / TILES_A_BATCH : MOST;
    batches = batches < 1 ? 1 : batches;
    double stretch[MOST], busy = 0.0, wall = 0.0;
    for (int b = 0; b < batches; b++) {
        const vd_lens_tiles some = {b * step, batches * step, (count - b + batches - 1) / batches,
                                    NULL};
        const uint64_t start_ns = vd_clock_ns(), start_busy_ns = vd_processor_ns();
        vd_status status = vd_lens_draw(renderer, job, camera, 1, &some, frame, NULL);
        if (status.code != VD_OK) {
            return status;
        }
        const double busy_here = (double)(vd_processor_ns() - start_busy_ns);
        const double wall_here = (double)(vd_clock_ns() - start_ns);
        const double here = busy_here > 0.0 ? wall_here / busy_here : 1.0;
        int at = b; /* kept in order */
        for (; at > 0 && stretch[at - 1] > here; at--) {
            stretch[at] = stretch[at - 1];
        }
        stretch[at] = here;
        busy += busy_here;
        wall += wall_here;
    }
    const double ns = busy > 0.0 ? busy * stretch[batches / 2] : wall;
    *seconds = ns * 1e-9 * tiles / count;
    return vd_success();
}

vd_status vd_terrain_estimate(vd_context *context, vd_job *job, const vd_terrain_def *def,
                              const vd_camera *camera, int width, int height, double *seconds,
                              size_t *bytes) {
    vd_frame *frame = NULL;
    vd_terrain_renderer *renderer = NULL;
    vd_status status = vd_camera_validate(camera);
    if (status.code == VD_OK) {
        status = vd_frame_create(context, width, height, 0, &frame);
    }
    const size_t before = vd_context_memory(context).bytes_now;
    const uint64_t start_ns = vd_clock_ns();
    vd_context_memory_reset_peak(context);
    if (status.code == VD_OK) {
        status = vd_terrain_renderer_create(context, job, def, &renderer);
    }
    if (status.code == VD_OK) {
        status = vd_lens_prepare(renderer, job, camera, width, height);
    }
    const double setup = (double)(vd_clock_ns() - start_ns) * 1e-9;
    const int tiles_x = vd_lens_tile_count(width), tiles = tiles_x * vd_lens_tile_count(height);
    /* At least 192 tiles, and a step that does not walk down one column. */
    int step = tiles / 192 < 16 ? tiles / 192 : 16;
    step = step < 1 ? 1 : step;
    while (step > 1 && tiles_x % step == 0) {
        step--;
    }
    double drawing = 0.0;
    if (status.code == VD_OK) {
        status = measure_tiles(renderer, job, camera, frame, tiles, step, &drawing);
    }
    if (status.code == VD_OK) {
        *seconds = setup + drawing;
        *bytes = vd_context_memory(context).bytes_peak - before;
    }
    vd_terrain_renderer_destroy(&renderer);
    vd_frame_destroy(&frame);
    return status;
}

static vd_status explain_empty_function(const vd_terrain_def *def, const vd_camera *camera) {
    const float x = (float)camera->eye.x, y = (float)camera->eye.y;
    float ground;
    vd_function_evaluate(def->function, 1, &x, &y, &ground, NULL);
    if (camera->eye.z < ground * def->exaggeration) {
        return vd_failure(VD_ERROR_EMPTY,
                          "the picture is empty: the camera is under ground, at %.10g m where the "
                          "function is at %.10g m; raise it",
                          camera->eye.z, ground * def->exaggeration);
    }
    return vd_failure(VD_ERROR_EMPTY, "the picture is empty: the camera looks away from the "
                                      "function, or it has no height where the camera looks; turn "
                                      "or move it");
}

vd_status vd_terrain_explain_empty(const vd_terrain_def *def, const vd_camera *camera, int width,
                                   int height) {
    const vd_heightfield *h = def->heightfield;
    if (h == NULL) {
        return explain_empty_function(def, camera);
    }
    if (h->holes == (uint64_t)h->width * (uint64_t)h->height) {
        return vd_failure(VD_ERROR_EMPTY, "the picture is empty: every height is missing (nodata); "
                                          "check the file's nodata value");
    }
    const double ground = vd_heightfield_height_at(h, camera->eye.x, camera->eye.y);
    if (camera->eye.z < ground * def->exaggeration) {
        return vd_failure(VD_ERROR_EMPTY,
                          "the picture is empty: the camera is under ground, at %.10g m where the "
                          "ground is at %.10g m; raise it",
                          camera->eye.z, ground * def->exaggeration);
    }
    vd_vec3 min, max;
    vd_heightfield_bounds(h, &min, &max);
    min.z *= def->exaggeration;
    max.z *= def->exaggeration;
    vd_frustum frustum = vd_camera_frustum(camera, width, height);
    const bool touches = vd_frustum_touches_box(&frustum, min, max);
    frustum.planes[4].offset -= camera->near_m; /* the near plane, moved to the eye */
    if (!touches && vd_frustum_touches_box(&frustum, min, max)) {
        return vd_failure(VD_ERROR_EMPTY,
                          "the picture is empty: all of the terrain lies before the near plane, "
                          "%.10g m from the camera, where nothing is drawn; bring it nearer",
                          camera->near_m);
    }
    if (!touches) {
        return vd_failure(VD_ERROR_EMPTY,
                          "the picture is empty: the camera at %.10g, %.10g, %.10g m looks away "
                          "from the terrain (x %.10g … %.10g, y %.10g … %.10g m); turn or move it",
                          camera->eye.x, camera->eye.y, camera->eye.z, min.x, max.x, min.y, max.y);
    }
    if (camera->eye.z < max.z) {
        return vd_failure(VD_ERROR_EMPTY, "the picture is empty: no ray of the camera meets the "
                                          "terrain from above; raise it or look further down");
    }
    return vd_failure(VD_ERROR_EMPTY, "the picture is empty: the terrain is beside the view, under "
                                      "the horizon or in the missing samples; turn or move the "
                                      "camera");
}
