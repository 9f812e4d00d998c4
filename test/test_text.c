/* Fonts and text: outlines cover what FreeType's own rasterizer covers, shaping, text both ways,
 * bad bytes, fonts that are not there, memory. */
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <unistd.h>
#include <veduta/coverage.h>
#include "text/font.h"
#include "text/text_runs.h"

#define FONT "DejaVu Sans"

static vd_context *context;
static vd_font *font;

static int set_up(void **state) {
    (void)state;
    context = test_context(1, VD_ISA_AUTO);
    const vd_status status = vd_font_find(context, FONT, &font);
    if (status.code != VD_OK) {
        print_error("%s\n", status.message);
    }
    return status.code == VD_OK ? 0 : -1;
}

static int tear_down(void **state) {
    (void)state;
    vd_font_destroy(&font);
    vd_context_destroy(&context);
    return 0;
}

static vd_outline outline_of(const char *text, double size_px) {
    vd_outline outline;
    assert_ok(vd_font_outline(font, text, size_px, &outline));
    return outline;
}

static double advance_of(const char *text) {
    vd_outline outline = outline_of(text, 64);
    const double advance = outline.advance;
    vd_outline_finish(&outline);
    return advance;
}

/* ---- areas --------------------------------------------------------------------------------------
 */

enum { SIDE = 256, ORIGIN_X = 64, BASELINE = 160 };

/* Draws an outline in white over black; [SIDE][SIDE] of 0 … 1. */
static void draw(const vd_outline *outline, double out[SIDE][SIDE]) {
    vd_coverage *coverage = NULL;
    vd_frame *frame = NULL;
    assert_ok(vd_coverage_create(context, &coverage));
    assert_ok(vd_frame_create(context, SIDE, SIDE, 0, &frame));
    vd_layer layer = vd_layer_default();
    layer.path = outline->path;
    layer.picture_from_path.x0 = ORIGIN_X;
    layer.picture_from_path.y0 = BASELINE;
    layer.fill[0] = layer.fill[1] = layer.fill[2] = layer.fill[3] = 65535;
    assert_ok(vd_coverage_draw_frame(coverage, NULL, NULL, &layer, 1, frame));
    for (int y = 0; y < SIDE; y++) {
        for (int x = 0; x < SIDE; x++) {
            out[y][x] = frame->rgba[4 * ((size_t)y * frame->stride + (size_t)x)] / 255.0;
        }
    }
    vd_frame_destroy(&frame);
    vd_coverage_destroy(&coverage);
}

/* FreeType's picture of one glyph at 64 pixels, at the same place. */
static void draw_by_freetype(uint32_t character, double out[SIDE][SIDE]) {
    memset(out, 0, sizeof(double) * SIDE * SIDE);
    FT_Face face = font->face;
    assert_int_equal(FT_Set_Pixel_Sizes(face, 64, 64), 0);
    assert_int_equal(FT_Load_Char(face, character, FT_LOAD_NO_HINTING | FT_LOAD_RENDER), 0);
    const FT_GlyphSlot slot = face->glyph;
    for (int y = 0; y < (int)slot->bitmap.rows; y++) {
        for (int x = 0; x < (int)slot->bitmap.width; x++) {
            out[BASELINE - slot->bitmap_top + y][ORIGIN_X + slot->bitmap_left + x] =
                slot->bitmap.buffer[y * slot->bitmap.pitch + x] / 255.0;
        }
    }
}

static void glyphs_cover_what_freetype_covers(void **state) {
    (void)state;
    static double ours[SIDE][SIDE], theirs[SIDE][SIDE];
    static const char *const texts[] = {"A", "g", "@", "8", "Ä", "&", "W", "i", "ß", "§", "%", "Ж"};
    static const uint32_t characters[] = {'A', 'g', '@',  '8',  0xC4, '&',
                                          'W', 'i', 0xDF, 0xA7, '%',  0x416};
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        vd_outline outline = outline_of(texts[i], 64);
        draw(&outline, ours);
        draw_by_freetype(characters[i], theirs);
        double a = 0, b = 0, apart = 0;
        for (int y = 0; y < SIDE; y++) {
            for (int x = 0; x < SIDE; x++) {
                a += ours[y][x];
                b += theirs[y][x];
                apart += fabs(ours[y][x] - theirs[y][x]);
                if (ours[y][x] > 0) { /* inside of what is said to be inked */
                    assert_true(x + 1 > ORIGIN_X + outline.ink[0] - 0.1);
                    assert_true(x < ORIGIN_X + outline.ink[2] + 0.1);
                    assert_true(y + 1 > BASELINE + outline.ink[1] - 0.1);
                    assert_true(y < BASELINE + outline.ink[3] + 0.1);
                }
            }
        }
        if (fabs(a - b) > 0.01 * b || apart > 0.03 * b) {
            fail_msg("%s: area %g, FreeType's %g, apart %g", texts[i], a, b, apart);
        }
        vd_outline_finish(&outline);
    }
}

