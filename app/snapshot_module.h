/* snapshot_module.h: veduta-snapshot, opened when a snapshot comes, as veduta-io in geo_module.h.
 */
#ifndef VEDUTA_APP_SNAPSHOT_MODULE_H
#define VEDUTA_APP_SNAPSHOT_MODULE_H

#include <veduta/snapshot.h>

/* Opens veduta-snapshot and then the snapshot. Returns VD_ERROR_UNSUPPORTED when the library is not
 * there, else as vd_snapshot_open. The library stays loaded until the program ends. */
VD_MUST_USE vd_status vd_snapshot_module_open(vd_context *context, const char *path,
                                              const vd_snapshot_def *def, vd_particle_source **out);

#endif
