/* gnuplot.h: SVG pictures of figures, drawn by the gnuplot program for --plot. */
#ifndef VEDUTA_APP_GNUPLOT_H
#define VEDUTA_APP_GNUPLOT_H

#include <stdio.h>
#include <veduta/status.h>

/* Sees that gnuplot is there; before anything takes long. Returns VD_ERROR_UNSUPPORTED. */
VD_MUST_USE vd_status vd_gnuplot_find(void);

/* Runs a script, from its beginning, and writes what it plots to `path`, whole or not at all. */
VD_MUST_USE vd_status vd_gnuplot_draw(FILE *script, const char *path);

#endif
