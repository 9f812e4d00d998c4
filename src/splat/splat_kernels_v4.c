#define TABLE vd_splat_kernels_v4
#include "splat/splat_kernels.inl"
