/* function_parse.c: from text to nodes: a recursive-descent parser that checks types as it goes.
 *
 *     text       = statement { ";" statement } [ ";" ]
 *     statement  = name "=" choice
 *     choice     = or [ "?" choice ":" choice ]
 *     or         = and { "or" and }           and = not { "and" not }      not = "not" not |
 * compare compare    = sum [ ("<" | "<=" | ">" | ">=" | "==" | "!=") sum ] sum        = product {
 * ("+" | "-") product } product    = unary { ("*" | "/") unary } unary      = ("-" | "+") unary |
 * power power      = primary [ "^" unary ]      so −x^2 is −(x^2), 2^−1 is ½ and 2^3^2 is 2^(3^2)
 *     primary    = number | name | name "(" choice { "," choice } ")" | "(" choice ")"
 *
 * The first error is kept; after it every function returns at once.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "core/text.h"
#include "terrain/function_words.h"

#define MAX_NAMES 256

typedef struct value {
    bool color;
    int node[3]; /* a number is node[0] */
} value;

typedef struct variable {
    size_t at, bytes; /* its name in the text */
    value value;
} variable;

typedef struct parser {
    const char *text;
    size_t size, at;
    vd_function_builder *builder;
    int depth;
    bool failed;
    vd_status status;
    variable variables[MAX_NAMES];
    int variable_count;
} parser;

static value parse_choice(parser *p);
static value parse_unary(parser *p);

static const value nothing = {false, {0, 0, 0}};

static value fail_code(parser *p, vd_code code, size_t at, const char *sentence) {
    if (!p->failed) {
        p->failed = true;
        p->status = vd_function_error(code, p->text, p->size, at, sentence);
    }
    return nothing;
}

static value fail(parser *p, size_t at, const char *sentence) {
    return fail_code(p, VD_ERROR_FORMAT, at, sentence);
}

/* ---- letters ----------------------------------------------------------------------------------
 */

static bool is_letter(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}

static bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

static void skip_space(parser *p) {
    while (p->at < p->size && strchr(" \t\r\n", p->text[p->at]) != NULL) {
        p->at++;
    }
}

static bool looking_at(const parser *p, const char *symbol) {
    const size_t n = strlen(symbol);
    return p->size - p->at >= n && memcmp(p->text + p->at, symbol, n) == 0;
}

/* Takes a symbol if it comes next. */
static bool take(parser *p, const char *symbol) {
    skip_space(p);
    if (!looking_at(p, symbol)) {
        return false;
    }
    p->at += strlen(symbol);
    return true;
}

static size_t name_bytes(const parser *p, size_t at) {
    size_t n = 0;
    while (at + n < p->size &&
           (is_letter(p->text[at + n]) || (n > 0 && is_digit(p->text[at + n])))) {
        n++;
    }
    return n;
}

/* Takes a word of letters if it comes next, whole. */
static bool take_word(parser *p, const char *word) {
    skip_space(p);
    const size_t n = name_bytes(p, p->at);
    if (n != strlen(word) || memcmp(p->text + p->at, word, n) != 0) {
        return false;
    }
    p->at += n;
    return true;
}

/* ---- nodes with types -------------------------------------------------------------------------
 */

static value number(int node) {
    const value v = {false, {node, node, node}};
    return v;
}

static int make(parser *p, vd_function_op op, int a, int b, int c) {
    return vd_function_node_make(p->builder, op, a, b, c);
}

/* Applies an operation to each component; numbers among colours count for every component. */
static value each(parser *p, vd_function_op op, value a, value b, value c) {
    value v = {a.color || b.color || c.color, {0, 0, 0}};
    for (int i = 0; i < (v.color ? 3 : 1); i++) {
        v.node[i] = make(p, op, a.node[i], b.node[i], c.node[i]);
    }
    return v.color ? v : number(v.node[0]);
}

static value need_number(parser *p, value v, size_t at) {
    return v.color ? fail(p, at, "a number is needed here, and this is a colour") : v;
}

