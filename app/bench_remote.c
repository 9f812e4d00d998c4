/* bench_remote.c: a real server and its clients over loopback, through slower links.
 *
 * The clients are those of `veduta view --connect`, without a window. The camera goes round as in
 * data/paths/orbit.json while a frame is drawn every sixtieth of a second, with whatever has come;
 * some of the frames are kept and compared with direct ones after the server has stopped, so that
 * drawing these takes nothing from it.
 */
#include "bench_cloud.h"
#include "bench_forest.h"
#include "bench_relay.h"
#include "remote_module.h"
#include "run.h"

#include <arpa/inet.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

enum { MOST_CLIENTS = 32, MOST_KEPT = 16, MOST_FRAMES = 4096, MOST_ANSWERS = 200 };

#define PERIOD_S (1.0 / 60)

typedef struct stage {
    vd_remote_module remote;
    bench_forest forest; /* the server's context: its memory is measured */
    vd_server *server;
    pthread_t threads[2];
    int running;
    bench_relay *relay;
    vd_camera_path *path;
    vd_context *context; /* the clients' */
    vd_frame *frame;
    vd_client *clients[MOST_CLIENTS];
    int client_count;
    double apart_s; /* along the path, from each client to the next */
    double times_ms[MOST_FRAMES];
    int time_count;
    vd_frame *kept[MOST_KEPT];
    vd_camera kept_from[MOST_KEPT];
    int kept_count;
    vd_client_news before, after;
    double seconds;
} stage;

static void sleep_until(double at_s) {
    const double left_s = at_s - vd_seconds_now();
    if (left_s > 0.0) {
        nanosleep(&(struct timespec){(time_t)left_s, (long)(1e9 * fmod(left_s, 1.0))}, NULL);
    }
}

/* ---- server and clients -----------------------------------------------------------------------*/

static void *listen_thread(void *user) {
    stage *s = user;
    const vd_status status = s->remote.server_listen(s->server);
    (void)status.code; /* clients notice */
    return NULL;
}

static void *render_thread(void *user) {
    stage *s = user;
    const vd_status status = s->remote.server_render(s->server, NULL);
    (void)status.code;
    return NULL;
}

static void stop_server(stage *s) {
    if (s->server != NULL) {
        s->remote.server_stop(s->server);
        for (int i = 0; i < s->running; i++) {
            pthread_join(s->threads[i], NULL);
        }
        s->running = 0;
        s->remote.server_destroy(&s->server);
    }
}

static void leave(stage *s) {
    for (int i = 0; i < s->client_count; i++) {
        s->remote.client_destroy(&s->clients[i]);
    }
    s->client_count = 0;
    bench_relay_close(&s->relay);
}

static void finish(stage *s) {
    leave(s);
    stop_server(s);
    for (int i = 0; i < s->kept_count; i++) {
        vd_frame_destroy(&s->kept[i]);
    }
    vd_frame_destroy(&s->frame);
    vd_context_destroy(&s->context);
    vd_camera_path_destroy(&s->path);
    bench_forest_finish(&s->forest);
}

static double ground_of(void *user, double x, double y) {
    const stage *s = user;
    return vd_world_ground(s->forest.world, x, y);
}

/* The circle of data/paths/orbit.json, about the middle of the forest. */
static vd_status make_path(stage *s) {
    vd_orbit_def orbit = vd_orbit_def_default();
    orbit.centre = bench_forest_middle(&s->forest);
    orbit.centre.z += 20.0;
    orbit.radius_m = 1200.0;
    orbit.height_m = 450.0;
    orbit.duration_s = 30.0;
    orbit.fov_y_rad = 50.0 * 3.14159265358979323846 / 180.0;
    orbit.near_m = 1.0;
    vd_status status = vd_camera_path_create_orbit(s->forest.s.context, &orbit, &s->path);
    if (status.code == VD_OK) {
        status = vd_camera_path_clear(s->path, ground_of, s, 40.0, NULL);
    }
    return status;
}

static vd_status start_server(stage *s) {
    vd_server_def def = s->remote.server_def_default();
    def.world = s->forest.world;
    def.renderer = s->forest.renderer;
    def.token = "bench";
    def.max_clients = MOST_CLIENTS;
    vd_status status = s->remote.server_create(s->forest.s.context, &def, &s->server);
    void *(*const parts[2])(void *) = {render_thread, listen_thread};
    for (int i = 0; i < 2 && status.code == VD_OK; i++) {
        if (pthread_create(&s->threads[i], NULL, parts[i], s) != 0) {
            status = vd_failure(VD_ERROR_MEMORY, "cannot start a thread; end other programs");
        } else {
            s->running++;
        }
    }
    return status;
}

