/* raster_kernels.inl: the kernels' bodies over wide.h. A file per SIMD level defines TABLE and
 * includes this; the table is the file's only external name. */
#include <string.h>
#include "core/wide_records.h"
#include "raster/raster_kernels.h"
#include "image/blended.h"
#include "image/srgb.h"

#define ALL_LANES ((1u << VD_WIDE_LANES) - 1)

#include "raster/raster_project.inl"
#include "raster/raster_fill.inl"
#include "raster/raster_sort.inl"
#include "raster/raster_shade.inl"
#include "raster/raster_fragments.inl"
#include "raster/raster_frame.inl"
#include "raster/raster_lit.inl"
#include "raster/raster_alpha.inl"

const vd_raster_kernels TABLE = {project,
                                 sort,
                                 fill_small,
                                 fill_blocks,
                                 flush,
                                 fill_setup,
                                 fill_tested,
                                 add_blended,
                                 merge,
                                 shade_frame,
                                 fill_frame,
                                 shade,
                                 {[VD_SHADING_PHONG] = fragments_phong,
                                  [VD_SHADING_FLAT] = fragments_flat,
                                  [VD_SHADING_DEPTH] = fragments_depth}};
