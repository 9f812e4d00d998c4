/* Heightfield blocks: pyramid, colours, queries, validation of blocks from outside. */
#include <math.h>
#include "core/core.h"
#include "support.h"
#include "terrain/heightfield_block.h"

static vd_context *context;
static size_t bytes_at_first;

static int set_up(void **state) {
    (void)state;
    context = test_context(1, VD_ISA_AUTO);
    bytes_at_first = vd_context_memory(context).bytes_now;
    return 0;
}

static int tear_down(void **state) {
    (void)state;
    assert_int_equal(vd_context_memory(context).bytes_now, bytes_at_first);
    vd_context_destroy(&context);
    return 0;
}

/* Random heights of a type in rows of width + 3; floats have holes. Freed by the caller. */
static void *random_heights(int width, int height, vd_height_type type, uint64_t seed) {
    size_t count = (size_t)(width + 3) * (size_t)height;
    uint8_t *data = calloc(count, 4);
    assert_non_null(data);
    for (size_t i = 0; i < count; i++) {
        uint64_t r = test_random(&seed);
        if (type == VD_HEIGHT_U8) {
            data[i] = (uint8_t)r;
        } else if (type == VD_HEIGHT_U16) {
            ((uint16_t *)(void *)data)[i] = (uint16_t)r;
        } else {
            ((float *)(void *)data)[i] = r % 5 == 0 ? NAN : (float)((int)(r % 20001) - 10000);
        }
    }
    return data;
}

static vd_heightfield *make(int width, int height, vd_height_type type, const void *heights,
                            bool wraps) {
    vd_heightfield_def def = vd_heightfield_def_default();
    def.width = width;
    def.height = height;
    def.type = type;
    def.heights = heights;
    def.height_stride = (size_t)width + 3;
    def.wraps = wraps;
    vd_heightfield *h = NULL;
    assert_ok(vd_heightfield_create(context, &def, &h));
    return h;
}

static vd_heightfield *make_random(int width, int height, vd_height_type type, uint64_t seed) {
    void *heights = random_heights(width, height, type, seed);
    vd_heightfield *h = make(width, height, type, heights, false);
    free(heights);
    return h;
}

/* The maximum as the header defines it, straight from the heights. */
static float true_maximum(const vd_heightfield *h, int level, int column, int row) {
    float max = -INFINITY;
    int side = 1 << level, shared = level > 0;
    for (int r = row * side; r < (row + 1) * side + shared && r < h->height; r++) {
        for (int c = column * side; c < (column + 1) * side + shared && c < h->width; c++) {
            float value = vd_heightfield_at(h, c, r);
            max = value > max ? value : max;
        }
    }
    return max;
}

static void check_pyramid(const vd_heightfield *h) {
    for (int level = 0; level < h->level_count; level++) {
        const vd_heightfield_level *l = &h->levels[level];
        int side = 1 << level;
        assert_int_equal(l->width, (h->width + side - 1) / side);
        assert_int_equal(l->height, (h->height + side - 1) / side);
        assert_int_equal(l->offset_bytes % 64, 0);
        assert_int_equal(l->stride * vd_height_bytes(h->height_type) % 64, 0);
        for (int row = 0; row < l->height; row++) {
            for (int column = 0; column < l->width; column++) {
                assert_true(vd_heightfield_sample(h, h, level, column, row) ==
                            true_maximum(h, level, column, row));
            }
        }
    }
    assert_int_equal(h->levels[h->level_count - 1].width, 1);
    assert_int_equal(h->levels[h->level_count - 1].height, 1);
}

static void pyramid_holds_maxima(void **state) {
    (void)state;
    static const int sizes[][2] = {{1, 1},   {1, 13}, {13, 1}, {2, 2},   {3, 5},
                                   {16, 16}, {17, 9}, {64, 3}, {31, 33}, {100, 70}};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        for (int type = 0; type < VD_HEIGHT_TYPE_COUNT; type++) {
            void *heights = random_heights(sizes[i][0], sizes[i][1], (vd_height_type)type, i + 1);
            vd_heightfield *h =
                make(sizes[i][0], sizes[i][1], (vd_height_type)type, heights, false);
            check_pyramid(h);
            assert_ok(vd_heightfield_validate(h, (size_t)h->size_bytes));
            for (int row = 0; row < h->height; row++) {
                for (int column = 0; column < h->width; column++) {
                    size_t k = (size_t)row * (size_t)(h->width + 3) + (size_t)column;
                    float stored = type == VD_HEIGHT_U8    ? ((uint8_t *)heights)[k]
                                   : type == VD_HEIGHT_U16 ? ((uint16_t *)heights)[k]
                                                           : ((float *)heights)[k];
                    stored = isnan(stored) ? -INFINITY : stored;
                    assert_true(vd_heightfield_at(h, column, row) == stored);
                }
            }
            free(heights);
            vd_heightfield_destroy(context, &h);
            assert_null(h);
        }
    }
}

