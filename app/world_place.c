/* world_place.c: objects and sprites, and what placing them shares with lines and labels. */
#include "world_place.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "model_file.h"

/* ---- shared -----------------------------------------------------------------------------------
 */

vd_status vd_place_failure(const vd_placer *placer, const char *key, const vd_status *cause) {
    return placer->name != NULL && key[0] != '-'
               ? vd_failure(cause->code, "%.100s: %s: %.250s", placer->name, key, cause->message)
               : vd_failure(cause->code, "%s: %.300s", key, cause->message);
}

static vd_status fail(const vd_placer *placer, const char *key, vd_code code, const char *what) {
    const vd_status cause = vd_failure(code, "%s", what);
    return vd_place_failure(placer, key, &cause);
}

double vd_place_ground(const vd_placer *placer, double x, double y) {
    return placer->scene->scene.terrain != NULL ? vd_world_ground(placer->scene->world, x, y) : 0.0;
}

double vd_place_height(const vd_placer *placer, const vd_world_spot *spot, double x, double y) {
    return spot->height == VD_SPOT_AT_ALTITUDE ? spot->height_m * placer->settings->exaggeration
                                               : vd_place_ground(placer, x, y) + spot->height_m;
}

/* The sentence about what takes degrees where the terrain does not say where it lies. */
static vd_status no_georeference(const vd_placer *placer, const char *key, const char *what) {
    const bool terrain = placer->scene->scene.terrain != NULL;
    char sentence[256];
    snprintf(sentence, sizeof sentence,
             "%s longitude and latitude, and %s; give \"position\" and \"points\" in metres, or "
             "heights that say where they lie",
             what,
             terrain ? "the heights have no georeference"
                     : "there is no terrain that says where that is");
    return fail(placer, key, VD_ERROR_FORMAT, sentence);
}

vd_status vd_place_spot(const vd_placer *placer, const char *key, const vd_world_spot *spot,
                        vd_vec3 *out) {
    char where[64];
    double x = spot->x, y = spot->y;
    snprintf(where, sizeof where, "%s.%s", key, spot->geographic ? "at" : "position");
    if (spot->geographic && placer->scene->scene.kind == VD_CRS_NONE) {
        return no_georeference(placer, where, "it is");
    }
    if (spot->geographic) {
        const vd_status status =
            vd_scene_world_from_latlon(&placer->scene->scene, spot->y, spot->x, &x, &y);
        if (status.code != VD_OK) {
            return vd_place_failure(placer, where, &status);
        }
    }
    const double z = vd_place_height(placer, spot, x, y);
    if (!isfinite(z)) {
        char what[160];
        snprintf(
            what, sizeof what,
            "%.10g, %.10g is off the map or in a hole of it; give another place, or \"height\": "
            "{\"altitude\": metres}",
            spot->x, spot->y);
        return fail(placer, where, VD_ERROR_FORMAT, what);
    }
    *out = vd_vec3_make(x, y, z);
    return vd_success();
}

vd_status vd_place_features(const vd_placer *placer, const char *key, const char *path,
                            const char *property, vd_geo_module *geo, vd_features **out) {
    const vd_scene *scene = &placer->scene->scene;
    char purpose[256];
    snprintf(purpose, sizeof purpose, "read %.200s", path);
    vd_status status = vd_geo_module_open(purpose, geo);
    if (status.code == VD_OK &&
        (scene->kind == VD_CRS_NONE || (scene->kind == VD_CRS_PROJECTED && scene->crs == NULL))) {
        snprintf(purpose, sizeof purpose, "%.100s has", path);
        return no_georeference(placer, key, purpose);
    }
    if (status.code == VD_OK) {
        vd_geo_features_def def = geo->features_def_default();
        def.name_field = property;
        def.crs = scene->kind == VD_CRS_PROJECTED ? scene->crs : NULL;
        status = geo->load_features(placer->scene->context, path, &def, out);
    }
    return status.code == VD_OK ? status : vd_place_failure(placer, key, &status);
}

void vd_place_feature_point(const vd_placer *placer, const double point[3], double *x, double *y) {
    const vd_scene *scene = &placer->scene->scene;
    const vd_placement *p = &scene->placement;
    double east = point[0];
    if (scene->kind == VD_CRS_GEOGRAPHIC) {
        east -= 360.0 * floor((east - p->origin_x) / 360.0 + 0.5);
    }
    *x = (east - p->origin_x) * p->scale_x;
    *y = (point[1] - p->origin_y) * p->scale_y;
}

