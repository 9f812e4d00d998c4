/* world_content.c: the lists of a world file. */
#include "world_content.h"

#include <stdlib.h>
#include <string.h>

#include "world_reader.h"

/* World metres beyond this are no place on any map. */
static const double farthest_m = 1e11;

const vd_rgba8 vd_world_line_color = {0xD0, 0x20, 0x20, 0xFF};
const double vd_world_line_width_px = 3.0;

void vd_world_content_finish(vd_world_content *content) {
    for (size_t i = 0; i < content->owned_count; i++) {
        free(content->owned[i]);
    }
    for (size_t i = 0; i < content->warning_count; i++) {
        free(content->warnings[i]);
    }
    free(content->owned);
    free(content->warnings);
    free(content->name);
    free(content->folder);
    json_decref(content->root);
    *content = (vd_world_content){.name = NULL};
}

bool vd_world_content_any(const vd_world_content *content) {
    return content->object_count + content->sprite_count + content->line_count +
               content->label_count + content->particles_count >
           0;
}

/* "height": "ground", {"above_ground": m} or {"altitude": m}. */
static void read_height(vd_world_reader *r, vd_world_spot *spot) {
    static const char *const names[] = {"above_ground", "altitude", NULL};
    const json_t *value = vd_world_value(r, "height");
    const char *word = json_string_value(value);
    if (value == NULL || (word != NULL && strcmp(word, "ground") == 0)) {
        return;
    }
    char item[48];
    snprintf(item, sizeof item, "%s.height", r->item);
    vd_world_reader inner = {.content = r->content, .object = value, .item = item};
    if (json_is_object(value) && json_object_size(value) == 1) {
        vd_world_check_keys(&inner, names);
        if (vd_world_number(&inner, names[0], -farthest_m, farthest_m, &spot->height_m)) {
            spot->height = VD_SPOT_ABOVE_GROUND;
        } else if (vd_world_number(&inner, names[1], -farthest_m, farthest_m, &spot->height_m)) {
            spot->height = VD_SPOT_AT_ALTITUDE;
        }
    }
    if (inner.status.code != VD_OK) {
        r->status = inner.status;
    } else if (spot->height == VD_SPOT_ON_GROUND) {
        vd_world_fail(r, "height",
                      "it is no height; give \"ground\", {\"above_ground\": metres} or "
                      "{\"altitude\": metres}");
    }
}

static bool is_lonlat(double longitude, double latitude) {
    return longitude >= -720.0 && longitude <= 720.0 && latitude >= -90.0 && latitude <= 90.0;
}

static bool is_metres(double x, double y) {
    return x >= -farthest_m && x <= farthest_m && y >= -farthest_m && y <= farthest_m;
}

/* "at": [lon, lat] or "position": [x, y], and the height. */
static vd_world_spot read_spot(vd_world_reader *r) {
    vd_world_spot spot = {.given = false};
    double at[2] = {0.0, 0.0}, position[2] = {0.0, 0.0};
    const bool geographic = vd_world_numbers(r, "at", 2, 2, at) == 2;
    const bool metres = vd_world_numbers(r, "position", 2, 2, position) == 2;
    if (geographic && metres) {
        vd_world_fail(r, "at", "\"at\" and \"position\" both say where it is; give one of them");
    } else if (geographic && !is_lonlat(at[0], at[1])) {
        vd_world_fail(r, "at", "%.10g, %.10g is no place; give [longitude, latitude] in degrees",
                      at[0], at[1]);
    } else if (metres && !is_metres(position[0], position[1])) {
        vd_world_fail(r, "position", "%.10g, %.10g is no place; give [x, y] in metres", position[0],
                      position[1]);
    }
    spot.given = geographic || metres;
    spot.geographic = geographic;
    spot.x = geographic ? at[0] : position[0];
    spot.y = geographic ? at[1] : position[1];
    read_height(r, &spot);
    return spot;
}

