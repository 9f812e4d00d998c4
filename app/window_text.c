/* window_text.c: shapes for vd_coverage, letters of a font, and a stroke font.
 *
 * Of the stroke font a letter is a text of points, two digits each (column 0 … 4, row 0 … 8 from
 * the top; the baseline is row 6); a space lifts the pen.
 */
#include "window_text.h"

#include <stdlib.h>
#include <string.h>

#include "text_module.h"

/* ---- shapes -----------------------------------------------------------------------------------
 */

typedef struct shape {
    size_t first_point, point_count, first_verb, verb_count;
    bool stroked;
    double width;
    uint16_t color[4];
} shape;

struct vd_canvas {
    vd_coverage *coverage;
    vd_context *context;
    vd_text_module module;
    vd_font *font; /* null: strokes */
    bool font_sought;
    double (*points)[2];
    uint8_t *verbs;
    shape *shapes;
    vd_layer *layers;
    vd_stroke *strokes;
    size_t point_count, point_room, verb_count, verb_room, shape_count, shape_room, layer_room;
    bool out_of_memory;
};

vd_canvas *vd_canvas_create(vd_context *context) {
    vd_canvas *canvas = calloc(1, sizeof *canvas);
    if (canvas != NULL && vd_coverage_create(context, &canvas->coverage).code != VD_OK) {
        free(canvas);
        return NULL;
    }
    if (canvas != NULL) {
        canvas->context = context;
    }
    return canvas;
}

void vd_canvas_destroy(vd_canvas **canvas) {
    if (*canvas != NULL) {
        vd_coverage_destroy(&(*canvas)->coverage);
        if ((*canvas)->font != NULL) {
            (*canvas)->module.destroy(&(*canvas)->font);
        }
        free((*canvas)->points);
        free((*canvas)->verbs);
        free((*canvas)->shapes);
        free((*canvas)->layers);
        free((*canvas)->strokes);
        free(*canvas);
    }
    *canvas = NULL;
}

void vd_canvas_clear(vd_canvas *canvas) {
    canvas->point_count = canvas->verb_count = canvas->shape_count = 0;
    canvas->out_of_memory = false;
}

/* Makes room for one more; the old block is kept when there is none. */
static bool reserve(void **block, size_t count, size_t *room, size_t size) {
    if (count < *room) {
        return true;
    }
    const size_t more = *room > 0 ? 2 * *room : 64;
    void *grown = realloc(*block, more * size);
    if (grown == NULL) {
        return false;
    }
    *block = grown;
    *room = more;
    return true;
}

static void add_corner(vd_canvas *canvas, double x, double y) {
    if (!reserve((void **)&canvas->points, canvas->point_count, &canvas->point_room,
                 sizeof canvas->points[0])) {
        canvas->out_of_memory = true;
        return;
    }
    canvas->points[canvas->point_count][0] = x;
    canvas->points[canvas->point_count++][1] = y;
}

static void add_verb(vd_canvas *canvas, vd_path_verb verb) {
    if (!reserve((void **)&canvas->verbs, canvas->verb_count, &canvas->verb_room, 1)) {
        canvas->out_of_memory = true;
        return;
    }
    canvas->verbs[canvas->verb_count++] = (uint8_t)verb;
}

static void add_point(vd_canvas *canvas, vd_path_verb verb, double x, double y) {
    add_corner(canvas, x, y);
    add_verb(canvas, verb);
}

static shape *begin(vd_canvas *canvas, vd_rgba8 color) {
    static shape spare; /* written when there is no room, never read */
    if (!reserve((void **)&canvas->shapes, canvas->shape_count, &canvas->shape_room,
                 sizeof canvas->shapes[0])) {
        canvas->out_of_memory = true;
        return &spare;
    }
    shape *made = &canvas->shapes[canvas->shape_count++];
    *made = (shape){.first_point = canvas->point_count, .first_verb = canvas->verb_count};
    vd_layer_color(color, made->color);
    return made;
}

static void end(const vd_canvas *canvas, shape *made) {
    made->point_count = canvas->point_count - made->first_point;
    made->verb_count = canvas->verb_count - made->first_verb;
}

void vd_canvas_box(vd_canvas *canvas, double x, double y, double width, double height,
                   vd_rgba8 color) {
    shape *made = begin(canvas, color);
    add_point(canvas, VD_PATH_MOVE, x, y);
    add_point(canvas, VD_PATH_LINE, x + width, y);
    add_point(canvas, VD_PATH_LINE, x + width, y + height);
    add_point(canvas, VD_PATH_LINE, x, y + height);
    end(canvas, made);
}