vd_status vd_place_add(const vd_placer *placer, vd_object *object) {
    const vd_status status = vd_world_add(placer->scene->world, &object);
    vd_object_destroy(placer->scene->context, &object);
    return status;
}

/* ---- models and pictures, each read once ------------------------------------------------------
 */

typedef struct asset {
    const char *path; /* the content's; null: free */
    uint32_t number;
    bool z_up;
    vd_vec3 min, max; /* of a model, in its own axes */
    double aspect;    /* of a picture: width over height */
} asset;

typedef struct assets {
    asset *table; /* [capacity], a power of two: open addressing */
    size_t capacity, count;
} assets;

static asset *find_asset(const assets *a, const char *path) {
    uint64_t hash = 14695981039346656037u; /* FNV-1a */
    for (const char *at = path; *at != '\0'; at++) {
        hash = (hash ^ (uint8_t)*at) * 1099511628211u;
    }
    size_t at = (size_t)(hash ^ (hash >> 32)) & (a->capacity - 1);
    while (a->table[at].path != NULL && strcmp(a->table[at].path, path) != 0) {
        at = (at + 1) & (a->capacity - 1);
    }
    return &a->table[at];
}

static vd_status grow(assets *a) {
    if (2 * a->count < a->capacity) {
        return vd_success();
    }
    assets larger = {.capacity = a->capacity > 0 ? 2 * a->capacity : 64, .count = a->count};
    larger.table = calloc(larger.capacity, sizeof *larger.table);
    if (larger.table == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory for the names of %zu files", a->count);
    }
    for (size_t i = 0; i < a->capacity; i++) {
        if (a->table[i].path != NULL) {
            *find_asset(&larger, a->table[i].path) = a->table[i];
        }
    }
    free(a->table);
    *a = larger;
    return vd_success();
}

static vd_status load_model(const vd_placer *p, const char *path, asset *out) {
    vd_model *model = NULL;
    vd_status status = vd_is_model_name(path, NULL)
                           ? vd_model_open(p->scene->context, path, false, &model)
                           : vd_failure(VD_ERROR_UNSUPPORTED,
                                        "%.200s is not named as models are; give OBJ, PLY, OFF, "
                                        "glTF or another that `veduta render` draws",
                                        path);
    if (status.code == VD_OK) {
        out->z_up = model->z_up;
        vd_model_bounds(model, &out->min, &out->max);
        status = vd_world_add_model(p->scene->world, &model, &out->number);
    }
    vd_model_destroy(&model);
    return status;
}

static vd_status load_picture(const vd_placer *p, const char *path, asset *out) {
    vd_picture *picture = NULL;
    vd_status status = vd_picture_load(p->scene->context, path, &picture);
    if (status.code == VD_OK) {
        out->aspect = (double)picture->width / picture->height;
        status = vd_world_add_picture(p->scene->world, picture, &out->number);
    }
    vd_picture_destroy(&picture);
    return status;
}

typedef vd_status load_asset(const vd_placer *p, const char *path, asset *out);

static vd_status use_asset(const vd_placer *p, assets *a, const vd_world_item *item,
                           const char *part, load_asset *load, asset *out) {
    vd_status status = grow(a);
    if (status.code != VD_OK) {
        return status;
    }
    asset *at = find_asset(a, item->path);
    if (at->path == NULL) {
        char key[48];
        asset made = {.path = item->path};
        snprintf(key, sizeof key, "%s.%s", item->key, part);
        status = load(p, item->path, &made);
        if (status.code != VD_OK) {
            return vd_place_failure(p, key, &status);
        }
        *at = made;
        a->count++;
    }
    *out = *at;
    return status;
}

/* ---- one thing or many
 * -------------------------------------------------------------------------*/

/* What is placed again and again: makes an object at a place. */
typedef struct stamp {
    const vd_placer *placer;
    const vd_world_item *item;
    asset asset;
    vd_matrix upright; /* stands up the model, its origin or foot at the origin */
} stamp;

typedef vd_status make_object(const stamp *s, vd_vec3 at, double heading, double factor,
                              vd_object **out);

