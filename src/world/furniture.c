/* furniture.c: the memory of map furniture, its texts and shapes, and the title. */
#include "world/furniture_internal.h"

#include <math.h>
#include <string.h>
#include "core/core.h"

#define MOST_TITLE_BYTES 4096u
#define MEASURED_PX 64.0

vd_furniture_def vd_furniture_def_default(void) {
    const vd_letters letters = vd_letters_default(1);
    return (vd_furniture_def){.color = letters.color, .halo = letters.halo};
}

/* ---- making it ----------------------------------------------------------------------------------
 */

static bool is_text(const char *text) {
    return text != NULL && text[0] != '\0';
}

static vd_status check_def(const vd_furniture_def *def) {
    if (def->outline == NULL &&
        (is_text(def->title) || def->north || def->scale || def->legend != NULL)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "furniture: outline is null: title, arrow, bar and legend have letters");
    }
    if (!(def->size_px == 0 || (def->size_px >= 4 && def->size_px <= 1024))) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "furniture: size_px is %g; give 4 to 1024 pixels, or 0 for automatic",
                          def->size_px);
    }
    if (def->legend != NULL &&
        (def->legend->count < 1 || def->legend->count > VD_COLORMAP_MAX_STOPS)) {
        return vd_failure(VD_ERROR_ARGUMENT, "furniture: legend has %d stops", def->legend->count);
    }
    if ((is_text(def->title) && strlen(def->title) > MOST_TITLE_BYTES) ||
        (is_text(def->legend_title) && strlen(def->legend_title) > MOST_TITLE_BYTES)) {
        return vd_failure(VD_ERROR_LIMIT, "furniture: a title is longer than %u bytes",
                          MOST_TITLE_BYTES);
    }
    return vd_success();
}

vd_status vd_furniture_create(vd_context *context, const vd_furniture_def *def,
                              vd_furniture **out) {
    vd_status status = check_def(def);
    if (status.code != VD_OK) {
        return status;
    }
    vd_furniture *f = vd_allocate_zero(context, 1, sizeof *f);
    if (f == NULL) {
        return vd_out_of_memory("map furniture", sizeof *f);
    }
    f->context = context;
    f->def = *def;
    f->title = vd_copy_string(context, def->title != NULL ? def->title : "");
    f->legend_title =
        vd_copy_string(context, def->legend_title != NULL ? def->legend_title : "Height (m)");
    if (f->title == NULL || f->legend_title == NULL) {
        status = vd_out_of_memory("titles", MOST_TITLE_BYTES);
        vd_furniture_destroy(&f);
        return status;
    }
    if (def->legend != NULL) {
        f->legend = *def->legend;
        f->def.legend = &f->legend;
    }
    f->title_width = -1;
    f->def.title = f->title;
    f->def.legend_title = f->legend_title;
    *out = f;
    return vd_success();
}

void vd_furniture_destroy(vd_furniture **furniture) {
    if (furniture == NULL || *furniture == NULL) {
        return;
    }
    vd_furniture *f = *furniture;
    for (int i = 0; i < VD_FURNITURE_TEXTS; i++) {
        vd_outline_finish(&f->slots[i].outline);
        vd_release(f->context, f->slots[i].text);
    }
    vd_release(f->context, f->title);
    vd_release(f->context, f->legend_title);
    vd_release(f->context, f);
    *furniture = NULL;
}

/* ---- texts --------------------------------------------------------------------------------------
 */

vd_status vd_furniture_outline(vd_furniture *f, vd_furniture_text slot, const char *text,
                               double size_px) {
    vd_furniture_slot *s = &f->slots[slot];
    if (s->text != NULL && s->size_px == size_px && strcmp(s->text, text) == 0) {
        return vd_success();
    }
    char *copy = vd_copy_string(f->context, text);
    if (copy == NULL) {
        return vd_out_of_memory("a text", strlen(text) + 1);
    }
    vd_outline outline;
    const vd_status status = f->def.outline(f->def.outline_user, text, size_px, &outline);
    if (status.code != VD_OK) {
        vd_release(f->context, copy);
        return status;
    }
    vd_outline_finish(&s->outline);
    vd_release(f->context, s->text);
    *s = (vd_furniture_slot){copy, size_px, outline};
    return vd_success();
}

void vd_furniture_write(vd_furniture *f, vd_furniture_text slot, double x, double y) {
    const double halo_width = vd_letters_default(f->slots[slot].size_px).halo_width;
    const vd_letters letters = {f->def.color, f->def.halo, halo_width};
    f->layer_count +=
        (size_t)vd_outline_layers(&f->slots[slot].outline, floor(x + 0.5), floor(y + 0.5), &letters,
                                  &f->strokes[f->stroke_count], &f->layers[f->layer_count]);
    f->stroke_count++;
}

/* ---- shapes -------------------------------------------------------------------------------------
 */

