/* options.c: the option table's parser and its checks. */
#include "options.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static vd_status out_of_memory(void) {
    return vd_failure(VD_ERROR_MEMORY, "out of memory while reading the options");
}

bool vd_read_number(const char *text, double *out) {
    /* strtod skips blanks and knows hexadecimal, infinities and NaN: none of them is a number that
     * a person gives on purpose. */
    if (text[0] == '\0' || strspn(text, "+-.0123456789eE") != strlen(text)) {
        return false;
    }
    char *end = NULL;
    double number = strtod(text, &end);
    if (end == text || *end != '\0' || !isfinite(number)) {
        return false;
    }
    *out = number;
    return true;
}

void vd_write_number(double number, char out[32]) {
    for (int digits = 15; digits <= 17; digits++) {
        snprintf(out, 32, "%.*g", digits, number);
        if (strtod(out, NULL) == number) {
            return;
        }
    }
}

bool vd_read_distance(const char *text, double *out) {
    static const struct {
        const char *ending;
        double metres;
    } units[] = {{"km", 1000.0}, {"m", 1.0}, {"ft", 0.3048}, {"", 1.0}};
    size_t length = strlen(text);
    for (size_t i = 0; i < sizeof units / sizeof units[0]; i++) {
        size_t ending = strlen(units[i].ending);
        char number[64];
        if (length <= ending || length - ending >= sizeof number ||
            strcmp(text + length - ending, units[i].ending) != 0) {
            continue;
        }
        memcpy(number, text, length - ending);
        number[length - ending] = '\0';
        double value = 0.0;
        if (!vd_read_number(number, &value) || !isfinite(value * units[i].metres)) {
            return false;
        }
        *out = value * units[i].metres;
        return true;
    }
    return false;
}

int vd_read_numbers(const char *text, double *out, int most) {
    for (int count = 0; count < most; count++) {
        size_t length = strcspn(text, ",");
        char number[64];
        if (length >= sizeof number) {
            return -1;
        }
        memcpy(number, text, length);
        number[length] = '\0';
        if (!vd_read_number(number, &out[count])) {
            return -1;
        }
        if (text[length] == '\0') {
            return count + 1;
        }
        text += length + 1;
    }
    return -1;
}

/* The number of insertions, deletions, replacements and swaps of neighbours that lead from a to b
 * (Damerau 1964, in the restricted form); names longer than the table count as far away. */
static int edit_distance(const char *a, const char *b) {
    enum { LONGEST = 31 };
    int rows = (int)strlen(a), columns = (int)strlen(b);
    if (rows > LONGEST || columns > LONGEST) {
        return LONGEST + 1;
    }
    int cost[LONGEST + 1][LONGEST + 1];
    for (int i = 0; i <= rows; i++) {
        for (int j = 0; j <= columns; j++) {
            if (i == 0 || j == 0) {
                cost[i][j] = i + j;
                continue;
            }
            int best = cost[i - 1][j - 1] + (a[i - 1] != b[j - 1]);
            best = cost[i - 1][j] + 1 < best ? cost[i - 1][j] + 1 : best;
            best = cost[i][j - 1] + 1 < best ? cost[i][j - 1] + 1 : best;
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] &&
                cost[i - 2][j - 2] + 1 < best) {
                best = cost[i - 2][j - 2] + 1;
            }
            cost[i][j] = best;
        }
    }
    return cost[rows][columns];
}

const char *vd_nearest_name(const char *typed, const char *const *names, int count) {
    const char *nearest = NULL;
    /* Near means: a third of the letters wrong at most, and at most three. */
    int length = (int)strnlen(typed, 64);
    int limit = length < 3 ? 1 : length < 9 ? 1 + length / 3 : 4;
    for (int i = 0; i < count; i++) {
        int distance = edit_distance(typed, names[i]);
        if (distance < limit) {
            limit = distance;
            nearest = names[i];
        }
    }
    for (int i = 0; i < count && nearest == NULL && length >= 3; i++) {
        if (strncmp(typed, names[i], (size_t)length) == 0 ||
            strncmp(typed, names[i], strlen(names[i])) == 0) {
            nearest = names[i]; /* "col" for "color", "colours" for "color" */
        }
    }
    return nearest;
}

vd_status vd_options_init(vd_options *options, const char *command, const vd_option *table,
                          int count) {
    vd_options made = {.command = command, .table = table, .count = count};
    made.values = calloc((size_t)count, sizeof made.values[0]);
    if (made.values == NULL) {
        return out_of_memory();
    }
    for (int i = 0; i < count; i++) {
        if (table[i].fallback == NULL) {
            continue;
        }
        vd_status status = vd_options_set(&made, i, table[i].fallback, VD_SOURCE_DEFAULT);
        if (status.code != VD_OK) {
            vd_options_finish(&made);
            return status;
        }
    }
    *options = made;
    return vd_success();
}

