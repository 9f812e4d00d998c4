/* brick_import.c: the stages of an import in their order. */
#include <string.h>
#include "core/core.h"
#include "splat/brick_import.h"

#define MEMORY_DEFAULT ((size_t)512 << 20)
#define MEMORY_LEAST ((size_t)64 << 20)
#define SCAN_PARTICLES ((size_t)1 << 20)

vd_bricks_def vd_bricks_def_default(void) {
    return (vd_bricks_def){.memory_bytes = MEMORY_DEFAULT, .leaf_particles = 8192};
}

static vd_status check_def(const vd_bricks_def *given, vd_bricks_def *out) {
    *out = vd_bricks_def_default();
    if (given == NULL) {
        return vd_success();
    }
    out->resume = given->resume;
    out->memory_bytes = given->memory_bytes != 0 ? given->memory_bytes : MEMORY_DEFAULT;
    out->leaf_particles = given->leaf_particles != 0 ? given->leaf_particles : 8192;
    if (out->memory_bytes < MEMORY_LEAST) {
        return vd_failure(VD_ERROR_ARGUMENT, "importing takes at least 64 MiB, not %zu bytes",
                          out->memory_bytes);
    }
    if (out->leaf_particles < 64 || out->leaf_particles > VD_BRICK_MOST) {
        return vd_failure(VD_ERROR_ARGUMENT, "a brick holds 64 to 65536 particles, not %u",
                          out->leaf_particles);
    }
    return vd_success();
}

static vd_status add_record(void *user, uint64_t key, const uint8_t *record) {
    return vd_tree_add(user, key, record);
}

static vd_status scan(vd_context *context, vd_job *job, vd_import_input *input) {
    const vd_import_progress progress = {job, 0.0, 0.2};
    vd_import_reader reader;
    vd_status status = vd_import_reader_init(context, input, SCAN_PARTICLES, &reader);
    if (status.code == VD_OK) {
        status = vd_import_scan(context, &reader, &progress);
    }
    vd_import_reader_finish(context, &reader);
    return status;
}

static vd_status build(vd_context *context, vd_job *job, const vd_import_input *input,
                       const vd_bricks_def *def, const char *path, vd_import_runs *runs,
                       vd_bricks_report *report) {
    const vd_import_progress sorting = {job, 0.2, 0.5}, merging = {job, 0.5, 1.0};
    vd_tree *tree = NULL;
    report->resumed = runs->consumed;
    vd_status status = vd_import_sort(runs, input, def->memory_bytes, def->resume, &sorting);
    if (status.code == VD_OK) {
        status = vd_tree_create(context, input, def->leaf_particles, path, &tree);
    }
    if (status.code == VD_OK) {
        status = vd_import_merge(runs, def->memory_bytes / 2, add_record, tree, &merging);
    }
    if (status.code == VD_OK) {
        const char *crs = input->sources[0]->crs;
        status = vd_tree_commit(tree, crs != NULL ? crs : "", report);
    }
    vd_tree_destroy(&tree);
    return status;
}

vd_status vd_bricks_import(vd_context *context, vd_job *job, vd_particle_source *const *sources,
                           int count, const vd_bricks_def *def, const char *path,
                           vd_bricks_report *report) {
    vd_bricks_def checked;
    vd_import_input *input = vd_allocate_zero(context, 1, sizeof *input);
    vd_bricks_report made = {0};
    if (input == NULL) {
        return vd_out_of_memory(path, sizeof *input);
    }
    vd_status status = check_def(def, &checked);
    if (status.code == VD_OK) {
        status = vd_import_begin(context, sources, count, input);
    }
    if (status.code == VD_OK) {
        status = scan(context, job, input);
    }
    if (status.code == VD_OK) {
        vd_import_runs runs;
        status = vd_import_runs_open(context, path, checked.resume, input, &runs);
        if (status.code == VD_OK) {
            status = build(context, job, input, &checked, path, &runs, &made);
        }
        vd_import_runs_close(&runs, checked.resume && status.code != VD_OK);
    }
    if (status.code == VD_OK && report != NULL) {
        made.count = input->count;
        made.skipped = input->skipped;
        for (int a = 0; a < input->attribute_count; a++) {
            made.missing_values += input->ranges[a].missing;
        }
        *report = made;
    }
    vd_release(context, input);
    return status;
}
