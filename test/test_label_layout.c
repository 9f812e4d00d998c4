/* Placing labels: what must hold of any labels, the order of spots, the cost, bad input. */
#include "support.h"

#include <math.h>
#include <stdio.h>
#include "world/label_layout_internal.h"

static vd_context *context;
static vd_label_layout *layout;

static int set_up(void **state) {
    (void)state;
    context = test_context(1, VD_ISA_AUTO);
    assert_ok(vd_label_layout_create(context, &layout));
    return 0;
}

static int tear_down(void **state) {
    (void)state;
    vd_label_layout_destroy(&layout);
    vd_label_layout_destroy(&layout);
    vd_context_destroy(&context);
    return 0;
}

enum { MOST = 100000, MOST_KEPT = 8 };

static vd_label_request requests[MOST];
static vd_label_spot spots[MOST], again[MOST];
static float kept[MOST_KEPT][4];

static vd_label_layout_def make_def(int width, int height) {
    vd_label_layout_def def = vd_label_layout_def_default();
    def.width = width;
    def.height = height;
    return def;
}

static void make_random(uint64_t *random, const vd_label_layout_def *def, size_t count) {
    /* Whole pixels sometimes: edges that touch, priorities and places that are equal. */
    const bool whole = test_random(random) % 2 == 0;
    const double size = 4 + 60 * test_uniform(random);
    for (size_t i = 0; i < count; i++) {
        vd_label_request *r = &requests[i];
        r->x = (float)((test_uniform(random) * 1.2 - 0.1) * def->width);
        r->y = (float)((test_uniform(random) * 1.2 - 0.1) * def->height);
        r->width = (float)(size * (0.5 + 3 * test_uniform(random)));
        r->height = (float)(size * (0.3 + 0.2 * test_uniform(random)));
        if (whole) {
            r->x = floorf(r->x);
            r->y = floorf(r->y);
            r->width = ceilf(r->width);
            r->height = ceilf(r->height);
        }
        r->priority = (double)(test_random(random) % 50);
        r->leader = (vd_leader)(test_random(random) % VD_LEADER_COUNT);
    }
}

/* ---- what must hold -----------------------------------------------------------------------------
 */

static bool overlap(const float a[4], const float b[4]) {
    return a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];
}

/* A shown label's leader as a rectangle without width; false when it has none. */
static bool leader_of(size_t i, float out[4]) {
    out[0] = out[2] = requests[i].x;
    out[1] = spots[i].box[3];
    out[3] = requests[i].y;
    return spots[i].leader;
}

static void check_one(const vd_label_layout_def *def, size_t i) {
    const vd_label_spot *s = &spots[i];
    const vd_label_request *r = &requests[i];
    if (!s->shown) {
        assert_false(s->leader);
        return;
    }
    assert_true(s->box[2] == s->box[0] + r->width && s->box[3] == s->box[1] + r->height);
    assert_true(s->box[0] >= def->margin && s->box[1] >= def->margin);
    assert_true(s->box[2] <= (float)def->width - def->margin);
    assert_true(s->box[3] <= (float)def->height - def->margin);
    assert_true(r->x >= 0 && r->y >= 0 && r->x <= (float)def->width && r->y <= (float)def->height);
    if (s->leader) {
        assert_true(r->leader != VD_LEADER_NEVER && s->box[3] < r->y);
        assert_true(s->box[0] <= r->x && r->x <= s->box[2]);
    } else {
        assert_true(r->leader != VD_LEADER_ALWAYS);
        const float place[4] = {r->x, r->y, r->x, r->y}; /* with a gap of 0, up to rounding */
        const float inner[4] = {s->box[0] + 0.001f, s->box[1] + 0.001f, s->box[2] - 0.001f,
                                s->box[3] - 0.001f};
        assert_false(overlap(inner, place));
    }
    float line[4];
    for (size_t k = 0; k < def->kept_count; k++) {
        assert_false(overlap(s->box, def->kept[k]));
        assert_false(leader_of(i, line) && overlap(line, def->kept[k]));
    }
}

