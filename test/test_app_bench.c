/* test_app_bench.c: `veduta bench` from outside: the JSON's shape, equal pictures, bad use. What it
 * measures is nobody's business here: tests never time. */
#include "support.h"

#include <stdio.h>
#include <sys/wait.h>

static char output[1 << 16];

/* Runs `veduta bench ARGUMENTS`, its standard output or error in `output`; returns the status. */
static int bench(const char *arguments) {
    char command[1024];
    snprintf(command, sizeof command, "'%s/veduta' bench %s", VEDUTA_BINARY_DIR, arguments);
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    size_t length = fread(output, 1, sizeof output - 1, pipe);
    output[length] = '\0';
    int status = pclose(pipe);
    assert_true(WIFEXITED(status));
    return WEXITSTATUS(status);
}

static int count(const char *part) {
    int found = 0;
    for (const char *at = output; (at = strstr(at, part)) != NULL; at += strlen(part)) {
        found++;
    }
    return found;
}

/* Every result has every field, in one object each, and nothing else. */
static void json_has_the_fields(void **state) {
    (void)state;
    static const char *const head[] = {"commit", "compiler", "flags", "cpu", "results"};
    static const char *const fields[] = {"case",   "method", "threads",   "isa",
                                         "width",  "height", "median_ms", "p99_ms",
                                         "min_ms", "hash",   "peak_bytes"};
    assert_int_equal(bench("classic-growth --threads 1,2 --repeat 1 --json - 2>/dev/null"), 0);
    char key[64];
    for (size_t i = 0; i < sizeof head / sizeof head[0]; i++) {
        snprintf(key, sizeof key, "\n  \"%s\": ", head[i]);
        assert_int_equal(count(key), 1);
    }
    /* The serial reference once, three methods on one thread and on two. */
    for (size_t i = 0; i < sizeof fields / sizeof fields[0]; i++) {
        snprintf(key, sizeof key, "\n      \"%s\": ", fields[i]);
        assert_int_equal(count(key), 7);
    }
    assert_int_equal(count("\": "), 5 + 7 * 11);
    assert_int_equal(count("\"reference\""), 1);
    assert_int_equal(count("\"threads\": 2"), 3);
}

/* The bench's map and picture are the same on every machine: the hash is pinned. */
static void the_picture_is_pinned(void **state) {
    (void)state;
    const char *levels = vd_isa_best() == VD_ISA_V4   ? "v2,v3,v4"
                         : vd_isa_best() == VD_ISA_V3 ? "v2,v3"
                                                      : "v2";
    char arguments[128];
    snprintf(arguments, sizeof arguments,
             "classic-growth --threads 2 --isa %s --repeat 1 --json - 2>/dev/null", levels);
    assert_int_equal(bench(arguments), 0);
    int results = count("\"case\": \"classic-growth\"");
    assert_int_equal(results, 4 * (int)vd_isa_best());
    assert_int_equal(count("\"hash\": \"896745c4004e2cfb\""), results);
}

static void table_and_list(void **state) {
    (void)state;
    assert_int_equal(bench("startup --repeat 1"), 0);
    assert_non_null(strstr(output, "startup"));
    assert_non_null(strstr(output, "median ms"));
    assert_int_equal(bench("--list"), 0);
    assert_non_null(strstr(output, "classic"));
    assert_int_equal(bench("--help"), 0);
    assert_non_null(strstr(output, "--json"));
}

static void bad_use_is_told(void **state) {
    (void)state;
    static const struct {
        const char *arguments, *part;
    } uses[] = {{"", "--list"},
                {"clasic", "did you mean classic?"},
                {"startup --theads 1", "--threads"},
                {"startup --threads 0", "1 to 1024"},
                {"startup --threads 1,x", "1 to 1024"},
                {"startup --isa v5", "v2, v3, v4"},
                {"startup --isa v2,", "v2, v3, v4"},
                {"startup --repeat 2000", "1000"}};
    for (size_t i = 0; i < sizeof uses / sizeof uses[0]; i++) {
        char arguments[128];
        snprintf(arguments, sizeof arguments, "%s 2>&1 >/dev/null", uses[i].arguments);
        assert_int_equal(bench(arguments), 2);
        if (strstr(output, uses[i].part) == NULL || strncmp(output, "veduta: ", 8) != 0) {
            fail_msg("bench %s: said %s", uses[i].arguments, output);
        }
        assert_int_equal(count("\n"), 1);
    }
    assert_int_equal(bench("startup --repeat 1 --json /nonexistent/x.json 2>&1 >/dev/null"), 1);
    assert_non_null(strstr(output, "/nonexistent/x.json"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(json_has_the_fields),
        cmocka_unit_test(the_picture_is_pinned),
        cmocka_unit_test(table_and_list),
        cmocka_unit_test(bad_use_is_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
