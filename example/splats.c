/* splats.c: a hundred thousand particles, coloured by their speed, and their column density.
 *
 *   splats [PARTICLES.png [DENSITY.png]]
 */
#include <stdio.h>
#include <veduta/veduta.h>

enum { COUNT = 100000 };

static vd_status draw(vd_splatter *splatter, const vd_splat_def *def, const vd_splats *splats,
                      vd_frame *frame, const char *path) {
    vd_camera camera = {.eye = {0.9, -1.2, 0.7},
                        .lens = vd_lens_from_fov(0.8, frame->width, frame->height),
                        .near_m = 0.01};
    camera.orientation = vd_orientation_look_at(camera.eye, vd_vec3_make(0, 0, 0));
    vd_splat_stats stats;
    vd_status status = vd_splatter_render(splatter, NULL, def, &camera, splats, 1, frame, &stats);
    if (status.code == VD_OK) {
        vd_splat_draw_legend(frame, def, &stats);
        status = vd_frame_save_png(frame, path, NULL);
    }
    return status;
}

int main(int argc, char **argv) {
    vd_context *context = NULL;
    vd_particles *particles = NULL;
    vd_splatter *splatter = NULL;
    vd_frame *frame = NULL;
    vd_status status = vd_context_create(NULL, &context);
    if (status.code == VD_OK) {
        status = vd_particles_generate(context, NULL, 1, COUNT, &particles);
    }
    if (status.code == VD_OK) {
        status = vd_splatter_create(context, &splatter);
    }
    if (status.code == VD_OK) {
        status = vd_frame_create(context, 800, 800, 0, &frame);
    }
    if (status.code == VD_OK) {
        vd_splats splats = vd_particles_splats(particles, 0, particles->count);
        vd_splat_def def = vd_splat_def_default();
        def.background = (vd_rgba8){0, 0, 0, 255};
        def.kernel = VD_SPLAT_GAUSSIAN;
        splats.radius = NULL; /* all of one size: half a thousandth of the cube */
        splats.radius_m = 0.0005f;
        status = draw(splatter, &def, &splats, frame, argc > 1 ? argv[1] : "splats.png");
        if (status.code == VD_OK && argc > 2) {
            def.mode = VD_SPLAT_DENSITY;
            def.kernel = VD_SPLAT_SPH;
            def.log = true;
            splats.radius = particles->radius; /* smoothing lengths */
            status = draw(splatter, &def, &splats, frame, argv[2]);
        }
    }
    if (status.code != VD_OK) {
        fprintf(stderr, "splats: %s\n", status.message);
    }
    vd_frame_destroy(&frame);
    vd_splatter_destroy(&splatter);
    vd_particles_destroy(&particles);
    vd_context_destroy(&context);
    return status.code == VD_OK ? 0 : 1;
}
