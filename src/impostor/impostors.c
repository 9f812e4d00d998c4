/* impostors.c: pictures of objects: made, kept, given up. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "core/core.h"
#include "impostor/impostor_painter.h"
#include "impostor/impostor_placed.h"
#include "impostor/impostor_pool.h"

vd_impostor_def vd_impostor_def_default(void) {
    vd_impostor_def def = {.tolerance_px = 1.0,
                           .budget_s = 5e-3,
                           .memory_bytes = (size_t)256 << 20,
                           .rate_hz = 60.0,
                           .speed_mps = 2.0,
                           .least_reuse = 4.0,
                           .most_px = 192.0,
                           .samples = 4,
                           .direct_samples = 1,
                           .most_direct = 64,
                           .placed_triangles = 100000,
                           .settle = true};
    return def;
}

static vd_status check(const vd_impostor_def *def) {
    const struct {
        const char *name;
        double value, least;
        bool above;
    } fields[] = {{"tolerance_px", def->tolerance_px, 0.0, false},
                  {"budget_s", def->budget_s, 0.0, true},
                  {"fade_s", def->fade_s, 0.0, false},
                  {"rate_hz", def->rate_hz, 0.0, true},
                  {"speed_mps", def->speed_mps, 0.0, true},
                  {"least_reuse", def->least_reuse, 0.0, false},
                  {"link_bytes_per_s", def->link_bytes_per_s, 0.0, false},
                  {"link_latency_s", def->link_latency_s, 0.0, false},
                  {"spare", def->spare, 0.0, false},
                  {"rest_s", def->rest_s, 0.0, false},
                  {"most_px", def->most_px, 8.0, false}};
    for (size_t i = 0; i < sizeof fields / sizeof fields[0]; i++) {
        const double v = fields[i].value, least = fields[i].least;
        if (!isfinite(v) || v < least || (fields[i].above && v == least)) {
            return vd_failure(VD_ERROR_ARGUMENT, "impostors with %s %g cannot be shown; give %s %g",
                              fields[i].name, v, fields[i].above ? "more than" : "at least", least);
        }
    }
    if (def->memory_bytes < ((size_t)1 << 20) || vd_sample_offsets(def->samples) == NULL ||
        vd_sample_offsets(def->direct_samples) == NULL) {
        return vd_failure(
            VD_ERROR_ARGUMENT,
            "impostors need memory_bytes of at least 1 MiB, and 1, 4 or 8 samples and "
            "direct_samples, not %zu, %d and %d",
            def->memory_bytes, def->samples, def->direct_samples);
    }
    if (def->spare > 1.0 || (def->ship && (def->link_bytes_per_s > 0.0 || def->fade_s > 0.0))) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          def->spare > 1.0
                              ? "impostors with a spare of more than 1 are mostly out of sight; "
                                "give a share of the screen"
                              : "impostors for a client have no simulated link and no fading; "
                                "leave link_bytes_per_s and fade_s at 0");
    }
    if (def->background_threads < 0 || def->background_threads > 1024) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "impostors with background_threads %d cannot be drawn; give 0 to 1024",
                          def->background_threads);
    }
    if (def->background && (def->link_bytes_per_s > 0.0 || def->ship || def->pool != NULL ||
                            def->no_reuse || def->budget_pixels > 0)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "impostors that are drawn in the background come when they are done: "
                          "leave link_bytes_per_s, ship, pool, no_reuse and budget_pixels out");
    }
    return vd_success();
}

vd_status vd_impostors_create(vd_context *context, const vd_world *world,
                              vd_world_renderer *renderer, const vd_impostor_def *def,
                              vd_impostors **out) {
    const vd_impostor_def used = def != NULL ? *def : vd_impostor_def_default();
    if (used.like != NULL && (used.like->world != world || used.like->renderer != renderer)) {
        return vd_failure(VD_ERROR_ARGUMENT, "impostors are like others of the same world and "
                                             "renderer; leave `like` out");
    }
    const vd_status status =
        (unsigned)used.show < VD_IMPOSTOR_SHOW_COUNT
            ? check(&used)
            : vd_failure(VD_ERROR_ARGUMENT, "impostors have no overlay %d; give a vd_impostor_show",
                         (int)used.show);
    if (status.code != VD_OK) {
        return status;
    }
    vd_impostors *set = vd_allocate_zero(context, 1, sizeof *set);
    if (set == NULL) {
        return vd_out_of_memory("impostors", sizeof *set);
    }
    set->context = context;
    set->world = world;
    set->renderer = renderer;
    set->def = used;
    set->cloud_detail = set->packed_share = set->haste = 1.0;
    set->front_pace.last = 2;
    set->clouds_pace.last = 3; /* they are soft */
    set->versions = used.first_version;
    set->scratch = set->still_in = &set->own_scratch;
    set->def.pool = NULL; /* until it has joined */
    vd_status made = vd_success();
    if (used.pool != NULL) {
        made = vd_impostor_pool_join(used.pool, world, renderer, &set->number);
        set->def.pool = made.code == VD_OK ? used.pool : NULL;
        set->scratch = made.code == VD_OK ? vd_impostor_pool_scratch(used.pool) : set->scratch;
        set->still_in = used.ship ? set->scratch : set->still_in;
    }
    if (made.code != VD_OK) {
        vd_impostors_destroy(&set);
        return made;
    }
    if (used.like != NULL) {
        set->ground = used.like->ground;
    } else {
        made = vd_impostor_ground_init(context, renderer, &set->ground);
    }
    const size_t nodes = world->node_count + set->ground.count;
    if (made.code == VD_OK && used.show != VD_IMPOSTOR_SHOW_PICTURES) {
        made = vd_impostor_make_tints(set);
    }
    if (made.code == VD_OK) {
        set->slot_of = vd_allocate_zero(context, nodes, sizeof *set->slot_of);
        made = set->slot_of != NULL ? vd_display_create(context, &set->display)
                                    : vd_out_of_memory("impostors", nodes * sizeof(uint32_t));
    }
    if (made.code == VD_OK && used.background) {
        made = vd_impostor_painter_create(set, &set->painter);
    }
    if (made.code != VD_OK) {
        vd_impostors_destroy(&set);
        return made;
    }
    *out = set;
    return made;
}

