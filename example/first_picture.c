/* first_picture.c: the shortest way from heights in memory to a picture of them.
 *
 *   first_picture [OUT.png]
 *
 * Makes an island of 256 × 256 samples, 30 m apart, and draws it from the south.
 */
#include <stdio.h>
#include <veduta/veduta.h>

enum { SIDE = 256, SPACING_M = 30 };

/* A wave between 0 and 1 that rises and falls evenly, with a sharp crest. */
static float fold(float x) {
    float part = x - (float)(int)x;
    part = part < 0.0f ? -part : part;
    return part < 0.5f ? 2.0f * part : 2.0f - 2.0f * part;
}

/* An island in a sea at 0: crests, each turned against and half as
 * high as the last, under a round cap. */
static void make_heights(float heights[SIDE][SIDE]) {
    for (int row = 0; row < SIDE; row++) {
        for (int column = 0; column < SIDE; column++) {
            float x = (float)(2 * column - SIDE) / SIDE, y = (float)(2 * row - SIDE) / SIDE;
            float cap = 1.0f - x * x - y * y, crests = 0.0f, height = 0.5f;
            float u = x + 7.3f, v = y + 9.1f;
            for (int octave = 0; octave < 6; octave++) {
                crests += height * fold(u) * fold(v);
                float turned = 1.6f * u - 1.2f * v + 20.0f; /* by 37°, twice as fine */
                v = 1.2f * u + 1.6f * v;
                u = turned;
                height *= 0.5f;
            }
            heights[row][column] = cap > 0 ? 2800.0f * cap * cap * crests : 0;
        }
    }
}

/* Draws the heightfield and saves the picture. Every call that can fail says so by its status. */
static vd_status draw(vd_context *context, const vd_heightfield *map, const char *path) {
    vd_frame *frame = NULL;
    vd_status status = vd_frame_create(context, 960, 540, 0, &frame);
    if (status.code != VD_OK) {
        return status;
    }
    /* World coordinates are metres: x east, y north, z up; row 0 of the map is its north. */
    vd_vec3 eye = vd_vec3_make(SIDE * SPACING_M * 0.35, -SIDE * SPACING_M * 1.5, 2600.0);
    vd_vec3 target = vd_vec3_make(SIDE * SPACING_M * 0.5, -SIDE * SPACING_M * 0.5, 500.0);
    vd_camera camera = {.eye = eye,
                        .orientation = vd_orientation_look_at(eye, target),
                        .projection = VD_PROJECTION_PERSPECTIVE,
                        .lens = vd_lens_from_fov(0.7, frame->width, frame->height),
                        .near_m = 1.0};
    vd_colormap colors;
    if (!vd_colormap_find("terrain", &colors)) {
        colors = (vd_colormap){.count = 1, .stops = {{0.0, {160, 160, 160, 255}}}};
    }
    vd_terrain_def def = vd_terrain_def_default();
    def.heightfield = map;
    def.colormap = &colors;
    status = vd_terrain_render(context, NULL, &def, &camera, frame, NULL);
    if (status.code == VD_OK) {
        status = vd_frame_save_png(frame, path, NULL);
    }
    vd_frame_destroy(&frame);
    return status;
}

int main(int argc, char **argv) {
    static float heights[SIDE][SIDE];
    make_heights(heights);

    vd_heightfield_def def = vd_heightfield_def_default();
    def.width = SIDE;
    def.height = SIDE;
    def.type = VD_HEIGHT_F32;
    def.heights = heights;
    def.height_stride = SIDE;
    def.world_from_sample[1] = SPACING_M;  /* x grows with the column */
    def.world_from_sample[5] = -SPACING_M; /* y shrinks with the row */

    vd_context *context = NULL; /* threads, memory, SIMD level: all by default */
    vd_heightfield *map = NULL;
    vd_status status = vd_context_create(NULL, &context);
    if (status.code == VD_OK) {
        status = vd_heightfield_create(context, &def, &map);
    }
    if (status.code == VD_OK) {
        status = draw(context, map, argc > 1 ? argv[1] : "first_picture.png");
    }
    if (status.code != VD_OK) {
        fprintf(stderr, "first_picture: %s\n", status.message);
    }
    if (context != NULL) {
        vd_heightfield_destroy(context, &map);
        vd_context_destroy(&context);
    }
    return status.code == VD_OK ? 0 : 1;
}