static vd_status begin(bench_run *run, const bench_case *self, const bench_forest_cloud *cloud,
                       stage *s) {
    memset(s, 0, sizeof *s);
    vd_status status = vd_remote_module_open("measure a server", &s->remote);
    if (status.code != VD_OK) {
        return status;
    }
    status = bench_forest_init(&s->forest, run, self->camera, cloud, run->isas[0],
                               run->threads[run->thread_count - 1], self->width, self->rows);
    if (status.code == VD_OK) {
        status = bench_forest_renderer(&s->forest, 4);
    }
    if (status.code == VD_OK) {
        status = make_path(s);
    }
    vd_context_def def = vd_context_def_default();
    def.threads = 1; /* a client's, which draws beside the server here */
    if (status.code == VD_OK) {
        status = vd_context_create(&def, &s->context);
    }
    if (status.code == VD_OK) {
        status = vd_frame_create(s->context, self->width, self->rows, 0, &s->frame);
    }
    return status.code == VD_OK ? start_server(s) : status;
}

static vd_status join(stage *s, vd_wire_mode mode) {
    char url[100];
    const int port =
        s->relay != NULL ? bench_relay_port(s->relay) : s->remote.server_port(s->server);
    (void)snprintf(url, sizeof url, "http://127.0.0.1:%d/#token=bench", port);
    vd_client_def def = s->remote.client_def_default();
    def.url = url;
    def.settings.mode = mode;
    vd_status status = s->remote.client_create(s->context, &def, &s->clients[s->client_count]);
    s->client_count += status.code == VD_OK;
    return status;
}

static vd_client_news news_of(stage *s, int client) {
    vd_client_news news;
    s->remote.client_get_news(s->clients[client], &news);
    return news;
}

/* Waits until every client shows something of where it looks, and stands still. */
static vd_status settle(stage *s, double at_s) {
    vd_camera camera;
    const double until_s = vd_seconds_now() + 30.0;
    for (int i = 0; i < s->client_count; i++) {
        vd_camera_path_at(s->path, at_s + i * s->apart_s, s->frame->width, s->frame->height,
                          &camera);
        s->remote.client_look(s->clients[i], &camera, s->frame->width, s->frame->height);
    }
    for (int i = 0; i < s->client_count;) {
        const vd_client_news news = news_of(s, i);
        if (news.state >= VD_CLIENT_LOST || vd_seconds_now() > until_s) {
            return vd_failure(VD_ERROR_IO, "a client of the bench is %s: %.200s",
                              s->remote.client_state_name(news.state), news.sentence);
        }
        i += news.state == VD_CLIENT_SHOWING;
        nanosleep(&(struct timespec){0, 2000000}, NULL);
    }
    sleep_until(vd_seconds_now() + 0.5);
    return vd_success();
}

/* ---- a flight over a link ---------------------------------------------------------------------*/

static vd_status keep_frame(stage *s, const vd_camera *camera) {
    if (s->kept_count == MOST_KEPT) {
        return vd_success();
    }
    vd_frame **to = &s->kept[s->kept_count];
    const vd_status status = vd_frame_create(s->context, s->frame->width, s->frame->height, 0, to);
    if (status.code == VD_OK) {
        memcpy((*to)->rgba, s->frame->rgba, 4 * s->frame->stride * (size_t)s->frame->height);
        s->kept_from[s->kept_count++] = *camera;
    }
    return status;
}

