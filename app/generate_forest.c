/* generate_forest.c: `veduta generate forest`: trees on a terrain, as the files of a world. */
#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "generator.h"
#include "random.h"
#include "run.h"
#include "scene.h"
#include "tree.h"

enum {
    FOREST_OUTPUT,
    FOREST_COUNT_OF,
    FOREST_SEED,
    FOREST_CENTER,
    FOREST_RADIUS,
    FOREST_TREE_LINE,
    FOREST_CELL_SIZE,
    FOREST_THREADS,
    FOREST_HELP,
    FOREST_COUNT
};

static const vd_option table[FOREST_COUNT] = {
    [FOREST_OUTPUT] = {.key = "output",
                       .group = "Options",
                       .type = VD_OPTION_FILE,
                       .letter = 'o',
                       .argument = "DIR",
                       .fallback = "forest",
                       .help = "the folder for forest.json, tree-*.obj and tree.mtl; it is made "
                               "where there is none"},
    [FOREST_COUNT_OF] = {.key = "count",
                         .group = "Options",
                         .type = VD_OPTION_INTEGER,
                         .letter = 'n',
                         .argument = "N",
                         .min = 1,
                         .max = 1000000,
                         .unit = "trees",
                         .fallback = "1000",
                         .help = "how many"},
    [FOREST_SEED] = {.key = "seed",
                     .group = "Options",
                     .type = VD_OPTION_INTEGER,
                     .argument = "N",
                     .max = 9007199254740992.0,
                     .fallback = "1",
                     .help = "another number gives another forest; the same one the same bytes"},
    [FOREST_CENTER] = {.key = "center",
                       .group = "Options",
                       .type = VD_OPTION_TEXT,
                       .argument = "X,Y",
                       .unit = "world metres",
                       .help = "the middle of the forest; without it, the map's"},
    [FOREST_RADIUS] = {.key = "radius",
                       .group = "Options",
                       .type = VD_OPTION_DISTANCE,
                       .argument = "M",
                       .max = 1e8,
                       .fallback = "0",
                       .help = "no tree is farther from the middle; 0: all over the map. 1,000 "
                               "trees within 300 m are a forest"},
    [FOREST_TREE_LINE] = {.key = "tree-line",
                          .group = "Options",
                          .type = VD_OPTION_DISTANCE,
                          .argument = "M",
                          .min = -20000,
                          .max = 100000,
                          .fallback = "2000",
                          .help = "height above which no tree grows"},
    [FOREST_CELL_SIZE] = {.key = "cell-size",
                          .group = "Options",
                          .type = VD_OPTION_DISTANCE,
                          .argument = "M",
                          .min = 1e-6,
                          .max = 1e8,
                          .help = "sample spacing of HEIGHTS without georeference"},
    [FOREST_THREADS] = {.key = "threads",
                        .group = "Options",
                        .type = VD_OPTION_INTEGER,
                        .letter = 't',
                        .argument = "N",
                        .max = 1024,
                        .unit = "threads",
                        .fallback = "0",
                        .help = "how many work at once; 0: one per processor"},
    [FOREST_HELP] = {.key = "help",
                     .group = "Options",
                     .type = VD_OPTION_SWITCH,
                     .letter = 'h',
                     .help = "this page"},
};

static void print_help(void) {
    fputs("usage: veduta generate forest HEIGHTS... [OPTIONS]\n\n"
          "Plants trees on elevation data and writes a world: DIR/forest.json, and meshes of\n"
          "conifers, larches, broadleaves and birches of some 500 triangles beside it. Trees\n"
          "stand in groves, apart from each other, fewer where it is steep (none above 45\n"
          "degrees) and near the tree line; conifers grow higher up than broadleaves.\n",
          stdout);
    vd_options_print_help(table, FOREST_COUNT, stdout);
    fputs("\nforest.json\n"
          "  {\"veduta_world\": 1,\n"
          "   \"terrain\": {\"heights\": [\"path from DIR\"]},\n"
          "   \"objects\": [{\"mesh\": \"tree-conifer.obj\",\n"
          "                \"instances\": [[x, y, heading in degrees, scale], ...]}, ...]}\n"
          "  x and y are world metres (east, north) as `veduta render` counts them; a tree stands\n"
          "  on the ground there. With --cell-size the terrain also has \"cell_size\": metres.\n"
          "\nexamples\n"
          "  veduta generate forest dem.tif -o woods\n"
          "  veduta generate forest dem.tif -o grove --center 0,0 --radius 300 --seed 7\n",
          stdout);
}

