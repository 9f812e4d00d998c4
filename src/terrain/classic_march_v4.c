#define TABLE vd_march_kernels_v4
#include "terrain/classic_march.inl"
