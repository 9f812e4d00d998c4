#define TABLE vd_march_kernels_v3
#include "terrain/classic_march.inl"
