/* splat_lists.c: placing lists before the camera and bringing them into order. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "core/real.h"
#include "splat/splat_run.h"

/* ---- placing ----------------------------------------------------------------------------------*/

static bool range_is_open(const vd_splat_def *def) {
    return !(def->range_max > def->range_min);
}

static void place_list(void *user, int index, int worker) {
    vd_splatter *splatter = user;
    vd_placing *placing = &splatter->placings[index];
    const vd_splat_def *def = splatter->def;
    (void)worker;
    vd_placing_init(placing, &splatter->lists[index], def, &splatter->picture, splatter->camera);
    const bool weights = def->mode == VD_SPLAT_DENSITY;
    if (weights ? def->max_weight == 0.0 : range_is_open(def)) {
        vd_placing_measure(placing, def);
    }
}

/* Values to colours and weights to integers, by what was measured where the def leaves it open. */
static void set_ranges(vd_splatter *splatter, const vd_splat_def *def) {
    double low = def->range_min, high = def->range_max, heaviest = def->max_weight;
    if (range_is_open(def)) {
        low = INFINITY;
        high = -INFINITY;
        for (int i = 0; i < splatter->list_count; i++) {
            const vd_placing *p = &splatter->placings[i];
            low = p->value_min < low ? p->value_min : low;
            high = p->value_max > high ? p->value_max : high;
        }
        if (!(low <= high) || def->mode == VD_SPLAT_DENSITY) {
            low = high = 0.0;
        }
    }
    if (heaviest == 0.0) {
        for (int i = 0; i < splatter->list_count; i++) {
            const double weight = splatter->placings[i].weight_max;
            heaviest = weight > heaviest ? weight : heaviest;
        }
    }
    vd_splat_picture_set_range(&splatter->picture, def, low, high);
    vd_splat_picture_set_weight(&splatter->picture, heaviest);
}

typedef struct far_list {
    float z;
    int list;
} far_list;

static int compare_far(const void *a, const void *b) {
    const far_list *x = a, *y = b;
    return x->z > y->z ? -1 : x->z < y->z ? 1 : (x->list > y->list) - (x->list < y->list);
}

/* The lists that show something, as given or farthest first. */
static vd_status choose_sequence(vd_splatter *splatter, const vd_splat_def *def) {
    vd_status status =
        vd_buffer_reserve(splatter->context, &splatter->sequence_memory, "a sequence of splats",
                          (size_t)splatter->list_count + 1, sizeof(far_list) + sizeof(int));
    if (status.code != VD_OK) {
        return status;
    }
    far_list *far = splatter->sequence_memory.memory;
    int *sequence = (int *)(void *)(far + splatter->list_count);
    int count = 0;
    for (int i = 0; i < splatter->list_count; i++) {
        const vd_placing *p = &splatter->placings[i];
        if (p->splats->count > 0 && (splatter->all || !p->culled)) {
            far[count].z = p->middle_z == p->middle_z ? p->middle_z : 0.0f;
            far[count++].list = i;
        }
    }
    if (def->sort_splats && def->mode == VD_SPLAT_ALPHA && count > 1) {
        qsort(far, (size_t)count, sizeof *far, compare_far);
    }
    for (int k = 0; k < count; k++) {
        sequence[k] = far[k].list;
    }
    splatter->sequence = sequence;
    splatter->sequence_count = count;
    return status;
}

vd_status vd_splatter_place(vd_splatter *splatter, const vd_splat_def *def, const vd_camera *camera,
                            const vd_splats *lists, int count, int width, int height) {
    vd_status status = vd_splat_check(def, camera, lists, count);
    if (status.code == VD_OK) {
        status = vd_buffer_reserve(splatter->context, &splatter->placing_memory, "placed splats",
                                   (size_t)count + 1, sizeof *splatter->placings);
    }
    if (status.code != VD_OK) {
        return status;
    }
    splatter->placings = splatter->placing_memory.memory;
    splatter->def = def;
    splatter->camera = camera;
    splatter->lists = lists;
    splatter->list_count = count;
    vd_splat_picture_init(&splatter->picture, def, width, height, splatter->profiles);
    status = vd_parallel_for(splatter->context, NULL, count, place_list, splatter);
    if (status.code == VD_OK) {
        set_ranges(splatter, def);
        status = choose_sequence(splatter, def);
    }
    return status;
}

/* ---- order ------------------------------------------------------------------------------------*/

