/* brick_sort.c: sorted runs in a work file, and their merge.
 *
 * A round reads as many particles as the memory holds; its pieces, one a thread, are made records,
 * sorted by key (radix, least digit first, 8 bits a pass, passes without effect left out) and
 * written at their places. The merge is a tournament of the runs (Knuth, vol. 3, §5.4.1: a tree of
 * losers), about log₂ of their number of comparisons a record.
 *
 * Resuming: after a round the state file says what the work file holds, replaced by a rename; an
 * import of the same sources takes the work file over and reads past what is sorted. */
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>
#include "core/core.h"
#include "splat/brick_import.h"

#define PIECE_MOST ((size_t)2 << 20)
#define PIECE_LEAST ((size_t)16 << 10)
#define STATE_MAGIC UINT64_C(0x31545350424456) /* "VDBPST1" */

static vd_status io_failure(const char *path, int error) {
    return vd_failure(VD_ERROR_IO, "cannot use the work file %.200s: %s; %s", path, strerror(error),
                      error == ENOSPC ? "free some space" : "check the folder");
}

static vd_status write_all(const vd_import_runs *r, const uint8_t *data, size_t bytes,
                           uint64_t offset) {
    while (bytes > 0) {
        const ssize_t done = pwrite(r->descriptor, data, bytes, (off_t)offset);
        if (done < 0 && errno != EINTR) {
            return io_failure(r->path, errno);
        }
        if (done > 0) {
            data += done;
            bytes -= (size_t)done;
            offset += (uint64_t)done;
        }
    }
    return vd_success();
}

static vd_status read_all(const vd_import_runs *r, uint8_t *data, size_t bytes, uint64_t offset) {
    while (bytes > 0) {
        const ssize_t done = pread(r->descriptor, data, bytes, (off_t)offset);
        if (done == 0 || (done < 0 && errno != EINTR)) {
            return io_failure(r->path, done == 0 ? EIO : errno);
        }
        if (done > 0) {
            data += done;
            bytes -= (size_t)done;
            offset += (uint64_t)done;
        }
    }
    return vd_success();
}

static vd_status add_run(vd_import_runs *r, uint64_t begin, uint64_t count) {
    if (r->run_count == r->run_capacity) {
        const uint32_t larger = r->run_capacity * 2 + 64;
        vd_import_run *grown = vd_allocate(r->context, larger, sizeof *grown);
        if (grown == NULL) {
            return vd_out_of_memory("sorted runs", larger * sizeof *grown);
        }
        if (r->run_count > 0) {
            memcpy(grown, r->runs, r->run_count * sizeof *grown);
        }
        vd_release(r->context, r->runs);
        r->runs = grown;
        r->run_capacity = larger;
    }
    r->runs[r->run_count++] = (vd_import_run){begin, count};
    return vd_success();
}

/* ---- resuming -----------------------------------------------------------------------------------
 */

/* What sources are, as far as an interrupted import must find them unchanged. */
static uint64_t find_fingerprint(const vd_import_input *input) {
    XXH64_hash_t sum = XXH64(&input->count, sizeof input->count, 0);
    sum = XXH64(&input->skipped, sizeof input->skipped, sum);
    sum = XXH64(input->min, sizeof input->min, sum);
    sum = XXH64(input->max, sizeof input->max, sum);
    for (int a = 0; a < input->attribute_count; a++) {
        const vd_import_range *r = &input->ranges[a];
        const double numbers[3] = {r->min, r->max, r->sum};
        sum = XXH64(input->attributes[a].name, strlen(input->attributes[a].name), sum);
        sum = XXH64(numbers, sizeof numbers, sum);
    }
    return sum;
}

typedef struct state_head {
    uint64_t magic, fingerprint, consumed, records, run_count, sum;
} state_head;

/* Failing to write it only costs the chance to resume. */
static void save_state(const vd_import_runs *r) {
    state_head head = {STATE_MAGIC,  r->fingerprint,
                       r->consumed,  r->records,
                       r->run_count, XXH64(r->runs, r->run_count * sizeof *r->runs, 0)};
    vd_file file;
    if (vd_file_create(r->context, r->state_path, &file).code == VD_OK) {
        vd_file_write(&file, &head, sizeof head);
        vd_file_write(&file, r->runs, r->run_count * sizeof *r->runs);
        vd_status status = vd_file_commit(&file);
        if (status.code != VD_OK) {
            vd_log(r->context, VD_LOG_WARNING, "%s", status.message);
        }
    }
}

