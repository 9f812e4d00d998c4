/* source_input.h: a file, or memory, read in blocks from front to back. */
#ifndef VEDUTA_SPLAT_SOURCE_INPUT_H
#define VEDUTA_SPLAT_SOURCE_INPUT_H

#include <veduta/particle_source.h>
#include "core/number.h"

#define VD_INPUT_BLOCK_BYTES ((size_t)4 << 20)

typedef struct vd_input {
    vd_context *context;
    const char *name; /* borrowed, for sentences */
    int descriptor;   /* −1: memory */
    const uint8_t *memory;
    uint64_t size_bytes;     /* of the whole input */
    uint64_t next;           /* where the block ends in the input */
    uint8_t *block;          /* of a file */
    size_t block_bytes;      /* capacity */
    const uint8_t *at, *end; /* what of the block was not consumed yet */
} vd_input;

/* Opens a regular file. `name` must outlive the input. Returns VD_ERROR_IO or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_input_open(vd_context *context, const char *path, vd_input *out);
void vd_input_from_memory(vd_context *context, const void *data, size_t size_bytes,
                          const char *name, vd_input *out);
void vd_input_close(vd_input *input);

/* Makes the next byte that is read the one at `offset`. */
void vd_input_seek(vd_input *input, uint64_t offset);

/* Where the next byte is. */
static inline uint64_t vd_input_tell(const vd_input *input) {
    return input->next - (uint64_t)(input->end - input->at);
}

/* Makes at least `need` bytes lie between at and end, fewer only where the input ends; what was not
 * consumed stays. `need` is at most VD_INPUT_BLOCK_BYTES. Returns VD_ERROR_IO. */
VD_MUST_USE vd_status vd_input_fill(vd_input *input, size_t need);

/* Copies up to `bytes` bytes at `offset`, without moving; returns how many there were. */
size_t vd_input_peek(vd_input *input, uint64_t offset, void *out, size_t bytes);

/* Readers of one kind each: take the input over, on failure too. */
VD_MUST_USE vd_status vd_las_open(vd_context *context, const char *path, vd_input input,
                                  vd_particle_source **out);
VD_MUST_USE vd_status vd_ply_open(vd_context *context, const char *path, vd_input input,
                                  vd_particle_source **out);
VD_MUST_USE vd_status vd_columns_open(vd_context *context, const char *path, vd_input input,
                                      const vd_particle_source_def *def, vd_particle_source **out);
VD_MUST_USE vd_status vd_raw_open(vd_context *context, const char *path, vd_input input,
                                  const vd_particle_source_def *def, vd_particle_source **out);

/* What a name of a column or property usually stands for: the name that attributes of its kind have
 * here ("diffuse_red" is "red"), and the kind. */
const char *vd_attribute_usual_name(const char *name, vd_attribute_kind *kind);

/* One column of a binary record: where it is, what it is, where it goes. */
typedef struct vd_field {
    int offset;
    vd_number_type type;
    int target;   /* 0 … 2: x, y, z; 3 + i: attribute i */
    double scale; /* stored numbers are multiplied by it */
} vd_field;

/* Appends `records` records of `stride` bytes at `at` to a batch, which has room for them. */
void vd_fields_read(const vd_field *fields, int count, bool big_endian, const uint8_t *at,
                    size_t stride, size_t records, vd_particle_batch *batch);

#endif
