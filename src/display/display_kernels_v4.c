#define TABLE vd_display_kernels_v4
#include "display/display_kernels.inl"
