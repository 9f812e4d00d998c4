/* wire.h: what a server and its clients say to each other, as bytes.
 *
 * Part of the library veduta-remote. src/remote/veduta.proto has the messages and every bound,
 * docs/wire.md who says what and when. Here they are structs: encoding checks them and makes an
 * envelope, decoding takes an envelope apart and checks it. There is no socket, clock or state of a
 * connection in it.
 *
 *     vd_wire_message ping = {.kind = VD_WIRE_PING, .as.ping = {stamp}};
 *     status = vd_wire_encode(wire, VD_WIRE_CLIENT, 0, &ping, 1, &buffer);
 *     send(socket, buffer.data, buffer.bytes);
 *
 *     status = vd_wire_decode(wire, VD_WIRE_SERVER, received, bytes, &envelope);
 *     for (int i = 0; i < envelope.count; i++) { use(&envelope.messages[i]); }
 *
 * Whatever the bytes, decoding ends with a status, in time and memory in proportion to them. What
 * it accepts is within the bounds: finite numbers, counts and sizes, a codec that there is. Not
 * checked are what only the receiver knows (whether an id is held, a sequence goes on) and what is
 * inside a picture or a block (vd_coder_decode, vd_model_unpack …).
 */
#ifndef VEDUTA_WIRE_H
#define VEDUTA_WIRE_H

#include <veduta/camera.h>
#include <veduta/codec.h>
#include <veduta/placed.h>

VD_BEGIN_DECLARATIONS

/* Of the messages. Raised when a side that does not know the new ones can no longer be served. */
#define VD_WIRE_VERSION 1

#define VD_WIRE_ENVELOPE_BYTES ((size_t)16 << 20)
#define VD_WIRE_BATCH_BYTES ((size_t)100 << 10) /* of several messages together */
#define VD_WIRE_HEAD_BYTES 6                    /* most of an envelope beside its messages */
#define VD_WIRE_MAX_MESSAGES 1024               /* in an envelope */
#define VD_WIRE_MAX_IDS 65536                   /* held, in order, dropped */
#define VD_WIRE_MAX_REPLACED 4096               /* of each, out and in */
#define VD_WIRE_PICTURE_BYTES ((size_t)8 << 20) /* of an impostor, of a block */
#define VD_WIRE_SCREEN_BYTES ((size_t)15 << 20)
#define VD_WIRE_IMPOSTOR_PIXELS ((size_t)1 << 24)
#define VD_WIRE_TOKEN_BYTES 256
#define VD_WIRE_INSTANCE_BYTES ((size_t)256) /* that one counts among what a client holds */
#define VD_WIRE_LEAST_MEMORY ((uint64_t)1 << 20)
#define VD_WIRE_MOST_MEMORY ((uint64_t)1 << 40)

typedef enum vd_wire_side { VD_WIRE_CLIENT = 0, VD_WIRE_SERVER, VD_WIRE_SIDE_COUNT } vd_wire_side;

/* Numbered as in the file of messages. */
typedef enum vd_wire_kind {
    VD_WIRE_NONE = 0, /* not a message of this version: to be skipped */
    VD_WIRE_HELLO,
    VD_WIRE_CAMERA,
    VD_WIRE_IMPOSTOR,
    VD_WIRE_ORDER,
    VD_WIRE_GEOMETRY,
    VD_WIRE_REPLACE,
    VD_WIRE_DROP,
    VD_WIRE_SCREEN,
    VD_WIRE_ACKNOWLEDGE,
    VD_WIRE_STATS,
    VD_WIRE_ERROR,
    VD_WIRE_PING,
    VD_WIRE_PONG,
    VD_WIRE_BYE,
    VD_WIRE_SETTINGS,
    VD_WIRE_INSTANCE,
    VD_WIRE_LIGHT,
    VD_WIRE_GROUND,
    VD_WIRE_KIND_COUNT
} vd_wire_kind;

/* Returns "hello", "camera" …; "none" for VD_WIRE_NONE, null outside. */
VD_API const char *vd_wire_kind_name(vd_wire_kind kind);

/* Whether a side may say this. */
VD_API bool vd_wire_may_send(vd_wire_side side, vd_wire_kind kind);

/* ---- the messages -----------------------------------------------------------------------------
 * Every pointer is borrowed: of what is encoded, the caller's; of what was decoded, the vd_wire's.
 * Strings are UTF-8; null counts as empty. Bounds: veduta.proto. */

typedef struct vd_wire_ids {
    const uint64_t *ids; /* [count] */
    int count;
} vd_wire_ids;

typedef struct vd_wire_bytes {
    const uint8_t *data;
    size_t bytes;
} vd_wire_bytes;

/* Capabilities: VD_CODEC_BIT of the codecs, and: */
#define VD_WIRE_MODELS (1u << 8)
#define VD_WIRE_BRICKS (1u << 9)
#define VD_WIRE_SCREENS (1u << 10)
#define VD_WIRE_HEIGHTS (1u << 11) /* vd_wire_ground */
#define VD_WIRE_FIXED (1u << 12)   /* vd_wire_impostor.fixed */