/* "scale": a factor, or one for each axis. */
static void read_scale(vd_world_reader *r, double scale[3]) {
    const json_t *value = vd_world_value(r, "scale");
    scale[0] = scale[1] = scale[2] = 1.0;
    if (json_is_array(value)) {
        (void)vd_world_numbers(r, "scale", 3, 3, scale);
        for (int i = 0; i < 3; i++) {
            if (!(scale[i] >= 1e-9 && scale[i] <= 1e9)) {
                vd_world_fail(r, "scale", "%g is no factor; give 1e-9 to 1e9", scale[i]);
            }
        }
    } else if (vd_world_number(r, "scale", 1e-9, 1e9, &scale[0])) {
        scale[1] = scale[2] = scale[0];
    }
}

/* "instances": rows of x, y, heading and scale, or a file of points. */
static void read_instances(vd_world_reader *r, vd_world_item *item) {
    static const double rest[4] = {0.0, 0.0, 0.0, 1.0};
    const json_t *value = vd_world_value(r, "instances");
    if (json_is_string(value)) {
        item->instance_path = vd_world_path(r, "instances");
    } else {
        double *rows = NULL;
        item->instance_count = vd_world_rows(r, "instances", 2, 4, rest, &rows);
        item->instances = (double(*)[4])rows;
    }
    for (size_t i = 0; i < item->instance_count && r->status.code == VD_OK; i++) {
        const double *row = item->instances[i];
        if (!is_metres(row[0], row[1]) || !(row[3] >= 1e-9 && row[3] <= 1e9)) {
            vd_world_fail(r, "instances",
                          "item %zu is no place with a factor; give [x, y, heading, scale]", i + 1);
        }
    }
    if (r->status.code == VD_OK && value != NULL && item->spot.given) {
        vd_world_fail(r, "instances", "\"instances\" and \"%s\" both say where it is; give one",
                      item->spot.geographic ? "at" : "position");
    } else if (r->status.code == VD_OK && value == NULL && !item->spot.given) {
        vd_world_fail(r, "",
                      "it has no place; give \"at\": [longitude, latitude], \"position\": [x, y] "
                      "or \"instances\"");
    }
}

static void read_object(vd_world_reader *r, void *to) {
    static const char *const names[] = {"mesh",      "at",      "position", "height",
                                        "heading",   "scale",   "up",       "anchor",
                                        "instances", "shadows", "plane",    NULL};
    vd_world_item *item = to;
    vd_world_check_keys(r, names);
    item->path = vd_world_path(r, "mesh");
    if (item->path == NULL) {
        vd_world_fail(r, "mesh", "it is missing; name a model, such as \"house.obj\"");
    }
    item->spot = read_spot(r);
    (void)vd_world_number(r, "heading", -3600.0, 3600.0, &item->heading);
    read_scale(r, item->scale);
    int up = VD_UP_AUTO, anchor = 0;
    bool shadows = true;
    vd_world_word(r, "up", "auto|y|z", &up);
    vd_world_word(r, "anchor", "origin|foot", &anchor);
    vd_world_bool(r, "shadows", &shadows);
    item->up = (vd_up)up;
    item->foot = anchor == 1;
    item->shadowless = !shadows;
    if (vd_world_numbers(r, "plane", 3, 3, item->plane) == 3 && item->plane[0] == 0.0 &&
        item->plane[1] == 0.0 && item->plane[2] == 0.0) {
        vd_world_fail(r, "plane", "three zeros are no direction; give one, such as [0, -1, 0]");
    }
    read_instances(r, item);
}

static void read_sprite(vd_world_reader *r, void *to) {
    static const char *const names[] = {"picture", "at",        "position", "height",
                                        "tilts",   "instances", "height_m", NULL};
    vd_world_item *item = to;
    vd_world_check_keys(r, names);
    item->path = vd_world_path(r, "picture");
    if (item->path == NULL) {
        vd_world_fail(r, "picture", "it is missing; name a picture, such as \"tree.png\"");
    }
    item->spot = read_spot(r);
    if (!vd_world_number(r, "height_m", 1e-6, 1e9, &item->height_m)) {
        vd_world_fail(r, "height_m", "it is missing; give the picture's height in metres");
    }
    vd_world_bool(r, "tilts", &item->tilts);
    read_instances(r, item);
}

