/* model_settings.c: the options of a model's picture, and which options belong to what. */
#include <ctype.h>
#include <string.h>

#include "render_settings.h"

/* Endings of what the core and assimp read. Those that are also elevation or pictures (.raw, .ter,
 * .xyz, .bvh …) are left out: a file is taken for a model by its name alone, before anything is
 * opened. */
bool vd_is_model_name(const char *path, bool *z_up) {
    static const struct {
        const char *ending;
        bool z_up;
    } endings[] = {
        {"obj", false},     {"ply", false},   {"stl", true},   {"off", false},  {"gltf", false},
        {"glb", false},     {"vrm", false},   {"3mf", true},   {"dae", false},  {"fbx", false},
        {"3ds", false},     {"blend", false}, {"x3d", false},  {"wrl", false},  {"ase", false},
        {"dxf", false},     {"lwo", false},   {"lws", false},  {"ms3d", false}, {"b3d", false},
        {"cob", false},     {"ac", false},    {"ac3d", false}, {"md2", false},  {"md3", false},
        {"md5mesh", false}, {"smd", false},   {"nff", false},  {"ifc", false},  {"irrmesh", false},
        {"x", false},       {"q3o", false},   {"ogex", false}, {"amf", false},
    };
    const char *slash = strrchr(path, '/');
    const char *dot = strrchr(slash != NULL ? slash : path, '.');
    char ending[12] = "";
    for (size_t i = 0; dot != NULL && dot[i] != '\0' && dot[i + 1] != '\0'; i++) {
        if (i + 1 == sizeof ending) {
            return false;
        }
        ending[i] = (char)tolower((unsigned char)dot[i + 1]);
    }
    for (size_t i = 0; i < sizeof endings / sizeof endings[0]; i++) {
        if (strcmp(ending, endings[i].ending) == 0) {
            if (z_up != NULL) {
                *z_up = endings[i].z_up;
            }
            return true;
        }
    }
    return false;
}

/* Refuses what belongs to terrain only; some have a counterpart. */
static vd_status refuse_with_model(const vd_options *options, const char *model) {
    static const struct {
        int option;
        const char *instead;
    } never[] = {{OPTION_METHOD, "--raster chooses how it is drawn"},
                 {OPTION_COLOR, "--texture lays a picture on it"},
                 {OPTION_SHADING, "--shade albedo draws it unlit"},
                 {OPTION_COLORMAP, NULL},
                 {OPTION_SHADOWS, NULL},
                 {OPTION_HAZE, NULL},
                 {OPTION_EXAGGERATE, NULL},
                 {OPTION_CURVATURE, NULL},
                 {OPTION_MISSING, NULL},
                 {OPTION_NODATA, NULL},
                 {OPTION_CELL_SIZE, NULL},
                 {OPTION_HEIGHT_SCALE, NULL},
                 {OPTION_HEIGHT_OFFSET, NULL},
                 {OPTION_HEIGHT_ENCODING, NULL},
                 {OPTION_RAW, NULL},
                 {OPTION_BAND, NULL},
                 {OPTION_BANDS, NULL},
                 {OPTION_EXTENT, NULL},
                 {OPTION_LINES, NULL},
                 {OPTION_LABELS, NULL},
                 {OPTION_LABEL_PEAKS, NULL},
                 {OPTION_TITLE, NULL},
                 {OPTION_NORTH_ARROW, NULL},
                 {OPTION_SCALE_BAR, NULL},
                 {OPTION_LEGEND, NULL}};
    for (size_t i = 0; i < sizeof never / sizeof never[0]; i++) {
        if (vd_options_given(options, never[i].option)) {
            const char *instead = never[i].instead;
            return vd_failure(VD_ERROR_ARGUMENT,
                              "--%s applies to terrain and %.120s is a model; leave it out%s%s",
                              options->table[never[i].option].key, model,
                              instead != NULL ? ": " : "", instead != NULL ? instead : "");
        }
    }
    return vd_success();
}

static vd_status refuse_with_terrain(const vd_options *options) {
    static const int never[] = {OPTION_SHADE,      OPTION_TEXTURE,      OPTION_WIREFRAME,
                                OPTION_POINTS,     OPTION_SHOW_NORMALS, OPTION_LINE_WIDTH,
                                OPTION_POINT_SIZE, OPTION_CULL,         OPTION_WINDING,
                                OPTION_UP,         OPTION_FAR,          OPTION_RASTER};
    for (size_t i = 0; i < sizeof never / sizeof never[0]; i++) {
        if (vd_options_given(options, never[i])) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "--%s applies to models, such as dragon.ply, and this picture is of "
                              "terrain; leave it out",
                              options->table[never[i]].key);
        }
    }
    if (options->values[OPTION_FILTER].number > 1.0) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--filter %s is for the textures of models; give nearest or bilinear",
                          options->values[OPTION_FILTER].text);
    }
    return vd_success();
}

