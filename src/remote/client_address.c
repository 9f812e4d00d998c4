/* client_address.c: reading an address. */
#include "remote/client_address.h"

#include <stdlib.h>
#include <string.h>

static vd_status wrong(const char *what) {
    return vd_failure(VD_ERROR_ARGUMENT,
                      "the server's address %s; give the whole line that `veduta serve` printed, "
                      "such as http://127.0.0.1:8080/#token=5c1b9e",
                      what);
}

/* Letters, digits and what stands in addresses beside them: nothing that could end a header. */
static bool is_plain(const char *text, size_t length, const char *more) {
    for (size_t i = 0; i < length; i++) {
        const char c = text[i];
        if (!(c >= 'a' && c <= 'z') && !(c >= 'A' && c <= 'Z') && !(c >= '0' && c <= '9') &&
            (c == '\0' || strchr(more, c) == NULL)) {
            return false;
        }
    }
    return true;
}

static vd_status read_scheme(const char **at, vd_address *out) {
    static const struct {
        const char *scheme;
        bool tls;
    } schemes[] = {{"http://", false}, {"https://", true}, {"ws://", false}, {"wss://", true}};
    for (size_t i = 0; i < sizeof schemes / sizeof schemes[0]; i++) {
        const size_t length = strlen(schemes[i].scheme);
        if (strncmp(*at, schemes[i].scheme, length) == 0) {
            *at += length;
            out->tls = schemes[i].tls;
            out->port = out->tls ? 443 : 80;
            return vd_success();
        }
    }
    return wrong("begins neither with http:// nor https://");
}

static vd_status read_host(const char **at, vd_address *out) {
    const bool brackets = **at == '[';
    const char *host = *at + brackets;
    const size_t length = strcspn(host, brackets ? "]" : ":/#?");
    if (length == 0 || length >= sizeof out->host ||
        !is_plain(host, length, brackets ? ":.%" : ".-_") || (brackets && host[length] != ']')) {
        return wrong("names no host");
    }
    memcpy(out->host, host, length);
    *at = host + length + brackets;
    if (**at == ':') {
        char *end;
        const long port = strtol(*at + 1, &end, 10);
        if ((*at)[1] < '0' || (*at)[1] > '9' || port < 1 || port > 65535) {
            return wrong("has no port from 1 to 65535");
        }
        out->port = (int)port;
        *at = end;
    }
    return vd_success();
}

vd_status vd_address_read(const char *url, vd_address *out) {
    vd_address made = {.path = "/"};
    const char *at = url;
    vd_status status = read_scheme(&at, &made);
    if (status.code == VD_OK) {
        status = read_host(&at, &made);
    }
    if (status.code != VD_OK) {
        return status;
    }
    const size_t length = strcspn(at, "#");
    if (length > 0) {
        if (at[0] != '/' || at[length - 1] != '/' || length >= sizeof made.path ||
            !is_plain(at, length, "/-._~")) {
            return wrong("has a path that no server has");
        }
        memcpy(made.path, at, length);
        made.path[length] = '\0';
    }
    at += length;
    const char *token = strncmp(at, "#token=", 7) == 0 ? at + 7 : at + strlen(at);
    const size_t bytes = strcspn(token, "&");
    if ((*at != '\0' && bytes == 0) || bytes >= sizeof made.token ||
        !is_plain(token, bytes, "-._~")) {
        return wrong("has something else than a token behind its #");
    }
    memcpy(made.token, token, bytes);
    *out = made;
    return status;
}
