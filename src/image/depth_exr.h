/* depth_exr.h: distances of a frame, and OpenEXR files of them. */
#ifndef VEDUTA_IMAGE_DEPTH_EXR_H
#define VEDUTA_IMAGE_DEPTH_EXR_H

#include <stdbool.h>
#include <veduta/frame.h>

/* A frame's depth plane with what it takes to make distances of it; see vd_frame_save_depth. */
typedef struct vd_distance_source {
    const vd_frame *frame;
    double near_m, far_m;
} vd_distance_source;

/* Fills out[width] with row `y`'s distances along the view axis in metres, +infinity = nothing. */
void vd_distance_row(const vd_distance_source *source, int y, float *out);

/* Writes an OpenEXR file with the float channel "Z". Returns VD_ERROR_UNSUPPORTED in a build
 * without OpenEXR, VD_ERROR_IO or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_exr_write(const vd_distance_source *source, const char *path);

#endif