static vd_matrix turned(double heading) {
    return vd_matrix_rotation(
        vd_quat_from_axis_angle(vd_vec3_make(0, 0, 1), -heading * VD_RADIANS_PER_DEGREE));
}

static vd_status make_instance(const stamp *s, vd_vec3 at, double heading, double factor,
                               vd_object **out) {
    const double *scale = s->item->scale;
    const vd_matrix turn = turned(s->item->heading + heading);
    const vd_matrix size =
        vd_matrix_scaling(vd_vec3_make(factor * scale[0], factor * scale[1], factor * scale[2]));
    const vd_matrix move = vd_matrix_translation(at);
    vd_instance_def def = {.model = s->asset.number,
                           .min = s->asset.min,
                           .max = s->asset.max,
                           .shadowless = s->item->shadowless};
    def.plane = vd_matrix_transform(
        &turn, vd_vec3_make(s->item->plane[0], s->item->plane[1], s->item->plane[2]));
    def.transform = vd_matrix_multiply(&size, &s->upright);
    def.transform = vd_matrix_multiply(&turn, &def.transform);
    def.transform = vd_matrix_multiply(&move, &def.transform);
    return vd_instance_create(s->placer->scene->context, &def, out);
}

static vd_status make_sprite(const stamp *s, vd_vec3 at, double heading, double factor,
                             vd_object **out) {
    (void)heading; /* it faces the viewer */
    const double height = factor * s->item->height_m;
    const vd_sprite_def def = {.picture = s->asset.number,
                               .foot = at,
                               .width_m = height * s->asset.aspect,
                               .height_m = height,
                               .tilts = s->item->tilts};
    return vd_sprite_create(s->placer->scene->context, &def, out);
}

/* Stands up a model, and where its foot is asked for moves that to the origin. */
static vd_matrix stand_up(const vd_world_item *item, const asset *a) {
    const bool y_up = item->up == VD_UP_Y || (item->up == VD_UP_AUTO && !a->z_up);
    const vd_matrix upright = y_up ? vd_model_upright() : vd_matrix_identity();
    if (!item->foot) {
        return upright;
    }
    vd_vec3 low = {0, 0, 0}, high = {0, 0, 0};
    for (int i = 0; i < 8; i++) {
        const vd_vec3 corner = {i & 1 ? a->max.x : a->min.x, i & 2 ? a->max.y : a->min.y,
                                i & 4 ? a->max.z : a->min.z};
        const vd_vec3 p = vd_matrix_transform(&upright, corner);
        low = i > 0 ? vd_vec3_min(low, p) : p;
        high = i > 0 ? vd_vec3_max(high, p) : p;
    }
    const vd_matrix move = vd_matrix_translation(
        vd_vec3_make(-0.5 * (low.x + high.x), -0.5 * (low.y + high.y), -low.z));
    return vd_matrix_multiply(&move, &upright);
}

static vd_status stamp_at(const stamp *s, make_object *make, vd_vec3 at, double heading,
                          double factor) {
    vd_object *object = NULL;
    const vd_status status = make(s, at, heading, factor, &object);
    return status.code == VD_OK ? vd_place_add(s->placer, object) : status;
}

static vd_status stamp_instances(const stamp *s, make_object *make) {
    const vd_placer *p = s->placer;
    const vd_world_item *item = s->item;
    vd_status status = vd_success();
    for (size_t i = 0; i < item->instance_count && status.code == VD_OK; i++) {
        const double *row = item->instances[i];
        const double z = vd_place_height(p, &item->spot, row[0], row[1]);
        if (!isfinite(z)) {
            char what[160];
            snprintf(what, sizeof what,
                     "item %zu: %.10g, %.10g is off the map or in a hole of it; leave it out",
                     i + 1, row[0], row[1]);
            status = vd_failure(VD_ERROR_FORMAT, "%s", what);
        } else {
            status = stamp_at(s, make, vd_vec3_make(row[0], row[1], z), row[2], row[3]);
        }
        if (status.code == VD_OK && (i & 0xFFFF) == 0xFFFF && vd_job_stopped(p->job)) {
            return vd_failure(VD_ERROR_CANCELLED, "cancelled");
        }
    }
    char key[48];
    snprintf(key, sizeof key, "%s.instances", item->key);
    return status.code == VD_OK ? status : vd_place_failure(p, key, &status);
}

