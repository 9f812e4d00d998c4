/* server_http.c: the page, /health, /frame.png and /world.json. */
#include "remote/server_internal.h"

#if VEDUTA_HAVE_WEBSOCKETS

#include <libwebsockets.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CHUNK_BYTES 32768
#define SEND_TIMEOUT_S 20
#define SHOT_TIMEOUT_S 60

/* What of a request is left to be answered. */
typedef struct http_user {
    const uint8_t *body;
    size_t bytes, at;
    uint8_t *owned; /* by malloc; null: the body is the server's */
    vd_shot *shot;  /* waits to be drawn */
} http_user;

size_t vd_server_http_bytes(void) {
    return sizeof(http_user);
}

static vd_server *server_of(struct lws *wsi) {
    return lws_context_user(lws_get_context(wsi));
}

static void forget(vd_server *server, http_user *user) {
    if (user->shot != NULL) {
        pthread_mutex_lock(&server->lock);
        const bool done = user->shot->done;
        user->shot->abandoned = true; /* the rendering thread frees it then */
        pthread_mutex_unlock(&server->lock);
        if (done) {
            free(user->shot->png);
            free(user->shot);
        }
    }
    free(user->owned);
    *user = (http_user){.body = NULL};
}

/* ---- answering --------------------------------------------------------------------------------*/

static int add_header(struct lws *wsi, const char *name, const char *value, unsigned char **at,
                      unsigned char *end) {
    return lws_add_http_header_by_name(wsi, (const unsigned char *)name,
                                       (const unsigned char *)value, (int)strlen(value), at, end);
}

