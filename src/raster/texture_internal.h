/* texture_internal.h: what a texture is made of. */
#ifndef VEDUTA_RASTER_TEXTURE_INTERNAL_H
#define VEDUTA_RASTER_TEXTURE_INTERNAL_H

#include <veduta/texture.h>
#include "core/core.h"

#define VD_TEXTURE_MAX_LEVELS 15

typedef struct vd_texture_level {
    int width, height;
    uint8_t *texels; /* [height][width][4] */
} vd_texture_level;

struct vd_texture {
    vd_context *context;
    int level_count;
    vd_texture_level levels[VD_TEXTURE_MAX_LEVELS]; /* one allocation, the first level's */
};

#endif
