/* render_model.c: a picture of a model. */
#include <math.h>
#include <string.h>

#include "model_file.h"
#include "model_shader.h"
#include "model_view.h"
#include "render_run.h"

/* What is drawn: the model's meshes, and lines along its normals. */
enum { MOST_DRAWS = VD_TOPOLOGY_COUNT + 1 };

typedef struct studio {
    vd_context *context;
    vd_model *model;
    vd_texture *texture; /* --texture */
    vd_material *materials;
    vd_mesh *normals; /* --show-normals */
    vd_material normal_material;
    vd_raster *raster;
    vd_placed_model placed;
    vd_view view;
    vd_phong light;
    vd_depth_range range;
    vd_draw draws[MOST_DRAWS];
    int draw_count;
    vd_raster_def def;
    bool backdrop;
} studio;

static void finish(studio *s) {
    vd_raster_destroy(&s->raster);
    vd_mesh_destroy(s->context, &s->normals);
    vd_texture_destroy(&s->texture);
    vd_release(s->context, s->materials);
    vd_model_destroy(&s->model);
}

/* Depth, normals, ids and texture coordinates are data: they stand on black, and nothing shows
 * through. */
static bool is_data(vd_shading shading) {
    return shading == VD_SHADING_DEPTH || shading == VD_SHADING_NORMALS ||
           shading == VD_SHADING_UV || shading == VD_SHADING_ID;
}

/* ---- materials --------------------------------------------------------------------------------*/

static vd_status load_texture(studio *s, const char *path) {
    vd_picture *picture = NULL;
    vd_status status = vd_picture_load(s->context, path, &picture);
    if (status.code == VD_OK) {
        status = vd_texture_create(s->context, picture, &s->texture);
    }
    vd_picture_destroy(&picture);
    return status;
}

/* The model's materials as the settings want them. */
static vd_status make_materials(studio *s, const vd_model_settings *m) {
    const int count = s->model->material_count;
    s->materials = vd_allocate(s->context, (size_t)count, sizeof *s->materials);
    if (s->materials == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory for %d materials", count);
    }
    vd_status status = m->texture != NULL ? load_texture(s, m->texture) : vd_success();
    for (int i = 0; i < count; i++) {
        s->materials[i] = s->model->materials[i];
        s->materials[i].filter = m->filter;
        if (m->ink && !s->model->has_colors) {
            s->materials[i] = vd_model_clay();
            s->materials[i].albedo = (vd_linear){0.01f, 0.02f, 0.04f};
        } else if (s->texture != NULL) {
            s->materials[i].texture = s->texture;
            s->materials[i].albedo = (vd_linear){1, 1, 1};
        }
        s->materials[i].blend = s->materials[i].blend && !is_data(m->shading);
    }
    return status;
}

/* What the model lacks for what is asked. */
static vd_status check_attributes(const studio *s, const vd_render_settings *r) {
    const vd_mesh *mesh = s->model->meshes[VD_TOPOLOGY_TRIANGLES];
    const vd_model_settings *m = &r->model;
    const bool uv = mesh != NULL && mesh->uv >= 0;
    if (!uv && (m->texture != NULL || m->shading == VD_SHADING_UV)) {
        return vd_failure(VD_ERROR_EMPTY,
                          "--%s needs texture coordinates and %.160s has none; leave it out, or "
                          "unwrap the model first",
                          m->texture != NULL ? "texture" : "shade uv", r->inputs[0]);
    }
    if (mesh == NULL && (m->show_normals || m->fill == VD_FILL_WIREFRAME)) {
        return vd_failure(VD_ERROR_EMPTY, "--%s needs triangles and %.160s has none; leave it out",
                          m->show_normals ? "show-normals" : "wireframe", r->inputs[0]);
    }
    if (mesh != NULL && s->model->flat_triangles == mesh->primitive_count &&
        m->fill == VD_FILL_SOLID && s->model->meshes[VD_TOPOLOGY_LINES] == NULL &&
        s->model->meshes[VD_TOPOLOGY_POINTS] == NULL && !r->allow_empty) {
        return vd_failure(VD_ERROR_EMPTY,
                          "%.160s: no triangle has an area (of %u), so there is nothing to see; "
                          "--points or --wireframe show where they are (--allow-empty draws it all "
                          "the same)",
                          r->inputs[0], mesh->primitive_count);
    }
    return vd_success();
}

/* ---- draws ------------------------------------------------------------------------------------*/