/* ---- shaping ------------------------------------------------------------------------------------
 */

static void metrics_are_those_of_the_font(void **state) {
    (void)state;
    vd_outline outline = outline_of("x", 100);
    /* DejaVu Sans: 2048 units an em, ascender 1901, descender −483, x is 1212 wide. */
    assert_float_equal(outline.ascent, 1901 * 100 / 2048.0, 1e-9);
    assert_float_equal(outline.descent, 483 * 100 / 2048.0, 1e-9);
    assert_float_equal(outline.advance, 1212 * 100 / 2048.0, 1e-9);
    assert_float_equal(outline.ink[3], 0, 1e-9); /* it stands on the baseline, y down */
    assert_float_equal(outline.ink[1], -1120 * 100 / 2048.0, 1e-9);
    assert_int_equal(outline.missing, 0);
    vd_outline_finish(&outline);
    assert_null(outline.path.points);
    vd_outline_finish(&outline);
    vd_outline_finish(NULL);
}

static void outlines_scale(void **state) {
    (void)state;
    vd_outline small = outline_of("Piz Bernina", 16), large = outline_of("Piz Bernina", 32);
    assert_int_equal(small.path.point_count, large.path.point_count);
    assert_memory_equal(small.path.verbs, large.path.verbs, small.path.verb_count);
    for (size_t i = 0; i < small.path.point_count; i++) {
        assert_true(2 * small.path.points[i][0] == large.path.points[i][0]);
        assert_true(2 * small.path.points[i][1] == large.path.points[i][1]);
    }
    assert_true(2 * small.advance == large.advance);
    vd_outline_finish(&small);
    vd_outline_finish(&large);
}

static void pairs_are_kerned(void **state) {
    (void)state;
    assert_true(advance_of("AV") < advance_of("A") + advance_of("V") - 1);
    assert_float_equal(advance_of("HH"), 2 * advance_of("H"), 1e-9);
}

static void letters_are_joined(void **state) {
    (void)state;
    /* Arabic beh alone, and three of them joined: the middle forms are narrower. */
    assert_true(advance_of("ببب") < 3 * advance_of("ب") - 10);
    vd_outline apart = outline_of("f\xE2\x80\x8Ci", 64); /* a non-joiner forbids the ligature */
    vd_outline joined = outline_of("fi", 64);
    assert_int_equal(apart.missing, 0);
    assert_true(joined.path.point_count != apart.path.point_count ||
                joined.advance != apart.advance);
    vd_outline_finish(&apart);
    vd_outline_finish(&joined);
}

/* Where the characters' runs stand: their first characters from left to right. */
static size_t split(const char *text, vd_text_run *runs, uint32_t *characters) {
    static vd_text_note notes[VD_TEXT_MAX_BYTES];
    int replaced;
    const size_t count = vd_text_decode(text, strlen(text), characters, &replaced);
    const size_t run_count = vd_text_split(characters, count, notes, runs);
    size_t sum = 0;
    for (size_t i = 0; i < run_count; i++) {
        assert_true(runs[i].count > 0);
        sum += runs[i].count;
    }
    assert_int_equal(sum, count);
    return run_count;
}

/* A text as it stands from left to right, in letters: characters of a run from right to left are
 * turned around. Hebrew letters are written as A … from alef on. */
static void show(const char *text, char *out) {
    static vd_text_run runs[VD_TEXT_MAX_BYTES];
    static uint32_t characters[VD_TEXT_MAX_BYTES];
    const size_t run_count = split(text, runs, characters);
    for (size_t r = 0; r < run_count; r++) {
        for (size_t i = 0; i < runs[r].count; i++) {
            const size_t at = runs[r].begin + (runs[r].right_to_left ? runs[r].count - 1 - i : i);
            const uint32_t c = characters[at];
            *out++ = c >= 0x5D0 ? (char)('A' + c - 0x5D0) : (char)c;
        }
    }
    *out = '\0';
}

