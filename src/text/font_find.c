/* font_find.c: fonts by name, in the places where distributions keep them.
 *
 * A list and not fontconfig: which font it picks depends on the machine's and the user's settings,
 * and a picture must not.
 */
#include "text/font.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

typedef struct place {
    const char *family, *file;
} place;

/* Below a root; in the order in which they are taken where no name is given. */
static const place places[] = {
    {"DejaVu Sans", "truetype/dejavu/DejaVuSans.ttf"},   /* Debian */
    {"DejaVu Sans", "dejavu-sans-fonts/DejaVuSans.ttf"}, /* Fedora */
    {"DejaVu Sans", "TTF/DejaVuSans.ttf"},               /* Arch */
    {"DejaVu Sans", "truetype/DejaVuSans.ttf"},          /* openSUSE */
    {"Liberation Sans", "truetype/liberation/LiberationSans-Regular.ttf"},
    {"Liberation Sans", "truetype/liberation2/LiberationSans-Regular.ttf"},
    {"Liberation Sans", "liberation-sans-fonts/LiberationSans-Regular.ttf"},
    {"Liberation Sans", "liberation-sans/LiberationSans-Regular.ttf"},
    {"Liberation Sans", "liberation/LiberationSans-Regular.ttf"},
    {"Liberation Sans", "truetype/LiberationSans-Regular.ttf"},
    {"Noto Sans", "truetype/noto/NotoSans-Regular.ttf"},
    {"Noto Sans", "google-noto/NotoSans-Regular.ttf"},
    {"Noto Sans", "noto/NotoSans-Regular.ttf"},
    {"Noto Sans", "truetype/NotoSans-Regular.ttf"},
    {"DejaVu Sans Bold", "truetype/dejavu/DejaVuSans-Bold.ttf"},
    {"DejaVu Sans Bold", "dejavu-sans-fonts/DejaVuSans-Bold.ttf"},
    {"DejaVu Sans Bold", "TTF/DejaVuSans-Bold.ttf"},
    {"DejaVu Sans Bold", "truetype/DejaVuSans-Bold.ttf"},
    {"Liberation Sans Bold", "truetype/liberation/LiberationSans-Bold.ttf"},
    {"Liberation Sans Bold", "truetype/liberation2/LiberationSans-Bold.ttf"},
    {"Liberation Sans Bold", "liberation-sans-fonts/LiberationSans-Bold.ttf"},
    {"Liberation Sans Bold", "liberation-sans/LiberationSans-Bold.ttf"},
    {"Liberation Sans Bold", "liberation/LiberationSans-Bold.ttf"},
    {"Liberation Sans Bold", "truetype/LiberationSans-Bold.ttf"},
    {"Noto Sans Bold", "truetype/noto/NotoSans-Bold.ttf"},
    {"Noto Sans Bold", "google-noto/NotoSans-Bold.ttf"},
    {"Noto Sans Bold", "noto/NotoSans-Bold.ttf"},
    {"Noto Sans Bold", "truetype/NotoSans-Bold.ttf"},
};

static bool is_file(const char *path) {
    struct stat about;
    return stat(path, &about) == 0 && S_ISREG(about.st_mode);
}

/* The Debian package that a family comes in. */
static const char *package_of(const char *family) {
    return strncmp(family, "Liberation", 10) == 0 ? "fonts-liberation"
           : strncmp(family, "Noto", 4) == 0      ? "fonts-noto-core"
                                                  : "fonts-dejavu-core";
}

vd_status vd_font_find_below(vd_context *context, const char *const *roots, const char *name,
                             vd_font **out) {
    const char *family = NULL; /* the one that was asked for */
    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++) {
        if (name != NULL && strcasecmp(name, places[i].family) != 0) {
            continue;
        }
        family = places[i].family;
        for (const char *const *root = roots; *root != NULL; root++) {
            char path[1024];
            const int length = snprintf(path, sizeof path, "%s/%s", *root, places[i].file);
            if (length > 0 && (size_t)length < sizeof path && is_file(path)) {
                return vd_font_create(context, path, out);
            }
        }
    }
    if (name == NULL) {
        return vd_failure(VD_ERROR_IO,
                          "no font is installed that text can be drawn with (none of DejaVu Sans, "
                          "Liberation Sans and Noto Sans is below %.100s); install the package "
                          "fonts-dejavu-core, or name a .ttf or .otf file",
                          roots[0] != NULL ? roots[0] : "anything");
    }
    if (family == NULL) {
        return vd_failure(VD_ERROR_IO,
                          "there is no font \"%.150s\": it is no file, nor one of the names DejaVu "
                          "Sans, Liberation Sans and Noto Sans with or without Bold; give the path "
                          "of a .ttf or .otf file",
                          name);
    }
    return vd_failure(VD_ERROR_IO,
                      "the font %s is not installed; install the package %s, or give the path of a "
                      ".ttf or .otf file",
                      family, package_of(family));
}

vd_status vd_font_find(vd_context *context, const char *name, vd_font **out) {
    static const char *const roots[] = {"/usr/share/fonts", "/usr/local/share/fonts", NULL};
    if (context == NULL || out == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "vd_font_find: context and out must be given");
    }
    if (name != NULL && name[0] == '\0') {
        name = NULL;
    }
    if (name != NULL && (strchr(name, '/') != NULL || is_file(name))) {
        return vd_font_create(context, name, out);
    }
    return vd_font_find_below(context, roots, name, out);
}
