/* brick_tree.c: the octree, built from the sorted stream of particles from the bottom up.
 *
 * A leaf is the largest cell of the octree that begins where the last leaf ended and holds no more
 * particles than a brick may: one look at the place of the particle just behind a full brick tells
 * how deep it must be. When the stream leaves a cell, the nodes in it that have no parent yet get
 * one; a cell with a single node gets none. So only the particles of a leaf and those of up to
 * seven nodes a level are in memory, whatever the size of the data.
 *
 *        leaf leaf │ leaf leaf leaf │ leaf ◄── stream
 *           └──┬───┘    └────┬──────┘
 *            parent        parent          ◄── made when the stream passes the bar */
#include <string.h>
#include <xxhash.h>
#include "core/core.h"
#include "splat/brick_tree.h"

#define SPACING_BUCKETS 32768 /* of the logarithm of a squared distance: 16 an octave */

struct vd_tree {
    vd_context *context;
    const vd_import_input *input;
    vd_file file;
    bool open;
    uint64_t written;
    size_t record_bytes;
    uint32_t leaf_particles;
    uint32_t attribute_count;
    vd_bricks_attribute attributes[VD_MAX_ATTRIBUTES];

    /* What came and is in no leaf yet: [begin, end) of room for 4 leaves. */
    vd_tree_place *places;
    uint8_t *records;
    size_t begin, end, room;
    vd_tree_place last;   /* the particle before `begin` */
    vd_tree_place newest; /* the particle before `end` */
    bool any_leaf, any;

    vd_tree_pending *pending;
    uint32_t pending_count, pending_room;
    vd_bricks_node *nodes;   /* in the order they were made: children before parents */
    uint32_t (*children)[8]; /* of each node, as indices into nodes */
    uint32_t node_count, node_room;
    uint64_t stored;
    uint64_t *spacing; /* [SPACING_BUCKETS] */
    uint8_t *brick;    /* the bytes of one */
    size_t brick_bytes;
};

static void describe_attributes(vd_tree *t) {
    for (int a = 0; a < t->input->attribute_count; a++) {
        const vd_attribute *from = &t->input->attributes[a];
        const vd_import_range *r = &t->input->ranges[a];
        vd_bricks_attribute *to = &t->attributes[a];
        memcpy(to->name, from->name, sizeof to->name);
        to->kind = from->kind;
        to->min = r->min;
        to->max = r->max;
        to->mean = r->numbers > 0 ? r->sum / (double)r->numbers : 0.0;
        to->missing = r->missing;
        if (from->kind == VD_ATTRIBUTE_CHANNEL ||
            (from->kind == VD_ATTRIBUTE_CATEGORY && r->max <= 255.0)) {
            to->storage = VD_BRICK_U8;
        } else if (from->kind == VD_ATTRIBUTE_CATEGORY) {
            to->storage = VD_BRICK_U16;
        } else {
            /* Many octaves of positive numbers would lose the small ones. */
            to->storage = r->min > 0.0 && r->max > 1024.0 * r->min ? VD_BRICK_LOG : VD_BRICK_LINEAR;
        }
    }
}