/* Flies for so long, the first client's frames drawn at 60 a second. */
static vd_status fly(stage *s, double seconds, double from_s) {
    const int frames = (int)(seconds / PERIOD_S), every = frames / MOST_KEPT + 1;
    const double start_s = vd_seconds_now();
    double last_s = start_s, due_s = start_s;
    vd_status status = vd_success();
    s->before = news_of(s, 0);
    s->time_count = s->kept_count = 0;
    for (int i = 1; vd_seconds_now() - start_s < seconds && status.code == VD_OK; i++) {
        vd_camera camera;
        const double at_s = vd_seconds_now() - start_s;
        for (int c = 0; c < s->client_count; c++) {
            vd_camera_path_at(s->path, from_s + at_s + c * s->apart_s, s->frame->width,
                              s->frame->height, &camera);
            s->remote.client_look(s->clients[c], &camera, s->frame->width, s->frame->height);
        }
        vd_camera_path_at(s->path, from_s + at_s, s->frame->width, s->frame->height, &camera);
        status = s->remote.client_draw(s->clients[0], NULL, &camera, s->frame, NULL);
        const double now_s = vd_seconds_now();
        if (s->time_count < MOST_FRAMES) {
            s->times_ms[s->time_count++] = 1e3 * (now_s - last_s);
        }
        last_s = now_s;
        if (status.code == VD_OK && i % every == 0) {
            status = keep_frame(s, &camera);
        }
        due_s = due_s + PERIOD_S > now_s ? due_s + PERIOD_S : now_s; /* late ones do not catch up */
        sleep_until(due_s);
    }
    s->seconds = vd_seconds_now() - start_s;
    s->after = news_of(s, 0);
    return status;
}

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void fill_times(bench_result *r, double *times_ms, int count, double high) {
    qsort(times_ms, (size_t)count, sizeof *times_ms, compare);
    r->median_ms = count > 0 ? times_ms[count / 2] : 0.0;
    r->p99_ms = count > 0 ? times_ms[(int)(high * (count - 1))] : 0.0;
    r->min_ms = count > 0 ? times_ms[0] : 0.0;
}

/* The mean error of the kept frames, which it forgets. */
static vd_status measure_error(stage *s, double *mean, double *worst) {
    vd_status status = vd_success();
    *mean = *worst = 0.0;
    for (int i = 0; i < s->kept_count; i++) {
        if (status.code == VD_OK) {
            status = vd_world_renderer_draw(s->forest.renderer, NULL, &s->kept_from[i],
                                            s->forest.s.frame, NULL);
        }
        const double error =
            status.code == VD_OK ? vd_frame_error(s->kept[i], s->forest.s.frame) : 0.0;
        *mean += error / s->kept_count;
        *worst = fmax(*worst, error);
        vd_frame_destroy(&s->kept[i]);
    }
    s->kept_count = 0;
    return status;
}

static bench_result result_of(const stage *s, const bench_case *self, const char *method) {
    bench_result r = bench_result_of(self, method);
    r.threads = vd_context_threads(s->forest.s.context);
    r.isa = vd_context_isa(s->forest.s.context);
    r.width = s->frame->width;
    r.height = s->frame->height;
    return r;
}

static vd_status measure_link(bench_run *run, const bench_case *self, const char *method,
                              const bench_forest_cloud *cloud, double bytes_per_s,
                              double round_trip_s, vd_wire_mode mode) {
    static stage s; /* large */
    double mean = 0.0, worst = 0.0;
    vd_status status = begin(run, self, cloud, &s);
    if (status.code == VD_OK && bytes_per_s > 0.0) {
        status =
            bench_relay_open(s.remote.server_port(s.server), bytes_per_s, round_trip_s, &s.relay);
    }
    if (status.code == VD_OK) {
        status = join(&s, mode);
    }
    if (status.code == VD_OK) {
        status = settle(&s, 0.0);
    }
    if (status.code == VD_OK) {
        status = fly(&s, run->quick ? 1.0 : 15.0, 0.0);
    }
    if (status.code == VD_OK) {
        bench_result r = result_of(&s, self, method);
        fill_times(&r, s.times_ms, s.time_count, 0.99);
        leave(&s);
        stop_server(&s);
        status = measure_error(&s, &mean, &worst);
        (void)snprintf(
            r.note, sizeof r.note, "error %.3f, worst %.3f; %.2f MB/s, %.0f pictures/s", mean,
            worst, 1e-6 * (double)(s.after.bytes - s.before.bytes) / s.seconds,
            (double)(s.after.pictures + s.after.screens - s.before.pictures - s.before.screens) /
                s.seconds);
        status = status.code == VD_OK ? bench_add(run, &r) : status;
    }
    finish(&s);
    return status;
}

static vd_status measure_links(bench_run *run, const bench_case *self,
                               const bench_forest_cloud *cloud) {
    static const struct {
        const char *method;
        double bytes_per_s, round_trip_s;
        vd_wire_mode mode;
    } ways[] = {{"loopback", 0.0, 0.0, VD_WIRE_MODE_IMPOSTORS},
                {"10 MB/s, 50 ms", 10e6, 0.05, VD_WIRE_MODE_IMPOSTORS},
                {"10 MB/s, screens", 10e6, 0.05, VD_WIRE_MODE_SCREENS},
                {"1 MB/s, 150 ms", 1e6, 0.15, VD_WIRE_MODE_IMPOSTORS},
                {"1 MB/s, screens", 1e6, 0.15, VD_WIRE_MODE_SCREENS}};
    vd_status status = vd_success();
    for (size_t i = 0; i < sizeof ways / sizeof ways[0] && status.code == VD_OK; i++) {
        status = measure_link(run, self, ways[i].method, cloud, ways[i].bytes_per_s,
                              ways[i].round_trip_s, ways[i].mode);
    }
    return status;
}

