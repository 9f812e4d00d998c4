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

/* As vd_texture_create, from the finest level as a texture has it: RGBA, alpha multiplied in, no
 * colour above its alpha, [height][width]. */
VD_MUST_USE vd_status vd_texture_create_from_texels(vd_context *context, const uint8_t *texels,
                                                    int width, int height, vd_texture **out);

#endif
