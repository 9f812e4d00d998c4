/* snapshot.c: HDF5 snapshots as a source of particles. */
#include <hdf5.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <veduta/snapshot.h>

#define ROWS ((size_t)65536) /* read at a time */
#define MAX_FILES 65536

/* Where the numbers of an attribute come from. */
typedef struct column {
    char dataset[VD_ATTRIBUTE_NAME_BYTES]; /* empty: `constant` */
    int width;                             /* 1, or 3: the length of a vector */
    double constant, scale;
} column;

typedef struct snapshot {
    vd_context *context;
    char *path;                                  /* of the file that was named */
    int type, first_file, file_count, number_at; /* number_at: of the digits in path; −1: none */
    int column_count;
    column columns[VD_MAX_ATTRIBUTES];
    double *rows; /* [ROWS][3] */

    int file; /* the file that is open, −1 none; those before it are read */
    hid_t handle, coordinates, datasets[VD_MAX_ATTRIBUTES];
    char file_path[4096];
    uint64_t next, count; /* rows of the open file */
} snapshot;

vd_snapshot_def vd_snapshot_def_default(void) {
    return (vd_snapshot_def){.type = -1, .whole = true};
}

/* ---- small things of HDF5 -----------------------------------------------------------------------
 */

/* Sizes of a dataset; its rank, 0 when it is none of rank 1 or 2. */
static int dataset_shape(hid_t dataset, hsize_t dims[2]) {
    const hid_t space = H5Dget_space(dataset);
    dims[0] = dims[1] = 1;
    int rank = space >= 0 ? H5Sget_simple_extent_ndims(space) : 0;
    rank = rank == 1 || rank == 2 ? rank : 0;
    if (rank > 0) {
        H5Sget_simple_extent_dims(space, dims, NULL);
    }
    if (space >= 0) {
        H5Sclose(space);
    }
    return rank;
}

static bool is_number(hid_t dataset) {
    const hid_t type = H5Dget_type(dataset);
    const H5T_class_t kind = type >= 0 ? H5Tget_class(type) : H5T_NO_CLASS;
    if (type >= 0) {
        H5Tclose(type);
    }
    return kind == H5T_FLOAT || kind == H5T_INTEGER;
}

/* Reads up to `most` numbers of an attribute of the header; returns how many. */
static int header_numbers(hid_t file, const char *name, double *out, int most) {
    if (H5Lexists(file, "Header", H5P_DEFAULT) <= 0 ||
        H5Aexists_by_name(file, "Header", name, H5P_DEFAULT) <= 0) {
        return 0;
    }
    const hid_t attribute = H5Aopen_by_name(file, "Header", name, H5P_DEFAULT, H5P_DEFAULT);
    const hid_t space = attribute >= 0 ? H5Aget_space(attribute) : -1;
    const hssize_t count = space >= 0 ? H5Sget_simple_extent_npoints(space) : 0;
    int got = 0;
    double numbers[64];
    if (count >= 1 && count <= 64 && H5Aread(attribute, H5T_NATIVE_DOUBLE, numbers) >= 0) {
        got = count < most ? (int)count : most;
        memcpy(out, numbers, (size_t)got * sizeof *out);
    }
    if (space >= 0) {
        H5Sclose(space);
    }
    if (attribute >= 0) {
        H5Aclose(attribute);
    }
    return got;
}

static hid_t open_in_group(hid_t file, int type, const char *name) {
    char path[VD_ATTRIBUTE_NAME_BYTES + 16];
    snprintf(path, sizeof path, "PartType%d", type);
    if (H5Lexists(file, path, H5P_DEFAULT) <= 0) {
        return -1;
    }
    snprintf(path, sizeof path, "PartType%d/%s", type, name);
    return H5Lexists(file, path, H5P_DEFAULT) > 0 ? H5Dopen2(file, path, H5P_DEFAULT) : -1;
}

/* Rows of a type's coordinates; 0 when it has none. */
static uint64_t type_rows(hid_t file, int type) {
    hsize_t dims[2];
    const hid_t dataset = open_in_group(file, type, "Coordinates");
    if (dataset < 0) {
        return 0;
    }
    const int rank = dataset_shape(dataset, dims);
    H5Dclose(dataset);
    return rank == 2 && dims[1] == 3 ? dims[0] : 0;
}

/* ---- files --------------------------------------------------------------------------------------
 */

