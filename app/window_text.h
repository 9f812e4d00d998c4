/* window_text.h: shapes and letters for what the window lays over a picture.
 *
 * A canvas collects shapes; drawing them is one call of vd_coverage. Letters are those of a font,
 * found with the first text; where there is no font, or no library for one, they are strokes of our
 * own: capitals, and smaller capitals for small letters.
 */
#ifndef VEDUTA_APP_WINDOW_TEXT_H
#define VEDUTA_APP_WINDOW_TEXT_H

#include <veduta/veduta.h>

typedef struct vd_canvas vd_canvas;

/* Returns null when memory is out. */
vd_canvas *vd_canvas_create(vd_context *context);
void vd_canvas_destroy(vd_canvas **canvas);

/* Forgets the shapes. */
void vd_canvas_clear(vd_canvas *canvas);

/* Adds a rectangle, pixels. */
void vd_canvas_box(vd_canvas *canvas, double x, double y, double width, double height,
                   vd_rgba8 color);

/* Adds a line through `count` points. */
void vd_canvas_line(vd_canvas *canvas, const double (*points)[2], int count, double width,
                    vd_rgba8 color);

/* Adds a line of text (UTF-8) whose baseline begins at (x, y), of capitals `size` pixels high. */
void vd_window_text(vd_canvas *canvas, double x, double y, double size, vd_rgba8 color,
                    const char *text);

/* Returns the width that it would have, pixels. */
double vd_window_text_width(vd_canvas *canvas, double size, const char *text);

/* Draws all shapes over a frame. Returns the errors of vd_coverage_draw_frame, or VD_ERROR_MEMORY
 * when a shape could not be kept. */
VD_MUST_USE vd_status vd_canvas_draw(vd_canvas *canvas, vd_frame *frame);

#endif
