/* render_classic.c: the classic Voxel Space picture from two picture files. */
#include <math.h>
#include <string.h>

#include "render_run.h"

/* Takes the first channel of a picture as heights: 8 bits stay bytes, 16 stay words. */
static vd_status first_channel(const vd_picture *picture, void **out) {
    size_t bytes = picture->bits == 16 ? 2 : 1;
    size_t width = (size_t)picture->width, height = (size_t)picture->height;
    uint8_t *heights = vd_allocate(picture->context, width * height, bytes);
    if (heights == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory for %zu heights", width * height);
    }
    size_t step = bytes * (size_t)picture->channels;
    for (size_t y = 0; y < height; y++) {
        const uint8_t *row = (const uint8_t *)picture->data + y * picture->stride_bytes;
        for (size_t x = 0; x < width; x++) {
            memcpy(heights + (y * width + x) * bytes, row + x * step, bytes);
        }
    }
    *out = heights;
    return vd_success();
}

/* Makes a picture of the map's size: the nearest pixels of `source`, or where that is null the
 * colormap's colours of the heights. */
static vd_status make_colors(const vd_picture *heights, const vd_picture *source,
                             const vd_colormap *colormap, vd_picture **out) {
    int width = heights->width, height = heights->height;
    vd_picture *made = NULL;
    vd_status status = vd_picture_create(heights->context, width, height, 3, 8, &made);
    if (status.code != VD_OK) {
        return status;
    }
    double range = heights->bits == 16 ? 65535.0 : 255.0;
    for (int y = 0; y < height; y++) {
        uint8_t *row = (uint8_t *)made->data + (size_t)y * made->stride_bytes;
        for (int x = 0; x < width; x++) {
            vd_rgba8 c;
            if (source != NULL) {
                c = vd_picture_color(source, (int)((int64_t)x * source->width / width),
                                     (int)((int64_t)y * source->height / height));
            } else {
                const uint8_t *h =
                    (const uint8_t *)heights->data + (size_t)y * heights->stride_bytes +
                    (size_t)x * (size_t)heights->channels * (size_t)(heights->bits / 8);
                uint16_t word = 0;
                memcpy(&word, h, heights->bits == 16 ? 2 : 1);
                double value = heights->bits == 16 ? word : *h;
                c = vd_colormap_at(colormap, value, 0.0, range);
            }
            row[3 * x] = c.r;
            row[3 * x + 1] = c.g;
            row[3 * x + 2] = c.b;
        }
    }
    *out = made;
    return vd_success();
}

static vd_status load_colors(vd_render_run *run, const vd_picture *heights, vd_picture **out) {
    const vd_render_settings *s = run->settings;
    if (s->color == NULL) {
        vd_colormap colormap;
        vd_status status = vd_colormap_find(s->colormap, &colormap)
                               ? vd_success()
                               : vd_colormap_load(run->context, s->colormap, &colormap);
        return status.code != VD_OK ? status : make_colors(heights, NULL, &colormap, out);
    }
    vd_picture *colors = NULL;
    vd_status status = vd_picture_load(run->context, s->color, &colors);
    if (status.code != VD_OK) {
        return status;
    }
    if (colors->width == heights->width && colors->height == heights->height) {
        *out = colors;
        return status;
    }
    vd_log(run->context, VD_LOG_WARNING,
           "%.160s is %dx%d and is resampled (nearest) to the "
           "heights' %dx%d",
           s->color, colors->width, colors->height, heights->width, heights->height);
    status = make_colors(heights, colors, NULL, out);
    vd_picture_destroy(&colors);
    return status;
}

/* Darkens the map's colours by the steps towards the sun that lie under the terrain. */
static vd_status bake_shadows(vd_render_run *run, vd_heightfield *map) {
    const vd_render_settings *s = run->settings;
    vd_shadow_def def = vd_shadow_def_default();
    def.azimuth_rad = s->sun_azimuth * VD_RADIANS_PER_DEGREE;
    def.altitude_rad = s->sun_altitude * VD_RADIANS_PER_DEGREE;
    const size_t stride = (size_t)map->width;
    uint8_t *counts = vd_allocate(run->context, (size_t)map->height, stride);
    if (counts == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory for %zu shadow counts",
                          stride * (size_t)map->height);
    }
    vd_status status = vd_shadow_count(run->context, run->job, map, &def, counts, stride);
    if (status.code == VD_OK) {
        status = vd_shadow_bake_heightfield(run->context, counts, stride, s->shadow_curve, map);
    }
    vd_release(run->context, counts);
    return status;
}

