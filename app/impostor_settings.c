/* impostor_settings.c: the options of impostors in `veduta render` and `veduta view`. */
#include "render_settings.h"

/* Why there can be no impostors; null where there can. */
static const char *reason_against(const vd_options *options, const vd_render_settings *s) {
    if (s->classic) {
        return "stand in for parts of a world, and --classic draws a map of its own; leave out one "
               "of them";
    }
    if (s->is_model) {
        return "stand in for parts of a world, and this is a model alone; name a world file that "
               "has it among its \"objects\"";
    }
    if (s->camera.projection == VD_PROJECTION_ORTHOGRAPHIC) {
        return "are shown in perspective; leave out --projection orthographic, whose parallel rays "
               "have no parallax to wait for";
    }
    if (s->ids != NULL) {
        return "are pictures of many objects, which have no single id; leave out --ids";
    }
    if (s->depth != NULL && vd_options_given(options, OPTION_SHOW)) {
        return "under --show are pictures without depth; leave out --depth or --show";
    }
    if (s->dry_run) {
        return "are made by drawing, which --dry-run does not; leave out one of them";
    }
    return NULL;
}

vd_status vd_impostor_settings_read(const vd_options *options, vd_render_settings *out) {
    static const int parts[] = {OPTION_TOLERANCE, OPTION_SHOW};
    out->impostors = options->values[OPTION_IMPOSTORS].number != 0.0;
    out->tolerance_px = options->values[OPTION_TOLERANCE].number;
    out->moving = vd_options_given(options, OPTION_SHOW);
    out->show = (vd_impostor_show)options->values[OPTION_SHOW].number;
    for (int i = 0; i < 2 && !out->impostors; i++) {
        if (vd_options_given(options, parts[i])) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "--%s is about impostors, and there are none; add --impostors, or "
                              "leave it out",
                              options->table[parts[i]].key);
        }
    }
    const char *reason = out->impostors ? reason_against(options, out) : NULL;
    return reason == NULL ? vd_success()
                          : vd_failure(VD_ERROR_ARGUMENT, "--impostors: impostors %s", reason);
}
