/* text.c: a picture with a title, a north arrow, a scale, a legend, and the names of its peaks.
 *
 *   text [OUT.png [WIDTH [map]]]
 *
 * An island of crests as seen from the south, or straight from above with "map". Names of peaks
 * that hills hide are left out; others find spots where they do not overlap.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <veduta/text.h>
#include <veduta/veduta.h>

enum { SIDE = 512, SPACING_M = 30, MOST_PEAKS = 18, LAYERS_A_PEAK = 5 };

static const char *const names[MOST_PEAKS] = {
    "Store Østhorn", "Weiße Wand", "Cima d’Oro",  "Älplihorn",   "Dent Sèche", "جبل النور",
    "Rysy",          "Pico Ñandú", "Αγία Πέτρα",  "Kékes",       "Гора Белая", "הר התבור",
    "Þórshnúkur",    "Jebel Musa", "Cerro Agudo", "Ben Vorlich", "Tête Ronde", "Kuh-e Sefid"};

typedef struct peak {
    vd_vec3 place;
    vd_outline outline;
} peak;

/* What a picture is made with. */
typedef struct studio {
    vd_context *context;
    vd_heightfield *map;
    vd_frame *frame;
    vd_camera camera;
    vd_colormap colors;
    double min, max; /* heights, metres */
    vd_font *font;
    vd_furniture *furniture;
    vd_label_layout *layout;
    vd_coverage *coverage;
    peak peaks[MOST_PEAKS];
    size_t peak_count;
    double size_px; /* of letters */
} studio;

/* ---- the island ---------------------------------------------------------------------------------
 */

#define SEA_M -1.0f

static float heights[SIDE][SIDE];

/* A wave between 0 and 1 that rises and falls evenly, with a sharp crest. */
static float fold(float x) {
    float part = x - (float)(int)x;
    return part < 0.5f ? 2.0f * part : 2.0f - 2.0f * part;
}

static void make_heights(void) {
    for (int row = 0; row < SIDE; row++) {
        for (int column = 0; column < SIDE; column++) {
            float x = (float)(2 * column - SIDE) / SIDE, y = (float)(2 * row - SIDE) / SIDE;
            float cap = 1.0f - x * x * x * x - y * y * y * y, crests = 0.0f, height = 0.5f;
            float u = 1.7f * x + 7.35f, v = 1.7f * y + 9.2f;
            for (int octave = 0; octave < 7; octave++) {
                crests += height * fold(u) * fold(v);
                float turned = 1.6f * u - 1.2f * v + 20.0f; /* by 37°, twice as fine */
                v = 1.2f * u + 1.6f * v + 10.0f;
                u = turned;
                height *= 0.42f;
            }
            float land = cap > 0 ? 5200.0f * cap * crests - 350.0f : SEA_M;
            heights[row][column] = land > SEA_M ? land : SEA_M;
        }
    }
}

/* The highest samples of their neighbourhoods, the highest first. */
static void find_peaks(studio *s) {
    enum { REACH = 14 };
    for (int row = REACH; row < SIDE - REACH; row++) {
        for (int column = REACH; column < SIDE - REACH; column++) {
            const float height = heights[row][column];
            bool highest = height > 700.0f;
            for (int i = 0; i < (2 * REACH + 1) * (2 * REACH + 1) && highest; i++) {
                highest = heights[row + i / (2 * REACH + 1) - REACH]
                                 [column + i % (2 * REACH + 1) - REACH] <= height;
            }
            size_t at = s->peak_count;
            while (highest && at > 0 && s->peaks[at - 1].place.z < (double)height) {
                at--;
            }
            if (!highest || at == MOST_PEAKS) {
                continue;
            }
            s->peak_count += s->peak_count < MOST_PEAKS;
            memmove(&s->peaks[at + 1], &s->peaks[at], (s->peak_count - 1 - at) * sizeof(peak));
            s->peaks[at].place = vd_vec3_make(column * SPACING_M, -row * SPACING_M, (double)height);
        }
    }
}

static vd_status make_map(studio *s) {
    make_heights();
    for (int i = 0; i < SIDE * SIDE; i++) {
        const double height = (double)heights[i / SIDE][i % SIDE];
        s->max = height > s->max ? height : s->max;
    }
    find_peaks(s);
    vd_heightfield_def def = vd_heightfield_def_default();
    def.width = SIDE;
    def.height = SIDE;
    def.type = VD_HEIGHT_F32;
    def.heights = heights;
    def.height_stride = SIDE;
    def.world_from_sample[1] = SPACING_M;  /* x grows with the column */
    def.world_from_sample[5] = -SPACING_M; /* y shrinks with the row */
    return vd_heightfield_create(s->context, &def, &s->map);
}

/* ---- the view -----------------------------------------------------------------------------------
 */

