#define TABLE vd_lens_methods_v4
#include "terrain/lens_march.inl"
