/* model_file.h: opening a model, by the core or by veduta-model. */
#ifndef VEDUTA_APP_MODEL_FILE_H
#define VEDUTA_APP_MODEL_FILE_H

#include <jansson.h>
#include <veduta/veduta.h>

/* Loads a model: OBJ, PLY and OFF by the core, others by veduta-model, which a shared build opens
 * when the first such file comes: assimp takes 20 ms to load, and a build may lack it. A sentence
 * on textures that are not there says how to do without. Returns as vd_model_load. */
VD_MUST_USE vd_status vd_model_open(vd_context *context, const char *path, bool skip_textures,
                                    vd_model **out);

/* Returns what a model holds, for --json; null when memory is out. */
json_t *vd_model_describe(const vd_model *model);

/* Materials that triangles use. */
int vd_model_used_materials(const vd_model *model);

#endif
