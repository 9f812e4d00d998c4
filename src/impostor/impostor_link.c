/* impostor_link.c: pictures that come over a link, before they are shown.
 *
 * The link is simulated in the caller's clock: it sends one byte after the other at a fixed rate,
 * and what it has sent arrives a fixed time later. Pictures arrive in the order in which they were
 * made. What happens follows from the calls and their times alone, so that a run can be repeated.
 */
#include <math.h>
#include <string.h>
#include "core/core.h"
#include "impostor/impostor_set.h"

/* Pictures that would have to wait longer, besides the time between updates, are not made. */
#define LONGEST_QUEUE_S 0.1

/* Bytes of pictures that wait for a client. */
#define MOST_AHEAD ((size_t)1 << 20)

static size_t sent_bytes(const vd_impostor_picture *picture) {
    return picture->packed > 0 ? picture->packed : vd_impostor_picture_bytes(picture);
}

void vd_impostors_replace(vd_impostors *set, vd_impostor_slot *slot,
                          const vd_impostor_picture *made) {
    vd_impostor_release(set, &slot->before);
    if (set->def.fade_s > 0.0 && slot->now.rgba != NULL) {
        slot->before = slot->now;
        slot->now.rgba = NULL;
    }
    vd_impostor_release(set, &slot->now);
    slot->now = *made;
    slot->empty = made->empty;
    slot->bytes = vd_impostor_picture_bytes(made);
    slot->born_s = set->time_s;
    slot->born = set->update;
    slot->failures = 0;
    slot->changed = made->version <= slot->since;
    set->stats.uploads++;
    set->stats.bytes_sent += sent_bytes(made);
    set->stats.pixels_sent += vd_impostor_picture_bytes(made) / 4;
}

double vd_impostors_send(vd_impostors *set, size_t bytes) {
    if (set->def.link_bytes_per_s == 0.0) {
        return set->time_s;
    }
    if (set->def.remote) { /* what is sent now was drawn just now */
        set->remote_free_s = set->time_s + 1e-9 * (double)(vd_clock_ns() - set->draws_since_ns);
    }
    const double made_s = set->remote_free_s > set->time_s ? set->remote_free_s : set->time_s;
    const double from_s = set->link_free_s > made_s ? set->link_free_s : made_s;
    set->link_free_s = from_s + (double)bytes / set->def.link_bytes_per_s;
    return set->link_free_s + set->def.link_latency_s;
}

vd_status vd_impostors_take(vd_impostors *set, vd_impostor_slot *slot, vd_impostor_picture *made) {
    /* A client need not be told of what is empty. */
    if (set->def.link_bytes_per_s == 0.0 && (!set->def.ship || made->empty)) {
        vd_impostors_replace(set, slot, made);
        return vd_success();
    }
    vd_impostor_sending *to = vd_list_add(set->context, &set->sending, 1, sizeof *to);
    if (to == NULL) {
        vd_impostor_release(set, made);
        return vd_out_of_memory("an impostor on its way", sizeof *to);
    }
    const double arrives_s =
        set->def.ship ? (double)INFINITY : vd_impostors_send(set, sent_bytes(made));
    *to = (vd_impostor_sending){*made, set->slot_of[slot->node] - 1, arrives_s};
    slot->coming = true;
    set->sending_bytes += vd_impostor_picture_bytes(made);
    return vd_success();
}

void vd_impostors_receive(vd_impostors *set) {
    vd_impostor_sending *sending = set->sending.data;
    size_t arrived = 0;
    for (; arrived < set->sending.count && sending[arrived].arrives_s <= set->time_s; arrived++) {
        vd_impostor_slot *slot = vd_impostor_slot_at(set, sending[arrived].slot);
        slot->coming = false;
        set->sending_bytes -= vd_impostor_picture_bytes(&sending[arrived].picture);
        vd_impostors_replace(set, slot, &sending[arrived].picture);
    }
    if (arrived > 0) {
        set->sending.count -= arrived;
        memmove(sending, sending + arrived, set->sending.count * sizeof *sending);
    }
}

bool vd_impostors_link_is_full(const vd_impostors *set) {
    /* What is on its way takes memory that cannot be given up. */
    const double queue_s = LONGEST_QUEUE_S + set->interval_s;
    if (set->def.ship) {
        return set->sending_bytes > MOST_AHEAD;
    }
    return set->def.link_bytes_per_s > 0.0 && (set->link_free_s - set->time_s > queue_s ||
                                               set->sending_bytes > set->def.memory_bytes / 2);
}
