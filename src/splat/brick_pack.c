/* brick_pack.c: a node of a brick file becomes a block for whoever draws it far from the file.
 *
 * Colours are looked up here, by the splatter's own tables: the block has what comes out. Where all
 * are the same, as in much of a cloud coloured by classes, one is enough. */
#include <math.h>
#include <string.h>
#include "core/core.h"
#include "splat/brick_pack.h"
#include "splat/splat_internal.h"

static bool has_color(const vd_brick_view_def *view) {
    return view->color != VD_BRICK_COLOR_CONSTANT;
}

int vd_brick_radius_of(const vd_bricks *bricks, const vd_brick_view_def *view) {
    int radius = -1;
    for (uint32_t a = 0; a < bricks->attribute_count && view->radius_m <= 0.0; a++) {
        radius = bricks->attributes[a].kind == VD_ATTRIBUTE_RADIUS ? (int)a : radius;
    }
    return radius;
}

size_t vd_brick_pack_bytes(const vd_bricks *bricks, uint32_t node, const vd_brick_view_def *view) {
    const uint32_t parts = (vd_brick_radius_of(bricks, view) >= 0 ? VD_BLOCK_RADII : 0u) |
                           (has_color(view) ? VD_BLOCK_COLORS : 0u);
    return vd_brick_block_layout(bricks->nodes[node].count, parts).size_bytes;
}

/* ---- radii ------------------------------------------------------------------------------------*/

static void pack_radii(const float *values, double grow, vd_brick_block_head *head, uint16_t *out) {
    double sum = 0.0;
    float most = 0.0f;
    for (uint32_t i = 0; i < head->count; i++) {
        sum += (double)values[i] * (double)values[i];
        most = values[i] > most ? values[i] : most;
    }
    head->radius = (float)((double)(float)sqrt(sum / head->count) * grow);
    head->radius_step = (float)(grow * (double)most / 65535.0);
    const float per_step = most > 0.0f ? 65535.0f / most : 0.0f;
    for (uint32_t i = 0; i < head->count; i++) {
        const float v = values[i] * per_step + 0.5f;
        out[i] = (uint16_t)(v > 0.0f ? v < 65535.0f ? v : 65535.0f : 0.0f);
    }
}

/* ---- colours ----------------------------------------------------------------------------------*/

static vd_rgba8 color_of(uint32_t bytes) {
    return (vd_rgba8){(uint8_t)bytes, (uint8_t)(bytes >> 8), (uint8_t)(bytes >> 16),
                      (uint8_t)(bytes >> 24)};
}

/* Looks colours up as the splatter would. `values`: room for as many numbers. */
static void pack_colors(const vd_bricks *bricks, const vd_brick *brick,
                        const vd_brick_view_def *view, const vd_splat_picture *picture,
                        float *values, vd_rgba8 *out) {
    const uint8_t *r = NULL, *g = NULL, *b = NULL, *classes = NULL;
    if (view->color == VD_BRICK_COLOR_RGB) {
        r = brick->values[vd_bricks_find(bricks, "red")];
        g = brick->values[vd_bricks_find(bricks, "green")];
        b = brick->values[vd_bricks_find(bricks, "blue")];
    } else if (view->color == VD_BRICK_COLOR_CLASS) {
        classes = brick->values[view->attribute];
    } else if (view->color == VD_BRICK_COLOR_VALUE) {
        vd_bricks_values(bricks, brick, view->attribute, values);
    } else {
        for (uint32_t i = 0; i < brick->count; i++) {
            values[i] = (float)brick->origin[2] + (float)brick->step[2] * (float)brick->z[i];
        }
    }
    for (uint32_t i = 0; i < brick->count; i++) {
        out[i] = r != NULL ? (vd_rgba8){r[i], g[i], b[i], 255}
                 : classes != NULL
                     ? color_of(picture->class_colors[classes[i]])
                     : color_of(picture->palette[vd_splat_palette_index(picture, values[i])]);
    }
}

static bool are_same(const vd_rgba8 *colors, uint32_t count) {
    uint32_t i = 1;
    while (i < count && memcmp(&colors[0], &colors[i], sizeof colors[0]) == 0) {
        i++;
    }
    return i >= count;
}

