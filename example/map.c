/* map.c: a small map of vector paths: areas that meet without a seam, a river, roads, a dashed
 * border, a scale bar, at any size.
 *
 *   map [OUT.png [WIDTH]]
 */
#include <stdio.h>
#include <stdlib.h>
#include <veduta/veduta.h>

/* The map is 600 × 400 units large. */
enum { MAP_WIDTH = 600, MAP_HEIGHT = 400, MOST_LAYERS = 24 };

#define POINTS(name, ...) static const double name[][2] = {__VA_ARGS__}
#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

/* clang-format off */
POINTS(meadow, {0, 0}, {600, 0}, {600, 170}, {410, 210}, {330, 150}, {170, 190}, {0, 120});
POINTS(forest, {0, 120}, {170, 190}, {330, 150}, {410, 210}, {350, 400}, {0, 400});
POINTS(fields, {410, 210}, {600, 170}, {600, 400}, {350, 400});
/* A lake with an island, by curves. */
POINTS(lake, {120, 280}, {120, 230}, {230, 220}, {250, 270}, {270, 330}, {200, 350}, {160, 335},
       {130, 325}, {120, 310}, {120, 280},
       {190, 270}, {170, 270}, {170, 300}, {195, 300}, {225, 300}, {225, 270}, {190, 270});
static const uint8_t lake_verbs[] = {VD_PATH_MOVE, VD_PATH_CUBIC, VD_PATH_CUBIC, VD_PATH_CUBIC, VD_PATH_CLOSE,
                                     VD_PATH_MOVE, VD_PATH_CUBIC, VD_PATH_CUBIC, VD_PATH_CLOSE};
POINTS(river, {560, -10}, {520, 60}, {430, 40}, {400, 110}, {370, 180}, {300, 200}, {240, 255});
static const uint8_t river_verbs[] = {VD_PATH_MOVE, VD_PATH_CUBIC, VD_PATH_CUBIC};
POINTS(road, {-10, 60}, {140, 90}, {230, 60}, {350, 100}, {470, 260}, {610, 300});
POINTS(path, {230, 60}, {260, 150}, {330, 230}, {330, 330}, {420, 380});
POINTS(border, {-5, 340}, {90, 370}, {300, 380}, {380, 250}, {520, 230}, {605, 110});
POINTS(peak, {0, -12}, {11, 8}, {-11, 8});
POINTS(bar, {0, 0}, {40, 0}, {40, 6}, {0, 6});
/* clang-format on */

typedef struct map {
    vd_layer layers[MOST_LAYERS];
    vd_stroke strokes[MOST_LAYERS];
    size_t count;
    double scale; /* pixels per unit */
} map;

/* Opaque, from 8 bits. */
static void set_color(uint16_t color[4], unsigned rgb) {
    color[0] = (uint16_t)((rgb >> 16 & 255) * 257);
    color[1] = (uint16_t)((rgb >> 8 & 255) * 257);
    color[2] = (uint16_t)((rgb & 255) * 257);
    color[3] = 65535;
}

static vd_layer *add_layer(map *m, const double (*points)[2], size_t count, double x, double y) {
    vd_layer *layer = &m->layers[m->count++];
    *layer = vd_layer_default();
    layer->path.points = points;
    layer->path.point_count = count;
    layer->picture_from_path =
        (vd_affine){.xx = m->scale, .yy = m->scale, .x0 = x * m->scale, .y0 = y * m->scale};
    return layer;
}

static vd_layer *add_area(map *m, const double (*points)[2], size_t count, unsigned rgb) {
    vd_layer *layer = add_layer(m, points, count, 0, 0);
    set_color(layer->fill, rgb);
    return layer;
}

/* `width` in units of the map. */
static vd_stroke *add_line(map *m, const double (*points)[2], size_t count, double width,
                           unsigned rgb) {
    vd_stroke *stroke = &m->strokes[m->count];
    vd_layer *layer = add_layer(m, points, count, 0, 0);
    *stroke = vd_stroke_default();
    stroke->width = width * m->scale;
    stroke->join = VD_JOIN_ROUND;
    stroke->cap = VD_CAP_ROUND;
    set_color(stroke->color, rgb);
    layer->path.open = true;
    layer->filled = false;
    layer->stroke = stroke;
    return stroke;
}

