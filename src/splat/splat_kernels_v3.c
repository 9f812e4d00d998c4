#define TABLE vd_splat_kernels_v3
#include "splat/splat_kernels.inl"
