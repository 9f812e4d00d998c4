/* window_pace.c: a controller with hysteresis. */
#include "window_pace.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double step = 1.0 / 32.0;

vd_pace vd_pace_start(double period_s) {
    return (vd_pace){.period_s = period_s, .scale = 1.0};
}

/* The scale changes what a picture takes by the square. */
static void set_scale(vd_pace *pace, double scale) {
    const double ratio = scale / pace->scale;
    pace->smoothed_s *= ratio * ratio;
    pace->scale = scale;
    pace->calm = 0;
}

void vd_pace_note(vd_pace *pace, double seconds) {
    const double budget = 0.85 * pace->period_s;
    pace->smoothed_s =
        pace->smoothed_s > 0.0 ? pace->smoothed_s + 0.3 * (seconds - pace->smoothed_s) : seconds;
    if (pace->smoothed_s > budget) {
        const double fitting = floor(pace->scale * sqrt(budget / pace->smoothed_s) / step) * step;
        set_scale(pace, fitting < VD_PACE_LEAST ? VD_PACE_LEAST : fitting);
        return;
    }
    const double larger = pace->scale + step, ratio = larger / pace->scale;
    const bool room = pace->smoothed_s * ratio * ratio < 0.8 * budget;
    pace->calm = room ? pace->calm + 1 : 0;
    if (pace->calm >= 24 && pace->scale < 1.0) {
        set_scale(pace, larger > 1.0 ? 1.0 : larger);
    }
}

void vd_times_add(vd_times *times, double seconds) {
    times->seconds[times->next] = (float)seconds;
    times->next = (times->next + 1) % VD_TIMES_COUNT;
    times->count += times->count < VD_TIMES_COUNT;
}

static int compare(const void *a, const void *b) {
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

double vd_times_share(const vd_times *times, double share) {
    float sorted[VD_TIMES_COUNT];
    if (times->count == 0) {
        return 0.0;
    }
    memcpy(sorted, times->seconds, sizeof sorted);
    qsort(sorted, (size_t)times->count, sizeof sorted[0], compare);
    const int at = (int)ceil(share * times->count) - 1;
    return (double)sorted[at < 0 ? 0 : at];
}