/* ---- where trees grow ------------------------------------------------------------------------ */

typedef struct placed_tree {
    double x, y, heading, scale;
    vd_tree_kind kind;
} placed_tree;

typedef struct forest {
    const vd_heightfield *map;
    uint64_t random;
    double x0, y0, x1, y1;  /* where trees may stand */
    double cx, cy, radius;  /* and within this; radius 0: all */
    double tree_line, cell; /* metres */
    double grove;           /* metres across */
    uint64_t salt;          /* of the groves */
    placed_tree *trees;     /* [wanted] */
    int wanted, count;
    /* A grid of squares whose side is the first distance between trees: which trees stand there. */
    double square;
    int columns, rows;
    int *first, *next; /* −1: none */
} forest;

static double smooth_step(double from, double to, double x) {
    double t = (x - from) / (to - from);
    t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
    return t * t * (3.0 - 2.0 * t);
}

static double lattice(const forest *f, double i, double j) {
    uint64_t state = f->salt + (uint64_t)(int64_t)i * 0x9E3779B97F4A7C15u +
                     (uint64_t)(int64_t)j * 0xC2B2AE3D27D4EB4Fu;
    (void)vd_uniform(&state);
    return vd_uniform(&state);
}

/* Smooth noise in 0 … 1 whose hills are groves. */
static double noise_at(const forest *f, double x, double y) {
    const double u = x / f->grove, v = y / f->grove, i = floor(u), j = floor(v);
    const double s = smooth_step(0, 1, u - i), t = smooth_step(0, 1, v - j);
    const double low = lattice(f, i, j) + s * (lattice(f, i + 1, j) - lattice(f, i, j));
    const double high =
        lattice(f, i, j + 1) + s * (lattice(f, i + 1, j + 1) - lattice(f, i, j + 1));
    return low + t * (high - low);
}

/* How readily a tree grows at a place, 0 … 1. */
static double density_at(const forest *f, double x, double y, double *height) {
    const double h = vd_heightfield_height_at(f->map, x, y), d = 0.5 * f->cell;
    *height = h;
    if (!(h > -INFINITY) || !(h < f->tree_line)) {
        return 0.0;
    }
    const double rise_x =
        vd_heightfield_height_at(f->map, x + d, y) - vd_heightfield_height_at(f->map, x - d, y);
    const double rise_y =
        vd_heightfield_height_at(f->map, x, y + d) - vd_heightfield_height_at(f->map, x, y - d);
    const double slope = sqrt(rise_x * rise_x + rise_y * rise_y) / f->cell;
    if (!isfinite(slope) || (h <= 0.0 && slope == 0.0)) {
        return 0.0; /* at the map's edge; level ground at sea level is sea */
    }
    const double fade = 0.15 * (f->tree_line > 1000.0 ? f->tree_line : 1000.0);
    const double room = smooth_step(0.0, fade, f->tree_line - h);
    const double steep = 1.0 - smooth_step(0.466, 1.0, slope); /* 25° … 45° */
    return room * steep * (0.08 + 0.92 * smooth_step(0.4, 0.6, noise_at(f, x, y)));
}

/* Whether another tree stands nearer than `apart`, which is at most a square's side. */
static bool is_crowded(const forest *f, double x, double y, double apart) {
    const int column = (int)((x - f->x0) / f->square), row = (int)((y - f->y0) / f->square);
    for (int r = row - 1; r <= row + 1; r++) {
        for (int c = column - 1; c <= column + 1; c++) {
            if (c < 0 || r < 0 || c >= f->columns || r >= f->rows) {
                continue;
            }
            for (int i = f->first[r * f->columns + c]; i >= 0; i = f->next[i]) {
                const double dx = f->trees[i].x - x, dy = f->trees[i].y - y;
                if (dx * dx + dy * dy < apart * apart) {
                    return true;
                }
            }
        }
    }
    return false;
}