const char *vd_impostor_show_name(vd_impostor_show show) {
    static const char *const names[VD_IMPOSTOR_SHOW_COUNT] = {"pictures", "bounds", "age", "error"};
    return (unsigned)show < VD_IMPOSTOR_SHOW_COUNT ? names[show] : "unknown";
}

vd_status vd_impostors_set_show(vd_impostors *set, vd_impostor_show show) {
    const vd_status status =
        show != VD_IMPOSTOR_SHOW_PICTURES ? vd_impostor_make_tints(set) : vd_success();
    set->def.show = status.code == VD_OK ? show : set->def.show;
    return status;
}

void vd_impostors_freeze(vd_impostors *set, bool frozen) {
    set->frozen = frozen;
}

bool vd_impostors_settled(const vd_impostors *set) {
    return vd_impostors_still_frame(set) != NULL && set->time_s >= set->still_s && !set->frozen &&
           set->def.show == VD_IMPOSTOR_SHOW_PICTURES;
}

void vd_impostor_release(vd_impostors *set, vd_impostor_picture *picture) {
    if (picture->rgba != NULL) {
        set->bytes -= vd_impostor_picture_bytes(picture);
        set->stats.pictures--;
        if (picture->pooled != NULL) {
            vd_impostor_pool_give_up(picture->pooled);
        } else {
            vd_release(set->context, picture->rgba);
        }
        picture->rgba = NULL;
        picture->pooled = NULL;
    }
}

void vd_impostor_scratch_release(vd_impostor_scratch *scratch) {
    vd_frame_destroy(&scratch->canvas);
    vd_frame_destroy(&scratch->front);
    vd_frame_destroy(&scratch->relief.frame);
    vd_frame_destroy(&scratch->wide);
    vd_frame_destroy(&scratch->still);
}

