/* replay.c: `veduta replay`: plays a recorded exchange (docs/wire.md), envelope by envelope. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "commands.h"
#include "options.h"
#include "remote_module.h"
#include "run.h"

enum { REPLAY_SPEED, REPLAY_HELP, REPLAY_COUNT };

static const vd_option table[REPLAY_COUNT] = {
    [REPLAY_SPEED] = {.key = "speed",
                      .group = "Options",
                      .type = VD_OPTION_REAL,
                      .argument = "F",
                      .max = 1000,
                      .fallback = "0",
                      .help = "times as fast as it was recorded; 0: without pauses"},
    [REPLAY_HELP] = {.key = "help",
                     .group = "Options",
                     .type = VD_OPTION_SWITCH,
                     .letter = 'h',
                     .help = "this page"},
};

typedef struct replaying {
    const char *path;
    FILE *file;
    vd_context *context;
    vd_remote_module remote;
    vd_wire *wire;
    vd_coder *coder;
    uint8_t *data; /* an envelope */
    uint8_t *rgba;
    size_t rgba_bytes;
    double speed;
    int envelopes, messages, pictures, spoilt;
} replaying;

static uint32_t read_u32(const uint8_t *p) {
    return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

static vd_status damaged(const replaying *r, const char *why) {
    return vd_failure(VD_ERROR_FORMAT, "%.160s: envelope %d %.160s; record it again", r->path,
                      r->envelopes + 1, why);
}

/* Unpacks a picture; what is no picture is said and counted. */
static vd_status unpack(replaying *r, vd_codec codec, const vd_wire_bytes *picture, int width,
                        int height) {
    const size_t bytes = 4 * (size_t)width * (size_t)height;
    if (bytes > r->rgba_bytes) {
        free(r->rgba);
        r->rgba = malloc(bytes);
        r->rgba_bytes = r->rgba != NULL ? bytes : 0;
    }
    if (r->rgba == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "not enough memory for a picture of %d x %d pixels",
                          width, height);
    }
    r->pictures++;
    const vd_status status = r->remote.decode(r->coder, codec, picture->data, picture->bytes, width,
                                              height, r->rgba, (size_t)width);
    if (status.code != VD_OK && status.code != VD_ERROR_MEMORY) {
        printf("    %s\n", status.message);
        r->spoilt++;
        return vd_success();
    }
    return status;
}

static vd_status show(replaying *r, const vd_wire_message *m) {
    printf("  %s", r->remote.wire_kind_name(m->kind));
    switch (m->kind) {
    case VD_WIRE_HELLO:
        printf(" version %u, capabilities 0x%x, \"%s\", %d held", m->as.hello.version,
               m->as.hello.capabilities, m->as.hello.name, m->as.hello.held.count);
        break;
    case VD_WIRE_CAMERA:
        printf(" %u at %.3f, %.3f, %.3f, %d x %d", m->as.camera.sequence, m->as.camera.camera.eye.x,
               m->as.camera.camera.eye.y, m->as.camera.camera.eye.z, m->as.camera.width,
               m->as.camera.height);
        break;
    case VD_WIRE_IMPOSTOR:
        printf(" %016llx version %u, %d x %d, %s, %zu bytes\n",
               (unsigned long long)m->as.impostor.id, m->as.impostor.version, m->as.impostor.width,
               m->as.impostor.height, r->remote.codec_name(m->as.impostor.codec),
               m->as.impostor.picture.bytes);
        return unpack(r, m->as.impostor.codec, &m->as.impostor.picture, m->as.impostor.width,
                      m->as.impostor.height);
    case VD_WIRE_SCREEN:
        printf(" for camera %u, %d x %d, %s%s, %zu bytes\n", m->as.screen.camera,
               m->as.screen.width, m->as.screen.height, r->remote.codec_name(m->as.screen.codec),
               m->as.screen.exact ? ", exact" : "", m->as.screen.picture.bytes);
        return unpack(r, m->as.screen.codec, &m->as.screen.picture, m->as.screen.width,
                      m->as.screen.height);
    case VD_WIRE_ORDER:
        printf(" for camera %u of %d", m->as.order.camera, m->as.order.ids.count);
        break;
    case VD_WIRE_GEOMETRY:
        printf(" %016llx version %u, %zu bytes", (unsigned long long)m->as.geometry.id,
               m->as.geometry.version, m->as.geometry.block.bytes);
        break;
    case VD_WIRE_INSTANCE:
        printf(" %016llx version %u of %016llx", (unsigned long long)m->as.instance.id,
               m->as.instance.version, (unsigned long long)m->as.instance.model);
        break;
    case VD_WIRE_GROUND:
        printf(" %d x %d heights, %.3g m apart, from %.3f, %.3f", m->as.ground.columns,
               m->as.ground.rows, m->as.ground.step_m, m->as.ground.x, m->as.ground.y);
        break;
    case VD_WIRE_REPLACE:
        printf(" %d by %d", m->as.replace.out.count, m->as.replace.in.count);
        break;
    case VD_WIRE_DROP:
        printf(" of %d", m->as.drop.count);
        break;
    case VD_WIRE_ACKNOWLEDGE:
        printf(" %u, %llu bytes held", m->as.acknowledge.batch,
               (unsigned long long)m->as.acknowledge.held_bytes);
        break;
    case VD_WIRE_ERROR:
        printf(" %d: %s", (int)m->as.error.code, m->as.error.sentence);
        break;
    case VD_WIRE_BYE:
        printf(" %d: %s", (int)m->as.bye.reason, m->as.bye.sentence);
        break;
    default:
        break;
    }
    putchar('\n');
    return vd_success();
}

