/* scene_wasm.c: the pictures that a page keeps, and a frame of them for a camera.
 *
 * Pictures lie in one heap whose size the page states to the server once; each belongs to a slot,
 * and only slots are known outside, so that what is left free in pieces can be pushed together. The
 * page says which slots are shown, in which order, and draws. Cameras and corners are placed by the
 * code that the native program has, in doubles: the same bytes.
 *
 *   heap   │head│picture······│head│free···│head│picture···│head│free··············│
 *          first-fit from where the last one was found; neighbours that are free become one
 */
#include <float.h>
#include <veduta/camera.h>
#include "display/wasm/display_wasm.h"

#define HEAD_BYTES 64u
#define NO_SLOT UINT32_MAX
#define MOST_SLOTS 65537u /* what a client may hold, and one */
#define BYTES_PER_PIXEL 4u

enum { TINT_SIDE = 64 };

typedef struct block {
    uint32_t bytes; /* with this head: a multiple of HEAD_BYTES */
    uint32_t slot;  /* NO_SLOT: free */
} block;

typedef struct slot {
    uint32_t at; /* of its block in the heap, plus 1; 0: empty */
    int width, height;
    int opaque[4];
    bool fixed;         /* to the screen: corners are in camera space, see veduta.proto */
    vd_vec3 corners[4]; /* world, metres, in the order of vd_quad */
} slot;

/* One page, one thread, one scene. */
static struct {
    uint8_t *heap;
    uint32_t heap_bytes, rover, used_bytes; /* rover: where looking begins */
    slot *slots;
    uint32_t slot_count;
    uint32_t *order; /* slots, or instances of models from VD_WASM_INSTANCES on */
    uint8_t *tint;   /* picture of a border */
    bool absurd;     /* the last frame's order was */
} scene;

static block *block_at(uint32_t at) {
    return (block *)(scene.heap + at);
}

/* ---- the heap ---------------------------------------------------------------------------------*/

/* A free block of at least `bytes` at or after `from`; heap_bytes when there is none. */
static uint32_t find_free(uint32_t from, uint32_t end, uint32_t bytes) {
    for (uint32_t at = from; at < end; at += block_at(at)->bytes) {
        block *b = block_at(at);
        if (b->slot != NO_SLOT) {
            continue;
        }
        for (uint32_t next = at + b->bytes;
             next < scene.heap_bytes && block_at(next)->slot == NO_SLOT; next = at + b->bytes) {
            b->bytes += block_at(next)->bytes;
        }
        if (b->bytes >= bytes) {
            return at;
        }
    }
    return scene.heap_bytes;
}

/* Pushes all pictures to the heap's front; what is free is one block then. Blocks are moved in
 * pieces of a head, of which distances are multiples: forward, so that overlap does no harm. */
static void push_together(void) {
    uint32_t to = 0;
    for (uint32_t at = 0; at < scene.heap_bytes;) {
        const block b = *block_at(at);
        if (b.slot != NO_SLOT) {
            if (to != at) {
                uint64_t *out = (uint64_t *)(scene.heap + to);
                const uint64_t *in = (const uint64_t *)(scene.heap + at);
                for (uint32_t i = 0; i < b.bytes / 8; i++) {
                    out[i] = in[i];
                }
                scene.slots[b.slot].at = to + 1;
            }
            to += b.bytes;
        }
        at += b.bytes;
    }
    if (to < scene.heap_bytes) {
        *block_at(to) = (block){scene.heap_bytes - to, NO_SLOT};
    }
    scene.rover = 0;
}

static uint32_t allocate(uint32_t bytes) {
    uint32_t at = find_free(scene.rover, scene.heap_bytes, bytes);
    if (at == scene.heap_bytes) {
        at = find_free(0, scene.heap_bytes, bytes);
    }
    if (at == scene.heap_bytes && scene.heap_bytes - scene.used_bytes >= bytes) {
        push_together();
        at = find_free(0, scene.heap_bytes, bytes);
    }
    return at;
}

/* ---- slots ------------------------------------------------------------------------------------*/

/* Makes a scene of `slots` slots and a heap; only once. Returns where the order is kept: `slots`
 * numbers of 32 bits; 0 when there is no memory. */