static void close_file(snapshot *s) {
    if (s->handle < 0) {
        return;
    }
    if (s->coordinates >= 0) {
        H5Dclose(s->coordinates);
    }
    for (int c = 0; c < s->column_count; c++) {
        if (s->datasets[c] >= 0) {
            H5Dclose(s->datasets[c]);
        }
    }
    H5Fclose(s->handle);
    s->handle = -1;
}

static void name_file(snapshot *s, int file) {
    if (s->number_at < 0) {
        snprintf(s->file_path, sizeof s->file_path, "%s", s->path);
    } else {
        snprintf(s->file_path, sizeof s->file_path, "%.*s%d%s", s->number_at, s->path, file,
                 s->path + s->number_at + strspn(s->path + s->number_at, "0123456789"));
    }
}

static vd_status bad(const char *path, const char *what) {
    return vd_failure(VD_ERROR_FORMAT, "cannot read %.160s: %.160s", path, what);
}

static vd_status open_handle(const char *path, hid_t *out) {
    FILE *file = fopen(path, "rb"); /* for the sentence: HDF5 does not say why */
    if (file == NULL) {
        return vd_failure(VD_ERROR_IO,
                          "cannot read %.250s: it is not there or may not be read; all files of a "
                          "snapshot must be in one folder",
                          path);
    }
    fclose(file);
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    *out = H5Fis_hdf5(path) > 0 ? H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT) : -1;
    return *out >= 0 ? vd_success()
                     : bad(path, "it is no HDF5 file, or damaged; get the whole file again");
}

/* Opens file number s->file and what is read of it. */
static vd_status open_file(snapshot *s) {
    name_file(s, s->file);
    vd_status status = open_handle(s->file_path, &s->handle);
    if (status.code != VD_OK) {
        return status;
    }
    s->next = 0;
    s->count = type_rows(s->handle, s->type);
    s->coordinates = s->count > 0 ? open_in_group(s->handle, s->type, "Coordinates") : -1;
    for (int c = 0; c < s->column_count; c++) {
        const column *col = &s->columns[c];
        s->datasets[c] = -1;
        if (s->count == 0 || col->dataset[0] == '\0') {
            continue;
        }
        hsize_t dims[2];
        s->datasets[c] = open_in_group(s->handle, s->type, col->dataset);
        if (s->datasets[c] < 0 || dataset_shape(s->datasets[c], dims) == 0 || dims[0] != s->count ||
            dims[1] != (hsize_t)col->width) {
            char what[160];
            snprintf(what, sizeof what,
                     "PartType%d/%s is not there or has not as many rows as Coordinates", s->type,
                     col->dataset);
            return bad(s->file_path, what);
        }
    }
    return status;
}

static bool read_rows(hid_t dataset, uint64_t from, uint64_t rows, int width, double *out) {
    const hsize_t start[2] = {from, 0}, count[2] = {rows, (hsize_t)width};
    hsize_t dims[2];
    const int rank = dataset_shape(dataset, dims);
    const hid_t all = H5Dget_space(dataset), some = H5Screate_simple(rank, count, NULL);
    const bool done = all >= 0 && some >= 0 &&
                      H5Sselect_hyperslab(all, H5S_SELECT_SET, start, NULL, count, NULL) >= 0 &&
                      H5Dread(dataset, H5T_NATIVE_DOUBLE, some, all, H5P_DEFAULT, out) >= 0;
    if (all >= 0) {
        H5Sclose(all);
    }
    if (some >= 0) {
        H5Sclose(some);
    }
    return done;
}

static vd_status read_block(snapshot *s, vd_particle_batch *b, size_t rows) {
    const size_t at = b->count;
    if (!read_rows(s->coordinates, s->next, rows, 3, s->rows)) {
        return bad(s->file_path, "its Coordinates cannot be read; get the whole file again");
    }
    for (size_t i = 0; i < rows; i++) {
        b->x[at + i] = s->rows[3 * i];
        b->y[at + i] = s->rows[3 * i + 1];
        b->z[at + i] = s->rows[3 * i + 2];
    }
    for (int c = 0; c < s->column_count; c++) {
        const column *col = &s->columns[c];
        float *out = b->values[c] + at;
        if (s->datasets[c] >= 0 && !read_rows(s->datasets[c], s->next, rows, col->width, s->rows)) {
            char what[120];
            snprintf(what, sizeof what, "its %s cannot be read; get the whole file again",
                     col->dataset);
            return bad(s->file_path, what);
        }
        for (size_t i = 0; i < rows; i++) {
            const double *v = s->rows + 3 * i;
            out[i] = s->datasets[c] < 0 ? (float)col->constant
                     : col->width == 1  ? (float)(col->scale * s->rows[i])
                                        : (float)sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        }
    }
    b->count += rows;
    s->next += rows;
    return vd_success();
}

