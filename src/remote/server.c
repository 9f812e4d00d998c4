/* server.c: opening, the network's loop, closing. */
#include <arpa/inet.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include "remote/server_internal.h"

vd_server_def vd_server_def_default(void) {
    return (vd_server_def){.max_clients = 32, .memory_bytes = (size_t)64 << 20};
}

#if VEDUTA_HAVE_WEBSOCKETS

#include <libwebsockets.h>
#include <openssl/ssl.h>

/* After a stop: for telling clients. */
#define GOODBYE_S 2.0

double vd_server_now_s(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* ---- opening ----------------------------------------------------------------------------------*/

static vd_status check(const vd_server_def *def) {
    const size_t token = def->token != NULL ? strlen(def->token) : 0;
    if (def->world == NULL || def->renderer == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "a server needs a world and its renderer");
    }
    if (token < 1 || token > VD_WIRE_TOKEN_BYTES) {
        return vd_failure(VD_ERROR_ARGUMENT, "a server's token has 1 to %d bytes, not %zu",
                          VD_WIRE_TOKEN_BYTES, token);
    }
    if (def->port < 0 || def->port > 65535 || def->max_clients < 1 || def->max_clients > 4096) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "port %d or max_clients %d is out of range: 0 to 65535, 1 to 4096",
                          def->port, def->max_clients);
    }
    if (!isfinite(def->bytes_per_s) || def->bytes_per_s < 0.0 ||
        def->memory_bytes < VD_SESSION_LEAST_MEMORY) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "bytes_per_s %g or memory_bytes %zu is out of range: 0 or more, 4 MiB "
                          "or more",
                          def->bytes_per_s, def->memory_bytes);
    }
    if ((def->certificate == NULL) != (def->key == NULL)) {
        return vd_failure(VD_ERROR_ARGUMENT, "TLS needs a certificate and its key; give both");
    }
    return vd_success();
}

static const char *address_of(const vd_server_def *def) {
    return def->address != NULL ? def->address : "127.0.0.1";
}

/* Binds for a moment: the network's library does not say why it could not. */
static vd_status try_address(const vd_server_def *def) {
    struct sockaddr_in v4 = {.sin_family = AF_INET, .sin_port = htons((uint16_t)def->port)};
    struct sockaddr_in6 v6 = {.sin6_family = AF_INET6, .sin6_port = htons((uint16_t)def->port)};
    const char *address = address_of(def);
    const bool is_v4 = inet_pton(AF_INET, address, &v4.sin_addr) == 1;
    if (!is_v4 && inet_pton(AF_INET6, address, &v6.sin6_addr) != 1) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "\"%.60s\" is no address to listen at; give one such as 127.0.0.1, "
                          "0.0.0.0 or ::1",
                          address);
    }
    const int one = 1, trial = socket(is_v4 ? AF_INET : AF_INET6, SOCK_STREAM, 0);
    const struct sockaddr *at = is_v4 ? (const struct sockaddr *)&v4 : (const struct sockaddr *)&v6;
    int error = trial < 0 ? errno : 0;
    if (error == 0) {
        (void)setsockopt(trial, SOL_SOCKET, SO_REUSEADDR, &one, sizeof one);
        error = bind(trial, at, is_v4 ? sizeof v4 : sizeof v6) != 0 || listen(trial, 1) != 0 ? errno
                                                                                             : 0;
    }
    if (trial >= 0) {
        (void)close(trial);
    }
    if (error != 0) {
        return vd_failure(VD_ERROR_IO,
                          "cannot listen at %.60s, port %d: %s; give another --port "
                          "or --bind",
                          address, def->port, strerror(error));
    }
    return vd_success();
}

static vd_status check_certificate(const vd_server_def *def) {
    const char *files[2] = {def->certificate, def->key};
    for (int i = 0; i < 2 && def->certificate != NULL; i++) {
        if (access(files[i], R_OK) != 0) {
            return vd_failure(VD_ERROR_IO, "cannot read %.200s: %s; name a PEM file", files[i],
                              strerror(errno));
        }
    }
    if (def->certificate == NULL) {
        return vd_success();
    }
    SSL_CTX *trial = SSL_CTX_new(TLS_server_method());
    const bool good = trial != NULL &&
                      SSL_CTX_use_certificate_chain_file(trial, def->certificate) == 1 &&
                      SSL_CTX_use_PrivateKey_file(trial, def->key, SSL_FILETYPE_PEM) == 1 &&
                      SSL_CTX_check_private_key(trial) == 1;
    SSL_CTX_free(trial);
    return good ? vd_success()
                : vd_failure(VD_ERROR_IO,
                             "%.150s and %.150s are no certificate with its key; give PEM files "
                             "that belong together",
                             def->certificate, def->key);
}

static int http_callback(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in,
                         size_t length) {
    return vd_server_http(wsi, (int)reason, user, in, length);
}

static int socket_callback(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in,
                           size_t length) {
    return vd_server_socket(wsi, (int)reason, user, in, length);
}

