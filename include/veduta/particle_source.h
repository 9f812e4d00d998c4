/* particle_source.h: particles from files, a batch at a time.
 *
 * A source reads one file (LAS, PLY, columns of text, raw numbers; HDF5 through snapshot.h) and
 * hands out its particles in the file's order, in batches, so that no file is too large. It can be
 * begun again. Positions are doubles, attributes floats, each with the name that the file gives it.
 *
 *     status = vd_particle_source_open(context, "scan.las", NULL, &source);
 *     batch.capacity = …; batch.x = …; batch.values[0] = …;
 *     do {
 *         batch.count = 0;
 *         status = vd_particle_source_read(source, &batch);
 *     } while (status.code == VD_OK && batch.count > 0);
 *     vd_particle_source_destroy(&source);
 */
#ifndef VEDUTA_PARTICLE_SOURCE_H
#define VEDUTA_PARTICLE_SOURCE_H

#include <stdbool.h>
#include <veduta/context.h>

VD_BEGIN_DECLARATIONS

#define VD_MAX_ATTRIBUTES 32
#define VD_ATTRIBUTE_NAME_BYTES 48

typedef enum vd_attribute_kind {
    VD_ATTRIBUTE_SCALAR = 0, /* a number; samples of a coarser level hold its mean */
    VD_ATTRIBUTE_CATEGORY,   /* a whole number 0 … 65535, such as a class; never averaged */
    VD_ATTRIBUTE_CHANNEL,    /* red, green or blue, 0 … 255, sRGB-encoded */
    VD_ATTRIBUTE_RADIUS,     /* metres; samples hold the root of the mean square */
    VD_ATTRIBUTE_KIND_COUNT
} vd_attribute_kind;

/* Returns "scalar", "category", "channel" or "radius". */
VD_API const char *vd_attribute_kind_name(vd_attribute_kind kind);

/* One number that every particle has. The names red, green, blue (channels), class (a category),
 * mass and radius mean what they say to those who draw; at most one attribute is a radius. */
typedef struct vd_attribute {
    char name[VD_ATTRIBUTE_NAME_BYTES]; /* unique within a source */
    vd_attribute_kind kind;
} vd_attribute;

/* Particles as arrays of the caller's. Reading appends behind `count`. */
typedef struct vd_particle_batch {
    size_t capacity, count;
    double *x, *y, *z;                /* [capacity] */
    float *values[VD_MAX_ATTRIBUTES]; /* [attributes of the source][capacity] */
} vd_particle_batch;

typedef struct vd_particle_source vd_particle_source;

/* How a kind of file is read; for those who write a reader. `user` is the reader's. */
typedef struct vd_particle_reader {
    /* Appends particles until the batch is full or the file ends. */
    vd_status (*read)(void *user, vd_particle_batch *batch);
    vd_status (*rewind)(void *user); /* begins again */
    double (*progress)(void *user);  /* the share that was read, 0 … 1 */
    void (*close)(void *user);
} vd_particle_reader;

/* A source. Everything but `reader` and `user` is for reading. */
struct vd_particle_source {
    vd_context *context;
    char format[64]; /* for people, such as "LAS 1.2, points of format 3" */
    char *path;      /* in the context's memory */
    char *crs;       /* what the file says about its coordinates, or null */
    uint64_t count;  /* particles that the file's header says there are; 0: not said */
    int attribute_count;
    vd_attribute attributes[VD_MAX_ATTRIBUTES];
    const vd_particle_reader *reader;
    void *user;
};

/* How to read what a file does not say itself. */
typedef struct vd_particle_source_def {
    const char *columns; /* text and raw files: names of the columns, separated by commas; those to
                            be passed over are empty or "-". Null: from the file; for raw "x,y,z" */
    const char *raw;     /* not null: the file is raw numbers, particle after particle, of this
                            type: "f32", "f64", "i16", "u16", "i32", "u8"; null: by contents */
    bool raw_big_endian;
    uint64_t raw_offset_bytes;
} vd_particle_source_def;

VD_API vd_particle_source_def vd_particle_source_def_default(void);

/* Opens a file of particles; its kind is told by its contents: "LASF", "ply" or else text (CSV, or
 * columns separated by blanks, tabs or semicolons), with names of columns in the first line or a
 * comment before the data; x, y and z must be among them, or ra and dec in degrees (hours where the
 * name is "ra_hours"), with a distance or "parallax". `def` may be null. Only the head of the file
 * is read. *out is owned by the caller.
 * Returns VD_ERROR_UNSUPPORTED (LAZ; HDF5, which snapshot.h reads; a PLY with faces: a mesh; a
 * version to come), VD_ERROR_FORMAT, VD_ERROR_IO, VD_ERROR_ARGUMENT (def) or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_particle_source_open(vd_context *context, const char *path,
                                                     const vd_particle_source_def *def,
                                                     vd_particle_source **out);

/* The same from memory, which must stay; `name` is for error sentences. */
VD_API VD_MUST_USE vd_status vd_particle_source_open_memory(vd_context *context, const void *data,
                                                            size_t size_bytes, const char *name,
                                                            const vd_particle_source_def *def,
                                                            vd_particle_source **out);

/* What a file is, by its first bytes: one open and one read. */
typedef enum vd_particle_file {
    VD_PARTICLE_FILE_NONE = 0, /* unreadable, or something else */
    VD_PARTICLE_FILE_BRICKS,   /* bricks.h */
    VD_PARTICLE_FILE_LAS,
    VD_PARTICLE_FILE_PLY,  /* without faces */
    VD_PARTICLE_FILE_HDF5, /* snapshot.h */
    VD_PARTICLE_FILE_TEXT, /* by the name's ending: .csv, .tsv, .txt, .xyz, .pts, .dat */
    VD_PARTICLE_FILE_COUNT
} vd_particle_file;

VD_API vd_particle_file vd_particle_file_probe(const char *path);

/* Appends the next particles to the batch; it is full or the file has ended when this returns.
 * A file that ends early or holds nonsense gives VD_ERROR_FORMAT; also VD_ERROR_IO. */
VD_API VD_MUST_USE vd_status vd_particle_source_read(vd_particle_source *source,
                                                     vd_particle_batch *batch);
VD_API VD_MUST_USE vd_status vd_particle_source_rewind(vd_particle_source *source);
VD_API double vd_particle_source_progress(const vd_particle_source *source);
VD_API void vd_particle_source_destroy(vd_particle_source **source);

/* Makes a source for a reader; takes `user` over, on failure too (by reader->close). The fields for
 * people and the attributes are the reader's to fill in afterwards. Returns VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_particle_source_create(vd_context *context, const char *path,
                                                       const vd_particle_reader *reader, void *user,
                                                       vd_particle_source **out);

/* Adds an attribute; a second one of the same name gets a number behind it. Returns its index, −1
 * when there are VD_MAX_ATTRIBUTES already. */
VD_API int vd_particle_source_add(vd_particle_source *source, const char *name,
                                  vd_attribute_kind kind);

/* Returns the index of an attribute, −1 when there is none of that name. */
VD_API int vd_particle_source_find(const vd_particle_source *source, const char *name);

VD_END_DECLARATIONS

#endif
