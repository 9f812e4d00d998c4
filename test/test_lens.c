/* The lens reference against the truth: analytic scenes (a plane, a step, a cone, a sphere, a
 * saddle), an independent brute-force ray walker in double, any direction, curvature, holes, edges,
 * shadows, golden pictures. That the fast twin gives the same bytes is test_lens_march.c's. */
#include <math.h>
#include <stdio.h>
#include "core/real.h"
#include "support.h"
#include "terrain/lens_cast.h"
#include <veduta/terrain.h>

typedef double height_function(double x, double y);

static const int W = 64, H = 48;

/* A map of n × n samples, `cell` metres apart, centred on the origin. */
static vd_heightfield *make_map(vd_context *context, int n, double cell, height_function *f) {
    float *heights = vd_allocate(context, (size_t)n * (size_t)n, sizeof *heights);
    assert_non_null(heights);
    vd_heightfield_def def = vd_heightfield_def_default();
    const double half = 0.5 * (n - 1) * cell;
    for (int r = 0; r < n; r++) {
        for (int c = 0; c < n; c++) {
            heights[(size_t)r * (size_t)n + (size_t)c] = (float)f(c * cell - half, half - r * cell);
        }
    }
    def.width = def.height = n;
    def.type = VD_HEIGHT_F32;
    def.heights = heights;
    def.height_stride = (size_t)n;
    const double m[6] = {-half, cell, 0, half, 0, -cell};
    memcpy(def.world_from_sample, m, sizeof m);
    vd_heightfield *map = NULL;
    assert_ok(vd_heightfield_create(context, &def, &map));
    vd_release(context, heights);
    return map;
}

static double plane(double x, double y) {
    return 3 + 0.25 * x - 0.125 * y;
}
static double step(double x, double y) {
    return (void)y, x < 0 ? 0.0 : 40.0;
}
static double cone(double x, double y) {
    const double d = 60 - sqrt(x * x + y * y);
    return d > 0 ? d : 0;
}
static double dome(double x, double y) {
    const double d = 50.0 * 50.0 - x * x - y * y;
    return d > 0 ? sqrt(d) : 0;
}
static double saddle(double x, double y) {
    return 20 + x * y / 40;
}
static double flat(double x, double y) {
    return (void)x, (void)y, 0;
}
static double rough(double x, double y) {
    uint64_t seed =
        (uint64_t)(int64_t)(x * 8 + 100000) * 1000003u + (uint64_t)(int64_t)(y * 8 + 7e5);
    return 12 * test_uniform(&seed);
}

static vd_camera make_camera(double x, double y, double z, double heading, double pitch,
                             double roll) {
    vd_camera camera;
    memset(&camera, 0, sizeof camera);
    camera.eye = vd_vec3_make(x, y, z);
    camera.orientation =
        vd_orientation_from_angles(vd_radians(heading), vd_radians(pitch), vd_radians(roll));
    camera.lens = vd_lens_from_fov(vd_radians(60), W, H);
    camera.near_m = 0.01;
    return camera;
}

/* A terrain without levels of detail, for rays of any kind. */
typedef struct ground {
    vd_context *context;
    vd_terrain_def def;
    vd_lens_map map;
} ground;

static ground make_ground(vd_context *context, const vd_heightfield *map) {
    ground g;
    g.context = context;
    g.def = vd_terrain_def_default();
    g.def.heightfield = map;
    g.def.mip = false;
    assert_ok(vd_lens_map_init_reference(context, &g.def, &g.map));
    return g;
}

/* Where a ray meets the ground: t metres along, at a sample position and a height. */
typedef struct meeting {
    double t, column, row, height;
} meeting;

/* Casts the middle ray of a picture of one pixel; `curvature` per metre. */
static bool cast(const ground *g, const vd_ray *ray, double curvature, meeting *out) {
    vd_camera camera;
    memset(&camera, 0, sizeof camera);
    camera.eye = ray->origin;
    const double length = vd_vec3_length(ray->direction);
    camera.orientation =
        vd_orientation_look_at(ray->origin, vd_vec3_add(ray->origin, ray->direction));
    camera.lens = (vd_lens){1, 1, 0.5, 0.5};
    camera.near_m = 1e-9;
    vd_terrain_def def = g->def;
    def.curvature = curvature != 0;
    vd_lens_view view;
    vd_lens_view_init(&g->map, &def, &camera, 1, 1, NULL, &view);
    view.curve = (float)curvature;
    const vd_lens_ray r = vd_lens_make_ray(&view, 0.5f, 0.5f);
    float s;
    if (!vd_lens_cast(&view, &r, &s)) {
        return false;
    }
    const vd_lens_slab *slab = &view.slab[0];
    out->t = ((double)view.t0 + s) / length;
    out->column = (double)r.u + (double)r.ut * s + slab->shift_u + slab->column;
    out->row = (double)r.v + (double)r.vt * s + slab->shift_v + slab->row;
    out->height = (double)r.w + s * ((double)r.w1 + (double)s * r.w2);
    return true;
}

