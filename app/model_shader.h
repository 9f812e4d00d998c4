/* model_shader.h: shaders for models that have a colour at each vertex. */
#ifndef VEDUTA_APP_MODEL_SHADER_H
#define VEDUTA_APP_MODEL_SHADER_H

#include <veduta/shader.h>

/* Returns the shader for a mesh whose first three extra components are linear colours: phong, flat
 * (both take vd_phong as uniforms) or albedo; null for other shadings, which show no colour. */
const vd_shader *vd_colored_shader(vd_shading shading);

#endif