vd_layer *vd_furniture_polygon(vd_furniture *f, const double (*points)[2], size_t count,
                               vd_rgba8 color) {
    double(*to)[2] = &f->points[f->point_count];
    memcpy(to, points, count * sizeof *to);
    f->point_count += count;
    vd_layer *layer = &f->layers[f->layer_count++];
    *layer = vd_layer_default();
    layer->path.points = (const double(*)[2])to;
    layer->path.point_count = count;
    vd_layer_color(color, layer->fill);
    return layer;
}

vd_layer *vd_furniture_rectangle(vd_furniture *f, double x0, double y0, double x1, double y1,
                                 vd_rgba8 color) {
    const double corners[4][2] = {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
    return vd_furniture_polygon(f, corners, 4, color);
}

void vd_furniture_stroke(vd_furniture *f, vd_layer *layer, double width, vd_rgba8 color) {
    vd_stroke *stroke = &f->strokes[f->stroke_count++];
    *stroke = vd_stroke_default();
    stroke->width = 2 * width;
    stroke->join = VD_JOIN_ROUND;
    vd_layer_color(color, stroke->color);
    layer->filled = false;
    layer->stroke = stroke;
}

bool vd_furniture_keep(vd_furniture *f, double x0, double y0, double x1, double y1) {
    const float wanted[4] = {(float)x0, (float)y0, (float)x1, (float)y1};
    for (size_t i = 0; i < f->kept_count; i++) {
        const float *kept = f->kept[i];
        if (wanted[0] < kept[2] && kept[0] < wanted[2] && wanted[1] < kept[3] &&
            kept[1] < wanted[3]) {
            return false;
        }
    }
    memcpy(f->kept[f->kept_count++], wanted, sizeof wanted);
    return true;
}

/* ---- the whole ----------------------------------------------------------------------------------
 */

/* Twice as large as other letters, or as small as it must be to fit. */
static vd_status add_title(vd_furniture *f) {
    vd_status status = vd_success();
    const vd_outline *outline = &f->slots[VD_TEXT_TITLE].outline;
    if (f->title_width < 0) {
        status = vd_furniture_outline(f, VD_TEXT_TITLE, f->def.title, MEASURED_PX);
        if (status.code != VD_OK) {
            return status;
        }
        f->title_width = (outline->ink[2] - outline->ink[0]) / MEASURED_PX;
    }
    /* The arrow's corner stays free, and as much on the other side. */
    const double room =
        f->width - 2 * (f->margin + (f->def.north ? VD_FURNITURE_NORTH_EMS * f->size : 0));
    double size = 2 * f->size;
    if (f->title_width * size > room) {
        size = floor(room / f->title_width);
    }
    if (size < 0.5 * f->size || 3 * size > f->height) {
        return vd_success();
    }
    status = vd_furniture_outline(f, VD_TEXT_TITLE, f->def.title, size);
    if (status.code != VD_OK || outline->path.point_count == 0) {
        return status;
    }
    const double x = 0.5 * (f->width - outline->ink[0] - outline->ink[2]);
    const double y = f->margin + 0.8 * size; /* capitals' height and a little */
    const double around = f->halo + 0.25 * f->size;
    if (vd_furniture_keep(f, x + outline->ink[0] - around, y + outline->ink[1] - around,
                          x + outline->ink[2] + around, y + outline->ink[3] + around)) {
        vd_furniture_write(f, VD_TEXT_TITLE, x, y);
    }
    return vd_success();
}

vd_status vd_furniture_arrange(vd_furniture *f, const vd_camera *camera, int width, int height,
                               double ground_m, vd_overlay *out) {
    if (width < 1 || height < 1 || width > VD_MAX_SIDE || height > VD_MAX_SIDE) {
        return vd_failure(VD_ERROR_ARGUMENT, "furniture: a picture of %d x %d pixels", width,
                          height);
    }
    vd_status status = vd_camera_validate(camera);
    if (status.code != VD_OK) {
        return status;
    }
    const double automatic = floor(height / 48.0 + 0.5);
    f->camera = camera;
    f->width = width;
    f->height = height;
    f->size = f->def.size_px > 0 ? f->def.size_px
              : automatic < 11   ? 11
              : automatic > 96   ? 96
                                 : automatic;
    f->margin = floor(0.9 * f->size + 0.5);
    f->halo = vd_letters_default(f->size).halo_width;
    f->ground_m = ground_m;
    f->layer_count = f->point_count = f->stroke_count = f->kept_count = 0;
    /* What comes first stays where there is no room for all. */
    if (is_text(f->def.title)) {
        status = add_title(f);
    }
    if (status.code == VD_OK && f->def.scale) {
        status = vd_furniture_scale(f);
    }
    if (status.code == VD_OK && f->def.legend != NULL) {
        status = vd_furniture_legend(f);
    }
    if (status.code == VD_OK && f->def.north) {
        status = vd_furniture_north(f);
    }
    if (status.code == VD_OK) {
        *out = (vd_overlay){f->layers, f->layer_count, (const float(*)[4])f->kept, f->kept_count};
    }
    return status;
}
