/* bench_scene.c: pictures that `veduta bench` draws: classic ones and through a lens. */
#include "bench.h"
#include "render_settings.h"

#include <string.h>

void bench_scene_finish(bench_scene *s) {
    if (s->context != NULL) {
        vd_classic_renderer_destroy(&s->renderer);
        vd_terrain_renderer_destroy(&s->terrain_renderer);
        vd_frame_destroy(&s->frame);
        vd_function_destroy(s->context, &s->function);
        vd_heightfield_destroy(s->context, &s->map);
        vd_context_destroy(&s->context);
    }
}

vd_status bench_scene_init(bench_scene *s, const bench_run *run, bench_map_kind kind, int map_side,
                           vd_isa isa, int threads, int width, int height) {
    memset(s, 0, sizeof *s);
    vd_context_def def = vd_context_def_default();
    def.threads = threads;
    def.isa = isa;
    vd_status status = vd_context_create(&def, &s->context);
    if (status.code == VD_OK) {
        status = bench_map_create(s->context, run->map, kind, map_side, map_side, &s->map);
    }
    if (status.code == VD_OK) {
        status = vd_frame_create(s->context, width, height, 0, &s->frame);
    }
    if (status.code != VD_OK) {
        bench_scene_finish(s);
        return status;
    }
    s->classic = vd_classic_def_default();
    s->terrain = vd_terrain_def_default();
    s->terrain.heightfield = s->map;
    return status;
}

vd_status bench_picture(bench_run *run, bench_scene *s, bench_work *work, bench_result *result) {
    bool serial = work == bench_draw_classic && s->method == VD_CLASSIC_REFERENCE;
    result->threads = serial ? 1 : vd_context_threads(s->context);
    result->isa = vd_context_isa(s->context);
    result->width = s->frame->width;
    result->height = s->frame->height;
    vd_context_memory_reset_peak(s->context);
    vd_status status = bench_measure(run, work, s, bench_wall_ms, result);
    if (status.code != VD_OK) {
        return status;
    }
    result->peak_bytes = vd_context_memory(s->context).bytes_peak;
    result->has_hash = true;
    result->hash = vd_frame_hash(s->frame);
    return bench_add(run, result);
}

vd_status bench_draw_classic(void *user) {
    bench_scene *s = user;
    if (s->method == VD_CLASSIC_MARCH) {
        return vd_classic_renderer_draw(s->renderer, NULL, &s->classic, s->frame);
    }
    return vd_classic_render(s->context, NULL, s->map, &s->classic, s->method, s->frame, NULL);
}

vd_status bench_draw_terrain(void *user) {
    bench_scene *s = user;
    vd_status status = vd_success();
    if (s->terrain_renderer == NULL) {
        status = vd_terrain_renderer_create(s->context, NULL, &s->terrain, &s->terrain_renderer);
    }
    return status.code == VD_OK
               ? vd_terrain_renderer_draw(s->terrain_renderer, NULL, &s->camera, s->frame, NULL)
               : status;
}

/* ---- classic ----------------------------------------------------------------------------------*/

vd_status bench_classic_method(bench_run *run, bench_scene *s, vd_classic_method method,
                               bench_result *result) {
    vd_status status = vd_success();
    s->method = method;
    if (method == VD_CLASSIC_MARCH && s->renderer == NULL) {
        status = vd_classic_renderer_create(s->context, s->map, &s->renderer);
    }
    result->reference = method == VD_CLASSIC_REFERENCE;
    result->same_picture = true;
    return status.code == VD_OK ? bench_picture(run, s, bench_draw_classic, result) : status;
}

/* The same view with the lens renderer: plain colours, one sample, as the classic picture has it.
 * Another picture, since its surface is bilinear, has no slices and ends at the map's edge. */
static vd_status measure_raycast(bench_run *run, const bench_case *self, vd_isa isa, int threads) {
    bench_scene s;
    vd_status status = bench_scene_init(&s, run, BENCH_MAP_FLOAT, self->map_side, isa, threads,
                                        self->width, self->rows);
    if (status.code != VD_OK) {
        return status;
    }
    s.camera = vd_classic_camera(&s.classic, s.frame->width, s.frame->height);
    s.terrain.method = VD_TERRAIN_RAYCAST;
    s.terrain.filter = VD_FILTER_NEAREST;
    s.terrain.samples = 1;
    s.terrain.shading = false;
    s.terrain.shadows = false;
    s.terrain.sky = false;
    s.terrain.background = s.classic.background;
    bench_result result = bench_result_of(self, "raycast");
    status = bench_picture(run, &s, bench_draw_terrain, &result);
    bench_scene_finish(&s);
    return status;
}

