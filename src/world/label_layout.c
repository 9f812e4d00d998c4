/* label_layout.c: boxes one after the other into a grid of what is taken.
 *
 * The grid's cells are as large as the average box. Taken rectangles stand in a list for each cell
 * that they touch; boxes do not overlap, so a cell has few. A label in a crowd could still try many
 * spots in vain; but once its leader meets something, all higher spots are out.
 */
#include "world/label_layout_internal.h"

#include <math.h>
#include <string.h>
#include "core/buffer.h"

#define MOST_CELLS 262144.0 /* of the grid */
#define NONE UINT32_MAX

/* What a rectangle is taken by. */
enum { KEPT = 1, BOX = 2, LEADER = 4, MARK = 8, ALL = 15 };

typedef struct rectangle {
    float x0, y0, x1, y1;
} rectangle;

typedef struct taken {
    rectangle at;
    uint32_t by;
} taken;

/* One entry of a cell's list. */
typedef struct node {
    uint32_t item, next;
} node;

struct vd_label_layout {
    vd_context *context;
    vd_buffer order; /* uint32_t [labels] */
    vd_buffer items; /* taken [3 labels + kept] */
    vd_buffer cells; /* uint32_t [columns × rows]: the first node of each */
    node *nodes;
    size_t item_count, node_count, node_capacity;
    int columns, rows;
    float cell_width, cell_height;
    uint64_t looks;
};

vd_label_layout_def vd_label_layout_def_default(void) {
    return (vd_label_layout_def){.margin = 4, .gap = 5, .mark = 3, .leader_width = 2};
}

vd_status vd_label_layout_create(vd_context *context, vd_label_layout **out) {
    vd_label_layout *layout = vd_allocate_zero(context, 1, sizeof *layout);
    if (layout == NULL) {
        return vd_out_of_memory("a layout of labels", sizeof *layout);
    }
    layout->context = context;
    *out = layout;
    return vd_success();
}

void vd_label_layout_destroy(vd_label_layout **layout) {
    if (layout == NULL || *layout == NULL) {
        return;
    }
    vd_label_layout *l = *layout;
    vd_release(l->context, l->order.memory);
    vd_release(l->context, l->items.memory);
    vd_release(l->context, l->cells.memory);
    vd_release(l->context, l->nodes);
    vd_release(l->context, l);
    *layout = NULL;
}

uint64_t vd_label_layout_looks(const vd_label_layout *layout) {
    return layout->looks;
}

/* ---- what comes in ------------------------------------------------------------------------------
 */

static vd_status check_def(const vd_label_layout_def *def, size_t count) {
    const struct {
        const char *name;
        float value;
    } lengths[] = {{"margin", def->margin},
                   {"gap", def->gap},
                   {"mark", def->mark},
                   {"leader_width", def->leader_width},
                   {"rise", def->rise}};
    if (def->width < 1 || def->height < 1) {
        return vd_failure(VD_ERROR_ARGUMENT, "labels: a picture of %d x %d pixels", def->width,
                          def->height);
    }
    for (size_t i = 0; i < sizeof lengths / sizeof lengths[0]; i++) {
        if (!(lengths[i].value >= 0 && lengths[i].value <= 65536)) {
            return vd_failure(VD_ERROR_ARGUMENT, "labels: %s is %g; give 0 to 65536 pixels",
                              lengths[i].name, (double)lengths[i].value);
        }
    }
    if (def->mark > def->gap || def->rises < 0 || def->rises > 65536) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "labels: mark (%g) may be at most gap (%g), rises (%d) 0 to 65536",
                          (double)def->mark, (double)def->gap, def->rises);
    }
    if (count > VD_LABEL_LAYOUT_MAX || def->kept_count > VD_LABEL_LAYOUT_MAX) {
        return vd_failure(VD_ERROR_LIMIT,
                          "%zu labels and %zu kept rectangles in one picture; at most %zu of each",
                          count, def->kept_count, VD_LABEL_LAYOUT_MAX);
    }
    for (size_t i = 0; i < def->kept_count; i++) {
        const float *r = def->kept[i];
        if (!(isfinite(r[0]) && isfinite(r[1]) && isfinite(r[2]) && isfinite(r[3]))) {
            return vd_failure(VD_ERROR_ARGUMENT, "labels: kept rectangle %zu is not finite", i);
        }
    }
    return vd_success();
}

