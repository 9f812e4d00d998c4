/* serve.c: `veduta serve`: a world for browsers. */
#include <errno.h>
#include <libgen.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <unistd.h>

#include "commands.h"
#include "remote_module.h"
#include "serve_settings.h"
#include "serve_world.h"

typedef struct serving {
    const vd_serve_settings *settings;
    vd_render_run run;
    vd_remote_module remote;
    vd_serve_world world;
    vd_world_renderer *renderer;
    vd_server *server;
    char token[2 * 16 + 1];
    char root[1024];
    char *json;
    vd_status rendered;
} serving;

static vd_status make_token(serving *v) {
    uint8_t bytes[16];
    if (getrandom(bytes, sizeof bytes, 0) != (ssize_t)sizeof bytes) {
        return vd_failure(VD_ERROR_IO, "there is no random token: %s; give one by --token",
                          strerror(errno));
    }
    for (int i = 0; i < 16; i++) {
        (void)snprintf(v->token + 2 * i, 3, "%02x", bytes[i]);
    }
    return vd_success();
}

/* The page of this installation, or of the source tree that was built in. */
static const char *find_root(serving *v) {
    static const char *const places[] = {"../share/veduta/web", "../../web/dist", "../web/dist"};
    char self[512];
    const ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
    if (v->settings->root != NULL || length < 0) {
        return v->settings->root;
    }
    self[length] = '\0';
    const char *folder = dirname(self);
    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++) {
        (void)snprintf(v->root, sizeof v->root, "%s/%s/index.html", folder, places[i]);
        if (access(v->root, R_OK) == 0) {
            *strrchr(v->root, '/') = '\0';
            return v->root;
        }
    }
    return NULL;
}

static vd_status load(serving *v) {
    vd_status status = vd_world_scene_load(&v->run, &v->world.scene);
    if (status.code == VD_OK) {
        status = vd_world_scene_camera(v->world.scene, &v->run, &v->world.view);
    }
    if (status.code == VD_OK && v->world.view.camera.projection != VD_PROJECTION_PERSPECTIVE) {
        status =
            vd_failure(VD_ERROR_ARGUMENT, "a server shows worlds in perspective; leave the world's "
                                          "\"projection\" out");
    }
    if (status.code == VD_OK) {
        status = vd_world_scene_renderer(v->world.scene, v->run.job, &v->renderer);
    }
    if (status.code == VD_OK) {
        v->json = vd_serve_world_json(&v->world);
        status = v->json != NULL ? status
                                 : vd_failure(VD_ERROR_MEMORY, "out of memory while describing the "
                                                               "world");
    }
    return status;
}

static vd_status open_server(serving *v) {
    const vd_serve_settings *s = v->settings;
    vd_server_def def = v->remote.server_def_default();
    def.world = v->world.scene->world;
    def.renderer = v->renderer;
    def.name = v->world.name;
    def.address = s->address;
    def.port = s->port;
    def.certificate = s->certificate;
    def.key = s->key;
    def.token = s->token != NULL ? s->token : v->token;
    def.root = find_root(v);
    def.world_json = v->json;
    def.camera = vd_serve_camera;
    def.camera_user = &v->world;
    def.record = s->record;
    def.max_clients = s->max_clients;
    def.bytes_per_s = s->bytes_per_s;
    def.memory_bytes = (size_t)s->memory_bytes;
    if (s->root != NULL && access(s->root, R_OK | X_OK) != 0) {
        return vd_failure(VD_ERROR_IO,
                          "cannot read the page's folder %.200s: %s; name the one "
                          "with its index.html",
                          s->root, strerror(errno));
    }
    return v->remote.server_create(v->run.context, &def, &v->server);
}

/* Whoever can reach the machine can reach what listens at other addresses. */
static bool is_loopback(const char *address) {
    return strncmp(address, "127.", 4) == 0 || strcmp(address, "::1") == 0;
}

