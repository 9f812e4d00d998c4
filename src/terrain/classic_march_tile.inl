/* classic_march_tile.inl: tiles of 16 columns from their first slice to the picture; included by
 * classic_march.inl.
 */

/* s and b of the essay for one column and one axis. */
static void begin_axis(const vd_march_picture *picture, float direction, float eye, float *slices,
                       float *begin) {
    const vd_classic_setup *setup = picture->setup;
    const float last = picture->segments[picture->segment_count - 1].last;
    const float z_last = setup->z0 + last * setup->step;
    if (floorf(eye + setup->z0 * direction) == floorf(eye + z_last * direction)) {
        *slices = 0.0f;
        *begin = 1e30f;
        return;
    }
    const double per_sample = 1.0 / ((double)direction * setup->step);
    const double first = (double)setup->z0 / setup->step;
    const double unsure = 0x1p-22 * fabs((double)eye) * fabs(per_sample);
    const bool finite = fabs(per_sample) < 1e30 && first < 1e30 && unsure < 1e30;
    *slices = finite ? (float)(per_sample * (1.0 - 0x1p-20)) : 0.0f;
    *begin = finite ? (float)(-first - unsure) : -1e30f;
}

/* Moves a packet to the first slice of a segment, whose map is coarser than the one before. */
static void begin_segment(const vd_march_segment *segment, float step, packet *p) {
    const float scale = segment->scale / p->segment->scale;
    p->segment = segment;
    p->direction_x *= scale;
    p->direction_y *= scale;
    p->slices_x *= 1.0f / scale;
    p->slices_y *= 1.0f / scale;
    p->step_x = step * p->direction_x;
    p->step_y = step * p->direction_y;
    p->bend = 2.0f * p->step_x * p->step_y;
    p->unsure = 0x1p-20f * (absolute(p->direction_x) + absolute(p->direction_y));
    p->level = vd_wide_splat_i32(0);
    p->k = vd_wide_blend_f32(vd_wide_less_f32(vd_wide_splat_f32(0.0f), p->hidden),
                             vd_wide_splat_f32(segment->first),
                             vd_wide_splat_f32(segment->last + 1.0f));
}

/* The same for the next segment; false where there is none, or nothing left to see. */
static bool next_segment(const vd_march_picture *picture, packet *p) {
    const ptrdiff_t next = p->segment - picture->segments + 1;
    if (next >= picture->segment_count ||
        vd_wide_bits(vd_wide_less_f32(vd_wide_splat_f32(0.0f), p->hidden)) == 0) {
        return false;
    }
    begin_segment(&picture->segments[next], picture->setup->step, p);
    return true;
}

/* `marches`: false for the sweep, which has no use for edges. */
static __attribute__((noinline)) void begin_packet(const vd_march_picture *picture, int slot_number,
                                                   int tile, int group, bool marches, packet *p) {
    const vd_classic_setup *setup = picture->setup;
    const int width = setup->frame->width, height = setup->frame->height;
    memset(p, 0, sizeof *p);
    for (int lane = 0; lane < LANES; lane++) {
        const int column = tile * VD_MARCH_TILE + group * LANES + lane;
        const int here = column < width ? column : width - 1;
        const float x = setup->direction_x[here], y = setup->direction_y[here];
        p->direction_x[lane] = x;
        p->direction_y[lane] = y;
        if (marches) {
            float slices, begin;
            begin_axis(picture, x, setup->eye_x, &slices, &begin);
            p->slices_x[lane] = slices;
            p->begin_x[lane] = begin;
            begin_axis(picture, y, setup->eye_y, &slices, &begin);
            p->slices_y[lane] = slices;
            p->begin_y[lane] = begin;
        }
        p->forward_x[lane] = x > 0.0f ? 1.0f : 0.0f;
        p->forward_y[lane] = y > 0.0f ? 1.0f : 0.0f;
        p->flip_x[lane] = x > 0.0f ? 0 : 1;
        p->flip_y[lane] = y > 0.0f ? 0 : 1;
        p->hidden[lane] = column < width ? (float)height : 0.0f;
        p->pixel[lane] = slot_number * height * VD_MARCH_TILE + group * LANES + lane;
    }
    static const vd_march_segment whole = {.scale = 1.0f};
    p->segment = &whole;
    begin_segment(&picture->segments[0], setup->step, p);
}

/* Takes the next tile; −1 when there is none. */
static int take_tile(vd_march_picture *picture) {
    if (atomic_load(&picture->interrupted)) {
        return -1;
    }
    if (vd_job_stopped(picture->setup->job)) {
        atomic_store(&picture->interrupted, true);
        return -1;
    }
    const int tile = atomic_fetch_add(&picture->next_tile, 1);
    return tile < picture->tiles ? tile : -1;
}

VD_CLASSIC_INLINE void begin_slot(vd_march_picture *picture, slot *slots, int number,
                                  bool power_of_two, bool deep, bool ahead) {
    slot *s = &slots[number];
    s->tile = take_tile(picture);
    s->alive = s->tile < 0 ? 0 : (1u << GROUPS) - 1;
    for (int group = 0; group < GROUPS && s->tile >= 0; group++) {
        begin_packet(picture, number, s->tile, group, true, &s->packets[group]);
        if (ahead) {
            s->packets[group].next = locate(picture, &s->packets[group], power_of_two, deep);
        }
    }
}

