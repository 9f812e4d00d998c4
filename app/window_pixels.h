/* window_pixels.h: from frames to what a window's surface holds: 0xFFRRGGBB, no alpha. */
#ifndef VEDUTA_APP_WINDOW_PIXELS_H
#define VEDUTA_APP_WINDOW_PIXELS_H

#include <veduta/frame.h>
#include <veduta/job.h>

/* Converts a frame to width × height pixels without gaps between rows; a smaller one is
 * stretched, bilinear. What is transparent shows black. One parallel loop on the context. Returns
 * VD_ERROR_ARGUMENT for a larger frame. */
VD_MUST_USE vd_status vd_pixels_from_frame(vd_context *context, const vd_frame *frame, int width,
                                           int height, uint32_t *out);

/* Lays a frame (premultiplied) over pixels at (x, y), cut at their edges. */
void vd_pixels_lay_over(uint32_t *pixels, size_t stride, int width, int height,
                        const vd_frame *frame, int x, int y);

#endif