static void drop_inputs(vd_options *options) {
    for (int i = 0; i < options->input_count; i++) {
        free(options->inputs[i]);
    }
    free(options->inputs);
    options->inputs = NULL;
    options->input_count = 0;
}

void vd_options_finish(vd_options *options) {
    drop_inputs(options);
    for (int i = 0; options->values != NULL && i < options->count; i++) {
        free(options->values[i].text);
    }
    free(options->values);
    options->values = NULL;
}

int vd_options_find(const vd_options *options, const char *key) {
    for (int i = 0; i < options->count; i++) {
        if (strcmp(options->table[i].key, key) == 0) {
            return i;
        }
    }
    return -1;
}

bool vd_options_given(const vd_options *options, int index) {
    return options->values[index].source >= VD_SOURCE_FILE;
}

/* Finds `word` in "first|second|third"; returns its position or −1. */
static int choice_index(const char *choices, const char *word) {
    size_t length = strlen(word);
    for (int index = 0; *choices != '\0'; index++) {
        size_t span = strcspn(choices, "|");
        if (span == length && strncmp(choices, word, length) == 0) {
            return index;
        }
        choices += span + (choices[span] == '|');
    }
    return -1;
}

/* Returns 1 for on, 0 for off, −1 for anything else. */
static int on_or_off(const char *text) {
    if (strcmp(text, "on") == 0 || strcmp(text, "true") == 0 || strcmp(text, "yes") == 0) {
        return 1;
    }
    if (strcmp(text, "off") == 0 || strcmp(text, "false") == 0 || strcmp(text, "no") == 0) {
        return 0;
    }
    return -1;
}

static vd_status check_range(const vd_option *option, const char *text, double number) {
    bool bounded = option->min != 0.0 || option->max != 0.0;
    if (bounded && !(number >= option->min && number <= option->max)) {
        return vd_failure(VD_ERROR_ARGUMENT, "--%s: %.40s is out of range; give %g to %g%s%s",
                          option->key, text, option->min, option->max,
                          option->unit != NULL ? " " : "",
                          option->unit != NULL ? option->unit : "");
    }
    return vd_success();
}

/* Returns 0 for off, 1 for on, 2, 3 … for an option's further words, −1 for anything else. */
static int flag_value(const vd_option *option, const char *text) {
    int value = on_or_off(text);
    if (value < 0 && option->argument != NULL) {
        value = choice_index(option->argument, text);
        value += value >= 0 ? 2 : 0;
    }
    return value;
}

/* Reads the number that stands behind a text, by the option's type. */
static vd_status interpret(const vd_option *option, const char *text, double *number) {
    const char *unit = option->unit != NULL ? option->unit : "";
    const char *open = option->unit != NULL ? " (" : "", *close = option->unit != NULL ? ")" : "";
    switch (option->type) {
    case VD_OPTION_SWITCH:
    case VD_OPTION_FLAG: {
        int on = flag_value(option, text);
        if (on < 0) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "--%s: \"%.40s\" is neither on nor off%s%s; give one", option->key,
                              text, option->argument != NULL ? " nor one of " : "",
                              option->argument != NULL ? option->argument : "");
        }
        *number = on;
        return vd_success();
    }
    case VD_OPTION_CHOICE: {
        int index = choice_index(option->argument, text);
        if (index < 0) {
            return vd_failure(VD_ERROR_ARGUMENT, "--%s: there is no \"%.40s\"; give one of %s",
                              option->key, text, option->argument);
        }
        *number = index;
        return vd_success();
    }
    case VD_OPTION_INTEGER:
        if (!vd_read_number(text, number) || *number != floor(*number)) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "--%s: \"%.40s\" is not a whole number; give one%s%s%s", option->key,
                              text, open, unit, close);
        }
        return check_range(option, text, *number);
    case VD_OPTION_REAL:
        if (!vd_read_number(text, number)) {
            return vd_failure(VD_ERROR_ARGUMENT, "--%s: \"%.40s\" is not a number; give one%s%s%s",
                              option->key, text, open, unit, close);
        }
        return check_range(option, text, *number);
    case VD_OPTION_DISTANCE:
        if (!vd_read_distance(text, number)) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "--%s: \"%.40s\" is not a distance; give metres, such as 500 or 20km",
                              option->key, text);
        }
        return check_range(option, text, *number);
    case VD_OPTION_FILE:
        if (text[0] == '\0') {
            return vd_failure(VD_ERROR_ARGUMENT, "--%s: the name is empty; give a file",
                              option->key);
        }
        return vd_success();
    default:
        return vd_success();
    }
}