/* Whether a kept order still holds for the placing's direction. */
static bool order_holds(const vd_placing *placing, const vd_splat_order *order, double angle_rad) {
    const float *a = placing->axis, *b = order->axis;
    if (a[0] == b[0] && a[1] == b[1] && a[2] == b[2]) {
        return true;
    }
    const float cosine = (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2];
    return angle_rad > 0.0 && cosine >= (float)vd_cos(angle_rad < VD_PI ? angle_rad : VD_PI);
}

static void sort_list(vd_splatter *splatter, vd_placing *placing, int worker) {
    vd_sorter *sorter = &splatter->sorters[worker];
    vd_splat_order *order = placing->splats->order;
    splatter->kernels->keys(placing, sorter->keys);
    vd_sorter_run(sorter, placing->splats->count, placing->sorting);
    if (order != NULL) {
        memcpy(order->axis, placing->axis, sizeof order->axis);
    }
}

static void sort_task(void *user, int index, int worker) {
    vd_splatter *splatter = user;
    vd_placing *placing = &splatter->placings[splatter->sequence[index]];
    if (placing->sorting != NULL && placing->splats->count <= VD_SORT_MUCH) {
        sort_list(splatter, placing, worker);
    }
}

/* Scratch for every thread, as much as its lists need. */
static vd_status reserve_sorters(vd_splatter *splatter, size_t most) {
    const size_t each = most < VD_SORT_MUCH ? most : VD_SORT_MUCH;
    const size_t threads = (size_t)splatter->thread_count;
    const size_t total = most + (threads - 1) * each;
    vd_status status =
        vd_buffer_reserve(splatter->context, &splatter->sort_memory, "scratch to sort splats",
                          total + 16 * threads, sizeof(uint64_t) + sizeof(uint32_t));
    if (status.code != VD_OK) {
        return status;
    }
    uint64_t *pairs = splatter->sort_memory.memory;
    uint32_t *keys = (uint32_t *)(void *)(pairs + total);
    for (size_t i = 0; i < threads; i++) {
        splatter->sorters[i].keys = keys;
        splatter->sorters[i].pairs = pairs;
        keys += (i == 0 ? most : each) + 16;
        pairs += i == 0 ? most : each;
    }
    return status;
}

/* Decides which lists to sort, and where to. */
static vd_status choose_sorting(vd_splatter *splatter, size_t *most, uint64_t *sorted) {
    const vd_splat_def *def = splatter->def;
    size_t own = 0;
    for (int k = 0; k < splatter->sequence_count; k++) {
        const vd_placing *p = &splatter->placings[splatter->sequence[k]];
        own += p->splats->order == NULL ? p->splats->count : 0;
    }
    vd_status status = vd_success();
    if (own > 0 && !splatter->all) {
        status = vd_buffer_reserve(splatter->context, &splatter->order_memory,
                                   "the order of splats", own, sizeof(uint32_t));
    }
    uint32_t *next = splatter->order_memory.memory;
    for (int k = 0; k < splatter->sequence_count && status.code == VD_OK; k++) {
        vd_placing *p = &splatter->placings[splatter->sequence[k]];
        vd_splat_order *order = p->splats->order;
        if (order == NULL && splatter->all) {
            continue;
        }
        p->order = order != NULL ? order->index : next;
        if (order == NULL || !order_holds(p, order, def->resort_rad)) {
            p->sorting = order != NULL ? order->index : next;
            *most = p->splats->count > *most ? p->splats->count : *most;
            *sorted += p->splats->count;
        }
        if (order == NULL) { /* next may be null where there is none */
            next += p->splats->count;
        }
    }
    return status;
}

vd_status vd_splatter_order(vd_splatter *splatter, vd_job *job) {
    splatter->sorted = 0;
    if (splatter->def->mode != VD_SPLAT_ALPHA || splatter->def->keep_order) {
        return vd_success();
    }
    size_t most = 0;
    vd_status status = choose_sorting(splatter, &most, &splatter->sorted);
    if (status.code != VD_OK || splatter->sorted == 0) {
        return status;
    }
    status = reserve_sorters(splatter, most);
    for (int k = 0; k < splatter->sequence_count && status.code == VD_OK && most > VD_SORT_MUCH;
         k++) {
        vd_placing *p = &splatter->placings[splatter->sequence[k]];
        if (p->sorting != NULL && p->splats->count > VD_SORT_MUCH) {
            sort_list(splatter, p, 0);
        }
    }
    if (status.code == VD_OK) {
        status =
            vd_parallel_for(splatter->context, job, splatter->sequence_count, sort_task, splatter);
    }
    return status;
}