/* ---- calls ------------------------------------------------------------------------------------
 */

static value call(parser *p, const vd_function_word *word, const value *a) {
    value v = nothing;
    switch (word->kind) {
    case VD_WORD_HSV:
        v.color = true;
        vd_function_hsv(p->builder, a[0].node[0], a[1].node[0], a[2].node[0], v.node);
        return v;
    case VD_WORD_RGB:
        v.color = true;
        for (int i = 0; i < 3; i++) {
            v.node[i] = a[i].node[0];
        }
        return v;
    case VD_WORD_MIX: /* a + (b − a) t */
        v = each(p, VD_OP_SUBTRACT, a[1], a[0], nothing);
        v = each(p, VD_OP_MULTIPLY, v, a[2], nothing);
        return each(p, VD_OP_ADD, a[0], v, nothing);
    case VD_WORD_CLAMP:
        v = each(p, VD_OP_MAX, a[0], a[1], nothing);
        return each(p, VD_OP_MIN, v, a[2], nothing);
    default:
        return each(p, (vd_function_op)word->op, a[0], a[1], a[2]);
    }
}

static value parse_call(parser *p, const vd_function_word *word, size_t at) {
    value arguments[3] = {nothing, nothing, nothing};
    char sentence[160];
    int count = 0;
    if (!take(p, "(")) {
        snprintf(sentence, sizeof sentence, "%s is a function: write %s", word->name, word->usage);
        return fail(p, at, sentence);
    }
    do {
        skip_space(p);
        const size_t argument_at = p->at;
        const value v = parse_choice(p);
        if (p->failed) {
            return nothing;
        }
        if (count == word->arguments) {
            snprintf(sentence, sizeof sentence, "one argument too many: write %s", word->usage);
            return fail(p, argument_at, sentence);
        }
        arguments[count++] = word->takes_colors ? v : need_number(p, v, argument_at);
    } while (take(p, ","));
    if (!take(p, ")")) {
        return fail(p, p->at, "\",\" or \")\" is missing before this");
    }
    if (count < word->arguments) {
        snprintf(sentence, sizeof sentence, "too few arguments: write %s", word->usage);
        return fail(p, p->at - 1, sentence);
    }
    return p->failed ? nothing : call(p, word, arguments);
}

static const variable *find_variable(const parser *p, size_t at, size_t bytes) {
    for (int i = 0; i < p->variable_count; i++) {
        const variable *v = &p->variables[i];
        if (v->bytes == bytes && memcmp(p->text + v->at, p->text + at, bytes) == 0) {
            return v;
        }
    }
    return NULL;
}

static value unknown_name(parser *p, size_t at, size_t bytes) {
    char sentence[160];
    const int shown = bytes < 30 ? (int)bytes : 30;
    const char *near = vd_function_word_near(p->text + at, bytes);
    if (near != NULL) {
        snprintf(sentence, sizeof sentence, "unknown name \"%.*s\"; did you mean %s?", shown,
                 p->text + at, near);
    } else {
        snprintf(sentence, sizeof sentence,
                 "unknown name \"%.*s\"; a variable is defined before it is used", shown,
                 p->text + at);
    }
    return fail(p, at, sentence);
}

static value parse_name(parser *p) {
    const size_t at = p->at, bytes = name_bytes(p, at);
    p->at += bytes;
    const vd_function_word *word = vd_function_word_find(p->text + at, bytes);
    const variable *known = find_variable(p, at, bytes);
    skip_space(p);
    if (known != NULL && !looking_at(p, "(")) { /* rgb is a variable, rgb( a function */
        return known->value;
    }
    if (word == NULL) {
        return known != NULL ? fail(p, p->at,
                                    "an operator is missing before this \"(\": a "
                                    "variable cannot be called")
                             : unknown_name(p, at, bytes);
    }
    switch (word->kind) {
    case VD_WORD_X:
        return number(0);
    case VD_WORD_Y:
        return number(1);
    case VD_WORD_PI:
        return number(vd_function_constant(p->builder, 3.14159265f));
    case VD_WORD_LOGIC:
        return fail(p, at, "a number, a name or \"(\" is missing before this");
    default:
        return parse_call(p, word, at);
    }
}

