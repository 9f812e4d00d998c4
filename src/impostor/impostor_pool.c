/* impostor_pool.c: pictures that several sets have. */
#include "impostor/impostor_pool.h"

#include "core/core.h"

enum { BUCKETS = 4096 };

struct vd_impostor_pool {
    vd_context *context;
    const vd_world *world; /* of the first set; null until then */
    const vd_world_renderer *renderer;
    vd_pooled *buckets[BUCKETS];
    vd_pooled *newest, *oldest; /* of those that no set has */
    size_t bytes, idle_bytes, most_idle_bytes;
    uint64_t count; /* pictures so far */
    uint32_t numbers, sets;
    vd_impostor_scratch scratch;
    uint8_t *sky[VD_SKY_SIDES];
};

static size_t bytes_of(const vd_pooled *pooled) {
    return 4 * (size_t)pooled->picture.width * (size_t)pooled->picture.height;
}

static vd_pooled **bucket_of(vd_impostor_pool *pool, uint32_t node) {
    return &pool->buckets[(node * 2654435761u) >> 20]; /* Knuth 1998, section 6.4 */
}

vd_status vd_impostor_pool_create(vd_context *context, size_t idle_bytes, vd_impostor_pool **out) {
    vd_impostor_pool *pool = vd_allocate_zero(context, 1, sizeof *pool);
    if (pool == NULL) {
        return vd_out_of_memory("a pool of impostors", sizeof *pool);
    }
    pool->context = context;
    pool->most_idle_bytes = idle_bytes;
    *out = pool;
    return vd_success();
}

/* ---- what no set has --------------------------------------------------------------------------*/

static void take_from_idle(vd_pooled *pooled) {
    vd_impostor_pool *pool = pooled->pool;
    *(pooled->newer != NULL ? &pooled->newer->older : &pool->newest) = pooled->older;
    *(pooled->older != NULL ? &pooled->older->newer : &pool->oldest) = pooled->newer;
    pooled->newer = pooled->older = NULL;
    pool->idle_bytes -= bytes_of(pooled);
}

static void put_to_idle(vd_pooled *pooled) {
    vd_impostor_pool *pool = pooled->pool;
    pooled->newer = NULL;
    pooled->older = pool->newest;
    *(pool->newest != NULL ? &pool->newest->newer : &pool->oldest) = pooled;
    pool->newest = pooled;
    pool->idle_bytes += bytes_of(pooled);
}

/* Frees the oldest that no set has, until the others fit. */
static void trim(vd_impostor_pool *pool) {
    const size_t most = pool->sets > 1 ? pool->most_idle_bytes : 0;
    while (pool->idle_bytes > most) {
        vd_pooled *pooled = pool->oldest;
        vd_pooled **at = bucket_of(pool, pooled->node);
        take_from_idle(pooled);
        while (*at != pooled) {
            at = &(*at)->next;
        }
        *at = pooled->next;
        pool->bytes -= bytes_of(pooled);
        vd_release(pool->context, pooled->picture.rgba);
        vd_release(pool->context, pooled);
    }
}

void vd_impostor_pool_give_up(vd_pooled *pooled) {
    if (--pooled->holders == 0) {
        put_to_idle(pooled);
        trim(pooled->pool);
    }
}

/* ---- sets -------------------------------------------------------------------------------------*/

vd_status vd_impostor_pool_join(vd_impostor_pool *pool, const vd_world *world,
                                const vd_world_renderer *renderer, uint32_t *number) {
    if (pool->world != NULL && (pool->world != world || pool->renderer != renderer)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "impostors share pictures with others of the same world and renderer; "
                          "give them another `pool`");
    }
    pool->world = world;
    pool->renderer = renderer;
    pool->sets++;
    *number = ++pool->numbers;
    return vd_success();
}

void vd_impostor_pool_leave(vd_impostor_pool *pool) {
    pool->sets--;
    trim(pool);
}

void vd_impostor_pool_destroy(vd_impostor_pool **pool) {
    vd_impostor_pool *p = pool != NULL ? *pool : NULL;
    if (p == NULL) {
        return;
    }
    p->sets = 0;
    trim(p);
    vd_impostor_scratch_release(&p->scratch);
    for (int i = 0; i < VD_SKY_SIDES; i++) {
        vd_release(p->context, p->sky[i]);
    }
    vd_release(p->context, p);
    *pool = NULL;
}

size_t vd_impostor_pool_bytes(const vd_impostor_pool *pool) {
    return pool->bytes;
}

vd_impostor_scratch *vd_impostor_pool_scratch(vd_impostor_pool *pool) {
    return &pool->scratch;
}

/* ---- pictures ---------------------------------------------------------------------------------*/

void vd_impostor_pool_put(vd_impostors *set, uint32_t node, vd_impostor_picture *made) {
    vd_impostor_pool *pool = set->def.pool;
    vd_pooled *pooled = pool != NULL ? vd_allocate(pool->context, 1, sizeof *pooled) : NULL;
    if (pooled == NULL) {
        return;
    }
    vd_pooled **bucket = bucket_of(pool, node);
    made->pooled = pooled;
    *pooled = (vd_pooled){.next = *bucket,
                          .pool = pool,
                          .picture = *made,
                          .number = ++pool->count,
                          .node = node,
                          .maker = set->number,
                          .holders = 1,
                          .samples = set->def.samples,
                          .tolerance_px = set->def.tolerance_px};
    *bucket = pooled;
    pool->bytes += bytes_of(pooled);
}

bool vd_impostor_pool_get(vd_impostors *set, const vd_impostor_view *view, uint32_t node,
                          vd_impostor_picture *out) {
    vd_impostor_pool *pool = set->def.pool;
    vd_pooled *best = NULL;
    double least = 0.5 * set->def.tolerance_px;
    if (pool == NULL || pool->sets < 2 || set->def.no_reuse) {
        return false;
    }
    for (vd_pooled *p = *bucket_of(pool, node); p != NULL; p = p->next) {
        /* Edges that were made for a smaller tolerance do not reach as far under neighbours. */
        if (p->node != node || p->maker == set->number || p->samples != set->def.samples ||
            p->tolerance_px < set->def.tolerance_px) {
            continue;
        }
        const double error = vd_impostor_picture_error(set, view, node, &p->picture);
        if (error < least) {
            least = error;
            best = p;
        }
    }
    if (best == NULL) {
        return false;
    }
    if (best->holders++ == 0) {
        take_from_idle(best);
    }
    *out = best->picture;
    return true;
}

uint8_t **vd_impostor_pool_sky(const vd_impostors *set, int side) {
    return set->def.pool != NULL && set->world->def.terrain.function == NULL
               ? &set->def.pool->sky[side]
               : NULL;
}
