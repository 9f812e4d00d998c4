/* What of a world by impostors is on the screen, thing by thing: each glows in a colour of its own,
 * all else is black, so that a pixel of one thing alone says which, as the id plane of a picture
 * does that is drawn directly. */
#include "impostor_scenes.h"
#include "world/object_kinds.h"

enum { WIDE = 320, HIGH = 240, THINGS = 24 };

/* How far a colour may be from a thing's. */
#define NEAR_COLOR 4.0

/* Texture filters and smooth edges reach so many pixels. */
#define REACH_PX 2.0

typedef struct stage {
    scene s;
    double colors[THINGS][3]; /* as encoded, 0 … 255 */
    vd_frame *frame, *direct;
    int *thing_of; /* of each pixel of the direct picture; −1: none */
    uint64_t checked, seen, pixels;
} stage;

static double between(uint64_t *random, double low, double high) {
    return low + (high - low) * test_uniform(random);
}

static double apart(const double a[3], const double b[3]) {
    const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return sqrt(x * x + y * y + z * z);
}

/* Colours on an eighth of a sphere, far from each other: a mixture of some lies within the sphere
 * and is like none, and so is one that is half transparent. */
static void choose_colors(double colors[THINGS][3]) {
    uint64_t random = 3;
    for (int i = 0; i < THINGS; i++) {
        double best = -1.0;
        for (int tries = 0; tries < 2000; tries++) {
            double c[3], length = 0.0, nearest = 1e9;
            for (int k = 0; k < 3; k++) {
                c[k] = test_uniform(&random);
                length += c[k] * c[k];
            }
            for (int k = 0; k < 3; k++) {
                c[k] = floor(255.0 * c[k] / sqrt(length) + 0.5);
            }
            for (int j = 0; j < i; j++) {
                nearest = fmin(nearest, apart(c, colors[j]));
            }
            if (nearest > best) {
                best = nearest;
                memcpy(colors[i], c, sizeof c);
            }
        }
        assert_true(i == 0 || best > 40.0);
    }
}

static vd_model *glowing_box(vd_context *context, const double color[3]) {
    static double positions[8][3];
    static const uint32_t triangles[12][3] = {{0, 1, 3}, {0, 3, 2}, {4, 7, 5}, {4, 6, 7},
                                              {0, 5, 1}, {0, 4, 5}, {2, 3, 7}, {2, 7, 6},
                                              {0, 2, 6}, {0, 6, 4}, {1, 5, 7}, {1, 7, 3}};
    for (int i = 0; i < 8; i++) {
        positions[i][0] = (i & 1) != 0 ? 5.0 : -5.0;
        positions[i][1] = (i & 2) != 0 ? 4.0 : -4.0;
        positions[i][2] = (i & 4) != 0 ? 14.0 : 0.0;
    }
    vd_material glow = vd_material_default();
    glow.specular = (vd_linear){0, 0, 0};
    glow.emission =
        (vd_linear){vd_srgb_decode((uint8_t)color[0]), vd_srgb_decode((uint8_t)color[1]),
                    vd_srgb_decode((uint8_t)color[2])};
    const vd_model_surface surface = {.texture = -1};
    const vd_model_source source = {.name = "box",
                                    .format = "test",
                                    .vertex_count = 8,
                                    .positions = (const double(*)[3])positions,
                                    .triangle_count = 12,
                                    .triangles = triangles,
                                    .material_count = 1,
                                    .materials = &glow,
                                    .surfaces = &surface};
    vd_model *model = NULL;
    assert_ok(vd_model_create(context, &source, &model));
    return model;
}

