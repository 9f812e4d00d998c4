/* remote_module.h: veduta-remote, opened when something is packed or served.
 *
 * Pictures in files need no wire, and a build may lack protobuf-c and the codecs' libraries. So a
 * shared build opens the library when it is first needed; a static one has it linked in; one
 * without says so.
 */
#ifndef VEDUTA_APP_REMOTE_MODULE_H
#define VEDUTA_APP_REMOTE_MODULE_H

#include <veduta/client.h>
#include <veduta/server.h>
#include <veduta/wire.h>

typedef struct vd_remote_module {
    const char *(*codec_name)(vd_codec codec);
    size_t (*codec_bound)(vd_codec codec, int width, int height);
    vd_status (*coder_create)(vd_context *context, vd_coder **out);
    void (*coder_destroy)(vd_coder **coder);
    vd_status (*encode)(vd_coder *coder, const vd_encode_def *def, const vd_codec_picture *picture,
                        uint8_t *out, size_t room, vd_encoded *encoded);
    vd_status (*decode)(vd_coder *coder, vd_codec codec, const void *data, size_t bytes, int width,
                        int height, uint8_t *rgba, size_t stride);
    vd_status (*wire_create)(vd_context *context, vd_wire **out);
    void (*wire_destroy)(vd_wire **wire);
    vd_status (*wire_decode)(vd_wire *wire, vd_wire_side from, const void *data, size_t bytes,
                             vd_wire_envelope *out);
    const char *(*wire_kind_name)(vd_wire_kind kind);
    vd_server_def (*server_def_default)(void);
    vd_status (*server_create)(vd_context *context, const vd_server_def *def, vd_server **out);
    void (*server_destroy)(vd_server **server);
    int (*server_port)(const vd_server *server);
    bool (*server_has_page)(const vd_server *server);
    vd_status (*server_listen)(vd_server *server);
    vd_status (*server_render)(vd_server *server, vd_job *job);
    void (*server_stop)(vd_server *server);
    vd_client_def (*client_def_default)(void);
    const char *(*client_state_name)(vd_client_state state);
    vd_status (*client_create)(vd_context *context, const vd_client_def *def, vd_client **out);
    void (*client_destroy)(vd_client **client);
    void (*client_look)(vd_client *client, const vd_camera *camera, int width, int height);
    vd_status (*client_set)(vd_client *client, const vd_wire_settings *settings);
    void (*client_cut)(vd_client *client);
    vd_status (*client_draw)(vd_client *client, vd_job *job, const vd_camera *camera,
                             vd_frame *frame, vd_client_shown *shown);
    void (*client_get_news)(vd_client *client, vd_client_news *out);
    bool (*client_get_world)(vd_client *client, char *out, size_t room);
    double (*client_ground)(vd_client *client, double x, double y);
} vd_remote_module;

/* Opens veduta-remote. `purpose` says what it is needed for, such as "measure codecs". Returns
 * VD_ERROR_UNSUPPORTED when it is not there. The library stays loaded until the program ends. */
VD_MUST_USE vd_status vd_remote_module_open(const char *purpose, vd_remote_module *out);

#endif
