/* bench_cases.c: the table of what `veduta bench` can measure. */
#include "bench.h"

#include <stddef.h>

/* Classic methods measured beside `reference`. */
enum {
    COLUMNS = 1 << VD_CLASSIC_COLUMNS,
    MARCH = 1 << VD_CLASSIC_MARCH,
    ALL = (1 << VD_CLASSIC_METHOD_COUNT) - 2
};

/* The published OpenMP/CUDA report (Chou, Liu), table of its results: the classic scene at 700×512,
 * without saying from which camera. The original's JavaScript at its own schedule, under node. */
static const bench_published report[] = {{"serial", "Core i7-9700, one thread", 2.99},
                                         {"OpenMP", "Core i7-9700, 8 threads", 7.03},
                                         {"CUDA", "GeForce RTX 2080, streaming", 82.19},
                                         {"CUDA", "Tesla V100, streaming", 214.29},
                                         {NULL, NULL, 0}};
static const bench_published original[] = {{"JavaScript", "original loops, node", 1e3 / 2.93},
                                           {NULL, NULL, 0}};

static const bench_camera valley = {21000, -10100, 1250, 160, 12, 45};
static const bench_camera summit = {23775, -17700, 5000, 40, -12, 50};
static const bench_camera glacier = {21000, -10100, 1500, 160, -6, 50};
static const bench_camera down = {22780, -14970, 9000, 160, -60, 45};

/* The thesis' values (listing A.4), as far as a picture or a map goes. */
static const bench_sweep distance = {BENCH_DISTANCE,
                                     "Time against the distance d: 10×10 pixels, growth 0.005",
                                     "distance, samples",
                                     false,
                                     7,
                                     {10, 100, 1e3, 1e4, 1e5, 5e5, 1e6}};
static const bench_sweep width = {BENCH_WIDTH,
                                  "Time against the width m: 10 rows, distance 10, growth 0.005",
                                  "width, pixels",
                                  false,
                                  6,
                                  {10, 100, 1e3, 1e4, 3e4, VD_MAX_SIDE}};
static const bench_sweep height = {BENCH_HEIGHT,
                                   "Time against the height l: 10 columns, distance 10, "
                                   "growth 0.005",
                                   "height, pixels",
                                   false,
                                   6,
                                   {10, 100, 1e3, 1e4, 3e4, VD_MAX_SIDE}};
static const bench_sweep map = {BENCH_MAP,
                                "Time against the map's side: the published scene, 700×512",
                                "side of the map, samples",
                                false,
                                7,
                                {256, 512, 1024, 2048, 4096, 8192, 16384}};
static const bench_sweep shadow_rows = {BENCH_SHADOW_ROWS,
                                        "Shadow counts against the rows q: 128 columns, 32 steps",
                                        "rows",
                                        false,
                                        7,
                                        {10, 100, 1e3, 2e3, 4e3, 8e3, 16e3}};
static const bench_sweep shadow_steps = {BENCH_SHADOW_STEPS,
                                         "Shadow counts against the steps d_c: map of 128×128",
                                         "steps",
                                         false,
                                         6,
                                         {1, 10, 32, 100, 180, 255}};
static const bench_sweep shadow_sun = {BENCH_SHADOW_SUN,
                                       "Shadow counts against the sun's altitude: map of 1024², "
                                       "worst of 8 azimuths",
                                       "altitude of the sun, degrees",
                                       true,
                                       7,
                                       {0, 1, 5, 10, 20, 45, 80}};

static const bench_sweep message_bytes = {BENCH_MESSAGE_BYTES,
                                          "Messages over loopback (Lawlor 2004, figure B.1)",
                                          "bytes of a message",
                                          false,
                                          8,
                                          {1, 10, 100, 1e3, 1e4, 1e5, 3e5, 1 << 20}};

