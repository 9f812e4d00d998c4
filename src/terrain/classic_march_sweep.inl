/* classic_march_sweep.inl: every slice, 16 columns at once; included by classic_march.inl.
 *
 * For growing steps, which pass several samples at once, and for few slices: there is nothing that
 * a pyramid could pass over. The slices' z and rises stand in a table.
 */

/* The slices of a segment for a tile's columns, until the highest height cannot be seen any more.
 * Returns false when the job was stopped. */
VD_CLASSIC_INLINE bool sweep_segment(const vd_march_picture *picture,
                                     const vd_march_segment *segment, vd_march_scratch *scratch,
                                     packet *packets, vd_height_type type, bool power_of_two,
                                     bool deep, bool linear) {
    const vd_classic_setup *setup = picture->setup;
    const vd_march_map *map = segment->map;
    const uint32_t last = (uint32_t)segment->last;
    const float above = setup->eye_height - map->highest;
    const float nearest_top = above * picture->slice_rise[last] + setup->horizon;
    size_t count = 0;
    bool finished = true;
    for (uint32_t k = (uint32_t)segment->first; k <= last; k++) {
        const float z = picture->slice_z[k], rise = picture->slice_rise[k];
        if (k % 8 == 0) {
            float top = above < 0.0f ? above * rise + setup->horizon : nearest_top;
            top = top < 0.0f ? 0.0f : top;
            uint32_t alive = 0;
            for (int group = 0; group < GROUPS; group++) {
                alive |=
                    vd_wide_bits(vd_wide_less_f32(vd_wide_splat_f32(top), packets[group].hidden));
            }
            if (alive == 0) {
                break;
            }
            if (k % POLL_STEPS == 0 && vd_job_stopped(setup->job)) {
                finished = false;
                break;
            }
        }
        for (int group = 0; group < GROUPS; group++) {
            packet *p = &packets[group];
            const vd_wide_f32 at_x = segment->eye_x + z * p->direction_x;
            const vd_wide_f32 at_y = segment->eye_y + z * p->direction_y;
            const vd_wide_f32 x = vd_wide_floor_f32(at_x), y = vd_wide_floor_f32(at_y);
            vd_wide_i32 column, row;
            if (power_of_two) {
                column = vd_wide_to_i32(x) & vd_wide_splat_i32(map->mask_x[0]);
                row = vd_wide_to_i32(y) & vd_wide_splat_i32(map->mask_y[0]);
            } else {
                column = vd_wide_to_i32(wrap(x, (float)map->width, 1.0f / (float)map->width));
                row = vd_wide_to_i32(wrap(y, (float)map->height, 1.0f / (float)map->height));
            }
            const vd_wide_i32 index = column + (row << 3) + (column & ~7) * map->mask_y[0];
            vd_wide_f32 height;
            if (linear) {
                const vd_wide_i32 level = vd_wide_splat_i32(0);
                const patch four =
                    gather_patch(map, vd_wide_equal_i32(level, level), column, row, level, type);
                height = patch_height(&four, at_x - x, at_y - y, type);
            } else {
                height = gather_height(map, index, type);
            }
            const vd_wide_f32 top = (setup->eye_height - height) * rise + setup->horizon;
            const vd_wide_f32 zero = vd_wide_splat_f32(0.0f);
            const vd_wide_mask seen =
                vd_wide_less_f32(top, p->hidden) & vd_wide_less_f32(zero, p->hidden);
            if (vd_wide_bits(seen) == 0) {
                continue;
            }
            const vd_wide_i32 first =
                vd_wide_to_i32(vd_wide_max_f32(vd_wide_blend_f32(seen, top, zero), zero));
            const vd_wide_f32 depth_z = vd_wide_splat_f32(z);
            if (linear) {
                count = linear_found(picture, map, scratch, count, seen, first, p->pixel, column,
                                     row, at_x - x, at_y - y, depth_z);
            } else {
                count = found(picture, map, scratch, count, seen, first, p->pixel,
                              type == VD_HEIGHT_U8 ? index : column + row * map->color_stride,
                              depth_z, deep);
            }
            p->hidden =
                vd_wide_blend_f32(seen, __builtin_convertvector(first, vd_wide_f32), p->hidden);
        }
    }
    drain_list(map, scratch, count, deep, linear);
    return finished;
}

VD_CLASSIC_INLINE void sweep(vd_march_picture *picture, vd_march_scratch *scratch,
                             vd_height_type type, bool power_of_two, bool deep, bool linear) {
    packet packets[GROUPS];
    for (int tile; (tile = take_tile(picture)) >= 0;) {
        for (int group = 0; group < GROUPS; group++) {
            begin_packet(picture, 0, tile, group, false, &packets[group]);
        }
        bool going = true;
        for (int i = 0; i < picture->segment_count && going; i++) {
            for (int group = 0; group < GROUPS && i > 0; group++) {
                begin_segment(&picture->segments[i], picture->setup->step, &packets[group]);
            }
            going = sweep_segment(picture, &picture->segments[i], scratch, packets, type,
                                  power_of_two, deep, linear);
        }
        if (!going) {
            atomic_store(&picture->interrupted, true);
        }
        flush(picture, scratch, 0, tile);
    }
}
