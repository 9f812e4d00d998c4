/* world_furniture.c: what stands around a world's picture. */
#include "world_furniture.h"

#include <math.h>
#include <stdlib.h>

#include "text_module.h"

/* The font that the furniture's letters come from. */
struct vd_world_letters {
    vd_text_module text;
    vd_font *font;
};

static vd_status outline(void *user, const char *utf8, double size_px, vd_outline *out) {
    const struct vd_world_letters *letters = user;
    return letters->text.outline(letters->font, utf8, size_px, out);
}

static vd_status open_letters(vd_world_scene *w) {
    struct vd_world_letters *letters = calloc(1, sizeof *letters);
    if (letters == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory while opening a font");
    }
    vd_status status = vd_text_module_open("write a title, scale or legend", &letters->text);
    if (status.code == VD_OK) {
        status = letters->text.find(w->context, NULL, &letters->font);
    }
    if (status.code != VD_OK) {
        free(letters);
        return status;
    }
    w->letters = letters;
    return status;
}

vd_status vd_world_furnish(vd_world_scene *scene, const vd_render_run *run) {
    const vd_render_settings *s = run->settings;
    if (s->title == NULL && !s->north_arrow && !s->scale_bar && !s->legend) {
        return vd_success();
    }
    vd_status status = open_letters(scene);
    if (status.code != VD_OK) {
        return status;
    }
    vd_furniture_def def = vd_furniture_def_default();
    def.title = s->title;
    def.north = s->north_arrow;
    def.scale = s->scale_bar;
    def.outline = outline;
    def.outline_user = scene->letters;
    const vd_heightfield *t = scene->scene.terrain;
    if (s->legend && t != NULL) {
        def.legend = &scene->colormap;
        def.legend_min = (double)t->min;
        def.legend_max = (double)t->max;
        def.legend_title = run->content != NULL ? run->content->legend_title : NULL;
    }
    return vd_furniture_create(scene->context, &def, &scene->furniture);
}

void vd_world_unfurnish(vd_world_scene *scene) {
    vd_furniture_destroy(&scene->furniture);
    if (scene->letters != NULL) {
        scene->letters->text.destroy(&scene->letters->font);
        free(scene->letters);
        scene->letters = NULL;
    }
}

/* How far along the view axis the ground in the picture's middle is, metres; 0: none is found.
 * Steps that grow with the distance, then halving. */
static double middle_distance(const vd_world_scene *w, const vd_camera *camera) {
    const vd_vec3 ahead = vd_quat_rotate(camera->orientation, vd_vec3_make(0, 0, 1));
    double before = 0.0, at = 1.0;
    for (; at < 1e8; before = at, at *= 1.01) {
        const vd_vec3 p = vd_vec3_add(camera->eye, vd_vec3_scale(ahead, at));
        if (p.z <= vd_world_ground(w->world, p.x, p.y)) {
            break;
        }
    }
    if (!(at < 1e8)) {
        return 0.0;
    }
    for (int i = 0; i < 32; i++) {
        const double middle = 0.5 * (before + at);
        const vd_vec3 p = vd_vec3_add(camera->eye, vd_vec3_scale(ahead, middle));
        *(p.z <= vd_world_ground(w->world, p.x, p.y) ? &at : &before) = middle;
    }
    return at;
}

vd_status vd_world_overlay(void *user, const vd_camera *camera, int width, int height,
                           vd_overlay *out) {
    const vd_world_scene *w = user;
    const double distance = w->scene.terrain != NULL ? middle_distance(w, camera) : 0.0;
    return vd_furniture_arrange(w->furniture, camera, width, height, distance, out);
}