static vd_status open_network(vd_server *server) {
    const vd_server_def *def = &server->def;
    struct lws_protocols *protocols = calloc(3, sizeof *protocols);
    const struct lws_protocols made[3] = {{.name = "http",
                                           .callback = http_callback,
                                           .per_session_data_size = vd_server_http_bytes()},
                                          {.name = VD_SERVER_PROTOCOL,
                                           .callback = socket_callback,
                                           .per_session_data_size = vd_server_socket_bytes(),
                                           .rx_buffer_size = 65536},
                                          {.name = NULL}};
    server->protocols = protocols; /* they have to stay */
    if (protocols == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "not enough memory for a server; free some");
    }
    memcpy(protocols, made, sizeof made);
    const char *address = address_of(def);
    const bool any = strcmp(address, "0.0.0.0") == 0 || strcmp(address, "::") == 0;
    struct lws_context_creation_info info = {
        .port = def->port,
        .iface = any ? NULL : address,
        .protocols = protocols,
        .user = server,
        .gid = (gid_t)-1,
        .uid = (uid_t)-1,
        .alpn = "http/1.1", /* else Chromium takes HTTP/2, and sockets close at once */
        .timeout_secs = 5,
        .keepalive_timeout = 5,
        .max_http_header_data = 4096,
        .max_http_header_pool = (unsigned short)(def->max_clients + 32),
        .options = LWS_SERVER_OPTION_EXPLICIT_VHOSTS};
    if (strchr(address, ':') == NULL) {
        info.options |= LWS_SERVER_OPTION_DISABLE_IPV6;
    }
    if (def->certificate != NULL) {
        info.options |= LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT;
        info.ssl_cert_filepath = def->certificate;
        info.ssl_private_key_filepath = def->key;
        info.ssl_options_set = SSL_OP_NO_SSLv3 | SSL_OP_NO_TLSv1 | SSL_OP_NO_TLSv1_1;
    }
    lws_set_log_level(0, NULL);
    server->network = lws_create_context(&info);
    struct lws_vhost *host =
        server->network != NULL ? lws_create_vhost(server->network, &info) : NULL;
    server->port = host != NULL ? lws_get_vhost_listen_port(host) : 0;
    if (server->port <= 0) {
        return vd_failure(VD_ERROR_IO,
                          "cannot listen at %.60s, port %d; give another --port or --bind", address,
                          def->port);
    }
    return vd_success();
}

vd_status vd_server_create(vd_context *context, const vd_server_def *def, vd_server **out) {
    vd_status status = check(def);
    if (status.code == VD_OK) {
        status = try_address(def);
    }
    if (status.code == VD_OK) {
        status = check_certificate(def);
    }
    if (status.code != VD_OK) {
        return status;
    }
    vd_server *server = calloc(1, sizeof *server);
    if (server == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "not enough memory for a server; free some");
    }
    server->context = context;
    server->def = *def;
    pthread_mutex_init(&server->lock, NULL);
    pthread_cond_init(&server->work, NULL);
    atomic_init(&server->stopping, false);
    status = vd_session_tools_init(context, &server->tools);
    if (status.code == VD_OK) {
        status = vd_server_read_files(server);
    }
    if (status.code == VD_OK) {
        status = open_network(server);
    }
    if (status.code == VD_OK) {
        status = vd_server_record(server);
    }
    if (status.code != VD_OK) {
        vd_server_destroy(&server);
        return status;
    }
    *out = server;
    return status;
}

void vd_server_destroy(vd_server **out) {
    vd_server *server = *out;
    if (server == NULL) {
        return;
    }
    if (server->network != NULL) {
        lws_context_destroy(server->network);
    }
    vd_server_free_peers(server);
    vd_server_end_recording(server, NULL);
    free(server->recording.name);
    vd_server_forget_files(server);
    free(server->protocols);
    vd_session_tools_finish(&server->tools);
    pthread_cond_destroy(&server->work);
    pthread_mutex_destroy(&server->lock);
    free(server);
    *out = NULL;
}

int vd_server_port(const vd_server *server) {
    return server->port;
}

bool vd_server_has_page(const vd_server *server) {
    return server->has_page;
}

/* ---- running ----------------------------------------------------------------------------------*/

void vd_server_stop(vd_server *server) {
    atomic_store(&server->stopping, true);
    if (server->network != NULL) {
        lws_cancel_service(server->network);
    }
}

/* Whether everybody has been told, or is gone. */
static bool is_quiet(vd_server *server) {
    pthread_mutex_lock(&server->lock);
    bool quiet = server->rendered;
    for (const vd_peer *peer = server->peers; peer != NULL; peer = peer->next) {
        quiet = quiet && peer->gone;
    }
    pthread_mutex_unlock(&server->lock);
    return quiet;
}

vd_status vd_server_listen(vd_server *server) {
    double stopped_s = 0.0;
    for (;;) {
        const double now_s = vd_server_now_s();
        if (atomic_load(&server->stopping)) {
            if (stopped_s == 0.0) {
                stopped_s = now_s;
                pthread_mutex_lock(&server->lock);
                pthread_cond_signal(&server->work);
                pthread_mutex_unlock(&server->lock);
            }
            if (now_s - stopped_s > GOODBYE_S || is_quiet(server)) {
                return vd_success();
            }
            lws_cancel_service(server->network); /* come back soon */
        }
        if (lws_service(server->network, 0) < 0) {
            atomic_store(&server->stopping, true);
            return vd_failure(VD_ERROR_IO, "the network gave up; start the server again");
        }
    }
}

#else

#define WITHOUT                                                                                    \
    vd_failure(VD_ERROR_UNSUPPORTED,                                                               \
               "this veduta-remote was built without libwebsockets and serves nothing; install "   \
               "libwebsockets-dev and build again")

vd_status vd_server_create(vd_context *context, const vd_server_def *def, vd_server **out) {
    (void)context, (void)def, (void)out;
    return WITHOUT;
}

void vd_server_destroy(vd_server **out) {
    *out = NULL;
}

int vd_server_port(const vd_server *server) {
    (void)server;
    return 0;
}

bool vd_server_has_page(const vd_server *server) {
    (void)server;
    return false;
}

vd_status vd_server_listen(vd_server *server) {
    (void)server;
    return WITHOUT;
}

vd_status vd_server_render(vd_server *server, vd_job *job) {
    (void)server, (void)job;
    return WITHOUT;
}

void vd_server_stop(vd_server *server) {
    (void)server;
}

#endif
