#define TABLE vd_splat_kernels_v2
#include "splat/splat_kernels.inl"
