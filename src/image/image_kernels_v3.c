#define TABLE vd_image_kernels_v3
#include "image/image_kernels.inl"