uint32_t *VD_EXPORT(vd_wasm_scene_create)(uint32_t slots, uint32_t heap_bytes) {
    if (slots == 0 || slots > MOST_SLOTS || heap_bytes < HEAD_BYTES || heap_bytes > INT32_MAX) {
        return NULL;
    }
    heap_bytes &= ~(HEAD_BYTES - 1);
    slot *table = (slot *)vd_wasm_take(slots * sizeof *table);
    uint32_t *order = (uint32_t *)vd_wasm_take(slots * sizeof *order);
    uint8_t *heap = (uint8_t *)vd_wasm_take(heap_bytes);
    uint8_t *tint = (uint8_t *)vd_wasm_take(TINT_SIDE * TINT_SIDE * BYTES_PER_PIXEL);
    if (table == NULL || order == NULL || heap == NULL || tint == NULL) {
        return NULL;
    }
    for (uint32_t i = 0; i < slots; i++) {
        table[i] = (slot){.at = 0};
    }
    for (int i = 0; i < TINT_SIDE * TINT_SIDE; i++) { /* an orange border, premultiplied */
        const int x = i % TINT_SIDE, y = i / TINT_SIDE;
        const bool border = x == 0 || y == 0 || x == TINT_SIDE - 1 || y == TINT_SIDE - 1;
        const uint8_t pixel[4] = {border ? 230 : 28, border ? 159 : 20, 0, border ? 255 : 32};
        for (int c = 0; c < 4; c++) {
            tint[4 * i + c] = pixel[c];
        }
    }
    scene.slots = table;
    scene.slot_count = slots;
    scene.order = order;
    scene.heap = heap;
    scene.heap_bytes = heap_bytes;
    scene.tint = tint;
    *block_at(0) = (block){heap_bytes, NO_SLOT};
    return order;
}

/* Empties a slot; one that is empty or does not exist stays so. */
void VD_EXPORT(vd_wasm_scene_remove)(uint32_t number) {
    if (number < scene.slot_count && scene.slots[number].at != 0) {
        block *b = block_at(scene.slots[number].at - 1);
        scene.used_bytes -= b->bytes;
        b->slot = NO_SLOT;
        scene.slots[number].at = 0;
    }
}

/* Makes room for a picture in a slot, in the place of what it had. Returns where its pixels go,
 * `width` to a row; 0 when there is no room: the slot is then empty. Addresses hold until the next
 * one is added. */
uint8_t *VD_EXPORT(vd_wasm_scene_add)(uint32_t number, int width, int height) {
    vd_wasm_scene_remove(number);
    if (number >= scene.slot_count || width < 2 || height < 2 || width > VD_MAX_SIDE ||
        height > VD_MAX_SIDE) {
        return NULL;
    }
    const uint64_t wanted =
        HEAD_BYTES + (uint64_t)BYTES_PER_PIXEL * (uint64_t)width * (uint64_t)height;
    const uint64_t bytes = (wanted + HEAD_BYTES - 1) & ~(uint64_t)(HEAD_BYTES - 1);
    const uint32_t at = bytes <= scene.heap_bytes ? allocate((uint32_t)bytes) : scene.heap_bytes;
    if (at == scene.heap_bytes) {
        return NULL;
    }
    block *b = block_at(at);
    if (b->bytes > bytes) {
        *block_at(at + (uint32_t)bytes) = (block){b->bytes - (uint32_t)bytes, NO_SLOT};
    }
    *b = (block){(uint32_t)bytes, number};
    scene.rover = at;
    scene.used_bytes += b->bytes;
    scene.slots[number] = (slot){.at = at + 1, .width = width, .height = height};
    return scene.heap + at + HEAD_BYTES;
}

/* Sets where a slot's picture stands: four corners of x, y, z; its opaque rectangle; whether it is
 * fixed to the screen. What is not sound is found when it is drawn. */
void VD_EXPORT(vd_wasm_scene_place)(uint32_t number, const double corners[12], const int opaque[4],
                                    int fixed) {
    if (number < scene.slot_count) {
        slot *s = &scene.slots[number];
        s->fixed = fixed != 0;
        for (int i = 0; i < 4; i++) {
            s->corners[i] = vd_vec3_make(corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]);
            s->opaque[i] = opaque[i];
        }
    }
}

/* Bytes of the heap that pictures take, their heads included. */
uint32_t VD_EXPORT(vd_wasm_scene_bytes)(void) {
    return scene.used_bytes;
}

/* ---- cameras ----------------------------------------------------------------------------------*/

