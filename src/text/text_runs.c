/* text_runs.c: which characters are shaped together, and where they stand.
 *
 * Directions follow Unicode Annex 9 (Davis 2022) with its rules for what a line on a map has:
 * letters, numbers, their separators, and neutrals between them (P2, P3, W1 … W7, N1, N2, I1, I2,
 * L1, L2). Explicit embeddings, isolates and pairs of brackets (X1 … X10, N0) are left out: nobody
 * types them into a peak's name. Letters' directions are those of their scripts.
 */
#include "text/text_runs.h"

#define REPLACEMENT 0xFFFDu

/* ---- characters ---------------------------------------------------------------------------------
 */

/* Decodes one character; *size becomes the bytes that it takes, at least 1. False: they are none,
 * but the beginning of one that does not go on (Unicode 15, table 3-7). */
static bool decode_one(const uint8_t *at, size_t left, uint32_t *out, size_t *size) {
    const uint8_t first = at[0];
    *size = 1;
    *out = first;
    if (first < 0x80) {
        return true;
    }
    const size_t follow = first >= 0xF0 ? 3 : first >= 0xE0 ? 2 : 1;
    if (first < 0xC2 || first > 0xF4) {
        return false;
    }
    uint32_t c = first & (0x3Fu >> follow);
    for (size_t i = 1; i <= follow; i++) {
        uint8_t low = 0x80, high = 0xBF;
        if (i == 1) { /* neither longer than need be, nor a surrogate, nor above U+10FFFF */
            low = first == 0xE0 ? 0xA0 : first == 0xF0 ? 0x90 : low;
            high = first == 0xED ? 0x9F : first == 0xF4 ? 0x8F : high;
        }
        if (i >= left || at[i] < low || at[i] > high) {
            return false;
        }
        c = c << 6 | (at[i] & 0x3Fu);
        *size = i + 1;
    }
    *out = c;
    return true;
}

size_t vd_text_decode(const char *utf8, size_t size_bytes, uint32_t *out, int *replaced) {
    size_t count = 0;
    *replaced = 0;
    for (size_t i = 0; i < size_bytes;) {
        size_t size;
        uint32_t c;
        const bool good = decode_one((const uint8_t *)utf8 + i, size_bytes - i, &c, &size);
        i += size;
        if (good && ((c >= '\t' && c <= '\r') || c == 0x85 || c == 0x2028 || c == 0x2029)) {
            c = ' ';
        } else if (!good || c < 0x20 || (c >= 0x7F && c < 0xA0)) {
            c = REPLACEMENT;
            ++*replaced;
        }
        out[count++] = c;
    }
    return count;
}

/* ---- kinds --------------------------------------------------------------------------------------
 */

/* The bidirectional classes that are told apart. */
enum {
    LEFT = 0, /* L */
    RIGHT,    /* R and AL */
    NUMBER,   /* EN */
    ARABIC,   /* AN */
    SIGN,     /* ES: + − */
    UNIT,     /* ET: % ° currency */
    POINT,    /* CS: . , : / */
    MARK,     /* NSM */
    NEUTRAL,  /* ON, WS */
};

static bool is_in(uint32_t c, uint32_t first, uint32_t last) {
    return c >= first && c <= last;
}

static bool is_mark(hb_unicode_general_category_t category) {
    return category == HB_UNICODE_GENERAL_CATEGORY_NON_SPACING_MARK ||
           category == HB_UNICODE_GENERAL_CATEGORY_ENCLOSING_MARK;
}

static bool is_letter(hb_unicode_general_category_t category) {
    switch (category) {
    case HB_UNICODE_GENERAL_CATEGORY_LOWERCASE_LETTER:
    case HB_UNICODE_GENERAL_CATEGORY_MODIFIER_LETTER:
    case HB_UNICODE_GENERAL_CATEGORY_OTHER_LETTER:
    case HB_UNICODE_GENERAL_CATEGORY_TITLECASE_LETTER:
    case HB_UNICODE_GENERAL_CATEGORY_UPPERCASE_LETTER:
    case HB_UNICODE_GENERAL_CATEGORY_LETTER_NUMBER:
    case HB_UNICODE_GENERAL_CATEGORY_SPACING_MARK:
        return true;
    default:
        return false;
    }
}

static uint8_t find_kind(hb_unicode_funcs_t *unicode, uint32_t c, hb_script_t script) {
    const hb_unicode_general_category_t category = hb_unicode_general_category(unicode, c);
    if (is_mark(category)) {
        return MARK;
    }
    if (is_in(c, '0', '9') || is_in(c, 0x6F0, 0x6F9) || c == 0xB2 || c == 0xB3 || c == 0xB9) {
        return NUMBER;
    }
    if (is_in(c, 0x660, 0x669) || c == 0x66B || c == 0x66C) {
        return ARABIC;
    }
    if (c == '+' || c == '-' || c == 0x2212) {
        return SIGN;
    }
    if (c == '#' || c == '%' || c == 0xB0 || c == 0xB1 || is_in(c, 0x2030, 0x2034) ||
        category == HB_UNICODE_GENERAL_CATEGORY_CURRENCY_SYMBOL) {
        return UNIT;
    }
    if (c == '.' || c == ',' || c == ':' || c == '/' || c == 0xA0 || c == 0x202F) {
        return POINT;
    }
    if (c == 0x200E || c == 0x200F) { /* the marks that people do type, to say a direction */
        return c == 0x200E ? LEFT : RIGHT;
    }
    if (is_letter(category) || category == HB_UNICODE_GENERAL_CATEGORY_DECIMAL_NUMBER) {
        return hb_script_get_horizontal_direction(script) == HB_DIRECTION_RTL ? RIGHT : LEFT;
    }
    return NEUTRAL;
}