/* Lines from the vertices along their normals, as long as three vertices are apart. */
static vd_status make_normals(studio *s) {
    const vd_mesh *mesh = s->model->meshes[VD_TOPOLOGY_TRIANGLES];
    const size_t count = mesh->vertex_count;
    float *ends = vd_allocate(s->context, count, 6 * sizeof *ends);
    if (ends == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory for %zu normals", count);
    }
    const double diagonal = vd_placed_diagonal(&s->placed);
    const float length = (float)fmin(0.03 * diagonal, 3.0 * diagonal / sqrt((double)count));
    const float *normals = vd_mesh_attributes(mesh, 0);
    for (size_t i = 0; i < count; i++) {
        for (int k = 0; k < 3; k++) {
            const float p = vd_mesh_positions(mesh, k)[i];
            ends[6 * i + (size_t)k] = p;
            ends[6 * i + 3 + (size_t)k] = p + length * normals[4 * i + (size_t)k];
        }
    }
    vd_mesh_def def = vd_mesh_def_default();
    def.topology = VD_TOPOLOGY_LINES;
    def.anchor = mesh->anchor;
    def.vertex_count = 2 * count;
    def.positions = ends;
    vd_status status = vd_mesh_create(s->context, &def, &s->normals);
    vd_release(s->context, ends);
    return status;
}

static void make_draws(studio *s, const vd_model_settings *m) {
    s->draw_count = vd_model_draws(s->model, s->draws);
    if (s->normals != NULL) {
        vd_draw *lines = &s->draws[s->draw_count++];
        *lines = vd_draw_default();
        lines->mesh = s->normals;
        s->normal_material = vd_material_default();
        s->normal_material.albedo = (vd_linear){0.9f, 0.35f, 0.02f};
        lines->materials = &s->normal_material;
        lines->material_count = 1;
        lines->shader = vd_shader_find(VD_SHADING_ALBEDO);
        lines->object_id = 2;
        lines->cull = VD_CULL_NONE;
    }
    for (int i = 0; i < s->draw_count; i++) {
        vd_draw *draw = &s->draws[i];
        draw->world_from_mesh = s->placed.world_from_model;
        draw->line_width = m->line_width;
        draw->point_size = m->point_size;
        if (draw->object_id != 1) {
            continue;
        }
        draw->materials = s->materials;
        draw->cull = m->cull;
        draw->winding = m->winding;
        draw->fill = m->fill;
        const bool plain = draw->mesh->normal < 0;
        const bool lit = m->shading == VD_SHADING_PHONG || m->shading == VD_SHADING_FLAT;
        vd_shading shading = m->ink ? VD_SHADING_ALBEDO : m->shading;
        if (plain && (lit || shading == VD_SHADING_NORMALS)) {
            shading = VD_SHADING_ALBEDO; /* clouds and lines without normals */
        }
        /* A texture that is asked for, or comes with the file, wins over colours at vertices. */
        const bool colored =
            s->model->has_colors && s->texture == NULL && s->model->texture_count == 0;
        const vd_shader *with_colors = colored ? vd_colored_shader(shading) : NULL;
        draw->shader = with_colors != NULL ? with_colors : vd_shader_find(shading);
        draw->uniforms = lit                           ? (const void *)&s->light
                         : shading == VD_SHADING_DEPTH ? (const void *)&s->range
                                                       : NULL;
    }
}

/* ---- light and backdrop -----------------------------------------------------------------------*/

/* Three lights of a studio for a view along +y, of which the first is as strong as the sun: over
 * the viewer's left shoulder, a weak one from the right, one from behind that draws the upper
 * edges. */
static const vd_phong studio_light = {
    .ambient = {0.10f, 0.11f, 0.13f},
    .lights = {{{-0.615f, -0.477f, 0.628f}, {0.98f, 0.95f, 0.90f}},
               {{0.853f, -0.502f, 0.141f}, {0.14f, 0.17f, 0.21f}},
               {{0.348f, 0.846f, 0.404f}, {0.22f, 0.23f, 0.25f}}},
    .light_count = 3,
};

