/* window_pace.h: how large a moving picture is drawn so that it keeps the display's rate, and the
 * times that frames took. */
#ifndef VEDUTA_APP_WINDOW_PACE_H
#define VEDUTA_APP_WINDOW_PACE_H

#include <stdbool.h>

/* The share of the picture's side below which it is never drawn. */
#define VD_PACE_LEAST 0.75

typedef struct vd_pace {
    double period_s;   /* of the display */
    double scale;      /* of the side, VD_PACE_LEAST … 1 */
    double smoothed_s; /* what a picture takes at this scale; 0: not known */
    int calm;          /* pictures in a row that left time for a larger one */
} vd_pace;

/* Full size, for a display that shows a picture every `period_s`. */
vd_pace vd_pace_start(double period_s);

/* Takes the time that a picture took and settles the next one's scale. It shrinks at once when
 * pictures take more than 85 % of the period, and grows by a 32nd after 24 pictures that would have
 * left a fifth of that. */
void vd_pace_note(vd_pace *pace, double seconds);

enum { VD_TIMES_COUNT = 256 };

/* The last times of something, seconds. */
typedef struct vd_times {
    float seconds[VD_TIMES_COUNT];
    int next, count;
} vd_times;

void vd_times_add(vd_times *times, double seconds);

/* Returns the time that a share of them, 0 … 1, do not exceed; 0 without times. */
double vd_times_share(const vd_times *times, double share);

#endif