static void plant(forest *f, double x, double y, double height) {
    const double low =
        1.0 - smooth_step(0.3, 0.7, height / (f->tree_line > 1.0 ? f->tree_line : 1));
    const bool leafy = vd_uniform(&f->random) < 0.1 + 0.75 * low;
    const bool rare = vd_uniform(&f->random) < 0.3;
    const double stunted = 0.45 + 0.55 * smooth_step(0.0, 400.0, f->tree_line - height);
    placed_tree *t = &f->trees[f->count];
    /* As they are written, so that what is tested is what is read. */
    t->x = floor(x * 100.0 + 0.5) / 100.0;
    t->y = floor(y * 100.0 + 0.5) / 100.0;
    t->heading = floor(vd_uniform(&f->random) * 3600.0) / 10.0;
    t->scale = floor(stunted * (0.65 + 0.6 * vd_uniform(&f->random)) * 1000.0 + 0.5) / 1000.0;
    t->kind = leafy ? (rare ? VD_TREE_BIRCH : VD_TREE_BROADLEAF)
                    : (rare ? VD_TREE_LARCH : VD_TREE_CONIFER);
    const int column = (int)((x - f->x0) / f->square), row = (int)((y - f->y0) / f->square);
    int *square = &f->first[row * f->columns + column];
    f->next[f->count] = *square;
    *square = f->count++;
}

/* Throws darts, as many as ever land: each stands when there is room, by chance as dense as trees
 * grow there. When few find room, trees may stand closer. */
static void throw_darts(forest *f) {
    double apart = f->square;
    const long round = 16L * f->wanted;
    for (int rounds = 0; rounds < 24 && f->count < f->wanted; rounds++, apart *= 0.8) {
        for (long i = 0; i < round && f->count < f->wanted; i++) {
            const double x = f->x0 + (f->x1 - f->x0) * vd_uniform(&f->random);
            const double y = f->y0 + (f->y1 - f->y0) * vd_uniform(&f->random);
            const double chance = vd_uniform(&f->random), dx = x - f->cx, dy = y - f->cy;
            double height;
            if ((f->radius > 0.0 && dx * dx + dy * dy > f->radius * f->radius) ||
                is_crowded(f, x, y, apart) || !(chance < density_at(f, x, y, &height))) {
                continue;
            }
            plant(f, x, y, height);
        }
        if (f->count == 0 && rounds == 6) {
            return;
        }
    }
}

static vd_status make_forest(forest *f) {
    vd_vec3 min, max;
    vd_heightfield_bounds(f->map, &min, &max);
    f->x0 = min.x, f->y0 = min.y, f->x1 = max.x, f->y1 = max.y;
    if (f->radius > 0.0) {
        f->x0 = f->cx - f->radius > min.x ? f->cx - f->radius : min.x;
        f->y0 = f->cy - f->radius > min.y ? f->cy - f->radius : min.y;
        f->x1 = f->cx + f->radius < max.x ? f->cx + f->radius : max.x;
        f->y1 = f->cy + f->radius < max.y ? f->cy + f->radius : max.y;
    }
    const double width = f->x1 - f->x0, height = f->y1 - f->y0;
    const double *m = f->map->world_from_sample;
    f->cell = sqrt(fabs(m[1] * m[5] - m[2] * m[4]));
    if (!(width > 0.0 && height > 0.0)) {
        return vd_failure(
            VD_ERROR_ARGUMENT,
            "--center: %.10g, %.10g with --radius %.10g lies beside the map, which is "
            "x %.10g ... %.10g, y %.10g ... %.10g; give a place on it",
            f->cx, f->cy, f->radius, min.x, max.x, min.y, max.y);
    }
    f->square = 0.75 * sqrt(width * height / f->wanted);
    const double longest = width > height ? width : height;
    f->square = f->square < longest / 2000.0 ? longest / 2000.0 : f->square;
    f->grove = longest / 9.0;
    f->columns = (int)(width / f->square) + 1;
    f->rows = (int)(height / f->square) + 1;
    const size_t squares = (size_t)f->columns * (size_t)f->rows;
    f->trees = malloc((size_t)f->wanted * sizeof *f->trees);
    f->next = malloc((size_t)f->wanted * sizeof *f->next);
    f->first = malloc(squares * sizeof *f->first);
    if (f->trees == NULL || f->next == NULL || f->first == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory for %d trees; ask for fewer with --count",
                          f->wanted);
    }
    memset(f->first, 0xFF, squares * sizeof *f->first);
    throw_darts(f);
    if (f->count < f->wanted) {
        return vd_failure(VD_ERROR_EMPTY,
                          "only %d of %d trees find a place: the ground is above the tree line of "
                          "%.10g m, steeper than 45 degrees or missing; raise --tree-line, or give "
                          "another --center or --radius",
                          f->count, f->wanted, f->tree_line);
    }
    return vd_success();
}

