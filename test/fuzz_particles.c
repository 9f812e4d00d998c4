/* Fuzzes the readers of particles: LAS, PLY, text and raw numbers, told apart by contents; the
 * first byte chooses between text with and without names, and raw. What is read must fit what was
 * announced, and reading again must give as much. */
#include <stdlib.h>
#include <string.h>
#include <veduta/particle_source.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { CAPACITY = 100 };
static double places[3][CAPACITY];
static float values[VD_MAX_ATTRIBUTES][CAPACITY];

static uint64_t read_all(vd_particle_source *source) {
    vd_particle_batch batch = {CAPACITY, 0, places[0], places[1], places[2], {0}};
    for (int a = 0; a < source->attribute_count; a++) {
        batch.values[a] = values[a];
    }
    uint64_t total = 0;
    vd_status status;
    do {
        batch.count = 0;
        status = vd_particle_source_read(source, &batch);
        total += batch.count;
        if (batch.count > CAPACITY || !(vd_particle_source_progress(source) <= 1.0)) {
            abort();
        }
    } while (status.code == VD_OK && batch.count > 0);
    if (status.code == VD_OK && source->count > 0 && total != source->count) {
        abort();
    }
    return total;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (size < 1) {
        return 0;
    }
    static const char *const columns[] = {NULL, "x,y,z,mass", "x,-,y,z,class,red", "ra,dec,plx,w"};
    static const char *const types[] = {"f32", "f64", "i16", "u8", "i32", "u16", "i8", "u32"};
    vd_particle_source_def def = vd_particle_source_def_default();
    def.columns = columns[data[0] & 3];
    if ((data[0] & 4) != 0) {
        def.raw = types[data[0] >> 3 & 7];
        def.raw_big_endian = (data[0] & 64) != 0;
        def.raw_offset_bytes = data[0] >> 7;
    }
    vd_context_def context_def = vd_context_def_default();
    context_def.threads = 1;
    vd_context *context = NULL;
    if (vd_context_create(&context_def, &context).code != VD_OK) {
        return 0;
    }
    vd_particle_source *source = NULL;
    vd_status status =
        vd_particle_source_open_memory(context, data + 1, size - 1, "fuzz", &def, &source);
    if ((status.code == VD_OK) != (source != NULL) ||
        (status.code != VD_OK && status.message[0] == '\0')) {
        abort();
    }
    if (source != NULL) {
        const uint64_t first = read_all(source);
        if (vd_particle_source_rewind(source).code != VD_OK || read_all(source) != first) {
            abort();
        }
    }
    vd_particle_source_destroy(&source);
    vd_context_destroy(&context);
    return 0;
}
