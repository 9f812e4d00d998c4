#define TABLE vd_function_kernels_v4
#include "terrain/function_kernels.inl"
