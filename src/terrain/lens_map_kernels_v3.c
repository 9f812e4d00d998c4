#define TABLE vd_lens_kernels_v3
#include "terrain/lens_map_kernels.inl"
