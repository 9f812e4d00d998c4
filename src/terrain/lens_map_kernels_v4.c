#define TABLE vd_lens_kernels_v4
#include "terrain/lens_map_kernels.inl"