static vd_status check_requests(const vd_label_request *requests, size_t count) {
    for (size_t i = 0; i < count; i++) {
        const vd_label_request *r = &requests[i];
        if (!(isfinite(r->x) && isfinite(r->y) && !isnan(r->priority))) {
            return vd_failure(VD_ERROR_ARGUMENT, "label %zu: its %s is not a number", i,
                              isnan(r->priority) ? "priority" : "place");
        }
        if (!(r->width > 0 && r->width < 1e6f && r->height > 0 && r->height < 1e6f) ||
            (unsigned)r->leader >= VD_LEADER_COUNT) {
            return vd_failure(VD_ERROR_ARGUMENT, "label %zu: a box of %g x %g pixels, leader %d", i,
                              (double)r->width, (double)r->height, (int)r->leader);
        }
    }
    return vd_success();
}

/* ---- the grid -----------------------------------------------------------------------------------
 */

static vd_status start_grid(vd_label_layout *l, const vd_label_layout_def *def,
                            const vd_label_request *requests, size_t count) {
    double width = 0, height = 0;
    for (size_t i = 0; i < count; i++) {
        width += (double)requests[i].width;
        height += (double)requests[i].height;
    }
    width = count > 0 && width > 8.0 * (double)count ? width / (double)count : 8.0;
    height = count > 0 && height > 8.0 * (double)count ? height / (double)count : 8.0;
    const double cells = def->width / width * (def->height / height);
    const double scale = cells > MOST_CELLS ? sqrt(cells / MOST_CELLS) : 1;
    l->cell_width = (float)(width * scale);
    l->cell_height = (float)(height * scale);
    l->columns = (int)((float)def->width / l->cell_width) + 1;
    l->rows = (int)((float)def->height / l->cell_height) + 1;
    l->item_count = l->node_count = 0;
    l->looks = 0;
    const size_t cell_count = (size_t)l->columns * (size_t)l->rows;
    vd_status status = vd_buffer_reserve(l->context, &l->cells, "the grid of labels", cell_count,
                                         sizeof(uint32_t));
    if (status.code == VD_OK) {
        memset(l->cells.memory, 0xFF, cell_count * sizeof(uint32_t));
        status = vd_buffer_reserve(l->context, &l->items, "the boxes of labels",
                                   3 * count + def->kept_count + 1, sizeof(taken));
    }
    return status;
}

static int clamp_cell(float at, float size, int count) {
    const float cell = floorf(at / size);
    return cell < 0 ? 0 : cell < (float)count ? (int)cell : count - 1;
}

/* The cells that a rectangle touches; those outside the picture count as the nearest within. */
static void find_cells(const vd_label_layout *l, const rectangle *r, int cells[4]) {
    cells[0] = clamp_cell(r->x0, l->cell_width, l->columns);
    cells[1] = clamp_cell(r->y0, l->cell_height, l->rows);
    cells[2] = clamp_cell(r->x1, l->cell_width, l->columns);
    cells[3] = clamp_cell(r->y1, l->cell_height, l->rows);
}

static vd_status grow_nodes(vd_label_layout *l, size_t count) {
    if (l->node_capacity - l->node_count >= count) {
        return vd_success();
    }
    const size_t capacity = l->node_count + count + l->node_capacity / 2 + 256;
    node *made = capacity < NONE ? vd_allocate(l->context, capacity, sizeof *made) : NULL;
    if (made == NULL) {
        return vd_out_of_memory("the grid of labels", capacity * sizeof *made);
    }
    if (l->node_count > 0) {
        memcpy(made, l->nodes, l->node_count * sizeof *made);
    }
    vd_release(l->context, l->nodes);
    l->nodes = made;
    l->node_capacity = capacity;
    return vd_success();
}