static void read_line(vd_world_reader *r, void *to) {
    static const char *const names[] = {"file",  "at",           "points", "color",
                                        "width", "above_ground", "closed", NULL};
    vd_world_line *line = to;
    double *rows = NULL;
    vd_world_check_keys(r, names);
    line->path = vd_world_path(r, "file");
    line->geographic = vd_world_value(r, "at") != NULL;
    const char *key = line->geographic ? "at" : "points";
    line->count = vd_world_rows(r, key, 2, 2, NULL, &rows);
    line->points = (double(*)[2])rows;
    if ((line->path != NULL) + line->geographic + (vd_world_value(r, "points") != NULL) != 1) {
        vd_world_fail(r, "",
                      "one thing says where a line runs: \"file\", \"points\": [[x, y], …] or "
                      "\"at\": [[longitude, latitude], …]; give one");
    } else if (line->path == NULL && line->count < 2) {
        vd_world_fail(r, key, "a line has two points or more; give them");
    }
    for (size_t i = 0; i < line->count; i++) {
        const double *p = line->points[i];
        if (!(line->geographic ? is_lonlat : is_metres)(p[0], p[1])) {
            vd_world_fail(r, key, "item %zu is no place: %.10g, %.10g; give %s", i + 1, p[0], p[1],
                          line->geographic ? "[longitude, latitude]" : "[x, y] in metres");
        }
    }
    line->color = vd_world_line_color;
    line->width_px = vd_world_line_width_px;
    vd_world_color(r, "color", &line->color);
    (void)vd_world_number(r, "width", 0.1, 64.0, &line->width_px);
    (void)vd_world_number(r, "above_ground", -farthest_m, farthest_m, &line->above_m);
    vd_world_bool(r, "closed", &line->closed);
}

static void read_label(vd_world_reader *r, void *to) {
    static const char *const names[] = {"text",     "at",     "position", "height",
                                        "priority", "hidden", "file",     "property",
                                        "peaks",    "color",  NULL};
    vd_world_label *label = to;
    int hidden = VD_LABEL_HIDE;
    vd_world_check_keys(r, names);
    vd_world_word(r, "hidden", "hide|show", &hidden);
    label->hidden = (vd_label_hidden)hidden;
    label->color = (vd_rgba8){0, 0, 0, 0};
    vd_world_color(r, "color", &label->color);
    (void)vd_world_number(r, "priority", -1e9, 1e9, &label->priority);
    label->text = vd_world_text(r, "text");
    label->path = vd_world_path(r, "file");
    label->property = vd_world_text(r, "property");
    label->spot = read_spot(r);
    const bool peaks = vd_world_value(r, "peaks") != NULL;
    if ((label->text != NULL) + (label->path != NULL) + peaks != 1) {
        vd_world_fail(r, "",
                      "one thing says what it names: \"text\", \"file\" or \"peaks\"; give "
                      "one");
    } else if (label->text != NULL && !label->spot.given) {
        vd_world_fail(r, "",
                      "it has no place; give \"at\": [longitude, latitude] or "
                      "\"position\": [x, y]");
    }
    if (peaks) {
        r->content->peaks_hidden = label->hidden;
    }
}

/* "colormap": the name of one that is built in, or a file. */
static const char *read_colormap(vd_world_reader *r) {
    vd_colormap map;
    const char *text = vd_world_text(r, "colormap");
    return text == NULL || vd_colormap_find(text, &map) ? text : vd_world_path(r, "colormap");
}