vd_status vd_options_set(vd_options *options, int index, const char *text,
                         vd_option_source source) {
    vd_option_value *value = &options->values[index];
    double number = 0.0;
    vd_status status = interpret(&options->table[index], text, &number);
    if (status.code != VD_OK || source < value->source) {
        return status;
    }
    char *copy = strdup(text);
    if (copy == NULL) {
        return out_of_memory();
    }
    free(value->text);
    *value = (vd_option_value){.source = source, .text = copy, .number = number};
    return vd_success();
}

vd_status vd_options_drop_file_value(vd_options *options, int index) {
    vd_option_value *value = &options->values[index];
    if (value->source != VD_SOURCE_FILE) {
        return vd_success();
    }
    free(value->text);
    *value = (vd_option_value){.source = VD_SOURCE_DEFAULT};
    const char *fallback = options->table[index].fallback;
    return fallback == NULL ? vd_success()
                            : vd_options_set(options, index, fallback, VD_SOURCE_DEFAULT);
}

vd_status vd_options_add_input(vd_options *options, const char *path, vd_option_source source) {
    if (source < options->input_source) {
        return vd_success();
    }
    if (source > options->input_source) {
        drop_inputs(options);
        options->input_source = source;
    }
    char **longer = realloc(options->inputs, ((size_t)options->input_count + 1) * sizeof longer[0]);
    if (longer == NULL) {
        return out_of_memory();
    }
    options->inputs = longer;
    options->inputs[options->input_count] = strdup(path);
    if (options->inputs[options->input_count] == NULL) {
        return out_of_memory();
    }
    options->input_count++;
    return vd_success();
}

/* The sentence for a name that is not in the table. */
static vd_status unknown_option(const vd_options *options, const char *typed) {
    const char *names[128];
    int count = 0;
    for (; count < options->count && count < 128; count++) {
        names[count] = options->table[count].key;
    }
    const char *nearest = vd_nearest_name(typed, names, count);
    if (nearest != NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "there is no option --%.60s; did you mean --%s?",
                          typed, nearest);
    }
    return vd_failure(VD_ERROR_ARGUMENT,
                      "there is no option --%.60s; `veduta %s --help` lists them", typed,
                      options->command);
}

/* True for what is an option of the table, spelled --name or --name=VALUE, and so no value. */
static bool is_long_option(const vd_options *options, const char *argument) {
    char key[64];
    const size_t length = strcspn(argument, "=");
    if (strncmp(argument, "--", 2) != 0 || length - 2 >= sizeof key) {
        return false;
    }
    memcpy(key, argument + 2, length - 2);
    key[length - 2] = '\0';
    return vd_options_find(options, key) >= 0;
}

/* Takes the option at argv[*at], which begins with two dashes, and its value. */
static vd_status parse_long(vd_options *options, int argc, char **argv, int *at) {
    const char *name = argv[*at] + 2;
    const char *equals = strchr(name, '=');
    size_t length = equals != NULL ? (size_t)(equals - name) : strlen(name);
    char key[64];
    if (length >= sizeof key) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "there is no option --%.40s…; `veduta %s --help` "
                          "lists them",
                          name, options->command);
    }
    memcpy(key, name, length);
    key[length] = '\0';
    int index = vd_options_find(options, key);
    if (index < 0) {
        return unknown_option(options, key);
    }
    const vd_option *option = &options->table[index];
    const char *value = equals != NULL ? equals + 1 : NULL;
    if (option->type == VD_OPTION_SWITCH && value == NULL) {
        value = "on";
    } else if (option->type == VD_OPTION_FLAG && value == NULL) {
        bool follows = *at + 1 < argc && flag_value(option, argv[*at + 1]) >= 0;
        value = follows ? argv[++*at] : "on";
    } else if (value == NULL) {
        if (*at + 1 >= argc || is_long_option(options, argv[*at + 1])) {
            return vd_failure(VD_ERROR_ARGUMENT, "--%s needs a value; give --%s %s", key, key,
                              option->argument);
        }
        value = argv[++*at];
    }
    return vd_options_set(options, index, value, VD_SOURCE_FLAG);
}