static void add_water(map *m) {
    static const double lines[][2] = {{9, 0x7896b4}, {7, 0xa8c8e8}};
    vd_layer *shore = add_area(m, lake, COUNT(lake), 0xa8c8e8);
    shore->path.verbs = lake_verbs;
    shore->path.verb_count = COUNT(lake_verbs);
    shore->rule = VD_FILL_RULE_EVEN_ODD; /* the island is a hole */
    for (int i = 0; i < 2; i++) {
        vd_stroke *line = add_line(m, river, COUNT(river), lines[i][0], (unsigned)lines[i][1]);
        line->cap = VD_CAP_BUTT;
        m->layers[m->count - 1].path.verbs = river_verbs;
        m->layers[m->count - 1].path.verb_count = COUNT(river_verbs);
        if (i == 0) { /* the lake's edge between the river's edge and its water */
            m->strokes[m->count] = *line;
            m->strokes[m->count].width = 2 * m->scale;
            m->layers[m->count] = *shore;
            m->layers[m->count].stroke = &m->strokes[m->count];
            m->count++;
        }
    }
}

static void make_map(map *m, double scale) {
    m->scale = scale;
    add_area(m, meadow, COUNT(meadow), 0xdfe8c4)->expand = 0.7072; /* no seam between the areas */
    add_area(m, forest, COUNT(forest), 0xb5cda0)->expand = 0.7072;
    add_area(m, fields, COUNT(fields), 0xf0e6c0)->expand = 0.7072;
    add_water(m);
    add_line(m, path, COUNT(path), 2, 0x806040)->join = VD_JOIN_MITER;
    add_line(m, road, COUNT(road), 8, 0x705030);
    add_line(m, road, COUNT(road), 5.5, 0xffe090);
    vd_stroke *line = add_line(m, border, COUNT(border), 3, 0xa03070);
    line->cap = VD_CAP_BUTT;
    line->dash_count = 4;
    line->dashes[0] = 14 * scale;
    line->dashes[1] = 6 * scale;
    line->dashes[2] = 3 * scale;
    line->dashes[3] = 6 * scale;
    static const double peaks[][2] = {{70, 40}, {105, 28}, {300, 40}};
    for (size_t i = 0; i < COUNT(peaks); i++) {
        set_color(add_layer(m, peak, COUNT(peak), peaks[i][0], peaks[i][1])->fill, 0x70604c);
    }
    for (int i = 0; i < 4; i++) {
        vd_layer *part = add_layer(m, bar, COUNT(bar), 420 + 40 * i, 378);
        set_color(part->fill, i % 2 == 0 ? 0x303030 : 0xffffff);
        vd_stroke *edge = &m->strokes[m->count - 1];
        *edge = vd_stroke_default();
        edge->width = scale;
        part->stroke = edge;
    }
}

int main(int argc, char **argv) {
    const int width = argc > 2 ? atoi(argv[2]) : MAP_WIDTH;
    static map m;
    make_map(&m, (double)width / MAP_WIDTH);
    vd_context *context = NULL;
    vd_coverage *coverage = NULL;
    vd_frame *frame = NULL;
    vd_status status = vd_context_create(NULL, &context);
    if (status.code == VD_OK) {
        status = vd_coverage_create(context, &coverage);
    }
    if (status.code == VD_OK) {
        status = vd_frame_create(context, width, width * MAP_HEIGHT / MAP_WIDTH, 0, &frame);
    }
    if (status.code == VD_OK) {
        status = vd_coverage_draw_frame(coverage, NULL, NULL, m.layers, m.count, frame);
    }
    if (status.code == VD_OK) {
        status = vd_frame_save_png(frame, argc > 1 ? argv[1] : "map.png", NULL);
    }
    if (status.code != VD_OK) {
        fprintf(stderr, "map: %s\n", status.message);
    }
    vd_frame_destroy(&frame);
    vd_coverage_destroy(&coverage);
    vd_context_destroy(&context);
    return status.code == VD_OK ? 0 : 1;
}
