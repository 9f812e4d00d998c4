/* placed_wasm.c: the models and bricks that a page keeps, where instances of models stand, and
 * their light.
 *
 * Blocks come from a server: each is checked before it is used. Models, instances and bricks have
 * slots of their own; an instance names its model's slot, which may be empty.
 */
#include "world/wasm/placed_wasm.h"
#include <string.h>
#include <veduta/colormap.h>

#define MOST_MODELS 4096u
#define MOST_INSTANCES 16384u
#define MOST_BRICKS 16384u

typedef struct instance {
    uint32_t model; /* slot + 1; 0: there is no instance */
    vd_place place;
} instance;

/* One page, one thread. */
static struct {
    vd_context *context;
    vd_placer *placer;
    vd_model **models;       /* [MOST_MODELS] */
    instance *instances;     /* [MOST_INSTANCES] */
    vd_brick_block **bricks; /* [MOST_BRICKS] */
    vd_placed *placed;       /* [MOST_INSTANCES], of a frame */
    vd_light light;
    bool lit;
    vd_placed_account account; /* of the frame that is drawn, or was drawn last */
    char sentence[VD_MESSAGE_BYTES];
} page;

/* Makes room for models and for drawing them; only once. Returns 0 when there is no memory. */
int VD_EXPORT(vd_wasm_placed_create)(uint32_t bytes) {
    page.context = vd_wasm_context(bytes);
    if (page.context == NULL || page.placer != NULL) {
        return page.placer != NULL;
    }
    page.models = (vd_model **)vd_wasm_take(MOST_MODELS * sizeof *page.models);
    page.instances = (instance *)vd_wasm_take(MOST_INSTANCES * sizeof *page.instances);
    page.bricks = (vd_brick_block **)vd_wasm_take(MOST_BRICKS * sizeof(vd_brick_block *));
    page.placed = (vd_placed *)vd_wasm_take(MOST_INSTANCES * sizeof *page.placed);
    if (page.models == NULL || page.instances == NULL || page.bricks == NULL ||
        page.placed == NULL) {
        return 0;
    }
    memset(page.models, 0, MOST_MODELS * sizeof *page.models);
    memset(page.instances, 0, MOST_INSTANCES * sizeof *page.instances);
    memset(page.bricks, 0, MOST_BRICKS * sizeof(vd_brick_block *));
    return vd_placer_create(page.context, &page.placer).code == VD_OK;
}

/* Returns where a block of so many bytes is to be written; 0 when there is no memory. */
void *VD_EXPORT(vd_wasm_model_room)(uint32_t bytes) {
    return page.placer != NULL ? vd_allocate(page.context, bytes, 1) : NULL;
}

void VD_EXPORT(vd_wasm_model_remove)(uint32_t slot) {
    if (page.placer != NULL && slot < MOST_MODELS) {
        vd_model_destroy(&page.models[slot]);
    }
}

/* What adding a block returns: 0; 1 when there is no memory; else the address of a sentence that
 * says what is wrong with the block. */
static uintptr_t result_of(const vd_status *status) {
    memcpy(page.sentence, status->message, sizeof page.sentence);
    return status->code == VD_OK             ? 0
           : status->code == VD_ERROR_MEMORY ? 1
                                             : (uintptr_t)page.sentence;
}

/* Makes a model of the block that was written, and gives its room back. */
uintptr_t VD_EXPORT(vd_wasm_model_add)(uint32_t slot, void *block, uint32_t bytes) {
    vd_model *model = NULL;
    vd_wasm_model_remove(slot);
    const vd_status status = slot < MOST_MODELS
                                 ? vd_model_unpack(page.context, block, bytes, &model)
                                 : vd_failure(VD_ERROR_MEMORY, "%s", "");
    vd_release(page.context, block);
    if (status.code == VD_OK) {
        page.models[slot] = model;
    }
    return result_of(&status);
}

void VD_EXPORT(vd_wasm_brick_remove)(uint32_t slot) {
    if (page.placer != NULL && slot < MOST_BRICKS) {
        vd_brick_block_destroy(&page.bricks[slot]);
    }
}

/* The same of a brick, whose numbers begin at an origin. */
uintptr_t VD_EXPORT(vd_wasm_brick_add)(uint32_t slot, void *block, uint32_t bytes,
                                       const double origin[3]) {
    vd_brick_block *brick = NULL;
    vd_wasm_brick_remove(slot);
    const vd_status status =
        slot < MOST_BRICKS
            ? vd_brick_block_unpack(page.context, block, bytes,
                                    vd_vec3_make(origin[0], origin[1], origin[2]), &brick)
            : vd_failure(VD_ERROR_MEMORY, "%s", "");
    vd_release(page.context, block);
    if (status.code == VD_OK) {
        page.bricks[slot] = brick;
    }
    return result_of(&status);
}

