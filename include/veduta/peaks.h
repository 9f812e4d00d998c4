/* peaks.h: the summits of a heightfield, by how far they stand out.
 *
 * The prominence of a peak is how far one must go down from it, at least, on the way to higher
 * ground: its height above the highest pass that leads there. Ways go from sample to sample, to any
 * of the eight around it, over heights as they are stored.
 */
#ifndef VEDUTA_PEAKS_H
#define VEDUTA_PEAKS_H

#include <veduta/heightfield.h>
#include <veduta/job.h>

VD_BEGIN_DECLARATIONS

typedef struct vd_peak {
    int column, row;     /* the sample */
    double x, y, z;      /* world, metres; z is the height as stored, not exaggerated */
    double prominence_m; /* above 0 */
} vd_peak;

/* Finds the peaks of the greatest prominence: out[0 … *found − 1], by prominence, the greatest
 * first; of equals the one whose sample comes first (rows from the north, columns from the west).
 * `count` is the room in `out`; fewer are found where there are fewer peaks. `job` may be null.
 *
 * A plateau is one peak, at the first of its samples. Of two peaks of one height the first counts
 * as the higher. The map's edge and holes are no way anywhere: no pass leads over them, and the
 * highest peak of what hangs together stands as far out as its height above the lowest sample of
 * it. A map that wraps goes on beyond its edge. A flat map has no peak.
 *
 * Cost: one sort of the samples and one pass in that order, on one thread: 170 ns a sample of
 * hills, 300 of noise, so 3 to 5 s for 4096² of them; 8 bytes a sample and 16 bytes for each of
 * `count` while it runs. Returns VD_ERROR_ARGUMENT (count below 1), VD_ERROR_LIMIT (2^32 samples
 * or more), VD_ERROR_MEMORY or VD_ERROR_CANCELLED; `out` and *found are written on success only. */
VD_API VD_MUST_USE vd_status vd_heightfield_peaks(vd_context *context, vd_job *job,
                                                  const vd_heightfield *heightfield, int count,
                                                  vd_peak *out, int *found);

VD_END_DECLARATIONS

#endif
