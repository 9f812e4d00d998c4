#define TABLE vd_image_kernels_v4
#include "image/image_kernels.inl"