static void check_pair(size_t i, size_t j) {
    const float place[4] = {requests[j].x, requests[j].y, requests[j].x, requests[j].y};
    float a[4], b[4];
    assert_false(overlap(spots[i].box, spots[j].box));
    assert_false(overlap(spots[i].box, place));
    if (leader_of(i, a)) {
        assert_false(overlap(a, spots[j].box));
        /* Leaders are upright: they meet only where they have one x. */
        if (leader_of(j, b)) {
            assert_false(a[0] == b[0] && a[1] < b[3] && b[1] < a[3]);
        }
    }
}

/* Every pair, by the plainest loops. */
static size_t check_all(const vd_label_layout_def *def, size_t count) {
    static size_t shown[MOST];
    size_t shown_count = 0;
    for (size_t i = 0; i < count; i++) {
        check_one(def, i);
        if (spots[i].shown) {
            shown[shown_count++] = i;
        }
    }
    for (size_t i = 0; i < shown_count; i++) {
        for (size_t j = 0; j < shown_count; j++) {
            if (i != j) {
                check_pair(shown[i], shown[j]);
            }
        }
    }
    return shown_count;
}

static void any_labels_keep_apart(void **state) {
    (void)state;
    uint64_t random = 11;
    size_t shown = 0, asked = 0;
    for (int round = 0; round < 400; round++) {
        vd_label_layout_def def = make_def(1 + (int)(test_random(&random) % 1500),
                                           1 + (int)(test_random(&random) % 1000));
        const size_t count = test_random(&random) % 400;
        def.kept = (const float(*)[4])kept;
        def.kept_count = test_random(&random) % MOST_KEPT;
        for (size_t k = 0; k < def.kept_count; k++) {
            kept[k][0] = (float)((test_uniform(&random) * 1.2 - 0.2) * def.width);
            kept[k][1] = (float)((test_uniform(&random) * 1.2 - 0.2) * def.height);
            kept[k][2] = kept[k][0] + (float)(test_uniform(&random) * 0.3 * def.width);
            kept[k][3] = kept[k][1] + (float)(test_uniform(&random) * 0.3 * def.height);
        }
        def.margin = (float)(test_random(&random) % 10);
        def.gap = (float)(test_random(&random) % 10);
        def.mark = (float)(test_random(&random) % 2) * def.gap;
        def.rise = (float)(test_random(&random) % 2) * 7;
        def.rise_first = test_random(&random) % 2 == 0;
        make_random(&random, &def, count);
        assert_ok(vd_label_layout_place(layout, &def, requests, count, spots));
        shown += check_all(&def, count);
        asked += count;
        memset(again, 0xA5, count * sizeof *again);
        assert_ok(vd_label_layout_place(layout, &def, requests, count, again));
        for (size_t i = 0; i < count; i++) {
            assert_true(again[i].shown == spots[i].shown && again[i].leader == spots[i].leader);
            assert_memory_equal(again[i].box, spots[i].box, sizeof spots[i].box);
        }
    }
    assert_true(shown * 10 > asked); /* and it does show labels */
}

/* What comes later moves none of those before; the first is shown wherever it has room. */
static void priority_decides(void **state) {
    (void)state;
    uint64_t random = 12;
    for (int round = 0; round < 100; round++) {
        const vd_label_layout_def def = make_def(800, 600);
        const size_t count = 2 + test_random(&random) % 300, cut = count / 2;
        make_random(&random, &def, count);
        for (size_t i = 0; i < count; i++) {
            requests[i].priority = -(double)i;
        }
        assert_ok(vd_label_layout_place(layout, &def, requests, count, spots));
        assert_ok(vd_label_layout_place(layout, &def, requests, cut, again));
        for (size_t i = 0; i < cut; i++) {
            assert_true(again[i].shown == spots[i].shown);
            assert_memory_equal(again[i].box, spots[i].box, sizeof spots[i].box);
        }
    }
}

/* ---- spots --------------------------------------------------------------------------------------
 */