vd_status vd_tree_create(vd_context *context, const vd_import_input *input, uint32_t leaf_particles,
                         const char *path, vd_tree **out) {
    vd_tree *t = vd_allocate_zero(context, 1, sizeof *t);
    if (t == NULL) {
        return vd_out_of_memory(path, sizeof *t);
    }
    t->context = context;
    t->input = input;
    t->record_bytes = vd_record_bytes(input->attribute_count);
    t->leaf_particles = leaf_particles;
    t->attribute_count = (uint32_t)input->attribute_count;
    describe_attributes(t);
    t->room = 4 * (size_t)leaf_particles;
    t->places = vd_allocate(context, t->room, sizeof *t->places);
    t->records = vd_allocate(context, t->room, t->record_bytes);
    t->pending_room = 8 * VD_TREE_LEVELS + 8;
    t->pending = vd_allocate(context, t->pending_room, sizeof *t->pending);
    t->spacing = vd_allocate_zero(context, SPACING_BUCKETS, sizeof *t->spacing);
    t->brick_bytes = vd_brick_bytes(t->attributes, t->attribute_count, VD_BRICK_MOST);
    t->brick = vd_allocate(context, t->brick_bytes, 1);
    vd_status status = vd_success();
    if (t->places == NULL || t->records == NULL || t->pending == NULL || t->spacing == NULL ||
        t->brick == NULL) {
        status = vd_out_of_memory(path, t->room * t->record_bytes);
    }
    if (status.code == VD_OK) {
        status = vd_file_create(context, path, &t->file);
        t->open = status.code == VD_OK;
    }
    if (status.code == VD_OK && t->file.beside == NULL) {
        status = vd_failure(VD_ERROR_IO,
                            "cannot write %.250s: bricks are written to a file only; "
                            "name one",
                            path);
    }
    if (status.code != VD_OK) {
        vd_tree_destroy(&t);
        return status;
    }
    const vd_bricks_head head = {0};
    vd_file_write(&t->file, &head, sizeof head);
    t->written = sizeof head;
    *out = t;
    return status;
}

void vd_tree_destroy(vd_tree **tree) {
    if (tree == NULL || *tree == NULL) {
        return;
    }
    vd_tree *t = *tree;
    if (t->open) {
        vd_file_discard(&t->file);
    }
    for (uint32_t i = 0; i < t->pending_count; i++) {
        vd_release(t->context, t->pending[i].records);
    }
    vd_release(t->context, t->places);
    vd_release(t->context, t->records);
    vd_release(t->context, t->pending);
    vd_release(t->context, t->nodes);
    vd_release(t->context, t->children);
    vd_release(t->context, t->spacing);
    vd_release(t->context, t->brick);
    vd_release(t->context, t);
    *tree = NULL;
}

/* ---- nodes --------------------------------------------------------------------------------------
 */

static vd_status make_room(vd_tree *t) {
    if (t->node_count < t->node_room) {
        return vd_success();
    }
    if (t->node_room > UINT32_MAX / 2 - 1024) {
        return vd_failure(VD_ERROR_LIMIT, "there are too many bricks; make them larger");
    }
    const uint32_t room = t->node_room * 2 + 1024;
    vd_bricks_node *nodes = vd_allocate(t->context, room, sizeof *nodes);
    uint32_t(*children)[8] = vd_allocate(t->context, room, sizeof *children);
    if (nodes == NULL || children == NULL) {
        vd_release(t->context, nodes);
        vd_release(t->context, children);
        return vd_out_of_memory("the tree", room * sizeof *nodes);
    }
    if (t->node_count > 0) {
        memcpy(nodes, t->nodes, t->node_count * sizeof *nodes);
        memcpy(children, t->children, t->node_count * sizeof *children);
    }
    vd_release(t->context, t->nodes);
    vd_release(t->context, t->children);
    t->nodes = nodes;
    t->children = children;
    t->node_room = room;
    return vd_success();
}

static double world(const vd_tree *t, uint32_t q, int axis) {
    return t->input->min[axis] + ((double)q + 0.5) * (t->input->cube_size / 4294967296.0);
}

