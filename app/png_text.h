/* png_text.h: the text that a PNG carries. */
#ifndef VEDUTA_APP_PNG_TEXT_H
#define VEDUTA_APP_PNG_TEXT_H

#include <jansson.h>

/* Returns the uncompressed text chunks (tEXt and iTXt) of a PNG file that come before its picture
 * or after it, as an object of keywords; empty for any other file. Null when memory is out. */
json_t *vd_png_read_text(const char *path);

#endif
