/* options_units.c: options that are numbers with an ending, such as 5ms and 10M. */
#include <math.h>
#include <string.h>

#include "options.h"

typedef struct ending {
    const char *text;
    double factor;
} ending;

/* Reads a number with one of the endings; the last of them is "". */
static bool read_with_ending(const char *text, const ending *endings, double *out) {
    const size_t length = strlen(text);
    for (const ending *e = endings;; e++) {
        const size_t cut = strlen(e->text);
        char number[64];
        if (length > cut && length - cut < sizeof number &&
            strcmp(text + length - cut, e->text) == 0) {
            memcpy(number, text, length - cut);
            number[length - cut] = '\0';
            double value = 0.0;
            if (vd_read_number(number, &value) && isfinite(value * e->factor)) {
                *out = value * e->factor;
                return true;
            }
        }
        if (cut == 0) {
            return false;
        }
    }
}

vd_status vd_option_seconds(const vd_options *options, int index, double least, double most,
                            double *out) {
    static const ending endings[] = {{"ms", 1e-3}, {"s", 1.0}, {"", 1.0}};
    const char *text = options->values[index].text;
    if (!read_with_ending(text, endings, out) || !(*out >= least && *out <= most)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--%s: \"%.40s\" is not a time from %g to %g s; give seconds, such as "
                          "0.005 or 5ms",
                          options->table[index].key, text, least, most);
    }
    return vd_success();
}

vd_status vd_option_bytes(const vd_options *options, int index, double least, double most,
                          double *out) {
    static const ending endings[] = {{"k", 1e3}, {"M", 1e6}, {"G", 1e9}, {"", 1.0}};
    const char *text = options->values[index].text;
    if (!read_with_ending(text, endings, out) || !(*out >= least && *out <= most)) {
        return vd_failure(
            VD_ERROR_ARGUMENT,
            "--%s: \"%.40s\" is not a number of bytes from %g to %g; give one such as "
            "2500000 or 2.5M",
            options->table[index].key, text, least, most);
    }
    return vd_success();
}