static void text_runs_both_ways(void **state) {
    (void)state;
    static const struct {
        const char *text, *shown;
    } cases[] = {
        {"abc", "abc"},
        {"אבג", "CBA"},
        {"אב גד", "DC BA"},
        {"abc אבג def", "abc CBA def"},   /* a name within a name */
        {"אבג abc דה", "ED abc CBA"},     /* the other way around */
        {"אבג 2814 ד", "D 2814 CBA"},     /* numbers from left to right */
        {"אב 1,234.5 ג", "C 1,234.5 BA"}, /* with separators */
        {"אב 12% ג", "C 12% BA"},         /* and units */
        {"abc אב 12 גד def", "abc DC 12 BA def"},
        {"abc 12 אב", "abc 12 BA"},
        {"abc (אב) d", "abc (BA) d"},
        {"אב!", "!BA"},
        {"abc!", "abc!"},
        {"123", "123"},
        {"", ""},
        {"12 אב", "BA 12"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char shown[256];
        show(cases[i].text, shown);
        assert_string_equal(shown, cases[i].shown);
    }
}

static void right_to_left_is_shaped_so(void **state) {
    (void)state;
    /* The first letter of the text is the last from the left: its outline lies right. */
    vd_outline word = outline_of("אל", 64), first = outline_of("א", 64), last = outline_of("ל", 64);
    assert_float_equal(word.advance, first.advance + last.advance, 1e-9);
    assert_float_equal(word.ink[0], last.ink[0], 1e-9);
    assert_float_equal(word.ink[2], last.advance + first.ink[2], 1e-9);
    vd_outline_finish(&word);
    vd_outline_finish(&first);
    vd_outline_finish(&last);
    /* Arabic and Latin at once, nothing lost. */
    vd_outline both = outline_of("Mt جبل 2814 m", 64);
    assert_int_equal(both.missing, 0);
    assert_true(both.advance > advance_of("Mt  2814 m") + 64);
    vd_outline_finish(&both);
}

/* ---- bad text -----------------------------------------------------------------------------------
 */

static void bad_bytes_are_replaced(void **state) {
    (void)state;
    static const struct {
        const char *text;
        int replaced, characters;
    } cases[] = {
        {"Z\xC3\xBCrich", 0, 6},
        {"Z\xFCrich", 1, 6},        /* Latin-1 */
        {"\xC3", 1, 1},             /* cut */
        {"a\xE2\x82", 1, 2},        /* cut: one for the whole */
        {"\xF0\x9F\x8F\xB4", 0, 1}, /* four bytes */
        {"\xC0\xAF", 2, 2},         /* longer than need be */
        {"\xE0\x80\xAF", 3, 3},     /* the same */
        {"\xED\xA0\x80", 3, 3},     /* a surrogate */
        {"\xF4\x90\x80\x80", 4, 4}, /* above U+10FFFF */
        {"\x80\xBF", 2, 2},         /* ends without beginnings */
        {"a\x01"
         "b\x7F",
         2, 4},                          /* control characters */
        {"a\tb\nc\r", 0, 6},             /* spaces */
        {"\xC2\x85|\xE2\x80\xA8", 0, 3}, /* line breaks of Unicode */
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        uint32_t characters[64];
        int replaced = -1;
        assert_int_equal(
            vd_text_decode(cases[i].text, strlen(cases[i].text), characters, &replaced),
            cases[i].characters);
        assert_int_equal(replaced, cases[i].replaced);
        vd_outline outline = outline_of(cases[i].text, 20);
        assert_int_equal(outline.replaced, cases[i].replaced);
        vd_outline_finish(&outline);
    }
    vd_outline bad = outline_of("\xFF", 64), good = outline_of("\xEF\xBF\xBD", 64);
    assert_true(bad.advance == good.advance);
    assert_memory_equal(bad.ink, good.ink, sizeof bad.ink);
    vd_outline_finish(&bad);
    vd_outline_finish(&good);
}

static void any_bytes_give_text(void **state) {
    (void)state;
    uint64_t random = 7;
    for (int round = 0; round < 3000; round++) {
        char text[64];
        const size_t size = test_random(&random) % (sizeof text - 1);
        for (size_t i = 0; i < size; i++) {
            const char c = (char)(test_random(&random) >> 17);
            /* Hebrew and Arabic lead bytes come often, to mix directions. */
            const uint64_t choice = test_random(&random) % 4;
            text[i] = c == '\0' ? 'x' : choice == 0 ? '\xD7' : choice == 1 ? (char)(c | '0') : c;
        }
        text[size] = '\0';
        vd_outline outline = outline_of(text, 16);
        assert_true(isfinite(outline.advance) && outline.missing >= 0);
        for (size_t i = 0; i < outline.path.point_count; i++) {
            assert_true(outline.path.points[i][1] >= outline.ink[1] - 8 &&
                        outline.path.points[i][1] <= outline.ink[3] + 8);
        }
        vd_outline_finish(&outline);
    }
}

static void missing_glyphs_are_counted(void **state) {
    (void)state;
    vd_outline outline = outline_of("a\xE5\xB1\xB1\xE5\xB1\xB1", 20); /* mountain, in Chinese */
    assert_int_equal(outline.missing, 2);
    assert_int_equal(outline.replaced, 0);
    assert_true(outline.ink[2] > advance_of("a") * 20 / 64 + 20);
    vd_outline_finish(&outline);
}

static void nothing_is_nothing(void **state) {
    (void)state;
    static const char *const texts[] = {"", " ", "\t \n"};
    for (int i = 0; i < 3; i++) {
        vd_outline outline = outline_of(texts[i], 20);
        assert_int_equal(outline.path.point_count, 0);
        assert_true(outline.ink[0] == 0 && outline.ink[2] == 0 && outline.ascent > 0);
        assert_true((outline.advance > 0) == (i > 0));
        vd_outline_finish(&outline);
    }
}

/* ---- refusals -----------------------------------------------------------------------------------
 */

static void assert_refused(vd_status status, vd_code code, const char *part) {
    assert_int_equal(status.code, code);
    if (strstr(status.message, part) == NULL) {
        fail_msg("\"%s\" does not say \"%s\"", status.message, part);
    }
}

static void bad_arguments_are_refused(void **state) {
    (void)state;
    vd_outline outline = {.missing = 77};
    static char text[VD_TEXT_MAX_BYTES + 2];
    memset(text, 'x', VD_TEXT_MAX_BYTES + 1);
    assert_refused(vd_font_outline(font, text, 20, &outline), VD_ERROR_LIMIT, "longer than 4096");
    static const double sizes[] = {0, -1, 65537, INFINITY, NAN};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        assert_refused(vd_font_outline(font, "x", sizes[i], &outline), VD_ERROR_ARGUMENT, "size");
    }
    assert_refused(vd_font_outline(NULL, "x", 20, &outline), VD_ERROR_ARGUMENT, "given");
    assert_refused(vd_font_outline(font, NULL, 20, &outline), VD_ERROR_ARGUMENT, "given");
    assert_refused(vd_font_outline(font, "x", 20, NULL), VD_ERROR_ARGUMENT, "given");
    assert_int_equal(outline.missing, 77);
    text[VD_TEXT_MAX_BYTES] = '\0';
    assert_ok(vd_font_outline(font, text, 20, &outline));
    vd_outline_finish(&outline);
}

