/* model_block.c: a model as one block.
 *
 *     head · materials · textures' heads · meshes (64-byte aligned) · texels (64-byte aligned)
 *
 * Offsets are from the block's beginning and follow from the counts and sizes in their order: what
 * unpacks computes them again, and a block whose numbers disagree is damaged. Little-endian, as all
 * blocks here.
 */
#define XXH_INLINE_ALL
#include <xxhash.h>

#include <math.h>
#include <string.h>
#include "core/core.h"
#include "model/model_build.h"
#include "raster/texture_internal.h"

#define MOST_COUNT (1 << 20)
#define MOST_SIDE 16384

static const uint8_t block_magic[8] = {'V', 'D', 'M', 'O', 'D', 'E', 'L', 1};

typedef struct block_head {
    uint8_t magic[8];
    uint64_t size_bytes;
    uint64_t checksum; /* XXH64 of the block with this field 0 */
    uint64_t flat_triangles;
    uint64_t mesh_bytes[VD_TOPOLOGY_COUNT]; /* 0: there is none */
    uint32_t material_count, texture_count;
    uint8_t z_up, computed_normals, has_colors, reserved[5];
    char format[32];
} block_head;

typedef struct block_material {
    vd_linear albedo, emission, specular;
    float alpha, shininess, alpha_test, alpha_cutoff;
    uint32_t filter, blend, alpha_mode;
    int32_t texture; /* −1: none */
    char name[64];
} block_material;

typedef struct block_texture {
    int32_t width, height;
    char name[248]; /* cut */
} block_texture;

static uint64_t round_up(uint64_t bytes) {
    return (bytes + 63) / 64 * 64;
}

/* Where things stand. */
typedef struct layout {
    uint64_t materials, textures, meshes[VD_TOPOLOGY_COUNT], texels, size;
} layout;

static uint64_t texel_bytes(const block_texture *t) {
    return round_up((uint64_t)t->width * (uint64_t)t->height * 4);
}

/* All but the texels, whose sizes stand in the block. */
static layout lay_out(const block_head *head) {
    layout l = {.materials = round_up(sizeof *head)};
    l.textures = l.materials + (uint64_t)head->material_count * sizeof(block_material);
    uint64_t at = round_up(l.textures + (uint64_t)head->texture_count * sizeof(block_texture));
    for (int i = 0; i < VD_TOPOLOGY_COUNT; i++) {
        l.meshes[i] = at;
        at += head->mesh_bytes[i];
    }
    l.texels = l.size = at;
    return l;
}

static block_head head_of(const vd_model *model) {
    block_head head = {.flat_triangles = model->flat_triangles,
                       .material_count = (uint32_t)model->material_count,
                       .texture_count = (uint32_t)model->texture_count,
                       .z_up = model->z_up,
                       .computed_normals = model->computed_normals,
                       .has_colors = model->has_colors};
    memcpy(head.magic, block_magic, sizeof block_magic);
    memcpy(head.format, model->format, sizeof head.format);
    for (int i = 0; i < VD_TOPOLOGY_COUNT; i++) {
        head.mesh_bytes[i] = model->meshes[i] != NULL ? model->meshes[i]->size_bytes : 0;
    }
    head.size_bytes = lay_out(&head).size;
    for (int i = 0; i < model->texture_count; i++) {
        const vd_texture_level *level = &model->textures[i]->levels[0];
        head.size_bytes +=
            texel_bytes(&(block_texture){.width = level->width, .height = level->height});
    }
    return head;
}

size_t vd_model_packed_bytes(const vd_model *model) {
    return (size_t)head_of(model).size_bytes;
}

/* ---- packing ----------------------------------------------------------------------------------*/

static void pack_material(const vd_model *model, int i, block_material *out) {
    const vd_material *m = &model->materials[i];
    const vd_model_surface *s = &model->surfaces[i];
    *out = (block_material){.albedo = m->albedo,
                            .emission = m->emission,
                            .specular = m->specular,
                            .alpha = m->alpha,
                            .shininess = m->shininess,
                            .alpha_test = m->alpha_test,
                            .alpha_cutoff = s->alpha_cutoff,
                            .filter = (uint32_t)m->filter,
                            .blend = m->blend,
                            .alpha_mode = (uint32_t)s->alpha_mode,
                            .texture = s->texture};
    memcpy(out->name, s->name, sizeof out->name);
}

