/* particle_color.c: what particles are coloured by. */
#include "particle_color.h"

#include <stdio.h>
#include <string.h>

#include "options.h"

bool vd_particle_has_colors(const vd_bricks *b) {
    const int red = vd_bricks_find(b, "red");
    return red >= 0 && b->attributes[red].kind == VD_ATTRIBUTE_CHANNEL &&
           vd_bricks_find(b, "green") >= 0 && vd_bricks_find(b, "blue") >= 0;
}

/* The index of a category of 0 … 255 that tells particles apart, else −1. */
static int useful_class(const vd_bricks *b) {
    const int at = vd_bricks_find(b, "class");
    return at >= 0 && b->attributes[at].storage == VD_BRICK_U8 &&
                   b->attributes[at].min < b->attributes[at].max
               ? at
               : -1;
}

vd_status vd_particle_no_attribute(const vd_bricks *b, const char *name) {
    char list[200] = "";
    const char *names[VD_MAX_ATTRIBUTES + 2] = {"height", "rgb"};
    for (uint32_t a = 0; a < b->attribute_count; a++) {
        names[2 + a] = b->attributes[a].name;
        const size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", a > 0 ? ", " : "", b->attributes[a].name);
    }
    const char *nearest = vd_nearest_name(name, names, (int)b->attribute_count + 2);
    if (nearest != NULL) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "there is no attribute \"%.60s\"; did you mean \"%.60s\"?", name,
                          nearest);
    }
    return vd_failure(VD_ERROR_ARGUMENT, "there is no attribute \"%.60s\"; there is height%s%s",
                      name, list[0] != '\0' ? ", " : "", list);
}

vd_status vd_particle_color(const vd_bricks *b, const char *name, bool by_map,
                            vd_brick_view_def *out, const char **chosen) {
    if (name == NULL) {
        name = vd_particle_has_colors(b) ? "rgb" : useful_class(b) >= 0 ? "class" : "height";
    }
    *chosen = name;
    const int at = vd_bricks_find(b, name);
    if (strcmp(name, "rgb") == 0 && vd_particle_has_colors(b)) {
        out->color = VD_BRICK_COLOR_RGB;
    } else if (strcmp(name, "height") == 0 && at < 0) {
        out->color = VD_BRICK_COLOR_HEIGHT;
    } else if (at >= 0) {
        const bool by_class = b->attributes[at].kind == VD_ATTRIBUTE_CATEGORY &&
                              b->attributes[at].storage == VD_BRICK_U8;
        out->color = by_class && !by_map ? VD_BRICK_COLOR_CLASS : VD_BRICK_COLOR_VALUE;
        out->attribute = at;
    } else {
        return vd_particle_no_attribute(b, name);
    }
    return vd_success();
}

void vd_particle_stretch(vd_colormap *map) {
    const double first = map->stops[0].value, last = map->stops[map->count - 1].value;
    for (int i = 0; i < map->count && !map->relative && last > first; i++) {
        map->stops[i].value = (map->stops[i].value - first) / (last - first);
    }
    map->relative = true;
}