static void spots_come_in_order(void **state) {
    (void)state;
    vd_label_layout_def def = make_def(400, 300);
    /* Each spot is kept free in turn, and the next one is taken. */
    static const float boxes[5][4] = {{170, 125, 230, 145}, /* above */
                                      {205, 140, 265, 160}, /* right */
                                      {135, 140, 195, 160}, /* left */
                                      {170, 155, 230, 175}, /* below */
                                      {170, 115, 230, 135}};
    const vd_label_request request = {200, 150, 60, 20, 0, VD_LEADER_ALLOWED};
    for (size_t i = 0; i < 5; i++) {
        def.kept_count = i;
        def.kept = (const float(*)[4])kept;
        if (i > 0) { /* a corner of that spot only: the other spots stay free */
            static const float corners[4][2] = {{200, 143}, {263, 158}, {137, 158}, {200, 173}};
            const float x = corners[i - 1][0], y = corners[i - 1][1];
            const float corner[4] = {x - 1, y - 1, x + 1, y + 1};
            memcpy(kept[i - 1], corner, sizeof corner);
        }
        assert_ok(vd_label_layout_place(layout, &def, &request, 1, spots));
        if (i < 4) {
            assert_true(spots[0].shown && !spots[0].leader);
            assert_memory_equal(spots[0].box, boxes[i], sizeof boxes[i]);
        } else { /* what is above the place stops the leader too */
            assert_false(spots[0].shown);
        }
    }
    def.kept_count = 0;
    vd_label_request raised = request;
    raised.leader = VD_LEADER_ALWAYS;
    assert_ok(vd_label_layout_place(layout, &def, &raised, 1, spots));
    assert_true(spots[0].shown && spots[0].leader);
    assert_memory_equal(spots[0].box, boxes[4], sizeof boxes[4]);
}

/* Names along a ridge go up into the sky where they are told to, and more of them are shown. */
static void crowds_rise(void **state) {
    (void)state;
    vd_label_layout_def def = make_def(800, 400);
    size_t shown[2];
    for (int first = 0; first < 2; first++) {
        def.rise_first = first == 1;
        for (int i = 0; i < 10; i++) {
            requests[i] = (vd_label_request){
                (float)(200 + 48 * (7 * i % 10)), 350, 90, 16, -(double)i, VD_LEADER_ALLOWED};
        }
        assert_ok(vd_label_layout_place(layout, &def, requests, 10, spots));
        shown[first] = check_all(&def, 10);
    }
    assert_int_equal(shown[1], 10);
    assert_true(shown[0] < 10);
    int leaders = 0;
    for (int i = 0; i < 10; i++) {
        leaders += spots[i].leader;
    }
    assert_true(leaders >= 4);
}

static void labels_at_the_edge_move_inwards(void **state) {
    (void)state;
    const vd_label_layout_def def = make_def(300, 200);
    const vd_label_request at_edges[] = {
        {5, 100, 80, 16, 0, VD_LEADER_NEVER},     {295, 100, 80, 16, 0, VD_LEADER_NEVER},
        {150, 5, 80, 16, 0, VD_LEADER_NEVER},     {-1, 100, 80, 16, 0, VD_LEADER_ALLOWED},
        {150, 300, 80, 16, 0, VD_LEADER_ALLOWED}, {150, 100, 300, 16, 0, VD_LEADER_ALLOWED}};
    memcpy(requests, at_edges, sizeof at_edges);
    assert_ok(vd_label_layout_place(layout, &def, requests, 6, spots));
    assert_true(spots[0].shown && spots[0].box[0] == 4);
    assert_true(spots[1].shown && spots[1].box[2] == 296);
    assert_true(spots[2].shown && spots[2].box[1] == 10); /* below it */
    assert_false(spots[3].shown || spots[4].shown || spots[5].shown);
}

/* ---- cost ---------------------------------------------------------------------------------------
 */

static uint64_t looks_of(size_t count, int width, int height, int kind) {
    uint64_t random = 5;
    const vd_label_layout_def def = make_def(width, height);
    for (size_t i = 0; i < count; i++) {
        const double u = test_uniform(&random), v = test_uniform(&random);
        requests[i] = (vd_label_request){(float)(u * width),    (float)(v * height), 80, 18,
                                         test_uniform(&random), VD_LEADER_ALLOWED};
        if (kind == 1) { /* all at one place */
            requests[i].x = (float)(width / 2);
            requests[i].y = (float)(height / 2);
        } else if (kind == 2) { /* along one line */
            requests[i].y = (float)(height / 2);
        } else if (kind == 3) { /* tiny ones */
            requests[i].width = requests[i].height = 1;
        }
    }
    assert_ok(vd_label_layout_place(layout, &def, requests, count, spots));
    return vd_label_layout_looks(layout);
}

