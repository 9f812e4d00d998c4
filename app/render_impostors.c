/* render_impostors.c: a camera that rests, looked through until nothing changes any more. */
#include "render_impostors.h"

/* Updates, a 60th of a second apart; children wait for parents, level by level. */
enum { MOST_UPDATES = 120 };

static vd_impostor_def def_of(const vd_render_settings *s) {
    vd_impostor_def def = vd_impostor_def_default();
    /* Of a tolerance of 0 every picture would always be drawn anew; what was made for this very
     * camera is as right as can be. */
    def.tolerance_px = s->tolerance_px > 1e-6 ? s->tolerance_px : 1e-6;
    def.samples = s->samples;
    def.budget_s = 1e9;
    def.settle = !s->moving;
    def.show = s->show;
    return def;
}

static vd_status describe(vd_render_run *run, const vd_impostor_stats *s, int updates,
                          bool settled) {
    run->impostors =
        json_pack("{s: I, s: I, s: I, s: I, s: i, s: b, s: f, s: f, s: I, s: I}", "shown",
                  (json_int_t)s->shown, "reused", (json_int_t)s->reused, "direct",
                  (json_int_t)s->direct, "uploads", (json_int_t)s->uploads, "updates", updates,
                  "settled", (int)settled, "overdraw", s->overdraw, "error_px", s->error_px,
                  "failed", (json_int_t)s->failed, "bytes", (json_int_t)s->bytes);
    return run->impostors != NULL
               ? vd_success()
               : vd_failure(VD_ERROR_MEMORY, "out of memory while describing the impostors");
}

/* Whether there is neither a picture, nor a thing, nor ground that was drawn itself. */
static bool is_empty(const vd_frame *frame, const vd_impostor_stats *stats) {
    bool any = stats->shown > 0 || stats->direct > 0;
    for (int y = 0; y < frame->height && !any; y++) {
        const float *depth = frame->depth + (size_t)y * frame->stride;
        for (int x = 0; x < frame->width && !any; x++) {
            any = depth[x] > 0.0f;
        }
    }
    return !any;
}

static vd_status not_at_rest(const vd_impostor_stats *stats) {
    if (stats->failed > 0) {
        return vd_failure(
            VD_ERROR_LIMIT,
            "something in the world cannot be drawn; leave out --impostors to be told "
            "what");
    }
    return vd_failure(VD_ERROR_LIMIT,
                      "the impostors of this view do not come to rest: they take %.0f MiB; leave "
                      "out --impostors, or give a smaller --size",
                      (double)stats->bytes / 1048576.0);
}

vd_status vd_render_by_impostors(vd_render_run *run, vd_world_scene *scene,
                                 vd_world_renderer *renderer, const vd_camera *camera,
                                 bool *empty) {
    const vd_render_settings *s = run->settings;
    const vd_impostor_def def = def_of(s);
    vd_impostors *impostors = NULL;
    vd_impostor_stats stats = {.shown = 0};
    int updates = 0;
    bool done = false;
    vd_status status = vd_impostors_create(run->context, scene->world, renderer, &def, &impostors);
    while (status.code == VD_OK && !done && updates < MOST_UPDATES) {
        status = vd_impostors_update(impostors, run->job, camera, s->width, s->height,
                                     updates++ / 60.0, &stats);
        const bool resting = stats.drawn == 0 && stats.waiting == 0;
        done = s->moving ? resting : vd_impostors_settled(impostors);
    }
    const bool settled = status.code == VD_OK && vd_impostors_settled(impostors);
    if (status.code == VD_OK && !done) {
        status = not_at_rest(&stats);
    }
    if (status.code == VD_OK) {
        status = vd_impostors_draw(impostors, run->job, camera, run->frame, &stats);
    }
    if (status.code == VD_OK) {
        *empty = is_empty(run->frame, &stats);
        status = describe(run, &stats, updates, settled);
    }
    vd_impostors_destroy(&impostors);
    return status;
}
