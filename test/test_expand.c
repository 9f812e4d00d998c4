/* Flattening by expansion against the plain filter. */
#include "core/expand.h"
#include "support.h"

#define SOURCES 50

/* Segments of random elements; element k of source i is wanted where the bit is set. */
typedef struct segments {
    uint32_t size[SOURCES];
    bool wanted[SOURCES][400];
    uint64_t visited, first;
    struct {
        size_t source;
        uint32_t element;
    } expected[SOURCES * 400];
} segments;

static uint32_t size(const void *user, size_t source) {
    return ((const segments *)user)->size[source];
}

static bool predicate(const void *user, size_t source, uint32_t element) {
    return ((const segments *)user)->wanted[source][element];
}

static void get(void *user, size_t source, uint32_t element, uint64_t output) {
    segments *s = user;
    assert_int_equal(output, s->first + s->visited++);
    assert_int_equal(s->expected[output].source, source);
    assert_int_equal(s->expected[output].element, element);
}

/* Fills in random segments of at most `limit` elements; returns the number wanted. */
static uint64_t randomize(segments *s, uint64_t *random, uint32_t limit, bool all) {
    uint64_t total = 0;
    for (size_t i = 0; i < SOURCES; i++) {
        s->size[i] =
            test_random(random) % 3 == 0 ? 0 : (uint32_t)(test_random(random) % (limit + 1));
        const uint64_t density = test_random(random) % 5;
        for (uint32_t k = 0; k < s->size[i]; k++) {
            s->wanted[i][k] = all || test_random(random) % 5 < density;
            if (s->wanted[i][k]) {
                s->expected[total].source = i;
                s->expected[total++].element = k;
            }
        }
    }
    return total;
}

static void masks_rank_and_select(void **state) {
    (void)state;
    uint64_t random = 3;
    for (int bits = 8; bits <= VD_MASK_BITS; bits *= 2) {
        for (int round = 0; round < 200; round++) {
            vd_mask mask;
            memset(&mask, 0, sizeof mask);
            int positions[VD_MASK_BITS], count = 0;
            for (int b = 0; b < bits; b++) {
                if (test_random(&random) % 8 <= (uint64_t)round % 8) {
                    vd_mask_set(&mask, b);
                    positions[count++] = b;
                }
            }
            assert_int_equal(vd_mask_rank(&mask, bits), count);
            for (int k = 0; k < count; k++) {
                assert_int_equal(vd_mask_select(&mask, k), positions[k]);
            }
        }
    }
}

static void expansion_is_a_filter(void **state) {
    (void)state;
    static segments s;
    static vd_mask masks[SOURCES];
    uint64_t offsets[SOURCES + 1], random = 4;
    for (int round = 0; round < 100; round++) {
        const bool masked = round % 2 == 0, all = round % 3 == 0;
        const vd_expand_def def = {size, all ? NULL : predicate, get, 256};
        const uint64_t total = randomize(&s, &random, masked ? 256 : 400, all);
        vd_expansion e = {SOURCES, masks, offsets};
        assert_int_equal(masked ? vd_expand_masked(&def, &s, &e) : vd_expand_filter(&def, &s, &e),
                         total);
        /* In runs of random length, as callers with little memory do. */
        for (uint64_t at = 0; at < total;) {
            uint64_t to = at + 1 + test_random(&random) % 300;
            to = to < total ? to : total;
            s.first = at;
            s.visited = 0;
            if (masked) {
                vd_expand_masked_fill(&def, &s, &e, at, to);
            } else {
                vd_expand_filter_fill(&def, &s, &e, at, to);
            }
            assert_int_equal(s.visited, to - at);
            at = to;
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(masks_rank_and_select),
        cmocka_unit_test(expansion_is_a_filter),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