static vd_status take(vd_label_layout *l, rectangle at, uint32_t by) {
    int cells[4];
    find_cells(l, &at, cells);
    const size_t count = (size_t)(cells[2] - cells[0] + 1) * (size_t)(cells[3] - cells[1] + 1);
    const vd_status status = grow_nodes(l, count);
    if (status.code != VD_OK) {
        return status;
    }
    const uint32_t item = (uint32_t)l->item_count++;
    ((taken *)l->items.memory)[item] = (taken){at, by};
    for (int row = cells[1]; row <= cells[3]; row++) {
        for (int column = cells[0]; column <= cells[2]; column++) {
            uint32_t *first =
                (uint32_t *)l->cells.memory + (size_t)row * (size_t)l->columns + column;
            l->nodes[l->node_count] = (node){item, *first};
            *first = (uint32_t)l->node_count++;
        }
    }
    return vd_success();
}

/* Whether nothing of the kinds `by` reaches into a rectangle; edges may touch. */
static bool is_free(vd_label_layout *l, rectangle r, uint32_t by) {
    int cells[4];
    find_cells(l, &r, cells);
    const taken *items = l->items.memory;
    for (int row = cells[1]; row <= cells[3]; row++) {
        for (int column = cells[0]; column <= cells[2]; column++) {
            const uint32_t *cell = (const uint32_t *)l->cells.memory;
            uint32_t at = cell[(size_t)row * (size_t)l->columns + (size_t)column];
            for (; at != NONE; at = l->nodes[at].next) {
                const taken *t = &items[l->nodes[at].item];
                l->looks++;
                if ((t->by & by) != 0 && t->at.x0 < r.x1 && r.x0 < t->at.x1 && t->at.y0 < r.y1 &&
                    r.y0 < t->at.y1) {
                    return false;
                }
            }
        }
    }
    return true;
}

/* ---- the order ----------------------------------------------------------------------------------
 */

static bool comes_before(const vd_label_request *requests, uint32_t a, uint32_t b) {
    const double pa = requests[a].priority, pb = requests[b].priority;
    return pa != pb ? pa > pb : a < b;
}

static void sift(const vd_label_request *requests, uint32_t *order, size_t at, size_t count) {
    for (size_t child = 2 * at + 1; child < count; child = 2 * at + 1) {
        if (child + 1 < count && comes_before(requests, order[child], order[child + 1])) {
            child++;
        }
        if (!comes_before(requests, order[at], order[child])) {
            return;
        }
        const uint32_t kept = order[at];
        order[at] = order[child];
        order[child] = kept;
        at = child;
    }
}

/* Heap sort: qsort may allocate. */
static void sort_labels(const vd_label_request *requests, uint32_t *order, size_t count) {
    for (size_t i = 0; i < count; i++) {
        order[i] = (uint32_t)i;
    }
    for (size_t i = count / 2; i > 0; i--) {
        sift(requests, order, i - 1, count);
    }
    for (size_t end = count; end > 1; end--) {
        const uint32_t kept = order[0];
        order[0] = order[end - 1];
        order[end - 1] = kept;
        sift(requests, order, 0, end - 1);
    }
}

/* ---- one label ----------------------------------------------------------------------------------
 */

/* Whether a box may stand at (x, y); moved sideways into the picture where `over` its place. */
static bool try_box(vd_label_layout *l, const vd_label_layout_def *def, const vd_label_request *r,
                    float x, float y, bool over, rectangle *out) {
    const float left = def->margin, right = (float)def->width - def->margin - r->width;
    if (over) {
        x = x < right ? x : right;
        x = left < x ? x : left;
    }
    /* x1 and y1 as they will be compared: their rounding counts. */
    const rectangle box = {x, y, x + r->width, y + r->height};
    if (box.x0 < left || box.y0 < def->margin || box.x1 > (float)def->width - def->margin ||
        box.y1 > (float)def->height - def->margin || (over && (r->x < box.x0 || r->x > box.x1)) ||
        !is_free(l, box, ALL)) {
        return false;
    }
    *out = box;
    return true;
}

static bool try_above(vd_label_layout *l, const vd_label_layout_def *def, const vd_label_request *r,
                      rectangle *box) {
    return try_box(l, def, r, r->x - 0.5f * r->width, r->y - def->gap - r->height, true, box);
}

