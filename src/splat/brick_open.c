/* brick_open.c: brick files opened, checked, looked at. */
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdatomic.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>
#include "core/core.h"
#include "core/real.h"
#include "splat/brick_format.h"

#define LN_2 0.69314718055994530942

struct vd_bricks_map {
    const uint8_t *data;
    size_t mapped_bytes;      /* 0: the caller's memory */
    _Atomic uint8_t *checked; /* [node_count]: 1 when a brick's checksum held */
};

static vd_status damaged(const char *path, const char *what) {
    return vd_failure(
        VD_ERROR_FORMAT,
        "cannot read %.200s: %s, so the file is damaged or cut short; import it again", path, what);
}

/* ---- checks -------------------------------------------------------------------------------------
 */

static vd_status check_head(const char *path, const vd_bricks_head *head, size_t size_bytes) {
    if (size_bytes < sizeof *head || memcmp(head->magic, VD_BRICKS_MAGIC, 8) != 0) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %.200s: it is no brick file; make one with `veduta import "
                          "particles`",
                          path);
    }
    if (head->version != VD_BRICKS_VERSION || head->head_bytes != sizeof *head) {
        return vd_failure(VD_ERROR_UNSUPPORTED,
                          "cannot read %.200s: it is of version %u and this veduta reads %u; "
                          "import it again, or use a newer veduta",
                          path, head->version, VD_BRICKS_VERSION);
    }
    if (head->file_bytes != size_bytes) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %.160s: it should have %llu bytes (%llu particles) and has "
                          "%zu; copy it again, or import it again",
                          path, (unsigned long long)head->file_bytes,
                          (unsigned long long)head->count, size_bytes);
    }
    const uint64_t rest = size_bytes - sizeof *head;
    if (head->node_count == 0 || head->node_count > rest / sizeof(vd_bricks_node) ||
        head->node_count > UINT32_MAX || head->attribute_count > VD_MAX_ATTRIBUTES ||
        head->text_bytes == 0 || head->text_bytes > rest) {
        return damaged(path, "its directory does not fit");
    }
    const uint64_t directory = head->attribute_count * sizeof(vd_bricks_attribute) +
                               head->node_count * sizeof(vd_bricks_node) + head->text_bytes;
    if (directory > rest || head->directory_offset != size_bytes - directory ||
        head->directory_offset % VD_BRICK_ALIGNMENT != 0) {
        return damaged(path, "its directory does not fit");
    }
    return vd_success();
}

static vd_status check_directory_sum(const char *path, const uint8_t *data) {
    vd_bricks_head head;
    memcpy(&head, data, sizeof head);
    const uint64_t expected = head.checksum;
    head.checksum = 0;
    const uint64_t sums[2] = {
        XXH64(&head, sizeof head, 0),
        XXH64(data + head.directory_offset, (size_t)(head.file_bytes - head.directory_offset), 0)};
    return XXH64(sums, sizeof sums, 0) == expected
               ? vd_success()
               : damaged(path, "the checksum of its directory does not hold");
}

static bool box_is_sound(const double min[3], const double max[3]) {
    for (int i = 0; i < 3; i++) {
        if (!isfinite(min[i]) || !isfinite(max[i]) || min[i] > max[i]) {
            return false;
        }
    }
    return true;
}

/* A sum that holds says that the file is as it was written, not that it was well written. */
static bool node_is_sound(const vd_bricks *b, const vd_bricks_head *head, uint32_t i,
                          uint64_t *next_child) {
    const vd_bricks_node *n = &b->nodes[i];
    if (n->count == 0 || n->count > VD_BRICK_MOST || n->leaves < n->count ||
        n->bytes != vd_brick_bytes(b->attributes, b->attribute_count, n->count) ||
        n->offset < sizeof *head || n->offset % VD_BRICK_ALIGNMENT != 0 ||
        n->offset > head->directory_offset || n->bytes > head->directory_offset - n->offset ||
        !box_is_sound(n->min, n->max) || !(n->spread >= 0.0f) || !(n->radius_max >= 0.0f)) {
        return false;
    }
    if (n->child_count == 0) {
        return n->child_first == 0 && n->leaves == n->count;
    }
    /* Children stand one family after the other: so each has one parent, and there is no circle. */
    if (n->child_count > 8 || n->octant > 7 || n->child_first != *next_child ||
        n->child_first <= i || n->child_count > b->node_count - *next_child) {
        return false;
    }
    uint64_t leaves = 0;
    for (uint32_t c = 0; c < n->child_count; c++) {
        leaves += b->nodes[n->child_first + c].leaves;
    }
    *next_child += n->child_count;
    return leaves == n->leaves;
}