void vd_impostors_destroy(vd_impostors **impostors) {
    vd_impostors *set = impostors != NULL ? *impostors : NULL;
    if (set == NULL) {
        return;
    }
    vd_impostor_painter_destroy(set->context, &set->painter);
    for (uint32_t i = 0; i < set->slots.count; i++) {
        vd_impostor_release(set, &vd_impostor_slot_at(set, i)->now);
        vd_impostor_release(set, &vd_impostor_slot_at(set, i)->before);
    }
    vd_impostor_sending *sending = set->sending.data;
    for (size_t i = 0; i < set->sending.count; i++) {
        vd_impostor_release(set, &sending[i].picture);
    }
    if (set->still_in->still_of == set) {
        set->still_in->still_of = NULL;
    }
    vd_impostor_scratch_release(&set->own_scratch);
    vd_impostors_release_extras(set);
    vd_impostors_release_placed(set);
    if (set->def.pool != NULL) {
        vd_impostor_pool_leave(set->def.pool);
    }
    vd_release(set->context, set->items.data);
    vd_release(set->context, set->ids.data);
    vd_release(set->context, set->tints);
    if (set->def.like == NULL) {
        vd_impostor_ground_finish(set->context, &set->ground);
    }
    vd_release(set->context, set->far.data);
    vd_release(set->context, set->sending.data);
    vd_release(set->context, set->slot_of);
    vd_release(set->context, set->slots.data);
    vd_release(set->context, set->shown.data);
    vd_release(set->context, set->direct.data);
    vd_release(set->context, set->lines.data);
    vd_release(set->context, set->over.data);
    vd_release(set->context, set->wishes.data);
    vd_release(set->context, set->quads.data);
    vd_release(set->context, set->depth.memory);
    vd_release(set->context, set->ranks.data);
    vd_release(set->context, set->order.memory);
    vd_display_destroy(&set->display);
    vd_release(set->context, set);
    *impostors = NULL;
}

/* ---- memory -----------------------------------------------------------------------------------*/

void vd_impostors_trim(vd_impostors *set) {
    while (set->bytes > set->def.memory_bytes) {
        vd_impostor_slot *oldest = NULL;
        for (uint32_t i = 0; i < set->slots.count; i++) {
            vd_impostor_slot *slot = vd_impostor_slot_at(set, i);
            const bool has = slot->now.rgba != NULL || slot->before.rgba != NULL;
            if (has && (oldest == NULL || slot->used < oldest->used)) {
                oldest = slot;
            }
        }
        if (oldest == NULL) {
            return;
        }
        vd_impostor_release(set, &oldest->before);
        vd_impostor_release(set, &oldest->now);
        set->missing += oldest->used == set->update; /* it would have been shown */
        oldest->split = false;
        set->stats.dropped++;
    }
}

/* ---- updating ---------------------------------------------------------------------------------*/

static int compare_wishes(const void *a, const void *b) {
    const vd_impostor_wish *x = a, *y = b;
    return x->worth != y->worth ? (x->worth < y->worth) - (x->worth > y->worth)
                                : (x->slot > y->slot) - (x->slot < y->slot);
}

/* Of a client's pictures: it hears nothing meanwhile. */
#define LONGEST_TURN_S 0.25

/* While things are drawn themselves for want of pictures each picture makes every frame shorter:
 * then pictures may take as long as what was drawn itself did. (By the budget alone a forest of
 * 5,000 direct trees, 300 ms a frame, stays one: eight pictures a frame.) */
static double budget_s(const vd_impostors *set) {
    if (set->def.remote) {
        return fmax(set->def.budget_s, 1.0 / set->def.rate_hz);
    }
    const bool wanting = set->missing > 0 && set->def.budget_pixels <= 0;
    const double direct_s =
        set->def.ship ? fmin(set->stats.direct_s, LONGEST_TURN_S) : set->stats.direct_s;
    return wanting ? fmax(set->def.budget_s, direct_s) : set->def.budget_s;
}

/* What an update's drawing began with. */
typedef struct spending {
    uint64_t start_ns, pixels;
    double most_s;
} spending;

static bool is_spent(const vd_impostors *set, const spending *spent) {
    return 1e-9 * (double)(vd_clock_ns() - spent->start_ns) > spent->most_s ||
           (set->def.budget_pixels > 0 &&
            set->stats.pixels_drawn - spent->pixels >= (uint64_t)set->def.budget_pixels);
}