void vd_canvas_line(vd_canvas *canvas, const double (*points)[2], int count, double width,
                    vd_rgba8 color) {
    shape *made = begin(canvas, color);
    made->stroked = true;
    made->width = width;
    for (int i = 0; i < count; i++) {
        add_point(canvas, i == 0 ? VD_PATH_MOVE : VD_PATH_LINE, points[i][0], points[i][1]);
    }
    end(canvas, made);
}

vd_status vd_canvas_draw(vd_canvas *canvas, vd_frame *frame) {
    if (canvas->layer_room < canvas->shape_count) {
        free(canvas->layers);
        free(canvas->strokes);
        canvas->layers = calloc(canvas->shape_count, sizeof canvas->layers[0]);
        canvas->strokes = calloc(canvas->shape_count, sizeof canvas->strokes[0]);
        canvas->layer_room = canvas->shape_count;
    }
    if (canvas->out_of_memory ||
        (canvas->shape_count > 0 && (canvas->layers == NULL || canvas->strokes == NULL))) {
        canvas->layer_room = 0;
        return vd_failure(VD_ERROR_MEMORY, "out of memory for the window's texts");
    }
    size_t count = 0;
    for (size_t i = 0; i < canvas->shape_count; i++) {
        const shape *s = &canvas->shapes[i];
        if (s->point_count == 0) {
            continue;
        }
        vd_layer *layer = &canvas->layers[count];
        *layer = vd_layer_default();
        layer->path = (vd_path){.points = (const double(*)[2])canvas->points + s->first_point,
                                .point_count = s->point_count,
                                .verbs = canvas->verbs + s->first_verb,
                                .verb_count = s->verb_count,
                                .open = s->stroked};
        layer->filled = !s->stroked;
        memcpy(layer->fill, s->color, sizeof s->color);
        if (s->stroked) {
            canvas->strokes[count] = vd_stroke_default();
            canvas->strokes[count].width = s->width;
            canvas->strokes[count].join = VD_JOIN_ROUND;
            canvas->strokes[count].cap = VD_CAP_ROUND;
            memcpy(canvas->strokes[count].color, s->color, sizeof s->color);
            layer->stroke = &canvas->strokes[count];
        }
        count++;
    }
    return vd_coverage_draw_frame(canvas->coverage, NULL, NULL, canvas->layers, count, frame);
}

/* ---- letters of a font ------------------------------------------------------------------------
 */

/* Capitals' height by the em, of the fonts that are found. */
static const double capitals = 0.73;

/* Outlines a text; false where there is no font, or not for this. */
static bool outline(vd_canvas *canvas, double size, const char *text, vd_outline *out) {
    if (!canvas->font_sought) {
        canvas->font_sought = true;
        if (vd_text_module_open("write on the window", &canvas->module).code == VD_OK &&
            canvas->module.find(canvas->context, NULL, &canvas->font).code != VD_OK) {
            canvas->font = NULL;
        }
    }
    return canvas->font != NULL &&
           canvas->module.outline(canvas->font, text, size / capitals, out).code == VD_OK;
}

/* Adds an outline as one filled shape. */
static void add_outline(vd_canvas *canvas, double x, double y, vd_rgba8 color,
                        const vd_outline *text) {
    shape *made = begin(canvas, color);
    const vd_path *path = &text->path;
    size_t point = 0;
    for (size_t i = 0; i < path->verb_count; i++) {
        static const int points_of[] = {1, 1, 2, 3, 0};
        const int count = points_of[path->verbs[i]];
        for (int k = 0; k < count; k++, point++) {
            add_corner(canvas, x + path->points[point][0], y + path->points[point][1]);
        }
        add_verb(canvas, (vd_path_verb)path->verbs[i]);
    }
    end(canvas, made);
}

/* ---- letters ----------------------------------------------------------------------------------
 */

static const char *const letters[26] = {
    "062046 1434",
    "06003041423303 3344453606",
    "4130100105163645",
    "06003041453606",
    "40000646 0333",
    "400006 0333",
    "41301001051636454323",
    "0006 4046 0343",
    "1030 2026 1636",
    "4045361605",
    "0006 4003 1346",
    "000646",
    "0600234046",
    "06004640",
    "103041453616050110",
    "06003041423303",
    "103041453616050110 3446",
    "06003041423303 2346",
    "413010010213334445361605",
    "0040 2026",
    "000516364540",
    "002640",
    "0016233640",
    "0046 4006",
    "002340 2326",
    "00400646",
};

static const char *const digits[10] = {
    "103041453616050110 1531",     "112026 1636", "01103041420646",
    "01103041423313 334445361605", "36300444",    "40000312324345361605",
    "413010010516364544331304",    "004016",      "103041423313020110 1304051636454433",
    "051636454130100102133342",
};

