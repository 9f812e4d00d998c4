#define TABLE vd_display_kernels_v2
#include "display/display_kernels.inl"
