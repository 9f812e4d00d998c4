/* path_track.c: tracks from vector files. */
#include <stdio.h>
#include <string.h>

#include "geo_module.h"
#include "path_file.h"

/* The first line of a file, else its first polygon, whose edge is one; null when it has neither. */
static const vd_feature *find_line(const vd_features *features) {
    for (int kind = VD_FEATURE_LINE; kind <= VD_FEATURE_POLYGON; kind++) {
        for (size_t i = 0; i < features->count; i++) {
            if ((int)features->features[i].kind == kind) {
                return &features->features[i];
            }
        }
    }
    return NULL;
}

/* Copies a line's points, its segments joined; of a polygon the outer ring's. */
static vd_status take_line(const vd_features *all, const vd_feature *line, vd_track_points *out) {
    const size_t parts = line->kind == VD_FEATURE_LINE ? line->part_count : 1;
    const size_t first = all->parts[line->first_part], end = all->parts[line->first_part + parts];
    if (end - first > VD_MAX_KEYFRAMES) {
        return vd_failure(VD_ERROR_LIMIT, "the track has %zu points, more than %d; thin it out",
                          end - first, VD_MAX_KEYFRAMES);
    }
    out->lonlat = vd_allocate(all->context, end - first, sizeof out->lonlat[0]);
    if (out->lonlat == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory while reading a track");
    }
    out->count = (int)(end - first);
    out->has_z = line->has_z;
    for (int i = 0; i < out->count; i++) {
        memcpy(out->lonlat[i], all->points[first + (size_t)i], sizeof out->lonlat[i]);
    }
    return vd_success();
}

vd_status vd_path_load_track(vd_context *context, const char *path, vd_track_points *out) {
    char purpose[256];
    snprintf(purpose, sizeof purpose, "read %.200s", path);
    vd_geo_module geo;
    vd_features *features = NULL;
    *out = (vd_track_points){NULL, 0, false};
    vd_status status = vd_geo_module_open(purpose, &geo);
    if (status.code == VD_OK) {
        status = geo.load_features(context, path, NULL, &features);
    }
    if (status.code != VD_OK) {
        return status;
    }
    const vd_feature *line = find_line(features);
    if (line == NULL) {
        status = vd_failure(VD_ERROR_EMPTY,
                            "%.200s holds no track: %zu points, and a line of two at least is a "
                            "way; give another file",
                            path, features->point_count);
    } else {
        size_t lines = 0;
        for (size_t i = 0; i < features->count; i++) {
            lines += features->features[i].kind == line->kind;
        }
        if (lines > 1) {
            const char *name = features->names + line->name;
            vd_log(context, VD_LOG_WARNING, "%.160s holds %zu lines; the first%s%.60s%s is flown",
                   path, lines, name[0] != '\0' ? ", \"" : "", name, name[0] != '\0' ? "\"," : "");
        }
        status = take_line(features, line, out);
    }
    geo.features_destroy(&features);
    return status;
}
