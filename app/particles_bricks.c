/* particles_bricks.c: generated particles as a source. */
#include "particles_bricks.h"

typedef struct generated {
    const vd_particles *particles;
    const vd_particles_place *place;
    size_t next;
} generated;

static vd_status generated_read(void *user, vd_particle_batch *batch) {
    generated *g = user;
    const vd_particles *p = g->particles;
    while (batch->count < batch->capacity && g->next < p->count) {
        const size_t from = g->next++, to = batch->count++;
        batch->x[to] = g->place->centre.x + g->place->size * (double)p->x[from];
        batch->y[to] = g->place->centre.y + g->place->size * (double)p->y[from];
        batch->z[to] = g->place->centre.z + g->place->size * (double)p->z[from];
        batch->values[0][to] = (float)(g->place->size * (double)p->radius[from]);
        batch->values[1][to] = p->mass[from];
        batch->values[2][to] = p->speed[from];
        batch->values[3][to] = (float)p->classes[from];
    }
    return vd_success();
}

static vd_status generated_rewind(void *user) {
    ((generated *)user)->next = 0;
    return vd_success();
}

static double generated_progress(void *user) {
    const generated *g = user;
    return (double)g->next / (double)g->particles->count;
}

static void generated_close(void *user) {
    (void)user;
}

void vd_particles_move(vd_particles *p, const vd_particles_place *place) {
    const vd_vec3 c = place->centre;
    for (size_t i = 0; i < p->count; i++) {
        p->x[i] = (float)(c.x + place->size * (double)p->x[i]);
        p->y[i] = (float)(c.y + place->size * (double)p->y[i]);
        p->z[i] = (float)(c.z + place->size * (double)p->z[i]);
        p->radius[i] = (float)(place->size * (double)p->radius[i]);
    }
}

vd_status vd_particles_to_bricks(vd_context *context, vd_job *job, const vd_particles *particles,
                                 const vd_particles_place *place, const char *path,
                                 vd_bricks_report *report) {
    static const vd_particle_reader reader = {generated_read, generated_rewind, generated_progress,
                                              generated_close};
    vd_particle_source *source = NULL;
    generated g = {particles, place, 0};
    vd_status status = vd_particle_source_create(context, "generated", &reader, &g, &source);
    if (status.code == VD_OK) {
        (void)vd_particle_source_add(source, "radius", VD_ATTRIBUTE_RADIUS);
        (void)vd_particle_source_add(source, "mass", VD_ATTRIBUTE_SCALAR);
        (void)vd_particle_source_add(source, "speed", VD_ATTRIBUTE_SCALAR);
        (void)vd_particle_source_add(source, "class", VD_ATTRIBUTE_CATEGORY);
        status = vd_bricks_import(context, job, &source, 1, NULL, path, report);
    }
    vd_particle_source_destroy(&source);
    return status;
}