static value parse_number(parser *p) {
    const size_t at = p->at;
    vd_text text = vd_text_make(p->text + at, p->size - at);
    double d = 0.0;
    if (!vd_text_number(&text, &d)) {
        return fail(p, at, "a number needs a digit");
    }
    p->at += (size_t)(text.at - (p->text + at));
    if (d > 3.4028235e38) {
        return fail(p, at, "this number is too large: at most 3.4e38 can be computed with");
    }
    return number(vd_function_constant(p->builder, (float)d));
}

static value parse_primary(parser *p) {
    skip_space(p);
    if (p->at >= p->size) {
        return fail(p, p->at, "the text ends where a number, a name or \"(\" should come");
    }
    const char c = p->text[p->at];
    if (is_digit(c) || c == '.') {
        return parse_number(p);
    }
    if (is_letter(c)) {
        return parse_name(p);
    }
    if (take(p, "π")) {
        return number(vd_function_constant(p->builder, 3.14159265f));
    }
    const size_t at = p->at;
    if (take(p, "(")) {
        const value v = parse_choice(p);
        if (!p->failed && !take(p, ")")) {
            return fail(p, p->at,
                        p->at < p->size ? "\")\" or an operator is missing before this"
                                        : "the text ends before a \"(\" is closed");
        }
        return v;
    }
    return fail(p, at, "a number, a name or \"(\" should come here");
}

/* ---- operators, from the tightest -------------------------------------------------------------
 */

/* Every way down passes here or parse_choice, so that neither can exhaust the stack. */
static bool enter(parser *p) {
    if (p->depth == VD_FUNCTION_MAX_DEPTH) {
        char sentence[100];
        snprintf(sentence, sizeof sentence, "nested more than %d deep; use variables",
                 VD_FUNCTION_MAX_DEPTH);
        fail_code(p, VD_ERROR_LIMIT, p->at < p->size ? p->at : p->size, sentence);
    }
    p->depth++;
    return !p->failed;
}

static value parse_power(parser *p) {
    skip_space(p);
    size_t at = p->at;
    value base = parse_primary(p);
    if (p->failed || !take(p, "^")) {
        return base;
    }
    base = need_number(p, base, at);
    skip_space(p);
    at = p->at;
    const value exponent = need_number(p, parse_unary(p), at);
    return p->failed ? nothing
                     : number(vd_function_power(p->builder, base.node[0], exponent.node[0]));
}

static value parse_unary(parser *p) {
    value v = nothing;
    if (enter(p)) {
        if (take(p, "-") || take(p, "−")) {
            v = parse_unary(p);
            v = p->failed ? nothing : each(p, VD_OP_NEGATE, v, nothing, nothing);
        } else if (take(p, "+")) {
            v = parse_unary(p);
        } else {
            v = parse_power(p);
        }
    }
    p->depth--;
    return v;
}

static value parse_product(parser *p) {
    value v = parse_unary(p);
    while (!p->failed) {
        const bool times = take(p, "*") || take(p, "×");
        if (!times && !take(p, "/") && !take(p, "÷")) {
            break;
        }
        const value right = parse_unary(p);
        v = p->failed ? nothing : each(p, times ? VD_OP_MULTIPLY : VD_OP_DIVIDE, v, right, nothing);
    }
    return v;
}

static value parse_sum(parser *p) {
    value v = parse_product(p);
    while (!p->failed) {
        const bool plus = take(p, "+");
        if (!plus && !take(p, "-") && !take(p, "−")) {
            break;
        }
        const value right = parse_product(p);
        v = p->failed ? nothing : each(p, plus ? VD_OP_ADD : VD_OP_SUBTRACT, v, right, nothing);
    }
    return v;
}

