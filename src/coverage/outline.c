/* outline.c: the memory of outlines. */
#include <string.h>
#include <veduta/outline.h>

void vd_outline_finish(vd_outline *outline) {
    if (outline == NULL) {
        return;
    }
    if (outline->context != NULL) {
        /* The path only lends its arrays to readers; they are ours. */
        vd_release(outline->context, (void *)outline->path.points);
    }
    memset(outline, 0, sizeof *outline);
}
