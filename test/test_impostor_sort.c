/* What is shown, sorted by distance: the same order as by comparing, whatever the distances are. */
#include <math.h>
#include <stdlib.h>
#include "impostor/impostor_set.h"
#include "support.h"

enum { MOST = 20000 };

static vd_impostor_rank sorted[MOST], room[MOST], wanted[MOST];

static int compare(const void *a, const void *b) {
    const vd_impostor_rank *x = a, *y = b;
    return x->distance2 != y->distance2
               ? (x->distance2 < y->distance2) - (x->distance2 > y->distance2)
               : (x->slot > y->slot) - (x->slot < y->slot);
}

static void check(size_t count) {
    for (size_t i = 0; i < count; i++) {
        wanted[i] = sorted[i];
    }
    qsort(wanted, count, sizeof wanted[0], compare);
    vd_impostor_ranks_sort(sorted, room, count);
    for (size_t i = 0; i < count; i++) {
        assert_true(sorted[i].slot == wanted[i].slot && sorted[i].distance2 == wanted[i].distance2);
    }
}

/* Slots in any order: a permutation of 0 … count − 1. */
static void shuffle_slots(uint64_t *random, size_t count) {
    for (size_t i = 0; i < count; i++) {
        const size_t other = (size_t)(test_uniform(random) * (double)(i + 1));
        sorted[i].slot = sorted[other].slot;
        sorted[other].slot = (uint32_t)i;
    }
}

static void distances_of_all_sizes(void **state) {
    (void)state;
    uint64_t random = 1;
    for (int run = 0; run < 200; run++) {
        const size_t count = (size_t)(test_uniform(&random) * (run % 10 == 0 ? MOST : 1000));
        const double spread = 600.0 * test_uniform(&random);
        shuffle_slots(&random, count);
        for (size_t i = 0; i < count; i++) {
            sorted[i].distance2 = exp(spread * (test_uniform(&random) - 0.5));
        }
        check(count);
    }
}

/* On a ring, on a few rings, and so near to each other that only the last bits tell them apart. */
static void distances_that_agree(void **state) {
    (void)state;
    uint64_t random = 2;
    static const int rings[] = {1, 2, 7, 300};
    for (size_t r = 0; r < sizeof rings / sizeof rings[0]; r++) {
        shuffle_slots(&random, MOST);
        for (size_t i = 0; i < MOST; i++) {
            sorted[i].distance2 = 1e6 * floor(rings[r] * test_uniform(&random));
        }
        check(MOST);
        for (size_t i = 0; i < MOST; i++) {
            sorted[i].distance2 = 1e6 + 1e-9 * floor(rings[r] * 10 * test_uniform(&random));
        }
        check(MOST);
    }
}

static void distances_without_end(void **state) {
    (void)state;
    for (size_t i = 0; i < 1000; i++) {
        sorted[i] = (vd_impostor_rank){i % 3 == 0   ? (double)INFINITY
                                       : i % 3 == 1 ? 0.0
                                                    : 5e-324 * (double)i,
                                       (uint32_t)i};
    }
    check(1000);
    check(0);
    check(1);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(distances_of_all_sizes),
        cmocka_unit_test(distances_that_agree),
        cmocka_unit_test(distances_without_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
