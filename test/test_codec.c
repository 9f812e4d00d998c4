/* The picture codecs: everything comes back, and nothing that comes does harm. */
#include "codec_pictures.h"
#include "remote/codec_runs.h"
#include "remote/packed.h"

#include <math.h>
#include <stdio.h>

static const int sizes[][2] = {{1, 1},  {2, 2},   {1, 9},   {9, 1},    {7, 5},
                               {16, 4}, {33, 31}, {64, 64}, {127, 65}, {130, 3}};
enum { SIZES = sizeof sizes / sizeof sizes[0] };

typedef struct fixture {
    vd_context *context;
    vd_coder *coder;
    size_t bytes; /* that the context itself takes */
} fixture;

static fixture begin(void) {
    fixture f = {test_context(1, VD_ISA_AUTO), NULL, 0};
    f.bytes = vd_context_memory(f.context).bytes_now;
    assert_ok(vd_coder_create(f.context, &f.coder));
    return f;
}

static void end(fixture *f) {
    vd_coder_destroy(&f->coder);
    assert_null(f->coder);
    assert_int_equal(vd_context_memory(f->context).bytes_now, f->bytes);
    vd_context_destroy(&f->context);
}

/* Packs into exactly the bound; the caller frees. */
static uint8_t *pack(fixture *f, const vd_encode_def *def, const vd_codec_picture *picture,
                     vd_encoded *encoded) {
    const size_t bound = vd_codec_bound(def->codec, picture->width, picture->height);
    assert_true(bound > 0);
    uint8_t *out = malloc(bound);
    assert_ok(vd_coder_encode(f->coder, def, picture, out, bound, encoded));
    assert_true(encoded->bytes >= 1 && encoded->bytes <= bound);
    assert_int_equal(encoded->codec, def->codec);
    return out;
}

/* Unpacks from memory that ends with the bytes, so that a sanitizer sees a read behind them. */
static vd_status unpack(fixture *f, vd_codec codec, const uint8_t *data, size_t bytes, int width,
                        int height, uint8_t *rgba, size_t stride) {
    uint8_t *exact = malloc(bytes > 0 ? bytes : 1);
    memcpy(exact, data, bytes);
    const vd_status status =
        vd_coder_decode(f->coder, codec, exact, bytes, width, height, rgba, stride);
    free(exact);
    return status;
}

static void check_same(const uint8_t *a, const uint8_t *b, int width, int height, size_t stride) {
    for (int y = 0; y < height; y++) {
        const size_t row = 4 * stride * (size_t)y;
        assert_memory_equal(a + row, b + row, 4 * (size_t)width);
        for (size_t x = 4 * (size_t)width; x < 4 * stride; x++) {
            assert_int_equal(b[row + x], 0x77); /* left alone */
        }
    }
}

static void check_close(const uint8_t *a, const uint8_t *b, int width, int height, size_t stride,
                        bool smooth) {
    double sum = 0;
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            const uint8_t *p = a + 4 * (stride * (size_t)y + (size_t)x);
            const uint8_t *q = b + 4 * (stride * (size_t)y + (size_t)x);
            assert_int_equal(p[3], q[3]);
            for (int c = 0; c < 3; c++) {
                assert_true(q[c] <= q[3]);
                sum += fabs((double)p[c] - (double)q[c]);
            }
        }
    }
    if (smooth) {
        assert_true(sum / (3.0 * width * height) < 8);
    }
}

static void test_round_trips(void **state) {
    (void)state;
    fixture f = begin();
    for (int s = 0; s < SIZES; s++) {
        const int width = sizes[s][0], height = sizes[s][1];
        const size_t stride = (size_t)width + (size_t)s % 3;
        uint8_t *back = malloc(4 * stride * (size_t)height);
        for (int look = 0; look < TEST_LOOK_COUNT; look++) {
            uint8_t *rgba = test_paint((test_look)look, width, height, stride, (uint64_t)s + 1);
            const vd_codec_picture picture = {rgba, width, height, stride};
            for (int codec = VD_CODEC_RAW; codec < VD_CODEC_COUNT; codec++) {
                vd_encode_def def = {.codec = (vd_codec)codec, .effort = s % 10};
                vd_encoded encoded;
                uint8_t *bytes = pack(&f, &def, &picture, &encoded);
                memset(back, 0x77, 4 * stride * (size_t)height);
                assert_ok(
                    unpack(&f, encoded.codec, bytes, encoded.bytes, width, height, back, stride));
                if (vd_codec_is_lossless((vd_codec)codec)) {
                    check_same(rgba, back, width, height, stride);
                } else if (look != TEST_NOISE) {
                    check_close(rgba, back, width, height, stride, width > 30 && height > 30);
                }
                free(bytes);
            }
            free(rgba);
        }
        free(back);
    }
    end(&f);
}

