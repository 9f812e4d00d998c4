/* particles.c: synthetic snapshots.
 *
 * Particle i is a function of the seed and i alone: all threads make particles at once, and after
 * the Morton keys are sorted the particles are made a second time, into their places, instead of
 * being moved there. No libm: the same particles on every machine.
 */
#include <math.h>
#include <string.h>
#include <veduta/particles.h>
#include "core/core.h"

#define KNOTS 64
#define FILAMENTS (KNOTS * 2)
#define PARTICLES_A_TASK 65536

/* Of 100 particles so many are in spheres and in filaments; the rest is everywhere. */
#define SPHERE_SHARE 0.6
#define FILAMENT_SHARE 0.3

typedef struct knot {
    double at[3];
    double share; /* of the spheres' particles in this knot and those before */
    double a;     /* Plummer radius */
} knot;

typedef struct web {
    uint64_t seed;
    size_t count;
    knot knots[KNOTS];
    int filaments[FILAMENTS][2]; /* knots */
} web;

typedef struct particle {
    float at[3];
    float radius, speed;
    uint8_t class;
} particle;

/* SplitMix64 (Steele, Lea & Flood 2014). */
static uint64_t next_bits(uint64_t *state) {
    uint64_t z = (*state += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

/* In [0, 1). */
static double uniform(uint64_t *state) {
    return (double)(next_bits(state) >> 11) * 0x1p-53;
}

/* About normal, of deviation 1: the sum of three uniform numbers. */
static double spread(uint64_t *state) {
    const double sum = uniform(state) + uniform(state) + uniform(state);
    return 2.0 * (sum - 1.5);
}

/* ---- the web ----------------------------------------------------------------------------------*/

static double square_distance(const double a[3], const double b[3]) {
    const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return (x * x + y * y) + z * z;
}

/* The knots nearest to knot k, nearest first. */
static void find_nearest(const knot *knots, int k, int nearest[2]) {
    double best[2] = {INFINITY, INFINITY};
    nearest[0] = nearest[1] = k;
    for (int i = 0; i < KNOTS; i++) {
        const double d = square_distance(knots[i].at, knots[k].at);
        if (i == k || d >= best[1]) {
            continue;
        }
        const int place = d < best[0] ? 0 : 1;
        if (place == 0) {
            best[1] = best[0];
            nearest[1] = nearest[0];
        }
        best[place] = d;
        nearest[place] = i;
    }
}

static void make_web(web *w, uint64_t seed, size_t count) {
    uint64_t state = seed;
    double total = 0.0;
    w->seed = next_bits(&state);
    w->count = count;
    for (int k = 0; k < KNOTS; k++) {
        for (int axis = 0; axis < 3; axis++) {
            w->knots[k].at[axis] = 0.9 * (uniform(&state) - 0.5);
        }
        /* Masses as 1 / rank, radii as the square root of the mass. */
        total += 1.0 / (k + 1);
        w->knots[k].share = total;
        w->knots[k].a = 0.02 / sqrt(k + 1.0);
    }
    for (int k = 0; k < KNOTS; k++) {
        w->knots[k].share /= total;
        int nearest[2];
        find_nearest(w->knots, k, nearest);
        for (int i = 0; i < 2; i++) {
            w->filaments[2 * k + i][0] = k;
            w->filaments[2 * k + i][1] = nearest[i];
        }
    }
}

/* ---- particles --------------------------------------------------------------------------------*/

/* A direction, uniform on the sphere (Marsaglia 1972). */
static void direction(uint64_t *state, double out[3]) {
    double x, y, s;
    do {
        x = 2.0 * uniform(state) - 1.0;
        y = 2.0 * uniform(state) - 1.0;
        s = x * x + y * y;
    } while (s >= 1.0);
    const double t = 2.0 * sqrt(1.0 - s);
    out[0] = x * t;
    out[1] = y * t;
    out[2] = 1.0 - 2.0 * s;
}

/* Speed as a share of the escape velocity, whose density is q²(1 − q²)^(7/2) (Aarseth, Hénon &
 * Wielen 1974, by rejection). */
static double speed_share(uint64_t *state) {
    for (;;) {
        const double q = uniform(state), rest = 1.0 - q * q;
        if (0.1 * uniform(state) < q * q * (rest * rest * rest * sqrt(rest))) {
            return q;
        }
    }
}

/* Within radius r lies the share w³ of a Plummer sphere's mass, w = r / √(r² + a²): and the
 * greatest of three uniform numbers is below w with that probability. */
static void in_sphere(const web *w, uint64_t *state, particle *out) {
    const double pick = uniform(state);
    int k = 0;
    while (k < KNOTS - 1 && w->knots[k].share <= pick) {
        k++;
    }
    const knot *of = &w->knots[k];
    double share = uniform(state);
    for (int i = 0; i < 2; i++) {
        const double other = uniform(state);
        share = other > share ? other : share;
    }
    share = share < 0.995 ? share : 0.995; /* to 10 a */
    const double x = share / sqrt(1.0 - share * share), root = sqrt(1.0 + x * x);
    double way[3];
    direction(state, way);
    for (int axis = 0; axis < 3; axis++) {
        out->at[axis] = (float)(of->at[axis] + of->a * x * way[axis]);
    }
    out->speed = (float)(speed_share(state) * sqrt(2.0 / root));
    out->radius = (float)(of->a * root * sqrt(root) * 0.03);
    out->class = 2;
}

static void in_filament(const web *w, uint64_t *state, particle *out) {
    const int *ends = w->filaments[next_bits(state) % FILAMENTS];
    const double t = uniform(state), bulge = 0.004 + 0.02 * t * (1.0 - t);
    for (int axis = 0; axis < 3; axis++) {
        const double a = w->knots[ends[0]].at[axis], b = w->knots[ends[1]].at[axis];
        out->at[axis] = (float)(a + (b - a) * t + bulge * spread(state));
    }
    out->speed = (float)(0.1 + 0.4 * uniform(state));
    out->radius = (float)(bulge * 0.2);
    out->class = 1;
}

static particle make_particle(const web *w, size_t i) {
    uint64_t state = w->seed + i * 0xD1342543DE82EF95u;
    state = next_bits(&state);
    particle p;
    const double kind = uniform(&state);
    if (kind < SPHERE_SHARE) {
        in_sphere(w, &state, &p);
    } else if (kind < SPHERE_SHARE + FILAMENT_SHARE) {
        in_filament(w, &state, &p);
    } else {
        for (int axis = 0; axis < 3; axis++) {
            p.at[axis] = (float)(uniform(&state) - 0.5);
        }
        p.speed = (float)(0.1 * uniform(&state));
        p.radius = 0.01f;
        p.class = 0;
    }
    for (int axis = 0; axis < 3; axis++) {
        p.at[axis] = p.at[axis] < -0.5f ? -0.5f : p.at[axis] > 0.5f ? 0.5f : p.at[axis];
    }
    return p;
}

/* ---- Morton order -----------------------------------------------------------------------------*/

#define AXIS_BITS 11
#define INDEX_BITS 31

/* Spreads 11 bits to every third place. */
static uint64_t spread_bits(uint64_t v) {
    v = (v | v << 32) & 0x001F00000000FFFFu;
    v = (v | v << 16) & 0x001F0000FF0000FFu;
    v = (v | v << 8) & 0x100F00F00F00F00Fu;
    v = (v | v << 4) & 0x10C30C30C30C30C3u;
    return (v | v << 2) & 0x1249249249249249u;
}

static uint64_t morton(const float at[3]) {
    uint64_t key = 0;
    for (int axis = 0; axis < 3; axis++) {
        const double cell = floor(((double)at[axis] + 0.5) * (1 << AXIS_BITS));
        const uint64_t most = (1 << AXIS_BITS) - 1;
        const uint64_t bits = cell >= (double)most ? most : (uint64_t)cell;
        key |= spread_bits(bits) << axis;
    }
    return key;
}

/* Sorts by the bits above the index; returns where the result is. */
static uint64_t *sort_keys(uint64_t *keys, uint64_t *other, size_t count) {
    for (int shift = INDEX_BITS; shift < 64; shift += AXIS_BITS) {
        size_t first[1 << AXIS_BITS] = {0}, sum = 0;
        for (size_t i = 0; i < count; i++) {
            first[keys[i] >> shift & ((1 << AXIS_BITS) - 1)]++;
        }
        for (int d = 0; d < 1 << AXIS_BITS; d++) {
            const size_t of = first[d];
            first[d] = sum;
            sum += of;
        }
        for (size_t i = 0; i < count; i++) {
            other[first[keys[i] >> shift & ((1 << AXIS_BITS) - 1)]++] = keys[i];
        }
        uint64_t *swap = keys;
        keys = other;
        other = swap;
    }
    return keys;
}

typedef struct generation {
    const web *web;
    uint64_t *keys;
    vd_particles *particles; /* null: keys are made */
} generation;

static void generate_task(void *user, int index, int worker) {
    const generation *g = user;
    vd_particles *to = g->particles;
    (void)worker;
    const size_t begin = (size_t)index * PARTICLES_A_TASK, left = g->web->count - begin;
    const size_t end = begin + (left < PARTICLES_A_TASK ? left : PARTICLES_A_TASK);
    for (size_t i = begin; i < end; i++) {
        if (to == NULL) {
            const particle p = make_particle(g->web, i);
            g->keys[i] = morton(p.at) << INDEX_BITS | i;
            continue;
        }
        const particle p = make_particle(g->web, g->keys[i] & (((uint64_t)1 << INDEX_BITS) - 1));
        to->x[i] = p.at[0];
        to->y[i] = p.at[1];
        to->z[i] = p.at[2];
        to->radius[i] = p.radius;
        to->mass[i] = (float)(1.0 / (double)g->web->count);
        to->speed[i] = p.speed;
        to->classes[i] = p.class;
    }
}

/* ---- the object -------------------------------------------------------------------------------*/

static vd_status allocate(vd_context *context, size_t count, vd_particles **out) {
    vd_particles *p = vd_allocate_zero(context, 1, sizeof *p);
    if (p == NULL) {
        return vd_out_of_memory("particles", sizeof *p);
    }
    p->context = context;
    p->count = count;
    float **arrays[] = {&p->x, &p->y, &p->z, &p->radius, &p->mass, &p->speed};
    bool ok = true;
    for (size_t i = 0; i < sizeof arrays / sizeof arrays[0]; i++) {
        *arrays[i] = vd_allocate(context, count, sizeof(float));
        ok = ok && *arrays[i] != NULL;
    }
    p->classes = vd_allocate(context, count, 1);
    if (!ok || p->classes == NULL) {
        vd_particles_destroy(&p);
        return vd_out_of_memory("particles", count * 25);
    }
    *out = p;
    return vd_success();
}

vd_status vd_particles_generate(vd_context *context, vd_job *job, uint64_t seed, size_t count,
                                vd_particles **out) {
    if (count > VD_SPLATS_MAX_COUNT) {
        return vd_failure(VD_ERROR_LIMIT, "%zu particles are too many; give at most %u", count,
                          VD_SPLATS_MAX_COUNT);
    }
    vd_particles *particles = NULL;
    vd_status status = allocate(context, count, &particles);
    uint64_t *keys = NULL, *other = NULL;
    if (status.code == VD_OK) {
        keys = vd_allocate(context, count, sizeof *keys);
        other = vd_allocate(context, count, sizeof *other);
        if (keys == NULL || other == NULL) {
            status = vd_out_of_memory("particles' keys", 2 * count * sizeof *keys);
        }
    }
    if (status.code == VD_OK) {
        web w;
        make_web(&w, seed, count);
        const int tasks = (int)((count + PARTICLES_A_TASK - 1) / PARTICLES_A_TASK);
        generation g = {&w, keys, NULL};
        status = vd_parallel_for(context, job, tasks, generate_task, &g);
        if (status.code == VD_OK) {
            g.keys = sort_keys(keys, other, count);
            g.particles = particles;
            status = vd_parallel_for(context, job, tasks, generate_task, &g);
        }
    }
    vd_release(context, keys);
    vd_release(context, other);
    if (status.code != VD_OK) {
        vd_particles_destroy(&particles);
        return status;
    }
    *out = particles;
    return status;
}

void vd_particles_destroy(vd_particles **particles) {
    if (particles == NULL || *particles == NULL) {
        return;
    }
    vd_particles *p = *particles;
    *particles = NULL;
    void *arrays[] = {p->x, p->y, p->z, p->radius, p->mass, p->speed, p->classes};
    for (size_t i = 0; i < sizeof arrays / sizeof arrays[0]; i++) {
        vd_release(p->context, arrays[i]);
    }
    vd_release(p->context, p);
}

vd_splats vd_particles_splats(const vd_particles *particles, size_t first, size_t count) {
    vd_splats splats = vd_splats_default();
    splats.count = count;
    splats.x = particles->x + first;
    splats.y = particles->y + first;
    splats.z = particles->z + first;
    splats.radius = particles->radius + first;
    splats.weight = particles->mass + first;
    splats.value = particles->speed + first;
    vd_splats_find_bounds(&splats);
    return splats;
}
