#define TABLE vd_raster_kernels_v3
#include "raster/raster_kernels.inl"