static void load_state(vd_import_runs *r) {
    void *data = NULL;
    size_t bytes = 0;
    struct stat info;
    if (access(r->state_path, R_OK) != 0 || fstat(r->descriptor, &info) != 0 ||
        vd_file_read(r->context, r->state_path, (size_t)64 << 20, &data, &bytes).code != VD_OK) {
        return;
    }
    const state_head *head = data;
    const vd_import_run *runs = (const vd_import_run *)(head + 1);
    if (bytes >= sizeof *head && head->magic == STATE_MAGIC &&
        head->fingerprint == r->fingerprint &&
        head->run_count == (bytes - sizeof *head) / sizeof *runs &&
        head->sum == XXH64(runs, bytes - sizeof *head, 0) &&
        (uint64_t)info.st_size >= head->records * r->record_bytes) {
        bool kept = true;
        for (uint64_t i = 0; i < head->run_count && kept; i++) {
            kept = add_run(r, runs[i].begin, runs[i].count).code == VD_OK;
        }
        if (kept) {
            r->consumed = head->consumed;
            r->records = head->records;
        } else {
            r->run_count = 0;
        }
    } else {
        vd_log(r->context, VD_LOG_INFO, "%.200s is of another import or damaged; it is begun again",
               r->path);
    }
    vd_release(r->context, data);
}

vd_status vd_import_runs_open(vd_context *context, const char *out_path, bool resume,
                              const vd_import_input *input, vd_import_runs *out) {
    const size_t length = strlen(out_path) + 16;
    *out = (vd_import_runs){.context = context,
                            .descriptor = -1,
                            .record_bytes = vd_record_bytes(input->attribute_count),
                            .fingerprint = find_fingerprint(input),
                            .path = vd_allocate(context, length, 1),
                            .state_path = vd_allocate(context, length, 1)};
    if (out->path == NULL || out->state_path == NULL) {
        return vd_out_of_memory(out_path, length);
    }
    snprintf(out->path, length, "%s.part", out_path);
    snprintf(out->state_path, length, "%s.part.state", out_path);
    out->descriptor = open(out->path, O_RDWR | O_CREAT | O_CLOEXEC | (resume ? 0 : O_TRUNC), 0666);
    if (out->descriptor < 0) {
        return io_failure(out->path, errno);
    }
    if (resume) {
        load_state(out);
    }
    return vd_success();
}

void vd_import_runs_close(vd_import_runs *runs, bool keep) {
    if (runs->descriptor >= 0) {
        close(runs->descriptor);
        if (!keep) {
            unlink(runs->path);
            unlink(runs->state_path);
        }
    }
    vd_release(runs->context, runs->path);
    vd_release(runs->context, runs->state_path);
    vd_release(runs->context, runs->runs);
    memset(runs, 0, sizeof *runs);
    runs->descriptor = -1;
}

/* ---- sorting ------------------------------------------------------------------------------------
 */

typedef struct sort_item {
    uint64_t key;
    uint32_t index;
} sort_item;

typedef struct sort_piece {
    sort_item *items, *spare; /* [piece] each */
    uint8_t *records;         /* [piece][record_bytes] */
    vd_status status;
} sort_piece;

typedef struct round_work {
    const vd_import_runs *runs;
    const vd_import_input *input;
    const vd_particle_batch *batch;
    size_t piece; /* particles */
    sort_piece *pieces;
} round_work;

/* Sorts stably by key; returns which of the two arrays holds the result. */
static sort_item *sort_items(sort_item *items, sort_item *spare, size_t count) {
    static const int passes = 8;
    size_t counts[8][256];
    memset(counts, 0, sizeof counts);
    for (size_t i = 0; i < count; i++) {
        for (int p = 0; p < passes; p++) {
            counts[p][items[i].key >> (8 * p) & 255]++;
        }
    }
    for (int p = 0; p < passes; p++) {
        size_t *c = counts[p];
        if (count == 0 || c[items[0].key >> (8 * p) & 255] == count) {
            continue;
        }
        size_t sum = 0;
        for (int d = 0; d < 256; d++) {
            const size_t n = c[d];
            c[d] = sum;
            sum += n;
        }
        for (size_t i = 0; i < count; i++) {
            spare[c[items[i].key >> (8 * p) & 255]++] = items[i];
        }
        sort_item *swap = items;
        items = spare;
        spare = swap;
    }
    return items;
}