static const bench_sweep sort_length = {BENCH_SORT_LENGTH,
                                        "Sorting 4 M particles in lists (Lawlor 2004, figure 6.14)",
                                        "particles of a list",
                                        false,
                                        7,
                                        {64, 256, 1024, 4096, 16384, 262144, 4194304}};

static const bench_sweep quad_side = {BENCH_QUAD_SIDE,
                                      "Quads of 1 to 1000 pixels a side (Lawlor 2004, figure 2.1)",
                                      "side, pixels",
                                      false,
                                      8,
                                      {1, 3, 10, 30, 100, 200, 400, 1000}};

/* Lawlor 2004, table 5.7: a tree of 128 × 128, libpng 1.0.12 and JPEG 6b on a PC of its day. */
static const bench_published lawlor_codecs[] = {
    {"PNG encode", "128x128, 11947 bytes", 1e3 / 11.535},
    {"PNG decode", "128x128", 1e3 / 1.708},
    {"JPEG encode", "128x128, 3105 bytes, no alpha", 1e3 / 1.512},
    {"JPEG decode", "128x128", 1e3 / 0.965},
    {"uncompressed encode", "128x128, 65536 bytes", 1e3 / 0.288},
    {"uncompressed decode", "128x128", 1e3 / 0.121},
    {"run-length encode", "128x128, 20636 bytes", 1e3 / 0.053},
    {"run-length decode", "128x128", 1e3 / 0.061},
    {NULL, NULL, 0}};
static const bench_sweep codec_side = {BENCH_CODEC_SIDE,
                                       "Packing and unpacking a picture (Lawlor 2004, figure 5.4)",
                                       "side, pixels",
                                       false,
                                       8,
                                       {4, 16, 32, 64, 128, 256, 512, 1024}};

/* Lawlor 2004, table 5.5: 50 M particles, 800 × 600. */
static const bench_published lawlor_grain[] = {
    {"impostors, 30 K", "error 0.140, overdraw 12.1", 18.4},
    {"impostors, 100 K", "error 0.126, overdraw 10.2", 64.0},
    {"impostors, 300 K", "error 0.189, overdraw 9.5", 98.0},
    {"impostors, 1 M", "error 0.222, overdraw 8.9", 130.8},
    {NULL, NULL, 0}};
static const bench_sweep grain = {BENCH_GRAIN,
                                  "Frames against the particles of an impostor (Lawlor 2004, table "
                                  "5.5)",
                                  "most particles of an object",
                                  false,
                                  4,
                                  {30e3, 100e3, 300e3, 1e6}};