/* Nothing from elsewhere, and nothing of this elsewhere. */
static int add_headers(struct lws *wsi, const char *type, unsigned char **at, unsigned char *end) {
    static const char *const headers[][2] = {
        {"content-security-policy:",
         "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; style-src "
         "'self'; img-src 'self' blob: data:; connect-src 'self'; manifest-src 'self'; font-src "
         "'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
        {"x-content-type-options:", "nosniff"},
        {"referrer-policy:", "no-referrer"},
        {"cross-origin-opener-policy:", "same-origin"},
        {"cross-origin-embedder-policy:", "require-corp"},
        {"cross-origin-resource-policy:", "same-origin"},
        {"cache-control:", "no-cache"},
    };
    int failed = add_header(wsi, "content-type:", type, at, end);
    for (size_t i = 0; i < sizeof headers / sizeof headers[0]; i++) {
        failed |= add_header(wsi, headers[i][0], headers[i][1], at, end);
    }
    return failed;
}

/* Begins an answer; the body follows as the client takes it. `owned` is taken over. */
static int answer(struct lws *wsi, http_user *user, unsigned status, const char *type,
                  const uint8_t *body, size_t bytes, uint8_t *owned) {
    unsigned char room[LWS_PRE + 2048], *start = room + LWS_PRE, *at = start;
    unsigned char *end = room + sizeof room - 1;
    user->body = body;
    user->bytes = bytes;
    user->at = 0;
    user->owned = owned;
    int failed = lws_add_http_header_status(wsi, status, &at, end);
    failed |= status == 401 ? add_header(wsi, "www-authenticate:", "Bearer", &at, end) : 0;
    failed |= add_headers(wsi, type, &at, end);
    failed |= lws_add_http_header_content_length(wsi, bytes, &at, end);
    if (failed || lws_finalize_write_http_header(wsi, start, &at, end) != 0) {
        return -1;
    }
    lws_set_timeout(wsi, PENDING_TIMEOUT_HTTP_CONTENT, SEND_TIMEOUT_S);
    (void)lws_callback_on_writable(wsi);
    return 0;
}

/* A sentence. */
static int say(struct lws *wsi, http_user *user, unsigned status, const char *sentence) {
    char *text = malloc(strlen(sentence) + 2);
    if (text == NULL) {
        return -1;
    }
    (void)sprintf(text, "%s\n", sentence);
    return answer(wsi, user, status, "text/plain; charset=utf-8", (const uint8_t *)text,
                  strlen(text), (uint8_t *)text);
}

/* The next piece of the body. */
static int send_piece(struct lws *wsi, http_user *user) {
    unsigned char room[LWS_PRE + CHUNK_BYTES];
    const size_t left = user->bytes - user->at;
    const size_t piece = left < CHUNK_BYTES ? left : CHUNK_BYTES;
    memcpy(room + LWS_PRE, user->body + user->at, piece);
    user->at += piece;
    const bool last = user->at == user->bytes;
    if (lws_write(wsi, room + LWS_PRE, piece, last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) < 0) {
        return -1;
    }
    if (!last) {
        lws_set_timeout(wsi, PENDING_TIMEOUT_HTTP_CONTENT, SEND_TIMEOUT_S);
        (void)lws_callback_on_writable(wsi);
        return 0;
    }
    free(user->owned);
    *user = (http_user){.body = NULL};
    return lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
}

/* ---- what is asked for ------------------------------------------------------------------------*/

static int health(vd_server *server, struct lws *wsi, http_user *user) {
    pthread_mutex_lock(&server->lock);
    const vd_server_counters c = server->counters;
    pthread_mutex_unlock(&server->lock);
    const vd_memory_stats memory = vd_context_memory(server->context);
    char *text = malloc(512);
    if (text == NULL) {
        return -1;
    }
    const int bytes = snprintf(
        text, 512,
        "{\"status\": \"%s\", \"version\": \"%s\", \"clients\": %d, \"max_clients\": %d, "
        "\"connections\": %d, \"accepted\": %llu, \"refused\": %llu, \"batches\": %llu, "
        "\"pictures\": %llu, \"screens\": %llu, \"frames\": %llu, \"bytes_sent\": %llu, "
        "\"picture_bytes\": %zu, \"memory_bytes\": %zu}\n",
        atomic_load(&server->stopping) ? "stopping" : "ok", vd_version(), c.clients,
        server->def.max_clients, server->connections, (unsigned long long)c.accepted,
        (unsigned long long)c.refused, (unsigned long long)c.batches,
        (unsigned long long)c.pictures, (unsigned long long)c.screens, (unsigned long long)c.frames,
        (unsigned long long)c.bytes_sent, c.kept_bytes, memory.bytes_now);
    return answer(wsi, user, 200, "application/json", (const uint8_t *)text, (size_t)bytes,
                  (uint8_t *)text);
}

static bool is_authorized(const vd_server *server, struct lws *wsi) {
    char given[VD_WIRE_TOKEN_BYTES + 16];
    const int length = lws_hdr_copy(wsi, given, sizeof given, WSI_TOKEN_HTTP_AUTHORIZATION);
    const bool bearer = length > 7 && strncmp(given, "Bearer ", 7) == 0;
    return vd_token_matches(server->def.token, bearer ? given + 7 : "");
}

static bool read_size(const char *text, int *width, int *height) {
    char rest = '\0';
    return sscanf(text, "%5dx%5d%c", width, height, &rest) == 2 && *width > 0 && *height > 0 &&
           (size_t)*width * (size_t)*height <= VD_SHOT_PIXELS;
}

/* Copies what stands behind a name in the query; false when that is not there. A value that does
 * not fit becomes one that nobody takes. */
static bool copy_argument(struct lws *wsi, const char *name, char *out, size_t bytes) {
    char text[512];
    const char *value = lws_get_urlarg_by_name(wsi, name, text, sizeof text);
    if (value == NULL) {
        return false;
    }
    (void)snprintf(out, bytes, "%s", strlen(value) < bytes ? value : "?");
    return true;
}

static int ask_for_frame(vd_server *server, struct lws *wsi, http_user *user) {
    char size[24];
    vd_shot *shot = calloc(1, sizeof *shot);
    if (shot == NULL) {
        return -1;
    }
    shot->width = 1280;
    shot->height = 720;
    shot->status = vd_success();
    (void)copy_argument(wsi, "camera=", shot->camera, sizeof shot->camera);
    if (copy_argument(wsi, "size=", size, sizeof size) &&
        !read_size(size, &shot->width, &shot->height)) {
        free(shot);
        return say(wsi, user, 400, "size is WIDTHxHEIGHT, such as 1280x720, up to 2^25 pixels");
    }
    pthread_mutex_lock(&server->lock);
    const bool taken = server->shot_count < VD_SHOTS_MOST && !server->rendered;
    if (taken) {
        vd_shot **end = &server->shots;
        while (*end != NULL) {
            end = &(*end)->next;
        }
        *end = shot;
        server->shot_count++;
        pthread_cond_signal(&server->work);
    }
    pthread_mutex_unlock(&server->lock);
    if (!taken) {
        free(shot);
        return say(wsi, user, 503, "too many pictures wait to be drawn; try again later");
    }
    user->shot = shot;
    lws_set_timeout(wsi, PENDING_TIMEOUT_HTTP_CONTENT, SHOT_TIMEOUT_S);
    return 0;
}

/* Answers with a picture once it is drawn. */
static int answer_frame(vd_server *server, struct lws *wsi, http_user *user) {
    vd_shot *shot = user->shot;
    pthread_mutex_lock(&server->lock);
    const bool done = shot->done;
    pthread_mutex_unlock(&server->lock);
    if (!done) {
        return 0;
    }
    user->shot = NULL;
    const vd_status status = shot->status;
    uint8_t *png = shot->png;
    const size_t bytes = shot->png_bytes;
    free(shot);
    if (status.code != VD_OK) {
        return say(wsi, user, status.code == VD_ERROR_ARGUMENT ? 400 : 500, status.message);
    }
    return answer(wsi, user, 200, "image/png", png, bytes, png);
}

static int request(vd_server *server, struct lws *wsi, http_user *user, const char *path) {
    forget(server, user);
    if (lws_hdr_total_length(wsi, WSI_TOKEN_GET_URI) <= 0) {
        return say(wsi, user, 405, "only GET is understood");
    }
    if (strcmp(path, "/health") == 0) {
        return health(server, wsi, user);
    }
    const bool world = strcmp(path, "/world.json") == 0;
    if (world || strcmp(path, "/frame.png") == 0) {
        if (!is_authorized(server, wsi)) {
            return say(wsi, user, 401,
                       "the token is missing or wrong; send it as Authorization: Bearer TOKEN");
        }
        const char *json = server->def.world_json != NULL ? server->def.world_json : "{}";
        return world ? answer(wsi, user, 200, "application/json", (const uint8_t *)json,
                              strlen(json), NULL)
               : server->def.camera != NULL ? ask_for_frame(server, wsi, user)
                                            : say(wsi, user, 404, "there is no such page");
    }
    const vd_server_file *file = vd_server_find_file(server, path);
    return file != NULL ? answer(wsi, user, 200, file->type, file->data, file->bytes, NULL)
                        : say(wsi, user, 404, "there is no such page");
}

int vd_server_http(struct lws *wsi, int reason, void *user, void *in, size_t length) {
    vd_server *server = server_of(wsi);
    http_user *mine = user;
    (void)length;
    switch (reason) {
    case LWS_CALLBACK_FILTER_NETWORK_CONNECTION:
        return server->connections > 4 * server->def.max_clients + 64;
    case LWS_CALLBACK_WSI_CREATE:
        server->connections++;
        return 0;
    case LWS_CALLBACK_WSI_DESTROY:
        server->connections--;
        return 0;
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION: /* a WebSocket that does not name ours */
    case LWS_CALLBACK_ESTABLISHED:
        return -1;
    case LWS_CALLBACK_HTTP:
        return request(server, wsi, mine, in);
    case LWS_CALLBACK_HTTP_WRITEABLE:
        if (mine == NULL) {
            return 0;
        }
        if (mine->shot != NULL) {
            return answer_frame(server, wsi, mine);
        }
        return mine->body != NULL ? send_piece(wsi, mine) : 0;
    case LWS_CALLBACK_CLOSED_HTTP:
    case LWS_CALLBACK_HTTP_DROP_PROTOCOL:
        if (mine != NULL) {
            forget(server, mine);
        }
        return 0;
    case LWS_CALLBACK_EVENT_WAIT_CANCELLED:
        vd_server_wake_peers(server);
        (void)lws_callback_on_writable_all_protocol(lws_get_context(wsi), server->protocols);
        return 0;
    default:
        return 0;
    }
}

#endif