static void range_passes_over_holes(void **state) {
    (void)state;
    float heights[8] = {NAN, 3, -7, 0, 0, 0, INFINITY, -INFINITY};
    vd_heightfield *h = make(3, 1, VD_HEIGHT_F32, heights, false);
    assert_true(h->min == -7.0f && h->max == 3.0f && h->holes == 1);
    vd_heightfield_destroy(context, &h);
    h = make(2, 1, VD_HEIGHT_F32, heights + 6, false);
    assert_true(h->min == 0.0f && h->max == 0.0f && h->holes == 2);
    assert_ok(vd_heightfield_validate(h, (size_t)h->size_bytes));
    vd_heightfield_destroy(context, &h);
}

static void same_input_gives_the_same_block(void **state) {
    (void)state;
    vd_heightfield *a = make_random(37, 21, VD_HEIGHT_F32, 9);
    vd_heightfield *b = make_random(37, 21, VD_HEIGHT_F32, 9);
    assert_true(a->size_bytes == b->size_bytes && a->checksum == b->checksum);
    assert_memory_equal(a, b, (size_t)a->size_bytes);
    vd_heightfield_destroy(context, &b);
    b = make_random(37, 21, VD_HEIGHT_F32, 10);
    assert_true(a->checksum != b->checksum);
    vd_heightfield_destroy(context, &a);
    vd_heightfield_destroy(context, &b);
}

/* ---- queries --------------------------------------------------------------------------------- */

static void heights_are_bilinear(void **state) {
    (void)state;
    const float heights[12] = {0, 10, 20, 0, 0, 0, 100, 110, 140, 0, 0, 0};
    vd_heightfield *h = make(3, 2, VD_HEIGHT_F32, heights, false);
    const double inf = (double)INFINITY;
    assert_true(vd_heightfield_height_at(h, 0, 0) == 0.0);
    assert_true(vd_heightfield_height_at(h, 2, -1) == 140.0);
    assert_true(vd_heightfield_height_at(h, 0.5, -0.5) == 55.0);
    assert_true(vd_heightfield_height_at(h, 1.5, -0.25) == 15.0 + 0.25 * 110.0);
    assert_true(vd_heightfield_height_at(h, 2, 0) == 20.0);
    assert_true(vd_heightfield_height_at(h, 2.001, 0) == -inf);
    assert_true(vd_heightfield_height_at(h, -0.001, 0) == -inf);
    assert_true(vd_heightfield_height_at(h, 1, 0.001) == -inf);
    assert_true(vd_heightfield_height_at(h, (double)NAN, 0) == -inf);
    assert_true(vd_heightfield_height_at(h, inf, 0) == -inf);
    vd_vec3 min, max;
    vd_heightfield_bounds(h, &min, &max);
    assert_true(min.x == 0 && max.x == 2 && min.y == -1 && max.y == 0 && min.z == 0 &&
                max.z == 140);
    vd_heightfield_destroy(context, &h);
    h = make(3, 2, VD_HEIGHT_F32, heights, true);
    assert_true(vd_heightfield_height_at(h, 3, 0) == 0.0);
    assert_true(vd_heightfield_height_at(h, 2.5, 0) == 10.0);
    assert_true(vd_heightfield_height_at(h, -0.5, -1.5) == 0.25 * (0 + 20 + 100 + 140));
    assert_true(vd_heightfield_height_at(h, 3e6 + 1.0, 2e6) == 10.0);
    assert_true(vd_heightfield_height_at(h, inf, 0) == -inf);
    vd_heightfield_destroy(context, &h);
}

static void cells_with_a_hole_are_holes(void **state) {
    (void)state;
    const float heights[12] = {0, 10, 20, 0, 0, 0, 100, 110, NAN, 0, 0, 0};
    vd_heightfield *h = make(3, 2, VD_HEIGHT_F32, heights, false);
    assert_true(vd_heightfield_height_at(h, 0.5, -0.5) == 55.0);
    assert_true(vd_heightfield_height_at(h, 1.5, -0.01) == -(double)INFINITY);
    vd_heightfield_destroy(context, &h);
    const uint8_t one[4] = {42, 0, 0, 0};
    h = make(1, 1, VD_HEIGHT_U8, one, false);
    assert_true(vd_heightfield_height_at(h, 0, 0) == 42.0);
    assert_true(vd_heightfield_height_at(h, 0.1, 0) == -(double)INFINITY);
    vd_heightfield_destroy(context, &h);
}

