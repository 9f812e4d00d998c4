/* import.h: one model on its way from assimp. */
#ifndef VEDUTA_IMPORT_IMPORT_H
#define VEDUTA_IMPORT_IMPORT_H

#include <assimp/scene.h>
#include <veduta/model_import.h>

/* What is collected for vd_model_create; everything owned. */
typedef struct vd_import {
    vd_context *context;
    const char *path;
    bool skip_textures, linear_colors; /* glTF's colours are linear, others' sRGB */
    const struct aiScene *scene;
    vd_material *materials; /* [scene->mNumMaterials] */
    vd_model_surface *surfaces;
    vd_texture **textures; /* [texture_count], room for one a material */
    char (*texture_names)[256];
    int texture_count;
    double (*positions)[3];
    float (*normals)[3], (*uvs)[2], (*colors)[3]; /* null where no mesh has them */
    uint32_t (*triangles)[3], *triangle_materials, (*lines)[2], *points;
    size_t vertex_count, triangle_count, line_count, point_count;
} vd_import;

/* Reads the scene's materials and their textures. */
VD_MUST_USE vd_status vd_import_materials(vd_import *import);

/* Collects the meshes of all nodes. */
VD_MUST_USE vd_status vd_import_meshes(vd_import *import);

#endif