static void sort_task(void *user, int index, int worker) {
    (void)worker;
    const round_work *w = user;
    sort_piece *piece = &w->pieces[index];
    const vd_particle_batch *b = w->batch;
    const vd_import_input *input = w->input;
    const size_t from = (size_t)index * w->piece;
    const size_t left = b->count > from ? b->count - from : 0;
    const size_t count = left < w->piece ? left : w->piece;
    const double per_metre = 4294967296.0 / input->cube_size;
    const double *const axes[3] = {b->x + from, b->y + from, b->z + from};
    for (size_t i = 0; i < count; i++) {
        uint32_t q[3];
        for (int k = 0; k < 3; k++) {
            q[k] = vd_cube_coordinate(axes[k][i], input->min[k], per_metre);
        }
        piece->items[i] = (sort_item){vd_record_key(q), (uint32_t)i};
    }
    const sort_item *sorted = sort_items(piece->items, piece->spare, count);
    uint8_t *at = piece->records;
    for (size_t i = 0; i < count; i++) {
        const size_t from_index = sorted[i].index;
        uint32_t q[3];
        for (int k = 0; k < 3; k++) {
            q[k] = vd_cube_coordinate(axes[k][from_index], input->min[k], per_metre);
        }
        memcpy(at, q, sizeof q);
        at += sizeof q;
        for (int a = 0; a < input->attribute_count; a++) {
            float v = b->values[a][from + from_index];
            v = isfinite(v) ? v : (float)input->ranges[a].min;
            memcpy(at, &v, sizeof v);
            at += sizeof v;
        }
    }
    piece->status = write_all(w->runs, piece->records, count * w->runs->record_bytes,
                              (w->runs->records + from) * w->runs->record_bytes);
}

/* Drops particles with a position that is not finite. */
static void compact(vd_particle_batch *b, int attribute_count) {
    size_t to = 0;
    for (size_t i = 0; i < b->count; i++) {
        if (!(b->x[i] - b->x[i] + (b->y[i] - b->y[i]) + (b->z[i] - b->z[i]) == 0.0)) {
            continue;
        }
        if (to != i) {
            b->x[to] = b->x[i];
            b->y[to] = b->y[i];
            b->z[to] = b->z[i];
            for (int a = 0; a < attribute_count; a++) {
                b->values[a][to] = b->values[a][i];
            }
        }
        to++;
    }
    b->count = to;
}

static vd_status sort_round(vd_import_runs *runs, round_work *w, int pieces, uint64_t read) {
    vd_status status = vd_parallel_for(runs->context, NULL, pieces, sort_task, w);
    for (int p = 0; p < pieces && status.code == VD_OK; p++) {
        const uint64_t from = (uint64_t)p * w->piece;
        const uint64_t left = w->batch->count > from ? w->batch->count - from : 0;
        status = w->pieces[p].status;
        if (status.code == VD_OK && left > 0) {
            status = add_run(runs, runs->records + from, left < w->piece ? left : w->piece);
        }
    }
    if (status.code == VD_OK) {
        runs->records += w->batch->count;
        runs->consumed += read;
    }
    return status;
}

/* Reads past what an interrupted import has sorted. */
static vd_status skip_consumed(vd_import_runs *runs, vd_import_reader *reader) {
    const size_t capacity = reader->batch.capacity;
    uint64_t left = runs->consumed;
    vd_status status = vd_success();
    while (left > 0 && status.code == VD_OK) {
        reader->batch.capacity = left < capacity ? (size_t)left : capacity;
        status = vd_import_reader_next(reader);
        left -= reader->batch.count;
        if (status.code == VD_OK && reader->batch.count == 0) {
            status = vd_failure(VD_ERROR_FORMAT, "%.200s does not fit its sources; remove it",
                                runs->path);
        }
    }
    reader->batch.capacity = capacity;
    return status;
}