/* A camera as the page keeps it. */
typedef struct page_camera {
    double eye[3], orientation[4], lens[4], near_m;
} page_camera;

static vd_camera read_camera(const page_camera *c) {
    return (vd_camera){
        .eye = vd_vec3_make(c->eye[0], c->eye[1], c->eye[2]),
        .orientation = {c->orientation[0], c->orientation[1], c->orientation[2], c->orientation[3]},
        .projection = VD_PROJECTION_PERSPECTIVE,
        .lens = {c->lens[0], c->lens[1], c->lens[2], c->lens[3]},
        .near_m = c->near_m};
}

/* Turns a camera and gives it a lens: angles in degrees, as `veduta render` reads them. */
void VD_EXPORT(vd_wasm_camera_aim)(page_camera *c, double heading, double pitch, double roll,
                                   double fov, int width, int height) {
    const double degree = 3.14159265358979323846 / 180.0;
    const vd_quat q = vd_orientation_from_angles(heading * degree, pitch * degree, roll * degree);
    const vd_lens lens = vd_lens_from_fov(fov * degree, width, height);
    const double turned[4] = {q.x, q.y, q.z, q.w}, seen[4] = {lens.fx, lens.fy, lens.cx, lens.cy};
    for (int i = 0; i < 4; i++) {
        c->orientation[i] = turned[i];
        c->lens[i] = seen[i];
    }
}

/* As vd_quad_place, whose sentences have no place here. */
static bool place(vd_quad *quad, const vd_camera *camera, const vd_matrix *matrix,
                  const vd_vec3 corners[4]) {
    for (int i = 0; i < 4; i++) {
        const vd_vec3 p = vd_vec3_subtract(corners[i], camera->eye);
        double at[3];
        for (int j = 0; j < 3; j++) {
            const double *row = matrix->m[j == 2 ? 3 : j];
            at[j] = row[0] * p.x + row[1] * p.y + row[2] * p.z + row[3];
            if (!(at[j] <= (double)FLT_MAX && at[j] >= -(double)FLT_MAX)) {
                return false;
            }
        }
        quad->corners[i] = (vd_quad_corner){(float)at[0], (float)at[1], (float)at[2]};
    }
    return true;
}

/* ---- frames -----------------------------------------------------------------------------------*/

/* Fills height rows of stride pixels with one colour. */
void VD_EXPORT(vd_wasm_fill)(uint32_t *rgba, int height, size_t stride, uint32_t color) {
    for (size_t i = 0; i < stride * (size_t)height; i++) {
        rgba[i] = color;
    }
}

/* What quads are placed by. */
typedef struct eye {
    vd_camera camera;
    vd_matrix matrix;
} eye;

/* That of pictures which are fixed to the screen. Homogeneous places may be scaled: theirs, about
 * one unit away, are brought behind the near plane, wherever that is. */
static eye fixed_eye(double near_m, int width, int height) {
    eye e = {.camera = {.orientation = {0, 0, 0, 1},
                        .projection = VD_PROJECTION_PERSPECTIVE,
                        .lens = {height, height, 0.5 * width, 0.5 * height},
                        .near_m = near_m}};
    const double scale = near_m > 0.5 ? 2 * near_m : 1;
    e.matrix = vd_camera_matrix(&e.camera);
    for (int i = 0; i < 16; i++) {
        e.matrix.m[i / 4][i % 4] *= scale;
    }
    return e;
}

/* The quad of a slot's picture; false where there is none, or it cannot be placed. */
static bool make_quad(uint32_t number, const eye *free, const eye *fixed, vd_quad *quad) {
    if (number >= scene.slot_count || scene.slots[number].at == 0) {
        return false;
    }
    const slot *s = &scene.slots[number];
    *quad = (vd_quad){.opacity = 255};
    quad->picture = (vd_quad_picture){scene.heap + (s->at - 1) + HEAD_BYTES,
                                      s->width,
                                      s->height,
                                      (size_t)s->width,
                                      {s->opaque[0], s->opaque[1], s->opaque[2], s->opaque[3]}};
    const eye *from = s->fixed ? fixed : free;
    return place(quad, &from->camera, &from->matrix, s->corners);
}

/* How many numbers from here on are instances. */
static uint32_t count_instances(uint32_t from, uint32_t end) {
    uint32_t at = from;
    while (at < end && scene.order[at] >= VD_WASM_INSTANCES) {
        at++;
    }
    return at - from;
}