vd_status bench_remote(bench_run *run, const bench_case *self) {
    return measure_links(run, self, NULL);
}

vd_status bench_remote_cloud(bench_run *run, const bench_case *self) {
    enum { PARTICLES = 2000000, FEW = 200000 };
    char path[512];
    bench_cloud_path(path, sizeof path);
    const bench_forest_cloud cloud = {path, run->particles > 0 ? run->particles
                                            : run->quick       ? FEW
                                                               : PARTICLES};
    const vd_status status = measure_links(run, self, &cloud);
    unlink(path);
    return status;
}

/* ---- from a camera to the first better picture ------------------------------------------------*/

vd_status bench_remote_answer(bench_run *run, const bench_case *self) {
    static stage s;
    static double times_ms[MOST_ANSWERS];
    int count = 0;
    const int wanted = run->quick ? 5 : MOST_ANSWERS;
    vd_status status = begin(run, self, NULL, &s);
    if (status.code == VD_OK) {
        status = join(&s, VD_WIRE_MODE_IMPOSTORS);
    }
    if (status.code == VD_OK) {
        status = settle(&s, 0.0);
    }
    /* Moves as far as in a fifteenth of a second, now and then: each is answered for itself. */
    for (int i = 1; i < 4 * wanted && count < wanted && status.code == VD_OK; i++) {
        vd_camera camera;
        const uint64_t before = news_of(&s, 0).answers;
        vd_camera_path_at(s.path, i / 15.0, s.frame->width, s.frame->height, &camera);
        s.remote.client_look(s.clients[0], &camera, s.frame->width, s.frame->height);
        sleep_until(vd_seconds_now() + 0.1);
        const vd_client_news after = news_of(&s, 0);
        if (after.answers > before) {
            times_ms[count++] = 1e3 * after.answer_s;
        }
    }
    if (status.code == VD_OK) {
        bench_result r = result_of(&s, self, "camera to picture");
        fill_times(&r, times_ms, count, 0.95);
        (void)snprintf(r.note, sizeof r.note, "p95 in place of p99; %d answers", count);
        status = bench_add(run, &r);
    }
    finish(&s);
    return status;
}

/* ---- many clients -----------------------------------------------------------------------------*/

static vd_status measure_clients(bench_run *run, const bench_case *self, int clients,
                                 double apart_s, double *one_bytes) {
    static stage s;
    double rates[MOST_CLIENTS], sum = 0.0, least = INFINITY, held = 0.0;
    vd_client_news before[MOST_CLIENTS];
    vd_status status = begin(run, self, NULL, &s);
    s.apart_s = apart_s;
    for (int i = 0; i < clients && status.code == VD_OK; i++) {
        status = join(&s, VD_WIRE_MODE_IMPOSTORS);
    }
    if (status.code == VD_OK) {
        status = settle(&s, 0.0);
    }
    for (int i = 0; i < s.client_count; i++) {
        before[i] = news_of(&s, i);
    }
    vd_context_memory_reset_peak(s.forest.s.context);
    if (status.code == VD_OK) {
        status = fly(&s, run->quick ? 1.0 : 15.0, 0.0);
    }
    for (int i = 0; i < s.client_count && status.code == VD_OK; i++) {
        const vd_client_news after = news_of(&s, i);
        rates[i] = (double)(after.batches - before[i].batches) / s.seconds;
        sum += rates[i];
        least = fmin(least, rates[i]);
        held += (double)after.held_bytes;
    }
    if (status.code == VD_OK) {
        bench_result r = result_of(&s, self, apart_s > 0.0 ? "clients" : "at one place");
        r.at = clients;
        fill_times(&r, s.times_ms, s.time_count, 0.99);
        r.peak_bytes = vd_context_memory(s.forest.s.context).bytes_peak;
        *one_bytes = clients == 1 ? (double)r.peak_bytes : *one_bytes;
        (void)snprintf(r.note, sizeof r.note,
                       "%.1f updates/s each, slowest %.0f %%; %.2f x one's memory, %.0f MB held",
                       sum / clients, sum > 0.0 ? 100.0 * least * clients / sum : 0.0,
                       (double)r.peak_bytes / *one_bytes, 1e-6 * held);
        status = bench_add(run, &r);
    }
    finish(&s);
    return status;
}

