#define TABLE vd_lens_kernels_v2
#include "terrain/lens_map_kernels.inl"
