/* camera_settings.c: the three spellings of a camera, as options and as texts. */
#include "render_settings.h"

#include <string.h>

/* World metres beyond this say nothing about terrain: no map that is read is as large. */
static const double farthest_m = 1e15;

static bool is_near_enough(double metres) {
    return metres >= -farthest_m && metres <= farthest_m;
}

/* Reads X,Y,Z, or LAT,LON with a height that says its unit. */
static bool read_position(const char *text, vd_position *out) {
    int count = vd_read_numbers(text, out->v, 3);
    if (count == 3) {
        out->kind = VD_POSITION_WORLD;
        return is_near_enough(out->v[0]) && is_near_enough(out->v[1]) && is_near_enough(out->v[2]);
    }
    char copy[160];
    if (strlen(text) >= sizeof copy) {
        return false;
    }
    strcpy(copy, text);
    out->kind = VD_POSITION_ABOVE_GROUND;
    out->v[2] = 0.0;
    if (count < 0) {
        char *height = strrchr(copy, ',');
        if (height == NULL) {
            return false;
        }
        *height++ = '\0';
        if (vd_ends_with(height, "masl")) {
            out->kind = VD_POSITION_ABOVE_SEA;
            height[strlen(height) - 3] = '\0';
        }
        if (!vd_read_distance(height, &out->v[2])) {
            return false;
        }
    }
    /* Data may begin at longitude -180, 0 or beside 180; a turn more than that still is a place. */
    return vd_read_numbers(copy, out->v, 2) == 2 && out->v[0] >= -90.0 && out->v[0] <= 90.0 &&
           out->v[1] >= -720.0 && out->v[1] <= 720.0 && is_near_enough(out->v[2]);
}

static vd_status refuse_together(const vd_options *options, int given, const int *others,
                                 int count) {
    for (int i = 0; i < count; i++) {
        if (vd_options_given(options, others[i])) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "--%s and --%s belong to different ways of saying "
                              "where the camera is; give one of them",
                              options->table[given].key, options->table[others[i]].key);
        }
    }
    return vd_success();
}

/* Finds which of the three spellings the options make up. */
static vd_status read_spelling(const vd_options *options, vd_camera_settings *out) {
    static const int orbit[] = {OPTION_AZIMUTH, OPTION_ELEVATION, OPTION_DISTANCE};
    static const int angles[] = {OPTION_HEADING, OPTION_PITCH};
    bool turned =
        vd_options_given(options, OPTION_HEADING) || vd_options_given(options, OPTION_PITCH);
    if (!vd_options_given(options, OPTION_EYE)) {
        out->spelling = VD_SPELLING_ORBIT;
        if (turned) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "--%s needs --eye; around a target the camera is "
                              "turned by --azimuth and --elevation",
                              vd_options_given(options, OPTION_HEADING) ? "heading" : "pitch");
        }
        return vd_success();
    }
    vd_status status = refuse_together(options, OPTION_EYE, orbit, 3);
    if (status.code == VD_OK && vd_options_given(options, OPTION_TARGET)) {
        status = refuse_together(options, OPTION_TARGET, angles, 2);
    }
    out->spelling = turned ? VD_SPELLING_ANGLES : VD_SPELLING_LOOK_AT;
    return status;
}

vd_status vd_render_prefer_flags(vd_options *options) {
    enum { MOST = 4, NONE = -1 };
    static const struct {
        int flags[MOST], dropped[MOST]; /* any of the flags drops these */
    } rules[] = {
        {{OPTION_EYE, OPTION_HEADING, OPTION_PITCH, NONE},
         {OPTION_AZIMUTH, OPTION_ELEVATION, OPTION_DISTANCE, NONE}},
        {{OPTION_AZIMUTH, OPTION_ELEVATION, OPTION_DISTANCE, NONE},
         {OPTION_EYE, OPTION_HEADING, OPTION_PITCH, NONE}},
        {{OPTION_TARGET, NONE}, {OPTION_HEADING, OPTION_PITCH, NONE}},
        {{OPTION_HEADING, OPTION_PITCH, NONE}, {OPTION_TARGET, NONE}},
        {{OPTION_COLOR, NONE}, {OPTION_COLORMAP, NONE}},
        {{OPTION_COLORMAP, NONE}, {OPTION_COLOR, NONE}},
        {{OPTION_BACKGROUND, NONE}, {OPTION_SKY, NONE}},
        {{OPTION_SKY, NONE}, {OPTION_BACKGROUND, NONE}},
    };
    vd_status status = vd_success();
    for (size_t i = 0; i < sizeof rules / sizeof rules[0]; i++) {
        bool by_flag = false;
        for (int j = 0; rules[i].flags[j] != NONE; j++) {
            by_flag |= options->values[rules[i].flags[j]].source == VD_SOURCE_FLAG;
        }
        for (int j = 0; by_flag && rules[i].dropped[j] != NONE && status.code == VD_OK; j++) {
            status = vd_options_drop_file_value(options, rules[i].dropped[j]);
        }
    }
    return status;
}

vd_status vd_camera_settings_read(const vd_options *options, vd_camera_settings *out) {
    vd_status status = read_spelling(options, out);
    if (status.code != VD_OK) {
        return status;
    }
    const char *eye = options->values[OPTION_EYE].text,
               *target = options->values[OPTION_TARGET].text;
    if (eye != NULL &&
        (vd_read_numbers(eye, out->eye.v, 3) == 2 || !read_position(eye, &out->eye))) {
        return vd_failure(
            VD_ERROR_ARGUMENT,
            "--eye: \"%.60s\" is not a position; give X,Y,Z in "
            "metres (up to 1e15), or LAT,LON with a height: 45.83,6.86,2m above ground, "
            "45.83,6.86,3000masl above sea level",
            eye);
    }
    if (target != NULL && !read_position(target, &out->target)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--target: \"%.60s\" is not a position; give X,Y,Z in "
                          "metres (up to 1e15), or LAT,LON in degrees",
                          target);
    }
    out->azimuth = options->values[OPTION_AZIMUTH].number;
    out->elevation = options->values[OPTION_ELEVATION].number;
    out->elevation_given = vd_options_given(options, OPTION_ELEVATION);
    out->distance_m = options->values[OPTION_DISTANCE].number;
    out->heading = options->values[OPTION_HEADING].number;
    out->pitch = options->values[OPTION_PITCH].number;
    out->roll = options->values[OPTION_ROLL].number;
    out->fov = options->values[OPTION_FOV].number;
    out->near_m = options->values[OPTION_NEAR].number;
    out->projection = (vd_projection)options->values[OPTION_PROJECTION].number;
    if (out->projection == VD_PROJECTION_ORTHOGRAPHIC && out->spelling == VD_SPELLING_ANGLES) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--projection orthographic needs a target to take its "
                          "scale from; give --target, or --azimuth and --elevation");
    }
    return vd_success();
}