/* Takes a comparison: its operation and whether its sides change places (a > b is b < a). */
static bool take_comparison(parser *p, vd_function_op *op, bool *swap) {
    static const struct {
        const char *symbol;
        vd_function_op op;
        bool swap;
    } comparisons[] = {
        {"<=", VD_OP_LESS_EQUAL, false}, {">=", VD_OP_LESS_EQUAL, true}, {"==", VD_OP_EQUAL, false},
        {"!=", VD_OP_NOT_EQUAL, false},  {"<", VD_OP_LESS, false},       {">", VD_OP_LESS, true},
    };
    for (size_t i = 0; i < sizeof comparisons / sizeof comparisons[0]; i++) {
        if (take(p, comparisons[i].symbol)) {
            *op = comparisons[i].op;
            *swap = comparisons[i].swap;
            return true;
        }
    }
    return false;
}

static value parse_compare(parser *p) {
    vd_function_op op = VD_OP_LESS;
    bool swap = false;
    skip_space(p);
    size_t at = p->at;
    value a = parse_sum(p);
    if (p->failed || !take_comparison(p, &op, &swap)) {
        return a;
    }
    a = need_number(p, a, at);
    skip_space(p);
    at = p->at;
    const value b = need_number(p, parse_sum(p), at);
    skip_space(p);
    at = p->at;
    vd_function_op next;
    if (!p->failed && take_comparison(p, &next, &(bool){false})) {
        return fail(p, at, "comparisons do not chain; write a < b and b < c");
    }
    const int left = swap ? b.node[0] : a.node[0], right = swap ? a.node[0] : b.node[0];
    return p->failed ? nothing : number(make(p, op, left, right, 0));
}

static value parse_not(parser *p) {
    value v = nothing;
    if (enter(p)) {
        if (take_word(p, "not")) {
            skip_space(p);
            const size_t at = p->at;
            v = need_number(p, parse_not(p), at);
            v = p->failed ? nothing : number(make(p, VD_OP_NOT, v.node[0], 0, 0));
        } else {
            v = parse_compare(p);
        }
    }
    p->depth--;
    return v;
}

static value parse_and(parser *p) {
    skip_space(p);
    size_t at = p->at;
    value v = parse_not(p);
    while (!p->failed && (take_word(p, "and") || take(p, "&&"))) {
        v = need_number(p, v, at);
        skip_space(p);
        at = p->at;
        const value right = need_number(p, parse_not(p), at);
        v = p->failed ? nothing : number(make(p, VD_OP_AND, v.node[0], right.node[0], 0));
    }
    return v;
}

static value parse_or(parser *p) {
    skip_space(p);
    size_t at = p->at;
    value v = parse_and(p);
    while (!p->failed && (take_word(p, "or") || take(p, "||"))) {
        v = need_number(p, v, at);
        skip_space(p);
        at = p->at;
        const value right = need_number(p, parse_and(p), at);
        v = p->failed ? nothing : number(make(p, VD_OP_OR, v.node[0], right.node[0], 0));
    }
    return v;
}

static value parse_choice(parser *p) {
    value v = nothing;
    if (enter(p)) {
        skip_space(p);
        const size_t at = p->at;
        v = parse_or(p);
        if (!p->failed && take(p, "?")) {
            v = need_number(p, v, at);
            const value yes = parse_choice(p);
            if (!p->failed && !take(p, ":")) {
                fail(p, p->at, "\":\" is missing: write condition ? a : b");
            }
            skip_space(p);
            const size_t no_at = p->at;
            const value no = p->failed ? nothing : parse_choice(p);
            if (!p->failed && yes.color != no.color) {
                fail(p, no_at, "both sides of ?: must be numbers, or both colours");
            }
            v.node[1] = v.node[2] = v.node[0];
            v = p->failed ? nothing : each(p, VD_OP_SELECT, v, yes, no);
        }
    }
    p->depth--;
    return v;
}