/* Writes a node's brick and adds the node. */
static vd_status write_node(vd_tree *t, vd_tree_pending *p, int level) {
    vd_status status = make_room(t);
    if (status.code != VD_OK) {
        return status;
    }
    vd_brick_source source = {.records = p->records, .count = p->count};
    memcpy(source.min, p->min, sizeof source.min);
    memcpy(source.max, p->max, sizeof source.max);
    const size_t bytes = vd_brick_bytes(t->attributes, t->attribute_count, p->count);
    memset(t->brick, 0, bytes);
    const float radius = vd_brick_encode(t->attributes, t->attribute_count, &source, t->brick);
    p->index = t->node_count++;
    vd_bricks_node *n = &t->nodes[p->index];
    memset(n, 0, sizeof *n);
    for (int k = 0; k < 3; k++) {
        n->min[k] = world(t, p->min[k], k);
        n->max[k] = world(t, p->max[k], k);
    }
    n->offset = t->written;
    n->checksum = XXH64(t->brick, bytes, 0);
    n->leaves = p->leaves;
    n->count = p->count;
    n->bytes = (uint32_t)bytes;
    n->spread = (float)(__builtin_sqrt(p->spread2) * (t->input->cube_size / 4294967296.0));
    n->radius_max = radius;
    n->level = (uint32_t)level;
    vd_file_write(&t->file, t->brick, bytes);
    t->written += bytes;
    t->stored += p->count;
    return t->file.error == 0 ? status
                              : vd_failure(VD_ERROR_IO, "cannot write %.250s: %s; free some space",
                                           t->file.path, strerror(t->file.error));
}

/* Gives the last `count` pending nodes a parent, which takes their place. */
static vd_status make_parent(vd_tree *t, uint32_t count, int level) {
    vd_tree_pending *children = &t->pending[t->pending_count - count];
    uint64_t total = 0;
    for (uint32_t c = 0; c < count; c++) {
        total += children[c].count;
    }
    const uint32_t most = vd_tree_sample_count(total, t->leaf_particles);
    vd_tree_pending parent = {.first = children[0].first,
                              .records = vd_allocate(t->context, most, t->record_bytes)};
    if (parent.records == NULL) {
        return vd_out_of_memory("a brick", most * t->record_bytes);
    }
    vd_tree_sample(t->attributes, t->attribute_count, children, count, most, &parent);
    vd_status status = write_node(t, &parent, level);
    if (status.code != VD_OK) {
        vd_release(t->context, parent.records);
        return status;
    }
    t->nodes[parent.index].child_count = count;
    for (uint32_t c = 0; c < count; c++) {
        t->children[parent.index][c] = children[c].index;
        t->nodes[children[c].index].octant = vd_tree_digit(children[c].first, level);
        vd_release(t->context, children[c].records);
    }
    t->pending_count -= count;
    t->pending[t->pending_count++] = parent;
    return status;
}

/* Makes the parents of all cells deeper than `level`, which the stream has left. */
static vd_status close_cells(vd_tree *t, int level) {
    while (t->pending_count > 1) {
        const vd_tree_place last = t->pending[t->pending_count - 1].first;
        const int common = vd_tree_common(t->pending[t->pending_count - 2].first, last);
        if (common <= level) {
            break;
        }
        uint32_t count = 2;
        while (count < t->pending_count &&
               vd_tree_common(t->pending[t->pending_count - count - 1].first, last) >= common) {
            count++;
        }
        vd_status status = make_parent(t, count, common);
        if (status.code != VD_OK) {
            return status;
        }
    }
    return vd_success();
}

/* ---- leaves -------------------------------------------------------------------------------------
 */

static void note_spacing(vd_tree *t, const uint8_t *a, const uint8_t *b) {
    uint32_t p[3], q[3];
    memcpy(p, a, sizeof p);
    memcpy(q, b, sizeof q);
    double sum = 0.0;
    for (int k = 0; k < 3; k++) {
        const double d = (double)p[k] - (double)q[k];
        sum += d * d;
    }
    uint64_t bits;
    memcpy(&bits, &sum, sizeof bits);
    t->spacing[bits >> 48 & (SPACING_BUCKETS - 1)]++;
}

static double median_spacing(const vd_tree *t) {
    uint64_t total = 0, sum = 0;
    for (int i = 1; i < SPACING_BUCKETS; i++) {
        total += t->spacing[i];
    }
    for (int i = 1; i < SPACING_BUCKETS; i++) { /* 0: at the same point */
        sum += t->spacing[i];
        if (2 * sum > total) {
            const uint64_t bits = (uint64_t)i << 48 | (uint64_t)1 << 47;
            double squared;
            memcpy(&squared, &bits, sizeof squared);
            return __builtin_sqrt(squared) * (t->input->cube_size / 4294967296.0);
        }
    }
    return 0.0;
}

