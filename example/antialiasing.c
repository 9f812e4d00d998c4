/* antialiasing.c: a tree's outline and two neighbouring polygons in 30 × 30 pixels, sampled 1, 4,
 * 16 and 64 times a pixel (stratified, random), by exact area, and the outline itself: figure 6.2
 * of O. S. Lawlor, Impostors for parallel interactive computer graphics, 2004, drawn again.
 *
 *   antialiasing [OUT.png]
 *
 * Prints the root mean square and the largest error of each against the exact area.
 */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <veduta/veduta.h>

enum { SIDE = 30, ZOOM = 6, PANELS = 6, WAYS = 5, MOST = 400, GAP = 12 };

/* What is drawn: polygons in a square of 0 … 1, each over those before. */
typedef struct outline {
    double corners[MOST][2];
    size_t count;
} outline;

typedef struct subject {
    outline outlines[2];
    int count;
    uint16_t colors[2][4];
} subject;

/* ---- outlines ---------------------------------------------------------------------------------*/

static void add(outline *o, double x, double y) {
    if (o->count < MOST) {
        o->corners[o->count][0] = x;
        o->corners[o->count][1] = y;
        o->count++;
    }
}

/* Up one side of a branch, along its twigs, and down the other. */
static void add_branch(outline *o, double x, double y, double dx, double dy, double width,
                       int depth) {
    static const double turns[3][2] = {{0.62, -0.60}, {0.85, 0.10}, {0.58, 0.62}}; /* cos, sin */
    const double nx = -dy * width, ny = dx * width;
    add(o, x + nx, y + ny);
    for (int i = 2; i >= 0 && depth > 0; i--) {
        const double c = turns[i][0], s = turns[i][1];
        add_branch(o, x + dx, y + dy, 0.85 * (c * dx - s * dy), 0.85 * (s * dx + c * dy), width,
                   depth - 1);
    }
    if (depth == 0) {
        add(o, x + dx, y + dy);
    }
    add(o, x - nx, y - ny);
}

static void make_tree(subject *s) {
    memset(s, 0, sizeof *s);
    s->count = 1;
    s->colors[0][1] = 20000;
    s->colors[0][3] = 65535;
    add_branch(&s->outlines[0], 0.52, 0.98, -0.01, -0.3, 0.09, 4);
}

static void make_neighbours(subject *s) {
    static const double left[5][2] = {
        {0.08, 0.2}, {0.45, 0.07}, {0.62, 0.9}, {0.3, 0.95}, {0.1, 0.6}};
    static const double right[4][2] = {{0.45, 0.07}, {0.95, 0.3}, {0.9, 0.8}, {0.62, 0.9}};
    memset(s, 0, sizeof *s);
    s->count = 2;
    for (int i = 0; i < 5; i++) {
        add(&s->outlines[0], left[i][0], left[i][1]);
    }
    for (int i = 0; i < 4; i++) {
        add(&s->outlines[1], right[i][0], right[i][1]);
    }
    s->colors[0][0] = s->colors[1][2] = 42000;
    s->colors[0][3] = s->colors[1][3] = 65535;
}

/* ---- by samples -------------------------------------------------------------------------------*/

static bool is_inside(const outline *o, double x, double y) {
    int winding = 0;
    for (size_t i = 0; i < o->count; i++) {
        const double *a = o->corners[i], *b = o->corners[i + 1 < o->count ? i + 1 : 0];
        if ((a[1] <= y) != (b[1] <= y) &&
            x >= a[0] + (y - a[1]) * ((b[0] - a[0]) / (b[1] - a[1]))) {
            winding += a[1] <= y ? 1 : -1;
        }
    }
    return winding != 0;
}

static double uniform(uint64_t *state) {
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) * 0x1p-53;
}

/* One random sample in each of k × k parts of every pixel; once for a single sample: its middle. */
static void draw_samples(const subject *s, int k, uint16_t picture[SIDE][SIDE][4]) {
    uint64_t random = 1;
    for (int y = 0; y < SIDE; y++) {
        for (int x = 0; x < SIDE; x++) {
            double sum[4] = {0};
            for (int part = 0; part < k * k; part++) {
                const double u = k == 1 ? 0.5 : uniform(&random);
                const double v = k == 1 ? 0.5 : uniform(&random);
                const double px = (x + (part % k + u) / k) / SIDE;
                const double py = (y + (part / k + v) / k) / SIDE;
                const uint16_t *color = NULL;
                for (int i = 0; i < s->count; i++) {
                    color = is_inside(&s->outlines[i], px, py) ? s->colors[i] : color;
                }
                for (int c = 0; c < 4; c++) {
                    sum[c] += color != NULL ? color[c] : 65535;
                }
            }
            for (int c = 0; c < 4; c++) {
                picture[y][x][c] = (uint16_t)(sum[c] / (k * k) + 0.5);
            }
        }
    }
}

/* ---- by area ----------------------------------------------------------------------------------*/

