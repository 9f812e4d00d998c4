/* fly_preview.c: the map of a path. */
#include "fly_preview.h"

#include <math.h>

enum { PLACES = 4096 };

/* The camera that has the terrain and all of the path under it, north up. */
static vd_camera map_camera(const vd_fly_world *world, const vd_camera_path *path) {
    static const double room = 1.06;
    const vd_render_settings *s = world->run->settings;
    vd_vec3 low, high;
    vd_fly_world_bounds(world, &low, &high);
    for (int i = 0; i <= PLACES; i++) {
        vd_vec3 p = vd_camera_path_pose(path, vd_camera_path_duration(path) * i / PLACES).eye;
        low = vd_vec3_make(fmin(low.x, p.x), fmin(low.y, p.y), fmin(low.z, p.z));
        high = vd_vec3_make(fmax(high.x, p.x), fmax(high.y, p.y), fmax(high.z, p.z));
    }
    const double wide = room * (high.x - low.x) + 1e-6, tall = room * (high.y - low.y) + 1e-6;
    const double x = s->width / wide, y = s->height / tall, scale = x < y ? x : y;
    const double depth = high.z - low.z + 2.0;
    return (vd_camera){
        .eye = {0.5 * (low.x + high.x), 0.5 * (low.y + high.y), high.z + depth + 1.0},
        .orientation = vd_orientation_from_angles(0.0, -90.0 * VD_RADIANS_PER_DEGREE, 0.0),
        .projection = VD_PROJECTION_ORTHOGRAPHIC,
        .lens = {scale, scale, 0.5 * s->width, 0.5 * s->height},
        .near_m = 0.1,
        .far_m = 3.0 * depth + 10.0};
}

static void place_on_map(const vd_camera *camera, vd_vec3 place, double out[2]) {
    double unused;
    (void)vd_camera_project(camera, place, &out[0], &out[1], &unused);
}

static void add_dot(vd_layer *layer, vd_stroke *stroke, double (*twice)[2], double width,
                    const uint16_t color[4]) {
    *stroke = vd_stroke_default();
    *layer = vd_layer_default();
    stroke->width = width;
    stroke->cap = VD_CAP_ROUND;
    for (int i = 0; i < 4; i++) {
        stroke->color[i] = color[i];
    }
    twice[1][0] = twice[0][0] + 1e-3; /* nearly a point: the caps make it a dot */
    twice[1][1] = twice[0][1];
    layer->filled = false;
    layer->stroke = stroke;
    layer->path.points = (const double(*)[2])twice;
    layer->path.point_count = 2;
    layer->path.open = true;
}

/* Strokes the path: white under dark blue, dots at a few keyframes, at its beginning and its end.
 */
static vd_status draw_path(vd_fly_world *world, const vd_camera *camera, const vd_camera_path *path,
                           vd_frame *frame) {
    enum { MOST_DOTS = 64, MOST = MOST_DOTS + 4 };
    static const uint16_t white[4] = {65535, 65535, 65535, 65535},
                          blue[4] = {6000, 12000, 40000, 65535},
                          green[4] = {5000, 45000, 12000, 65535},
                          red[4] = {57000, 9000, 9000, 65535};
    double line[PLACES + 1][2], dots[MOST][2][2];
    vd_layer layers[MOST];
    vd_stroke strokes[MOST];
    const double unit = (frame->width < frame->height ? frame->width : frame->height) / 400.0;
    const double width = unit > 1.0 ? unit : 1.0;
    int count = 0;
    for (int i = 0; i <= PLACES; i++) {
        const double t = vd_camera_path_duration(path) * i / PLACES;
        place_on_map(camera, vd_camera_path_pose(path, t).eye, line[i]);
    }
    for (int pass = 0; pass < 2; pass++, count++) {
        layers[count] = vd_layer_default();
        strokes[count] = vd_stroke_default();
        strokes[count].width = (pass == 0 ? 4.5 : 2.5) * width;
        strokes[count].join = VD_JOIN_ROUND;
        strokes[count].cap = VD_CAP_ROUND;
        for (int c = 0; c < 4; c++) {
            strokes[count].color[c] = pass == 0 ? white[c] : blue[c];
        }
        layers[count].filled = false;
        layers[count].stroke = &strokes[count];
        layers[count].path.points = (const double(*)[2])line;
        layers[count].path.point_count = PLACES + 1;
        layers[count].path.open = true;
    }
    const int keys = vd_camera_path_keyframe_count(path);
    for (int i = 0; i < keys && keys <= MOST_DOTS; i++, count++) {
        place_on_map(camera, vd_camera_path_keyframe(path, i).eye, dots[count][0]);
        add_dot(&layers[count], &strokes[count], dots[count], 5.0 * width, blue);
    }
    for (int end = 1; end >= 0; end--, count++) {
        const double t = end == 0 ? 0.0 : vd_camera_path_duration(path);
        place_on_map(camera, vd_camera_path_pose(path, t).eye, dots[count][0]);
        add_dot(&layers[count], &strokes[count], dots[count], 8.0 * width, end == 0 ? green : red);
    }
    vd_coverage *coverage = NULL;
    vd_status status = vd_coverage_create(world->run->context, &coverage);
    if (status.code == VD_OK) {
        status =
            vd_coverage_draw_frame(coverage, world->run->job, NULL, layers, (size_t)count, frame);
    }
    vd_coverage_destroy(&coverage);
    return status;
}

vd_status vd_fly_save_map(vd_fly_world *world, const vd_camera_path *path, const char *output) {
    const vd_render_settings *s = world->run->settings;
    const vd_camera camera = map_camera(world, path);
    vd_frame *frame = NULL;
    vd_status status = vd_frame_create(world->run->context, s->width, s->height, 0, &frame);
    if (status.code == VD_OK) {
        status = vd_fly_draw_map(world, &camera, frame);
    }
    if (status.code == VD_OK) {
        status = draw_path(world, &camera, path, frame);
    }
    if (status.code == VD_OK) {
        status = vd_frame_save_png(frame, output, NULL);
    }
    vd_frame_destroy(&frame);
    return status;
}