static void rotated_maps_are_inverted(void **state) {
    (void)state;
    enum { W = 9, H = 7 };
    float heights[W * H];
    for (int i = 0; i < W * H; i++) {
        heights[i] = (float)(i % W) * 3.0f + (float)(i / W) * 5.0f;
    }
    vd_heightfield_def def = vd_heightfield_def_default();
    def.width = W;
    def.height = H;
    def.heights = heights;
    def.height_stride = W;
    const double m[6] = {500000, 24, 18, 5000000, 18, -24};
    memcpy(def.world_from_sample, m, sizeof m);
    vd_heightfield *h = NULL;
    assert_ok(vd_heightfield_create(context, &def, &h));
    uint64_t seed = 1;
    for (int i = 0; i < 200; i++) {
        double c = test_uniform(&seed) * (W - 1), r = test_uniform(&seed) * (H - 1);
        double x = m[0] + c * m[1] + r * m[2], y = m[3] + c * m[4] + r * m[5];
        assert_true(fabs(vd_heightfield_height_at(h, x, y) - (3.0 * c + 5.0 * r)) < 1e-6);
    }
    vd_vec3 min, max;
    vd_heightfield_bounds(h, &min, &max);
    assert_true(min.x == 500000 && max.x == 500000 + 8 * 24 + 6 * 18);
    assert_true(min.y == 5000000 - 6 * 24 && max.y == 5000000 + 8 * 18);
    vd_heightfield_destroy(context, &h);
}

static void dems_become_heightfields(void **state) {
    (void)state;
    vd_dem *dem = NULL;
    assert_ok(vd_dem_create(context, 5, 3, &dem));
    dem->kind = VD_CRS_GEOGRAPHIC;
    const double t[6] = {6.0, 0.001, 0.0, 46.0, 0.0, -0.001};
    memcpy(dem->transform, t, sizeof t);
    dem->heights[2] = 1234.5f;
    vd_heightfield *h = NULL;
    assert_ok(vd_heightfield_from_dem(dem, NULL, NULL, &h));
    assert_int_equal(h->height_type, VD_HEIGHT_F32);
    assert_true(h->holes == 14 && h->max == 1234.5f && vd_heightfield_at(h, 2, 0) == 1234.5f);
    assert_true(fabs(h->world_from_sample[0] + 2 * h->world_from_sample[1]) < 1e-9);
    assert_true(fabs(h->world_from_sample[1] - 77.46) < 0.1);
    assert_true(fabs(h->world_from_sample[5] + 111.15) < 0.1);
    vd_heightfield_destroy(context, &h);
    vd_dem_destroy(&dem);
}

/* ---- colours --------------------------------------------------------------------------------- */

static void colors_are_converted(void **state) {
    (void)state;
    const float heights[8] = {1, 2, 0, 0, 0, 3, 4, 0};
    for (int channels = 1; channels <= 4; channels++) {
        for (int bits = 8; bits <= 16; bits += 8) {
            vd_picture *picture = NULL;
            assert_ok(vd_picture_create(context, 3, 2, channels, bits, &picture));
            for (int y = 0; y < 2; y++) {
                uint8_t *row = (uint8_t *)picture->data + (size_t)y * picture->stride_bytes;
                for (int i = 0; i < 3 * channels; i++) {
                    uint8_t v = (uint8_t)(40 * y + 17 * i + 5);
                    if (bits == 8) {
                        row[i] = v;
                    } else {
                        ((uint16_t *)(void *)row)[i] = (uint16_t)(v * 257);
                    }
                }
            }
            vd_heightfield_def def = vd_heightfield_def_default();
            def.width = def.height = 2;
            def.heights = heights;
            def.height_stride = 5;
            def.colors = picture;
            vd_heightfield *h = NULL;
            assert_ok(vd_heightfield_create(context, &def, &h));
            assert_true(h->color_width == 3 && h->color_height == 2);
            assert_int_equal(h->color_offset_bytes % 64, 0);
            /* Outer edges meet: sample −½ is the picture's edge 0, sample 1½ its edge 3. */
            const double *c = h->color_from_sample;
            assert_true(c[0] - 0.5 * c[1] == 0.0 && c[0] + 1.5 * c[1] == 3.0);
            assert_true(c[3] - 0.5 * c[5] == 0.0 && c[3] + 1.5 * c[5] == 2.0);
            for (int y = 0; y < 2; y++) {
                for (int x = 0; x < 3; x++) {
                    vd_rgba8 color = vd_heightfield_colors(h)[(size_t)y * h->color_stride + x];
                    int first = 40 * y + 17 * x * channels + 5;
                    assert_int_equal(color.r, first & 255);
                    assert_int_equal(color.b, (channels < 3 ? first : first + 34) & 255);
                    assert_int_equal(color.a, channels == 2   ? (first + 17) & 255
                                              : channels == 4 ? (first + 51) & 255
                                                              : 255);
                }
            }
            assert_ok(vd_heightfield_validate(h, (size_t)h->size_bytes));
            vd_heightfield_destroy(context, &h);
            const double placed[6] = {1, 2, 3, 4, 5, 6};
            def.color_from_sample = placed;
            assert_ok(vd_heightfield_create(context, &def, &h));
            assert_memory_equal(h->color_from_sample, placed, sizeof placed);
            vd_heightfield_destroy(context, &h);
            vd_picture_destroy(&picture);
        }
    }
}

