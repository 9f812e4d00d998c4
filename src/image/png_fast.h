/* png_fast.h: the PNG encoder behind the default compression level. */
#ifndef VEDUTA_IMAGE_PNG_FAST_H
#define VEDUTA_IMAGE_PNG_FAST_H

#include "core/file.h"
#include "image/image.h"

/* True when this build has libdeflate and the picture is small enough to be held twice. */
bool vd_png_fast_possible(const vd_png_source *source);

/* Writes a whole PNG into `file`, whose owner commits or discards it. `text` is known to be valid.
 * Returns VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_png_write_fast(const vd_png_source *source, const vd_picture_text *text,
                                        int text_count, vd_file *file);

#endif
