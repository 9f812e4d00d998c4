/* particle_file.h: particles by the file's name, whatever kind of file it is. */
#ifndef VEDUTA_APP_PARTICLE_FILE_H
#define VEDUTA_APP_PARTICLE_FILE_H

#include <veduta/veduta.h>

/* Opens `count` files as sources; *out is an array of them, ended by vd_particle_files_close. HDF5
 * snapshots are read by veduta-snapshot: particles of `type`, −1 the first there is. Returns what
 * opening them returns. */
VD_MUST_USE vd_status vd_particle_files_open(vd_context *context, const char *const *paths,
                                             int count, const vd_particle_source_def *def, int type,
                                             vd_particle_source ***out);
void vd_particle_files_close(vd_context *context, vd_particle_source ***sources, int count);

/* Opens a brick file as it is; other files are imported into one that has no name and goes when it
 * is closed (in $TMPDIR, else /tmp). Returns what opening and importing return. */
VD_MUST_USE vd_status vd_particle_files_bricks(vd_context *context, vd_job *job,
                                               const char *const *paths, int count,
                                               const vd_particle_source_def *def, int type,
                                               vd_bricks **out, char format[64]);

#endif
