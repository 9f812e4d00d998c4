#define TABLE vd_lens_methods_v2
#include "terrain/lens_march.inl"
