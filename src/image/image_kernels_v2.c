#define TABLE vd_image_kernels_v2
#include "image/image_kernels.inl"
