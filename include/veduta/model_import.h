/* model_import.h: models of every format that assimp reads (library veduta-model).
 *
 * glTF and GLB, STL, FBX, COLLADA, 3DS, Blender and others. Kept out of the core library so
 * that an embedder who does not need it does not link assimp.
 */
#ifndef VEDUTA_MODEL_IMPORT_H
#define VEDUTA_MODEL_IMPORT_H

#include <veduta/model.h>

VD_BEGIN_DECLARATIONS

/* Reads a model by assimp. Nodes are flattened into the file's world; of materials the base colour
 * and its texture (a file beside the model, or embedded: PNG, and JPEG where the build has it),
 * emission, highlight, transparency are kept; animations, bones, lights and cameras are not.
 * Metal and roughness become the highlight that comes nearest. `def` may be null.
 * Returns as vd_model_load, assimp's own words included; VD_ERROR_FORMAT also for a format that
 * assimp does not know. */
VD_API VD_MUST_USE vd_status vd_model_import(vd_context *context, const char *path,
                                             const vd_model_def *def, vd_model **out);

VD_END_DECLARATIONS

#endif
