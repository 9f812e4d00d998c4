/* bench_relay.c: the relay's thread.
 *
 * A direction is a ring of bytes and of arrivals: what was read at a time may leave half a round
 * trip later, or when the bytes before it have left at the link's speed. When the ring is full
 * nothing is read: the sender's own TCP waits, as before a router.
 */
#include "bench_relay.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "run.h"

/* A router's buffer beside what is under way, and the pieces it forwards. */
enum { MOST_PAIRS = 64, MOST_CHUNKS = 4096, BUFFER_BYTES = 64 << 10, PIECE_BYTES = 4096 };

typedef struct chunk {
    double leaves_s;
    size_t bytes, sent;
    char data[PIECE_BYTES];
} chunk;

typedef struct direction {
    chunk *chunks; /* a ring */
    int first, count, room;
    double free_s; /* when the link is */
} direction;

typedef struct pair {
    int ends[2]; /* client, server; −1: closed */
    direction to[2];
} pair;

struct bench_relay {
    int listener, port, server_port;
    double bytes_per_s, delay_s;
    int room; /* chunks of a direction */
    pthread_t thread;
    bool started;
    atomic_bool stopping;
    pair pairs[MOST_PAIRS];
    int count;
};

static void close_pair(pair *p) {
    for (int i = 0; i < 2; i++) {
        if (p->ends[i] >= 0) {
            (void)close(p->ends[i]);
        }
        free(p->to[i].chunks);
    }
}

static void accept_one(bench_relay *r) {
    const int client = accept(r->listener, NULL, NULL), one = 1;
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_port = htons((uint16_t)r->server_port)};
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int server = socket(AF_INET, SOCK_STREAM, 0);
    pair made = {.ends = {client, server}};
    for (int i = 0; i < 2; i++) {
        made.to[i].chunks = calloc((size_t)r->room, sizeof *made.to[i].chunks);
        made.to[i].room = r->room;
    }
    if (client < 0 || server < 0 || made.to[0].chunks == NULL || made.to[1].chunks == NULL ||
        r->count == MOST_PAIRS || connect(server, (struct sockaddr *)&at, sizeof at) != 0) {
        close_pair(&made);
        return;
    }
    for (int i = 0; i < 2; i++) {
        (void)setsockopt(made.ends[i], IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
    }
    /* What the kernel would buffer besides would hide the link from the server. */
    const int small = BUFFER_BYTES;
    (void)setsockopt(server, SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
    r->pairs[r->count++] = made;
}

/* Reads one piece that goes to end `to`; false at its end. */
static bool take(bench_relay *r, pair *p, int to) {
    direction *d = &p->to[to];
    chunk *c = &d->chunks[(d->first + d->count) % d->room];
    const ssize_t got = recv(p->ends[1 - to], c->data, sizeof c->data, MSG_DONTWAIT);
    if (got <= 0) {
        return got < 0 && (errno == EAGAIN || errno == EINTR);
    }
    const double now = vd_seconds_now();
    d->free_s = (d->free_s > now ? d->free_s : now) + (double)got / r->bytes_per_s;
    c->bytes = (size_t)got;
    c->sent = 0;
    c->leaves_s = d->free_s + r->delay_s;
    d->count++;
    return true;
}

/* Sends what is due to end `to`; false when that is gone. */
static bool pass_on(pair *p, int to, double now) {
    direction *d = &p->to[to];
    while (d->count > 0 && d->chunks[d->first].leaves_s <= now) {
        chunk *c = &d->chunks[d->first];
        const ssize_t sent =
            send(p->ends[to], c->data + c->sent, c->bytes - c->sent, MSG_DONTWAIT | MSG_NOSIGNAL);
        if (sent < 0) {
            return errno == EAGAIN || errno == EINTR;
        }
        c->sent += (size_t)sent;
        if (c->sent < c->bytes) {
            return true;
        }
        d->first = (d->first + 1) % d->room;
        d->count--;
    }
    return true;
}

/* Waits for something to read, or a millisecond while something is under way. */
static void wait_for_some(bench_relay *r) {
    struct pollfd fds[1 + 2 * MOST_PAIRS];
    nfds_t count = 0;
    bool under_way = false;
    fds[count++] = (struct pollfd){.fd = r->listener, .events = POLLIN};
    for (int i = 0; i < r->count; i++) {
        for (int to = 0; to < 2; to++) {
            const direction *d = &r->pairs[i].to[to];
            under_way = under_way || d->count > 0;
            if (d->count < d->room) {
                fds[count++] = (struct pollfd){.fd = r->pairs[i].ends[1 - to], .events = POLLIN};
            }
        }
    }
    (void)poll(fds, count, under_way ? 1 : 20);
    if ((fds[0].revents & POLLIN) != 0) {
        accept_one(r);
    }
}

static void *run(void *user) {
    bench_relay *r = user;
    while (!atomic_load(&r->stopping)) {
        wait_for_some(r);
        const double now = vd_seconds_now();
        for (int i = 0; i < r->count; i++) {
            pair *p = &r->pairs[i];
            bool open = true;
            for (int to = 0; to < 2 && open; to++) {
                for (int k = 0; k < 16 && open && p->to[to].count < p->to[to].room; k++) {
                    const int before = p->to[to].count;
                    open = take(r, p, to);
                    k = p->to[to].count == before ? 16 : k;
                }
                open = open && pass_on(p, to, now);
            }
            if (!open) {
                close_pair(p);
                *p = r->pairs[--r->count];
                i--;
            }
        }
    }
    return NULL;
}

vd_status bench_relay_open(int port, double bytes_per_s, double round_trip_s, bench_relay **out) {
    bench_relay *r = calloc(1, sizeof *r);
    if (r == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory for a slower network");
    }
    r->server_port = port;
    r->bytes_per_s = bytes_per_s;
    r->delay_s = 0.5 * round_trip_s;
    r->room = (int)((bytes_per_s * round_trip_s + BUFFER_BYTES) / PIECE_BYTES) + 16;
    r->room = r->room < MOST_CHUNKS ? r->room : MOST_CHUNKS;
    struct sockaddr_in at = {.sin_family = AF_INET};
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof at;
    r->listener = socket(AF_INET, SOCK_STREAM, 0);
    if (r->listener < 0 || bind(r->listener, (struct sockaddr *)&at, sizeof at) != 0 ||
        listen(r->listener, MOST_PAIRS) != 0 ||
        getsockname(r->listener, (struct sockaddr *)&at, &length) != 0) {
        const vd_status status =
            vd_failure(VD_ERROR_IO, "cannot listen on loopback: %s", strerror(errno));
        bench_relay_close(&r);
        return status;
    }
    r->port = ntohs(at.sin_port);
    r->started = pthread_create(&r->thread, NULL, run, r) == 0;
    if (!r->started) {
        bench_relay_close(&r);
        return vd_failure(VD_ERROR_MEMORY, "cannot start a thread; end other programs");
    }
    *out = r;
    return vd_success();
}

void bench_relay_close(bench_relay **relay) {
    bench_relay *r = *relay;
    if (r == NULL) {
        return;
    }
    atomic_store(&r->stopping, true);
    if (r->started) {
        pthread_join(r->thread, NULL);
    }
    for (int i = 0; i < r->count; i++) {
        close_pair(&r->pairs[i]);
    }
    if (r->listener >= 0) {
        (void)close(r->listener);
    }
    free(r);
    *relay = NULL;
}

int bench_relay_port(const bench_relay *relay) {
    return relay->port;
}
