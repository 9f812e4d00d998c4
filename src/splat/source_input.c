#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "core/core.h"
#include "splat/source_input.h"

static vd_status read_failure(const char *name, int error) {
    return vd_failure(VD_ERROR_IO, "cannot read %.250s: %s; check %s", name, strerror(error),
                      error == ENOENT ? "the path" : "the file and its permissions");
}

vd_status vd_input_open(vd_context *context, const char *path, vd_input *out) {
    const int descriptor = open(path, O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) {
        return read_failure(path, errno);
    }
    struct stat info;
    vd_status status = vd_success();
    if (fstat(descriptor, &info) != 0) {
        status = read_failure(path, errno);
    } else if (!S_ISREG(info.st_mode)) {
        status = vd_failure(VD_ERROR_IO,
                            "cannot read %.250s: particles are read twice, which only a file "
                            "allows; save them into one first",
                            path);
    }
    uint8_t *block = status.code == VD_OK ? vd_allocate(context, VD_INPUT_BLOCK_BYTES, 1) : NULL;
    if (status.code == VD_OK && block == NULL) {
        status = vd_out_of_memory(path, VD_INPUT_BLOCK_BYTES);
    }
    if (status.code != VD_OK) {
        close(descriptor);
        return status;
    }
    *out = (vd_input){.context = context,
                      .name = path,
                      .descriptor = descriptor,
                      .size_bytes = (uint64_t)info.st_size,
                      .block = block,
                      .block_bytes = VD_INPUT_BLOCK_BYTES,
                      .at = block,
                      .end = block};
    return vd_success();
}

void vd_input_from_memory(vd_context *context, const void *data, size_t size_bytes,
                          const char *name, vd_input *out) {
    *out = (vd_input){.context = context,
                      .name = name,
                      .descriptor = -1,
                      .memory = data,
                      .size_bytes = size_bytes,
                      .next = size_bytes,
                      .at = data,
                      .end = (const uint8_t *)data + size_bytes};
}

void vd_input_close(vd_input *input) {
    if (input->descriptor >= 0) {
        close(input->descriptor);
        input->descriptor = -1;
    }
    vd_release(input->context, input->block);
    input->block = NULL;
}

void vd_input_seek(vd_input *input, uint64_t offset) {
    if (offset > input->size_bytes) {
        offset = input->size_bytes;
    }
    if (input->descriptor < 0) {
        input->at = input->memory + offset;
    } else {
        input->next = offset;
        input->at = input->end = input->block;
    }
}

static ssize_t read_at(const vd_input *input, void *out, size_t bytes, uint64_t offset) {
    ssize_t got;
    do {
        got = pread(input->descriptor, out, bytes, (off_t)offset);
    } while (got < 0 && errno == EINTR);
    return got;
}

vd_status vd_input_fill(vd_input *input, size_t need) {
    size_t have = (size_t)(input->end - input->at);
    if (have >= need || input->descriptor < 0) {
        return vd_success();
    }
    memmove(input->block, input->at, have);
    while (have < input->block_bytes) {
        const ssize_t got =
            read_at(input, input->block + have, input->block_bytes - have, input->next);
        if (got < 0) {
            return read_failure(input->name, errno);
        }
        if (got == 0) {
            break;
        }
        have += (size_t)got;
        input->next += (uint64_t)got;
    }
    input->at = input->block;
    input->end = input->block + have;
    return vd_success();
}

size_t vd_input_peek(vd_input *input, uint64_t offset, void *out, size_t bytes) {
    if (offset >= input->size_bytes) {
        return 0;
    }
    const uint64_t left = input->size_bytes - offset;
    bytes = bytes < left ? bytes : (size_t)left;
    if (input->descriptor < 0) {
        memcpy(out, input->memory + offset, bytes);
        return bytes;
    }
    size_t have = 0;
    while (have < bytes) {
        const ssize_t got = read_at(input, (uint8_t *)out + have, bytes - have, offset + have);
        if (got <= 0) {
            break;
        }
        have += (size_t)got;
    }
    return have;
}

void vd_fields_read(const vd_field *fields, int count, bool big_endian, const uint8_t *at,
                    size_t stride, size_t records, vd_particle_batch *batch) {
    double *const places[3] = {batch->x, batch->y, batch->z};
    const bool swapped = vd_number_is_swapped(big_endian);
    for (int f = 0; f < count; f++) {
        const vd_field *field = &fields[f];
        const uint8_t *p = at + field->offset;
        if (field->target < 3) {
            double *out = places[field->target] + batch->count;
            for (size_t i = 0; i < records; i++, p += stride) {
                out[i] = field->scale * vd_number_read(p, field->type, swapped);
            }
        } else {
            float *out = batch->values[field->target - 3] + batch->count;
            for (size_t i = 0; i < records; i++, p += stride) {
                out[i] = (float)(field->scale * vd_number_read(p, field->type, swapped));
            }
        }
    }
    batch->count += records;
}
