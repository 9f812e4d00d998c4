#define TABLE vd_raster_kernels_v2
#include "raster/raster_kernels.inl"
