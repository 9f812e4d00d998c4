#define TABLE vd_coverage_kernels_v2
#include "coverage/coverage_kernels.inl"
