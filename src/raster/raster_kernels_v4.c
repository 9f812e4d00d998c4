#define TABLE vd_raster_kernels_v4
#include "raster/raster_kernels.inl"
