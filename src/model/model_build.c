/* model_build.c: from what a reader found to meshes.
 *
 * A corner has up to three numbers: position, texture coordinates, normal. The mesh wants one
 * vertex for each combination that occurs. Where only positions are numbered by corner, as in PLY,
 * vertices are positions; where normals were computed they are normals, of which each belongs to
 * one place; else combinations are looked up in a hash table.
 */
#include <string.h>
#include "model/model_build.h"

/* The triangles' vertices as arrays of vd_mesh_def. */
typedef struct skin {
    vd_model_builder *builder;
    uint32_t *vertex_of_corner; /* becomes the indices */
    vd_list keys;               /* vd_corner: what each vertex is made of */
    vd_list computed, owner;    /* normals that were computed, the position of each */
    bool welded; /* positions at one place were taken for one when normals were computed */
    float *positions, *normals, *uvs, *colors;
    uint32_t *indices;   /* vertex_of_corner, by material */
    vd_mesh_part *parts; /* [part_count] */
    int part_count;
} skin;

static const uint32_t *numbers(const vd_list *list) {
    return list->data;
}

/* ---- normals ----------------------------------------------------------------------------------*/

static float square(const float *v) {
    return (v[0] * v[0] + v[1] * v[1]) + v[2] * v[2];
}

/* Whether the file gives every corner of a triangle a normal that points somewhere. */
static bool has_normals(const vd_model_builder *b) {
    const float *normals = b->normals.data;
    const size_t corners = b->corners.count;
    for (size_t c = 0; b->normals_by != VD_BY_NONE && c < corners; c++) {
        const uint32_t i = b->normals_by == VD_BY_CORNER ? numbers(&b->corner_normals)[c]
                                                         : numbers(&b->corners)[c];
        if (i == VD_NO_INDEX || !(square(normals + 3 * (size_t)i) > 0.0f)) {
            return false;
        }
    }
    return b->normals_by != VD_BY_NONE;
}

static uint32_t hash(uint32_t x, uint32_t y, uint32_t z) {
    uint64_t h = x * UINT64_C(0x9E3779B97F4A7C15);
    h = (h ^ (h >> 32) ^ y) * UINT64_C(0xBF58476D1CE4E5B9);
    h = (h ^ (h >> 32) ^ z) * UINT64_C(0x94D049BB133111EB);
    return (uint32_t)(h >> 32);
}

/* A hash table of at most `count` numbers: a power of two of slots, at least half of them empty. */
static uint32_t *make_table(vd_context *context, size_t count, size_t *slots) {
    *slots = 64;
    while (*slots < 2 * count) {
        *slots *= 2;
    }
    uint32_t *table = vd_allocate(context, *slots, sizeof *table);
    if (table != NULL) {
        memset(table, 0xff, *slots * sizeof *table);
    }
    return table;
}

static size_t slot_of(const float *position, size_t slots) {
    uint32_t bits[3];
    memcpy(bits, position, sizeof bits);
    return hash(bits[0], bits[1], bits[2]) & (slots - 1);
}

/* Maps each position to the first one at the same place: a surface goes on where a file repeats
 * positions, as STL does for every triangle and others where normals or textures have a seam. The
 * slots of the next ones are fetched ahead: waiting for them was three quarters of the time. */
static bool weld(skin *s, uint32_t *first) {
    enum { AHEAD = 16 };
    vd_model_builder *b = s->builder;
    float *positions = b->positions.data;
    const size_t count = b->positions.count;
    size_t slots;
    uint32_t *table = make_table(b->context, count, &slots);
    for (size_t i = 0; i < 3 * count; i++) {
        positions[i] += 0.0f; /* −0 becomes 0 */
    }
    for (size_t i = 0; i < count && table != NULL; i++) {
        const float *here = positions + 3 * i;
        if (i + AHEAD < count) {
            __builtin_prefetch(&table[slot_of(here + 3 * AHEAD, slots)]);
        }
        size_t at = slot_of(here, slots);
        while (table[at] != VD_NO_INDEX &&
               memcmp(positions + 3 * (size_t)table[at], here, 3 * sizeof *here) != 0) {
            at = (at + 1) & (slots - 1);
        }
        if (table[at] == VD_NO_INDEX) {
            table[at] = (uint32_t)i;
        }
        first[i] = table[at];
        s->welded = s->welded || first[i] != i;
    }
    vd_release(b->context, table);
    return table != NULL;
}