/* They turn with the viewer; with --sun the first one comes from there and stays. */
static vd_phong make_light(const vd_render_settings *r, const vd_camera *camera) {
    vd_phong light = studio_light;
    double heading = 0.0, pitch = 0.0, roll = 0.0;
    vd_orientation_to_angles(camera->orientation, &heading, &pitch, &roll);
    const vd_quat turn = vd_quat_from_axis_angle(vd_vec3_make(0, 0, 1), -heading);
    for (int i = 0; i < light.light_count; i++) {
        float *d = light.lights[i].direction;
        vd_vec3 to = vd_quat_rotate(turn, vd_vec3_make((double)d[0], (double)d[1], (double)d[2]));
        to = vd_vec3_normalize(to);
        if (i == 0 && r->model.sun_given) {
            to = vd_sun_direction(r->sun_azimuth * VD_RADIANS_PER_DEGREE,
                                  r->sun_altitude * VD_RADIANS_PER_DEGREE);
        }
        d[0] = (float)to.x;
        d[1] = (float)to.y;
        d[2] = (float)to.z;
    }
    return light;
}

/* Lays the transparent parts of the picture over a backdrop: grey-blue above, nearly white below,
 * or one colour. In encoded space, as everything is blended here. */
static void lay_over_backdrop(const vd_render_settings *r, vd_frame *frame) {
    static const double above[3] = {122, 139, 160}, below[3] = {232, 236, 240};
    const double solid[3] = {r->sky_color.r, r->sky_color.g, r->sky_color.b};
    for (int y = 0; y < frame->height; y++) {
        const double t = (y + 0.5) / frame->height;
        uint32_t back[3];
        for (int c = 0; c < 3; c++) {
            const double v = above[c] + (below[c] - above[c]) * t;
            back[c] = (uint32_t)((r->sky_colored ? solid[c] : v) * 256.0);
        }
        uint8_t *row = frame->rgba + 4 * (size_t)y * frame->stride;
        for (int x = 0; x < frame->width; x++) {
            /* An ordered dither of 2 × 2 hides the bands of a slow gradient. */
            const uint32_t dither = r->sky_colored ? 128u
                                                   : 32u + 64u * (uint32_t)((x & 1) ^ (y & 1)) +
                                                         128u * (uint32_t)(y & 1);
            uint8_t *p = row + 4 * (size_t)x;
            const uint32_t through = 255u - p[3];
            for (int c = 0; c < 3 && through > 0; c++) {
                const uint32_t behind = (back[c] + dither) >> 8;
                p[c] = (uint8_t)(p[c] + (behind * through + 127u) / 255u);
            }
            p[3] = 255;
        }
    }
}

/* ---- the picture ------------------------------------------------------------------------------*/

static vd_status describe(vd_render_run *run, const studio *s) {
    vd_view_flags(&s->view, run->flags, sizeof run->flags);
    run->camera = vd_view_json(&s->view);
    run->camera_all = run->settings->json ? vd_model_view_describe(&s->view) : NULL;
    run->model = vd_model_describe(s->model);
    if (run->camera == NULL || run->model == NULL ||
        (run->settings->json && run->camera_all == NULL)) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory while describing the model");
    }
    const vd_camera *camera = &s->view.camera;
    run->near_m = camera->near_m;
    run->far_m = camera->projection == VD_PROJECTION_ORTHOGRAPHIC ? camera->far_m : 0.0;
    return vd_success();
}

static vd_status draw(vd_render_run *run, studio *s) {
    const vd_render_settings *r = run->settings;
    vd_status status = vd_render_make_frame(run);
    if (status.code != VD_OK) {
        return status;
    }
    vd_raster_stats stats = {.primitives = 0};
    vd_progress progress;
    const double start = vd_seconds_now();
    vd_progress_start(&progress, run->job, r->quiet);
    status = vd_raster_render(s->raster, run->job, &s->def, &s->view.camera, s->draws,
                              s->draw_count, run->frame, &stats);
    vd_progress_stop(&progress);
    if (status.code == VD_OK && s->backdrop) {
        lay_over_backdrop(r, run->frame);
    }
    run->draw_seconds = vd_seconds_now() - start;
    run->stats.hits = stats.hits;
    run->stats.samples = (uint64_t)r->width * (uint64_t)r->height * (uint64_t)r->samples;
    if (status.code != VD_OK || stats.hits > 0) {
        return status;
    }
    status = vd_raster_explain_empty(&s->def, &s->view.camera, s->draws, s->draw_count, r->width,
                                     r->height);
    if (!r->allow_empty) {
        return vd_failure(VD_ERROR_EMPTY, "%.320s (--allow-empty writes the picture all the same)",
                          status.message);
    }
    vd_log(run->context, VD_LOG_WARNING, "%.360s", status.message);
    return vd_success();
}

