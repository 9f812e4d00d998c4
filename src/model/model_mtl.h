/* model_mtl.h: the material libraries (MTL) that an OBJ file names. */
#ifndef VEDUTA_MODEL_MODEL_MTL_H
#define VEDUTA_MODEL_MODEL_MTL_H

#include "model/model_build.h"

/* Materials by name. Zero it before use. */
typedef struct vd_mtl_library {
    vd_list entries; /* vd_mtl_entry, sorted by name */
    bool warned;     /* that a material does not exist */
} vd_mtl_library;

/* Reads an MTL file beside the builder's own; one that is not there is a warning, not a failure. */
VD_MUST_USE vd_status vd_mtl_load(vd_mtl_library *library, vd_model_builder *builder,
                                  const char *name, size_t name_bytes);

/* Finds a material, adding it to the builder, with its texture, when it is first used. For one that
 * does not exist that is the default. */
VD_MUST_USE vd_status vd_mtl_find(vd_mtl_library *library, vd_model_builder *builder,
                                  const char *name, size_t name_bytes, uint32_t *out);

void vd_mtl_finish(vd_mtl_library *library, vd_context *context);

#endif
