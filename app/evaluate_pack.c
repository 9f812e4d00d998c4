/* evaluate_pack.c: what goes over the simulated link, as small as a server would make it. */
#include <stdlib.h>

#include "evaluate.h"
#include "run.h"

vd_status vd_packer_init(vd_context *context, const vd_evaluate_settings *settings,
                         vd_packer *out) {
    *out = (vd_packer){.coder = NULL};
    if (settings->codec == VD_CODEC_RAW) {
        return vd_success();
    }
    out->def.codec = settings->codec;
    out->def.quality = settings->quality;
    out->def.link_bytes_per_s = settings->impostors.link_bytes_per_s;
    const vd_status status = vd_remote_module_open("pack pictures for a link", &out->remote);
    return status.code == VD_OK ? out->remote.coder_create(context, &out->coder) : status;
}

void vd_packer_finish(vd_packer *p) {
    if (p->coder != NULL) {
        p->remote.coder_destroy(&p->coder);
    }
    free(p->bytes);
    p->bytes = NULL;
}

static bool make_room(vd_packer *p, size_t room) {
    if (room > p->room) {
        uint8_t *bytes = realloc(p->bytes, room);
        if (bytes == NULL) {
            return false;
        }
        p->bytes = bytes;
        p->room = room;
    }
    return room > 0;
}

size_t vd_packer_pass(vd_packer *p, uint8_t *rgba, int width, int height, size_t stride) {
    const size_t raw = 4 * (size_t)width * (size_t)height;
    if (p->coder == NULL || !make_room(p, p->remote.codec_bound(p->def.codec, width, height))) {
        return raw;
    }
    const vd_codec_picture picture = {rgba, width, height, stride};
    vd_encoded packed;
    vd_status status = p->remote.encode(p->coder, &p->def, &picture, p->bytes, p->room, &packed);
    if (status.code != VD_OK) {
        return raw;
    }
    const double start = vd_seconds_now();
    status = p->remote.decode(p->coder, packed.codec, p->bytes, packed.bytes, width, height, rgba,
                              stride);
    p->decode_s += vd_seconds_now() - start;
    return status.code == VD_OK ? packed.bytes : raw;
}
