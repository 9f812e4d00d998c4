/* peaks.c: topographic prominence by flooding from the top.
 *
 * The samples are visited from the highest to the lowest, as if the sea fell. Each either rises as
 * an island of its own (a peak), joins the island beside it, or joins several: then it is the pass
 * between them, and of every one but the highest its prominence is known. Islands are sets in a
 * forest of parents whose root is the island's peak (union-find; Tarjan 1975); of two, the root
 * that came first stays root, and halving of paths alone keeps finding short.
 *
 * Sorting is most of the memory: two arrays of indices, by three rounds of 11 bits of the height's
 * key (least significant digits first, which keeps equal heights in the order of their indices).
 * The second array then holds the forest. Keys beside the indices would read in order, but take 16
 * bytes a sample where this takes 8.
 */
#include <math.h>
#include <string.h>
#include <veduta/peaks.h>
#include "core/core.h"
#include "terrain/heightfield_block.h"

#define DIGIT_BITS 11
#define DIGITS 3
#define BUCKETS (1 << DIGIT_BITS)
#define NOBODY UINT32_MAX /* the parent of a sample that is still under water */
#define POLL (1u << 16)   /* samples between two looks at the job */

typedef struct candidate {
    double prominence;
    uint32_t sample;
} candidate;

typedef struct flood {
    const vd_heightfield *map;
    vd_job *job;
    uint32_t *order;      /* [land]: samples, the highest first */
    uint32_t *parent;     /* [samples]; while sorting the other half */
    uint32_t land;        /* samples that are not holes */
    candidate *best;      /* [room]: a heap, the least of them on top */
    int room, candidates; /* of it used */
} flood;

static float height_of(const flood *f, uint32_t sample) {
    const uint32_t width = (uint32_t)f->map->width;
    return vd_heightfield_at(f->map, (int)(sample % width), (int)(sample / width));
}

/* Whether the first peak comes before the second in the result. */
static bool stands_out_more(candidate a, candidate b) {
    return a.prominence != b.prominence ? a.prominence > b.prominence : a.sample < b.sample;
}

/* ---- sorting --------------------------------------------------------------------------------- */

/* A key that grows as the height falls; 0 and −0 have one. */
static uint32_t key_of(float height) {
    const float plain = height + 0.0f;
    uint32_t bits;
    memcpy(&bits, &plain, sizeof bits);
    return bits >> 31 ? bits : ~bits & 0x7FFFFFFFu;
}

static uint32_t digit_of(uint32_t key, int digit) {
    return key >> (digit * DIGIT_BITS) & (BUCKETS - 1);
}

static vd_status stopped(void) {
    return vd_failure(VD_ERROR_CANCELLED, "the job was cancelled or ran out of time");
}

/* Lists the samples that are not holes in `order`, and counts the digits of their keys. False once
 * the job stops. */
static bool list_land(flood *f, uint32_t counts[DIGITS][BUCKETS]) {
    uint32_t sample = 0;
    for (int row = 0; row < f->map->height; row++) {
        if (vd_job_stopped(f->job)) {
            return false;
        }
        for (int column = 0; column < f->map->width; column++, sample++) {
            const float height = vd_heightfield_at(f->map, column, row);
            if (!(height > -INFINITY)) {
                continue;
            }
            const uint32_t key = key_of(height);
            for (int digit = 0; digit < DIGITS; digit++) {
                counts[digit][digit_of(key, digit)]++;
            }
            f->order[f->land++] = sample;
        }
    }
    return true;
}

/* One round: from `order` into `parent`, which then change places. */
static bool sort_by_digit(flood *f, int digit, uint32_t counts[BUCKETS]) {
    uint32_t at = 0;
    for (int i = 0; i < BUCKETS; i++) {
        const uint32_t count = counts[i];
        counts[i] = at;
        at += count;
    }
    for (uint32_t i = 0; i < f->land; i++) {
        if (i % POLL == 0 && vd_job_stopped(f->job)) {
            return false;
        }
        const uint32_t sample = f->order[i];
        f->parent[counts[digit_of(key_of(height_of(f, sample)), digit)]++] = sample;
    }
    uint32_t *sorted = f->parent;
    f->parent = f->order;
    f->order = sorted;
    return true;
}

