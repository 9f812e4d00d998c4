#define TABLE vd_shadow_kernels_v3
#include "terrain/shadow_kernels.inl"
