/* world_settings.c: the options of what stands on a terrain and of its furniture. */
#include <string.h>

#include "render_settings.h"

vd_status vd_world_settings_read(const vd_options *options, vd_render_settings *out) {
    const vd_option_value *v = options->values;
    out->lines = v[OPTION_LINES].text;
    out->labels = v[OPTION_LABELS].text;
    out->label_peaks = (int)v[OPTION_LABEL_PEAKS].number;
    out->title = v[OPTION_TITLE].text;
    out->north_arrow = v[OPTION_NORTH_ARROW].number != 0.0;
    out->scale_bar = v[OPTION_SCALE_BAR].number != 0.0;
    out->legend = v[OPTION_LEGEND].number != 0.0;
    if (out->title != NULL && (out->title[0] == '\0' || strlen(out->title) > 1024)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--title: a title of %zu bytes is none; give 1 to 1024",
                          strlen(out->title));
    }
    if (out->legend && out->color != NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "--legend explains the colours of heights, which "
                                             "--color replaces; leave out one of them");
    }
    if (v[OPTION_CAMERA].text != NULL && !out->world) {
        return vd_failure(VD_ERROR_ARGUMENT, "--camera names a camera of a world file, and there "
                                             "is none; name one, such as world.json");
    }
    if (v[OPTION_SAVE].text != NULL && out->world) {
        return vd_failure(VD_ERROR_ARGUMENT, "--save writes options alone, and this is a world; "
                                             "give --save-world");
    }
    if (v[OPTION_SAVE_WORLD].text != NULL && (out->classic || out->is_model)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--save-world writes terrain and what stands on it, and this is %s; "
                          "give --save",
                          out->classic ? "the classic picture" : "a model alone");
    }
    return vd_success();
}