vd_status bench_remote_clients(bench_run *run, const bench_case *self) {
    static const struct {
        int clients;
        double apart_s;
    } ways[] = {{1, 1.0}, {8, 1.0}, {8, 0.0}, {32, 1.0}, {32, 0.0}};
    double one_bytes = 1.0;
    vd_status status = vd_success();
    for (int i = 0; i < (run->quick ? 3 : 5) && status.code == VD_OK; i++) {
        status = measure_clients(run, self, ways[i].clients, ways[i].apart_s, &one_bytes);
    }
    return status;
}

/* ---- messages ---------------------------------------------------------------------------------*/

typedef struct pipe_ends {
    int ends[2];
    size_t bytes, total;
} pipe_ends;

static void *swallow(void *user) {
    pipe_ends *p = user;
    static char into[1 << 20];
    size_t left = p->total;
    while (left > 0) {
        const ssize_t got = recv(p->ends[1], into, sizeof into, 0);
        if (got <= 0) {
            break;
        }
        left -= (size_t)got;
    }
    const char done = 1;
    return send(p->ends[1], &done, 1, MSG_NOSIGNAL) == 1 ? p : NULL;
}

static vd_status connect_ends(pipe_ends *p) {
    struct sockaddr_in at = {.sin_family = AF_INET};
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof at;
    const int listener = socket(AF_INET, SOCK_STREAM, 0);
    p->ends[0] = socket(AF_INET, SOCK_STREAM, 0);
    p->ends[1] = -1;
    if (listener >= 0 && p->ends[0] >= 0 && bind(listener, (struct sockaddr *)&at, length) == 0 &&
        listen(listener, 1) == 0 && getsockname(listener, (struct sockaddr *)&at, &length) == 0 &&
        connect(p->ends[0], (struct sockaddr *)&at, length) == 0) {
        p->ends[1] = accept(listener, NULL, NULL);
    }
    (void)close(listener);
    return p->ends[1] >= 0 ? vd_success()
                           : vd_failure(VD_ERROR_IO, "cannot connect over loopback; allow it");
}

static vd_status measure_messages(bench_run *run, const bench_case *self, size_t bytes) {
    static char message[1 << 20];
    pipe_ends p = {.bytes = bytes};
    const size_t count = run->quick ? 100 : bytes < 1024 ? 200000 : (size_t)(400 << 20) / bytes;
    p.total = bytes * count;
    pthread_t thread;
    vd_status status = connect_ends(&p);
    if (status.code != VD_OK || pthread_create(&thread, NULL, swallow, &p) != 0) {
        return status.code != VD_OK ? status : vd_failure(VD_ERROR_MEMORY, "cannot start a thread");
    }
    const double start_s = vd_seconds_now();
    for (size_t i = 0; i < count; i++) {
        for (size_t sent = 0; sent < bytes;) {
            const ssize_t n = send(p.ends[0], message + sent, bytes - sent, MSG_NOSIGNAL);
            sent = n > 0 ? sent + (size_t)n : bytes;
        }
    }
    char done;
    const bool good = recv(p.ends[0], &done, 1, 0) == 1;
    const double seconds = vd_seconds_now() - start_s;
    pthread_join(thread, NULL);
    (void)close(p.ends[0]);
    (void)close(p.ends[1]);
    bench_result r = bench_result_of(self, "TCP, one way");
    r.at = (double)bytes;
    r.median_ms = r.p99_ms = r.min_ms = 1e3 * seconds / (double)count;
    (void)snprintf(r.note, sizeof r.note, "%.0f messages/s, %.3g MB/s", (double)count / seconds,
                   1e-6 * (double)p.total / seconds);
    return good ? bench_add(run, &r) : vd_failure(VD_ERROR_IO, "loopback broke; try again");
}

vd_status bench_remote_messages(bench_run *run, const bench_case *self) {
    vd_status status = vd_success();
    const int points = bench_sweep_points(run, self->sweep);
    for (int i = 0; i < points && status.code == VD_OK; i++) {
        status = measure_messages(run, self, (size_t)self->sweep->values[i]);
    }
    return status;
}