static vd_status announce(serving *v) {
    const vd_serve_settings *s = v->settings;
    char host[256] = "";
    const bool any = strcmp(s->address, "0.0.0.0") == 0 || strcmp(s->address, "::") == 0;
    if (any && gethostname(host, sizeof host - 1) != 0) {
        strcpy(host, "localhost");
    }
    const char *name = any ? host : s->address;
    const bool brackets = strchr(name, ':') != NULL;
    if (!is_loopback(s->address)) {
        vd_log(v->run.context, VD_LOG_WARNING,
               "everybody who can reach %s and knows the token sees this world%s", s->address,
               s->certificate == NULL ? "; the token goes unencrypted, give --tls" : "");
    }
    if (!v->remote.server_has_page(v->server)) {
        vd_log(v->run.context, VD_LOG_WARNING,
               "there is no page; build web/, or name the folder of one by --root");
    }
    printf("http%s://%s%s%s:%d/#token=%s\n", s->certificate != NULL ? "s" : "", brackets ? "[" : "",
           name, brackets ? "]" : "", v->remote.server_port(v->server),
           s->token != NULL ? s->token : v->token);
    return fflush(stdout) == 0
               ? vd_success()
               : vd_failure(VD_ERROR_IO, "cannot write to standard output; check the pipe");
}

static void *render(void *user) {
    serving *v = user;
    v->rendered = v->remote.server_render(v->server, v->run.job);
    return NULL;
}

/* Until a signal cancels the job. */
static vd_status run_server(serving *v) {
    pthread_t thread;
    v->rendered = vd_success();
    if (pthread_create(&thread, NULL, render, v) != 0) {
        return vd_failure(VD_ERROR_MEMORY, "no thread can be started; free some memory");
    }
    vd_status status = v->remote.server_listen(v->server);
    v->remote.server_stop(v->server);
    pthread_join(thread, NULL);
    return status.code == VD_OK ? v->rendered : status;
}

static vd_status serve(serving *v) {
    vd_status status = vd_remote_module_open("serve", &v->remote);
    if (status.code == VD_OK && v->settings->token == NULL) {
        status = make_token(v);
    }
    if (status.code == VD_OK) {
        status = load(v);
    }
    if (status.code == VD_OK) {
        status = open_server(v);
        v->run.bad_use = status.code == VD_ERROR_ARGUMENT;
    }
    if (status.code == VD_OK) {
        status = announce(v);
    }
    return status.code == VD_OK ? run_server(v) : status;
}

static int run_serve(const vd_render_settings *render_settings, const vd_serve_settings *settings,
                     const vd_world_content *content, const char *note) {
    serving v = {.settings = settings};
    const char *file = content->name != NULL              ? content->name
                       : render_settings->input_count > 0 ? render_settings->inputs[0]
                                                          : "";
    const char *slash = strrchr(file, '/');
    v.run = (vd_render_run){.settings = render_settings, .content = content};
    v.world.settings = render_settings;
    v.world.name = slash != NULL ? slash + 1 : file;
    vd_status status = vd_render_run_begin(&v.run, note);
    if (status.code == VD_OK) {
        status = serve(&v);
        if (status.code == VD_ERROR_CANCELLED) { /* before anything was served */
            status = vd_failure(VD_ERROR_CANCELLED, "interrupted; nothing was served");
        }
    }
    if (v.server != NULL) {
        v.remote.server_destroy(&v.server);
    }
    vd_world_renderer_destroy(&v.renderer);
    vd_world_scene_destroy(&v.world.scene);
    free(v.json);
    return vd_render_run_end(&v.run, &status);
}

int vd_command_serve(int argc, char **argv) {
    vd_option table[SERVE_COUNT];
    vd_options options;
    vd_render_settings settings;
    vd_serve_settings own;
    vd_world_content content = {.name = NULL};
    bool help = false;
    vd_serve_make_table(table);
    vd_status status = vd_options_init(&options, "serve", table, SERVE_COUNT);
    if (status.code != VD_OK) {
        return vd_report(&status, 1);
    }
    status = vd_render_read_options(argc, argv, &options, &settings, &content, &help);
    if (status.code == VD_OK && !help) {
        status = vd_serve_settings_read(&options, &settings, &own);
    }
    int code = status.code == VD_ERROR_ARGUMENT ? 2 : 1;
    vd_catch_signals();
    if (help) {
        vd_serve_print_help(table);
        code = 0;
    } else if (status.code != VD_OK) {
        vd_report(&status, code);
    } else {
        code = run_serve(&settings, &own, &content, options.note);
    }
    vd_world_content_finish(&content);
    vd_options_finish(&options);
    return code;
}