static vd_status draw_view(studio *s, bool from_above) {
    const int width = s->frame->width, height = s->frame->height;
    const double extent = SIDE * SPACING_M;
    const vd_vec3 middle = vd_vec3_make(extent * 0.5, -extent * 0.5, 300.0);
    s->camera = (vd_camera){.eye = vd_vec3_make(extent * 0.3, -extent * 1.5, 4300.0),
                            .projection = VD_PROJECTION_PERSPECTIVE,
                            .lens = vd_lens_from_fov(0.55, width, height),
                            .near_m = 1.0};
    s->camera.orientation = vd_orientation_look_at(s->camera.eye, middle);
    if (from_above) {
        s->camera.eye = vd_vec3_make(middle.x, middle.y, 10000.0);
        s->camera.orientation = vd_orientation_from_angles(0.3, -1.57079632679489661923, 0.0);
        s->camera.projection = VD_PROJECTION_ORTHOGRAPHIC;
        s->camera.lens.fx = s->camera.lens.fy = height / (0.95 * extent);
        s->camera.far_m = 20000.0;
    }
    if (!vd_colormap_find("topo", &s->colors)) {
        s->colors = (vd_colormap){.count = 1, .stops = {{0.0, {160, 160, 160, 255}}}};
    }
    vd_terrain_def def = vd_terrain_def_default();
    def.heightfield = s->map;
    def.colormap = &s->colors;
    return vd_terrain_render(s->context, NULL, &def, &s->camera, s->frame, NULL);
}

/* The distance of what a pixel shows, along the view axis. */
static double distance_at(const studio *s, int x, int y) {
    return vd_camera_distance(&s->camera,
                              s->frame->depth[(size_t)y * s->frame->stride + (size_t)x]);
}

/* Where a peak is in the picture; false when a hill hides it. */
static bool see_peak(const studio *s, const peak *p, double *x, double *y) {
    double z;
    if (!vd_camera_project(&s->camera, p->place, x, y, &z) || !(*x >= 0) || !(*y >= 1) ||
        *x >= s->frame->width || *y >= s->frame->height) {
        return false;
    }
    /* The pixel above: the peak's own may show the slope before it. */
    return distance_at(s, (int)*x, (int)*y - 1) > 0.99 * z;
}

/* ---- names --------------------------------------------------------------------------------------
 */

static vd_status outline_text(void *user, const char *utf8, double size_px, vd_outline *out) {
    return vd_font_outline(user, utf8, size_px, out);
}

/* Outlines the names with the heights, of whose boxes it makes requests. */
static vd_status request_labels(studio *s, vd_label_request *requests, size_t *from,
                                size_t *count) {
    const float room = (float)(0.2 * s->size_px);
    *count = 0;
    for (size_t i = 0; i < s->peak_count; i++) {
        peak *p = &s->peaks[i];
        double x, y;
        if (!see_peak(s, p, &x, &y)) {
            continue;
        }
        char text[128];
        snprintf(text, sizeof text, "%s %.0f", names[i], p->place.z);
        vd_status status = vd_font_outline(s->font, text, s->size_px, &p->outline);
        if (status.code != VD_OK) {
            return status;
        }
        from[*count] = i;
        requests[(*count)++] = (vd_label_request){
            .x = (float)x,
            .y = (float)y,
            .width = (float)p->outline.advance + 2 * room,
            .height = (float)(p->outline.ascent + p->outline.descent),
            .priority = p->place.z,
            .leader = VD_LEADER_ALLOWED,
        };
    }
    return vd_success();
}

/* A line with a dark edge from a box to its place, and a triangle there. */
static size_t add_leader(const studio *s, const vd_letters *letters,
                         const vd_label_request *request, const vd_label_spot *spot,
                         double points[5][2], vd_stroke strokes[2], vd_layer *layers) {
    const double x = (double)request->x, y = (double)request->y, side = 0.3 * s->size_px;
    const double corners[5][2] = {{x, (double)spot->box[3]},
                                  {x, y},
                                  {x, y - 0.5 * side},
                                  {x + side, y + side},
                                  {x - side, y + side}};
    memcpy(points, corners, sizeof corners);
    size_t count = 0;
    for (int i = 0; i < 2; i++) {
        strokes[i] = vd_stroke_default();
        strokes[i].width = s->size_px * (i == 0 ? 0.22 : 0.09);
        vd_layer_color(i == 0 ? letters->halo : letters->color, strokes[i].color);
        layers[count] = vd_layer_default();
        layers[count].path.points = (const double(*)[2])points;
        layers[count].path.point_count = 2;
        layers[count].path.open = true;
        layers[count].filled = false;
        layers[count].stroke = &strokes[i];
        count += spot->leader;
    }
    layers[count] = vd_layer_default();
    layers[count].path.points = (const double(*)[2])(points + 2);
    layers[count].path.point_count = 3;
    layers[count].stroke = &strokes[0];
    layers[count + 1] = layers[count];
    layers[count].filled = false;
    layers[count + 1].stroke = NULL;
    vd_layer_color(letters->color, layers[count + 1].fill);
    return count + 2;
}