static void wait_until(const replaying *r, double start_s, uint32_t ms) {
    const double left_s = r->speed > 0.0 ? start_s + 1e-3 * ms / r->speed - vd_seconds_now() : 0.0;
    if (left_s > 0.0) {
        const struct timespec pause = {(time_t)left_s,
                                       (long)(1e9 * (left_s - (double)(time_t)left_s))};
        (void)fflush(stdout);
        (void)nanosleep(&pause, NULL);
    }
}

static vd_status play_envelope(replaying *r, const uint8_t head[12], double start_s) {
    const uint32_t side = read_u32(head), ms = read_u32(head + 4), bytes = read_u32(head + 8);
    vd_wire_envelope envelope;
    if (side >= VD_WIRE_SIDE_COUNT || bytes > VD_WIRE_ENVELOPE_BYTES) {
        return damaged(r, "is from neither side, or longer than one can be");
    }
    if (fread(r->data, 1, bytes, r->file) != bytes) {
        return damaged(r, "is cut off");
    }
    vd_status status =
        r->remote.wire_decode(r->wire, (vd_wire_side)side, r->data, bytes, &envelope);
    if (status.code != VD_OK) {
        return damaged(r, status.message);
    }
    wait_until(r, start_s, ms);
    printf("%9.3f s  %s  %u bytes", 1e-3 * ms, side == VD_WIRE_CLIENT ? "client" : "server", bytes);
    if (envelope.batch != 0) {
        printf(", batch %u", envelope.batch);
    }
    putchar('\n');
    for (int i = 0; i < envelope.count && status.code == VD_OK; i++) {
        status = show(r, &envelope.messages[i]);
    }
    r->envelopes++;
    r->messages += envelope.count;
    return status;
}

static vd_status play(replaying *r) {
    uint8_t head[12];
    r->file = fopen(r->path, "rb");
    if (r->file == NULL) {
        return vd_failure(VD_ERROR_IO, "cannot read %.200s: %s; check the name", r->path,
                          strerror(errno));
    }
    if (fread(head, 1, 8, r->file) != 8 || memcmp(head, "VDX", 4) != 0 || read_u32(head + 4) != 1) {
        return vd_failure(VD_ERROR_FORMAT,
                          "%.200s is no recorded exchange, or of another version; docs/wire.md "
                          "tells what one is",
                          r->path);
    }
    const double start_s = vd_seconds_now();
    vd_status status = vd_success();
    for (size_t got = fread(head, 1, 12, r->file); got > 0 && status.code == VD_OK;
         got = fread(head, 1, 12, r->file)) {
        status = got == 12 ? play_envelope(r, head, start_s) : damaged(r, "is cut off");
        if (status.code != VD_OK) {
            return status;
        }
    }
    printf("%d envelopes, %d messages, %d pictures, %d of them do not unpack\n", r->envelopes,
           r->messages, r->pictures, r->spoilt);
    return fflush(stdout) == 0 && !ferror(stdout)
               ? status
               : vd_failure(VD_ERROR_IO, "cannot write to standard output; check the pipe");
}

static vd_status replay(replaying *r) {
    vd_context_def def = vd_context_def_default();
    def.threads = 1;
    vd_status status = vd_remote_module_open("replay", &r->remote);
    if (status.code == VD_OK) {
        status = vd_context_create(&def, &r->context);
    }
    if (status.code == VD_OK) {
        status = r->remote.wire_create(r->context, &r->wire);
    }
    if (status.code == VD_OK) {
        status = r->remote.coder_create(r->context, &r->coder);
    }
    if (status.code == VD_OK) {
        r->data = malloc(VD_WIRE_ENVELOPE_BYTES);
        status = r->data != NULL
                     ? play(r)
                     : vd_failure(VD_ERROR_MEMORY, "not enough memory to replay; free some");
    }
    if (r->file != NULL) {
        (void)fclose(r->file);
    }
    if (r->coder != NULL) {
        r->remote.coder_destroy(&r->coder);
    }
    if (r->wire != NULL) {
        r->remote.wire_destroy(&r->wire);
    }
    vd_context_destroy(&r->context);
    free(r->data);
    free(r->rgba);
    return status;
}

static void print_help(void) {
    fputs("usage: veduta replay [OPTIONS] FILE.vdx\n\n"
          "Plays a recorded exchange between a server and a client: says what either said, and\n"
          "unpacks every picture. Exit status 1 when it is cut off or not an exchange.\n",
          stdout);
    vd_options_print_help(table, REPLAY_COUNT, stdout);
    fputs("\nexamples\n  veduta replay test/wire/exchange.vdx\n"
          "  veduta replay --speed 1 exchange.vdx\n",
          stdout);
}

int vd_command_replay(int argc, char **argv) {
    vd_options options;
    vd_status status = vd_options_init(&options, "replay", table, REPLAY_COUNT);
    if (status.code != VD_OK) {
        return vd_report(&status, 1);
    }
    status = vd_options_parse(&options, argc, argv);
    const bool help = status.code == VD_OK && options.values[REPLAY_HELP].number != 0.0;
    if (status.code == VD_OK && !help && options.input_count != 1) {
        status = vd_failure(VD_ERROR_ARGUMENT,
                            "one recording is replayed, %d given; name one, as in `veduta replay "
                            "exchange.vdx`",
                            options.input_count);
    }
    int code = status.code == VD_OK ? 0 : 2;
    if (help) {
        print_help();
    } else if (status.code == VD_OK) {
        replaying r = {.path = options.inputs[0], .speed = options.values[REPLAY_SPEED].number};
        status = replay(&r);
        code = status.code == VD_OK ? 0 : 1;
    }
    if (status.code != VD_OK) {
        vd_report(&status, code);
    }
    vd_options_finish(&options);
    return code;
}
