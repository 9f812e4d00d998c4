/* world_shader.h: meshes lit exactly as the terrain is: by one sun that hills and things may hide,
 * by sky and ground, seen through the same haze. */
#ifndef VEDUTA_WORLD_WORLD_SHADER_H
#define VEDUTA_WORLD_WORLD_SHADER_H

#include "world/world_light.h"

/* Uniforms of a draw; must live until the picture is drawn. */
typedef struct vd_world_uniforms {
    const vd_world_light *light;
    float sun_visible; /* share of the sun that hills leave all of it, 0 … 1 */
    bool mixed;        /* they leave some of it in the sun: every fragment is asked for */
    bool receives;     /* things throw shadows on it */
} vd_world_uniforms;

/* The material's albedo × texture (× vertex colours), lit on the side towards the viewer;
 * emission; the material's highlight of the sun. Names that end in _flat take the triangle's own
 * normal, for meshes without; _plain has no texture, _colored takes the first three extra
 * components as linear colour (vd_model.has_colors). */
extern const vd_shader vd_world_shader, vd_world_shader_flat;
extern const vd_shader vd_world_shader_plain, vd_world_shader_flat_plain;
extern const vd_shader vd_world_shader_colored, vd_world_shader_flat_colored;

/* Returns the one that suits a draw's mesh and materials; `colored` as vd_model.has_colors. */
const vd_shader *vd_world_shader_for(const vd_draw *draw, bool colored);

#endif
