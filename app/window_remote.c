/* window_remote.c: a world that a server draws, in the window. */
#include "window_remote.h"

#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "remote_module.h"
#include "run.h"

#define PATIENCE_S 10.0
#define WORLD_BYTES ((size_t)1 << 16)

typedef struct remote {
    vd_remote_module module;
    vd_client *client;
} remote;

static vd_status draw(void *user, vd_job *job, const vd_camera *camera, const vd_window_way *way,
                      vd_frame *frame) {
    remote *r = user;
    (void)way;
    r->module.client_look(r->client, camera, frame->width, frame->height);
    return r->module.client_draw(r->client, job, camera, frame, NULL);
}

static bool impostors(void *user, vd_impostor_stats *out) {
    (void)user, (void)out; /* what they are like the server knows */
    return false;
}

/* Light and heights are the server's. */
static vd_status look(void *user, vd_job *job, const vd_render_settings *settings) {
    (void)user, (void)job, (void)settings;
    return vd_success();
}

static double ground(void *user, double x, double y) {
    remote *r = user;
    return r->module.client_ground(r->client, x, y);
}

static void destroy(void *user) {
    remote *r = user;
    if (r->client != NULL) {
        r->module.client_destroy(&r->client);
    }
    free(r);
}

static void news(void *user, vd_scene_news *out) {
    remote *r = user;
    vd_client_news n;
    r->module.client_get_news(r->client, &n);
    *out = (vd_scene_news){.version = n.version};
    switch (n.state) {
    case VD_CLIENT_LOADING:
        (void)snprintf(out->state, sizeof out->state, "waiting for the first picture");
        break;
    case VD_CLIENT_LOST:
        (void)snprintf(out->state, sizeof out->state, "lost: %.300s; trying again in %.0f s",
                       n.sentence, ceil(n.retry_s));
        break;
    case VD_CLIENT_REFUSED:
    case VD_CLIENT_MISMATCHED:
    case VD_CLIENT_ENDED:
        out->failed = true;
        (void)snprintf(out->state, sizeof out->state, "%s: %.360s",
                       r->module.client_state_name(n.state), n.sentence);
        break;
    default:
        break;
    }
    (void)snprintf(out->lines[0], sizeof out->lines[0], "%d shown  %d held  %.1f MiB", n.ordered,
                   n.held, (double)n.held_bytes / 1048576.0);
    (void)snprintf(out->lines[1], sizeof out->lines[1], "%.1f MB/s  %.0f ms  %.2f px  %.1f MB",
                   1e-6 * n.last.link_bytes_per_s, 1e3 * n.answer_s, n.last.error_px,
                   1e-6 * (double)n.bytes);
}

/* ---- where to look from -----------------------------------------------------------------------*/

static bool read_number(const json_t *from, const char *key, double least, double most,
                        double *out) {
    const json_t *value = json_object_get(from, key);
    const double number = json_is_number(value) ? json_number_value(value) : NAN;
    if (number >= least && number <= most) {
        *out = number;
        return true;
    }
    return false;
}

static bool read_vector(const json_t *from, const char *key, double out[3]) {
    const json_t *value = json_object_get(from, key);
    for (size_t i = 0; i < 3; i++) {
        const json_t *part = json_array_get(value, i);
        out[i] = json_is_number(part) ? json_number_value(part) : NAN;
        if (!(fabs(out[i]) <= 1e9)) {
            return false;
        }
    }
    return true;
}