/* Boxes on hills, or in the air; night, but for what glows. */
static void begin_stage(stage *p, bool ground, const vd_impostor_def *def) {
    const vd_vec3 middle = {0, 0, 0};
    uint64_t random = 12;
    *p = (stage){.s = {.context = test_context(2, VD_ISA_AUTO)}};
    scene *s = &p->s;
    choose_colors(p->colors);
    vd_world_def world = vd_world_def_default();
    const vd_linear black = {0, 0, 0};
    vd_light *light = &world.terrain.light;
    s->map = hills(s->context, middle);
    world.terrain.heightfield = ground ? s->map : NULL;
    world.terrain.sky = false;
    world.terrain.background = (vd_rgba8){0, 0, 0, 255};
    light->sun = light->ambient_up = light->ambient_down = black;
    light->haze_m = 0.0;
    assert_ok(vd_world_create(s->context, &world, &s->world));
    for (int i = 0; i < THINGS; i++) {
        vd_model *model = glowing_box(s->context, p->colors[i]);
        vd_instance_def instance = {.model = 0};
        vd_object *object = NULL;
        vd_model_bounds(model, &instance.min, &instance.max);
        assert_ok(vd_world_add_model(s->world, &model, &instance.model));
        assert_int_equal(instance.model, i);
        const double x = between(&random, -300, 300), y = between(&random, -300, 300);
        const double z =
            ground ? vd_world_ground(s->world, x, y) - 1.0 : between(&random, -30.0, 30.0);
        instance.transform = vd_matrix_translation(vd_vec3_make(floor(x), floor(y), floor(z)));
        assert_ok(vd_instance_create(s->context, &instance, &object));
        assert_ok(vd_world_add(s->world, &object));
    }
    assert_ok(vd_world_arrange(s->world, NULL));
    assert_ok(vd_world_renderer_create(s->context, NULL, s->world, NULL, &s->renderer));
    assert_ok(vd_impostors_create(s->context, s->world, s->renderer, def, &s->set));
    assert_ok(vd_frame_create(s->context, WIDE, HIGH, VD_PLANE_DEPTH, &p->frame));
    assert_ok(vd_frame_create(s->context, WIDE, HIGH, VD_PLANE_ID, &p->direct));
    p->thing_of = malloc((size_t)WIDE * HIGH * sizeof *p->thing_of);
    assert_non_null(p->thing_of);
}

static void end_stage(stage *p) {
    free(p->thing_of);
    vd_frame_destroy(&p->frame);
    vd_frame_destroy(&p->direct);
    end(&p->s);
}

/* ---- what is where ----------------------------------------------------------------------------*/

static void find_things(stage *p) {
    for (int y = 0; y < HIGH; y++) {
        for (int x = 0; x < WIDE; x++) {
            const uint32_t id = p->direct->id[(size_t)y * p->direct->stride + (size_t)x];
            const vd_object *object =
                id != 0 ? vd_world_find(p->s.world, p->direct->object_ids[id]) : NULL;
            p->thing_of[y * WIDE + x] = object != NULL && object->kind == VD_OBJECT_INSTANCE
                                            ? (int)((const vd_instance *)object)->model
                                            : -1;
        }
    }
}

/* The thing whose colour a pixel has; −1: none, or several. */
static int color_at(const stage *p, const vd_frame *frame, int x, int y) {
    const uint8_t *rgba = frame->rgba + 4 * ((size_t)y * frame->stride + (size_t)x);
    const double c[3] = {rgba[0], rgba[1], rgba[2]};
    for (int i = 0; i < THINGS; i++) {
        if (apart(c, p->colors[i]) <= NEAR_COLOR) {
            return i;
        }
    }
    return -1;
}

/* Whether a thing is in the direct picture, no farther than that from a pixel. */
static bool is_near(const stage *p, int thing, int x, int y, double reach) {
    const int r = (int)ceil(reach);
    if (x < r || y < r || x + r >= WIDE || y + r >= HIGH) {
        return true; /* or beyond the edge */
    }
    for (int v = y - r; v <= y + r; v++) {
        for (int u = x - r; u <= x + r; u++) {
            if (p->thing_of[v * WIDE + u] == thing) {
                return true;
            }
        }
    }
    return false;
}

/* Whether a thing has a pixel and all around it for itself, and what may be shown there instead,
 * up to so many pixels away, is nothing else that glows. */
