/* tree.h: meshes of trees, as text: for `veduta generate forest`. */
#ifndef VEDUTA_APP_TREE_H
#define VEDUTA_APP_TREE_H

#include <stdint.h>
#include <veduta/status.h>

typedef enum vd_tree_kind {
    VD_TREE_CONIFER = 0,
    VD_TREE_LARCH,
    VD_TREE_BROADLEAF,
    VD_TREE_BIRCH,
    VD_TREE_KIND_COUNT
} vd_tree_kind;

/* Returns "conifer", "larch", "broadleaf" or "birch". */
const char *vd_tree_name(vd_tree_kind kind);

/* Returns an OBJ of about 500 triangles, 14 to 22 m high, its foot at the origin, y up, that uses
 * "tree.mtl"; the same text for the same seed. Freed by the caller; null when memory is out. */
char *vd_tree_obj(vd_tree_kind kind, uint64_t seed);

/* Returns the text of "tree.mtl". */
const char *vd_tree_mtl(void);

#endif