/* Anything may stand in it: a server sent it. */
static bool read_world(const char *text, vd_window_scene *out) {
    json_t *root = json_loads(text, 0, NULL);
    const json_t *camera = json_object_get(root, "camera");
    const json_t *bounds = json_object_get(root, "bounds");
    vd_camera_settings *start = &out->start;
    double low[3], high[3], size = 0.0;
    start->spelling = VD_SPELLING_ANGLES;
    start->eye.kind = VD_POSITION_WORLD;
    const bool good = read_vector(camera, "eye", start->eye.v) &&
                      read_number(camera, "heading", -3600, 3600, &start->heading) &&
                      read_number(camera, "pitch", -90, 90, &start->pitch) &&
                      read_number(camera, "roll", -360, 360, &start->roll) &&
                      read_number(camera, "fov", 0.01, 179, &start->fov) &&
                      read_number(camera, "near", 1e-6, 1e6, &start->near_m);
    if (read_vector(bounds, "min", low) && read_vector(bounds, "max", high)) {
        for (int i = 0; i < 3; i++) {
            size += (high[i] - low[i]) * (high[i] - low[i]);
        }
    }
    out->size_m = size > 0.0 ? sqrt(size) : 1000.0;
    json_decref(root);
    return good;
}

static void set_stage(vd_client_state state, vd_window_stage_function *stage, void *user) {
    stage(user, state == VD_CLIENT_LOST         ? "looking again for"
                : state == VD_CLIENT_CONNECTING ? "connecting to"
                                                : "asking about");
}

static vd_status wait_for_world(remote *r, vd_job *job, vd_window_stage_function *stage, void *user,
                                vd_window_scene *out) {
    char *text = malloc(WORLD_BYTES);
    vd_status status =
        text != NULL ? vd_success() : vd_failure(VD_ERROR_MEMORY, "out of memory while connecting");
    vd_client_state shown = VD_CLIENT_STATE_COUNT;
    const double until_s = vd_seconds_now() + PATIENCE_S;
    while (status.code == VD_OK) {
        vd_client_news n;
        r->module.client_get_news(r->client, &n);
        if (n.state != shown) {
            set_stage(n.state, stage, user);
        }
        shown = n.state;
        if (r->module.client_get_world(r->client, text, WORLD_BYTES)) {
            status = read_world(text, out)
                         ? status
                         : vd_failure(VD_ERROR_FORMAT, "the server's /world.json says no camera; "
                                                       "start it again, of this version");
            break;
        }
        if (n.state >= VD_CLIENT_REFUSED) {
            status = vd_failure(VD_ERROR_IO, "%s: %.360s", r->module.client_state_name(n.state),
                                n.sentence);
        } else if (vd_job_stopped(job)) {
            status = vd_failure(VD_ERROR_CANCELLED, "cancelled while connecting");
        } else if (vd_seconds_now() > until_s) {
            status = vd_failure(VD_ERROR_IO, "%.370s",
                                n.sentence[0] != '\0' ? n.sentence : "the server does not answer");
        }
        nanosleep(&(struct timespec){0, 5000000}, NULL);
    }
    free(text);
    return status;
}

vd_status vd_window_remote_open(vd_context *context, vd_job *job, const vd_window_remote *def,
                                const vd_render_settings *settings, vd_window_stage_function *stage,
                                void *stage_user, void (*wake)(void *user), void *wake_user,
                                vd_window_scene *out) {
    remote *r = calloc(1, sizeof *r);
    if (r == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory while connecting");
    }
    vd_window_scene made = {.user = r,
                            .draw = draw,
                            .impostors = impostors,
                            .look = look,
                            .ground = ground,
                            .news = news,
                            .destroy = destroy};
    vd_status status = vd_remote_module_open("connect to a server", &r->module);
    if (status.code == VD_OK) {
        vd_client_def client = r->module.client_def_default();
        client.url = def->url;
        client.insecure = def->insecure;
        client.wants_world = true;
        client.memory_bytes = (size_t)def->memory_bytes;
        client.settings.tolerance_px = (float)settings->tolerance_px;
        client.wake = wake;
        client.wake_user = wake_user;
        status = r->module.client_create(context, &client, &r->client);
    }
    if (status.code == VD_OK) {
        status = wait_for_world(r, job, stage, stage_user, &made);
    }
    if (status.code != VD_OK) {
        destroy(r);
        return status;
    }
    *out = made;
    return status;
}