static double bilinear(const vd_heightfield *map, double c, double r) {
    int i = (int)floor(c), j = (int)floor(r);
    i = i < 0 ? 0 : i > map->width - 2 ? map->width - 2 : i;
    j = j < 0 ? 0 : j > map->height - 2 ? map->height - 2 : j;
    const double u = c - i, v = r - j;
    const double a = vd_heightfield_at(map, i, j), b = vd_heightfield_at(map, i + 1, j);
    const double d = vd_heightfield_at(map, i, j + 1), e = vd_heightfield_at(map, i + 1, j + 1);
    return (a * (1 - u) + b * u) * (1 - v) + (d * (1 - u) + e * u) * v;
}

static void a_plane_is_hit_where_algebra_says(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_heightfield *map = make_map(context, 101, 10, plane);
    ground g = make_ground(context, map);
    uint64_t random = 1;
    int hits = 0;
    for (int i = 0; i < 20000; i++) {
        vd_ray ray = {{(test_uniform(&random) - 0.5) * 900, (test_uniform(&random) - 0.5) * 900, 0},
                      {test_uniform(&random) - 0.5, test_uniform(&random) - 0.5,
                       test_uniform(&random) - 0.7}};
        ray.origin.z = plane(ray.origin.x, ray.origin.y) + 1 + 200 * test_uniform(&random);
        const double a = ray.origin.z - plane(ray.origin.x, ray.origin.y);
        const double b = ray.direction.z - (0.25 * ray.direction.x - 0.125 * ray.direction.y);
        const double t = -a / b;
        const double x = ray.origin.x + t * ray.direction.x, y = ray.origin.y + t * ray.direction.y;
        const double edge = fabs(x) > fabs(y) ? fabs(x) : fabs(y);
        meeting hit;
        const bool got = cast(&g, &ray, 0, &hit);
        if (t > 0 && edge < 499.9) {
            assert_true(got);
            assert_true(fabs(hit.t - t) < 1e-4 * (1 + t));
            hits++;
        } else if (t < 0 || edge > 500.1) {
            assert_false(got);
        }
    }
    assert_true(hits > 5000);
    vd_lens_map_finish(&g.map);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

/* Walks the ray in tiny steps, then bisects: slow, obviously right, and knows nothing of cells. */
static bool march(const vd_heightfield *map, const vd_ray *ray, double curvature, double t_max,
                  double *t_out) {
    const double *m = map->world_from_sample;
    double last = 0;
    bool in_air = false;
    const double q =
        curvature * (ray->direction.x * ray->direction.x + ray->direction.y * ray->direction.y);
    for (double t = 0; t <= t_max; t += 0.02) {
        const double c = (ray->origin.x + t * ray->direction.x - m[0]) / m[1];
        const double r = (ray->origin.y + t * ray->direction.y - m[3]) / m[5];
        if (c < 0 || r < 0 || c > map->width - 1 || r > map->height - 1) {
            if (in_air) {
                return false;
            }
            last = t;
            continue;
        }
        const double f = ray->origin.z + t * ray->direction.z + q * t * t - bilinear(map, c, r);
        if (f > 0) {
            in_air = true;
        } else if (!in_air) {
            return false;
        } else {
            double low = last, high = t;
            for (int i = 0; i < 60; i++) {
                const double mid = 0.5 * (low + high);
                const double cm = (ray->origin.x + mid * ray->direction.x - m[0]) / m[1];
                const double rm = (ray->origin.y + mid * ray->direction.y - m[3]) / m[5];
                const double fm =
                    ray->origin.z + mid * ray->direction.z + q * mid * mid - bilinear(map, cm, rm);
                *(fm > 0 ? &low : &high) = mid;
            }
            *t_out = high;
            return true;
        }
        last = t;
    }
    return false;
}

static void rough_ground_agrees_with_tiny_steps(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    height_function *const shapes[] = {rough, saddle, cone, dome, step};
    uint64_t random = 2;
    int hits = 0, misses = 0, grazing = 0;
    const int rays = test_is_reduced() ? 60 : 600;
    for (int n = 0; n < 5; n++) {
        vd_heightfield *map = make_map(context, 33, 4, shapes[n]);
        ground g = make_ground(context, map);
        for (int i = 0; i < rays; i++) {
            const double curvature = i % 3 == 0 ? 0.002 : 0;
            vd_ray ray = {{(test_uniform(&random) - 0.5) * 200, (test_uniform(&random) - 0.5) * 200,
                           test_uniform(&random) * 90},
                          {test_uniform(&random) - 0.5, test_uniform(&random) - 0.5,
                           (test_uniform(&random) - 0.65)}};
            ray.direction = vd_vec3_normalize(ray.direction);
            meeting hit;
            double t;
            const bool got = cast(&g, &ray, curvature, &hit);
            const bool expected = march(map, &ray, curvature, 400, &t);
            /* A ray that grazes a ridge may be told apart by less than the walker's step. */
            if (got != expected || (got && fabs(hit.t - t) > 2e-3)) {
                if (got && (!expected || hit.t < t)) {
                    const double there = bilinear(map, hit.column, hit.row);
                    assert_true(fabs(hit.height - there) < 1e-3); /* it is on the surface */
                    grazing++;
                    continue;
                }
                fail_msg("ground %d ray %d: cast %d at %g, walk %d at %g", n, i, got,
                         got ? hit.t : 0, expected, expected ? t : 0);
            }
            hits += got;
            misses += !got;
        }
        vd_lens_map_finish(&g.map);
        vd_heightfield_destroy(context, &map);
    }
    if (!(hits > rays / 2 && misses > rays / 2 && grazing <= rays / 50)) {
        fail_msg("%d hits, %d misses, %d grazing", hits, misses, grazing);
    }
    vd_context_destroy(&context);
}

/* ---- pictures ---------------------------------------------------------------------------------
 */

static vd_frame *render(vd_context *context, const vd_heightfield *map, const vd_camera *camera,
                        vd_terrain_def def, vd_frame_stats *stats) {
    def.heightfield = map;
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, W, H, VD_PLANE_DEPTH | VD_PLANE_ID, &frame));
    assert_ok(vd_terrain_render(context, NULL, &def, camera, frame, stats));
    return frame;
}

