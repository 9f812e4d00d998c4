/* impostor_painter.h: a thread that draws pictures while frames go on.
 *
 *   update    collect ── decide ── ask for the most worthy ─────── collect ── …
 *   painter              draw, draw … until its time of this update is spent
 *
 * What it has not begun when the next update comes is dropped, and wished for anew if it still
 * matters. It has a renderer and a pool of threads of its own; of the world nothing changes. Where
 * there is no memory for these the set draws by itself.
 */
#ifndef VEDUTA_IMPOSTOR_IMPOSTOR_PAINTER_H
#define VEDUTA_IMPOSTOR_IMPOSTOR_PAINTER_H

#include "impostor/impostor_set.h"

/* The most pictures that it is asked for at once. */
#define VD_PAINTER_QUEUE 16

/* For a set whose renderer has the light that pictures shall have. Returns VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_impostor_painter_create(const vd_impostors *set,
                                                 vd_impostor_painter **out);

/* Ends the thread, within a piece of what it draws. */
void vd_impostor_painter_destroy(vd_context *context, vd_impostor_painter **painter);

/* Takes the set's pictures over that were drawn, and drops what was not begun. Returns the errors
 * of drawing that no other try can mend. */
VD_MUST_USE vd_status vd_impostors_collect(vd_impostors *set);

/* Asks for what is wished for most; wishes are sorted. `most_s`: see vd_impostor_def.budget_s. */
void vd_impostors_ask_painter(vd_impostors *set, const vd_impostor_view *view, double most_s);

#endif