static vd_status sort_land(vd_context *context, flood *f) {
    uint32_t(*counts)[BUCKETS] = vd_allocate_zero(context, DIGITS, sizeof *counts);
    if (counts == NULL) {
        return vd_out_of_memory("the order of the heights", DIGITS * sizeof *counts);
    }
    bool done = list_land(f, counts);
    for (int digit = 0; done && digit < DIGITS; digit++) {
        /* Heights of 8 and 16 bits differ in few digits: a round of one bucket changes nothing. */
        bool one = false;
        for (int i = 0; i < BUCKETS && !one; i++) {
            one = counts[digit][i] == f->land;
        }
        done = one || sort_by_digit(f, digit, counts[digit]);
        vd_job_report(f->job, digit + 1, 2 * DIGITS);
    }
    vd_release(context, counts);
    return done ? vd_success() : stopped();
}

/* ---- the best so far ------------------------------------------------------------------------- */

static void sink(candidate *heap, int count, candidate item) {
    int at = 0;
    for (int child; (child = 2 * at + 1) < count; at = child) {
        if (child + 1 < count && stands_out_more(heap[child], heap[child + 1])) {
            child++;
        }
        if (!stands_out_more(item, heap[child])) {
            break;
        }
        heap[at] = heap[child];
    }
    heap[at] = item;
}

static void keep(flood *f, uint32_t sample, double prominence) {
    const candidate item = {prominence, sample};
    if (!(prominence > 0.0)) {
        return; /* the rest of a plateau */
    }
    if (f->candidates == f->room) {
        if (stands_out_more(item, f->best[0])) {
            sink(f->best, f->room, item);
        }
        return;
    }
    int at = f->candidates++;
    for (int up; at > 0 && stands_out_more(f->best[up = (at - 1) / 2], item); at = up) {
        f->best[at] = f->best[up];
    }
    f->best[at] = item;
}

/* ---- flooding -------------------------------------------------------------------------------- */

static uint32_t find(uint32_t *parent, uint32_t sample) {
    while (parent[sample] != sample) {
        parent[sample] = parent[parent[sample]];
        sample = parent[sample];
    }
    return sample;
}

/* Whether the peak of one root is higher than the other's, or as high and first. */
static bool is_higher(const flood *f, uint32_t a, uint32_t b) {
    const float height_a = height_of(f, a), height_b = height_of(f, b);
    return height_a != height_b ? height_a > height_b : a < b;
}

/* The samples around one that exist; at most 8, some of them twice in a narrow map that wraps. */
static int neighbours(const vd_heightfield *map, uint32_t sample, uint32_t out[8]) {
    const int width = map->width, height = map->height;
    const int column = (int)(sample % (uint32_t)width), row = (int)(sample / (uint32_t)width);
    int count = 0;
    for (int dr = -1; dr <= 1; dr++) {
        for (int dc = -1; dc <= 1; dc++) {
            int c = column + dc, r = row + dr;
            if (map->wraps) {
                c = c < 0 ? width - 1 : c < width ? c : 0;
                r = r < 0 ? height - 1 : r < height ? r : 0;
            }
            if ((dc != 0 || dr != 0) && c >= 0 && c < width && r >= 0 && r < height) {
                out[count++] = (uint32_t)r * (uint32_t)width + (uint32_t)c;
            }
        }
    }
    return count;
}

/* Lets one sample rise: joins it to the islands around it. */
static void rise(flood *f, uint32_t sample) {
    uint32_t around[8];
    const int count = neighbours(f->map, sample, around);
    uint32_t peak = sample; /* of the island that the sample is part of */
    f->parent[sample] = sample;
    for (int i = 0; i < count; i++) {
        if (f->parent[around[i]] == NOBODY) {
            continue;
        }
        const uint32_t other = find(f->parent, around[i]);
        if (other == peak) {
            continue;
        }
        const bool stays = is_higher(f, peak, other);
        const uint32_t higher = stays ? peak : other, lower = stays ? other : peak;
        if (lower != sample) {
            keep(f, lower, (double)height_of(f, lower) - (double)height_of(f, sample));
        }
        f->parent[lower] = higher;
        peak = higher;
    }
}