/* Computes normals and puts them in place of the file's. */
static vd_status compute_normals(skin *s) {
    vd_model_builder *b = s->builder;
    const size_t corners = b->corners.count;
    b->corner_normals.count = 0;
    uint32_t *to = vd_list_add(b->context, &b->corner_normals, corners, sizeof *to);
    uint32_t *first = vd_allocate(b->context, b->positions.count, sizeof *first);
    uint32_t *welded = vd_allocate(b->context, corners, sizeof *welded);
    vd_status status = vd_success();
    if (to == NULL || first == NULL || welded == NULL || !weld(s, first)) {
        status = vd_out_of_memory("a model's normals", corners * sizeof *to);
    }
    for (size_t c = 0; c < corners && status.code == VD_OK; c++) {
        welded[c] = first[numbers(&b->corners)[c]];
    }
    if (status.code == VD_OK) {
        b->model->computed_normals = true;
        b->normals_by = VD_BY_CORNER;
        status = vd_model_normals(b->context, b->positions.data, b->positions.count, welded,
                                  corners, &s->computed, &s->owner, to);
    }
    vd_release(b->context, first);
    vd_release(b->context, welded);
    return status;
}

/* ---- vertices ---------------------------------------------------------------------------------*/

static vd_corner key_of(const vd_model_builder *b, size_t corner) {
    const uint32_t p = numbers(&b->corners)[corner];
    return (vd_corner){p,
                       b->uvs_by == VD_BY_CORNER     ? numbers(&b->corner_uvs)[corner]
                       : b->uvs_by == VD_BY_POSITION ? p
                                                     : VD_NO_INDEX,
                       b->normals_by == VD_BY_CORNER     ? numbers(&b->corner_normals)[corner]
                       : b->normals_by == VD_BY_POSITION ? p
                                                         : VD_NO_INDEX};
}

/* Gives every number that is used a vertex, in the order of the numbers. */
static vd_status number_directly(skin *s, const uint32_t *number, size_t number_count) {
    vd_model_builder *b = s->builder;
    const size_t corners = b->corners.count;
    uint32_t *vertex = vd_allocate_zero(b->context, number_count, sizeof *vertex);
    if (vertex == NULL) {
        return vd_out_of_memory("a model's vertices", number_count * sizeof *vertex);
    }
    for (size_t c = 0; c < corners; c++) {
        vertex[number[c]] = 1;
    }
    uint32_t count = 0;
    for (size_t i = 0; i < number_count; i++) {
        count += vertex[i];
        vertex[i] = count - 1; /* of those used; others are not asked for */
    }
    vd_corner *keys = vd_list_add(b->context, &s->keys, count, sizeof *keys);
    for (size_t c = 0; c < corners && keys != NULL; c++) {
        s->vertex_of_corner[c] = vertex[number[c]];
        keys[vertex[number[c]]] = key_of(b, c);
    }
    vd_release(b->context, vertex);
    return keys != NULL ? vd_success()
                        : vd_out_of_memory("a model's vertices", count * sizeof *keys);
}

/* Gives every combination a vertex, in order of appearance. */
static vd_status number_combinations(skin *s) {
    vd_model_builder *b = s->builder;
    const size_t corners = b->corners.count;
    size_t slots;
    uint32_t *table = make_table(b->context, corners, &slots);
    if (table == NULL) {
        return vd_out_of_memory("a model's vertices", slots * sizeof *table);
    }
    vd_status status = vd_success();
    for (size_t c = 0; c < corners; c++) {
        const vd_corner key = key_of(b, c);
        size_t at = hash(key.position, key.uv, key.normal) & (slots - 1);
        while (table[at] != VD_NO_INDEX &&
               memcmp((vd_corner *)s->keys.data + table[at], &key, sizeof key) != 0) {
            at = (at + 1) & (slots - 1);
        }
        if (table[at] == VD_NO_INDEX) {
            vd_corner *to = vd_list_add(b->context, &s->keys, 1, sizeof *to);
            if (to == NULL) {
                status = vd_out_of_memory("a model's vertices", s->keys.count * sizeof *to);
                break;
            }
            *to = key;
            table[at] = (uint32_t)(s->keys.count - 1);
        }
        s->vertex_of_corner[c] = table[at];
    }
    vd_release(b->context, table);
    return status;
}

static vd_status number_vertices(skin *s) {
    vd_model_builder *b = s->builder;
    const bool by_normal = b->model->computed_normals;
    /* Of positions at one place each may have a colour or texture coordinates of its own. */
    const bool differ = s->welded && (b->uvs_by != VD_BY_NONE || b->colors.count > 0);
    if (b->uvs_by != VD_BY_CORNER && (by_normal || b->normals_by != VD_BY_CORNER) && !differ) {
        return by_normal ? number_directly(s, numbers(&b->corner_normals), s->owner.count)
                         : number_directly(s, numbers(&b->corners), b->positions.count);
    }
    return number_combinations(s);
}