/* A published model by every raster method at one size. */
#define RASTER(model, size, help)                                                                  \
    { model "-" #size, help, bench_raster, .width = size, .rows = size }
#define RASTER_SIZES(model, help)                                                                  \
    RASTER(model, 1024, help), RASTER(model, 2048, help), RASTER(model, 4096, help),               \
        RASTER(model, 8192, help)

const bench_case *bench_case_at(int index) {
    static const bench_case cases[] = {
        {"classic-default", "the published Voxel Space scene, all methods", bench_classic, 700, 512,
         78, .methods = ALL, .published = report, .target_fps = 3000},
        {"classic-high", "the same from above everything", bench_classic, 700, 512, 200,
         .methods = COLUMNS | MARCH, .target_fps = 800},
        {"classic-default-1080p", "the published scene, 1920x1080", bench_classic, 1920, 1080, 78,
         .methods = MARCH, .target_fps = 900},
        {"classic-high-1080p", "from above everything, 1920x1080", bench_classic, 1920, 1080, 200,
         .methods = MARCH, .target_fps = 230},
        {"classic-default-1080p-bilinear", "the published scene between samples, 1920x1080",
         bench_classic, 1920, 1080, 78, .methods = MARCH, .bilinear = true, .target_fps = 300},
        {"classic-high-1080p-bilinear", "from above everything, between samples, 1920x1080",
         bench_classic, 1920, 1080, 200, .methods = MARCH, .bilinear = true, .target_fps = 100},
        {"classic-default-2160p-bilinear", "the published scene between samples, 3840x2160",
         bench_classic, 3840, 2160, 78, .methods = MARCH, .bilinear = true, .target_fps = 120},
        {"classic-high-2160p-bilinear", "from above everything, between samples, 3840x2160",
         bench_classic, 3840, 2160, 200, .methods = MARCH, .bilinear = true, .target_fps = 45},
        {"classic-growth", "the schedule of 1992: distance 800, growth 0.005", bench_classic, 700,
         512, 78, .growth = 0.005, .methods = ALL, .published = original, .target_fps = 4000},
        {"classic-16384", "the published scene over a map of 16384x16384", bench_classic, 700, 512,
         78, .methods = MARCH, .map_side = 16384},
        {"lens", "a lens view with light and shadows, one sample a pixel", bench_lens, .width = 700,
         .rows = 512},
        {"lens-16384", "the same over a map of 16384x16384", bench_lens, 700, 512,
         .map_side = 16384},
        {"lens-valley-1080p", "Mont Blanc from the valley, 1920x1080, everything on", bench_lens,
         1920, 1080, .camera = &valley, .target_fps = 125},
        {"lens-summit-1080p", "from above the summit, 1920x1080, everything on", bench_lens, 1920,
         1080, .camera = &summit, .target_fps = 125},
        {"lens-down-1080p", "60 degrees down on it, 1920x1080, everything on", bench_lens, 1920,
         1080, .camera = &down, .target_fps = 125},
        {"world-forest",
         "Mont Blanc with 1,000 trees of 504 triangles and 50 names, in flight, 1920x1080",
         bench_world, 1920, 1080, .camera = &glacier, .target_fps = 60},
        {"lens-valley-2160p", "from the valley, 3840x2160", bench_lens, 3840, 2160,
         .camera = &valley, .target_fps = 40},
        {"lens-summit-2160p", "from above the summit, 3840x2160", bench_lens, 3840, 2160,
         .camera = &summit, .target_fps = 40},
        {"lens-down-2160p", "60 degrees down, 3840x2160", bench_lens, 3840, 2160, .camera = &down,
         .target_fps = 40},
        {"shadow", "counted shadows by the sun's altitude", bench_sweep_shadow, 1024, 1024,
         .sweep = &shadow_sun, .target_fps = 250},
        {"function", "evaluating formulas; ns a point in the note", .function = bench_formula},
        {"function-endless", "formulas up to the horizon, 1920x1080, everything on", bench_endless,
         .width = 1920, .rows = 1080},
        {"memory", "bytes held against bytes of heights and colours", .function = bench_memory},
        {"false-sharing", "the published loop: columns dealt, padded, tiled", bench_sharing,
         .width = 700, .rows = 512},
        {"counters", "two numbers in one cache line, or a line each", .function = bench_counters},
        {"sweep-distance", "the thesis' d: 10 ... 10^6", bench_sweep_classic, .sweep = &distance},
        {"sweep-width", "the thesis' m: 10 ... 65535", bench_sweep_classic, .sweep = &width},
        {"sweep-height", "the thesis' l: 10 ... 65535", bench_sweep_classic, .sweep = &height},
        {"sweep-map", "side of the map: 256 ... 16384", bench_sweep_classic, .sweep = &map},
        {"sweep-shadow-q", "rows of the map: 10 ... 16000", bench_sweep_shadow,
         .sweep = &shadow_rows},
        {"sweep-shadow-steps", "steps of a shadow's ray: 1 ... 255", bench_sweep_shadow,
         .sweep = &shadow_steps},
        RASTER_SIZES("bunny", "the Stanford bunny, 3,674 triangles"),
        RASTER_SIZES("monkey", "Suzanne, 3,936 triangles"),
        RASTER_SIZES("armadillo", "the Stanford armadillo, 52,000 triangles"),
        RASTER_SIZES("dragon202k", "the Stanford dragon, 202,520 triangles"),
        RASTER_SIZES("dragon871k", "the Stanford dragon, 871,414 triangles"),
        {"raster-levels", "thesis table 1: SIMD levels and threads", bench_raster_levels,
         .width = 1024, .rows = 1024},
        {"raster-triangles", "tables 2, 3: share of the triangles, sizes, architectures",
         bench_raster_triangles, .width = 1024, .rows = 1024},
        {"raster-bins", "table 4: bins and fine tiles of the immediate method", bench_raster_bins,
         .width = 1024, .rows = 1024},
        {"raster-small", "table 5: how large a small triangle is", bench_raster_small,
         .width = 1024, .rows = 1024},
        {"raster-tiles", "table 6: tiles of the methods that sort", bench_raster_tiles,
         .width = 1024, .rows = 1024},
        {"raster-resolve", "three published ways to resolve depth; one thread",
         bench_raster_resolve, .width = 1024, .rows = 1024},
        {"coverage-large", "paths: 100 polygons of 100 corners, half transparent", bench_coverage,
         .width = 1024, .rows = 1024},
        {"coverage-small", "paths: 500,000 quads of 3 pixels a side", bench_coverage, .width = 1024,
         .rows = 1024},
        {"coverage-crossing", "paths: 100,000 pentagrams 8 pixels wide", bench_coverage,
         .width = 1024, .rows = 1024},
        {"coverage-curves", "paths: 20,000 circles of four cubics, 16 pixels wide", bench_coverage,
         .width = 1024, .rows = 1024},
        {"coverage-strokes", "paths: 2,000 lines 2.5 pixels wide, round joins and caps",
         bench_coverage, .width = 1024, .rows = 1024},
        {"quads", "20 layers of 600x600 pixels, 1280x720: plain, in perspective, half transparent",
         bench_quads, .width = 1280, .rows = 720},
        {"quad-sides", "time of a quad against its side, fitted to the published model",
         bench_quad_sides, .width = 1280, .rows = 1200, .sweep = &quad_side},
        {"impostor-decide",
         "100,000 objects decided a frame, the camera moving; us an object in the note",
         bench_impostor_decide, .width = 1280, .rows = 720, .target_fps = 50},
        {"impostor-grain", "particles round which a camera goes, by the most of an object",
         bench_impostor_grain, .width = 1280, .rows = 720, .sweep = &grain,
         .published = lawlor_grain, .target_fps = 60},
        {"impostor-extremes", "world-forest by large, tiny and usual pictures; reuse, bandwidths",
         bench_impostor_extremes, .width = 1280, .rows = 720, .camera = &glacier},
        {"impostor-path", "world-forest in flight, pictures drawn elsewhere, over 10 MB/s",
         bench_impostor_path, .width = 1280, .rows = 720, .camera = &glacier, .target_fps = 60},
        {"impostor-window", "the same flight in time, pictures drawn in the frame and beside it",
         bench_impostor_window, .width = 1280, .rows = 720, .camera = &glacier, .target_fps = 60},
        {"codec-tree", "a tree packed by every codec: encode, decode, bytes, links",
         bench_codec_tree, 128, 128, .sweep = &codec_side, .published = lawlor_codecs},
        {"codec-building", "a building, the same", bench_codec_building, 128, 128,
         .sweep = &codec_side},
        {"codec-particles", "a cloud of particles, the same", bench_codec_particles, 128, 128,
         .sweep = &codec_side},
        {"remote", "a server's world over slower links: frames of the client, errors", bench_remote,
         1280, 720, .camera = &glacier, .target_fps = 60},
        {"remote-cloud", "the same with particles in the air (--particles)", bench_remote_cloud,
         1280, 720, .camera = &glacier},
        {"remote-answer", "from a camera's message to the first picture after it, loopback",
         bench_remote_answer, 1280, 720, .camera = &glacier},
        {"remote-clients", "1, 8, 32 clients of one server: rates and memory", bench_remote_clients,
         640, 360, .camera = &glacier},
        {"remote-messages", "messages of 1 B ... 1 MiB over loopback: rate and throughput",
         bench_remote_messages, .sweep = &message_bytes},
        {"splat-draw", "50 M particles in bricks: blended, added up, nearest", bench_splat,
         .width = 1024, .rows = 1024},
        {"splat-sort", "4 M particles by lists: qsort, merge sort, radix sort", bench_splat_sort,
         .sweep = &sort_length},
        {"bricks", "50 M particles: import, and pictures from the octree", bench_bricks, 1920, 1080,
         .target_fps = 30},
        {"png", "writing a 1920x1080 picture, by zlib level; CPU time", bench_png, .width = 1920,
         .rows = 1080},
        {"startup", "starting the program until it ends, with --version",
         .function = bench_startup},
        {"cold",
         ".hgt of 1201x1201, GeoTIFF of 2048x2048 floats, to a 1080p PNG in a new process; "
         "CPU time",
         bench_cold, 1920, 1080, .target_fps = 4},
    };
    return index >= 0 && index < (int)(sizeof cases / sizeof cases[0]) ? &cases[index] : NULL;
}

const bench_group *bench_group_at(int index) {
    static const bench_group groups[] = {
        {"classic", "classic pictures of the bench's map",
         "classic-default classic-high classic-default-1080p classic-high-1080p "
         "classic-bilinear classic-growth"},
        {"classic-bilinear", "classic pictures with heights and colours between the samples",
         "classic-default-1080p-bilinear classic-high-1080p-bilinear "
         "classic-default-2160p-bilinear classic-high-2160p-bilinear"},
        {"lens-views", "Mont Blanc by a lens, three cameras, two sizes",
         "lens-valley-1080p lens-summit-1080p lens-down-1080p lens-valley-2160p "
         "lens-summit-2160p lens-down-2160p"},
        {"sweeps", "time against one parameter at a time",
         "sweep-distance sweep-width sweep-height sweep-map sweep-shadow-q sweep-shadow-steps"},
        {"raster-cells", "published models by every raster method, beside llvmpipe",
         "bunny-1024 bunny-2048 bunny-4096 bunny-8192 "
         "monkey-1024 monkey-2048 monkey-4096 monkey-8192 "
         "armadillo-1024 armadillo-2048 armadillo-4096 armadillo-8192 "
         "dragon202k-1024 dragon202k-2048 dragon202k-4096 dragon202k-8192 "
         "dragon871k-1024 dragon871k-2048 dragon871k-4096 dragon871k-8192"},
        {"raster-tables", "the tables of the rasterization thesis",
         "raster-levels raster-triangles raster-bins raster-small raster-tiles raster-resolve"},
        {"raster", "everything about triangles", "raster-cells raster-tables"},
        {"coverage", "vector paths with exact edges, beside a plain loop",
         "coverage-large coverage-small coverage-crossing coverage-curves coverage-strokes"},
        {"impostor", "impostors: deciding, grain, extremes, a flight, and quads",
         "impostor-decide impostor-grain impostor-extremes impostor-path impostor-window quads "
         "quad-sides"},
        {"codec", "pictures packed for the wire", "codec-tree codec-building codec-particles"},
        {"served", "everything about serving",
         "remote remote-cloud remote-answer remote-clients remote-messages codec"},
        {"splat", "particles", "splat-draw splat-sort bricks"},
        {"terrain", "everything about terrain",
         "classic lens lens-views shadow function function-endless memory false-sharing counters "
         "classic-16384 "
         "lens-16384 "
         "sweeps cold"},
    };
    return index >= 0 && index < (int)(sizeof groups / sizeof groups[0]) ? &groups[index] : NULL;
}