/* Draws a subject `side` pixels large at (x, y) of a target. */
static vd_status draw_area(vd_coverage *coverage, const subject *s, double x, double y, double side,
                           vd_target *target) {
    vd_layer layers[2];
    for (int i = 0; i < s->count; i++) {
        layers[i] = vd_layer_default();
        layers[i].path.points = s->outlines[i].corners;
        layers[i].path.point_count = s->outlines[i].count;
        layers[i].picture_from_path = (vd_affine){.xx = side, .yy = side, .x0 = x, .y0 = y};
        memcpy(layers[i].fill, s->colors[i], sizeof layers[i].fill);
    }
    return vd_coverage_draw(coverage, NULL, NULL, layers, (size_t)s->count, target);
}

static void get_pixels(const vd_target *target, uint16_t picture[SIDE][SIDE][4]) {
    for (int y = 0; y < SIDE; y++) {
        memcpy(picture[y], target->color + 4 * (size_t)y * target->stride, sizeof picture[y]);
    }
}

/* A pixel becomes a square. */
static void magnify(uint16_t picture[SIDE][SIDE][4], vd_target *to, int x0, int y0) {
    for (int y = 0; y < SIDE * ZOOM; y++) {
        uint16_t *row = to->color + 4 * ((size_t)(y0 + y) * to->stride + (size_t)x0);
        for (int x = 0; x < SIDE * ZOOM; x++) {
            memcpy(row + 4 * x, picture[y / ZOOM][x / ZOOM], 4 * sizeof *row);
        }
    }
}

/* Against the truth: samples of both polygons at once have no seam, so 128 × 128 of them are it. */
static void print_error(const char *name, uint16_t picture[SIDE][SIDE][4],
                        uint16_t truth[SIDE][SIDE][4]) {
    double sum = 0, most = 0;
    for (int i = 0; i < SIDE * SIDE * 3; i++) {
        const double a = picture[i / 3 / SIDE][i / 3 % SIDE][i % 3];
        const double b = truth[i / 3 / SIDE][i / 3 % SIDE][i % 3];
        sum += (a - b) * (a - b);
        most = fabs(a - b) > most ? fabs(a - b) : most;
    }
    printf("  %-12s rms %7.3f  maximum %7.3f (of 255)\n", name, sqrt(sum / (SIDE * SIDE * 3)) / 257,
           most / 257);
}

static vd_status draw_row(vd_coverage *coverage, const subject *s, vd_target *small, int y,
                          vd_target *sheet) {
    static const uint16_t white[4] = {65535, 65535, 65535, 65535};
    static const char *const names[] = {"1 sample", "4 samples", "16 samples", "64 samples",
                                        "area"};
    static uint16_t pictures[WAYS][SIDE][SIDE][4], truth[SIDE][SIDE][4];
    for (int way = 0; way < WAYS - 1; way++) {
        draw_samples(s, 1 << way, pictures[way]);
    }
    draw_samples(s, 128, truth);
    vd_target_clear(small, white);
    vd_status status = draw_area(coverage, s, 0, 0, SIDE, small);
    get_pixels(small, pictures[WAYS - 1]);
    for (int way = 0; way < WAYS; way++) {
        print_error(names[way], pictures[way], truth);
        magnify(pictures[way], sheet, GAP + way * (SIDE * ZOOM + GAP), y);
    }
    if (status.code == VD_OK) {
        status = draw_area(coverage, s, GAP + WAYS * (SIDE * ZOOM + GAP), y, SIDE * ZOOM, sheet);
    }
    return status;
}

static vd_status draw_sheet(vd_coverage *coverage, vd_target *small, vd_target *sheet) {
    static const uint16_t white[4] = {65535, 65535, 65535, 65535};
    static subject tree, neighbours;
    make_tree(&tree);
    make_neighbours(&neighbours);
    vd_target_clear(sheet, white);
    printf("tree\n");
    vd_status status = draw_row(coverage, &tree, small, GAP, sheet);
    printf("two neighbours\n");
    if (status.code == VD_OK) {
        status = draw_row(coverage, &neighbours, small, 2 * GAP + SIDE * ZOOM, sheet);
    }
    return status;
}

int main(int argc, char **argv) {
    const int width = GAP + PANELS * (SIDE * ZOOM + GAP), height = GAP + 2 * (SIDE * ZOOM + GAP);
    vd_context *context = NULL;
    vd_coverage *coverage = NULL;
    vd_target *small = NULL, *sheet = NULL;
    vd_frame *frame = NULL;
    vd_status status = vd_context_create(NULL, &context);
    if (status.code == VD_OK) {
        status = vd_coverage_create(context, &coverage);
    }
    if (status.code == VD_OK) {
        status = vd_target_create(context, SIDE, SIDE, 1, &small);
    }
    if (status.code == VD_OK) {
        status = vd_target_create(context, width, height, 1, &sheet);
    }
    if (status.code == VD_OK) {
        status = vd_frame_create(context, width, height, 0, &frame);
    }
    if (status.code == VD_OK) {
        status = draw_sheet(coverage, small, sheet);
    }
    if (status.code == VD_OK) {
        vd_target_resolve(sheet, frame);
        status = vd_frame_save_png(frame, argc > 1 ? argv[1] : "antialiasing.png", NULL);
    }
    if (status.code != VD_OK) {
        fprintf(stderr, "antialiasing: %s\n", status.message);
    }
    vd_frame_destroy(&frame);
    vd_target_destroy(&sheet);
    vd_target_destroy(&small);
    vd_coverage_destroy(&coverage);
    vd_context_destroy(&context);
    return status.code == VD_OK ? 0 : 1;
}