/* Collects `components` values of each vertex; a vertex without a number gets zeros. */
static float *collect(skin *s, const float *from, size_t components, size_t member) {
    const vd_corner *keys = s->keys.data;
    float *to = vd_allocate_zero(s->builder->context, s->keys.count * components, sizeof *to);
    for (size_t v = 0; v < s->keys.count && to != NULL; v++) {
        const uint32_t numbers_of[3] = {keys[v].position, keys[v].uv, keys[v].normal};
        const uint32_t i = numbers_of[member];
        if (i != VD_NO_INDEX) {
            memcpy(to + v * components, from + (size_t)i * components, components * sizeof *to);
        }
    }
    return to;
}

static vd_status collect_attributes(skin *s) {
    vd_model_builder *b = s->builder;
    const bool uvs = b->uvs_by != VD_BY_NONE, colors = b->colors.count > 0;
    s->positions = collect(s, b->positions.data, 3, 0);
    s->normals = collect(s, b->model->computed_normals ? s->computed.data : b->normals.data, 3, 2);
    s->uvs = uvs ? collect(s, b->uvs.data, 2, 1) : NULL;
    s->colors = colors ? collect(s, b->colors.data, 3, 0) : NULL;
    if (s->positions == NULL || s->normals == NULL || (uvs && s->uvs == NULL) ||
        (colors && s->colors == NULL)) {
        return vd_out_of_memory("a model's vertices", s->keys.count * 12);
    }
    return vd_success();
}

/* ---- parts ------------------------------------------------------------------------------------*/

/* Sorts the triangles by material, each material's in their order, and makes a part of each. */
static vd_status sort_by_material(skin *s) {
    vd_model_builder *b = s->builder;
    const size_t triangles = b->corners.count / 3, materials = b->materials.count;
    const uint32_t *material = numbers(&b->triangle_materials);
    if (b->triangle_materials.count == 0) {
        s->indices = s->vertex_of_corner;
        return vd_success();
    }
    uint32_t *start = vd_allocate_zero(b->context, materials + 1, sizeof *start);
    s->indices = vd_allocate(b->context, b->corners.count, sizeof *s->indices);
    s->parts = vd_allocate(b->context, materials, sizeof *s->parts);
    if (start == NULL || s->indices == NULL || s->parts == NULL) {
        vd_release(b->context, start);
        return vd_out_of_memory("a model's parts", b->corners.count * sizeof *s->indices);
    }
    for (size_t t = 0; t < triangles; t++) {
        start[material[t] + 1]++;
    }
    for (size_t m = 0; m < materials; m++) {
        if (start[m + 1] > 0) {
            s->parts[s->part_count++] = (vd_mesh_part){start[m], start[m + 1], (uint32_t)m};
        }
        start[m + 1] += start[m];
    }
    for (size_t t = 0; t < triangles; t++) {
        memcpy(s->indices + 3 * (size_t)start[material[t]]++, s->vertex_of_corner + 3 * t,
               3 * sizeof *s->indices);
    }
    vd_release(b->context, start);
    return vd_success();
}

/* ---- meshes -----------------------------------------------------------------------------------*/

static void count_flat_triangles(skin *s) {
    const vd_model_builder *b = s->builder;
    const float *p = b->positions.data;
    for (size_t c = 0; c < b->corners.count; c += 3) {
        const float *a = p + 3 * (size_t)numbers(&b->corners)[c];
        double side[2][3];
        for (size_t k = 0; k < 6; k++) {
            const float *to = p + 3 * (size_t)numbers(&b->corners)[c + 1 + k / 3];
            side[k / 3][k % 3] = (double)to[k % 3] - (double)a[k % 3];
        }
        bool is_flat = true;
        for (int k = 0; k < 3; k++) {
            const int u = (k + 1) % 3, v = (k + 2) % 3;
            is_flat = is_flat && side[0][u] * side[1][v] == side[0][v] * side[1][u];
        }
        b->model->flat_triangles += is_flat;
    }
}

static vd_status create(vd_model_builder *b, const vd_mesh_def *def) {
    vd_status status = vd_mesh_create(b->context, def, &b->model->meshes[def->topology]);
    return status.code == VD_OK || status.code == VD_ERROR_MEMORY
               ? status
               : vd_failure(VD_ERROR_FORMAT, "cannot read %.120s: %.240s", b->path, status.message);
}

static vd_status make_triangles(skin *s) {
    vd_model_builder *b = s->builder;
    s->vertex_of_corner = vd_allocate(b->context, b->corners.count, sizeof *s->vertex_of_corner);
    if (s->vertex_of_corner == NULL) {
        return vd_out_of_memory("a model's triangles", b->corners.count * sizeof(uint32_t));
    }
    count_flat_triangles(s);
    vd_status status = has_normals(b) ? vd_success() : compute_normals(s);
    if (status.code == VD_OK) {
        status = number_vertices(s);
    }
    if (status.code == VD_OK) {
        status = collect_attributes(s);
    }
    if (status.code == VD_OK) {
        status = sort_by_material(s);
    }
    if (status.code != VD_OK) {
        return status;
    }
    vd_mesh_def def = vd_mesh_def_default();
    def.anchor = b->anchor;
    def.vertex_count = s->keys.count;
    def.positions = s->positions;
    def.normals = s->normals;
    def.uvs = s->uvs;
    def.extra = s->colors;
    def.extra_count = s->colors != NULL ? 3 : 0;
    def.index_count = b->corners.count;
    def.indices = s->indices;
    def.parts = s->parts;
    def.part_count = s->part_count;
    return create(b, &def);
}

