/* session_link.c: how much a client is sent before it has taken in what came before.
 *
 * The window is what the link carries in a quarter of a second. The link's speed is the bytes of a
 * batch over the time from when it could leave, after the batch before it, to its acknowledgement:
 * never more than the link does, and as much when the window was full. The largest measurement
 * counts, and fades by half in 3 s when nothing confirms it.
 */
#include <math.h>
#include "remote/session_internal.h"

#define WINDOW_S 0.25
#define LEAST_WINDOW VD_WIRE_BATCH_BYTES
#define MOST_WINDOW ((size_t)1 << 20)
#define HALVES_S 3.0

/* Acknowledgements that come together measure nothing. */
#define LEAST_S 2e-3

/* Small batches measure the delay. */
#define LEAST_BYTES 8192

void vd_link_sent(vd_session_link *link, uint32_t batch, size_t bytes, double limit, double now_s) {
    const int at = (link->first + link->count) % VD_SESSION_FLIGHTS;
    link->flights[at] = (vd_flight){batch, bytes, now_s};
    link->count++;
    link->in_flight += bytes;
    if (limit > 0.0) {
        link->free_s = (link->free_s > now_s ? link->free_s : now_s) + (double)bytes / limit;
    }
}

static void measure(vd_session_link *link, double bytes, double seconds, double now_s) {
    const double speed = bytes / (seconds > LEAST_S ? seconds : LEAST_S);
    const double faded = link->bytes_per_s * exp2(-(now_s - link->measured_s) / HALVES_S);
    if (bytes >= LEAST_BYTES && (speed >= faded || link->measured_s == 0.0)) {
        link->bytes_per_s = speed;
        link->measured_s = now_s;
    }
}

bool vd_link_acknowledged(vd_session_link *link, uint32_t batch, double now_s) {
    if (link->count == 0 || batch < link->flights[link->first].batch) {
        return false;
    }
    const int last = (link->first + link->count - 1) % VD_SESSION_FLIGHTS;
    if (batch > link->flights[last].batch) {
        return false;
    }
    double bytes = 0.0, from_s = link->flights[link->first].sent_s;
    while (link->count > 0 && link->flights[link->first].batch <= batch) {
        const vd_flight *flight = &link->flights[link->first];
        bytes += (double)flight->bytes;
        link->in_flight -= flight->bytes;
        link->first = (link->first + 1) % VD_SESSION_FLIGHTS;
        link->count--;
    }
    from_s = from_s > link->acked_s ? from_s : link->acked_s;
    measure(link, bytes, now_s - from_s, now_s);
    link->acked_s = now_s;
    return true;
}

size_t vd_link_window(const vd_session_link *link) {
    const double bytes = link->bytes_per_s * WINDOW_S;
    return bytes < (double)LEAST_WINDOW  ? LEAST_WINDOW
           : bytes > (double)MOST_WINDOW ? MOST_WINDOW
                                         : (size_t)bytes;
}

bool vd_link_is_open(const vd_session_link *link, double now_s) {
    /* A turn sends a few envelopes. */
    return link->in_flight < vd_link_window(link) && link->count < VD_SESSION_FLIGHTS - 16 &&
           now_s >= link->free_s;
}