/* Scripts: what is common to all (digits, spaces, marks) goes with what stands before it; at the
 * beginning with what comes first. */
static void note_scripts(const uint32_t *characters, size_t count, vd_text_note *notes) {
    hb_unicode_funcs_t *unicode = hb_unicode_funcs_get_default();
    hb_script_t last = HB_SCRIPT_INVALID;
    for (size_t i = 0; i < count; i++) {
        hb_script_t script = hb_unicode_script(unicode, characters[i]);
        notes[i].kind = find_kind(unicode, characters[i], script);
        if (script == HB_SCRIPT_COMMON || script == HB_SCRIPT_INHERITED ||
            script == HB_SCRIPT_UNKNOWN) {
            script = last;
        } else if (last == HB_SCRIPT_INVALID) {
            for (size_t j = 0; j < i; j++) {
                notes[j].script = script;
            }
        }
        notes[i].script = last = script;
    }
    for (size_t i = 0; i < count && last == HB_SCRIPT_INVALID; i++) {
        notes[i].script = HB_SCRIPT_LATIN;
    }
}

/* ---- directions -----------------------------------------------------------------------------
 */

/* W1 … W7: what marks, signs, units and separators become. */
static void resolve_weak(vd_text_note *notes, size_t count, uint8_t base) {
    uint8_t last = base;
    for (size_t i = 0; i < count; i++) { /* W1, W4 */
        vd_text_note *n = &notes[i];
        const bool inside = i > 0 && i + 1 < count && notes[i - 1].kind == notes[i + 1].kind;
        if (n->kind == MARK) {
            n->kind = last;
        } else if ((n->kind == SIGN || n->kind == POINT) && inside &&
                   (notes[i - 1].kind == NUMBER ||
                    (notes[i - 1].kind == ARABIC && n->kind == POINT))) {
            n->kind = notes[i - 1].kind;
        }
        last = n->kind;
    }
    for (size_t i = 0; i < count; i++) { /* W5, W6 */
        size_t end = i;
        while (end < count && notes[end].kind == UNIT) {
            end++;
        }
        const bool by_number = end > i && ((i > 0 && notes[i - 1].kind == NUMBER) ||
                                           (end < count && notes[end].kind == NUMBER));
        for (; i < end; i++) {
            notes[i].kind = by_number ? NUMBER : NEUTRAL;
        }
        if (i < count && (notes[i].kind == SIGN || notes[i].kind == POINT)) {
            notes[i].kind = NEUTRAL;
        }
    }
    uint8_t strong = base;
    for (size_t i = 0; i < count; i++) { /* W7 */
        if (notes[i].kind == LEFT || notes[i].kind == RIGHT) {
            strong = notes[i].kind;
        } else if (notes[i].kind == NUMBER && strong == LEFT) {
            notes[i].kind = LEFT;
        }
    }
}

/* The direction that a neutral sees in a neighbour: numbers are as letters from right to left. */
static uint8_t direction_of(uint8_t kind) {
    return kind == LEFT ? LEFT : RIGHT;
}

/* N1, N2: neutrals between two of one direction take it, others the line's; I1, I2: levels. */
static void resolve_neutrals(vd_text_note *notes, size_t count, uint8_t base) {
    for (size_t i = 0; i < count;) {
        size_t end = i;
        while (end < count && notes[end].kind == NEUTRAL) {
            end++;
        }
        if (end == i) {
            i++;
            continue;
        }
        const uint8_t before = i > 0 ? direction_of(notes[i - 1].kind) : base;
        const uint8_t after = end < count ? direction_of(notes[end].kind) : base;
        for (; i < end; i++) {
            notes[i].kind = before == after ? before : base;
        }
    }
    for (size_t i = 0; i < count; i++) {
        const uint8_t kind = notes[i].kind;
        notes[i].level = kind == RIGHT ? 1 : kind == LEFT ? (base == LEFT ? 0 : 2) : 2;
    }
}

/* L2: turns around, from the highest level down, every stretch of runs of at least that level. */
static void order_runs(vd_text_run *runs, size_t count, const vd_text_note *notes) {
    for (int level = 2; level > 0; level--) {
        for (size_t i = 0; i < count;) {
            size_t end = i;
            while (end < count && notes[runs[end].begin].level >= level) {
                end++;
            }
            for (size_t a = i, b = end; a + 1 < b; a++, b--) {
                const vd_text_run kept = runs[a];
                runs[a] = runs[b - 1];
                runs[b - 1] = kept;
            }
            i = end > i ? end : i + 1;
        }
    }
}

size_t vd_text_split(const uint32_t *characters, size_t count, vd_text_note *notes,
                     vd_text_run *runs) {
    note_scripts(characters, count, notes);
    uint8_t base = LEFT;
    for (size_t i = 0; i < count; i++) {
        if (notes[i].kind == LEFT || notes[i].kind == RIGHT) {
            base = notes[i].kind;
            break;
        }
    }
    resolve_weak(notes, count, base);
    resolve_neutrals(notes, count, base);
    for (size_t i = count; i > 0 && characters[i - 1] == ' '; i--) { /* L1 */
        notes[i - 1].level = base;
    }
    size_t made = 0;
    for (size_t i = 0; i < count; i++) {
        if (i == 0 || notes[i].level != notes[i - 1].level ||
            notes[i].script != notes[i - 1].script) {
            runs[made++] = (vd_text_run){i, 0, notes[i].script, (notes[i].level & 1) != 0};
        }
        runs[made - 1].count++;
    }
    order_runs(runs, made, notes);
    return made;
}