static void bad_definitions_are_refused(void **state) {
    (void)state;
    const float heights[4] = {1, 2, 3, 4};
    vd_heightfield_def good = vd_heightfield_def_default();
    good.width = good.height = 2;
    good.heights = heights;
    good.height_stride = 2;
    vd_heightfield *h = NULL;
    for (int i = 0; i < 9; i++) {
        vd_heightfield_def def = good;
        static const double singular[6] = {0, 2, 4, 0, 1, 2}, nan[6] = {NAN, 1, 0, 0, 0, -1};
        vd_picture picture = {.width = 1, .height = 1, .channels = 1, .bits = 8};
        uint8_t grey = 0;
        switch (i) {
        case 0:
            def.width = 0;
            break;
        case 1:
            def.heights = NULL;
            break;
        case 2:
            def.height_stride = 1;
            break;
        case 3:
            def.type = VD_HEIGHT_TYPE_COUNT;
            break;
        case 4:
            memcpy(def.world_from_sample, singular, sizeof singular);
            break;
        case 5:
            memcpy(def.world_from_sample, nan, sizeof nan);
            break;
        case 6:
            def.colors = &picture; /* without data */
            break;
        case 7:
            picture.data = &grey;
            picture.stride_bytes = 1;
            def.colors = &picture;
            def.color_from_sample = nan;
            break;
        default:
            def.width = 65536;
            def.height_stride = 65536;
            break;
        }
        vd_status status = vd_heightfield_create(context, &def, &h);
        assert_int_equal(status.code, i == 8 ? VD_ERROR_LIMIT : VD_ERROR_ARGUMENT);
        assert_true(strlen(status.message) > 10);
        assert_null(h);
    }
    assert_int_equal(vd_heightfield_create(context, NULL, &h).code, VD_ERROR_ARGUMENT);
    assert_int_equal(vd_heightfield_from_dem(NULL, NULL, NULL, &h).code, VD_ERROR_ARGUMENT);
}

/* ---- blocks from outside --------------------------------------------------------------------- */

static void refuse(const void *block, size_t size, const char *field) {
    vd_status status = vd_heightfield_validate(block, size);
    if (status.code != VD_ERROR_FORMAT || !strstr(status.message, field)) {
        fail_msg("expected a refusal of %s, got: %s", field, status.message);
    }
}