static void measure_leaf(vd_tree *t, vd_tree_pending *leaf) {
    for (uint32_t i = 0; i < leaf->count; i++) {
        uint32_t q[3];
        memcpy(q, leaf->records + i * t->record_bytes, sizeof q);
        for (int k = 0; k < 3; k++) {
            leaf->min[k] = i == 0 || q[k] < leaf->min[k] ? q[k] : leaf->min[k];
            leaf->max[k] = i == 0 || q[k] > leaf->max[k] ? q[k] : leaf->max[k];
        }
        if (i > 0) {
            note_spacing(t, leaf->records + (i - 1) * t->record_bytes,
                         leaf->records + i * t->record_bytes);
        }
    }
}

/* Makes the leaf that begins at `begin`. */
static vd_status make_leaf(vd_tree *t) {
    const vd_tree_place *places = t->places + t->begin;
    const size_t have = t->end - t->begin;
    int level = 0;
    vd_status status = vd_success();
    if (t->any_leaf) {
        level = vd_tree_common(t->last, places[0]) + 1;
        status = close_cells(t, level - 1);
    }
    if (have > t->leaf_particles) {
        const int deeper = vd_tree_common(places[0], places[t->leaf_particles]) + 1;
        level = deeper > level ? deeper : level;
    }
    size_t count = 1, beyond = have < t->leaf_particles + 1u ? have : t->leaf_particles + 1u;
    while (beyond - count > 0) { /* all before `count` are in the cell, none from `beyond` on */
        const size_t middle = count + (beyond - count) / 2;
        if (vd_tree_common(places[0], places[middle]) >= level) {
            count = middle + 1;
        } else {
            beyond = middle;
        }
    }
    vd_tree_pending leaf = {.first = places[0], .count = (uint32_t)count, .leaves = count};
    leaf.records = vd_allocate(t->context, count, t->record_bytes);
    if (leaf.records == NULL || t->pending_count == t->pending_room) {
        vd_release(t->context, leaf.records);
        return vd_out_of_memory("a brick", count * t->record_bytes);
    }
    memcpy(leaf.records, t->records + t->begin * t->record_bytes, count * t->record_bytes);
    t->pending[t->pending_count++] = leaf;
    vd_tree_pending *kept = &t->pending[t->pending_count - 1];
    measure_leaf(t, kept);
    t->last = places[count - 1];
    t->any_leaf = true;
    t->begin += count;
    return status.code == VD_OK ? write_node(t, kept, level) : status;
}

vd_status vd_tree_add(vd_tree *t, uint64_t key, const uint8_t *record) {
    vd_status status = vd_success();
    if (t->end == t->room) {
        while (t->end - t->begin > t->leaf_particles && status.code == VD_OK) {
            status = make_leaf(t);
        }
        if (status.code != VD_OK) {
            return status;
        }
        const size_t left = t->end - t->begin;
        memmove(t->places, t->places + t->begin, left * sizeof *t->places);
        memmove(t->records, t->records + t->begin * t->record_bytes, left * t->record_bytes);
        t->begin = 0;
        t->end = left;
    }
    vd_tree_place place = {key, 0};
    if (t->any && t->newest.key == key) {
        if (t->newest.number == UINT32_MAX) {
            return vd_failure(VD_ERROR_LIMIT, "more than 2^32 particles are at one point");
        }
        place.number = t->newest.number + 1;
    }
    t->newest = place;
    t->any = true;
    t->places[t->end] = place;
    memcpy(t->records + t->end * t->record_bytes, record, t->record_bytes);
    t->end++;
    return status;
}

/* ---- the directory ------------------------------------------------------------------------------
 */

