/* bench_relay.h: a slower network in one thread: TCP connections that are passed on late and not
 * faster than so many bytes a second, down to the clients; both ways share the delay. */
#ifndef VEDUTA_APP_BENCH_RELAY_H
#define VEDUTA_APP_BENCH_RELAY_H

#include <veduta/status.h>

typedef struct bench_relay bench_relay;

/* Listens on loopback and passes every connection on to `port` there. `round_trip_s` is added to
 * every exchange, half each way. Returns VD_ERROR_IO or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status bench_relay_open(int port, double bytes_per_s, double round_trip_s,
                                       bench_relay **out);
void bench_relay_close(bench_relay **relay);

/* To connect to. */
int bench_relay_port(const bench_relay *relay);

#endif