typedef struct vd_wire_hello {
    unsigned version;
    unsigned capabilities; /* unknown bits are kept */
    const char *token;     /* client */
    uint64_t memory_bytes; /* client; the server says 0 */
    int width, height;     /* client: its screen; the server says 0 */
    const char *name;
    vd_wire_ids held;              /* client: ascending */
    const uint32_t *held_versions; /* [held.count] */
    uint32_t particles; /* client: of bricks, that it draws for a frame; the server says 0 */
} vd_wire_hello;

typedef struct vd_wire_camera {
    uint32_t sequence; /* from 1 */
    vd_camera camera;  /* perspective, every number to the bit; far_m is not sent: 0 */
    int width, height;
    double time_s; /* of the client's clock */
} vd_wire_camera;

typedef struct vd_wire_impostor {
    uint64_t id;
    uint32_t version; /* from 1 */
    vd_vec3 origin;
    float corners[4][3]; /* relative to origin: top left, top right, bottom right, bottom left */
    float nearer;        /* as vd_quad's, at least 1 */
    int width, height;
    int opaque[4]; /* as vd_quad_picture's: left, top, right, bottom, or zeros */
    vd_codec codec;
    vd_wire_bytes picture;
    bool fixed; /* to the screen: in camera space, of a lens { height, height, width / 2,
                   height / 2 } for a frame of width × height */
} vd_wire_impostor;

typedef struct vd_wire_order {
    uint32_t camera; /* sequence that it was sorted for; 0: none */
    vd_wire_ids ids; /* farthest first; an id that comes twice is drawn twice */
} vd_wire_order;

typedef enum vd_wire_geometry_kind {
    VD_WIRE_MODEL = 1,
    VD_WIRE_BRICK,
    VD_WIRE_GEOMETRY_KIND_COUNT
} vd_wire_geometry_kind;

typedef struct vd_wire_geometry {
    uint64_t id;
    uint32_t version;
    vd_wire_geometry_kind kind;
    vd_vec3 origin;
    vd_wire_bytes block; /* VD_WIRE_MODEL: vd_model_pack's; VD_WIRE_BRICK: brick_block.h */
} vd_wire_geometry;

/* A model that the client draws, placed. */
typedef struct vd_wire_instance {
    uint64_t id;
    uint32_t version;
    uint64_t model; /* id of a vd_wire_geometry */
    vd_place place;
} vd_wire_instance;

/* What instances are lit by. */
typedef struct vd_wire_light {
    vd_light light; /* zenith and nadir are not sent: 0 */
} vd_wire_light;

#define VD_WIRE_GROUND_SIDE 129
#define VD_WIRE_NO_GROUND (-1e9f)

/* Heights of the ground around a place, between which it is linear. */
typedef struct vd_wire_ground {
    double x, y;          /* of the first height, in the south-west */
    double step_m;        /* to the next, eastward and northward */
    int columns, rows;    /* 2 … VD_WIRE_GROUND_SIDE */
    const float *heights; /* [rows][columns], the southernmost row first; VD_WIRE_NO_GROUND: none */
} vd_wire_ground;

typedef struct vd_wire_replace {
    vd_wire_ids out, in; /* each ascending, nothing in both */
} vd_wire_replace;

typedef struct vd_wire_screen {
    uint32_t camera; /* sequence of what it shows */
    vd_codec codec;
    bool exact;
    int width, height;
    vd_wire_bytes picture;
} vd_wire_screen;

typedef struct vd_wire_acknowledge {
    uint32_t batch;
    uint64_t held_bytes;
} vd_wire_acknowledge;

typedef struct vd_wire_stats {
    double frames_per_s, frame_p99_s, decode_s, error_px, link_bytes_per_s, latency_s;
    uint64_t queued_bytes, shown, clients;
} vd_wire_stats;

typedef enum vd_wire_fault {
    VD_WIRE_FAULT_MALFORMED = 1,
    VD_WIRE_FAULT_VERSION,
    VD_WIRE_FAULT_TOKEN,
    VD_WIRE_FAULT_FULL,        /* no more clients are taken */
    VD_WIRE_FAULT_OUT_OF_TURN, /* a message that may not come now */
    VD_WIRE_FAULT_TOO_MUCH,    /* more than agreed on: a flood, memory */
    VD_WIRE_FAULT_SLOW,        /* nothing came, or nothing was taken, for too long */
    VD_WIRE_FAULT_INTERNAL,
    VD_WIRE_FAULT_COUNT
} vd_wire_fault;

typedef struct vd_wire_error {
    vd_wire_fault code; /* unknown ones become VD_WIRE_FAULT_INTERNAL */
    const char *sentence;
} vd_wire_error;