void vd_model_pack(const vd_model *model, void *block) {
    block_head head = head_of(model);
    const layout l = lay_out(&head);
    uint8_t *bytes = block;
    memset(bytes, 0, (size_t)head.size_bytes);
    for (int i = 0; i < model->material_count; i++) {
        block_material material;
        pack_material(model, i, &material);
        memcpy(bytes + l.materials + (size_t)i * sizeof material, &material, sizeof material);
    }
    uint64_t at = l.texels;
    for (int i = 0; i < model->texture_count; i++) {
        const vd_texture_level *level = &model->textures[i]->levels[0];
        block_texture texture = {.width = level->width, .height = level->height};
        const size_t length = strlen(model->texture_names[i]);
        memcpy(texture.name, model->texture_names[i],
               length < sizeof texture.name ? length : sizeof texture.name - 1);
        memcpy(bytes + l.textures + (size_t)i * sizeof texture, &texture, sizeof texture);
        memcpy(bytes + at, level->texels, (size_t)level->width * (size_t)level->height * 4);
        at += texel_bytes(&texture);
    }
    for (int i = 0; i < VD_TOPOLOGY_COUNT; i++) {
        if (model->meshes[i] != NULL) {
            memcpy(bytes + l.meshes[i], model->meshes[i], model->meshes[i]->size_bytes);
        }
    }
    memcpy(bytes, &head, sizeof head);
    head.checksum = XXH64(bytes, (size_t)head.size_bytes, 0);
    memcpy(bytes, &head, sizeof head);
}

/* ---- unpacking --------------------------------------------------------------------------------*/

static vd_status damaged(const char *what) {
    return vd_failure(VD_ERROR_FORMAT,
                      "a model's block is damaged: its %s cannot be so; write or send it again",
                      what);
}

static bool checksum_fits(const uint8_t *bytes, const block_head *head) {
    block_head without = *head;
    without.checksum = 0;
    XXH64_state_t state;
    XXH64_reset(&state, 0);
    XXH64_update(&state, &without, sizeof without);
    XXH64_update(&state, bytes + sizeof without, (size_t)head->size_bytes - sizeof without);
    return XXH64_digest(&state) == head->checksum;
}

/* Sizes and counts, so that everything named lies in the block. */
static vd_status check_block(const uint8_t *bytes, size_t size_bytes, block_head *head, layout *l) {
    if (size_bytes < sizeof *head || memcmp(bytes, block_magic, sizeof block_magic) != 0) {
        return damaged("beginning");
    }
    memcpy(head, bytes, sizeof *head);
    bool fits = head->size_bytes == size_bytes && head->material_count >= 1 &&
                head->material_count <= MOST_COUNT && head->texture_count <= MOST_COUNT &&
                head->format[sizeof head->format - 1] == '\0';
    for (int i = 0; i < VD_TOPOLOGY_COUNT; i++) {
        fits = fits && head->mesh_bytes[i] <= size_bytes && head->mesh_bytes[i] % 64 == 0;
    }
    if (!fits) {
        return damaged("head");
    }
    *l = lay_out(head);
    if (l->size > size_bytes || !checksum_fits(bytes, head)) {
        return damaged(l->size > size_bytes ? "size" : "checksum");
    }
    uint64_t end = l->texels;
    for (uint32_t i = 0; i < head->texture_count; i++) {
        block_texture t;
        memcpy(&t, bytes + l->textures + (size_t)i * sizeof t, sizeof t);
        if (t.width < 1 || t.height < 1 || t.width > MOST_SIDE || t.height > MOST_SIDE ||
            t.name[sizeof t.name - 1] != '\0') {
            return damaged("texture");
        }
        end += texel_bytes(&t);
    }
    return end == size_bytes ? vd_success() : damaged("size");
}

static bool is_light(vd_linear c) {
    return isfinite(c.r) && isfinite(c.g) && isfinite(c.b);
}

static vd_status unpack_materials(vd_model *model, const uint8_t *bytes, const layout *l) {
    for (int i = 0; i < model->material_count; i++) {
        block_material m;
        memcpy(&m, bytes + l->materials + (size_t)i * sizeof m, sizeof m);
        if (!is_light(m.albedo) || !is_light(m.emission) || !is_light(m.specular) ||
            !(m.alpha >= 0.0f && m.alpha <= 1.0f) ||
            !(m.shininess >= 0.0f && m.shininess <= 65536.0f) ||
            !(m.alpha_test >= 0.0f && m.alpha_test <= 1.0f) || !isfinite(m.alpha_cutoff) ||
            m.filter >= VD_TEXTURE_FILTER_COUNT || m.blend > 1 ||
            m.alpha_mode >= VD_ALPHA_MODE_COUNT || m.texture < -1 ||
            m.texture >= model->texture_count || m.name[sizeof m.name - 1] != '\0') {
            return damaged("material");
        }
        model->materials[i] =
            (vd_material){.albedo = m.albedo,
                          .emission = m.emission,
                          .specular = m.specular,
                          .alpha = m.alpha,
                          .shininess = m.shininess,
                          .alpha_test = m.alpha_test,
                          .filter = (vd_texture_filter)m.filter,
                          .blend = m.blend != 0,
                          .texture = m.texture >= 0 ? model->textures[m.texture] : NULL};
        model->surfaces[i] = (vd_model_surface){.alpha_mode = (vd_alpha_mode)m.alpha_mode,
                                                .alpha_cutoff = m.alpha_cutoff,
                                                .texture = m.texture};
        memcpy(model->surfaces[i].name, m.name, sizeof m.name);
    }
    return vd_success();
}

