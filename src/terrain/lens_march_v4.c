#define TABLE vd_lens_kernels_v4
#include "terrain/lens_march.inl"