static const struct {
    const char *character; /* UTF-8 */
    const char *strokes;
} signs[] = {
    {".", "2626"},
    {",", "2617"},
    {":", "2222 2626"},
    {";", "2222 2617"},
    {"-", "1333"},
    {"+", "0343 2125"},
    {"/", "0640"},
    {"\\", "0046"},
    {"(", "30212536"},
    {")", "10212516"},
    {"[", "30101636"},
    {"]", "10303616"},
    {"%", "4006 0010110100 3545463635"},
    {"=", "0242 0444"},
    {"_", "0646"},
    {"'", "2021"},
    {"\"", "1011 3031"},
    {"!", "2024 2626"},
    {"?", "01103041422324 2626"},
    {"*", "2125 1234 3214"},
    {"#", "1016 3036 0242 0444"},
    {"<", "410345"},
    {">", "014305"},
    {"|", "2026"},
    {"&", "46121120310405162644"},
    {"`", "1021"},
    {"°", "2031221120"},
    {"×", "1135 3115"},
    {"–", "1333"},
    {"…", "0606 2626 4646"},
    {"↑", "2026 022042"},
    {"↓", "2026 042644"},
    {"←", "0343 210325"},
    {"→", "0343 214325"},
};

/* Bytes of the UTF-8 character at `at`, at least 1 and no more than there are. */
static int character_bytes(const char *at) {
    int bytes = 1;
    while (((unsigned char)at[bytes] & 0xC0) == 0x80) {
        bytes++;
    }
    return bytes;
}

/* The strokes of a character, and whether it is a small letter. */
static const char *strokes_of(const char *at, int bytes, bool *small) {
    *small = bytes == 1 && at[0] >= 'a' && at[0] <= 'z';
    if (*small) {
        return letters[at[0] - 'a'];
    }
    if (bytes == 1 && at[0] >= 'A' && at[0] <= 'Z') {
        return letters[at[0] - 'A'];
    }
    if (bytes == 1 && at[0] >= '0' && at[0] <= '9') {
        return digits[at[0] - '0'];
    }
    if (bytes == 1 && at[0] == ' ') {
        return "";
    }
    for (size_t i = 0; i < sizeof signs / sizeof signs[0]; i++) {
        if (strncmp(signs[i].character, at, (size_t)bytes) == 0 &&
            signs[i].character[bytes] == '\0') {
            return signs[i].strokes;
        }
    }
    return "2323";
}

static double advance_of(double size, bool small) {
    return size * (small ? 0.8 : 1.0);
}

static double stroked_width(double size, const char *text) {
    double width = 0.0;
    for (const char *at = text; *at != '\0';) {
        const int bytes = character_bytes(at);
        bool small;
        (void)strokes_of(at, bytes, &small);
        width += advance_of(size, small);
        at += bytes;
    }
    return width;
}

static void add_strokes(vd_canvas *canvas, double x, double y, double size, vd_rgba8 color,
                        const char *text) {
    shape *made = begin(canvas, color);
    made->stroked = true;
    made->width = size * 0.13 > 1.1 ? size * 0.13 : 1.1;
    for (const char *at = text; *at != '\0';) {
        const int bytes = character_bytes(at);
        bool small;
        const char *strokes = strokes_of(at, bytes, &small);
        const double unit = size / 6.0 * (small ? 0.78 : 1.0);
        vd_path_verb verb = VD_PATH_MOVE;
        while (*strokes != '\0') {
            if (*strokes == ' ') {
                verb = VD_PATH_MOVE;
                strokes++;
                continue;
            }
            add_point(canvas, verb, x + unit * (strokes[0] - '0'), y + unit * (strokes[1] - '6'));
            verb = VD_PATH_LINE;
            strokes += 2;
        }
        x += advance_of(size, small);
        at += bytes;
    }
    end(canvas, made);
}

/* ---- text --------------------------------------------------------------------------------------
 */

double vd_window_text_width(vd_canvas *canvas, double size, const char *text) {
    vd_outline line;
    if (!outline(canvas, size, text, &line)) {
        return stroked_width(size, text);
    }
    const double width = line.advance;
    vd_outline_finish(&line);
    return width;
}

void vd_window_text(vd_canvas *canvas, double x, double y, double size, vd_rgba8 color,
                    const char *text) {
    vd_outline line;
    if (!outline(canvas, size, text, &line)) {
        add_strokes(canvas, x, y, size, color, text);
        return;
    }
    add_outline(canvas, x, y, color, &line);
    vd_outline_finish(&line);
}
