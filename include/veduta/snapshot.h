/* snapshot.h: particles from HDF5 snapshots of Gadget, AREPO and SWIFT.
 *
 * Part of the library veduta-snapshot, which links HDF5. A snapshot is one file, or several that
 * are numbered before the ending (snap_099.0.hdf5). Of each particle come Coordinates, and as
 * attributes all datasets of one number a particle, by their names; of three numbers (Velocities)
 * the length. Masses are "mass", from the table in the header where all are equal; smoothing
 * lengths are "radius": SWIFT's as they are, those of Gadget, at which the kernel ends, halved.
 */
#ifndef VEDUTA_SNAPSHOT_H
#define VEDUTA_SNAPSHOT_H

#include <veduta/particle_source.h>

VD_BEGIN_DECLARATIONS

typedef struct vd_snapshot_def {
    int type;   /* 0 … 5: PartType0 (gas) …; −1: the first that has particles */
    bool whole; /* read the snapshot's other files too, when the path names one of several */
} vd_snapshot_def;

/* The first type, the whole snapshot. */
VD_API vd_snapshot_def vd_snapshot_def_default(void);

/* Opens a snapshot; HDF5 reads whatever compression it was built with. `def` may be null. *out is
 * owned by the caller. One thread at a time may use snapshots: HDF5 is not thread-safe everywhere.
 * Its messages to standard error are turned off.
 * Returns VD_ERROR_IO, VD_ERROR_FORMAT (not HDF5, damaged, not a snapshot: which group or dataset
 * is missing), VD_ERROR_ARGUMENT (def) or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_snapshot_open(vd_context *context, const char *path,
                                              const vd_snapshot_def *def, vd_particle_source **out);

VD_END_DECLARATIONS

#endif