static vd_status flood_all(flood *f) {
    const size_t samples = (size_t)f->map->width * (size_t)f->map->height;
    memset(f->parent, 0xFF, samples * sizeof *f->parent); /* NOBODY */
    for (uint32_t i = 0; i < f->land; i++) {
        if (i % POLL == 0) {
            if (vd_job_stopped(f->job)) {
                return stopped();
            }
            vd_job_report(f->job, 50 + (int)(50.0 * i / f->land), 100);
        }
        rise(f, f->order[i]);
    }
    return vd_success();
}

/* What is left: the highest peak of each part that hangs together, down to the part's lowest
 * sample, which is the first that one meets from the lowest up. Parts done are marked by NOBODY. */
static void keep_highest(flood *f) {
    for (uint32_t i = f->land; i-- > 0;) {
        const uint32_t sample = f->order[i];
        uint32_t root = sample;
        while (f->parent[root] != root && f->parent[root] != NOBODY) {
            const uint32_t up = f->parent[root];
            if (f->parent[up] != NOBODY) {
                f->parent[root] = f->parent[up];
            }
            root = up;
        }
        if (f->parent[root] == root) {
            keep(f, root, (double)height_of(f, root) - (double)height_of(f, sample));
            f->parent[root] = NOBODY;
        }
    }
}

/* ---- the call -------------------------------------------------------------------------------- */

/* Empties the heap, the least first. */
static int write_out(flood *f, vd_peak *out) {
    const double *m = f->map->world_from_sample;
    const int found = f->candidates;
    for (int i = found; i-- > 0;) {
        const candidate c = f->best[0];
        sink(f->best, i, f->best[i]);
        vd_peak *p = &out[i];
        p->column = (int)(c.sample % (uint32_t)f->map->width);
        p->row = (int)(c.sample / (uint32_t)f->map->width);
        p->x = m[0] + p->column * m[1] + p->row * m[2];
        p->y = m[3] + p->column * m[4] + p->row * m[5];
        p->z = (double)height_of(f, c.sample);
        p->prominence_m = c.prominence;
    }
    return found;
}

vd_status vd_heightfield_peaks(vd_context *context, vd_job *job, const vd_heightfield *heightfield,
                               int count, vd_peak *out, int *found) {
    const size_t samples = (size_t)heightfield->width * (size_t)heightfield->height;
    if (count < 1) {
        return vd_failure(VD_ERROR_ARGUMENT, "the count of peaks is %d; ask for 1 or more", count);
    }
    if (samples >= NOBODY) {
        return vd_failure(VD_ERROR_LIMIT,
                          "peaks are found among at most 2^32 samples, but the map has %d x %d; "
                          "load it smaller",
                          heightfield->width, heightfield->height);
    }
    const size_t room = (size_t)count < samples ? (size_t)count : samples;
    flood f = {.map = heightfield, .job = job, .room = (int)room};
    vd_status status = vd_success();
    f.order = vd_allocate(context, samples, sizeof *f.order);
    f.parent = vd_allocate(context, samples, sizeof *f.parent);
    f.best = vd_allocate(context, room, sizeof *f.best);
    if (f.order == NULL || f.parent == NULL || f.best == NULL) {
        status = vd_out_of_memory("the order of the heights", 2 * samples * sizeof *f.order);
    }
    if (status.code == VD_OK) {
        status = sort_land(context, &f);
    }
    if (status.code == VD_OK) {
        status = flood_all(&f);
    }
    if (status.code == VD_OK) {
        keep_highest(&f);
        *found = write_out(&f, out);
        vd_job_report(job, 1, 1);
    }
    vd_release(context, f.best);
    vd_release(context, f.parent);
    vd_release(context, f.order);
    return status;
}