/* The nodes breadth first: order[i] is the i-th by the order they were made in. */
static vd_bricks_node *order_nodes(vd_tree *t) {
    vd_bricks_node *out = vd_allocate(t->context, t->node_count, sizeof *out);
    uint32_t *order = vd_allocate(t->context, t->node_count, sizeof *order);
    if (out != NULL && order != NULL) {
        uint32_t known = 1;
        order[0] = t->node_count - 1; /* the root was made last */
        for (uint32_t i = 0; i < known; i++) {
            out[i] = t->nodes[order[i]];
            out[i].child_first = out[i].child_count > 0 ? known : 0;
            for (uint32_t c = 0; c < out[i].child_count; c++) {
                order[known++] = t->children[order[i]][c];
            }
        }
    } else {
        vd_release(t->context, out);
        out = NULL;
    }
    vd_release(t->context, order);
    return out;
}

static vd_bricks_head make_head(const vd_tree *t, const char *crs) {
    vd_bricks_head head = {.version = VD_BRICKS_VERSION,
                           .head_bytes = sizeof head,
                           .count = t->input->count,
                           .skipped = t->input->skipped,
                           .stored = t->stored,
                           .directory_offset = t->written,
                           .node_count = t->node_count,
                           .attribute_count = t->attribute_count,
                           .leaf_particles = t->leaf_particles,
                           .spacing = median_spacing(t),
                           .text_bytes = strlen(crs) + 1};
    memcpy(head.magic, VD_BRICKS_MAGIC, sizeof head.magic);
    memcpy(head.min, t->input->min, sizeof head.min);
    memcpy(head.max, t->input->max, sizeof head.max);
    head.file_bytes = t->written + t->attribute_count * sizeof(vd_bricks_attribute) +
                      t->node_count * sizeof(vd_bricks_node) + head.text_bytes;
    return head;
}

static vd_status write_directory(vd_tree *t, const char *crs, vd_bricks_report *report) {
    vd_bricks_node *nodes = order_nodes(t);
    if (nodes == NULL) {
        return vd_out_of_memory("the tree", t->node_count * sizeof *nodes);
    }
    vd_bricks_head head = make_head(t, crs);
    const size_t attribute_bytes = t->attribute_count * sizeof(vd_bricks_attribute);
    const size_t node_bytes = t->node_count * sizeof *nodes;
    XXH64_state_t *sum = XXH64_createState();
    vd_status status = sum != NULL ? vd_success() : vd_out_of_memory("a checksum", 64);
    if (sum != NULL) {
        XXH64_reset(sum, 0);
        XXH64_update(sum, t->attributes, attribute_bytes);
        XXH64_update(sum, nodes, node_bytes);
        XXH64_update(sum, crs, head.text_bytes);
        const uint64_t sums[2] = {XXH64(&head, sizeof head, 0), XXH64_digest(sum)};
        head.checksum = XXH64(sums, sizeof sums, 0);
        XXH64_freeState(sum);
        vd_file_write(&t->file, t->attributes, attribute_bytes);
        vd_file_write(&t->file, nodes, node_bytes);
        vd_file_write(&t->file, crs, head.text_bytes);
        vd_file_write_at(&t->file, 0, &head, sizeof head);
        report->file_bytes = head.file_bytes;
        report->bricks = t->node_count;
    }
    vd_release(t->context, nodes);
    return status;
}

vd_status vd_tree_commit(vd_tree *t, const char *crs, vd_bricks_report *report) {
    vd_status status = vd_success();
    while (t->end > t->begin && status.code == VD_OK) {
        status = make_leaf(t);
    }
    if (status.code == VD_OK) {
        status = close_cells(t, -1);
    }
    if (status.code == VD_OK) {
        status = write_directory(t, crs, report);
    }
    if (status.code == VD_OK) {
        t->open = false;
        status = vd_file_commit(&t->file);
    }
    return status;
}