static vd_status load_map(vd_render_run *run, vd_heightfield **out) {
    vd_picture *heights = NULL, *colors = NULL;
    void *values = NULL;
    vd_status status = vd_picture_load(run->context, run->settings->inputs[0], &heights);
    if (status.code == VD_OK) {
        status = load_colors(run, heights, &colors);
    }
    if (status.code == VD_OK) {
        status = first_channel(heights, &values);
    }
    if (status.code == VD_OK) {
        vd_heightfield_def def = vd_heightfield_def_default();
        def.width = heights->width;
        def.height = heights->height;
        def.type = heights->bits == 16 ? VD_HEIGHT_U16 : VD_HEIGHT_U8;
        def.heights = values;
        def.height_stride = (size_t)heights->width;
        def.wraps = true;
        def.colors = colors;
        status = vd_heightfield_create(run->context, &def, out);
    }
    if (status.code == VD_OK && run->settings->shadows) {
        status = bake_shadows(run, *out);
        if (status.code != VD_OK) {
            vd_heightfield_destroy(run->context, out);
        }
    }
    vd_release(run->context, values);
    vd_picture_destroy(&colors);
    vd_picture_destroy(&heights);
    return status;
}

static vd_status describe(vd_render_run *run, const vd_heightfield *map) {
    const vd_classic_def *c = &run->settings->classic_def;
    const struct {
        const char *key;
        double value;
    } keys[] = {{"x", c->x},
                {"y", c->y},
                {"height", c->height},
                {"yaw", run->settings->classic_yaw},
                {"horizon", c->horizon},
                {"scale", c->scale},
                {"view", c->view},
                {"distance", c->distance},
                {"z0", c->z0},
                {"step", c->step},
                {"growth", c->growth}};
    json_t *values = json_object();
    bool failed = values == NULL;
    size_t used = (size_t)snprintf(run->flags, sizeof run->flags, "--classic ");
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++) {
        failed |= json_object_set_new(values, keys[i].key, json_real(keys[i].value)) != 0;
        char number[32];
        vd_write_number(keys[i].value, number);
        used += (size_t)snprintf(run->flags + used, sizeof run->flags - used, "%s%s=%s",
                                 i > 0 ? "," : "", keys[i].key, number);
    }
    const struct {
        const char *key;
        bool on;
    } switches[] = {{"mip", c->mip}, {"smooth", c->smooth}};
    for (size_t i = 0; i < sizeof switches / sizeof switches[0]; i++) {
        if (switches[i].on) {
            failed |= json_object_set_new(values, switches[i].key, json_integer(1)) != 0;
            used += (size_t)snprintf(run->flags + used, sizeof run->flags - used, ",%s=1",
                                     switches[i].key);
        }
    }
    run->camera = json_pack("{s: s, s: o}", "veduta", vd_version(), "classic", values);
    run->camera_all = json_pack("{s: s, s: O}", "flags", run->flags, "options", run->camera);
    run->terrain = json_pack("{s: i, s: i, s: f, s: f}", "width", map->width, "height", map->height,
                             "min", (double)map->min, "max", (double)map->max);
    run->near_m = c->view * c->z0;
    failed |= run->camera == NULL || run->camera_all == NULL || run->terrain == NULL;
    return failed ? vd_failure(VD_ERROR_MEMORY, "out of memory while describing the camera")
                  : vd_success();
}

/* What a picture cost: on the clock, and of the processors. */
typedef struct cost {
    double wall, busy;
} cost;

