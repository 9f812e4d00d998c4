#define TABLE vd_lens_methods_v3
#include "terrain/lens_march.inl"