/* What a link that is asked for more than it carries in LONG_S brings first is half as fine, a
 * quarter of the bytes, and so it is where the far end is asked for more than it draws in that
 * time. What is only to be finer then waits. */
#define LONG_S 0.25

/* A picture's pixels over the square of its bounds' diagonal, about. */
#define BOUND_SHARE 0.2

/* Seconds that it would take to draw and send what is wished for. */
static double behind(const vd_impostors *set) {
    const vd_impostor_wish *wishes = set->wishes.data;
    const double link = set->def.link_bytes_per_s;
    double pixels = 0.0;
    if (set->def.no_reuse || (link == 0.0 && !set->def.ship)) {
        return 0.0;
    }
    for (size_t i = 0; i < set->wishes.count; i++) {
        pixels += wishes[i].finer ? 0.0 : wishes[i].area;
    }
    pixels *= BOUND_SHARE;
    const double on_link = link > 0.0 ? 4.0 * pixels * set->packed_share / link : 0.0;
    const double at_work = set->far_px_per_s > 0.0 ? pixels / set->far_px_per_s : 0.0;
    return fmax(on_link, at_work);
}

/* A server that is behind shows larger parts, which last shorter, until it keeps up: fewer of them
 * lie over each other, and none waits for many others before it may take the place of a whole.
 * While the camera rests nothing is decided anew because of it. */
#define MOST_HASTE 8.0

static void hurry(vd_impostors *set, double behind_s) {
    if (set->resting > 1) {
        return;
    }
    if (set->def.ship && behind_s > LONG_S) {
        set->haste = fmin(set->haste * 1.1, MOST_HASTE);
    } else if (behind_s < 0.3 * LONG_S) {
        set->haste = fmax(set->haste / 1.05, 1.0);
    }
}

/* How fast it is believed what the far end draws in a second. */
#define FAR_WEIGHT 0.1

/* What took longer was a pause. */
#define MOST_TOOK_S 1.0

/* Learns how fast the far end is; of one that was not `busy` all the time, at least how fast. */
static void learn_far(vd_impostors *set, uint64_t pixels, double took_s, bool busy) {
    const double rate = took_s > 0.0 ? (double)pixels / fmin(took_s, MOST_TOOK_S) : 0.0;
    if (rate > 0.0 && (busy || rate > set->far_px_per_s)) {
        set->far_px_per_s +=
            (set->far_px_per_s > 0.0 ? FAR_WEIGHT : 1.0) * (rate - set->far_px_per_s);
    }
}

/* Takes those wishes out whose pictures would only push others out that are shown now: there is no
 * memory for them. Wishes are sorted. */
static void leave_out(vd_impostors *set, double detail) {
    vd_impostor_wish *wishes = set->wishes.data;
    double room = (double)set->def.memory_bytes - (double)set->bytes;
    size_t kept = 0;
    for (uint32_t i = 0; i < set->slots.count; i++) {
        const vd_impostor_slot *slot = vd_impostor_slot_at(set, i);
        room += slot->used < set->update ? (double)(vd_impostor_picture_bytes(&slot->now) +
                                                    vd_impostor_picture_bytes(&slot->before))
                                         : 0.0;
    }
    for (size_t i = 0; i < set->wishes.count; i++) {
        vd_impostor_slot *slot = vd_impostor_slot_at(set, wishes[i].slot);
        const double guess = 4.0 * BOUND_SHARE * wishes[i].area * detail * detail;
        const double takes =
            fmax(guess, (double)slot->bytes) - (double)vd_impostor_picture_bytes(&slot->now);
        if (takes <= 0.0 || takes <= room) {
            room -= takes > 0.0 ? takes : 0.0;
            wishes[kept++] = wishes[i];
        } else {
            slot->left_out = set->update;
        }
    }
    set->left_out = set->wishes.count - kept;
    set->wishes.count = kept;
}

