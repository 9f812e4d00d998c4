/* info_model.c: what a model holds. */
#include "info_model.h"

#include <stdio.h>

#include "model_file.h"
#include "model_view.h"

/* The flags of the view that frames it, in the numbers that a render would print. */
static vd_status suggest_view(const vd_model *model, char *flags, size_t flags_bytes) {
    vd_placed_model placed = vd_place_model(model, VD_UP_AUTO);
    vd_camera_settings settings = vd_model_camera_default();
    vd_view view;
    double nearest = 0.0, farthest = 0.0;
    vd_status status =
        vd_model_view_make(&placed, &settings, 1920, 1080, &view, &nearest, &farthest);
    if (status.code == VD_OK) {
        const double *t = view.exact.target.v;
        (void)snprintf(flags, flags_bytes,
                       "--target %.10g,%.10g,%.10g --azimuth %g --elevation %g --distance %.6g",
                       t[0], t[1], t[2], view.exact.azimuth, view.exact.elevation,
                       view.exact.distance_m);
    }
    return status;
}

static void print_materials(const vd_model *model) {
    const vd_mesh *mesh = model->meshes[VD_TOPOLOGY_TRIANGLES];
    static const char *const modes[] = {"", ", alpha-tested", ", transparent"};
    for (uint32_t i = 0; mesh != NULL && i < mesh->part_count; i++) {
        const vd_mesh_part *part = &vd_mesh_parts(mesh)[i];
        const vd_model_surface *s = &model->surfaces[part->material];
        const vd_linear c = model->materials[part->material].albedo;
        printf("material    %s: %u triangles, colour %02X%02X%02X%s%s%s\n",
               s->name[0] != '\0' ? s->name : "(no name)", part->count,
               (unsigned)vd_round_16_to_8(vd_srgb_encode(c.r)),
               (unsigned)vd_round_16_to_8(vd_srgb_encode(c.g)),
               (unsigned)vd_round_16_to_8(vd_srgb_encode(c.b)), modes[s->alpha_mode],
               s->texture >= 0 ? ", " : "",
               s->texture >= 0 ? model->texture_names[s->texture] : "");
    }
    for (int i = 0; i < model->texture_count; i++) {
        int width = 0, height = 0;
        (void)vd_texture_level_texels(model->textures[i], 0, &width, &height);
        printf("texture     %s, %d x %d\n", model->texture_names[i], width, height);
    }
}

static bool print_people(const char *path, const vd_model *model, const char *flags) {
    unsigned counts[VD_TOPOLOGY_COUNT] = {0, 0, 0}, vertices = 0;
    bool uv = false;
    for (int i = 0; i < VD_TOPOLOGY_COUNT; i++) {
        const vd_mesh *mesh = model->meshes[i];
        counts[i] = mesh != NULL ? mesh->primitive_count : 0;
        vertices += mesh != NULL ? mesh->vertex_count : 0;
        uv = uv || (mesh != NULL && mesh->uv >= 0);
    }
    vd_vec3 min = {0, 0, 0}, max = {0, 0, 0};
    vd_model_bounds(model, &min, &max);
    printf("file        %s\n", path);
    printf("format      %s\n", model->format);
    printf("vertices    %u\n", vertices);
    printf("triangles   %u%s\n", counts[VD_TOPOLOGY_TRIANGLES],
           model->computed_normals ? ", normals computed" : "");
    if (model->flat_triangles > 0) {
        printf("no area     %llu triangles\n", (unsigned long long)model->flat_triangles);
    }
    if (counts[VD_TOPOLOGY_LINES] > 0) {
        printf("lines       %u\n", counts[VD_TOPOLOGY_LINES]);
    }
    if (counts[VD_TOPOLOGY_POINTS] > 0) {
        printf("points      %u\n", counts[VD_TOPOLOGY_POINTS]);
    }
    printf("has         %s%s%s\n", uv ? "texture coordinates" : "",
           uv && model->has_colors ? ", " : "",
           model->has_colors ? "colours"
           : uv              ? ""
                             : "plain positions");
    print_materials(model);
    printf("bounds      %.6g %.6g %.6g to %.6g %.6g %.6g\n", min.x, min.y, min.z, max.x, max.y,
           max.z);
    printf("size        %.6g x %.6g x %.6g\n", max.x - min.x, max.y - min.y, max.z - min.z);
    printf("up          %c (by custom of the format; --up says otherwise)\n",
           model->z_up ? 'z' : 'y');
    printf("view        %s\n", flags);
    return fflush(stdout) == 0 && !ferror(stdout);
}

static bool print_json(const char *path, const vd_model *model, const char *flags,
                       const vd_notes *notes) {
    json_t *root =
        json_pack("{s: s, s: o, s: s, s: O}", "file", path, "model", vd_model_describe(model),
                  "view_flags", flags, "warnings", notes->list);
    const bool printed = root != NULL && vd_print_json(root);
    json_decref(root);
    return printed;
}

vd_status vd_info_model(vd_context *context, const char *path, bool json, const vd_notes *notes) {
    vd_model *model = NULL;
    char flags[512] = "";
    vd_status status = vd_model_open(context, path, false, &model);
    if (status.code == VD_ERROR_IO || status.code == VD_ERROR_UNSUPPORTED) {
        /* Of a model whose textures are not there the rest can still be told. */
        vd_status without = vd_model_open(context, path, true, &model);
        if (without.code == VD_OK) {
            vd_log(context, VD_LOG_WARNING, "%.360s", status.message);
            status = without;
        }
    }
    if (status.code == VD_OK) {
        status = suggest_view(model, flags, sizeof flags);
    }
    if (status.code == VD_OK &&
        !(json ? print_json(path, model, flags, notes) : print_people(path, model, flags))) {
        status = vd_failure(VD_ERROR_IO, "cannot write to standard output; check the pipe");
    }
    vd_model_destroy(&model);
    return status;
}