/* ---- files ----------------------------------------------------------------------------------- */

static vd_status out_of_memory(void) {
    return vd_failure(VD_ERROR_MEMORY, "out of memory while writing the forest; ask for fewer "
                                       "trees with --count");
}

static vd_status make_folder(const char *path) {
    struct stat info;
    if (mkdir(path, 0777) != 0 && errno != EEXIST) {
        return vd_failure(VD_ERROR_IO, "--output: cannot make the folder %.200s: %s", path,
                          strerror(errno));
    }
    if (stat(path, &info) != 0 || !S_ISDIR(info.st_mode)) {
        return vd_failure(VD_ERROR_IO, "--output: %.200s is not a folder; give another name", path);
    }
    return vd_success();
}

/* Writes a text to a file in a folder. */
static vd_status write_file(const char *folder, const char *name, const char *text) {
    char path[PATH_MAX];
    if (snprintf(path, sizeof path, "%s/%s", folder, name) >= (int)sizeof path) {
        return vd_failure(VD_ERROR_IO, "--output: the path %.80s... is too long", folder);
    }
    return vd_write_text(path, text);
}

static vd_status write_trees(const char *folder, uint64_t seed) {
    vd_status status = write_file(folder, "tree.mtl", vd_tree_mtl());
    for (int kind = 0; status.code == VD_OK && kind < VD_TREE_KIND_COUNT; kind++) {
        char name[64];
        snprintf(name, sizeof name, "tree-%s.obj", vd_tree_name((vd_tree_kind)kind));
        char *text = vd_tree_obj((vd_tree_kind)kind, seed);
        status = text != NULL ? write_file(folder, name, text) : out_of_memory();
        free(text);
    }
    return status;
}

/* The way from a folder to a file, both existing; absolute where they cannot be resolved. */
static bool relative_path(const char *folder, const char *file, char *out, size_t out_bytes) {
    char from[PATH_MAX], to[PATH_MAX];
    if (realpath(folder, from) == NULL || realpath(file, to) == NULL) {
        return snprintf(out, out_bytes, "%s", file) < (int)out_bytes;
    }
    size_t same = 0, slash = 0; /* the last '/' up to which both agree */
    while (from[same] != '\0' && from[same] == to[same]) {
        slash = from[same] == '/' ? same : slash;
        same++;
    }
    if (from[same] == '\0' && to[same] == '/') {
        slash = same;
    }
    size_t used = 0;
    out[0] = '\0';
    for (const char *at = from + slash; *at != '\0'; at++) {
        /* A folder to leave: a name behind the common part. */
        if (*at == '/' && at[1] != '\0') {
            used += (size_t)snprintf(out + used, used < out_bytes ? out_bytes - used : 0, "../");
            if (used >= out_bytes) {
                return false;
            }
        }
    }
    return snprintf(out + used, out_bytes - used, "%s", to + slash + 1) < (int)(out_bytes - used);
}

static void write_instances(FILE *out, const forest *f, vd_tree_kind kind, bool *some) {
    bool begun = false;
    for (int i = 0; i < f->count; i++) {
        const placed_tree *t = &f->trees[i];
        if (t->kind != kind) {
            continue;
        }
        if (!begun) {
            fprintf(out, "%s\n  {\"mesh\": \"tree-%s.obj\", \"instances\": [", *some ? "," : "",
                    vd_tree_name(kind));
        }
        fprintf(out, "%s\n   [%.2f, %.2f, %.1f, %.3f]", begun ? "," : "", t->x, t->y, t->heading,
                t->scale);
        begun = *some = true;
    }
    fputs(begun ? "]}" : "", out);
}

/* Writes "heights": the paths, as JSON strings. */
static bool write_heights(FILE *out, const char *folder, const vd_options *options) {
    for (int i = 1; i < options->input_count; i++) {
        char path[2 * PATH_MAX];
        if (!relative_path(folder, options->inputs[i], path, sizeof path)) {
            return false;
        }
        json_t *string = json_string(path);
        char *text = string != NULL ? json_dumps(string, JSON_ENCODE_ANY) : NULL;
        json_decref(string);
        if (text == NULL) {
            return false; /* also a path that is not UTF-8 */
        }
        fprintf(out, "%s%s", i > 1 ? ", " : "", text);
        free(text);
    }
    return true;
}

