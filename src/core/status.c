#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <veduta/status.h>

vd_status vd_success(void) {
    vd_status status;
    status.code = VD_OK;
    status.message[0] = '\0';
    return status;
}

vd_status vd_failure(vd_code code, const char *format, ...) {
    vd_status status;
    status.code = code;
    va_list arguments;
    va_start(arguments, format);
    int length = vsnprintf(status.message, sizeof status.message, format, arguments);
    va_end(arguments);
    if (length < 0) {
        status.message[0] = '\0';
    } else if ((size_t)length >= sizeof status.message) {
        /* Do not leave half a UTF-8 character at the cut. */
        size_t end = sizeof status.message - 1;
        while (end > 0 && ((unsigned char)status.message[end - 1] & 0xC0) == 0x80) {
            end--;
        }
        if (end > 0 && (unsigned char)status.message[end - 1] >= 0xC0) {
            end--;
        }
        status.message[end] = '\0';
    }
    return status;
}

const char *vd_code_name(vd_code code) {
    static const char *const names[VD_CODE_COUNT] = {
        "ok", "argument", "memory", "io", "format", "limit", "unsupported", "cancelled", "empty"};
    return code >= 0 && code < VD_CODE_COUNT ? names[code] : "unknown";
}