static vd_status snapshot_read(void *user, vd_particle_batch *batch) {
    snapshot *s = user;
    vd_status status = vd_success();
    while (status.code == VD_OK && batch->count < batch->capacity) {
        if (s->handle < 0) {
            if (s->file >= s->first_file + s->file_count) {
                break;
            }
            status = open_file(s);
            continue;
        }
        const size_t room = batch->capacity - batch->count;
        const uint64_t left = s->count - s->next;
        size_t rows = left < ROWS ? (size_t)left : ROWS;
        rows = rows < room ? rows : room;
        if (rows > 0) {
            status = read_block(s, batch, rows);
        } else {
            close_file(s);
            s->file++;
        }
    }
    return status;
}

static vd_status snapshot_rewind(void *user) {
    snapshot *s = user;
    close_file(s);
    s->file = s->first_file;
    return vd_success();
}

static double snapshot_progress(void *user) {
    const snapshot *s = user;
    const double within = s->handle >= 0 && s->count > 0 ? (double)s->next / (double)s->count : 0.0;
    return (s->file - s->first_file + within) / s->file_count;
}

static void snapshot_close(void *user) {
    snapshot *s = user;
    close_file(s);
    vd_release(s->context, s->path);
    vd_release(s->context, s->rows);
    vd_release(s->context, s);
}

static const vd_particle_reader reader = {snapshot_read, snapshot_rewind, snapshot_progress,
                                          snapshot_close};

/* ---- what there is ------------------------------------------------------------------------------
 */

static void add_column(snapshot *s, vd_particle_source *source, const char *name,
                       vd_attribute_kind kind, const column *col) {
    if (s->column_count < VD_MAX_ATTRIBUTES && vd_particle_source_add(source, name, kind) >= 0) {
        s->columns[s->column_count++] = *col;
    }
}

typedef struct search {
    snapshot *s;
    vd_particle_source *source;
    uint64_t rows;
} search;

static herr_t look_at_dataset(hid_t group, const char *name, const H5L_info_t *info, void *user) {
    (void)info;
    search *f = user;
    if (strcmp(name, "Coordinates") == 0 || strcmp(name, "ParticleIDs") == 0 ||
        strlen(name) >= VD_ATTRIBUTE_NAME_BYTES) {
        return 0;
    }
    const hid_t dataset = H5Dopen2(group, name, H5P_DEFAULT);
    hsize_t dims[2];
    if (dataset < 0) {
        return 0; /* a group */
    }
    const int rank = dataset_shape(dataset, dims);
    const bool fits =
        rank > 0 && dims[0] == f->rows && (dims[1] == 1 || dims[1] == 3) && is_number(dataset);
    H5Dclose(dataset);
    column col = {.width = (int)dims[1], .scale = 1.0};
    snprintf(col.dataset, sizeof col.dataset, "%s", name);
    if (fits && strcasecmp(name, "Masses") == 0) {
        add_column(f->s, f->source, "mass", VD_ATTRIBUTE_SCALAR, &col);
    } else if (fits && (strcmp(name, "SmoothingLengths") == 0 || /* SWIFT, then Gadget */
                        strcmp(name, "SmoothingLength") == 0 || strcmp(name, "Hsml") == 0)) {
        col.scale = strcmp(name, "SmoothingLengths") == 0 ? 1.0 : 0.5;
        add_column(f->s, f->source, "radius", VD_ATTRIBUTE_RADIUS, &col);
    } else if (fits) {
        add_column(f->s, f->source, name, VD_ATTRIBUTE_SCALAR, &col);
    }
    return 0;
}

static vd_status find_columns(snapshot *s, hid_t file, vd_particle_source *source) {
    char name[16];
    snprintf(name, sizeof name, "PartType%d", s->type);
    search f = {s, source, type_rows(file, s->type)};
    const hid_t group = H5Gopen2(file, name, H5P_DEFAULT);
    if (group < 0 || H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, NULL, look_at_dataset, &f) < 0) {
        if (group >= 0) {
            H5Gclose(group);
        }
        return bad(s->path, "the datasets of its particles cannot be listed; get the whole file");
    }
    H5Gclose(group);
    double table[6] = {0};
    if (vd_particle_source_find(source, "mass") < 0 &&
        header_numbers(file, "MassTable", table, 6) > s->type && table[s->type] > 0.0) {
        const column col = {.width = 1, .constant = table[s->type], .scale = 1.0};
        add_column(s, source, "mass", VD_ATTRIBUTE_SCALAR, &col);
    }
    return vd_success();
}