static bool is_inside(const stage *p, int x, int y, double reach) {
    const int r = (int)ceil(reach), thing = p->thing_of[y * WIDE + x];
    if (thing < 0 || x < r || y < r || x + r >= WIDE || y + r >= HIGH) {
        return false;
    }
    for (int v = -r; v <= r; v++) {
        for (int u = -r; u <= r; u++) {
            const int other = p->thing_of[(y + v) * WIDE + x + u];
            const bool beside = abs(u) <= 1 && abs(v) <= 1;
            if (other != thing && (beside || other >= 0)) {
                return false;
            }
        }
    }
    return true;
}

/* The thing whose colour a pixel has, or on its edge a shade of; −1: none. A shade of several may
 * be like that of another. */
static int shade_at(const stage *p, const vd_frame *frame, int x, int y) {
    const uint8_t *rgba = frame->rgba + 4 * ((size_t)y * frame->stride + (size_t)x);
    double c[3] = {rgba[0], rgba[1], rgba[2]};
    static const double black[3] = {0, 0, 0};
    const double length = apart(c, black);
    int best = -1;
    double least = 20.0;
    for (int k = 0; k < 3 && length > 80.0; k++) {
        c[k] *= 255.0 / length;
    }
    for (int i = 0; i < THINGS && length > 80.0; i++) {
        const double off = apart(c, p->colors[i]);
        best = off < least ? i : best;
        least = off < least ? off : least;
    }
    return best;
}

/* Every thing of which enough is to be seen is on the screen, and none where it is not. What the
 * impostors may be wrong by is `slack` pixels. */
static void check_screen(stage *p, const vd_camera *camera, double slack, int step_number) {
    enum { ENOUGH = 12 };
    int inside[THINGS] = {0}, shown[THINGS] = {0};
    const double reach = slack + REACH_PX;
    assert_ok(vd_world_renderer_draw(p->s.renderer, NULL, camera, p->direct, NULL));
    assert_ok(vd_impostors_draw(p->s.set, NULL, camera, p->frame, NULL));
    find_things(p);
    for (int y = 0; y < HIGH; y++) {
        for (int x = 0; x < WIDE; x++) {
            if (is_inside(p, x, y, reach)) {
                const int thing = p->thing_of[y * WIDE + x];
                assert_int_equal(color_at(p, p->direct, x, y), thing); /* colours are ids */
                inside[thing]++;
            }
            const int shade = shade_at(p, p->frame, x, y), is = color_at(p, p->frame, x, y);
            if (shade >= 0) {
                shown[shade]++;
            }
            if (is < 0) {
                continue;
            }
            p->pixels++;
            if (!is_near(p, is, x, y, reach)) {
                fail_msg("step %d: thing %d at (%d, %d), where it is not; wrong by %g pixels",
                         step_number, is, x, y, slack);
            }
        }
    }
    for (int i = 0; i < THINGS; i++) {
        p->seen += inside[i] >= ENOUGH;
        if (inside[i] >= ENOUGH && 4 * shown[i] < inside[i]) {
            fail_msg("step %d: of thing %d %d pixels are shown, and %d are inside of it; %g pixels",
                     step_number, i, shown[i], inside[i], slack);
        }
    }
    p->checked++;
}

/* ---- flights ----------------------------------------------------------------------------------*/

typedef struct flight {
    vd_camera camera;
    vd_vec3 velocity; /* metres an update */
    double heading, turn;
    uint64_t random;
} flight;

static flight take_off(uint64_t seed) {
    flight f = {.camera = looking(vd_vec3_make(0, 0, 0)), .random = seed};
    f.camera.lens = vd_lens_from_fov(0.9, WIDE, HIGH);
    return f;
}

/* Another way every 40 updates; somewhere else at once every 200, looking at the middle. */
static void fly_on(flight *f, int number) {
    vd_vec3 *eye = &f->camera.eye;
    if (number % 40 == 0) {
        const double speed = exp(between(&f->random, -4.0, 0.0));
        const double way = between(&f->random, 0.0, 6.3);
        f->velocity = vd_vec3_make(speed * cos(way), speed * sin(way), 0.1 * speed * cos(5 * way));
        f->turn = between(&f->random, -0.01, 0.01);
    }
    if (number % 200 == 0) {
        const double angle = between(&f->random, 0.0, 6.3), away = between(&f->random, 200, 450);
        *eye = vd_vec3_make(-away * sin(angle), -away * cos(angle), between(&f->random, 70, 200));
        f->heading = angle;
    }
    *eye = vd_vec3_add(*eye, f->velocity);
    eye->z = eye->z < 60.0 ? 60.0 : eye->z;
    f->heading += f->turn;
    f->camera.orientation = vd_orientation_from_angles(f->heading, -0.3, 0.0);
}

