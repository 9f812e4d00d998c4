/* shadow_block.inl: counting one band of rows, for one type of heights. shadow_kernels.inl defines
 *   SAMPLE, VECTOR, LANES    the type, its vector, samples in one
 *   COUNT, MAXIMA            the names of the two kernels made here
 *   LOWEST, GROUND, RUNS     and of what they use
 *   COUNTER                  a vector of as many lanes, for the counts
 *   base_heights(v)          heights to compare from (holes become infinite)
 *   count_under(count, base, there, slab, k)   adds 1 where the ray of step k is under the ground
 *   is_above(lowest, slab, k, ground)          true when no ray of a block is under `ground` */

/* The highest ground that the rays of `columns` × VD_SHADOW_ROWS cells pass over in steps
 * [from, to). */
static inline float GROUND(const vd_shadow_slab *slab, int column, int row, int columns, int from,
                           int to) {
    const vd_shadow_plan *plan = slab->plan;
    const int xa = column + plan->dx[from], xb = column + plan->dx[to - 1];
    const int ya = row + plan->dy[from], yb = row + plan->dy[to - 1];
    const int left = xa < xb ? xa : xb, right = (xa < xb ? xb : xa) + columns - 1;
    const int top = ((ya < yb ? ya : yb) + slab->rows_above) / VD_SHADOW_TILE_HEIGHT;
    const int bottom =
        ((ya < yb ? yb : ya) + slab->rows_above + VD_SHADOW_ROWS - 1) / VD_SHADOW_TILE_HEIGHT;
    return highest_tile(slab, left, right, top, bottom);
}

/* The lowest height of a block. A hole makes it −infinity, and then nothing is skipped. */
static inline SAMPLE LOWEST(const SAMPLE *first, ptrdiff_t pitch) {
    SAMPLE least[LANES];
    memcpy(least, first, sizeof least);
    for (int r = 1; r < VD_SHADOW_ROWS; r++) {
        for (int i = 0; i < LANES; i++) {
            const SAMPLE h = first[r * pitch + i];
            least[i] = h < least[i] ? h : least[i];
        }
    }
    for (int i = 1; i < LANES; i++) {
        least[0] = least[i] < least[0] ? least[i] : least[0];
    }
    return least[0];
}

/* Which of the runs of steps, bit i for run i, may bring a ray of `columns` cells under the ground.
 */
static inline uint32_t RUNS(const vd_shadow_slab *slab, const SAMPLE *first, int column, int row,
                            int columns, uint32_t of) {
    const vd_shadow_plan *plan = slab->plan;
    SAMPLE lowest = LOWEST(first, (ptrdiff_t)slab->pitch);
    for (int i = LANES; i < columns; i += LANES) {
        const SAMPLE next = LOWEST(first + i, (ptrdiff_t)slab->pitch);
        lowest = next < lowest ? next : lowest;
    }
    uint32_t runs = 0;
    for (; of != 0; of &= of - 1) {
        const int run = __builtin_ctz(of), from = run * VD_SHADOW_RUN;
        if (from >= plan->steps || is_above(lowest, slab, from, slab->highest)) {
            break;
        }
        const int to = from + VD_SHADOW_RUN < plan->steps ? from + VD_SHADOW_RUN : plan->steps;
        const float ground = GROUND(slab, column, row, columns, from, to);
        runs |= (uint32_t)!is_above(lowest, slab, from, ground) << run;
    }
    return runs;
}

static void COUNT(const vd_shadow_slab *slab, int row, int rows, uint8_t *restrict counts,
                  size_t stride) {
    const vd_shadow_plan *plan = slab->plan;
    const SAMPLE *origin = (const SAMPLE *)slab->origin + (size_t)row * slab->pitch;
    const ptrdiff_t pitch = (ptrdiff_t)slab->pitch;
    const int width = slab->width;
    uint32_t group = ~0u; /* runs of the tile's width of columns that this block is one of */
    for (int column = 0; column < width; column += LANES) {
        const size_t used = width - column < LANES ? (size_t)(width - column) : LANES;
        if (LANES < VD_SHADOW_TILE_WIDTH && column % VD_SHADOW_TILE_WIDTH == 0) {
            group = RUNS(slab, origin + column, column, row, VD_SHADOW_TILE_WIDTH, ~0u);
        }
        const uint32_t runs =
            group == 0 ? 0 : RUNS(slab, origin + column, column, row, LANES, group);
        if (runs == 0) {
            for (int r = 0; r < rows; r++) {
                memset(counts + (size_t)(row + r) * stride + (size_t)column, 0, used);
            }
            continue;
        }
        VECTOR base[VD_SHADOW_ROWS];
        COUNTER count[VD_SHADOW_ROWS];
        for (int r = 0; r < VD_SHADOW_ROWS; r++) {
            VECTOR v;
            memcpy(&v, origin + column + r * pitch, sizeof v);
            base[r] = base_heights(v);
            count[r] = (COUNTER){0};
        }
        for (uint32_t left = runs; left != 0; left &= left - 1) {
            const int from = __builtin_ctz(left) * VD_SHADOW_RUN;
            const int to = from + VD_SHADOW_RUN < plan->steps ? from + VD_SHADOW_RUN : plan->steps;
            for (int k = from; k < to; k++) {
                int x = column + slab->dx[k];
                if (plan->wraps) {
                    x -= x >= width ? width : 0;
                } else if (x >= width || x <= -LANES) {
                    break; /* outside from here on */
                }
                const SAMPLE *there = origin + x + plan->dy[k] * pitch;
                for (int r = 0; r < VD_SHADOW_ROWS; r++) {
                    VECTOR v;
                    memcpy(&v, there + r * pitch, sizeof v);
                    count[r] = count_under(count[r], base[r], v, slab, k);
                }
            }
        }
        for (int r = 0; r < rows; r++) {
            uint8_t bytes[LANES];
            narrow(bytes, count[r]);
            memcpy(counts + (size_t)(row + r) * stride + (size_t)column, bytes, used);
        }
    }
}

static void MAXIMA(const void *first, size_t pitch, int rows, size_t tiles, float *restrict out) {
    for (size_t t = 0; t < tiles; t++) {
        const SAMPLE *from = (const SAMPLE *)first + t * VD_SHADOW_TILE_WIDTH;
        SAMPLE most[VD_SHADOW_TILE_WIDTH];
        memcpy(most, from, sizeof most);
        for (int r = 1; r < rows; r++) {
            from += pitch;
            for (int i = 0; i < VD_SHADOW_TILE_WIDTH; i++) {
                most[i] = from[i] > most[i] ? from[i] : most[i];
            }
        }
        SAMPLE highest = most[0];
        for (int i = 1; i < VD_SHADOW_TILE_WIDTH; i++) {
            highest = most[i] > highest ? most[i] : highest;
        }
        out[t] = (float)highest;
    }
}