/* ---- statements -------------------------------------------------------------------------------
 */

static void check_name(parser *p, size_t at, size_t bytes) {
    const vd_function_word *word = vd_function_word_find(p->text + at, bytes);
    if (bytes == 0) {
        fail(p, at, "a statement begins with a name: h = …");
    } else if (word != NULL && word->kind != VD_WORD_RGB) {
        fail(p, at, "this name is the language's own; choose another");
    } else if (find_variable(p, at, bytes) != NULL) {
        fail(p, at, "this name is defined already; choose another");
    } else if (p->variable_count == MAX_NAMES) {
        fail_code(p, VD_ERROR_LIMIT, at, "more than 256 variables");
    }
}

static void explain_end(parser *p) {
    const char c = p->text[p->at];
    if (c == '=') {
        fail(p, p->at, "\"=\" defines a variable; write \"==\" to compare");
    } else if (is_letter(c) || is_digit(c) || c == '(' || c == '.') {
        fail(p, p->at, "an operator or \";\" is missing before this (multiply with *)");
    } else if (c == ')') {
        fail(p, p->at, "this \")\" closes nothing");
    } else {
        fail(p, p->at, "an operator or \";\" should come here");
    }
}

static void parse_statement(parser *p) {
    const size_t at = p->at, bytes = name_bytes(p, at);
    check_name(p, at, bytes);
    if (p->failed) {
        return;
    }
    p->at += bytes;
    skip_space(p);
    if (looking_at(p, "==") || !take(p, "=")) {
        fail(p, p->at, "\"=\" is missing: a statement is name = expression");
        return;
    }
    skip_space(p);
    const size_t expression_at = p->at;
    const value v = parse_choice(p);
    if (!p->failed && p->builder->full) {
        char sentence[100];
        snprintf(sentence, sizeof sentence, "the function has more than %d operations",
                 VD_FUNCTION_MAX_STEPS);
        fail_code(p, VD_ERROR_LIMIT, at, sentence);
    }
    if (!p->failed && bytes == 1 && p->text[at] == 'h' && v.color) {
        fail(p, expression_at, "h is the height, a number, and this is a colour");
    }
    if (!p->failed && bytes == 3 && memcmp(p->text + at, "rgb", 3) == 0 && !v.color) {
        fail(p, expression_at, "rgb is a colour: write rgb(r, g, b) or hsv(h, s, v)");
    }
    if (!p->failed) {
        const variable made = {at, bytes, v};
        p->variables[p->variable_count++] = made;
    }
}

static void parse_text(parser *p) {
    for (skip_space(p); !p->failed && p->at < p->size; skip_space(p)) {
        if (take(p, ";")) { /* an empty statement */
            continue;
        }
        parse_statement(p);
        skip_space(p);
        if (!p->failed && p->at < p->size && !take(p, ";")) {
            explain_end(p);
        }
    }
}

vd_status vd_function_parse(const char *text, size_t size_bytes, vd_function_builder *builder,
                            int *h, int rgb[3], bool *has_color) {
    parser p; /* 10 KiB */
    memset(&p, 0, sizeof p);
    p.text = text;
    p.size = size_bytes;
    p.builder = builder;
    parse_text(&p);
    if (p.failed) {
        return p.status;
    }
    bool has_height = false;
    *has_color = false;
    for (int i = 0; i < p.variable_count; i++) {
        const variable *v = &p.variables[i];
        if (v->bytes == 1 && text[v->at] == 'h') {
            *h = v->value.node[0];
            has_height = true;
        } else if (v->bytes == 3 && memcmp(text + v->at, "rgb", 3) == 0) {
            memcpy(rgb, v->value.node, sizeof v->value.node);
            *has_color = true;
        }
    }
    if (!has_height) {
        return vd_function_error(VD_ERROR_FORMAT, text, size_bytes, size_bytes,
                                 "the height is missing: the text needs h = …");
    }
    return vd_success();
}
