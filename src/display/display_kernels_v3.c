#define TABLE vd_display_kernels_v3
#include "display/display_kernels.inl"