/* ---- the block --------------------------------------------------------------------------------*/

static void fill_head(const vd_bricks *bricks, const vd_bricks_node *n, const vd_brick *brick,
                      const vd_brick_view_def *view, vd_brick_block_head *head) {
    const double grow = view->radius_scale > 0.0 ? view->radius_scale : 1.0;
    const double own = view->radius_m > 0.0 ? view->radius_m : vd_brick_view_radius(bricks);
    *head = (vd_brick_block_head){.magic = {'V', 'D', 'B', 'R', 'I', 'C', 'K', 1},
                                  .stands_for = (double)n->leaves / n->count,
                                  .count = n->count,
                                  .kernel = (uint32_t)view->kernel,
                                  .color = view->constant,
                                  .radius = (float)(own * grow),
                                  .opacity = (float)(view->opacity > 0.0 ? view->opacity : 1.0)};
    for (int k = 0; k < 3; k++) {
        head->step[k] = (float)brick->step[k];
    }
}

static void write_block(const vd_brick *brick, const vd_brick_block_head *head,
                        const uint16_t *radii, const vd_rgba8 *colors, uint8_t *out,
                        size_t *bytes) {
    const vd_brick_layout l = vd_brick_block_layout(head->count, head->parts);
    const size_t axis = 2 * (size_t)head->count;
    memset(out, 0, l.size_bytes);
    memcpy(out, head, sizeof *head);
    memcpy(out + l.x, brick->x, axis);
    memcpy(out + l.y, brick->y, axis);
    memcpy(out + l.z, brick->z, axis);
    if ((head->parts & VD_BLOCK_RADII) != 0) {
        memcpy(out + l.radius, radii, axis);
    }
    if ((head->parts & VD_BLOCK_COLORS) != 0) {
        memcpy(out + l.color, colors, 2 * axis);
    }
    vd_brick_block_head *written = (vd_brick_block_head *)(void *)out;
    written->checksum = vd_brick_block_checksum(out, l.size_bytes);
    *bytes = l.size_bytes;
}

vd_status vd_brick_pack(vd_context *context, const vd_bricks *bricks, uint32_t node,
                        const vd_brick_view_def *view, const vd_splat_def *splat, uint8_t *out,
                        size_t *bytes) {
    const vd_bricks_node *n = &bricks->nodes[node];
    const size_t count = n->count;
    vd_brick brick;
    vd_status status = vd_bricks_brick(bricks, node, &brick);
    if (status.code != VD_OK) {
        return status;
    }
    /* Numbers, radii, colours, the tables. */
    float *values = vd_allocate(context, count, 4 + 2 + 4);
    vd_splat_picture *picture = vd_allocate(context, 1, sizeof *picture);
    if (values == NULL || picture == NULL) {
        status = vd_out_of_memory("a brick's block", 10 * count + sizeof *picture);
    } else {
        vd_rgba8 *colors = (vd_rgba8 *)(values + count);
        uint16_t *radii = (uint16_t *)(colors + count);
        vd_brick_block_head head;
        const int radius = vd_brick_radius_of(bricks, view);
        fill_head(bricks, n, &brick, view, &head);
        if (radius >= 0) {
            vd_bricks_values(bricks, &brick, radius, values);
            pack_radii(values, view->radius_scale > 0.0 ? view->radius_scale : 1.0, &head, radii);
            head.parts |= VD_BLOCK_RADII;
        }
        if (has_color(view)) {
            static const vd_splat_profile none[2];
            vd_splat_picture_init(picture, splat, 1, 1, none);
            vd_splat_picture_set_range(picture, splat, splat->range_min, splat->range_max);
            pack_colors(bricks, &brick, view, picture, values, colors);
            head.color = colors[0];
            head.parts |= are_same(colors, head.count) ? 0u : VD_BLOCK_COLORS;
        }
        write_block(&brick, &head, radii, colors, out, bytes);
    }
    vd_release(context, picture);
    vd_release(context, values);
    return status;
}
