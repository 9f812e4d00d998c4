#define TABLE vd_coverage_kernels_v4
#include "coverage/coverage_kernels.inl"