static vd_status sort_rounds(vd_import_runs *runs, round_work *w, vd_import_reader *reader,
                             bool resume, const vd_import_progress *progress) {
    vd_status status = vd_import_reader_rewind(reader);
    const int attributes = w->input->attribute_count;
    if (status.code == VD_OK) {
        status = skip_consumed(runs, reader);
    }
    while (status.code == VD_OK) {
        status = vd_import_reader_next(reader);
        const uint64_t read = reader->batch.count;
        if (status.code != VD_OK || read == 0) {
            break;
        }
        compact(&reader->batch, attributes);
        const int pieces = (int)((reader->batch.count + w->piece - 1) / w->piece);
        status = sort_round(runs, w, pieces, read);
        if (status.code == VD_OK && resume) {
            save_state(runs);
        }
        vd_import_report(progress, (double)runs->records / (double)w->input->count);
        if (status.code == VD_OK && vd_job_stopped(progress->job)) {
            status = vd_failure(VD_ERROR_CANCELLED, "importing was cancelled");
        }
    }
    if (status.code == VD_OK && runs->records != w->input->count) {
        status = vd_failure(VD_ERROR_IO,
                            "%.200s changed while it was read: %llu particles, then %llu; import "
                            "it again",
                            w->input->sources[0]->path, (unsigned long long)w->input->count,
                            (unsigned long long)runs->records);
    }
    return status;
}

vd_status vd_import_sort(vd_import_runs *runs, const vd_import_input *input, size_t memory_bytes,
                         bool resume, const vd_import_progress *progress) {
    const size_t threads = (size_t)vd_context_threads(runs->context);
    const size_t bytes_each =
        24 + 4 * ((size_t)input->attribute_count + 1) + 2 * sizeof(sort_item) + runs->record_bytes;
    size_t pieces = threads < 16 ? threads : 16;
    size_t piece = memory_bytes / (bytes_each * pieces);
    piece = piece < PIECE_MOST ? piece : PIECE_MOST;
    piece = piece > PIECE_LEAST ? piece : PIECE_LEAST;
    if (piece * pieces > input->count) {
        piece = (size_t)(input->count / pieces) + 1;
    }
    vd_import_input *own = (vd_import_input *)(uintptr_t)input;
    vd_import_reader reader;
    vd_status status = vd_import_reader_init(runs->context, own, piece * pieces, &reader);
    sort_piece *work = vd_allocate_zero(runs->context, pieces, sizeof *work);
    for (size_t p = 0; p < pieces && work != NULL && status.code == VD_OK; p++) {
        work[p].items = vd_allocate(runs->context, piece, sizeof(sort_item));
        work[p].spare = vd_allocate(runs->context, piece, sizeof(sort_item));
        work[p].records = vd_allocate(runs->context, piece, runs->record_bytes);
        if (work[p].items == NULL || work[p].spare == NULL || work[p].records == NULL) {
            status = vd_out_of_memory("sorting", piece * bytes_each);
        }
    }
    if (status.code == VD_OK && work == NULL) {
        status = vd_out_of_memory("sorting", pieces * sizeof *work);
    }
    if (status.code == VD_OK) {
        round_work w = {runs, input, &reader.batch, piece, work};
        status = sort_rounds(runs, &w, &reader, resume, progress);
    }
    for (size_t p = 0; p < pieces && work != NULL; p++) {
        vd_release(runs->context, work[p].items);
        vd_release(runs->context, work[p].spare);
        vd_release(runs->context, work[p].records);
    }
    vd_release(runs->context, work);
    vd_import_reader_finish(runs->context, &reader);
    return status;
}

/* ---- merging ------------------------------------------------------------------------------------
 */

typedef struct cursor {
    uint64_t next, left; /* in the file, not in the buffer yet */
    uint8_t *buffer;
    uint64_t *keys;
    size_t at, filled; /* records in the buffer */
} cursor;

typedef struct merge {
    const vd_import_runs *runs;
    cursor *cursors;
    uint32_t count;   /* cursors, a power of two: those beyond the runs are empty */
    size_t capacity;  /* records in a buffer */
    uint32_t *losers; /* [count]; 0 is the winner */
    void *memory;
} merge;

static vd_status refill(merge *m, cursor *c) {
    const size_t bytes = m->runs->record_bytes;
    const size_t n = c->left < m->capacity ? (size_t)c->left : m->capacity;
    vd_status status = read_all(m->runs, c->buffer, n * bytes, c->next * bytes);
    for (size_t i = 0; i < n && status.code == VD_OK; i++) {
        uint32_t q[3];
        memcpy(q, c->buffer + i * bytes, sizeof q);
        c->keys[i] = vd_record_key(q);
    }
    c->next += n;
    c->left -= n;
    c->at = 0;
    c->filled = n;
    return status;
}