/* The worst pictures at the best quality stay within the bound, and large ones come back. */
static void test_bounds_hold_for_noise(void **state) {
    (void)state;
    fixture f = begin();
    uint8_t *rgba = test_paint(TEST_NOISE, 256, 200, 256, 3);
    uint8_t *back = malloc(4 * 256 * 200);
    const vd_codec_picture picture = {rgba, 256, 200, 256};
    for (int codec = VD_CODEC_RAW; codec < VD_CODEC_COUNT; codec++) {
        vd_encode_def def = {.codec = (vd_codec)codec, .quality = 100};
        vd_encoded encoded;
        uint8_t *bytes = pack(&f, &def, &picture, &encoded);
        assert_true(encoded.bytes <= vd_codec_bound(VD_CODEC_AUTO, 256, 200));
        assert_true(encoded.bytes > 65536); /* several chunks, blocks, tokens */
        assert_ok(unpack(&f, def.codec, bytes, encoded.bytes, 256, 200, back, 256));
        if (vd_codec_is_lossless(def.codec)) {
            assert_memory_equal(rgba, back, 4 * 256 * 200);
        }
        free(bytes);
    }
    free(back);
    free(rgba);
    end(&f);
}

static void test_sizes_make_sense(void **state) {
    (void)state;
    fixture f = begin();
    uint8_t *rgba = test_paint(TEST_TREE, 128, 128, 128, 4);
    const vd_codec_picture picture = {rgba, 128, 128, 128};
    size_t bytes[VD_CODEC_COUNT];
    for (int codec = VD_CODEC_RAW; codec < VD_CODEC_COUNT; codec++) {
        vd_encode_def def = {.codec = (vd_codec)codec};
        vd_encoded encoded;
        free(pack(&f, &def, &picture, &encoded));
        bytes[codec] = encoded.bytes;
    }
    assert_int_equal(bytes[VD_CODEC_RAW], 4 * 128 * 128);
    assert_true(bytes[VD_CODEC_RUNS] < bytes[VD_CODEC_RAW] / 2);
    assert_true(bytes[VD_CODEC_RUNS_ZSTD] < bytes[VD_CODEC_RUNS]);
    assert_true(bytes[VD_CODEC_JPEG] < bytes[VD_CODEC_RAW] / 4);
    free(rgba);
    end(&f);
}

/* A row of each kind, by hand, as docs/wire.md has it. */
static void test_runs_to_the_byte(void **state) {
    (void)state;
    uint8_t rgba[2][12][4] = {{{0}}};
    for (int x = 2; x < 11; x++) {
        memcpy(rgba[1][x], x < 4 ? "abcd" : "efgh", 4);
    }
    memcpy(rgba[1][2], "1234", 4);
    uint8_t out[256];
    assert_true(vd_runs_bound(12, 2) <= sizeof out);
    const size_t bytes = vd_runs_encode(rgba[0][0], 12, 12, 2, out);
    static const uint8_t expected[] = {0,   0,   0,   0,   2,   0,   9,  0, 2,   0,   '1', '2',
                                       '3', '4', 'a', 'b', 'c', 'd', 13, 0, 'e', 'f', 'g', 'h'};
    assert_int_equal(bytes, sizeof expected);
    assert_memory_equal(out, expected, bytes);
    uint8_t back[2][12][4];
    assert_null(vd_runs_decode(out, bytes, 12, 2, back[0][0], 12));
    assert_memory_equal(back, rgba, sizeof rgba);
}