/* The camera where it is not given: in front of the model, a little to its left and above. */
static vd_status settle_camera(const vd_options *options, const char *model,
                               vd_camera_settings *camera) {
    if ((camera->eye.kind != VD_POSITION_NONE && camera->eye.kind != VD_POSITION_WORLD) ||
        (camera->target.kind != VD_POSITION_NONE && camera->target.kind != VD_POSITION_WORLD)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--%s: %.120s is a model and has no latitude and longitude; give X,Y,Z",
                          camera->eye.kind > VD_POSITION_WORLD ? "eye" : "target", model);
    }
    if (!vd_options_given(options, OPTION_AZIMUTH)) {
        camera->azimuth = VD_MODEL_AZIMUTH;
    }
    if (!vd_options_given(options, OPTION_ELEVATION)) {
        camera->elevation = VD_MODEL_ELEVATION;
    }
    if (!vd_options_given(options, OPTION_NEAR)) {
        camera->near_m = 0.0;
    }
    camera->far_m = options->values[OPTION_FAR].number;
    if (camera->far_m > 0.0 && camera->far_m <= camera->near_m) {
        return vd_failure(VD_ERROR_ARGUMENT, "--far %s is not beyond --near %s; give a larger one",
                          options->values[OPTION_FAR].text, options->values[OPTION_NEAR].text);
    }
    return vd_success();
}

vd_status vd_model_settings_read(const vd_options *options, vd_render_settings *out) {
    static const vd_texture_filter filters[] = {VD_TEXTURE_NEAREST, VD_TEXTURE_BILINEAR,
                                                VD_TEXTURE_TRILINEAR, VD_TEXTURE_ANISOTROPIC};
    static const vd_shading shadings[] = {VD_SHADING_PHONG,   VD_SHADING_FLAT, VD_SHADING_DEPTH,
                                          VD_SHADING_NORMALS, VD_SHADING_UV,   VD_SHADING_ID,
                                          VD_SHADING_ALBEDO};
    static const vd_cull culls[] = {VD_CULL_NONE, VD_CULL_BACK, VD_CULL_FRONT};
    if (!out->is_model) {
        return refuse_with_terrain(options);
    }
    vd_status status = refuse_with_model(options, out->inputs[0]);
    if (status.code == VD_OK) {
        status = settle_camera(options, out->inputs[0], &out->camera);
    }
    const vd_option_value *values = options->values;
    vd_model_settings *m = &out->model;
    m->shading = shadings[(int)values[OPTION_SHADE].number];
    m->texture = values[OPTION_TEXTURE].text;
    m->skip_textures = m->texture != NULL;
    if (m->texture != NULL && strcmp(m->texture, "none") == 0) {
        m->texture = NULL;
    }
    const bool wireframe = values[OPTION_WIREFRAME].number != 0.0;
    const bool points = values[OPTION_POINTS].number != 0.0;
    m->ink = (wireframe || points) && !vd_options_given(options, OPTION_SHADE);
    m->fill = wireframe ? VD_FILL_WIREFRAME : points ? VD_FILL_POINTS : VD_FILL_SOLID;
    m->show_normals = values[OPTION_SHOW_NORMALS].number != 0.0;
    m->line_width = values[OPTION_LINE_WIDTH].number;
    m->point_size = values[OPTION_POINT_SIZE].number;
    m->cull = culls[(int)values[OPTION_CULL].number];
    m->winding = (vd_winding)values[OPTION_WINDING].number;
    m->up = (vd_up)values[OPTION_UP].number;
    m->method = (vd_raster_method)values[OPTION_RASTER].number;
    m->filter = vd_options_given(options, OPTION_FILTER)
                    ? filters[(int)values[OPTION_FILTER].number]
                    : VD_TEXTURE_ANISOTROPIC;
    m->sun_given = vd_options_given(options, OPTION_SUN);
    if (status.code == VD_OK && wireframe && points) {
        status = vd_failure(VD_ERROR_ARGUMENT,
                            "--wireframe and --points both say what is drawn; give one of them");
    }
    return status;
}
