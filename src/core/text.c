#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <math.h>
#include "core/text.h"

static bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v';
}

void vd_text_skip_blanks(vd_text *text) {
    while (text->at < text->end && is_blank(*text->at)) {
        text->at++;
    }
}

void vd_text_skip_lines(vd_text *text) {
    while (text->at < text->end && (is_blank(*text->at) || *text->at == '\n')) {
        text->line += *text->at == '\n';
        text->at++;
    }
}

void vd_text_next_line(vd_text *text) {
    while (text->at < text->end && *text->at != '\n') {
        text->at++;
    }
    if (text->at < text->end) {
        text->at++;
        text->line++;
    }
}

static bool match_word(vd_text *text, const char *word) {
    size_t length = strlen(word);
    if ((size_t)(text->end - text->at) < length) {
        return false;
    }
    for (size_t i = 0; i < length; i++) {
        if ((text->at[i] | 0x20) != word[i]) {
            return false;
        }
    }
    text->at += length;
    return true;
}

static bool special_number(vd_text *text, double *out) {
    vd_text t = *text;
    double sign = 1.0;
    if (t.at < t.end && (*t.at == '-' || *t.at == '+')) {
        sign = *t.at == '-' ? -1.0 : 1.0;
        t.at++;
    }
    if (match_word(&t, "nan")) {
        *out = (double)NAN;
    } else if (match_word(&t, "infinity") || match_word(&t, "inf")) {
        *out = sign * (double)INFINITY;
    } else {
        return false;
    }
    *text = t;
    return true;
}

/* 10^0 … 10^22 are exact doubles. */
static const double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

/* What a decimal number is made of: ±mantissa × 10^exponent, `exact` when no digit was dropped. */
typedef struct decimal {
    uint64_t mantissa;
    int exponent, digits;
    bool exact;
} decimal;

static void add_digit(decimal *d, int digit, bool fraction) {
    if (d->mantissa <= (UINT64_MAX - 9) / 10) {
        d->mantissa = d->mantissa * 10 + (uint64_t)digit;
        d->exponent -= fraction;
    } else {
        d->exact &= digit == 0;
        d->exponent += !fraction;
    }
    d->digits++;
}

static const char *scan_exponent(const char *p, const char *end, int *exponent) {
    if (p >= end || (*p | 0x20) != 'e') {
        return p;
    }
    const char *start = p++;
    bool negative = p < end && *p == '-';
    if (p < end && (*p == '-' || *p == '+')) {
        p++;
    }
    if (p >= end || *p < '0' || *p > '9') {
        return start; /* "2em" is the number 2 and then a word */
    }
    int value = 0;
    for (; p < end && *p >= '0' && *p <= '9'; p++) {
        value = value < 100000 ? value * 10 + (*p - '0') : value;
    }
    *exponent += negative ? -value : value;
    return p;
}

/* The rare number that does not convert exactly in one step goes through strtod. Its only locale
 * dependence is the decimal point, which is avoided by writing mantissa and exponent instead. */
static double convert_slowly(const char *begin, const char *end, int exponent10) {
    char buffer[800];
    size_t n = 0;
    bool point = false;
    int exponent = exponent10;
    for (const char *p = begin; p < end && n < sizeof buffer - 32; p++) {
        if (*p == '.') {
            point = true;
        } else if (*p >= '0' && *p <= '9') {
            buffer[n++] = *p;
            exponent -= point;
        }
    }
    buffer[n++] = 'e';
    if (exponent < 0) {
        buffer[n++] = '-';
        exponent = -exponent;
    }
    char digits[12];
    int count = 0;
    do {
        digits[count++] = (char)('0' + exponent % 10);
        exponent /= 10;
    } while (exponent > 0);
    while (count > 0) {
        buffer[n++] = digits[--count];
    }
    buffer[n] = '\0';
    return strtod(buffer, NULL);
}

bool vd_text_number(vd_text *text, double *out) {
    vd_text_skip_blanks(text);
    if (special_number(text, out)) {
        return true;
    }
    const char *p = text->at, *end = text->end;
    bool negative = p < end && *p == '-';
    if (p < end && (*p == '-' || *p == '+')) {
        p++;
    }
    decimal d = {0, 0, 0, true};
    const char *digits_begin = p;
    bool point = false;
    for (; p < end && ((*p >= '0' && *p <= '9') || (*p == '.' && !point)); p++) {
        if (*p == '.') {
            point = true;
        } else {
            add_digit(&d, *p - '0', point);
        }
    }
    if (d.digits == 0) {
        return false;
    }
    const char *digits_end = p;
    int written_exponent = 0;
    p = scan_exponent(p, end, &written_exponent);
    int exponent = d.exponent + written_exponent;
    double value;
    if (d.mantissa == 0) {
        value = 0.0;
    } else if (d.exact && d.mantissa <= (UINT64_C(1) << 53) && exponent >= -22 && exponent <= 22) {
        /* Clinger (1990): one exact operand on each side, so one rounding. */
        value = exponent < 0 ? (double)d.mantissa / powers[-exponent]
                             : (double)d.mantissa * powers[exponent];
    } else {
        value = convert_slowly(digits_begin, digits_end, written_exponent);
    }
    *out = negative ? -value : value;
    text->at = p;
    return true;
}

bool vd_text_word(vd_text *text, char *out, size_t out_bytes) {
    vd_text_skip_blanks(text);
    size_t n = 0;
    bool any = false;
    for (; text->at < text->end && !is_blank(*text->at) && *text->at != '\n'; text->at++) {
        if (n + 1 < out_bytes) {
            out[n++] = *text->at;
        }
        any = true;
    }
    out[n] = '\0';
    return any;
}