static void finish_skin(skin *s) {
    vd_context *context = s->builder->context;
    void *memory[] = {s->keys.data, s->computed.data, s->owner.data, s->positions,
                      s->normals,   s->uvs,           s->colors,     s->parts};
    for (size_t i = 0; i < sizeof memory / sizeof memory[0]; i++) {
        vd_release(context, memory[i]);
    }
    if (s->indices != s->vertex_of_corner) {
        vd_release(context, s->indices);
    }
    vd_release(context, s->vertex_of_corner);
}

/* Lines and points use the positions as they are. */
static vd_status make_plain(vd_model_builder *b, vd_topology topology, const vd_list *indices) {
    vd_mesh_def def = vd_mesh_def_default();
    def.anchor = b->anchor;
    def.topology = topology;
    def.vertex_count = b->positions.count;
    def.positions = b->positions.data;
    def.normals = b->normals_by == VD_BY_POSITION ? b->normals.data : NULL;
    def.extra = b->colors.data;
    def.extra_count = b->colors.count > 0 ? 3 : 0;
    def.extra = b->colors.count > 0 ? def.extra : NULL;
    def.index_count = indices->count;
    def.indices = indices->count > 0 ? indices->data : NULL;
    return create(b, &def);
}

/* ---- materials --------------------------------------------------------------------------------*/

/* What a file says of transparency becomes what the raster draws. An opaque material's alpha is not
 * looked at (glTF 2.0, §3.9.4). */
static void apply_alpha(vd_material *material, const vd_model_surface *surface) {
    const float cutoff = surface->alpha_cutoff;
    material->blend = surface->alpha_mode == VD_ALPHA_BLEND;
    material->alpha_test = 0.0f;
    if (surface->alpha_mode == VD_ALPHA_MASK) {
        material->alpha_test = cutoff > 0.0f ? cutoff < 1.0f ? cutoff : 1.0f : 0.0f;
    }
}

static vd_status settle_materials(vd_model_builder *b) {
    if (b->materials.count == 0) {
        const vd_material plain = vd_model_clay();
        const vd_model_surface surface = {.texture = -1};
        uint32_t first = 0;
        vd_status status = vd_builder_add_material(b, &plain, &surface, &first);
        if (status.code != VD_OK) {
            return status;
        }
    }
    vd_model *m = b->model;
    m->materials = b->materials.data;
    m->surfaces = b->surfaces.data;
    m->material_count = (int)b->materials.count;
    m->textures = b->textures.data;
    m->texture_names = b->texture_names.data;
    m->texture_count = (int)b->textures.count;
    vd_list *given[] = {&b->materials, &b->surfaces, &b->textures, &b->texture_names};
    for (size_t i = 0; i < sizeof given / sizeof given[0]; i++) {
        memset(given[i], 0, sizeof *given[i]);
    }
    for (int i = 0; i < m->material_count; i++) {
        const int texture = m->surfaces[i].texture;
        m->materials[i].texture = texture >= 0 ? m->textures[texture] : NULL;
        m->materials[i].filter = VD_TEXTURE_ANISOTROPIC;
        apply_alpha(&m->materials[i], &m->surfaces[i]);
    }
    return vd_success();
}

vd_status vd_model_build(vd_model_builder *b, vd_model **out) {
    if (b->positions.count == 0) {
        return vd_failure(VD_ERROR_EMPTY,
                          "cannot draw %.160s: it has no vertices; check that it is "
                          "the file that is meant",
                          b->path);
    }
    b->model->has_colors = b->colors.count > 0;
    vd_status status = vd_success();
    if (b->corners.count > 0) {
        skin s = {.builder = b};
        status = make_triangles(&s);
        finish_skin(&s);
    }
    if (status.code == VD_OK && b->line_ends.count > 0) {
        status = make_plain(b, VD_TOPOLOGY_LINES, &b->line_ends);
    }
    const bool cloud = b->corners.count == 0 && b->line_ends.count == 0;
    if (status.code == VD_OK && (b->dots.count > 0 || cloud)) {
        status = make_plain(b, VD_TOPOLOGY_POINTS, &b->dots);
    }
    if (status.code == VD_OK) {
        status = settle_materials(b);
    }
    if (status.code == VD_OK) {
        *out = b->model;
        b->model = NULL;
    }
    return status;
}
