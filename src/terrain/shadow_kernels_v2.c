#define TABLE vd_shadow_kernels_v2
#include "terrain/shadow_kernels.inl"