static void cost_does_not_blow_up(void **state) {
    (void)state;
    for (int kind = 0; kind < 4; kind++) {
        const uint64_t few = looks_of(10000, 1920, 1080, kind);
        const uint64_t many = looks_of(100000, 1920, 1080, kind);
        print_message("%d: %llu looks for 10,000 labels, %llu for 100,000\n", kind,
                      (unsigned long long)few, (unsigned long long)many);
        assert_true(few < 10000 * 200);
        assert_true(many < 100000 * 300);
    }
}

static void warm_pictures_allocate_nothing(void **state) {
    (void)state;
    looks_of(5000, 1920, 1080, 0);
    const uint64_t before = vd_context_memory(context).allocations;
    looks_of(5000, 1920, 1080, 0);
    assert_int_equal(vd_context_memory(context).allocations, before);
}

/* ---- refusals -----------------------------------------------------------------------------------
 */

static void assert_refused(const vd_label_layout_def *def, const vd_label_request *request,
                           const char *part) {
    const vd_status status = vd_label_layout_place(layout, def, request, 1, spots);
    assert_int_equal(status.code, VD_ERROR_ARGUMENT);
    if (strstr(status.message, part) == NULL) {
        fail_msg("\"%s\" does not say \"%s\"", status.message, part);
    }
}

static void bad_input_is_refused(void **state) {
    (void)state;
    const vd_label_request good = {10, 10, 5, 5, 0, VD_LEADER_NEVER};
    vd_label_layout_def def = make_def(100, 100);
    static const float bad[] = {NAN, INFINITY, -INFINITY};
    for (int i = 0; i < 3; i++) {
        vd_label_request r = good;
        r.x = bad[i];
        assert_refused(&def, &r, "label 0: its place");
        r = good;
        r.height = bad[i];
        assert_refused(&def, &r, "label 0: a box of");
        def.gap = bad[i];
        assert_refused(&def, &good, "gap");
        def = make_def(100, 100);
    }
    vd_label_request r = good;
    r.priority = NAN;
    assert_refused(&def, &r, "priority");
    r = good;
    r.width = 0;
    assert_refused(&def, &r, "a box of 0 x 5");
    def.width = 0;
    assert_refused(&def, &good, "0 x 100");
    def = make_def(100, 100);
    def.mark = 9;
    assert_refused(&def, &good, "mark (9)");
    def = make_def(100, 100);
    kept[0][2] = NAN;
    def.kept = (const float(*)[4])kept;
    def.kept_count = 1;
    assert_refused(&def, &good, "kept rectangle 0");
    kept[0][2] = 0;
    def = make_def(100, 100);
    assert_int_equal(
        vd_label_layout_place(layout, &def, &good, VD_LABEL_LAYOUT_MAX + 1, spots).code,
        VD_ERROR_LIMIT);
    assert_ok(vd_label_layout_place(layout, &def, NULL, 0, NULL));
}

static void memory_runs_out_cleanly(void **state) {
    (void)state;
    const vd_label_layout_def def = make_def(1920, 1080);
    uint64_t random = 4;
    make_random(&random, &def, 2000);
    bool done = false;
    for (int fail_at = 2; !done; fail_at++) {
        test_allocator allocator = {.fail_at = 0};
        vd_context *failing = test_failing_context(&allocator);
        const int live = allocator.live;
        allocator.fail_at = fail_at;
        vd_label_layout *made = NULL;
        vd_status status = vd_label_layout_create(failing, &made);
        for (int i = 0; i < 2 && status.code == VD_OK; i++) {
            status = vd_label_layout_place(made, &def, requests, 2000, spots);
        }
        done = status.code == VD_OK;
        assert_true(done || status.code == VD_ERROR_MEMORY);
        vd_label_layout_destroy(&made);
        assert_int_equal(allocator.live, live);
        vd_context_destroy(&failing);
        assert_true(fail_at < 100);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_labels_keep_apart),
        cmocka_unit_test(priority_decides),
        cmocka_unit_test(spots_come_in_order),
        cmocka_unit_test(crowds_rise),
        cmocka_unit_test(labels_at_the_edge_move_inwards),
        cmocka_unit_test(cost_does_not_blow_up),
        cmocka_unit_test(warm_pictures_allocate_nothing),
        cmocka_unit_test(bad_input_is_refused),
        cmocka_unit_test(memory_runs_out_cleanly),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
