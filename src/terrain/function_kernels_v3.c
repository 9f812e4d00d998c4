#define TABLE vd_function_kernels_v3
#include "terrain/function_kernels.inl"
