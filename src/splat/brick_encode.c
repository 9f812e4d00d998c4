/* brick_encode.c: records become the bytes of a brick. */
#include <string.h>
#include "core/real.h"
#include "splat/brick_import.h"

/* Rounds (v − min) · 65535 / (max − min), v between them. */
static uint16_t quantise_coordinate(uint32_t v, uint32_t min, uint32_t max) {
    if (max == min) {
        return 0;
    }
    const uint64_t span = max - min;
    return (uint16_t)(((uint64_t)(v - min) * 65535u + span / 2) / span);
}

static void encode_axis(const vd_brick_source *s, size_t stride, int axis, uint16_t *out) {
    for (uint32_t i = 0; i < s->count; i++) {
        uint32_t v;
        memcpy(&v, s->records + i * stride + 4 * (size_t)axis, sizeof v);
        out[i] = quantise_coordinate(v, s->min[axis], s->max[axis]);
    }
}

static float record_value(const vd_brick_source *s, size_t stride, uint32_t i, uint32_t attribute) {
    float v;
    memcpy(&v, s->records + i * stride + 12 + 4 * (size_t)attribute, sizeof v);
    return v;
}

static uint32_t whole(float v, uint32_t most) {
    return v >= (float)most ? most : v > 0.0f ? (uint32_t)(v + 0.5f) : 0u;
}

/* What is stored linearly: the value or its logarithm. */
static float stored_scale(float v, uint32_t storage) {
    return storage == VD_BRICK_LOG ? (float)vd_log2((double)v) : v;
}

static void encode_scaled(const vd_brick_source *s, size_t stride, uint32_t attribute,
                          uint32_t storage, float range[2], uint16_t *out) {
    float low = 0.0f, high = 0.0f;
    for (uint32_t i = 0; i < s->count; i++) {
        const float v = record_value(s, stride, i, attribute);
        low = i == 0 || v < low ? v : low;
        high = i == 0 || v > high ? v : high;
    }
    low = stored_scale(low, storage);
    high = stored_scale(high, storage);
    const float step = (high - low) / 65535.0f;
    const float per_step = step > 0.0f ? 1.0f / step : 0.0f;
    for (uint32_t i = 0; i < s->count; i++) {
        const float v = stored_scale(record_value(s, stride, i, attribute), storage);
        out[i] = (uint16_t)whole((v - low) * per_step, 65535);
    }
    range[0] = low;
    range[1] = step;
}

float vd_brick_encode(const vd_bricks_attribute *attributes, uint32_t attribute_count,
                      const vd_brick_source *source, uint8_t *out) {
    const size_t stride = vd_record_bytes((int)attribute_count);
    float *ranges = (float *)out;
    float radius = 0.0f;
    out += vd_brick_pad(8 * (size_t)attribute_count);
    for (int axis = 0; axis < 3; axis++) {
        encode_axis(source, stride, axis, (uint16_t *)out);
        out += vd_brick_pad(2 * (size_t)source->count);
    }
    for (uint32_t a = 0; a < attribute_count; a++) {
        const uint32_t storage = attributes[a].storage;
        ranges[2 * a] = 0.0f;
        ranges[2 * a + 1] = 1.0f;
        if (storage == VD_BRICK_U8) {
            for (uint32_t i = 0; i < source->count; i++) {
                out[i] = (uint8_t)whole(record_value(source, stride, i, a), 255);
            }
        } else if (storage == VD_BRICK_U16) {
            for (uint32_t i = 0; i < source->count; i++) {
                ((uint16_t *)out)[i] = (uint16_t)whole(record_value(source, stride, i, a), 65535);
            }
        } else {
            encode_scaled(source, stride, a, storage, ranges + 2 * a, (uint16_t *)out);
        }
        for (uint32_t i = 0; i < source->count && attributes[a].kind == VD_ATTRIBUTE_RADIUS; i++) {
            const float r = record_value(source, stride, i, a);
            radius = r > radius ? r : radius;
        }
        out += vd_brick_pad(source->count * vd_brick_value_bytes(storage));
    }
    return radius;
}