static vd_status check_tree(const vd_bricks *b, const vd_bricks_head *head) {
    for (uint32_t a = 0; a < b->attribute_count; a++) {
        const vd_bricks_attribute *t = &b->attributes[a];
        if (memchr(t->name, '\0', sizeof t->name) == NULL || t->name[0] == '\0' ||
            t->kind >= VD_ATTRIBUTE_KIND_COUNT || t->storage >= VD_BRICK_STORAGE_COUNT ||
            !isfinite(t->min) || !isfinite(t->max)) {
            return damaged(b->path, "an attribute is not described well");
        }
    }
    uint64_t next_child = 1;
    for (uint32_t i = 0; i < b->node_count; i++) {
        if (next_child > b->node_count || (i > 0 && i >= next_child) ||
            !node_is_sound(b, head, i, &next_child)) {
            return damaged(b->path, "its tree does not hold together");
        }
    }
    if (next_child != b->node_count || b->nodes[0].leaves != b->count ||
        !box_is_sound(b->min, b->max) || !isfinite(b->spacing) || b->spacing < 0.0 ||
        b->crs[head->text_bytes - 1] != '\0') {
        return damaged(b->path, "its tree does not hold together");
    }
    return vd_success();
}

/* ---- opening ------------------------------------------------------------------------------------
 */

static void describe(vd_bricks *b, const vd_bricks_head *head, const uint8_t *data) {
    b->count = head->count;
    b->skipped = head->skipped;
    b->stored = head->stored;
    b->file_bytes = head->file_bytes;
    memcpy(b->min, head->min, sizeof b->min);
    memcpy(b->max, head->max, sizeof b->max);
    b->spacing = head->spacing;
    b->node_count = (uint32_t)head->node_count;
    b->attribute_count = head->attribute_count;
    b->attributes = (const vd_bricks_attribute *)(data + head->directory_offset);
    b->nodes = (const vd_bricks_node *)(b->attributes + b->attribute_count);
    b->crs = (const char *)(b->nodes + b->node_count);
}

static vd_status open_data(vd_context *context, const uint8_t *data, size_t size_bytes,
                           size_t mapped_bytes, const char *path, vd_bricks **out) {
    const vd_bricks_head *head = (const vd_bricks_head *)data;
    vd_status status = check_head(path, head, size_bytes);
    if (status.code == VD_OK) {
        status = check_directory_sum(path, data);
    }
    if (status.code != VD_OK) {
        return status;
    }
    vd_bricks *b = vd_allocate_zero(context, 1, sizeof *b);
    struct vd_bricks_map *p = vd_allocate_zero(context, 1, sizeof *p);
    char *copy = vd_copy_string(context, path);
    uint8_t *checked = vd_allocate_zero(context, (size_t)head->node_count, 1);
    if (b == NULL || p == NULL || copy == NULL || checked == NULL) {
        vd_release(context, b);
        vd_release(context, p);
        vd_release(context, copy);
        vd_release(context, checked);
        return vd_out_of_memory(path, (size_t)head->node_count);
    }
    b->context = context;
    b->path = copy;
    b->map = p;
    p->data = data;
    p->checked = (_Atomic uint8_t *)checked;
    describe(b, head, data);
    status = check_tree(b, head);
    if (status.code != VD_OK) {
        vd_bricks_close(&b); /* mapped_bytes is 0 yet: the mapping stays the caller's */
        return status;
    }
    p->mapped_bytes = mapped_bytes;
    *out = b;
    return vd_success();
}

vd_status vd_bricks_open_memory(vd_context *context, const void *data, size_t size_bytes,
                                const char *name, vd_bricks **out) {
    return open_data(context, data, size_bytes, 0, name, out);
}

vd_status vd_bricks_open(vd_context *context, const char *path, vd_bricks **out) {
    const int descriptor = open(path, O_RDONLY | O_CLOEXEC);
    struct stat info;
    if (descriptor < 0 || fstat(descriptor, &info) != 0) {
        const int error = errno;
        if (descriptor >= 0) {
            close(descriptor);
        }
        return vd_failure(VD_ERROR_IO, "cannot read %.250s: %s; check the path", path,
                          strerror(error));
    }
    if (!S_ISREG(info.st_mode) || info.st_size < (off_t)sizeof(vd_bricks_head)) {
        close(descriptor);
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %.200s: it is too short for a brick file, or none; make one "
                          "with `veduta import particles`",
                          path);
    }
    const size_t bytes = (size_t)info.st_size;
    void *data = mmap(NULL, bytes, PROT_READ, MAP_SHARED, descriptor, 0);
    close(descriptor);
    if (data == MAP_FAILED) {
        return vd_failure(VD_ERROR_MEMORY, "cannot map %.200s: %s; it takes %zu bytes of addresses",
                          path, strerror(errno), bytes);
    }
    vd_status status = open_data(context, data, bytes, bytes, path, out);
    if (status.code != VD_OK) {
        munmap(data, bytes);
    }
    return status;
}