/* Two pictures of a quarter and a half of the sides tell what the vertices and what the pixels
 * cost. */
static vd_status estimate(vd_render_run *run, studio *s) {
    const vd_render_settings *r = run->settings;
    const vd_process_memory loaded = vd_process_memory_now();
    double seconds[2], pixels[2];
    vd_status status = vd_success();
    run->ready_seconds = vd_seconds_now() - run->start;
    for (int i = 0; i < 2 && status.code == VD_OK; i++) {
        const int part = 4 >> i;
        const int width = (r->width + part - 1) / part, height = (r->height + part - 1) / part;
        vd_camera camera = s->view.camera;
        vd_frame *frame = NULL;
        camera.lens.fx /= part;
        camera.lens.cx /= part;
        camera.lens.fy /= part;
        camera.lens.cy /= part;
        status = vd_frame_create(run->context, width, height, 0, &frame);
        /* The first of two is not counted: it takes the memory. */
        for (int turn = 0; turn < 2 && status.code == VD_OK; turn++) {
            const double start = vd_seconds_now();
            status = vd_raster_render(s->raster, run->job, &s->def, &camera, s->draws,
                                      s->draw_count, frame, NULL);
            seconds[i] = vd_seconds_now() - start;
        }
        pixels[i] = (double)width * height;
        vd_frame_destroy(&frame);
    }
    if (status.code != VD_OK) {
        return status;
    }
    const double all = (double)r->width * r->height;
    const double slope = pixels[1] > pixels[0] && seconds[1] > seconds[0]
                             ? (seconds[1] - seconds[0]) / (pixels[1] - pixels[0])
                             : seconds[1] / pixels[1];
    run->draw_seconds = seconds[1] + slope * (all - pixels[1]);
    vd_render_estimate_memory(run, &loaded, 0);
    return status;
}

static vd_status make_view(vd_render_run *run, studio *s) {
    const vd_render_settings *r = run->settings;
    double nearest = 0.0, farthest = 0.0;
    s->placed = vd_place_model(s->model, r->model.up);
    vd_status status = vd_model_view_make(&s->placed, &r->camera, r->width, r->height, &s->view,
                                          &nearest, &farthest);
    if (status.code != VD_OK) {
        run->bad_use = status.code == VD_ERROR_ARGUMENT;
        return status;
    }
    const vd_camera *camera = &s->view.camera;
    nearest = fmax(nearest, camera->near_m);
    s->range = (vd_depth_range){vd_camera_depth(camera, nearest),
                                vd_camera_depth(camera, fmax(farthest, nearest))};
    if (!(s->range.nearest > s->range.farthest)) {
        s->range.farthest = 0.5f * s->range.nearest; /* all at one depth: white */
    }
    s->light = make_light(r, camera);
    s->def = vd_raster_def_default();
    s->def.method = r->model.method;
    s->def.samples = r->samples;
    s->def.background = r->background;
    s->backdrop = r->sky && (r->sky_colored || !is_data(r->model.shading));
    if (r->sky && !s->backdrop) {
        s->def.background = (vd_rgba8){0, 0, 0, 255};
    }
    if (camera->projection == VD_PROJECTION_PERSPECTIVE) {
        s->def.far_m = s->view.exact.far_m;
    }
    return describe(run, s);
}

static vd_status draw_model(vd_render_run *run, studio *s) {
    const vd_render_settings *r = run->settings;
    vd_status status = check_attributes(s, r);
    if (status.code == VD_OK) {
        status = make_materials(s, &r->model);
    }
    if (status.code == VD_OK) {
        status = make_view(run, s);
    }
    if (status.code == VD_OK && r->model.show_normals) {
        status = make_normals(s);
    }
    if (status.code == VD_OK) {
        make_draws(s, &r->model);
        status = vd_raster_create(run->context, &s->raster);
    }
    if (status.code == VD_OK) {
        status = r->dry_run ? estimate(run, s) : draw(run, s);
    }
    return status;
}

vd_status vd_render_model(vd_render_run *run) {
    const vd_render_settings *r = run->settings;
    studio s = {.context = run->context};
    vd_status status = vd_model_open(run->context, r->inputs[0], r->model.skip_textures, &s.model);
    if (status.code == VD_OK && vd_job_stopped(run->job)) {
        status = vd_failure(VD_ERROR_CANCELLED, "cancelled");
    }
    if (status.code == VD_OK) {
        status = draw_model(run, &s);
    }
    finish(&s);
    return status;
}
