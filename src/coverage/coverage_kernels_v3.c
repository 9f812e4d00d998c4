#define TABLE vd_coverage_kernels_v3
#include "coverage/coverage_kernels.inl"
