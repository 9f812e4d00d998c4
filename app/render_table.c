/* render_table.c: the option table of `veduta render`, and its presets. */
#include <string.h>

#include "render_settings.h"

static bool is_colormap_name(const char *text) {
    vd_colormap map;
    return vd_colormap_find(text, &map);
}

static bool is_none(const char *text) {
    return strcmp(text, "none") == 0;
}

#define PICTURE "Picture"
#define LOOK "Look"
#define CAMERA                                                                                     \
    "Camera: orbit (azimuth, elevation, distance), look-at (eye, target) or geographic (eye, "     \
    "heading, pitch)"
#define DATA "Data: what a file does not say itself"
#define WORLD "World: what stands on the terrain; a world file has more of it (docs/world.md)"
#define IMPOSTORS "Impostors: pictures that stand in for parts of a world (docs/impostors.md)"
#define CLASSIC "Classic: the Voxel Space picture of 1992, all in map samples"
#define MODEL                                                                                      \
    "Model: OBJ, PLY, OFF, STL, glTF and others; Picture, Camera, --sun, --sky and --background "  \
    "apply too"
#define RUN "This run"

const vd_option vd_render_table[OPTION_COUNT] = {
    [OPTION_OUTPUT] = {.key = "output",
                       .group = PICTURE,
                       .type = VD_OPTION_FILE,
                       .letter = 'o',
                       .argument = "FILE.png",
                       .fallback = "veduta.png",
                       .help = "where the picture goes; - is standard output"},
    [OPTION_SIZE] =
        {.key = "size",
         .group = PICTURE,
         .type = VD_OPTION_TEXT,
         .letter = 's',
         .argument = "WxH",
         .unit = "pixels",
         .fallback = "1920x1080",
         .help = "width and height of the picture, each 1 to 65535 (700x512 with --classic)"},
    [OPTION_SAMPLES] = {.key = "samples",
                        .group = PICTURE,
                        .type = VD_OPTION_CHOICE,
                        .argument = "1|4|8",
                        .unit = "per pixel",
                        .fallback = "4",
                        .help = "sample positions: more give smoother edges (1 with --classic)"},
    [OPTION_FILTER] = {.key = "filter",
                       .group = PICTURE,
                       .type = VD_OPTION_CHOICE,
                       .argument = "nearest|bilinear|trilinear|anisotropic",
                       .fallback = "bilinear",
                       .help = "how imagery is read between its pixels; with --classic (nearest "
                               "unless given) heights too; the last two are for the textures of "
                               "models, which are anisotropic unless given"},
    [OPTION_PRESET] =
        {.key = "preset",
         .group = PICTURE,
         .type = VD_OPTION_CHOICE,
         .argument = "fast|default|best",
         .fallback = "default",
         .help = "fast: 1 sample, no shadows; best: 8 samples; what is given beside it wins"},
    [OPTION_METHOD] =
        {.key = "method",
         .group = PICTURE,
         .type = VD_OPTION_TEXT,
         .letter = 'm',
         .argument = "NAME",
         .fallback = "auto",
         .help = "march, or raycast: one ray at a time through every cell, which defines the "
                 "picture; with --classic reference, slices, columns, scan or march; all the same "
                 "bytes; auto: march"},
    [OPTION_THREADS] = {.key = "threads",
                        .group = PICTURE,
                        .type = VD_OPTION_INTEGER,
                        .letter = 't',
                        .argument = "N",
                        .max = 1024,
                        .unit = "threads",
                        .fallback = "0",
                        .help =
                            "how many draw at once; 0: one per processor; the picture is the same"},
    [OPTION_PNG_LEVEL] = {.key = "png-level",
                          .group = PICTURE,
                          .type = VD_OPTION_INTEGER,
                          .argument = "N",
                          .max = 9,
                          .unit = "zlib level",
                          .fallback = "1",
                          .help = "how hard to compress: 0 not at all, 9 smallest and slowest"},
    [OPTION_DEPTH] =
        {.key = "depth",
         .group = PICTURE,
         .type = VD_OPTION_FILE,
         .argument = "FILE",
         .help = "also write distances along the view axis: .exr or .pfm in metres, .png as the "
                 "inverse in 16 bits"},
    [OPTION_IDS] = {.key = "ids",
                    .group = PICTURE,
                    .type = VD_OPTION_FILE,
                    .argument = "FILE.png",
                    .help = "also write which object each pixel shows, 16-bit grey"},

    [OPTION_COLOR] =
        {.key = "color",
         .group = LOOK,
         .type = VD_OPTION_FILE,
         .letter = 'c',
         .argument = "IMAGE",
         .help = "imagery laid over the terrain: placed by its georeference, else stretched"},
    [OPTION_COLORMAP] =
        {.key = "colormap",
         .group = LOOK,
         .type = VD_OPTION_FILE,
         .argument = "NAME|FILE",
         .fallback = "terrain",
         .is_name = is_colormap_name,
         .help = "colours by height: terrain, viridis, grey, …, a GMT .cpt or a gdaldem "
                 "color-relief text; not given, georeferenced data from land to below -500 m, "
                 "which is sea floor, takes topo"},
    [OPTION_SUN] = {.key = "sun",
                    .group = LOOK,
                    .type = VD_OPTION_TEXT,
                    .argument = "AZ,ALT",
                    .unit = "degrees",
                    .fallback = "315,45",
                    .help =
                        "the sun's azimuth, clockwise from north, and altitude above the horizon; "
                        "a model is lit from over the viewer's shoulder unless it is given"},
    [OPTION_SHADOWS] = {.key = "shadows",
                        .group = LOOK,
                        .type = VD_OPTION_FLAG,
                        .argument = "soft|count",
                        .fallback = "on",
                        .help = "whether the terrain throws shadows on itself (--function: only "
                                "with --extent); with --classic (off unless given) counted towards "
                                "--sun: count darkens as published, soft more gently"},
    [OPTION_SHADING] = {.key = "shading",
                        .group = LOOK,
                        .type = VD_OPTION_FLAG,
                        .fallback = "on",
                        .help = "whether sun and sky light the surface; off: plain colours"},
    [OPTION_HAZE] =
        {.key = "haze",
         .group = LOOK,
         .type = VD_OPTION_TEXT,
         .argument = "auto|off|DISTANCE",
         .unit = "metres, or with ending: 20km",
         .fallback = "auto",
         .help = "the distance at which haze leaves 37 % of the contrast; auto: by the scene's "
                 "size"},
    [OPTION_SKY] = {.key = "sky",
                    .group = LOOK,
                    .type = VD_OPTION_TEXT,
                    .argument = "on|off|RRGGBB",
                    .fallback = "on",
                    .help = "the sky: a gradient, none (--background shows), or one colour"},
    [OPTION_BACKGROUND] = {.key = "background",
                           .group = LOOK,
                           .type = VD_OPTION_TEXT,
                           .argument = "RRGGBB|transparent",
                           .help = "what shows where nothing is; given, it turns the sky off; by "
                                   "default transparent, with --classic 9090E0"},
    [OPTION_EXAGGERATE] = {.key = "exaggerate",
                           .group = LOOK,
                           .type = VD_OPTION_REAL,
                           .letter = 'x',
                           .argument = "FACTOR",
                           .min = 0.001,
                           .max = 1000,
                           .fallback = "1",
                           .help = "factor on all heights; 1 is real"},
    [OPTION_CURVATURE] =
        {.key = "curvature",
         .group = LOOK,
         .type = VD_OPTION_FLAG,
         .help = "the Earth's curvature with refraction k = 0.13; by default on "
                 "for georeferenced data up to 1000 km across, unless it is framed from so "
                 "far that the formula fails"},

    [OPTION_AZIMUTH] =
        {.key = "azimuth",
         .group = CAMERA,
         .type = VD_OPTION_REAL,
         .argument = "A",
         .min = -360,
         .max = 360,
         .unit = "degrees clockwise from north",
         .fallback = "0",
         .help = "orbit: the compass direction the camera looks towards; 0 stands in the south "
                 "and looks north (at a model, whose front faces south: -30)"},
    [OPTION_ELEVATION] =
        {.key = "elevation",
         .group = CAMERA,
         .type = VD_OPTION_REAL,
         .argument = "A",
         .min = -90,
         .max = 90,
         .unit = "degrees above the horizon",
         .fallback = "35",
         .help = "orbit: how high the camera stands over its target; not given, 90 where "
                 "a framed relief would not be seen, and 25 with a model"},
    [OPTION_DISTANCE] =
        {.key = "distance",
         .group = CAMERA,
         .type = VD_OPTION_DISTANCE,
         .argument = "D",
         .min = 1e-6,
         .max = 1e12,
         .unit = "metres",
         .help = "orbit: from camera to target; not given, all of it is in the picture"},
    [OPTION_EYE] =
        {.key = "eye",
         .group = CAMERA,
         .type = VD_OPTION_TEXT,
         .argument = "X,Y,Z | LAT,LON,2m | LAT,LON,3000masl",
         .unit = "metres; degrees",
         .help = "where the camera is: world metres, or latitude and longitude with a height above "
                 "ground (m) or above sea level (masl)"},
    [OPTION_TARGET] =
        {.key = "target",
         .group = CAMERA,
         .type = VD_OPTION_TEXT,
         .argument = "X,Y,Z | LAT,LON",
         .unit = "metres; degrees",
         .help = "what is in the middle of the picture; LAT,LON is on the ground, and takes a "
                 "height as --eye does; by default the terrain's middle"},
    [OPTION_HEADING] = {.key = "heading",
                        .group = CAMERA,
                        .type = VD_OPTION_REAL,
                        .argument = "A",
                        .min = -360,
                        .max = 360,
                        .unit = "degrees clockwise from north",
                        .help = "with --eye: the compass direction the camera looks towards"},
    [OPTION_PITCH] = {.key = "pitch",
                      .group = CAMERA,
                      .type = VD_OPTION_REAL,
                      .argument = "A",
                      .min = -90,
                      .max = 90,
                      .unit = "degrees",
                      .help = "with --eye: up is positive, -90 is straight down"},
    [OPTION_ROLL] = {.key = "roll",
                     .group = CAMERA,
                     .type = VD_OPTION_REAL,
                     .argument = "A",
                     .min = -360,
                     .max = 360,
                     .unit = "degrees",
                     .fallback = "0",
                     .help = "turn about the view axis, clockwise"},
    [OPTION_FOV] = {.key = "fov",
                    .group = CAMERA,
                    .type = VD_OPTION_REAL,
                    .argument = "A",
                    .min = 0.001,
                    .max = 179,
                    .unit = "degrees",
                    .fallback = "40",
                    .help = "field of view, top to bottom"},
    [OPTION_PROJECTION] = {.key = "projection",
                           .group = CAMERA,
                           .type = VD_OPTION_CHOICE,
                           .argument = "perspective|orthographic",
                           .fallback = "perspective",
                           .help =
                               "orthographic keeps the scale that perspective has at the target"},
    [OPTION_NEAR] = {.key = "near",
                     .group = CAMERA,
                     .type = VD_OPTION_DISTANCE,
                     .argument = "D",
                     .min = 1e-6,
                     .max = 1e9,
                     .unit = "metres",
                     .fallback = "0.1",
                     .help = "nothing nearer is drawn; not given, with a model by its size"},
    [OPTION_PRINT_CAMERA] =
        {.key = "print-camera",
         .group = CAMERA,
         .type = VD_OPTION_SWITCH,
         .transient = true,
         .help = "print the camera as flags and as JSON (an options file); either gives the same "
                 "picture again"},

    [OPTION_MISSING] =
        {.key = "missing",
         .group = DATA,
         .type = VD_OPTION_CHOICE,
         .argument = "hole|fill",
         .fallback = "hole",
         .help = "what becomes of missing samples: left open, or filled from their neighbours"},
    [OPTION_NODATA] = {.key = "nodata",
                       .group = DATA,
                       .type = VD_OPTION_REAL,
                       .argument = "VALUE",
                       .unit = "stored value",
                       .help = "treat this value as missing, beside what the file says"},
    [OPTION_CELL_SIZE] = {.key = "cell-size",
                          .group = DATA,
                          .type = VD_OPTION_DISTANCE,
                          .argument = "D",
                          .min = 1e-9,
                          .max = 1e9,
                          .unit = "metres",
                          .help =
                              "spacing of the samples of files without georeference; by default 1"},
    [OPTION_HEIGHT_SCALE] = {.key = "height-scale",
                             .group = DATA,
                             .type = VD_OPTION_REAL,
                             .argument = "FACTOR",
                             .min = -1e9,
                             .max = 1e9,
                             .unit = "metres per stored unit",
                             .help =
                                 "factor on stored heights; by default the file's unit, else 1"},
    [OPTION_HEIGHT_OFFSET] = {.key = "height-offset",
                              .group = DATA,
                              .type = VD_OPTION_REAL,
                              .argument = "H",
                              .unit = "metres",
                              .fallback = "0",
                              .help = "added after scaling"},
    [OPTION_HEIGHT_ENCODING] =
        {.key = "height-encoding",
         .group = DATA,
         .type = VD_OPTION_CHOICE,
         .argument = "grey|rgb24|terrarium|mapbox",
         .fallback = "grey",
         .help = "how pictures hold heights: the first channel, R·65536+G·256+B, or the two tile "
                 "encodings"},
    [OPTION_RAW] = {.key = "raw",
                    .group = DATA,
                    .type = VD_OPTION_TEXT,
                    .argument = "WxH:TYPE[:big][:SKIP]",
                    .unit = "samples, bytes to skip",
                    .help = "read the input as raw numbers; TYPE is u8, i16, u16, i32, f32 or f64"},
    [OPTION_BAND] = {.key = "band",
                     .group = DATA,
                     .type = VD_OPTION_INTEGER,
                     .argument = "N",
                     .max = 65535,
                     .unit = "1 is the first",
                     .fallback = "0",
                     .help = "band that holds the heights (with GDAL); 0: the first"},
    [OPTION_FUNCTION] =
        {.key = "function",
         .group = DATA,
         .type = VD_OPTION_TEXT,
         .argument = "FORMULA",
         .help = "terrain from a formula in place of a file, such as "
                 "\"h=60*cos(x/40)*sin(y/40); rgb=hsv(h/120,0.6,1)\"; docs/function-terrain.md"},
    [OPTION_EXTENT] = {.key = "extent",
                       .group = DATA,
                       .type = VD_OPTION_TEXT,
                       .argument = "X0,Y0,X1,Y1",
                       .unit = "metres",
                       .help = "draw no more of --function than this: west, south, east, north; "
                               "sampled "
                               "every --cell-size, else 1024 times along the longer side"},
    [OPTION_BANDS] = {.key = "bands",
                      .group = DATA,
                      .type = VD_OPTION_TEXT,
                      .argument = "R,G,B",
                      .unit = "1 is the first",
                      .help = "bands of --color that are red, green and blue (with GDAL)"},

    [OPTION_CAMERA] = {.key = "camera",
                       .group = WORLD,
                       .type = VD_OPTION_TEXT,
                       .transient = true,
                       .argument = "NAME",
                       .help = "which of the world file's cameras to look through"},
    [OPTION_LINES] = {.key = "lines",
                      .group = WORLD,
                      .type = VD_OPTION_FILE,
                      .argument = "FILE",
                      .help = "tracks and borders laid on the ground: GPX, GeoJSON, KML and what "
                              "else GDAL reads"},
    [OPTION_LABELS] = {.key = "labels",
                       .group = WORLD,
                       .type = VD_OPTION_FILE,
                       .argument = "FILE",
                       .help = "names of places: GeoJSON, GPX, KML and what else GDAL reads"},
    [OPTION_LABEL_PEAKS] = {.key = "label-peaks",
                            .group = WORLD,
                            .type = VD_OPTION_INTEGER,
                            .argument = "N",
                            .max = 10000,
                            .unit = "peaks",
                            .fallback = "0",
                            .help = "write the heights of the peaks that stand out most"},
    [OPTION_TITLE] = {.key = "title",
                      .group = WORLD,
                      .type = VD_OPTION_TEXT,
                      .argument = "TEXT",
                      .help = "stands over the picture"},
    [OPTION_NORTH_ARROW] = {.key = "north-arrow",
                            .group = WORLD,
                            .type = VD_OPTION_FLAG,
                            .fallback = "off",
                            .help = "an arrow that points north"},
    [OPTION_SCALE_BAR] = {.key = "scale-bar",
                          .group = WORLD,
                          .type = VD_OPTION_FLAG,
                          .fallback = "off",
                          .help = "a bar of a round length, as it is in the picture's middle"},
    [OPTION_LEGEND] = {.key = "legend",
                       .group = WORLD,
                       .type = VD_OPTION_FLAG,
                       .fallback = "off",
                       .help = "the colours of the heights (not with --color)"},

    [OPTION_IMPOSTORS] = {.key = "impostors",
                          .group = IMPOSTORS,
                          .type = VD_OPTION_SWITCH,
                          .transient = true,
                          .help = "draw through impostors, until the picture is the one that is "
                                  "drawn without them"},
    [OPTION_TOLERANCE] =
        {.key = "tolerance",
         .group = IMPOSTORS,
         .type = VD_OPTION_REAL,
         .transient = true,
         .argument = "PX",
         .max = 1000,
         .unit = "pixels",
         .fallback = "1",
         .help = "how wrong such a picture may become before it is drawn anew; 0: always"},
    [OPTION_SHOW] = {.key = "show",
                     .group = IMPOSTORS,
                     .type = VD_OPTION_CHOICE,
                     .transient = true,
                     .argument = "pictures|bounds|age|error",
                     .help = "leave the pictures as a moving camera has them, and lay over each "
                             "where it is, how old or how wrong"},

    [OPTION_CLASSIC] =
        {.key = "classic",
         .group = CLASSIC,
         .type = VD_OPTION_TEXT,
         .argument = "KEY=VALUE,…",
         .unit = "samples, degrees",
         .help = "keys x, y, height, yaw (turning left), horizon, scale, view, distance, z0, step, "
                 "growth; those left out are the published scene's; mip=1 keeps the distance from "
                 "sparkling, smooth=1 turns flat curtains into gradients"},
    [OPTION_HEIGHT] = {.key = "height",
                       .group = CLASSIC,
                       .type = VD_OPTION_FILE,
                       .argument = "IMAGE",
                       .help = "heights: the first channel as it is, wrapping; --color "
                               "gives the colours"},

    [OPTION_SHADE] = {.key = "shade",
                      .group = MODEL,
                      .type = VD_OPTION_CHOICE,
                      .argument = "phong|flat|depth|normals|uv|id|albedo",
                      .fallback = "phong",
                      .help = "what surfaces show: light on smooth or flat faces, how near they "
                              "are, which way they face, their texture coordinates, a colour for "
                              "each triangle, or their own colour"},
    [OPTION_TEXTURE] = {.key = "texture",
                        .group = MODEL,
                        .type = VD_OPTION_FILE,
                        .argument = "FILE|none",
                        .is_name = is_none,
                        .help = "a picture for all of the model in place of its own textures; "
                                "none: do without"},
    [OPTION_WIREFRAME] = {.key = "wireframe",
                          .group = MODEL,
                          .type = VD_OPTION_SWITCH,
                          .help = "draw the edges of the triangles alone"},
    [OPTION_POINTS] = {.key = "points",
                       .group = MODEL,
                       .type = VD_OPTION_SWITCH,
                       .help = "draw the vertices alone"},
    [OPTION_SHOW_NORMALS] = {.key = "show-normals",
                             .group = MODEL,
                             .type = VD_OPTION_SWITCH,
                             .help = "draw a short line along the normal of each vertex"},
    [OPTION_LINE_WIDTH] = {.key = "line-width",
                           .group = MODEL,
                           .type = VD_OPTION_REAL,
                           .argument = "W",
                           .min = 0.1,
                           .max = 256,
                           .unit = "pixels",
                           .fallback = "1",
                           .help = "of wireframes, normals and the model's own lines"},
    [OPTION_POINT_SIZE] = {.key = "point-size",
                           .group = MODEL,
                           .type = VD_OPTION_REAL,
                           .argument = "W",
                           .min = 0.1,
                           .max = 256,
                           .unit = "pixels",
                           .fallback = "2",
                           .help = "of points"},
    [OPTION_CULL] = {.key = "cull",
                     .group = MODEL,
                     .type = VD_OPTION_CHOICE,
                     .argument = "none|back|front",
                     .fallback = "none",
                     .help = "which faces are left out: none lights both sides alike, back is "
                             "faster on closed models"},
    [OPTION_WINDING] = {.key = "winding",
                        .group = MODEL,
                        .type = VD_OPTION_CHOICE,
                        .argument = "ccw|cw|either",
                        .fallback = "ccw",
                        .help =
                            "which way the corners of a front face go round: counter-clockwise, "
                            "clockwise, or every face is one"},
    [OPTION_UP] = {.key = "up",
                   .group = MODEL,
                   .type = VD_OPTION_CHOICE,
                   .argument = "auto|y|z",
                   .fallback = "auto",
                   .help = "the model's axis that points up; auto: z in STL and 3MF, which come "
                           "from engineering, y in all others"},
    [OPTION_FAR] = {.key = "far",
                    .group = MODEL,
                    .type = VD_OPTION_DISTANCE,
                    .argument = "D",
                    .min = 1e-6,
                    .max = 1e15,
                    .unit = "metres",
                    .help = "nothing farther along the view axis is drawn; not given, no limit "
                            "(orthographic: behind all of the model)"},
    [OPTION_RASTER] = {.key = "raster",
                       .group = MODEL,
                       .type = VD_OPTION_CHOICE,
                       .argument = "auto|scanline|immediate|tiled|hybrid|reference",
                       .fallback = "auto",
                       .help = "how triangles are rasterized; all the same bytes; auto: what is "
                               "fastest for the picture"},

    [OPTION_OPTIONS] =
        {.key = "options",
         .group = RUN,
         .type = VD_OPTION_FILE,
         .transient = true,
         .argument = "FILE.json",
         .help = "read options and inputs from a file, or a world; flags win over it; plainly "
                 "naming the file does the same"},
    [OPTION_SAVE] = {.key = "save",
                     .group = RUN,
                     .type = VD_OPTION_FILE,
                     .transient = true,
                     .argument = "FILE.json",
                     .help = "write the options given as such a file"},
    [OPTION_SAVE_WORLD] = {.key = "save-world",
                           .group = RUN,
                           .type = VD_OPTION_FILE,
                           .transient = true,
                           .argument = "FILE.json",
                           .help = "write what is drawn as a world file"},
    [OPTION_DRY_RUN] = {.key = "dry-run",
                        .group = RUN,
                        .type = VD_OPTION_SWITCH,
                        .letter = 'n',
                        .transient = true,
                        .help =
                            "only say how many seconds and how much memory the picture would take"},
    [OPTION_ALLOW_EMPTY] = {.key = "allow-empty",
                            .group = RUN,
                            .type = VD_OPTION_SWITCH,
                            .help = "write the picture even when nothing is in it"},
    [OPTION_JSON] = {.key = "json",
                     .group = RUN,
                     .type = VD_OPTION_SWITCH,
                     .letter = 'j',
                     .transient = true,
                     .help = "print the result as JSON on standard output"},
    [OPTION_QUIET] = {.key = "quiet",
                      .group = RUN,
                      .type = VD_OPTION_SWITCH,
                      .letter = 'q',
                      .transient = true,
                      .help = "print nothing but errors on standard error"},
    [OPTION_HELP] = {.key = "help",
                     .group = RUN,
                     .type = VD_OPTION_SWITCH,
                     .letter = 'h',
                     .transient = true,
                     .help = "this page"},
};

vd_status vd_render_apply_preset(vd_options *options) {
    static const struct {
        const char *preset;
        int option;
        const char *value;
    } values[] = {
        {"fast", OPTION_SAMPLES, "1"},
        {"fast", OPTION_SHADOWS, "off"},
        {"best", OPTION_SAMPLES, "8"},
    };
    for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) {
        if (strcmp(values[i].preset, options->values[OPTION_PRESET].text) == 0) {
            vd_status status =
                vd_options_set(options, values[i].option, values[i].value, VD_SOURCE_PRESET);
            if (status.code != VD_OK) {
                return status;
            }
        }
    }
    return vd_success();
}