static vd_status write_world(const forest *f, const char *folder, const vd_options *options) {
    char *text = NULL;
    size_t bytes = 0;
    FILE *out = open_memstream(&text, &bytes);
    if (out == NULL) {
        return out_of_memory();
    }
    fputs("{\"veduta_world\": 1,\n \"terrain\": {\"heights\": [", out);
    const bool named = write_heights(out, folder, options);
    fputs("]", out);
    if (vd_options_given(options, FOREST_CELL_SIZE)) {
        char number[32];
        vd_write_number(options->values[FOREST_CELL_SIZE].number, number);
        fprintf(out, ", \"cell_size\": %s", number);
    }
    fputs("},\n \"objects\": [", out);
    bool some = false;
    for (int kind = 0; kind < VD_TREE_KIND_COUNT; kind++) {
        write_instances(out, f, (vd_tree_kind)kind, &some);
    }
    fputs("]}\n", out);
    const bool failed = ferror(out) != 0;
    vd_status status = vd_success();
    if (fclose(out) != 0 || failed) {
        status = out_of_memory();
    } else if (!named) {
        status = vd_failure(VD_ERROR_ARGUMENT,
                            "the path of the heights is too long or not UTF-8, and cannot stand in "
                            "a world file; rename it");
    } else {
        status = write_file(folder, "forest.json", text);
    }
    free(text);
    return status;
}

/* ---- the command ----------------------------------------------------------------------------- */

static vd_status read_center(const vd_options *options, const vd_heightfield *map, forest *f) {
    vd_vec3 min, max;
    vd_heightfield_bounds(map, &min, &max);
    double place[2] = {0.5 * (min.x + max.x), 0.5 * (min.y + max.y)};
    if (vd_options_given(options, FOREST_CENTER) &&
        vd_read_numbers(options->values[FOREST_CENTER].text, place, 2) != 2) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--center: %.60s is no place; give x and y in world metres, such as "
                          "--center 1200,-300",
                          options->values[FOREST_CENTER].text);
    }
    f->cx = place[0];
    f->cy = place[1];
    return vd_success();
}

static vd_status generate(const vd_options *options, vd_context *context) {
    const vd_option_value *v = options->values;
    vd_scene_def def = {.inputs = (const char *const *)options->inputs + 1,
                        .input_count = options->input_count - 1,
                        .dem = vd_dem_def_default()};
    def.has_cell_size = vd_options_given(options, FOREST_CELL_SIZE);
    def.dem.cell_size_m = v[FOREST_CELL_SIZE].number;
    vd_scene scene = {0};
    vd_status status = vd_scene_load(context, &def, &scene);
    if (status.code != VD_OK) {
        return status;
    }
    forest f = {.map = scene.terrain,
                .radius = v[FOREST_RADIUS].number,
                .tree_line = v[FOREST_TREE_LINE].number,
                .wanted = (int)v[FOREST_COUNT_OF].number};
    f.random = f.salt = (uint64_t)v[FOREST_SEED].number * 0xD1342543DE82EF95u;
    const char *folder = v[FOREST_OUTPUT].text;
    status = read_center(options, scene.terrain, &f);
    if (status.code == VD_OK) {
        status = make_forest(&f);
    }
    if (status.code == VD_OK) {
        status = make_folder(folder);
    }
    if (status.code == VD_OK) {
        status = write_trees(folder, (uint64_t)v[FOREST_SEED].number);
    }
    if (status.code == VD_OK) {
        status = write_world(&f, folder, options);
    }
    free(f.trees);
    free(f.next);
    free(f.first);
    vd_scene_finish(&scene);
    return status;
}

static vd_status check(const vd_options *options) {
    return options->input_count >= 2
               ? vd_success()
               : vd_failure(VD_ERROR_ARGUMENT, "say where the trees are to stand: `veduta generate "
                                               "forest HEIGHTS -o DIR`");
}

const vd_generator vd_generate_forest = {.table = table,
                                         .count = FOREST_COUNT,
                                         .threads = FOREST_THREADS,
                                         .help = FOREST_HELP,
                                         .print_help = print_help,
                                         .check = check,
                                         .generate = generate};