/* Runs longer than a token, in planes and rows. */
static void test_long_runs(void **state) {
    (void)state;
    const size_t count = 100001;
    uint8_t *plane = malloc(count), *back = malloc(count),
            *out = malloc(vd_runs_plane_bound(count));
    uint64_t seed = 5;
    for (int kind = 0; kind < 3; kind++) {
        for (size_t i = 0; i < count; i++) {
            plane[i] = kind == 0 ? 9 : kind == 1 ? (uint8_t)test_random(&seed) : i > 50000;
        }
        const size_t bytes = vd_runs_encode_plane(plane, count, out);
        assert_true(bytes <= vd_runs_plane_bound(count));
        memset(back, 0, count);
        assert_null(vd_runs_decode_plane(out, bytes, count, back));
        assert_memory_equal(plane, back, count);
        for (size_t cut = 0; cut < bytes && cut < 40; cut++) {
            assert_non_null(vd_runs_decode_plane(out, cut, count, back));
        }
    }
    free(out);
    free(back);
    free(plane);
    uint8_t *row = malloc(4 * 65535);
    uint8_t *packed = malloc(vd_runs_bound(65535, 1));
    memset(row, 1, 4 * 65535);
    assert_int_equal(vd_runs_encode(row, 65535, 65535, 1, packed), 4 + 2 * 6);
    free(packed);
    free(row);
}

/* Every beginning of a packed picture is refused, and with bytes behind it too. */
static void test_truncations(void **state) {
    (void)state;
    fixture f = begin();
    uint8_t *rgba = test_paint(TEST_TREE, 40, 36, 40, 6);
    uint8_t *back = malloc(4 * 40 * 36);
    const vd_codec_picture picture = {rgba, 40, 36, 40};
    for (int codec = VD_CODEC_RAW; codec < VD_CODEC_COUNT; codec++) {
        vd_encode_def def = {.codec = (vd_codec)codec};
        vd_encoded encoded;
        uint8_t *bytes = pack(&f, &def, &picture, &encoded);
        for (size_t cut = 0; cut < encoded.bytes; cut++) {
            const vd_status status = unpack(&f, def.codec, bytes, cut, 40, 36, back, 40);
            assert_int_equal(status.code, VD_ERROR_FORMAT);
            assert_non_null(strstr(status.message, vd_codec_name(def.codec)));
            assert_non_null(strstr(status.message, "40 × 36"));
        }
        uint8_t *longer = malloc(encoded.bytes + 1);
        memcpy(longer, bytes, encoded.bytes);
        longer[encoded.bytes] = 0;
        assert_int_equal(unpack(&f, def.codec, longer, encoded.bytes + 1, 40, 36, back, 40).code,
                         VD_ERROR_FORMAT);
        /* another size than promised; runs that fit into a narrower picture are one, too */
        if (codec != VD_CODEC_RUNS && codec != VD_CODEC_RUNS_ZSTD) {
            assert_int_equal(unpack(&f, def.codec, bytes, encoded.bytes, 36, 36, back, 40).code,
                             VD_ERROR_FORMAT);
        }
        assert_int_equal(unpack(&f, def.codec, bytes, encoded.bytes, 40, 35, back, 40).code,
                         VD_ERROR_FORMAT);
        free(longer);
        free(bytes);
    }
    free(back);
    free(rgba);
    end(&f);
}

/* Bytes changed at random: an error or a picture, and for lossy codecs a premultiplied one. */
static void test_mutations(void **state) {
    (void)state;
    fixture f = begin();
    uint64_t seed = 7;
    for (int look = 0; look < TEST_LOOK_COUNT; look++) {
        uint8_t *rgba = test_paint((test_look)look, 33, 29, 33, 8);
        uint8_t *back = malloc(4 * 33 * 29);
        const vd_codec_picture picture = {rgba, 33, 29, 33};
        for (int codec = VD_CODEC_RAW; codec < VD_CODEC_COUNT; codec++) {
            vd_encode_def def = {.codec = (vd_codec)codec};
            vd_encoded encoded;
            uint8_t *bytes = pack(&f, &def, &picture, &encoded);
            uint8_t *changed = malloc(encoded.bytes);
            for (int trial = 0; trial < 800; trial++) {
                memcpy(changed, bytes, encoded.bytes);
                for (uint64_t n = 1 + test_random(&seed) % 4; n > 0; n--) {
                    changed[test_random(&seed) % encoded.bytes] ^=
                        (uint8_t)(1u << test_random(&seed) % 8);
                }
                memset(back, 1, 4 * 33 * 29);
                const vd_status status =
                    unpack(&f, def.codec, changed, encoded.bytes, 33, 29, back, 33);
                assert_true(status.code == VD_OK || status.code == VD_ERROR_FORMAT);
                assert_true(status.code == VD_OK || strlen(status.message) > 20);
                for (int i = 0;
                     status.code == VD_OK && !vd_codec_is_lossless(def.codec) && i < 33 * 29; i++) {
                    assert_true(back[4 * i] <= back[4 * i + 3]);
                }
            }
            free(changed);
            free(bytes);
        }
        free(back);
        free(rgba);
    }
    end(&f);
}