static vd_impostor_stats step_stage(stage *p, const vd_camera *camera) {
    vd_impostor_stats stats;
    p->s.time_s += 1.0 / 60;
    assert_ok(vd_impostors_update(p->s.set, NULL, camera, WIDE, HIGH, p->s.time_s, &stats));
    return stats;
}

static vd_impostor_def exact(void) {
    vd_impostor_def def = vd_impostor_def_default();
    def.settle = false;
    def.least_reuse = 2.0;
    def.budget_s = 1e9;
    def.budget_pixels = (size_t)1 << 30; /* what is drawn itself is as fine as the screen */
    return def;
}

/* Groups split and merge; pictures come one or a few an update, and go for want of memory. */
static void things_are_on_screen_while_pictures_come(void **state) {
    (void)state;
    for (int ground = 0; ground < 2; ground++) {
        vd_impostor_def def = exact();
        def.most_direct = 0;
        def.budget_pixels = ground == 1 ? 8000 : 1;
        def.memory_bytes = (size_t)1 << 20;
        stage p;
        begin_stage(&p, ground == 1, &def);
        flight f = take_off(5);
        uint64_t drawn = 0, shown = 0, direct = 0;
        const int updates = test_is_reduced() ? 240 : 4000;
        for (int i = 0; i < updates; i++) {
            fly_on(&f, i);
            const vd_impostor_stats stats = step_stage(&p, &f.camera);
            drawn += stats.drawn;
            shown += stats.shown;
            direct += stats.direct;
            /* One picture an update is too few after jumps and on some ways: what is shown then may
             * be wrong by as much as a thing is large. */
            if (i % 5 == 0 && stats.error_px < 2.0) {
                check_screen(&p, &f.camera, fmax(stats.error_px, def.tolerance_px), i);
            }
        }
        print_message("%s: %llu pictures checked of %d, %llu things seen, %llu pixels; %llu drawn, "
                      "%llu shown, %llu direct\n",
                      ground == 1 ? "hills" : "air", (unsigned long long)p.checked, updates / 5,
                      (unsigned long long)p.seen, (unsigned long long)p.pixels,
                      (unsigned long long)drawn, (unsigned long long)shown,
                      (unsigned long long)direct);
        assert_true(p.checked * 50 > (uint64_t)updates && p.seen > p.checked);
        assert_true(drawn > 30 && shown > drawn && direct > 0);
        end_stage(&p);
    }
}

/* With as many things drawn themselves for want of pictures as usual, once the pictures are there:
 * wherever the camera is put, and on its way from there. */
static void things_are_on_screen_when_pictures_are_there(void **state) {
    (void)state;
    static const double tolerances[] = {0.5, 1.0, 3.0};
    for (int kind = 0; kind < 6; kind++) {
        vd_impostor_def def = exact();
        def.tolerance_px = tolerances[kind / 2];
        stage p;
        begin_stage(&p, kind % 2 == 1, &def);
        flight f = take_off(17 + (uint64_t)kind);
        for (int i = 0; i < (test_is_reduced() ? 80 : 1000); i++) {
            fly_on(&f, i);
            vd_impostor_stats stats = step_stage(&p, &f.camera);
            for (int k = 0; k < 20 && i % 40 == 0 && stats.drawn + stats.waiting > 0; k++) {
                stats = step_stage(&p, &f.camera);
            }
            if (i % 8 == 0) {
                assert_true(stats.error_px <= 4.0 * def.tolerance_px);
                check_screen(&p, &f.camera, fmax(stats.error_px, def.tolerance_px), i);
            }
        }
        assert_true(p.seen > 2 * p.checked);
        end_stage(&p);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(things_are_on_screen_while_pictures_come),
        cmocka_unit_test(things_are_on_screen_when_pictures_are_there),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