static void read_particles(vd_world_reader *r, void *to) {
    static const char *const names[] = {
        "file",         "color",   "color_by", "colormap", "range",          "log", "radius",
        "radius_scale", "opacity", "kernel",   "detail",   "most_particles", NULL};
    vd_world_particles *p = to;
    int kernel = VD_SPLAT_DISC;
    vd_world_check_keys(r, names);
    p->path = vd_world_path(r, "file");
    if (p->path == NULL) {
        vd_world_fail(r, "file", "it is missing; name a brick file, such as \"cloud.vdp\"");
    }
    p->has_color = vd_world_value(r, "color") != NULL;
    vd_world_color(r, "color", &p->color);
    p->color_by = vd_world_text(r, "color_by");
    p->colormap = read_colormap(r);
    if (p->has_color && (p->color_by != NULL || p->colormap != NULL)) {
        vd_world_fail(r, "color", "\"color\" and \"%s\" both say what colour they have; give one",
                      p->color_by != NULL ? "color_by" : "colormap");
    }
    vd_world_bool(r, "log", &p->log);
    if (vd_world_numbers(r, "range", 2, 2, p->range) == 2 &&
        (!(p->range[0] < p->range[1]) || (p->log && !(p->range[0] > 0.0)))) {
        vd_world_fail(r, "range", "%g to %g is no range; give two rising numbers%s", p->range[0],
                      p->range[1], p->log ? " above 0" : "");
    }
    p->opacity = 1.0;
    p->detail_px = 0.5;
    (void)vd_world_number(r, "radius", 1e-9, 1e9, &p->radius_m);
    (void)vd_world_number(r, "radius_scale", 1e-6, 1e6, &p->radius_scale);
    (void)vd_world_number(r, "opacity", 1e-6, 1.0, &p->opacity);
    (void)vd_world_number(r, "detail", 0.0, 1e6, &p->detail_px);
    (void)vd_world_number(r, "most_particles", 1.0, 1e15, &p->most);
    vd_world_word(r, "kernel", "box|disc|gaussian|sph", &kernel);
    p->kernel = (vd_splat_kernel)kernel;
}

/* Reads a list of objects into an array; returns how many there are. */
static size_t read_list(vd_world_reader *file, const char *key, size_t size, void **out,
                        void (*read)(vd_world_reader *, void *)) {
    const json_t *list = vd_world_value(file, key);
    const size_t count = json_array_size(list);
    if (list != NULL && !json_is_array(list)) {
        vd_world_fail(file, key, "it is not a list; give one: [{…}, …]");
    }
    char *items = list != NULL ? vd_world_keep(file, count, size) : NULL;
    for (size_t i = 0; items != NULL && i < count && file->status.code == VD_OK; i++) {
        char *item = items + i * size; /* begins with its key */
        snprintf(item, 32, "%s[%zu]", key, i);
        const json_t *object = json_array_get(list, i);
        vd_world_reader r = {.content = file->content, .object = object, .item = item};
        if (json_is_object(object)) {
            read(&r, item);
        } else {
            vd_world_fail(&r, "", "it is not an object; give one: {\"key\": value, …}");
        }
        file->status = r.status;
    }
    *out = items;
    return items != NULL ? count : 0;
}

vd_status vd_world_content_read(vd_world_content *content, const json_t *root) {
    vd_world_reader file = {.content = content, .object = root, .item = ""};
    void *list = NULL;
    content->object_count = read_list(&file, "objects", sizeof(vd_world_item), &list, read_object);
    content->objects = list;
    content->sprite_count = read_list(&file, "sprites", sizeof(vd_world_item), &list, read_sprite);
    content->sprites = list;
    content->line_count = read_list(&file, "lines", sizeof(vd_world_line), &list, read_line);
    content->lines = list;
    content->label_count = read_list(&file, "labels", sizeof(vd_world_label), &list, read_label);
    content->labels = list;
    content->particles_count =
        read_list(&file, "particles", sizeof(vd_world_particles), &list, read_particles);
    content->particles = list;
    return file.status;
}
