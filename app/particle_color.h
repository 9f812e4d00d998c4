/* particle_color.h: what particles are coloured by. */
#ifndef VEDUTA_APP_PARTICLE_COLOR_H
#define VEDUTA_APP_PARTICLE_COLOR_H

#include <veduta/veduta.h>

/* Whether particles have colours of their own. */
bool vd_particle_has_colors(const vd_bricks *bricks);

/* Sets out->color and out->attribute by a name: "rgb", "height" or an attribute; null: colours of
 * their own, else classes, else height, whichever there is. With `by_map` classes are numbers for
 * a colour map too. *chosen is the name. Returns VD_ERROR_ARGUMENT (no such attribute). */
VD_MUST_USE vd_status vd_particle_color(const vd_bricks *bricks, const char *name, bool by_map,
                                        vd_brick_view_def *out, const char **chosen);

/* A failure: there is no attribute of that name; which there are, or the nearest. */
vd_status vd_particle_no_attribute(const vd_bricks *bricks, const char *name);

/* Stretches an absolute map as a relative one is: its metres mean nothing here. */
void vd_particle_stretch(vd_colormap *map);

#endif