static void fonts_are_found(void **state) {
    (void)state;
    vd_font *found = NULL;
    assert_ok(vd_font_find(context, "dejavu sans", &found));
    assert_string_equal(vd_font_family(found), "DejaVu Sans");
    vd_font *again = NULL;
    assert_ok(vd_font_find(context, vd_font_path(found), &again));
    assert_string_equal(vd_font_path(again), vd_font_path(found));
    vd_font_destroy(&found);
    vd_font_destroy(&again);
    assert_ok(vd_font_find(context, NULL, &found));
    vd_font_destroy(&found);
    assert_null(found);
    assert_ok(vd_font_find(context, "", &found));
    vd_font_destroy(&found);
    vd_font_destroy(&found);
    vd_font_destroy(NULL);
}

static void fonts_that_are_not_there_are_named(void **state) {
    (void)state;
    static const char *const nowhere[] = {VEDUTA_BINARY_DIR "/no-fonts", NULL};
    vd_font *found = NULL;
    assert_refused(vd_font_find_below(context, nowhere, NULL, &found), VD_ERROR_IO,
                   "install the package fonts-dejavu-core");
    assert_refused(vd_font_find_below(context, nowhere, "Liberation Sans", &found), VD_ERROR_IO,
                   "install the package fonts-liberation");
    assert_refused(vd_font_find_below(context, nowhere, "noto sans bold", &found), VD_ERROR_IO,
                   "install the package fonts-noto-core");
    assert_refused(vd_font_find(context, "Comic Sans", &found), VD_ERROR_IO,
                   "there is no font \"Comic Sans\"");
    assert_refused(vd_font_find(context, "/nowhere/a.ttf", &found), VD_ERROR_IO,
                   "/nowhere/a.ttf: No such file");
    assert_refused(vd_font_create(context, "/", &found), VD_ERROR_IO, "it is not a file");
    assert_refused(vd_font_create(context, NULL, &found), VD_ERROR_ARGUMENT, "path");
    assert_refused(vd_font_find(NULL, NULL, &found), VD_ERROR_ARGUMENT, "context");
    assert_null(found);
}

