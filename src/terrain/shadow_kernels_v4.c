#define TABLE vd_shadow_kernels_v4
#include "terrain/shadow_kernels.inl"