typedef struct vd_wire_ping {
    uint64_t stamp;
} vd_wire_ping;

typedef enum vd_wire_reason {
    VD_WIRE_DONE = 1,
    VD_WIRE_STOPPING,
    VD_WIRE_IDLE,
    VD_WIRE_REASON_COUNT
} vd_wire_reason;

typedef struct vd_wire_bye {
    vd_wire_reason reason; /* unknown ones become VD_WIRE_DONE */
    const char *sentence;
} vd_wire_bye;

typedef enum vd_wire_mode {
    VD_WIRE_MODE_IMPOSTORS = 1,
    VD_WIRE_MODE_SCREENS,
    VD_WIRE_MODE_COUNT
} vd_wire_mode;

typedef struct vd_wire_settings {
    vd_wire_mode mode;
    float tolerance_px;
    int quality;     /* 0: as the server likes */
    unsigned codecs; /* VD_CODEC_BIT; 0: all of its capabilities */
    double bytes_per_s;
} vd_wire_settings;

typedef struct vd_wire_message {
    vd_wire_kind kind;
    union {
        vd_wire_hello hello;
        vd_wire_camera camera;
        vd_wire_impostor impostor;
        vd_wire_order order;
        vd_wire_geometry geometry;
        vd_wire_replace replace;
        vd_wire_ids drop;
        vd_wire_screen screen;
        vd_wire_acknowledge acknowledge;
        vd_wire_stats stats;
        vd_wire_error error;
        vd_wire_ping ping, pong;
        vd_wire_bye bye;
        vd_wire_settings settings;
        vd_wire_instance instance;
        vd_wire_light light;
        vd_wire_ground ground;
    } as;
} vd_wire_message;

/* Checks a message that `side` is to send or has sent against every bound. Returns
 * VD_ERROR_ARGUMENT with a sentence that names the message and the field. */
VD_API VD_MUST_USE vd_status vd_wire_check(vd_wire_side side, const vd_wire_message *message);

/* ---- envelopes --------------------------------------------------------------------------------*/

/* Bytes of the caller's that grow. All zero to begin with; vd_wire_buffer_release ends it. */
typedef struct vd_wire_buffer {
    uint8_t *data;     /* the envelope; before it lie head_bytes of the caller's */
    size_t bytes;      /* of the envelope */
    size_t head_bytes; /* kept free before it for a transport's own head; set before the first use,
                          at most 4096 */
    uint8_t *memory;   /* the wire's business from here on */
    size_t memory_bytes;
} vd_wire_buffer;

VD_API void vd_wire_buffer_release(vd_context *context, vd_wire_buffer *buffer);

typedef struct vd_wire_envelope {
    uint32_t batch; /* 0: needs no acknowledgement */
    int count;
    const vd_wire_message *messages; /* [count]; kinds of newer versions are VD_WIRE_NONE */
} vd_wire_envelope;

/* Memory for encoding and decoding, kept from one to the next. One call at a time. */
typedef struct vd_wire vd_wire;

/* Returns VD_ERROR_MEMORY. *out is owned by the caller. */
VD_API VD_MUST_USE vd_status vd_wire_create(vd_context *context, vd_wire **out);
VD_API void vd_wire_destroy(vd_wire **wire);

/* Returns the bytes that a message takes in an envelope: to fill batches with, whose messages may
 * take VD_WIRE_BATCH_BYTES - VD_WIRE_HEAD_BYTES. The message must be one that vd_wire_check takes.
 */
VD_API size_t vd_wire_message_bytes(const vd_wire_message *message);

/* Makes an envelope of `count` messages from `from`. Large arrays are copied once, into the buffer.
 * What was decoded before stays valid. Returns VD_ERROR_ARGUMENT (a message breaks a bound, or
 * `from` may not send it; no messages, or too many), VD_ERROR_LIMIT (several messages are more than
 * VD_WIRE_BATCH_BYTES, or one more than VD_WIRE_ENVELOPE_BYTES: send them apart) or
 * VD_ERROR_MEMORY; buffer->bytes is then 0. */
VD_API VD_MUST_USE vd_status vd_wire_encode(vd_wire *wire, vd_wire_side from, uint32_t batch,
                                            const vd_wire_message *messages, int count,
                                            vd_wire_buffer *buffer);

/* Takes an envelope from `from` apart. *out and all it points to is the wire's, until the next
 * decoding; nothing points into data. Takes at most 2 MiB more memory than the bytes.
 * Returns VD_ERROR_FORMAT (not an envelope, damaged, out of bounds, not for `from` to say; names
 * the message and the field), VD_ERROR_LIMIT (more than VD_WIRE_ENVELOPE_BYTES, or than several
 * messages may have) or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_wire_decode(vd_wire *wire, vd_wire_side from, const void *data,
                                            size_t bytes, vd_wire_envelope *out);

VD_END_DECLARATIONS

#endif
