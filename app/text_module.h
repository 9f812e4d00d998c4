/* text_module.h: veduta-text, opened when text is drawn.
 *
 * A picture without names needs no fonts, and a build may lack FreeType and HarfBuzz. So a shared
 * build opens the library on the first text; a static one has it linked in; one without says so.
 */
#ifndef VEDUTA_APP_TEXT_MODULE_H
#define VEDUTA_APP_TEXT_MODULE_H

#include <veduta/text.h>

typedef struct vd_text_module {
    vd_status (*create)(vd_context *context, const char *path, vd_font **out);
    vd_status (*find)(vd_context *context, const char *name, vd_font **out);
    void (*destroy)(vd_font **font);
    const char *(*path)(const vd_font *font);
    const char *(*family)(const vd_font *font);
    vd_status (*outline)(vd_font *font, const char *utf8, double size_px, vd_outline *out);
} vd_text_module;

/* Opens veduta-text. `purpose` says what it is needed for, such as "write the title". Returns
 * VD_ERROR_UNSUPPORTED when it is not there. The library stays loaded until the program ends. */
VD_MUST_USE vd_status vd_text_module_open(const char *purpose, vd_text_module *out);

#endif