static vd_status find_type(snapshot *s, hid_t file, int wanted) {
    s->type = wanted;
    for (int t = 0; t < 6 && s->type < 0; t++) {
        s->type = type_rows(file, t) > 0 ? t : -1;
    }
    if (s->type < 0 || type_rows(file, s->type) == 0) {
        char types[16] = "0 to 5", what[200];
        if (wanted >= 0) {
            snprintf(types, sizeof types, "%d", wanted);
        }
        snprintf(what, sizeof what,
                 "PartType%s has no Coordinates of shape [n][3], so it is no snapshot of Gadget, "
                 "AREPO or SWIFT, or has no such particles",
                 types);
        return bad(s->path, what);
    }
    return vd_success();
}

/* How many files the snapshot has, and where the number stands in their names. */
static void find_files(snapshot *s, hid_t file, bool whole) {
    double files = 1.0;
    s->file_count = 1;
    s->number_at = -1;
    (void)header_numbers(file, "NumFilesPerSnapshot", &files, 1);
    const char *dot = strrchr(s->path, '.');
    const char *slash = strrchr(s->path, '/');
    int at = dot != NULL && (slash == NULL || dot > slash) ? (int)(dot - s->path) : 0;
    const int end = at;
    while (at > 0 && s->path[at - 1] >= '0' && s->path[at - 1] <= '9') {
        at--;
    }
    if (whole && files >= 2.0 && files <= MAX_FILES && at < end && at > 0 &&
        s->path[at - 1] == '.' && end - at < 6) {
        s->number_at = at;
        s->file_count = (int)files;
    }
    s->file = s->first_file = 0;
}

static vd_status begin(snapshot *s, const vd_snapshot_def *def, vd_particle_source *source) {
    hid_t file = -1;
    vd_status status = open_handle(s->path, &file);
    if (status.code != VD_OK) {
        return status;
    }
    find_files(s, file, def->whole);
    status = find_type(s, file, def->type);
    if (status.code == VD_OK) {
        status = find_columns(s, file, source);
    }
    double total[6] = {0};
    if (status.code == VD_OK && s->number_at >= 0 &&
        header_numbers(file, "NumPart_Total", total, 6) > s->type && total[s->type] > 0.0) {
        source->count = (uint64_t)total[s->type];
    } else if (status.code == VD_OK) {
        source->count = type_rows(file, s->type);
    }
    H5Fclose(file);
    snprintf(source->format, sizeof source->format, "HDF5 snapshot, PartType%d, %d file%s", s->type,
             s->file_count, s->file_count == 1 ? "" : "s");
    return status;
}

vd_status vd_snapshot_open(vd_context *context, const char *path, const vd_snapshot_def *def,
                           vd_particle_source **out) {
    const vd_snapshot_def none = vd_snapshot_def_default();
    def = def != NULL ? def : &none;
    if (def->type < -1 || def->type > 5) {
        return vd_failure(VD_ERROR_ARGUMENT, "types of particles are 0 to 5, not %d", def->type);
    }
    if (strlen(path) > 4000) {
        return vd_failure(VD_ERROR_ARGUMENT, "the path of a snapshot is longer than 4000 bytes");
    }
    snapshot *s = vd_allocate(context, 1, sizeof *s);
    if (s == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory for a snapshot");
    }
    memset(s, 0, sizeof *s);
    s->context = context;
    s->handle = -1;
    s->path = vd_allocate(context, strlen(path) + 1, 1);
    s->rows = vd_allocate(context, ROWS * 3, sizeof *s->rows);
    if (s->path == NULL || s->rows == NULL) {
        snapshot_close(s);
        return vd_failure(VD_ERROR_MEMORY, "out of memory for a snapshot");
    }
    strcpy(s->path, path);
    vd_particle_source *source = NULL;
    vd_status status = vd_particle_source_create(context, path, &reader, s, &source);
    if (status.code != VD_OK) {
        return status;
    }
    status = begin(s, def, source);
    if (status.code != VD_OK) {
        vd_particle_source_destroy(&source);
        return status;
    }
    *out = source;
    return status;
}