void vd_bricks_close(vd_bricks **bricks) {
    if (bricks == NULL || *bricks == NULL) {
        return;
    }
    vd_bricks *b = *bricks;
    struct vd_bricks_map *p = b->map;
    if (p->mapped_bytes > 0) {
        munmap((void *)(uintptr_t)p->data, p->mapped_bytes);
    }
    vd_release(b->context, (void *)(uintptr_t)p->checked);
    vd_release(b->context, p);
    vd_release(b->context, b->path);
    vd_release(b->context, b);
    *bricks = NULL;
}

/* ---- bricks -------------------------------------------------------------------------------------
 */

int vd_bricks_find(const vd_bricks *bricks, const char *name) {
    for (uint32_t a = 0; a < bricks->attribute_count; a++) {
        if (strcmp(bricks->attributes[a].name, name) == 0) {
            return (int)a;
        }
    }
    return -1;
}

vd_status vd_bricks_brick(const vd_bricks *bricks, uint32_t node, vd_brick *out) {
    const vd_bricks_node *n = &bricks->nodes[node];
    struct vd_bricks_map *p = bricks->map;
    const uint8_t *at = p->data + n->offset;
    if (atomic_load_explicit(&p->checked[node], memory_order_relaxed) == 0) {
        if (XXH64(at, n->bytes, 0) != n->checksum) {
            return damaged(bricks->path, "the checksum of a brick does not hold");
        }
        atomic_store_explicit(&p->checked[node], 1, memory_order_relaxed);
    }
    out->count = n->count;
    for (int i = 0; i < 3; i++) {
        out->origin[i] = n->min[i];
        out->step[i] = (n->max[i] - n->min[i]) * (1.0 / 65535.0);
    }
    const uint8_t *ranges = at;
    at += vd_brick_pad(8 * (size_t)bricks->attribute_count);
    const uint16_t **axes[3] = {&out->x, &out->y, &out->z};
    for (int i = 0; i < 3; i++) {
        *axes[i] = (const uint16_t *)at;
        at += vd_brick_pad(2 * (size_t)n->count);
    }
    for (uint32_t a = 0; a < bricks->attribute_count; a++) {
        const uint32_t storage = bricks->attributes[a].storage;
        float range[2] = {0.0f, 1.0f};
        if (storage >= VD_BRICK_LINEAR) {
            memcpy(range, ranges + 8 * a, sizeof range);
        }
        out->low[a] = range[0];
        out->value_step[a] = range[1];
        out->values[a] = at;
        at += vd_brick_pad(n->count * vd_brick_value_bytes(storage));
    }
    return vd_success();
}

void vd_bricks_values(const vd_bricks *bricks, const vd_brick *brick, int attribute, float *out) {
    const uint32_t storage = bricks->attributes[attribute].storage;
    const float low = brick->low[attribute], step = brick->value_step[attribute];
    const uint8_t *u8 = brick->values[attribute];
    const uint16_t *u16 = brick->values[attribute];
    for (uint32_t i = 0; i < brick->count; i++) {
        out[i] = storage == VD_BRICK_U8 ? (float)u8[i] : low + step * (float)u16[i];
    }
    if (storage == VD_BRICK_LOG) {
        for (uint32_t i = 0; i < brick->count; i++) {
            out[i] = (float)vd_exp(LN_2 * (double)out[i]);
        }
    }
}

typedef struct verification {
    const vd_bricks *bricks;
    atomic_bool failed;
} verification;

static void verify_some(void *user, int index, int worker) {
    (void)worker;
    verification *v = user;
    for (uint64_t i = (uint64_t)index * 64; i < (uint64_t)(index + 1) * 64; i++) {
        vd_brick brick;
        if (i < v->bricks->node_count &&
            vd_bricks_brick(v->bricks, (uint32_t)i, &brick).code != VD_OK) {
            atomic_store(&v->failed, true);
        }
    }
}

vd_status vd_bricks_verify(const vd_bricks *bricks, vd_job *job) {
    verification v = {bricks, false};
    vd_status status = vd_parallel_for(bricks->context, job, (int)((bricks->node_count + 63) / 64),
                                       verify_some, &v);
    return status.code == VD_OK && atomic_load(&v.failed)
               ? damaged(bricks->path, "the checksum of a brick does not hold")
               : status;
}
