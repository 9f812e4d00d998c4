/* bench_cloud.c: generated particles in a world. */
#include "bench_cloud.h"

#include <stdlib.h>
#include <unistd.h>

void bench_cloud_path(char *out, size_t out_bytes) {
    const char *folder = getenv("TMPDIR");
    snprintf(out, out_bytes, "%.400s/veduta-bench-cloud-%d.vdp", folder != NULL ? folder : "/tmp",
             (int)getpid());
}

vd_status bench_cloud_write(const char *path, size_t count, const vd_particles_place *place) {
    vd_bricks_report report;
    vd_context *context = NULL;
    vd_particles *particles = NULL;
    vd_status status = vd_context_create(NULL, &context);
    if (status.code == VD_OK) {
        status = vd_particles_generate(context, NULL, 1, count, &particles);
    }
    if (status.code == VD_OK) {
        status = vd_particles_to_bricks(context, NULL, particles, place, path, &report);
    }
    vd_particles_destroy(&particles);
    vd_context_destroy(&context);
    return status;
}

vd_status bench_cloud_add(vd_context *context, vd_world *world, const char *path, bool thin,
                          uint64_t most, size_t *objects) {
    vd_bricks *bricks = NULL;
    vd_particle_look look = vd_particle_look_default();
    uint32_t number = 0;
    vd_status status = vd_bricks_open(context, path, &bricks);
    if (status.code == VD_OK) {
        look.color = VD_BRICK_COLOR_VALUE;
        look.attribute = vd_bricks_find(bricks, "speed");
        look.log = true;
        if (thin) {
            look.radius_m = vd_brick_view_radius(bricks);
        } else {
            look.opacity = 0.5;
        }
        status = vd_world_add_bricks(world, &bricks, &look, &number);
    }
    vd_bricks_close(&bricks);
    return status.code == VD_OK ? vd_world_add_particles(world, number, most, objects) : status;
}