/* Keys have 63 bits: an ended run comes after all others. */
static uint64_t head_key(const merge *m, uint32_t run) {
    const cursor *c = &m->cursors[run];
    return c->at < c->filled ? c->keys[c->at] : UINT64_MAX;
}

static bool beats(const merge *m, uint32_t a, uint32_t b) {
    const uint64_t ka = head_key(m, a), kb = head_key(m, b);
    return ka < kb || (ka == kb && a < b);
}

static uint32_t play_all(merge *m, uint32_t node) {
    if (node >= m->count) {
        return node - m->count;
    }
    const uint32_t a = play_all(m, 2 * node), b = play_all(m, 2 * node + 1);
    const bool first = beats(m, a, b);
    m->losers[node] = first ? b : a;
    return first ? a : b;
}

static void replay(merge *m, uint32_t run) {
    for (uint32_t node = (run + m->count) / 2; node > 0; node /= 2) {
        if (beats(m, m->losers[node], run)) {
            const uint32_t swap = m->losers[node];
            m->losers[node] = run;
            run = swap;
        }
    }
    m->losers[0] = run;
}

static vd_status merge_init(merge *m, size_t memory_bytes) {
    vd_context *context = m->runs->context;
    const uint32_t runs = m->runs->run_count;
    m->count = 1;
    while (m->count < runs) {
        m->count *= 2;
    }
    const size_t each = m->runs->record_bytes + sizeof(uint64_t);
    m->capacity = memory_bytes / (each * runs);
    m->capacity = m->capacity < 65536 ? m->capacity : 65536;
    m->capacity = m->capacity > 512 ? m->capacity : 512;
    m->cursors = vd_allocate_zero(context, m->count, sizeof *m->cursors);
    m->losers = vd_allocate_zero(context, m->count, sizeof *m->losers);
    m->memory = vd_allocate(context, runs * m->capacity, each);
    if (m->cursors == NULL || m->losers == NULL || m->memory == NULL) {
        return vd_out_of_memory("merging", runs * m->capacity * each);
    }
    vd_status status = vd_success();
    for (uint32_t i = 0; i < runs && status.code == VD_OK; i++) {
        cursor *c = &m->cursors[i];
        c->next = m->runs->runs[i].begin;
        c->left = m->runs->runs[i].count;
        c->keys = (uint64_t *)m->memory + i * m->capacity;
        c->buffer = (uint8_t *)((uint64_t *)m->memory + runs * m->capacity) +
                    i * m->capacity * m->runs->record_bytes;
        status = refill(m, c);
    }
    m->losers[0] = status.code == VD_OK ? play_all(m, 1) : 0;
    return status;
}

static vd_status merge_all(merge *m, vd_record_function *take, void *user,
                           const vd_import_progress *progress) {
    const uint64_t total = m->runs->records;
    for (uint64_t i = 0; i < total; i++) {
        const uint32_t run = m->losers[0];
        cursor *c = &m->cursors[run];
        vd_status status = take(user, c->keys[c->at], c->buffer + c->at * m->runs->record_bytes);
        if (status.code == VD_OK && ++c->at == c->filled && c->left > 0) {
            status = refill(m, c);
        }
        if (status.code != VD_OK) {
            return status;
        }
        replay(m, run);
        if (i % 65536 == 0) {
            vd_import_report(progress, (double)i / (double)total);
            if (vd_job_stopped(progress->job)) {
                return vd_failure(VD_ERROR_CANCELLED, "importing was cancelled");
            }
        }
    }
    return vd_success();
}

vd_status vd_import_merge(vd_import_runs *runs, size_t memory_bytes, vd_record_function *take,
                          void *user, const vd_import_progress *progress) {
    merge m = {.runs = runs};
    vd_status status = merge_init(&m, memory_bytes);
    if (status.code == VD_OK) {
        status = merge_all(&m, take, user, progress);
    }
    vd_release(runs->context, m.cursors);
    vd_release(runs->context, m.losers);
    vd_release(runs->context, m.memory);
    return status;
}