static void wrong_fields_are_named(void **state) {
    (void)state;
    vd_heightfield *h = make_random(20, 12, VD_HEIGHT_F32, 4);
    const vd_heightfield good = *h;
    size_t size = (size_t)h->size_bytes;
#define WITH(change, field)                                                                        \
    do {                                                                                           \
        change;                                                                                    \
        h->checksum = vd_heightfield_checksum(h, size);                                            \
        refuse(h, size, field);                                                                    \
        *h = good;                                                                                 \
    } while (0)
    WITH(h->magic[3] = 'x', "magic");
    WITH(h->version = 2, "version");
    WITH(h->header_bytes = 64, "header_bytes");
    WITH(h->size_bytes += 64, "size_bytes");
    WITH(h->height_type = 3, "height_type");
    WITH(h->wraps = 2, "wraps");
    WITH(h->width = -1, "width");
    WITH(h->height = INT32_MAX, "height");
    WITH(h->height = 13, "size_bytes");
    WITH(h->color_width = 1, "color_width");
    WITH(h->color_offset_bytes = 64, "color_offset_bytes");
    WITH(h->color_from_sample[2] = 1, "color_from_sample");
    WITH(h->world_from_sample[1] = 0, "world_from_sample");
    WITH(h->world_from_sample[0] = (double)INFINITY, "world_from_sample");
    WITH(h->min = 0.5f, "min");
    WITH(h->max = NAN, "max");
    WITH(h->holes++, "holes");
    WITH(h->level_count++, "level_count");
    WITH(h->reserved = 1, "reserved");
    WITH(h->levels[1].offset_bytes += 64, "levels");
    WITH(h->levels[2].stride = UINT64_MAX, "levels");
#undef WITH
    h->checksum ^= 1;
    refuse(h, size, "checksum");
    *h = good;
    /* Contents that a right checksum does not save. */
    float *first = (float *)(void *)((uint8_t *)h + h->levels[0].offset_bytes);
    float kept = *first;
    *first = NAN;
    h->checksum = vd_heightfield_checksum(h, size);
    refuse(h, size, "heights");
    *first = kept;
    float *maximum = (float *)(void *)((uint8_t *)h + h->levels[2].offset_bytes);
    *maximum += 1.0f;
    h->checksum = vd_heightfield_checksum(h, size);
    refuse(h, size, "pyramid");
    *maximum -= 1.0f;
    *h = good;
    assert_ok(vd_heightfield_validate(h, size));
    refuse(h, size - 1, "size_bytes");
    refuse(h, 100, "header");
    assert_int_equal(vd_heightfield_validate((uint8_t *)h + 4, size - 4).code, VD_ERROR_ARGUMENT);
    assert_int_equal(vd_heightfield_validate(NULL, 0).code, VD_ERROR_ARGUMENT);
    vd_heightfield_destroy(context, &h);
}

/* Any one changed byte is noticed; with the checksum set right, anything goes but a crash. */
static void damaged_blocks_are_refused(void **state) {
    (void)state;
    for (int type = 0; type < VD_HEIGHT_TYPE_COUNT; type++) {
        vd_heightfield *h = make_random(13, 11, (vd_height_type)type, 8);
        size_t size = (size_t)h->size_bytes;
        uint8_t *bytes = (uint8_t *)h;
        for (size_t i = 0; i < size; i++) {
            bytes[i] ^= 0x40;
            assert_int_equal(vd_heightfield_validate(h, size).code, VD_ERROR_FORMAT);
            bytes[i] ^= 0x40;
        }
        uint8_t *copy = vd_allocate(context, 1, size);
        assert_non_null(copy);
        uint64_t seed = 77;
        for (int round = 0; round < 4000; round++) {
            memcpy(copy, h, size);
            int changes = 1 + (int)(test_random(&seed) % 4);
            for (int i = 0; i < changes; i++) {
                size_t range = test_random(&seed) % 4 ? sizeof *h : size;
                copy[test_random(&seed) % range] = (uint8_t)test_random(&seed);
            }
            uint64_t checksum = vd_heightfield_checksum(copy, size);
            memcpy(copy + offsetof(vd_heightfield, checksum), &checksum, sizeof checksum);
            vd_status status = vd_heightfield_validate(copy, size);
            assert_true(status.code == VD_OK || status.code == VD_ERROR_FORMAT);
        }
        vd_release(context, copy);
        vd_heightfield_destroy(context, &h);
    }
}

static void allocation_may_fail(void **state) {
    (void)state;
    test_allocator allocator = {0, 0, 0};
    vd_context *failing = test_failing_context(&allocator);
    allocator.fail_at = allocator.calls + 1;
    const float heights[1] = {1};
    vd_heightfield_def def = vd_heightfield_def_default();
    def.width = def.height = 1;
    def.heights = heights;
    def.height_stride = 1;
    vd_heightfield *h = NULL;
    assert_int_equal(vd_heightfield_create(failing, &def, &h).code, VD_ERROR_MEMORY);
    assert_null(h);
    assert_ok(vd_heightfield_create(failing, &def, &h));
    vd_heightfield_destroy(failing, &h);
    vd_context_destroy(&failing);
    assert_int_equal(allocator.live, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pyramid_holds_maxima),
        cmocka_unit_test(range_passes_over_holes),
        cmocka_unit_test(same_input_gives_the_same_block),
        cmocka_unit_test(heights_are_bilinear),
        cmocka_unit_test(cells_with_a_hole_are_holes),
        cmocka_unit_test(rotated_maps_are_inverted),
        cmocka_unit_test(dems_become_heightfields),
        cmocka_unit_test(colors_are_converted),
        cmocka_unit_test(bad_definitions_are_refused),
        cmocka_unit_test(wrong_fields_are_named),
        cmocka_unit_test(damaged_blocks_are_refused),
        cmocka_unit_test(allocation_may_fail),
    };
    return cmocka_run_group_tests_name("heightfield", tests, set_up, tear_down);
}
