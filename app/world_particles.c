/* world_particles.c: brick files in a world. */
#include "particle_color.h"
#include "world_place.h"

/* The look of particles, and the map that it points to. */
static vd_status choose_look(const vd_placer *placer, const vd_world_particles *p,
                             const vd_bricks *bricks, vd_colormap *map, vd_particle_look *look,
                             const char **part) {
    vd_brick_view_def color = vd_brick_view_def_default();
    const char *name;
    vd_status status = vd_success();
    *look = vd_particle_look_default();
    *part = "color_by";
    if (!p->has_color) {
        status = vd_particle_color(bricks, p->color_by, p->colormap != NULL, &color, &name);
    }
    if (status.code == VD_OK && p->colormap != NULL && !vd_colormap_find(p->colormap, map)) {
        *part = "colormap";
        status = vd_colormap_load(placer->scene->context, p->colormap, map);
    }
    if (status.code == VD_OK && p->colormap != NULL) {
        vd_particle_stretch(map);
        look->colormap = map;
    }
    look->color = color.color;
    look->attribute = color.attribute;
    look->constant = p->has_color ? p->color : look->constant;
    look->kernel = p->kernel;
    look->range_min = p->range[0];
    look->range_max = p->range[1];
    look->log = p->log;
    look->opacity = p->opacity;
    look->detail_px = p->detail_px > 0.0 ? p->detail_px : -1.0;
    look->radius_m = p->radius_m;
    look->radius_scale = p->radius_scale;
    if (p->radius_m <= 0.0 && p->radius_scale <= 0.0) {
        /* Smoothing lengths overlap dozens of times: blended, they would be fog. */
        look->radius_m = vd_brick_view_radius(bricks);
    }
    return status;
}

static vd_status place_file(const vd_placer *placer, const vd_world_particles *p) {
    vd_bricks *bricks = NULL;
    vd_particle_look look;
    vd_colormap map;
    uint32_t number = 0;
    size_t objects = 0;
    char key[48];
    const char *part = "file";
    vd_status status = vd_bricks_open(placer->scene->context, p->path, &bricks);
    if (status.code == VD_OK) {
        status = choose_look(placer, p, bricks, &map, &look, &part);
    }
    if (status.code == VD_OK) {
        part = "color_by";
        status = vd_world_add_bricks(placer->scene->world, &bricks, &look, &number);
    }
    if (status.code == VD_OK) {
        part = "most_particles";
        status = vd_world_add_particles(placer->scene->world, number, (uint64_t)p->most, &objects);
    }
    vd_bricks_close(&bricks);
    snprintf(key, sizeof key, "%s.%s", p->key, part);
    /* What is wrong here is the file's, not the command line's. */
    status.code = status.code == VD_ERROR_ARGUMENT ? VD_ERROR_FORMAT : status.code;
    return status.code == VD_OK || status.code == VD_ERROR_MEMORY
               ? status
               : vd_place_failure(placer, key, &status);
}

vd_status vd_place_particles(const vd_placer *placer, const vd_world_content *content) {
    vd_status status = vd_success();
    for (size_t i = 0; i < content->particles_count && status.code == VD_OK; i++) {
        status = place_file(placer, &content->particles[i]);
        if (status.code == VD_OK && vd_job_stopped(placer->job)) {
            status = vd_failure(VD_ERROR_CANCELLED, "cancelled");
        }
    }
    return status;
}