/* Takes a short option: -o FILE, -oFILE, or a switch. */
static vd_status parse_short(vd_options *options, int argc, char **argv, int *at) {
    const char *argument = argv[*at];
    for (int i = 0; i < options->count; i++) {
        const vd_option *option = &options->table[i];
        if (option->letter != argument[1]) {
            continue;
        }
        const char *value = argument[2] != '\0' ? argument + 2 : NULL;
        if (option->type == VD_OPTION_SWITCH || option->type == VD_OPTION_FLAG) {
            if (value != NULL) {
                break;
            }
            value = "on";
        } else if (value == NULL) {
            if (*at + 1 >= argc || is_long_option(options, argv[*at + 1])) {
                return vd_failure(VD_ERROR_ARGUMENT, "-%c needs a value; give -%c %s",
                                  option->letter, option->letter, option->argument);
            }
            value = argv[++*at];
        }
        return vd_options_set(options, i, value, VD_SOURCE_FLAG);
    }
    return vd_failure(VD_ERROR_ARGUMENT, "there is no option %.60s; `veduta %s --help` lists them",
                      argument, options->command);
}

vd_status vd_options_parse(vd_options *options, int argc, char **argv) {
    bool only_inputs = false;
    for (int at = 1; at < argc; at++) {
        const char *argument = argv[at];
        vd_status status;
        if (only_inputs || argument[0] != '-' || argument[1] == '\0') {
            status = vd_options_add_input(options, argument, VD_SOURCE_FLAG);
        } else if (strcmp(argument, "--") == 0) {
            only_inputs = true;
            continue;
        } else if (argument[1] == '-') {
            status = parse_long(options, argc, argv, &at);
        } else {
            status = parse_short(options, argc, argv, &at);
        }
        if (status.code != VD_OK) {
            return status;
        }
    }
    return vd_success();
}

/* Counts what a terminal shows of `bytes` bytes of UTF-8: all but continuation bytes. */
static int letter_count(const char *text, size_t bytes) {
    int letters = 0;
    for (size_t i = 0; i < bytes; i++) {
        letters += ((unsigned char)text[i] & 0xC0) != 0x80;
    }
    return letters;
}

/* Prints `text` broken at blanks, the lines after the first indented. */
static void print_wrapped(FILE *out, const char *text, int indent, int width) {
    int column = indent;
    while (*text != '\0') {
        size_t word = strcspn(text, " ");
        int letters = letter_count(text, word);
        if (column > indent && column + 1 + letters > width) {
            fprintf(out, "\n%*s", indent, "");
            column = indent;
        } else if (column > indent) {
            fputc(' ', out);
            column++;
        }
        fprintf(out, "%.*s", (int)word, text);
        column += letters;
        text += word + strspn(text + word, " ");
    }
    fputc('\n', out);
}

static void print_option(const vd_option *option, FILE *out) {
    enum { INDENT = 30, WIDTH = 100 };
    char left[96], text[1024], flag[48];
    const char *argument = option->argument != NULL ? option->argument : "";
    if (option->type == VD_OPTION_FLAG) {
        snprintf(flag, sizeof flag, "on|off%s%s", argument[0] != '\0' ? "|" : "", argument);
        argument = flag;
    }
    snprintf(left, sizeof left, "  %c%c%s --%s%s%s", option->letter ? '-' : ' ',
             option->letter ? option->letter : ' ', option->letter ? "," : " ", option->key,
             argument[0] != '\0' ? " " : "", argument);
    int used = snprintf(text, sizeof text, "%s", option->help);
    const char *separator = " [";
    if (option->unit != NULL) {
        used += snprintf(text + used, sizeof text - (size_t)used, "%s%s", separator, option->unit);
        separator = ", ";
    }
    if (option->min != 0.0 || option->max != 0.0) {
        used += snprintf(text + used, sizeof text - (size_t)used, "%s%g to %g", separator,
                         option->min, option->max);
        separator = ", ";
    }
    if (option->fallback != NULL) {
        used += snprintf(text + used, sizeof text - (size_t)used, "%sdefault %s", separator,
                         option->fallback);
        separator = ", ";
    }
    if (separator[0] == ',') {
        snprintf(text + used, sizeof text - (size_t)used, "]");
    }
    fputs(left, out);
    int column = letter_count(left, strlen(left));
    if (column >= INDENT) {
        fputc('\n', out);
        column = 0;
    }
    fprintf(out, "%*s", INDENT - column, "");
    print_wrapped(out, text, INDENT, WIDTH);
}

void vd_options_print_help(const vd_option *table, int count, FILE *out) {
    for (int i = 0; i < count; i++) {
        bool first = true;
        for (int j = 0; j < i; j++) {
            first = first && strcmp(table[j].group, table[i].group) != 0;
        }
        if (!first) {
            continue;
        }
        fprintf(out, "\n%s\n", table[i].group);
        for (int j = i; j < count; j++) {
            if (strcmp(table[j].group, table[i].group) == 0) {
                print_option(&table[j], out);
            }
        }
    }
}