/* Places an instance of a model: origin, axes, sun, ground (three numbers and 1, or four times 0).
 * False when there is no such slot. */
int VD_EXPORT(vd_wasm_instance_add)(uint32_t slot, uint32_t model, const double numbers[17]) {
    if (page.placer == NULL || slot >= MOST_INSTANCES || model >= MOST_MODELS) {
        return 0;
    }
    instance *i = &page.instances[slot];
    i->model = model + 1;
    i->place.origin = vd_vec3_make(numbers[0], numbers[1], numbers[2]);
    for (int k = 0; k < 9; k++) {
        i->place.axes[k / 3][k % 3] = (float)numbers[3 + k];
    }
    i->place.sun = (float)numbers[12];
    for (int k = 0; k < 3; k++) {
        i->place.ground[k] = (float)numbers[13 + k];
    }
    i->place.has_ground = numbers[16] != 0.0;
    return 1;
}

void VD_EXPORT(vd_wasm_instance_remove)(uint32_t slot) {
    if (page.placer != NULL && slot < MOST_INSTANCES) {
        page.instances[slot].model = 0;
    }
}

static vd_linear linear(const double *rgb) {
    return (vd_linear){(float)rgb[0], (float)rgb[1], (float)rgb[2]};
}

/* Sets the light: towards the sun; colours of the sun, of ambient light from above and below, of
 * the horizon; the haze's distance. */
void VD_EXPORT(vd_wasm_light_set)(const double numbers[16]) {
    page.light = (vd_light){.sun_direction = vd_vec3_make(numbers[0], numbers[1], numbers[2]),
                            .sun = linear(numbers + 3),
                            .ambient_up = linear(numbers + 6),
                            .ambient_down = linear(numbers + 9),
                            .horizon = linear(numbers + 12),
                            .haze_m = numbers[15]};
    page.lit = true;
}

int vd_wasm_placed_draw(int run, const uint32_t *order, int count, const vd_camera *camera,
                        const vd_display_window *window) {
    const vd_placed_window to = {window->rgba, window->width, window->height, window->stride};
    int made = 0, drawn = 0;
    if (run == 0) {
        page.account = (vd_placed_account){.runs = 0};
    }
    for (int k = 0; k < count && made < (int)MOST_INSTANCES; k++) {
        const uint32_t slot = order[k] - VD_WASM_INSTANCES;
        const uint32_t brick = order[k] - VD_WASM_BRICKS;
        const instance *i = slot < MOST_INSTANCES && page.lit ? &page.instances[slot] : NULL;
        if (i != NULL && i->model != 0 && page.models[i->model - 1] != NULL) {
            page.placed[made++] =
                (vd_placed){.model = page.models[i->model - 1], .place = i->place};
        } else if (order[k] >= VD_WASM_BRICKS && brick < MOST_BRICKS &&
                   page.bricks[brick] != NULL) {
            page.placed[made++] = (vd_placed){.brick = page.bricks[brick]};
        }
    }
    /* Without memory the frame has none of them. */
    return made > 0 && vd_placer_draw(page.placer, NULL, &page.light, camera, page.placed, made,
                                      &to, &page.account, &drawn)
                               .code == VD_OK
               ? drawn
               : 0;
}

bool vd_wasm_placed_is_absurd(int width, int height) {
    return vd_placed_is_absurd(&page.account, width, height);
}

/* ---- what there is not in a page: hills and shadows that are asked for by the fragment, colours
 * of numbers, which bricks have looked up ---- */

bool vd_colormap_find(const char *name, vd_colormap *out) {
    (void)name;
    *out = (vd_colormap){.relative = true};
    return true;
}

vd_rgba8 vd_colormap_at(const vd_colormap *map, double value, double low, double high) {
    (void)map, (void)value, (void)low, (void)high;
    return (vd_rgba8){0, 0, 0, 0};
}

float vd_hill_shade(const void *heightfield, double exaggeration, vd_vec3 sun, vd_vec3 point);
float vd_hill_shade(const void *heightfield, double exaggeration, vd_vec3 sun, vd_vec3 point) {
    (void)heightfield, (void)exaggeration, (void)sun, (void)point;
    return 1.0f;
}

uint32_t vd_sun_map_shares(const void *map, uint32_t mask, const float column[16],
                           const float row[16], const float height[16], const float width[16],
                           float share[16]);
uint32_t vd_sun_map_shares(const void *map, uint32_t mask, const float column[16],
                           const float row[16], const float height[16], const float width[16],
                           float share[16]) {
    (void)map, (void)mask, (void)column, (void)row, (void)height, (void)width;
    for (int i = 0; i < 16; i++) {
        share[i] = 1.0f;
    }
    return 0;
}

double vd_curvature_drop(double distance_m);
double vd_curvature_drop(double distance_m) { /* light is aimed without curvature */
    (void)distance_m;
    return 0.0;
}
