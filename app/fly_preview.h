/* fly_preview.h: a path without its frames: its figures, and a map of it. */
#ifndef VEDUTA_APP_FLY_PREVIEW_H
#define VEDUTA_APP_FLY_PREVIEW_H

#include "fly_world.h"

/* Draws the world from straight above with the path on it, from its beginning (green) to its end
 * (red), keyframes as dots, and writes it as PNG. */
VD_MUST_USE vd_status vd_fly_save_map(vd_fly_world *world, const vd_camera_path *path,
                                      const char *output);

#endif