static void set_classic_view(const bench_case *self, vd_classic_def *def) {
    def->height = self->eye;
    def->filter = self->bilinear ? VD_FILTER_LINEAR : VD_FILTER_NEAREST;
    if (self->growth > 0) {
        def->step = 1;
        def->growth = self->growth;
        def->distance = 800;
    }
}

/* The reference (it is serial) with the first number of threads, and the case's methods. */
static vd_status measure_classic(bench_run *run, const bench_case *self, vd_isa isa, int threads,
                                 bool with_reference) {
    bench_scene s;
    vd_status status = bench_scene_init(&s, run, BENCH_MAP_CLASSIC, self->map_side, isa, threads,
                                        self->width, self->rows);
    if (status.code != VD_OK) {
        return status;
    }
    set_classic_view(self, &s.classic);
    for (int m = 0; m < (int)VD_CLASSIC_METHOD_COUNT && status.code == VD_OK; m++) {
        if (m == VD_CLASSIC_REFERENCE ? with_reference : (self->methods >> m & 1) != 0) {
            vd_classic_method method = (vd_classic_method)m;
            bench_result result = bench_result_of(self, vd_classic_method_name(method));
            if (method == VD_CLASSIC_MARCH) {
                result.target_fps = bench_target_fps(self, vd_context_isa(s.context), threads);
            }
            status = bench_classic_method(run, &s, method, &result);
        }
    }
    bench_scene_finish(&s);
    return status;
}

/* Over a map of another size, the same method on the map as it comes: what the size alone costs. */
static vd_status measure_own_size(bench_run *run, const bench_case *self, vd_isa isa) {
    bench_scene s;
    vd_status status =
        bench_scene_init(&s, run, BENCH_MAP_CLASSIC, 0, isa, run->threads[run->thread_count - 1],
                         self->width, self->rows);
    if (status.code != VD_OK) {
        return status;
    }
    set_classic_view(self, &s.classic);
    bench_result result = bench_result_of(self, "march");
    snprintf(result.note, sizeof result.note, "map of %dx%d", s.map->width, s.map->height);
    status = bench_classic_method(run, &s, VD_CLASSIC_MARCH, &result);
    bench_scene_finish(&s);
    return status;
}

vd_status bench_classic(bench_run *run, const bench_case *self) {
    vd_status status = bench_add_published(run, self);
    for (int i = 0; i < run->isa_count && status.code == VD_OK; i++) {
        for (int t = 0; t < run->thread_count && status.code == VD_OK; t++) {
            status = measure_classic(run, self, run->isas[i], run->threads[t], t == 0);
            if (status.code == VD_OK && (self->methods >> VD_CLASSIC_SLICES & 1) != 0 &&
                self->growth == 0) {
                status = measure_raycast(run, self, run->isas[i], run->threads[t]);
            }
        }
        if (status.code == VD_OK && self->map_side > 0) {
            status = measure_own_size(run, self, run->isas[i]);
        }
    }
    return status;
}

/* ---- lens -------------------------------------------------------------------------------------*/

void bench_set_camera(bench_scene *s, const bench_camera *camera) {
    s->camera.eye = vd_vec3_make(camera->x, camera->y, camera->z);
    s->camera.orientation = vd_orientation_from_angles(camera->heading * VD_RADIANS_PER_DEGREE,
                                                       camera->pitch * VD_RADIANS_PER_DEGREE, 0.0);
    s->camera.projection = VD_PROJECTION_PERSPECTIVE;
    s->camera.lens =
        vd_lens_from_fov(camera->fov_y * VD_RADIANS_PER_DEGREE, s->frame->width, s->frame->height);
    s->camera.near_m = 1.0;
}

void bench_set_lens_view(bench_scene *s) {
    /* From above the southern half of the map, northwards and a little down. */
    static const bench_camera camera = {512, -900, 180, 0, -18, 50};
    bench_set_camera(s, &camera);
    s->terrain.samples = 1;
}