/* At every point of a file; what is off the map is left out. */
static vd_status stamp_file(const stamp *s, make_object *make) {
    const vd_placer *p = s->placer;
    const vd_world_item *item = s->item;
    vd_features *features = NULL;
    vd_geo_module geo;
    char key[48];
    snprintf(key, sizeof key, "%s.instances", item->key);
    vd_status status = vd_place_features(p, key, item->instance_path, NULL, &geo, &features);
    if (status.code != VD_OK) {
        return status;
    }
    size_t points = 0, placed = 0;
    for (size_t i = 0; i < features->count && status.code == VD_OK; i++) {
        const vd_feature *feature = &features->features[i];
        if (feature->kind != VD_FEATURE_POINT) {
            continue;
        }
        double x, y;
        vd_place_feature_point(p, features->points[features->parts[feature->first_part]], &x, &y);
        const double z = vd_place_height(p, &item->spot, x, y);
        points++;
        if (isfinite(z)) {
            status = stamp_at(s, make, vd_vec3_make(x, y, z), 0.0, 1.0);
            placed++;
        }
    }
    if (status.code == VD_OK && placed == 0) {
        status =
            vd_failure(VD_ERROR_FORMAT, "%.160s has %s; give another file", item->instance_path,
                       points > 0 ? "no point on the map" : "no points, only lines or areas");
    }
    if (status.code == VD_OK && placed < points) {
        vd_log(p->scene->context, VD_LOG_WARNING,
               "%.160s: %zu of %zu points are off the map and left out", item->instance_path,
               points - placed, points);
    }
    geo.features_destroy(&features);
    return status.code == VD_OK || status.code == VD_ERROR_MEMORY
               ? status
               : vd_place_failure(p, key, &status);
}

static vd_status place_item(const stamp *s, make_object *make) {
    if (s->item->instance_path != NULL) {
        return stamp_file(s, make);
    }
    if (s->item->instance_count > 0) {
        return stamp_instances(s, make);
    }
    vd_vec3 at;
    vd_status status = vd_place_spot(s->placer, s->item->key, &s->item->spot, &at);
    if (status.code == VD_OK) {
        status = stamp_at(s, make, at, 0.0, 1.0);
        status = status.code == VD_OK ? status : vd_place_failure(s->placer, s->item->key, &status);
    }
    return status;
}

static vd_status place_items(const vd_placer *p, const vd_world_item *items, size_t count,
                             const char *part, load_asset *load, make_object *make) {
    assets known = {.table = NULL};
    vd_status status = vd_success();
    for (size_t i = 0; i < count && status.code == VD_OK; i++) {
        stamp s = {.placer = p, .item = &items[i]};
        status = use_asset(p, &known, &items[i], part, load, &s.asset);
        if (status.code == VD_OK) {
            s.upright = stand_up(&items[i], &s.asset);
            status = place_item(&s, make);
        }
        if (status.code == VD_OK && vd_job_stopped(p->job)) {
            status = vd_failure(VD_ERROR_CANCELLED, "cancelled");
        }
    }
    free(known.table);
    return status;
}

vd_status vd_world_place(vd_world_scene *scene, const vd_render_run *run) {
    static const vd_world_content none = {.name = NULL};
    const vd_world_content *c = run->content != NULL ? run->content : &none;
    const vd_placer p = {
        .scene = scene, .settings = run->settings, .job = run->job, .name = c->name};
    vd_status status =
        place_items(&p, c->objects, c->object_count, "mesh", load_model, make_instance);
    if (status.code == VD_OK) {
        status = place_items(&p, c->sprites, c->sprite_count, "picture", load_picture, make_sprite);
    }
    if (status.code == VD_OK) {
        status = vd_place_particles(&p, c);
    }
    if (status.code == VD_OK) {
        status = vd_place_lines(&p, c);
    }
    if (status.code == VD_OK) {
        status = vd_place_labels(&p, c);
    }
    if (status.code == VD_OK && scene->scene.terrain == NULL &&
        !vd_world_bounds(scene->world, &scene->scene.low, &scene->scene.high)) {
        status = vd_failure(VD_ERROR_EMPTY,
                            "%.200s: there is nothing in it; give it \"terrain\" or \"objects\"",
                            c->name != NULL ? c->name : "the world");
    }
    return status;
}