static vd_status draw_columns(vd_render_run *run, const vd_heightfield *map, int width,
                              cost *spent) {
    const vd_render_settings *s = run->settings;
    vd_frame *frame = NULL;
    vd_status status = vd_frame_create(run->context, width, s->height, 0, &frame);
    double start = vd_seconds_now(), busy = vd_processor_seconds_now();
    if (status.code == VD_OK) {
        status = vd_classic_render(run->context, run->job, map, &s->classic_def, s->classic_method,
                                   frame, NULL);
    }
    *spent = (cost){vd_seconds_now() - start, vd_processor_seconds_now() - busy};
    vd_frame_destroy(&frame);
    return status;
}

/* Two narrow pictures tell what a column costs and what the slices cost without columns. Processor
 * time is what is compared, as other programs hardly change it; how much longer the clock runs is
 * taken from the less disturbed of the two. */
static vd_status estimate(vd_render_run *run, const vd_heightfield *map) {
    int width = run->settings->width;
    /* Far apart, so that an error of either weighs little in their difference. */
    int narrow = width / 16 > 0 ? width / 16 : 1;
    int wide = width / 3 > narrow ? width / 3 : width;
    cost first = {0.0, 0.0}, second = {0.0, 0.0};
    vd_process_memory loaded = vd_process_memory_now();
    run->ready_seconds = vd_seconds_now() - run->start;
    vd_status status = draw_columns(run, map, narrow, &first);
    if (status.code == VD_OK) {
        status = draw_columns(run, map, wide, &second);
    }
    run->bad_use = status.code == VD_ERROR_ARGUMENT || status.code == VD_ERROR_LIMIT;
    /* Where the wide one came out no dearer, all cost is taken for the columns'. */
    bool rises = second.busy > first.busy && wide > narrow;
    double slope = rises ? (second.busy - first.busy) / (wide - narrow) : second.busy / wide;
    double busy = second.busy + slope * (width - wide);
    double stretch = fmin(first.busy > 0.0 ? first.wall / first.busy : 1.0,
                          second.busy > 0.0 ? second.wall / second.busy : 1.0);
    run->draw_seconds = busy * stretch;
    vd_render_estimate_memory(run, &loaded, 0);
    return status;
}

static bool shows_nothing(const vd_frame *frame, vd_rgba8 background) {
    for (int y = 0; y < frame->height; y++) {
        const uint8_t *row = frame->rgba + 4 * (size_t)y * frame->stride;
        for (int x = 0; x < frame->width; x++) {
            if (row[4 * x] != background.r || row[4 * x + 1] != background.g ||
                row[4 * x + 2] != background.b) {
                return false;
            }
        }
    }
    return true;
}

static vd_status draw(vd_render_run *run, const vd_heightfield *map) {
    const vd_render_settings *s = run->settings;
    vd_status status = vd_render_make_frame(run);
    if (status.code != VD_OK) {
        return status;
    }
    /* Only `columns` is one parallel loop, whose progress is the picture's. */
    bool hidden = s->quiet || s->classic_method != VD_CLASSIC_COLUMNS;
    vd_progress progress;
    double start = vd_seconds_now();
    vd_progress_start(&progress, run->job, hidden);
    status = vd_classic_render(run->context, run->job, map, &s->classic_def, s->classic_method,
                               run->frame, NULL);
    vd_progress_stop(&progress);
    run->draw_seconds = vd_seconds_now() - start;
    run->bad_use = status.code == VD_ERROR_ARGUMENT || status.code == VD_ERROR_LIMIT;
    if (status.code == VD_OK && !s->allow_empty &&
        shows_nothing(run->frame, s->classic_def.background)) {
        status = vd_failure(VD_ERROR_EMPTY,
                            "nothing but background is in the picture; change "
                            "height, horizon or scale of --classic (--allow-empty writes it all "
                            "the same)");
    }
    return status;
}

vd_status vd_render_classic(vd_render_run *run) {
    const vd_render_settings *s = run->settings;
    vd_heightfield *map = NULL;
    vd_status status = load_map(run, &map);
    if (status.code == VD_OK) {
        status = describe(run, map);
    }
    if (status.code == VD_OK && s->dry_run) {
        status = estimate(run, map);
    } else if (status.code == VD_OK) {
        status = draw(run, map);
    }
    vd_heightfield_destroy(run->context, &map);
    return status;
}