static vd_status make_wishes(vd_impostors *set, vd_job *job, const vd_impostor_view *view_given,
                             const spending *spent) {
    vd_impostor_view coarser = *view_given;
    const double behind_s = behind(set);
    const bool pressed = behind_s > LONG_S;
    coarser.detail = pressed ? 0.5 : 1.0;
    const vd_impostor_view *view = &coarser;
    const vd_impostor_wish *wishes = set->wishes.data;
    vd_status status = vd_success();
    if (set->wishes.count > 1) {
        qsort(set->wishes.data, set->wishes.count, sizeof *wishes, compare_wishes);
    }
    hurry(set, behind_s);
    set->left_out = 0;
    if (set->bytes > set->def.memory_bytes / 2) {
        leave_out(set, coarser.detail);
    }
    if (set->painter != NULL) {
        vd_impostors_ask_painter(set, view, spent->most_s);
        return status;
    }
    size_t i = 0, made = 0, late = 0;
    const bool busy = set->def.remote && set->time_s < set->remote_free_s;
    for (; i < set->wishes.count && status.code == VD_OK; i++) {
        vd_impostor_slot *slot = vd_impostor_slot_at(set, wishes[i].slot);
        bool taken = false;
        if (busy || vd_impostors_link_is_full(set)) {
            break;
        }
        if (pressed && wishes[i].finer) {
            late++;
            continue;
        }
        status = vd_impostors_share(set, view, slot, &taken);
        if (taken || status.code != VD_OK) {
            continue;
        }
        if (made > 0 && is_spent(set, spent)) {
            if (set->def.pool == NULL) {
                break;
            }
            late++; /* others may be had from the pool */
            continue;
        }
        status = vd_impostors_make(set, job, view, slot);
        made++;
        if (set->def.remote) {
            set->remote_free_s = set->time_s + 1e-9 * (double)(vd_clock_ns() - spent->start_ns);
        }
    }
    if (set->def.remote && set->def.budget_pixels == 0) { /* a virtual clock has no machine */
        learn_far(set, set->stats.pixels_drawn - spent->pixels, set->remote_free_s - set->time_s,
                  true);
    }
    set->stats.waiting = set->wishes.count - i + late;
    if (set->def.ship) { /* all that a client is sent takes its time, not pictures alone */
        learn_far(set, set->stats.pixels_drawn - spent->pixels, set->interval_s,
                  set->stats.waiting > 0);
    }
    return status;
}

/* Pictures replace others when all of them are there, which the next update sees. That is too late
 * where it would show something very wrong now, as after a jump of the camera. */
#define VERY_WRONG 4.0

enum { MOST_ROUNDS = 6 };

static bool needs_another_round(const vd_impostors *set, uint64_t drawn, const spending *spent) {
    const bool wrong = set->stats.error_px > VERY_WRONG * fmax(set->def.tolerance_px, 0.1);
    return set->stats.drawn + set->stats.shared > drawn && (set->missing > 0 || wrong) &&
           set->stats.waiting == 0 && set->def.link_bytes_per_s == 0.0 && !set->def.ship &&
           !is_spent(set, spent);
}

/* Decides and draws. */
static vd_status make_all(vd_impostors *set, vd_job *job, const vd_impostor_view *view) {
    vd_status status = vd_success();
    uint64_t drawn = 0;
    spending spent = {.pixels = set->stats.pixels_drawn};
    set->stats.decide_s = 0.0;
    for (int round = 0; round < MOST_ROUNDS && status.code == VD_OK; round++) {
        const uint64_t start = vd_clock_ns();
        status = vd_impostors_decide(set, view);
        set->stats.decide_s += 1e-9 * (double)(vd_clock_ns() - start);
        if (round == 0) {
            vd_impostors_forget_stale(set);
            spent.start_ns = set->draws_since_ns = vd_clock_ns();
            spent.most_s = budget_s(set);
        } else if (set->wishes.count == 0) {
            break;
        }
        drawn = set->stats.drawn + set->stats.shared;
        if (status.code == VD_OK) {
            status = make_wishes(set, job, view, &spent);
        }
        if (!needs_another_round(set, drawn, &spent)) {
            break;
        }
    }
    set->stats.draw_s = 1e-9 * (double)(vd_clock_ns() - spent.start_ns);
    return status;
}

