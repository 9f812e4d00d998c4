/* brick_sample.c: the particles of a parent.
 *
 * The children's particles, each of which stands for some number w of particles of the data, are
 * laid end to end in Morton order, w long, and the line is cut into n equal strata; a particle that
 * lies over a cut belongs to both, by its shares. Each stratum, about eight neighbours, becomes one
 * particle: the one of them nearest to the stratum's middle, with the mean of the attributes
 * (radii: the root of the mean square; categories: its own). So every particle of a node stands for
 * exactly leaves / n particles, and sums over a node of 1, of the area and of every scalar are
 * those of its children, up to rounding.
 *
 * Tried: the middle itself in place of the particle nearest to it; pictures of 5 M particles at two
 * pixels are no nearer to those of all (RMS 10.2 against 9.4 of 255), and surfaces shrink. */
#include <math.h>
#include <string.h>
#include "splat/brick_tree.h"

/* One stratum as it is gathered. */
typedef struct stratum {
    double weight, spread2;
    double place[3], values[VD_MAX_ATTRIBUTES];
    uint32_t child_first, from; /* its first member */
} stratum;

uint32_t vd_tree_sample_count(uint64_t total, uint32_t leaf_particles) {
    const uint64_t eighth = (total + 7) / 8, half = (total + 1) / 2;
    const uint64_t least = half < leaf_particles / 8 ? half : leaf_particles / 8;
    return (uint32_t)(eighth > least ? eighth : least);
}

static void take(stratum *s, const uint8_t *record, uint32_t attribute_count,
                 const vd_bricks_attribute *attributes, double weight, double spread2) {
    uint32_t q[3];
    memcpy(q, record, sizeof q);
    s->weight += weight;
    s->spread2 += weight * spread2;
    for (int k = 0; k < 3; k++) {
        s->place[k] += weight * (double)q[k];
    }
    for (uint32_t a = 0; a < attribute_count; a++) {
        float v;
        memcpy(&v, record + 12 + 4 * (size_t)a, sizeof v);
        const double d = (double)v;
        s->values[a] += weight * (attributes[a].kind == VD_ATTRIBUTE_RADIUS ? d * d : d);
    }
}

static double distance2(const uint8_t *record, const double middle[3]) {
    uint32_t q[3];
    memcpy(q, record, sizeof q);
    double sum = 0.0;
    for (int k = 0; k < 3; k++) {
        const double d = (double)q[k] - middle[k];
        sum += d * d;
    }
    return sum;
}

/* Writes the stratum as a record; `last_child` and `last` name its last member. Returns the mean
 * square distance of the data from it. */
static double finish(const stratum *s, const vd_tree_pending *children, size_t stride,
                     uint32_t last_child, uint32_t last, const vd_bricks_attribute *attributes,
                     uint32_t attribute_count, uint8_t *out) {
    double middle[3], best2 = (double)INFINITY, moment = 0.0;
    for (int k = 0; k < 3; k++) {
        middle[k] = s->place[k] / s->weight;
    }
    const uint8_t *best = NULL;
    for (uint32_t c = s->child_first, i = s->from; c <= last_child; c++, i = 0) {
        const uint32_t end = c == last_child ? last + 1 : children[c].count;
        for (; i < end; i++) {
            const uint8_t *record = children[c].records + i * stride;
            const double d2 = distance2(record, middle);
            if (d2 < best2) {
                best2 = d2;
                best = record;
            }
        }
    }
    double weights = 0.0;
    for (uint32_t c = s->child_first, i = s->from; c <= last_child; c++, i = 0) {
        const uint32_t end = c == last_child ? last + 1 : children[c].count;
        const double w = (double)children[c].leaves / children[c].count;
        for (; i < end; i++) {
            uint32_t q[3];
            memcpy(q, best, sizeof q);
            const double at[3] = {(double)q[0], (double)q[1], (double)q[2]};
            moment += w * distance2(children[c].records + i * stride, at);
            weights += w;
        }
    }
    memcpy(out, best, stride);
    for (uint32_t a = 0; a < attribute_count; a++) {
        const double mean = s->values[a] / s->weight;
        const float v = (float)(attributes[a].kind == VD_ATTRIBUTE_RADIUS ? sqrt(mean) : mean);
        if (attributes[a].kind != VD_ATTRIBUTE_CATEGORY) {
            memcpy(out + 12 + 4 * (size_t)a, &v, sizeof v);
        }
    }
    return moment / weights + s->spread2 / s->weight;
}

static void measure(const vd_tree_pending *children, uint32_t count, vd_tree_pending *out) {
    out->leaves = 0;
    memcpy(out->min, children[0].min, sizeof out->min);
    memcpy(out->max, children[0].max, sizeof out->max);
    for (uint32_t c = 0; c < count; c++) {
        out->leaves += children[c].leaves;
        for (int k = 0; k < 3; k++) {
            out->min[k] = children[c].min[k] < out->min[k] ? children[c].min[k] : out->min[k];
            out->max[k] = children[c].max[k] > out->max[k] ? children[c].max[k] : out->max[k];
        }
    }
}

void vd_tree_sample(const vd_bricks_attribute *attributes, uint32_t attribute_count,
                    const vd_tree_pending *children, uint32_t count, uint32_t most,
                    vd_tree_pending *out) {
    const size_t stride = vd_record_bytes((int)attribute_count);
    measure(children, count, out);
    out->count = most;
    const double each = (double)out->leaves / most;
    stratum s = {0};
    double spread2 = 0.0;
    uint32_t made = 0, last_child = 0, last = 0;
    for (uint32_t c = 0; c < count; c++) {
        const double w = (double)children[c].leaves / children[c].count;
        for (uint32_t i = 0; i < children[c].count; i++) {
            const uint8_t *record = children[c].records + i * stride;
            double left = w;
            /* The last stratum takes what rounding left. */
            while (made + 1 < most && s.weight + left >= each) {
                const double share = each - s.weight;
                take(&s, record, attribute_count, attributes, share, children[c].spread2);
                spread2 += finish(&s, children, stride, c, i, attributes, attribute_count,
                                  out->records + made++ * stride);
                left -= share;
                s = (stratum){.child_first = c, .from = i};
            }
            if (left > 1e-9 * w) {
                take(&s, record, attribute_count, attributes, left, children[c].spread2);
            } else if (s.weight == 0.0) {
                const bool more = i + 1 < children[c].count;
                s.child_first = more ? c : c + 1;
                s.from = more ? i + 1 : 0;
            }
            last_child = c;
            last = i;
        }
    }
    if (made < most && s.weight > 0.0) {
        spread2 += finish(&s, children, stride, last_child, last, attributes, attribute_count,
                          out->records + made++ * stride);
    }
    out->count = made;
    out->spread2 = spread2 / made;
}