static void silhouettes_fall_where_projected(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_heightfield *map = make_map(context, 401, 1, dome);
    vd_terrain_def def = vd_terrain_def_default();
    def.samples = 1;
    def.sky = false;
    /* The sphere of radius 50 at the origin, seen level from 200 m: its outline is a cone of half
     * angle asin(50 / distance) around the direction to the centre. */
    vd_camera camera = make_camera(0, -199, 10, 0, 0, 0);
    vd_frame *frame = render(context, map, &camera, def, NULL);
    const double distance = sqrt(199.0 * 199 + 100),
                 cosine = sqrt(1 - 2500 / (distance * distance));
    int on = 0, off = 0;
    for (int y = 0; y < H; y++) {
        for (int x = 0; x < W; x++) {
            vd_ray ray = vd_camera_ray(&camera, x + 0.5, y + 0.5);
            vd_vec3 d = vd_vec3_normalize(ray.direction);
            if (d.z < 0.002) {
                continue; /* the flat ground around */
            }
            const double c = vd_vec3_dot(d, vd_vec3_make(0, 199 / distance, -10 / distance));
            const bool hit = frame->id[(size_t)y * frame->stride + (size_t)x] != 0;
            if (c > cosine + 0.002) {
                assert_true(hit);
                on++;
            } else if (c < cosine - 0.002) {
                assert_false(hit);
                off++;
            }
        }
    }
    assert_true(on > 50 && off > 500);
    vd_frame_destroy(&frame);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

static void depth_and_id_are_those_of_the_surface(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_heightfield *map = make_map(context, 201, 2, flat);
    vd_terrain_def def = vd_terrain_def_default();
    def.samples = 1;
    def.object_id = 0x123456789abcu;
    const double angles[][3] = {{0, -90, 0},      {30, -60, 0},  {200, -30, 15},
                                {300, -45, -170}, {10, -89, 90}, {45, 5, 0}};
    for (int i = 0; i < 6; i++) {
        vd_camera camera = make_camera(3, -5, 70, angles[i][0], angles[i][1], angles[i][2]);
        vd_frame_stats stats;
        vd_frame *frame = render(context, map, &camera, def, &stats);
        uint64_t hits = 0;
        for (int y = 0; y < H; y++) {
            for (int x = 0; x < W; x++) {
                const size_t at = (size_t)y * frame->stride + (size_t)x;
                vd_ray ray = vd_camera_ray(&camera, x + 0.5, y + 0.5);
                const double t = -70 / ray.direction.z;
                const double px = 3 + t * ray.direction.x, py = -5 + t * ray.direction.y;
                const double edge = fabs(px) > fabs(py) ? fabs(px) : fabs(py);
                if (t > 0 && edge < 199.99) {
                    assert_int_equal(frame->object_ids[frame->id[at]], 0x123456789abcu);
                    assert_true(fabs(vd_camera_distance(&camera, frame->depth[at]) - t) < 1e-5 * t);
                } else if (t < 0 || edge > 200.01) {
                    assert_int_equal(frame->id[at], 0);
                    assert_true(frame->depth[at] == 0);
                }
                hits += frame->id[at] != 0;
            }
        }
        assert_int_equal(stats.hits, hits);
        assert_int_equal(stats.samples, W * H);
        assert_true(i != 0 || hits == (uint64_t)(W * H)); /* straight down: all ground */
        vd_frame_destroy(&frame);
    }
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

static void curvature_drops_far_ground(void **state) {
    (void)state;
    assert_true(fabs(vd_curvature_drop(100e3) - 682.8) < 0.5); /* 785 m without refraction */
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_heightfield *map = make_map(context, 301, 1000, flat);
    ground g = make_ground(context, map);
    for (int i = 1; i <= 14; i++) {
        /* A ray from 2,000 m towards flat ground at distance d must be aimed lower by the drop. */
        const double d = i * 10e3;
        vd_ray ray = {{0.5, 0.5, 2000}, {0, 1, -(2000 + vd_curvature_drop(d)) / d}};
        meeting hit;
        const double horizon = sqrt(2000 / vd_curvature_drop(1)); /* 171 km */
        assert_true(d < horizon);
        assert_true(cast(&g, &ray, vd_curvature_drop(1), &hit));
        assert_true(fabs(hit.t - d) < 1e-5 * d);
        assert_true(fabs(hit.height) < 1e-2);
    }
    vd_ray level = {{0.5, 0.5, 1}, {0, 1, -1e-9}};
    meeting hit;
    assert_false(cast(&g, &level, vd_curvature_drop(1), &hit));
    assert_false(cast(&g, &level, 0, &hit)); /* 1 m over 150 km at 1e-9 */
    vd_lens_map_finish(&g.map);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

static void rays_under_the_surface_see_nothing(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_heightfield *map = make_map(context, 65, 4, cone);
    ground g = make_ground(context, map);
    meeting hit;
    vd_ray inside = {{0.1, 0.2, 30}, {1, 0, 0.01}}; /* starts in the cone */
    assert_false(cast(&g, &inside, 0, &hit));
    vd_ray beside = {{-500, 0.3, -5}, {1, 0, 0.0}}; /* comes in under the edge */
    assert_false(cast(&g, &beside, 0, &hit));
    vd_ray rising = {{-500, 0.3, -50}, {1, 0, 0.12}}; /* would come out inside the map */
    assert_false(cast(&g, &rising, 0, &hit));
    vd_ray over = {{-500, 0.3, 20}, {1, 0, 0.0}};
    assert_true(cast(&g, &over, 0, &hit));
    assert_true(fabs(hit.t - 460) < 0.5);
    vd_lens_map_finish(&g.map);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

static double with_hole(double x, double y) {
    return fabs(x) < 20 && fabs(y) < 20 ? NAN : 10;
}

static void holes_let_rays_through(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_heightfield *map = make_map(context, 65, 4, with_hole);
    assert_true(map->holes > 0);
    ground g = make_ground(context, map);
    for (int x = -120; x <= 120; x += 3) {
        vd_ray ray = {{x + 0.1, 0.2, 50}, {0, 0, -1}};
        meeting hit;
        const bool got = cast(&g, &ray, 0, &hit);
        assert_int_equal(got, fabs(x + 0.1) > 20);
    }
    vd_lens_map_finish(&g.map);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

static void shadows_end_where_the_sun_says(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_heightfield *map = make_map(context, 401, 1, step); /* a cliff of 40 m at x = 0, high east */
    vd_terrain_def def = vd_terrain_def_default();
    def.samples = 1;
    def.light = vd_light_daylight(vd_radians(90), vd_radians(45)); /* sun in the east, 45° */
    vd_camera camera = make_camera(-40, 0, 150, 0, -90, 0);
    vd_frame *lit = render(context, map, &camera, def, NULL);
    def.shadows = false;
    vd_frame *plain = render(context, map, &camera, def, NULL);
    int dark = 0, bright = 0;
    for (int y = 0; y < H; y++) {
        for (int x = 0; x < W; x++) {
            const size_t at = (size_t)y * lit->stride + (size_t)x;
            vd_ray ray = vd_camera_ray(&camera, x + 0.5, y + 0.5);
            const double px = -40 - 150 / ray.direction.z * ray.direction.x;
            const bool darker = lit->rgba[4 * at] + 20 < plain->rgba[4 * at];
            if (px > -28 && px < -2) { /* as long as the cliff is high, fading towards its tip */
                assert_true(darker);
                dark++;
            } else if (px < -41) {
                assert_false(darker);
                bright++;
            }
        }
    }
    assert_true(dark > 100 && bright > 100);
    vd_frame_destroy(&lit);
    vd_frame_destroy(&plain);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

/* One picture, everything on; its bytes must never depend on threads or SIMD level. */
static void pictures_are_golden(void **state) {
    (void)state;
    const uint64_t golden[3] = {0xac7a3298a3258667u, 0xb665ff5f5bd169cdu, 0xcb189420424291efu};
    const int samples[3] = {1, 4, 8}, threads[3] = {1, 2, 7};
    for (int s = 0; s < 3; s++) {
        for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
            for (int t = 0; t < 3; t++) {
                vd_context *context = test_context(threads[t], (vd_isa)isa);
                vd_heightfield *map = make_map(context, 65, 4, rough);
                vd_terrain_def def = vd_terrain_def_default();
                vd_colormap colormap;
                assert_true(vd_colormap_find("viridis", &colormap));
                def.colormap = &colormap;
                def.samples = samples[s];
                def.curvature = true;
                def.light.haze_m = 500;
                vd_camera camera = make_camera(-130, -150, 90, 35, -25, 5);
                def.method = (vd_terrain_method)(t % VD_TERRAIN_METHOD_COUNT);
                vd_frame *frame = render(context, map, &camera, def, NULL);
                const uint64_t hash = vd_frame_hash(frame);
                if (hash != golden[s]) {
                    fail_msg("%d samples, %s, %d threads: hash %016llx, not %016llx", samples[s],
                             vd_isa_name((vd_isa)isa), threads[t], (unsigned long long)hash,
                             (unsigned long long)golden[s]);
                }
                vd_frame_destroy(&frame);
                vd_heightfield_destroy(context, &map);
                vd_context_destroy(&context);
            }
        }
    }
}

static void bad_definitions_are_named(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_heightfield *map = make_map(context, 9, 1, flat);
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, W, H, 0, &frame));
    const vd_camera camera = make_camera(0, 0, 10, 0, -90, 0);
    for (int i = 0; i < 6; i++) {
        vd_terrain_def def = vd_terrain_def_default();
        def.heightfield = map;
        const char *name = "";
        vd_camera used = camera;
        switch (i) {
        case 0:
            def.heightfield = NULL, name = "heightfield";
            break;
        case 1:
            def.samples = 3, name = "samples";
            break;
        case 2:
            def.exaggeration = NAN, name = "exaggeration";
            break;
        case 3:
            def.method = (vd_terrain_method)9, name = "method";
            break;
        case 4:
            def.light.haze_m = -1, name = "haze";
            break;
        default:
            used.eye.x = INFINITY, name = "eye x";
            break;
        }
        vd_status status = vd_terrain_render(context, NULL, &def, &used, frame, NULL);
        assert_int_equal(status.code, VD_ERROR_ARGUMENT);
        assert_non_null(strstr(status.message, name));
    }
    vd_frame_destroy(&frame);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

static vd_camera near_at(vd_camera camera, double near_m) {
    camera.near_m = near_m;
    return camera;
}

static void empty_pictures_are_explained(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const struct {
        height_function *ground;
        vd_camera camera;
        const char *word;
    } cases[] = {{cone, make_camera(0, 0, 10, 0, 0, 0), "under ground"},
                 {flat, near_at(make_camera(0, 0, 100, 0, -90, 0), 1e9), "near plane, 1000000000"},
                 {cone, make_camera(1e300, 0, 100, 90, 0, 0), "1e+300"},
                 {cone, make_camera(0, 0, 100, 0, 90, 0), "looks away"},
                 {cone, make_camera(-1000, 0, 10, 270, 0, 0), "looks away"},
                 {flat, make_camera(-1000, 0, -100, 90, 5, 0), "raise it"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        vd_heightfield *map = make_map(context, 65, 4, cases[i].ground);
        vd_terrain_def def = vd_terrain_def_default();
        vd_frame_stats stats;
        vd_frame *frame = render(context, map, &cases[i].camera, def, &stats);
        assert_int_equal(stats.hits, 0);
        def.heightfield = map;
        vd_status status = vd_terrain_explain_empty(&def, &cases[i].camera, W, H);
        assert_int_equal(status.code, VD_ERROR_EMPTY);
        if (strstr(status.message, cases[i].word) == NULL) {
            fail_msg("case %zu says: %s", i, status.message);
        }
        vd_frame_destroy(&frame);
        vd_heightfield_destroy(context, &map);
    }
    vd_context_destroy(&context);
}

static void warm_frames_release_all_and_failures_leave_nothing(void **state) {
    (void)state;
    for (int n = 1; n < 100; n++) {
        test_allocator allocator = {0, 0, 0};
        vd_context *context = test_failing_context(&allocator);
        vd_heightfield *map = make_map(context, 9, 1, flat);
        vd_frame *frame = NULL;
        assert_ok(vd_frame_create(context, W, H, 0, &frame));
        vd_terrain_def def = vd_terrain_def_default();
        def.heightfield = map;
        const vd_camera camera = make_camera(0, 0, 10, 0, -90, 0);
        const int live = allocator.live;
        allocator.fail_at = allocator.calls + n;
        vd_status status = vd_terrain_render(context, NULL, &def, &camera, frame, NULL);
        assert_int_equal(allocator.live, live);
        allocator.fail_at = 0;
        vd_frame_destroy(&frame);
        vd_heightfield_destroy(context, &map);
        vd_context_destroy(&context);
        assert_int_equal(allocator.live, 0);
        if (status.code == VD_OK) {
            assert_true(n > 3);
            return;
        }
        assert_int_equal(status.code, VD_ERROR_MEMORY);
    }
    fail_msg("rendering never succeeded");
}

static void cancelled_renders_say_so(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_heightfield *map = make_map(context, 65, 4, rough);
    vd_job *job = NULL;
    assert_ok(vd_job_create(context, &job));
    vd_job_cancel(job);
    vd_terrain_def def = vd_terrain_def_default();
    def.heightfield = map;
    const vd_camera camera = make_camera(0, 0, 100, 0, -90, 0);
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, W, H, 0, &frame));
    assert_int_equal(vd_terrain_render(context, job, &def, &camera, frame, NULL).code,
                     VD_ERROR_CANCELLED);
    double seconds = -1;
    size_t bytes = 0;
    assert_ok(vd_terrain_estimate(context, NULL, &def, &camera, W, H, &seconds, &bytes));
    assert_true(seconds > 0 && bytes > 0);
    vd_job_destroy(&job);
    vd_frame_destroy(&frame);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_plane_is_hit_where_algebra_says),
        cmocka_unit_test(rough_ground_agrees_with_tiny_steps),
        cmocka_unit_test(silhouettes_fall_where_projected),
        cmocka_unit_test(depth_and_id_are_those_of_the_surface),
        cmocka_unit_test(curvature_drops_far_ground),
        cmocka_unit_test(rays_under_the_surface_see_nothing),
        cmocka_unit_test(holes_let_rays_through),
        cmocka_unit_test(shadows_end_where_the_sun_says),
        cmocka_unit_test(pictures_are_golden),
        cmocka_unit_test(bad_definitions_are_named),
        cmocka_unit_test(empty_pictures_are_explained),
        cmocka_unit_test(warm_frames_release_all_and_failures_leave_nothing),
        cmocka_unit_test(cancelled_renders_say_so),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