vd_status vd_impostors_check(const vd_camera *camera, int width, int height) {
    const vd_status status = vd_camera_validate(camera);
    if (status.code != VD_OK) {
        return status;
    }
    if (camera->projection != VD_PROJECTION_PERSPECTIVE) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "impostors are shown through a perspective camera; parallel rays have no "
                          "parallax to wait for");
    }
    return width >= 1 && height >= 1 && width <= VD_MAX_SIDE && height <= VD_MAX_SIDE
               ? vd_success()
               : vd_failure(VD_ERROR_ARGUMENT,
                            "impostors cannot be shown in %d x %d pixels; give 1 to %d a side",
                            width, height, VD_MAX_SIDE);
}

/* Counts what the picture is made of. */
static void count_shown(vd_impostors *set) {
    const vd_list *lists[2] = {&set->shown, &set->far};
    vd_impostor_stats *stats = &set->stats;
    stats->shown = stats->reused = 0;
    stats->direct = set->direct.count + set->lines.count;
    for (int k = 0; k < 2; k++) {
        const uint32_t *slots = lists[k]->data;
        for (size_t i = 0; i < lists[k]->count; i++) {
            const vd_impostor_slot *slot = vd_impostor_slot_at(set, slots[i]);
            const bool has = slot->now.rgba != NULL;
            stats->shown += has;
            stats->reused += has && slot->born < set->update;
            stats->direct += k == 1 && !has && !slot->empty;
        }
    }
    stats->bytes = set->bytes;
    stats->in_flight = set->sending.count + set->painting;
}

/* Fewer pictures are not worth a horizon, which takes a millisecond: as long as showing these. Nor
 * is what is ordered for a client, which moves on before it is shown there. Those count that it hid
 * last time, and a quarter fewer do not end it, so that it does not come and go. */
static bool is_horizon_worth_it(const vd_impostors *set) {
    enum { LEAST = 256 };
    const size_t seen = (size_t)set->stats.shown + set->hidden;
    return !set->def.ship && seen > (set->by_horizon ? LEAST * 3 / 4 : LEAST);
}

vd_status vd_impostors_update(vd_impostors *set, vd_job *job, const vd_camera *camera, int width,
                              int height, double time_s, vd_impostor_stats *stats) {
    vd_status status = vd_impostors_check(camera, width, height);
    if (status.code == VD_OK && !(isfinite(time_s) && (!set->moving || time_s >= set->time_s))) {
        status = vd_failure(VD_ERROR_ARGUMENT,
                            "an update at %g s comes after one at %g s; time goes "
                            "forward",
                            time_s, set->time_s);
    }
    if (status.code != VD_OK) {
        return status;
    }
    if (set->frozen) {
        set->stats.drawn = 0;
        set->stats.reused = set->stats.shown;
        if (stats != NULL) {
            *stats = set->stats;
        }
        return status;
    }
    set->update++;
    set->stats.drawn = 0;
    vd_impostors_follow(set, camera, time_s);
    vd_impostors_receive(set);
    if (set->painter != NULL) {
        status = vd_impostors_collect(set);
    }
    if (status.code == VD_OK && set->painter != NULL && vd_job_stopped(job)) {
        status = vd_failure(VD_ERROR_CANCELLED, "the job was cancelled or ran out of time");
    }
    vd_impostor_view view = vd_impostors_view(set, camera, width, height);
    set->by_horizon = is_horizon_worth_it(set);
    if (status.code == VD_OK && set->by_horizon) {
        status = vd_world_aim_horizon(set->renderer, job, camera, width, height, &view.horizon);
    }
    status = status.code == VD_OK ? make_all(set, job, &view) : status;
    vd_impostors_trim(set);
    if (status.code == VD_OK) {
        const uint64_t start = vd_clock_ns();
        status = vd_impostors_settle(set, job, camera, width, height);
        set->stats.draw_s += 1e-9 * (double)(vd_clock_ns() - start);
    }
    count_shown(set);
    if (stats != NULL) {
        *stats = set->stats;
    }
    return status;
}