/* Draws what the first `count` numbers of the order name, farthest first, over rgba (as
 * vd_wasm_draw wants it); with `bounds` a tint over each. What is not sound or no longer there is
 * left out, and what comes when the frame was covered too often. Returns the number of pictures
 * drawn, or −1 when there is no memory. */
int VD_EXPORT(vd_wasm_scene_draw)(const page_camera *page, uint8_t *rgba, int width, int height,
                                  size_t stride, uint32_t count, int bounds) {
    const uintptr_t mark = vd_wasm_mark();
    const vd_camera camera = read_camera(page);
    const eye free = {camera, vd_camera_matrix(&camera)};
    const eye fixed = fixed_eye(page->near_m, width, height);
    const uint32_t most = count < scene.slot_count ? count : scene.slot_count;
    vd_quad *quads = (vd_quad *)vd_wasm_take((bounds ? 2 : 1) * most * sizeof *quads);
    if (quads == NULL) {
        return -1;
    }
    const float near_m = (float)page->near_m;
    const double screen = (double)width * height;
    double pixels = 0;
    int made = 0, shown = 0;
    const vd_display_window window = {
        .rgba = rgba, .width = width, .height = height, .stride = stride};
    int unsound = 0, runs = 0;
    for (uint32_t i = 0; i < most; i++) {
        vd_quad quad;
        if (scene.order[i] >= VD_WASM_INSTANCES) { /* over what was ordered before */
            const uint32_t run = count_instances(i, most);
            unsound =
                unsound < 0 ? unsound : vd_wasm_draw_quads(&window, quads, made, near_m, false);
            shown += vd_wasm_placed_draw(runs++, scene.order + i, (int)run, &camera, &window);
            made = 0;
            i += run - 1;
            continue;
        }
        if (!make_quad(scene.order[i], &free, &fixed, &quad)) {
            continue;
        }
        pixels += vd_quad_pixels(&quad, near_m, width, height);
        if (pixels > VD_DISPLAY_MOST_SCREENS * screen) {
            continue;
        }
        quads[made++] = quad;
        shown++;
        if (bounds) {
            quad.picture =
                (vd_quad_picture){scene.tint, TINT_SIDE, TINT_SIDE, TINT_SIDE, {0, 0, 0, 0}};
            quads[made++] = quad;
        }
    }
    unsound = unsound < 0 ? unsound : vd_wasm_draw_quads(&window, quads, made, near_m, false);
    scene.absurd = pixels > VD_DISPLAY_ABSURD_SCREENS * screen ||
                   (runs > 0 && vd_wasm_placed_is_absurd(width, height));
    vd_wasm_return(mark);
    return unsound < 0 ? -1 : shown;
}

/* Whether more was ordered for the last frame than any world takes. */
int VD_EXPORT(vd_wasm_scene_is_absurd)(void) {
    return scene.absurd;
}

/* Draws one opaque picture that the camera `from` saw, as if it were infinitely far away, as the
 * camera `page` sees it: only turning and zooming show. */
int VD_EXPORT(vd_wasm_screen_draw)(const page_camera *page, uint8_t *rgba, int width, int height,
                                   size_t stride, const page_camera *from, const uint8_t *picture,
                                   int picture_width, int picture_height) {
    vd_camera camera = read_camera(page);
    vd_camera seen = read_camera(from);
    camera.eye = seen.eye = vd_vec3_make(0, 0, 0);
    camera.near_m = 1e-3;
    const vd_matrix matrix = vd_camera_matrix(&camera);
    const double x[4] = {0, picture_width, picture_width, 0},
                 y[4] = {0, 0, picture_height, picture_height};
    vd_vec3 corners[4];
    for (int i = 0; i < 4; i++) {
        corners[i] = vd_camera_ray(&seen, x[i], y[i]).direction;
    }
    vd_quad quad = {.opacity = 255};
    quad.picture = (vd_quad_picture){
        picture, picture_width, picture_height, (size_t)picture_width, {0, 0, 0, 0}};
    const vd_display_window window = {
        .rgba = rgba, .width = width, .height = height, .stride = stride};
    return place(&quad, &camera, &matrix, corners)
               ? vd_wasm_draw_quads(&window, &quad, 1, 1e-3f, false)
               : 1;
}