/* Depth and id of a tile; its colours tell where runs begin. */
static void flush_planes(const vd_frame *frame, const vd_march_scratch *scratch, size_t at,
                         int first, int columns) {
    float depth[VD_MARCH_TILE] = {0};
    uint32_t id[VD_MARCH_TILE] = {0};
    for (int row = 0; row < frame->height; row++, at += VD_MARCH_TILE) {
        for (int i = 0; i < VD_MARCH_TILE; i++) {
            if (scratch->tiles[at + (size_t)i] != 0) {
                id[i] = 1;
                depth[i] = frame->depth != NULL ? scratch->depths[at + (size_t)i] : 0.0f;
            }
        }
        const size_t to = (size_t)row * frame->stride + (size_t)first;
        if (frame->depth != NULL) {
            memcpy(frame->depth + to, depth, (size_t)columns * sizeof *depth);
        }
        if (frame->id != NULL) {
            memcpy(frame->id + to, id, (size_t)columns * sizeof *id);
        }
    }
}

/* Fills the curtains of a tile as the option smooth defines: upwards to find where each run ends,
 * then downwards. The first row of a run of n pixels has its colour, as have the rows of a run
 * without one before it, which ends at the picture's bottom. */
static void smooth_tile(const vd_frame *frame, uint32_t *tile, int32_t *below) {
    const vd_wide_i32 zero = vd_wide_splat_i32(0);
    for (int group = 0; group < GROUPS; group++) {
        vd_wide_i32 end = vd_wide_splat_i32(frame->height), here;
        for (int row = frame->height - 1; row >= 0; row--) {
            const size_t at = (size_t)row * VD_MARCH_TILE + (size_t)group * LANES;
            memcpy(below + at, &end, sizeof end);
            memcpy(&here, tile + at, sizeof here);
            end = vd_wide_blend_i32(vd_wide_equal_i32(here, zero), end, vd_wide_splat_i32(row));
        }
    }
    uint32_t top[VD_MARCH_TILE] = {0}, bottom[VD_MARCH_TILE] = {0};
    uint32_t slope[VD_MARCH_TILE] = {0}, part[VD_MARCH_TILE] = {0};
    for (int row = 0; row < frame->height; row++, tile += VD_MARCH_TILE, below += VD_MARCH_TILE) {
        for (int i = 0; i < VD_MARCH_TILE; i++) {
            if (tile[i] == 0) {
                continue;
            }
            const int32_t pixels = below[i] - row;
            const bool first = below[i] == frame->height;
            top[i] = tile[i];
            bottom[i] = first ? top[i] : tile[(size_t)pixels * VD_MARCH_TILE + (size_t)i];
            slope[i] = 65536u / (uint32_t)pixels;
            part[i] = 0;
        }
        for (int group = 0; group < GROUPS; group++) {
            const int i = group * LANES;
            const vd_wide_u32 w = vd_wide_load_u32(part + i) >> 8;
            vd_wide_store_u32(tile + i,
                              mix(vd_wide_load_u32(top + i), vd_wide_load_u32(bottom + i), w));
            vd_wide_store_u32(part + i, vd_wide_load_u32(part + i) + vd_wide_load_u32(slope + i));
        }
    }
}

/* Writes a tile out: a row shows the colour of the last run that began at or above it. The picture
 * is written a line at a time and not read again here, so it goes past the caches, which belong to
 * the map (700 × 512: 7 % faster, 1920 × 1080: 14 %). */
static void flush(const vd_march_picture *picture, vd_march_scratch *scratch, int slot_number,
                  int tile) {
    const vd_classic_setup *setup = picture->setup;
    const vd_frame *frame = setup->frame;
    const int first = tile * VD_MARCH_TILE;
    const int columns = frame->width - first < VD_MARCH_TILE ? frame->width - first : VD_MARCH_TILE;
    const size_t at = (size_t)slot_number * (size_t)frame->height * VD_MARCH_TILE;
    uint32_t *from = scratch->tiles + at;
    uint32_t *to = (uint32_t *)(void *)frame->rgba + first;
    const bool lines = columns == VD_MARCH_TILE && frame->stride % VD_MARCH_TILE == 0 &&
                       (uintptr_t)to % (VD_MARCH_TILE * sizeof *to) == 0;
    if (frame->depth != NULL || frame->id != NULL) {
        flush_planes(frame, scratch, at, first, columns);
    }
    if (setup->smooth) {
        smooth_tile(frame, from, scratch->below);
    }
    const vd_wide_i32 zero = vd_wide_splat_i32(0);
    vd_wide_i32 color[GROUPS];
    for (int group = 0; group < GROUPS; group++) {
        color[group] = vd_wide_splat_i32((int32_t)setup->background);
    }
    for (int row = 0; row < frame->height; row++) {
        for (int group = 0; group < GROUPS; group++) {
            vd_wide_i32 here;
            memcpy(&here, from + group * LANES, sizeof here);
            memcpy(from + group * LANES, &zero, sizeof zero);
            color[group] = vd_wide_blend_i32(vd_wide_equal_i32(here, zero), color[group], here);
        }
        if (lines) {
            for (int group = 0; group < GROUPS; group++) {
                vd_wide_stream_i32(to + group * LANES, color[group]);
            }
        } else {
            memcpy(to, color, (size_t)columns * sizeof *to);
        }
        from += VD_MARCH_TILE;
        to += frame->stride;
    }
    vd_wide_fence();
}