static void write_file(const char *path, const void *data, size_t size_bytes) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, size_bytes, file), size_bytes);
    fclose(file);
}

/* Cut or changed fonts are refused, or drawn somehow. */
static void damaged_fonts_do_no_harm(void **state) {
    (void)state;
    char path[] = VEDUTA_BINARY_DIR "/test-font-XXXXXX";
    const int descriptor = mkstemp(path);
    assert_true(descriptor >= 0);
    close(descriptor);
    vd_font *found = NULL;
    write_file(path, "this is no font", 15);
    assert_refused(vd_font_create(context, path, &found), VD_ERROR_FORMAT, "it is no font");
    write_file(path, "", 0);
    assert_refused(vd_font_create(context, path, &found), VD_ERROR_FORMAT, "it is no font");
    uint64_t random = 3;
    uint8_t *data = malloc(font->size_bytes);
    assert_non_null(data);
    for (int round = 0; round < 60; round++) {
        memcpy(data, font->data, font->size_bytes);
        const size_t size =
            round % 2 == 0 ? test_random(&random) % font->size_bytes : font->size_bytes;
        for (int i = 0; i < 200 && round % 2 == 1; i++) {
            /* In the tables' directory and the first tables more often than elsewhere. */
            const size_t within = i % 4 == 0 ? 300 : i % 4 == 1 ? 70000 : font->size_bytes;
            data[test_random(&random) % within] = (uint8_t)test_random(&random);
        }
        write_file(path, data, size);
        if (vd_font_create(context, path, &found).code == VD_OK) {
            vd_outline outline;
            if (vd_font_outline(found, "Äfi ببب 12", 20, &outline).code == VD_OK) {
                vd_outline_finish(&outline);
            }
            vd_font_destroy(&found);
        }
    }
    free(data);
    unlink(path);
}

static void memory_runs_out_cleanly(void **state) {
    (void)state;
    bool done = false;
    for (int fail_at = 2; !done; fail_at++) {
        test_allocator allocator = {.fail_at = 0};
        vd_context *failing = test_failing_context(&allocator);
        const int live = allocator.live;
        allocator.fail_at = fail_at;
        vd_font *made = NULL;
        vd_outline outline;
        vd_status status = vd_font_create(failing, vd_font_path(font), &made);
        if (status.code == VD_OK) {
            status = vd_font_outline(made, "Ä fi בא 12", 20, &outline);
            if (status.code == VD_OK) {
                vd_outline_finish(&outline);
            }
        }
        done = status.code == VD_OK && allocator.calls < fail_at;
        if (status.code != VD_OK) { /* FreeType does without some tables, others it misses */
            assert_true(status.code == VD_ERROR_MEMORY || status.code == VD_ERROR_FORMAT);
        }
        vd_font_destroy(&made);
        assert_int_equal(allocator.live, live);
        vd_context_destroy(&failing);
        assert_int_equal(allocator.live, 0);
        assert_true(fail_at < 10000);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(glyphs_cover_what_freetype_covers),
        cmocka_unit_test(metrics_are_those_of_the_font),
        cmocka_unit_test(outlines_scale),
        cmocka_unit_test(pairs_are_kerned),
        cmocka_unit_test(letters_are_joined),
        cmocka_unit_test(text_runs_both_ways),
        cmocka_unit_test(right_to_left_is_shaped_so),
        cmocka_unit_test(bad_bytes_are_replaced),
        cmocka_unit_test(any_bytes_give_text),
        cmocka_unit_test(missing_glyphs_are_counted),
        cmocka_unit_test(nothing_is_nothing),
        cmocka_unit_test(bad_arguments_are_refused),
        cmocka_unit_test(fonts_are_found),
        cmocka_unit_test(fonts_that_are_not_there_are_named),
        cmocka_unit_test(damaged_fonts_do_no_harm),
        cmocka_unit_test(memory_runs_out_cleanly),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