void bench_set_everything(bench_scene *s) {
    if (vd_colormap_find("terrain", &s->colormap)) {
        s->terrain.colormap = &s->colormap;
    }
    s->terrain.light = vd_light_daylight(250 * VD_RADIANS_PER_DEGREE, 30 * VD_RADIANS_PER_DEGREE);
    s->terrain.light.haze_m = 90e3;
    s->terrain.mip = true;
    s->terrain.samples = 4;
    s->terrain.curvature = true;
}

/* One scene by both methods, the plain ray caster first and only with the first number of threads,
 * since it takes seconds a picture. */
static vd_status measure_lens(bench_run *run, const bench_case *self, vd_isa isa, int t) {
    bench_scene s;
    bool views = self->camera != NULL;
    vd_status status =
        bench_scene_init(&s, run, views ? BENCH_MAP_METRES : BENCH_MAP_FLOAT, self->map_side, isa,
                         run->threads[t], self->width, self->rows);
    if (status.code != VD_OK) {
        return status;
    }
    if (views) {
        bench_set_camera(&s, self->camera);
        bench_set_everything(&s);
    } else {
        bench_set_lens_view(&s);
    }
    for (int m = VD_TERRAIN_METHOD_COUNT - 1; m >= 0 && status.code == VD_OK; m--) {
        s.terrain.method = (vd_terrain_method)m;
        vd_terrain_renderer_destroy(&s.terrain_renderer);
        bool raycast = m == VD_TERRAIN_RAYCAST;
        if (raycast && (t > 0 || (views && self->width > 1920))) {
            continue;
        }
        bench_result result = bench_result_of(self, vd_terrain_method_name(s.terrain.method));
        result.reference = raycast;
        result.same_picture = true;
        if (m == VD_TERRAIN_MARCH) {
            result.target_fps = bench_target_fps(self, vd_context_isa(s.context), run->threads[t]);
        }
        status = bench_picture(run, &s, bench_draw_terrain, &result);
    }
    bench_scene_finish(&s);
    return status;
}

vd_status bench_lens(bench_run *run, const bench_case *self) {
    vd_status status = vd_success();
    for (int i = 0; i < run->isa_count && status.code == VD_OK; i++) {
        for (int t = 0; t < run->thread_count && status.code == VD_OK; t++) {
            status = measure_lens(run, self, run->isas[i], t);
        }
    }
    return status;
}

/* ---- formulas without end ---------------------------------------------------------------------*/

/* A formula, and how high the eye is that looks over it. */
typedef struct formula_view {
    const char *method, *text;
    double eye_m;
} formula_view;

static vd_status measure_endless(bench_run *run, const bench_case *self, const formula_view *view,
                                 vd_isa isa, int threads) {
    bench_scene s;
    vd_status status =
        bench_scene_init(&s, run, BENCH_MAP_FLOAT, 0, isa, threads, self->width, self->rows);
    if (status.code != VD_OK) {
        return status;
    }
    const bench_camera camera = {0, -1000, view->eye_m, 0, -10, 40};
    bench_set_camera(&s, &camera);
    bench_set_everything(&s);
    s.terrain.light.haze_m = 46e3; /* 7 of these are drawn: 322 km */
    s.terrain.curvature = false;
    s.terrain.heightfield = NULL;
    status = vd_function_compile(s.context, view->text, &s.function);
    if (status.code == VD_OK) {
        bench_result result = bench_result_of(self, view->method);
        s.terrain.function = s.function;
        status = bench_picture(run, &s, bench_draw_terrain, &result);
    }
    bench_scene_finish(&s);
    return status;
}

vd_status bench_endless(bench_run *run, const bench_case *self) {
    static const formula_view views[] = {
        {"thesis-rgb", "h=60*cos(x/40)*sin(y/40); rgb=hsv(h/120,0.6,1)", 300},
        {"ridged-10", "h=900*ridged(x/4000,y/4000,10)^1.5", 2500},
        {"islands", "n=120*fbm(x/400,y/400,8); h=max(n,0); rgb=n<0?rgb(.1,.3,.6):rgb(.3,.5,.2)",
         300},
    };
    vd_status status = vd_success();
    for (int i = 0; i < run->isa_count && status.code == VD_OK; i++) {
        for (int t = 0; t < run->thread_count && status.code == VD_OK; t++) {
            for (size_t v = 0; v < sizeof views / sizeof views[0] && status.code == VD_OK; v++) {
                status = measure_endless(run, self, &views[v], run->isas[i], run->threads[t]);
            }
        }
    }
    return status;
}