static vd_status unpack_textures(vd_model *model, const uint8_t *bytes, const block_head *head,
                                 const layout *l) {
    uint64_t at = l->texels;
    vd_status status = vd_success();
    for (uint32_t i = 0; i < head->texture_count && status.code == VD_OK; i++) {
        block_texture t;
        memcpy(&t, bytes + l->textures + (size_t)i * sizeof t, sizeof t);
        model->texture_names[i] = vd_copy_string(model->context, t.name);
        status = model->texture_names[i] != NULL
                     ? vd_texture_create_from_texels(model->context, bytes + at, t.width, t.height,
                                                     &model->textures[i])
                     : vd_out_of_memory("a texture's name", sizeof t.name);
        model->texture_count = (int)i + 1;
        at += texel_bytes(&t);
    }
    return status;
}

static vd_status unpack_meshes(vd_model *model, const uint8_t *bytes, const block_head *head,
                               const layout *l) {
    vd_status status = vd_success();
    for (int i = 0; i < VD_TOPOLOGY_COUNT && status.code == VD_OK; i++) {
        const size_t size = (size_t)head->mesh_bytes[i];
        const vd_mesh *mesh = (const vd_mesh *)(const void *)(bytes + l->meshes[i]);
        if (size == 0) {
            continue;
        }
        status = vd_mesh_validate(mesh, size);
        for (uint32_t p = 0; status.code == VD_OK && p < mesh->part_count; p++) {
            if (vd_mesh_parts(mesh)[p].material >= head->material_count ||
                mesh->topology != (uint32_t)i) {
                status = damaged("mesh");
            }
        }
        if (status.code == VD_OK) {
            model->meshes[i] = vd_allocate(model->context, 1, size);
            if (model->meshes[i] == NULL) {
                return vd_out_of_memory("a mesh", size);
            }
            memcpy(model->meshes[i], mesh, size);
        }
    }
    return status;
}

vd_status vd_model_unpack(vd_context *context, const void *block, size_t size_bytes,
                          vd_model **out) {
    if ((uintptr_t)block % 64 != 0) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "a model's block lies at no multiple of 64 bytes; copy it to one");
    }
    block_head head;
    layout l = {.size = 0};
    vd_status status = check_block(block, size_bytes, &head, &l);
    if (status.code != VD_OK) {
        return status;
    }
    const size_t materials = head.material_count, textures = head.texture_count;
    vd_model *model = vd_allocate_zero(context, 1, sizeof *model);
    if (model == NULL) {
        return vd_out_of_memory("a model", sizeof *model);
    }
    model->context = context;
    model->z_up = head.z_up != 0;
    model->computed_normals = head.computed_normals != 0;
    model->has_colors = head.has_colors != 0;
    model->flat_triangles = head.flat_triangles;
    memcpy(model->format, head.format, sizeof model->format);
    model->material_count = (int)materials;
    model->materials = vd_allocate_zero(context, materials, sizeof *model->materials);
    model->surfaces = vd_allocate_zero(context, materials, sizeof *model->surfaces);
    model->textures = vd_allocate_zero(context, textures, sizeof *model->textures);
    model->texture_names = vd_allocate_zero(context, textures, sizeof *model->texture_names);
    if (model->materials == NULL || model->surfaces == NULL || model->textures == NULL ||
        model->texture_names == NULL) {
        status = vd_out_of_memory("a model", materials * sizeof *model->materials);
    }
    if (status.code == VD_OK) {
        status = unpack_textures(model, block, &head, &l);
    }
    if (status.code == VD_OK) {
        status = unpack_materials(model, block, &l);
    }
    if (status.code == VD_OK) {
        status = unpack_meshes(model, block, &head, &l);
    }
    if (status.code != VD_OK) {
        vd_model_destroy(&model);
        return status;
    }
    *out = model;
    return status;
}