static bool try_beside(vd_label_layout *l, const vd_label_layout_def *def,
                       const vd_label_request *r, rectangle *box) {
    const float centre_x = r->x - 0.5f * r->width, centre_y = r->y - 0.5f * r->height;
    return try_box(l, def, r, r->x + def->gap, centre_y, false, box) ||
           try_box(l, def, r, r->x - def->gap - r->width, centre_y, false, box) ||
           try_box(l, def, r, centre_x, r->y + def->gap, true, box);
}

static rectangle leader_of(const vd_label_layout_def *def, const vd_label_request *r, float top,
                           float bottom) {
    return (rectangle){r->x - 0.5f * def->leader_width, top, r->x + 0.5f * def->leader_width,
                       bottom};
}

/* Ever higher; centred over the place, then more to the right, then to the left. */
static bool try_raised(vd_label_layout *l, const vd_label_layout_def *def,
                       const vd_label_request *r, rectangle *box) {
    static const float shifts[] = {-0.5f, -0.15f, -0.85f}; /* widths */
    const float rise = def->rise > 0 ? def->rise : 0.5f * r->height;
    const int rises = def->rises > 0 ? def->rises : 16;
    float free_from = r->y - def->mark; /* down to the place, the leader meets nothing */
    for (int i = 1; i <= rises; i++) {
        const float bottom = r->y - def->gap - (float)i * rise;
        if (bottom - r->height < def->margin ||
            !is_free(l, leader_of(def, r, bottom, free_from), ALL)) {
            return false;
        }
        free_from = bottom;
        for (int s = 0; s < 3; s++) {
            if (try_box(l, def, r, r->x + shifts[s] * r->width, bottom - r->height, true, box)) {
                return true;
            }
        }
    }
    return false;
}

static vd_status place_label(vd_label_layout *l, const vd_label_layout_def *def,
                             const vd_label_request *r, vd_label_spot *spot) {
    memset(spot, 0, sizeof *spot);
    const rectangle mark = {r->x - def->mark, r->y - def->mark, r->x + def->mark, r->y + def->mark};
    rectangle box;
    if (r->x < 0 || r->y < 0 || r->x > (float)def->width || r->y > (float)def->height ||
        !is_free(l, mark, KEPT | BOX | LEADER)) {
        return vd_success();
    }
    const bool near = r->leader != VD_LEADER_ALWAYS, far = r->leader != VD_LEADER_NEVER;
    spot->shown =
        near && (try_above(l, def, r, &box) || (!def->rise_first && try_beside(l, def, r, &box)));
    if (!spot->shown && far) {
        spot->shown = spot->leader = try_raised(l, def, r, &box);
    }
    if (!spot->shown && near && def->rise_first) {
        spot->shown = try_beside(l, def, r, &box);
    }
    if (!spot->shown) {
        return vd_success();
    }
    memcpy(spot->box, &box, sizeof spot->box);
    vd_status status = take(l, box, BOX);
    if (status.code == VD_OK) {
        status = take(l, mark, MARK);
    }
    if (status.code == VD_OK && spot->leader) {
        /* To its very place: no leader of another may come down on it. */
        status = take(l, leader_of(def, r, box.y1, r->y), LEADER);
    }
    return status;
}

vd_status vd_label_layout_place(vd_label_layout *layout, const vd_label_layout_def *def,
                                const vd_label_request *requests, size_t count,
                                vd_label_spot *spots) {
    vd_status status = check_def(def, count);
    if (status.code == VD_OK) {
        status = check_requests(requests, count);
    }
    if (status.code == VD_OK) {
        status = start_grid(layout, def, requests, count);
    }
    if (status.code == VD_OK) {
        status = vd_buffer_reserve(layout->context, &layout->order, "the order of labels",
                                   count + 1, sizeof(uint32_t));
    }
    for (size_t i = 0; i < def->kept_count && status.code == VD_OK; i++) {
        rectangle kept;
        memcpy(&kept, def->kept[i], sizeof kept);
        if (kept.x0 < kept.x1 && kept.y0 < kept.y1) {
            status = take(layout, kept, KEPT);
        }
    }
    if (status.code != VD_OK) {
        return status;
    }
    uint32_t *order = layout->order.memory;
    sort_labels(requests, order, count);
    for (size_t i = 0; i < count && status.code == VD_OK; i++) {
        status = place_label(layout, def, &requests[order[i]], &spots[order[i]]);
    }
    return status;
}