static void test_refusals(void **state) {
    (void)state;
    fixture f = begin();
    uint8_t rgba[16 * 4] = {0}, out[4096];
    vd_encoded encoded;
    const vd_codec_picture good = {rgba, 4, 4, 4};
    const struct {
        vd_encode_def def;
        vd_codec_picture picture;
        size_t room;
        vd_code code;
        const char *says;
    } cases[] = {
        {{.codec = VD_CODEC_COUNT}, good, 4096, VD_ERROR_ARGUMENT, "codec"},
        {{.quality = 101}, good, 4096, VD_ERROR_ARGUMENT, "quality"},
        {{.effort = 10}, good, 4096, VD_ERROR_ARGUMENT, "effort"},
        {{.codec = 1}, {rgba, 0, 4, 4}, 4096, VD_ERROR_ARGUMENT, "0 × 4"},
        {{.codec = 1}, {rgba, 16384, 4, 16384}, 4096, VD_ERROR_ARGUMENT, "16384 × 4"},
        {{.codec = 1}, {rgba, 16000, 16000, 16000}, 4096, VD_ERROR_ARGUMENT, "16000"},
        {{.codec = 1}, {rgba, 4, 4, 3}, 4096, VD_ERROR_ARGUMENT, "stride of 3"},
        {{.codec = 1}, {NULL, 4, 4, 4}, 4096, VD_ERROR_ARGUMENT, "no memory"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const vd_status status = vd_coder_encode(f.coder, &cases[i].def, &cases[i].picture, out,
                                                 cases[i].room, &encoded);
        assert_int_equal(status.code, cases[i].code);
        assert_non_null(strstr(status.message, cases[i].says));
    }
    for (int codec = VD_CODEC_RAW; codec < VD_CODEC_COUNT; codec++) {
        const vd_encode_def def = {.codec = (vd_codec)codec};
        assert_ok(vd_coder_encode(f.coder, &def, &good, out, sizeof out, &encoded));
        const size_t needed = encoded.bytes;
        for (size_t room = 0; room < needed; room++) {
            const vd_status status = vd_coder_encode(f.coder, &def, &good, out, room, &encoded);
            assert_int_equal(status.code, VD_ERROR_LIMIT);
            assert_non_null(strstr(status.message, "vd_codec_bound"));
        }
    }
    assert_int_equal(vd_coder_decode(f.coder, VD_CODEC_AUTO, out, 4, 4, 4, rgba, 4).code,
                     VD_ERROR_FORMAT);
    assert_int_equal(vd_coder_decode(f.coder, VD_CODEC_COUNT, out, 4, 4, 4, rgba, 4).code,
                     VD_ERROR_FORMAT);
    assert_int_equal(vd_coder_decode(f.coder, VD_CODEC_RAW, out, 64, 4, 4, rgba, 3).code,
                     VD_ERROR_ARGUMENT);
    assert_int_equal(vd_codec_bound(VD_CODEC_RAW, 0, 1), 0);
    assert_int_equal(vd_codec_bound(VD_CODEC_COUNT, 4, 4), 0);
    assert_null(vd_codec_name(VD_CODEC_COUNT));
    end(&f);
}

/* Each allocation through the context fails in turn. */
static void test_out_of_memory(void **state) {
    (void)state;
    uint8_t *rgba = test_paint(TEST_TREE, 20, 20, 20, 9);
    const vd_codec_picture picture = {rgba, 20, 20, 20};
    uint8_t *out = malloc(vd_codec_bound(VD_CODEC_AUTO, 20, 20)), *back = malloc(4 * 20 * 20);
    for (int codec = VD_CODEC_RAW; codec < VD_CODEC_COUNT; codec++) {
        bool failed = true;
        for (int n = 1; failed; n++) {
            test_allocator allocator = {0};
            vd_context *context = test_failing_context(&allocator);
            const int live = allocator.live;
            allocator.fail_at = allocator.calls + n;
            vd_coder *coder = NULL;
            vd_encoded encoded = {VD_CODEC_RAW, 0};
            const vd_encode_def def = {.codec = (vd_codec)codec};
            vd_status status = vd_coder_create(context, &coder);
            if (status.code == VD_OK) {
                status = vd_coder_encode(coder, &def, &picture, out,
                                         vd_codec_bound(def.codec, 20, 20), &encoded);
            }
            if (status.code == VD_OK) {
                vd_coder_destroy(&coder); /* decoding with nothing left over from encoding */
                status = vd_coder_create(context, &coder);
            }
            if (status.code == VD_OK) {
                status = vd_coder_decode(coder, def.codec, out, encoded.bytes, 20, 20, back, 20);
            }
            failed = status.code != VD_OK;
            if (failed) {
                assert_int_equal(status.code, VD_ERROR_MEMORY);
            }
            vd_coder_destroy(&coder);
            assert_int_equal(allocator.live, live);
            vd_context_destroy(&context);
        }
    }
    free(back);
    free(out);
    free(rgba);
}

/* A second picture of a size allocates nothing. */
static void test_warm_runs_allocate_nothing(void **state) {
    (void)state;
    fixture f = begin();
    uint8_t *rgba = test_paint(TEST_TREE, 64, 64, 64, 10);
    const vd_codec_picture picture = {rgba, 64, 64, 64};
    uint8_t *back = malloc(4 * 64 * 64);
    uint64_t before = 0;
    for (int turn = 0; turn < 3; turn++) {
        if (turn == 1) {
            before = vd_context_memory(f.context).allocations;
        }
        for (int codec = VD_CODEC_RAW; codec < VD_CODEC_COUNT; codec++) {
            const vd_encode_def def = {.codec = (vd_codec)codec};
            vd_encoded encoded;
            uint8_t *bytes = pack(&f, &def, &picture, &encoded);
            assert_ok(unpack(&f, def.codec, bytes, encoded.bytes, 64, 64, back, 64));
            free(bytes);
        }
    }
    assert_int_equal(vd_context_memory(f.context).allocations, before);
    free(back);
    free(rgba);
    end(&f);
}

static void test_choice(void **state) {
    (void)state;
    /* The faster the link, the less work is worth doing. */
    assert_int_equal(vd_codec_choose(NULL, VD_CODEC_ALL, true, 1e12, 128, 128), VD_CODEC_RAW);
    const vd_codec at_10 = vd_codec_choose(NULL, VD_CODEC_ALL, true, 10e6, 128, 128);
    assert_true(at_10 > VD_CODEC_RAW && vd_codec_is_lossless(at_10));
    assert_false(vd_codec_is_lossless(vd_codec_choose(NULL, VD_CODEC_ALL, false, 1e5, 512, 512)));
    assert_int_equal(vd_codec_choose(NULL, VD_CODEC_BIT(VD_CODEC_PNG), true, 0, 64, 64),
                     VD_CODEC_PNG);
    assert_int_equal(vd_codec_choose(NULL, VD_CODEC_BIT(VD_CODEC_JPEG), true, 1e6, 64, 64),
                     VD_CODEC_RAW);
    /* Costs that are learnt change the choice. */
    vd_codec_costs costs = vd_codec_costs_default();
    for (int i = 0; i < 200; i++) {
        vd_codec_costs_learn(&costs, VD_CODEC_RUNS, 1 << 14, 4 << 14, 1e7, NAN);
        vd_codec_costs_learn(&costs, VD_CODEC_RUNS_ZSTD, 1 << 14, 4 << 14, 1e9, 1e9);
    }
    assert_true(costs.codecs[VD_CODEC_RUNS].bytes_per_pixel > 3.9);
    assert_true(costs.codecs[VD_CODEC_RUNS].decode_ns_per_pixel <
                1.01 * vd_codec_costs_default().codecs[VD_CODEC_RUNS].decode_ns_per_pixel);
    assert_int_equal(vd_codec_choose(&costs,
                                     VD_CODEC_BIT(VD_CODEC_RAW) | VD_CODEC_BIT(VD_CODEC_RUNS) |
                                         VD_CODEC_BIT(VD_CODEC_RUNS_ZSTD),
                                     true, 10e6, 128, 128),
                     VD_CODEC_RAW);
    const vd_codec_costs before = costs;
    vd_codec_costs_learn(&costs, VD_CODEC_AUTO, 1, 1, 1, 1);
    vd_codec_costs_learn(&costs, VD_CODEC_COUNT, 1, 1, 1, 1);
    vd_codec_costs_learn(&costs, VD_CODEC_RUNS, 0, 1, 1, 1);
    assert_memory_equal(&before, &costs, sizeof costs);
}

static void test_automatic(void **state) {
    (void)state;
    fixture f = begin();
    uint8_t *rgba = test_paint(TEST_TREE, 64, 64, 64, 11);
    const vd_codec_picture picture = {rgba, 64, 64, 64};
    const size_t bound = vd_codec_bound(VD_CODEC_AUTO, 64, 64);
    uint8_t *out = malloc(bound), *back = malloc(4 * 64 * 64);
    vd_encoded encoded;
    vd_encode_def def = {.lossless = true, .link_bytes_per_s = 1e12};
    assert_ok(vd_coder_encode(f.coder, &def, &picture, out, bound, &encoded));
    assert_int_equal(encoded.codec, VD_CODEC_RAW);
    assert_ok(vd_coder_encode(f.coder, NULL, &picture, out, bound, &encoded));
    assert_ok(vd_coder_decode(f.coder, encoded.codec, out, encoded.bytes, 64, 64, back, 64));
    free(back);
    free(out);
    free(rgba);
    end(&f);
}

/* ---- what was packed --------------------------------------------------------------------------*/

static void test_packed_are_bounded(void **state) {
    (void)state;
    static vd_packed_cache cache;
    static uint8_t data[VD_PACKED_BYTES];
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const size_t empty = vd_context_memory(context).bytes_now;
    uint64_t random = 3;
    for (uint64_t i = 1; i < 3000; i++) {
        const size_t most = i < 1500 ? 1000 : 300000; /* many, then large ones */
        const size_t bytes = 1 + (size_t)((double)most * test_uniform(&random));
        memset(data, (int)(i & 255), bytes);
        const vd_packed packed = {i, VD_CODEC_RUNS, 85, bytes, data};
        vd_packed_keep(context, &cache, &packed);
        const vd_packed *found = vd_packed_find(&cache, i, VD_CODEC_RUNS, 85);
        assert_non_null(found);
        assert_int_equal(found->bytes, bytes);
        assert_memory_equal(found->data, data, bytes);
        assert_null(vd_packed_find(&cache, i, VD_CODEC_PNG, 85));
        assert_null(vd_packed_find(&cache, i, VD_CODEC_RUNS, 84));
        size_t sum = 0;
        for (int k = 0; k < VD_PACKED_MOST; k++) {
            sum += cache.items[k].bytes;
        }
        assert_true(sum == cache.bytes && sum <= VD_PACKED_BYTES);
        if (i > 20) { /* the newest are there */
            assert_non_null(vd_packed_find(&cache, i - 5, VD_CODEC_RUNS, 85));
        }
    }
    const vd_packed large = {5000, VD_CODEC_RUNS, 85, VD_PACKED_BYTES, data};
    const vd_packed unnumbered = {0, VD_CODEC_RUNS, 85, 10, data};
    const size_t before = cache.bytes;
    vd_packed_keep(context, &cache, &large);
    vd_packed_keep(context, &cache, &unnumbered);
    assert_int_equal(cache.bytes, before);
    assert_null(vd_packed_find(&cache, 0, VD_CODEC_RUNS, 85));
    vd_packed_clear(context, &cache);
    assert_int_equal(vd_context_memory(context).bytes_now, empty);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trips),
        cmocka_unit_test(test_bounds_hold_for_noise),
        cmocka_unit_test(test_sizes_make_sense),
        cmocka_unit_test(test_runs_to_the_byte),
        cmocka_unit_test(test_long_runs),
        cmocka_unit_test(test_truncations),
        cmocka_unit_test(test_mutations),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_out_of_memory),
        cmocka_unit_test(test_warm_runs_allocate_nothing),
        cmocka_unit_test(test_choice),
        cmocka_unit_test(test_automatic),
        cmocka_unit_test(test_packed_are_bounded),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
