/* client_address.h: what the address says that `veduta serve` prints. */
#ifndef VEDUTA_REMOTE_CLIENT_ADDRESS_H
#define VEDUTA_REMOTE_CLIENT_ADDRESS_H

#include <veduta/wire.h>

enum { VD_ADDRESS_HOST = 256, VD_ADDRESS_PATH = 256 };

typedef struct vd_address {
    char host[VD_ADDRESS_HOST]; /* without brackets */
    char path[VD_ADDRESS_PATH]; /* begins and ends with a slash */
    char token[VD_WIRE_TOKEN_BYTES + 1];
    int port;
    bool tls;
} vd_address;

/* Reads http[s]://HOST[:PORT][/PATH/][#token=TOKEN[&…]]; ws and wss are taken for http and https.
 * Returns VD_ERROR_ARGUMENT with a sentence that does not repeat the token. */
VD_MUST_USE vd_status vd_address_read(const char *url, vd_address *out);

#endif