static vd_status draw_labels(studio *s, const vd_overlay *overlay, bool from_above) {
    static vd_label_request requests[MOST_PEAKS];
    static vd_label_spot spots[MOST_PEAKS];
    static double points[MOST_PEAKS][5][2];
    static vd_stroke strokes[MOST_PEAKS][3];
    static vd_layer layers[MOST_PEAKS * (LAYERS_A_PEAK + 1)];
    size_t from[MOST_PEAKS], count, layer_count = 0;
    vd_status status = request_labels(s, requests, from, &count);
    vd_label_layout_def def = vd_label_layout_def_default();
    def.width = s->frame->width;
    def.height = s->frame->height;
    def.kept = overlay->kept;
    def.kept_count = overlay->kept_count;
    def.mark = (float)(0.35 * s->size_px);
    def.gap = (float)(0.45 * s->size_px);
    def.rise_first = !from_above;
    if (status.code == VD_OK) {
        status = vd_label_layout_place(s->layout, &def, requests, count, spots);
    }
    const vd_letters letters = vd_letters_default(s->size_px);
    for (size_t i = 0; i < count && status.code == VD_OK; i++) {
        if (spots[i].shown) {
            layer_count += add_leader(s, &letters, &requests[i], &spots[i], points[i], strokes[i],
                                      layers + layer_count);
            const vd_outline *outline = &s->peaks[from[i]].outline;
            layer_count += (size_t)vd_outline_layers(
                outline, floor((double)spots[i].box[0] + 0.2 * s->size_px),
                floor((double)spots[i].box[1] + outline->ascent), &letters, &strokes[i][2],
                layers + layer_count);
        }
    }
    return status.code != VD_OK
               ? status
               : vd_coverage_draw_frame(s->coverage, NULL, NULL, layers, layer_count, s->frame);
}

/* ---- the picture --------------------------------------------------------------------------------
 */

static vd_status draw_furniture(studio *s, vd_overlay *overlay) {
    vd_furniture_def def = vd_furniture_def_default();
    def.title = "An Island of Crests";
    def.north = def.scale = true;
    def.legend = &s->colors;
    def.legend_min = s->min;
    def.legend_max = s->max;
    def.outline = outline_text;
    def.outline_user = s->font;
    vd_status status = vd_furniture_create(s->context, &def, &s->furniture);
    if (status.code == VD_OK) {
        const double ground_m = distance_at(s, s->frame->width / 2, s->frame->height / 2);
        status = vd_furniture_arrange(s->furniture, &s->camera, s->frame->width, s->frame->height,
                                      ground_m, overlay);
    }
    if (status.code == VD_OK) {
        status = vd_coverage_draw_frame(s->coverage, NULL, NULL, overlay->layers,
                                        overlay->layer_count, s->frame);
    }
    return status;
}

static vd_status make_picture(studio *s, const char *path, int width, bool from_above) {
    vd_overlay overlay = {0};
    vd_status status = vd_context_create(NULL, &s->context);
    if (status.code == VD_OK) {
        status = vd_frame_create(s->context, width, width * 9 / 16, VD_PLANE_DEPTH, &s->frame);
    }
    if (status.code == VD_OK) {
        status = make_map(s);
    }
    if (status.code == VD_OK) {
        status = draw_view(s, from_above);
    }
    if (status.code == VD_OK) {
        status = vd_font_find(s->context, NULL, &s->font);
    }
    if (status.code == VD_OK) {
        status = vd_label_layout_create(s->context, &s->layout);
    }
    if (status.code == VD_OK) {
        status = vd_coverage_create(s->context, &s->coverage);
    }
    if (status.code == VD_OK) {
        status = draw_furniture(s, &overlay);
    }
    if (status.code == VD_OK) {
        status = draw_labels(s, &overlay, from_above);
    }
    return status.code == VD_OK ? vd_frame_save_png(s->frame, path, NULL) : status;
}

int main(int argc, char **argv) {
    static studio s;
    const int width = argc > 2 ? atoi(argv[2]) : 1280;
    s.size_px = width / 80 > 10 ? width / 80 : 10;
    const vd_status status = make_picture(&s, argc > 1 ? argv[1] : "text.png", width,
                                          argc > 3 && strcmp(argv[3], "map") == 0);
    if (status.code != VD_OK) {
        fprintf(stderr, "text: %s\n", status.message);
    }
    for (size_t i = 0; i < s.peak_count; i++) {
        vd_outline_finish(&s.peaks[i].outline);
    }
    vd_furniture_destroy(&s.furniture);
    vd_label_layout_destroy(&s.layout);
    vd_coverage_destroy(&s.coverage);
    vd_font_destroy(&s.font);
    vd_frame_destroy(&s.frame);
    if (s.context != NULL) {
        vd_heightfield_destroy(s.context, &s.map);
        vd_context_destroy(&s.context);
    }
    return status.code == VD_OK ? 0 : 1;
}
