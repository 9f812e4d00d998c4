#define TABLE vd_march_kernels_v2
#include "terrain/classic_march.inl"
