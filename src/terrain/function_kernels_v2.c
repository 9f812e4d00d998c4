#define TABLE vd_function_kernels_v2
#include "terrain/function_kernels.inl"
