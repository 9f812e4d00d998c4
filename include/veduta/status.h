/* status.h: what a fallible call returns.
 *
 * A vd_status carries a code for programs and one sentence for people. The sentence names what
 * failed, where (file, field, flag), and what to do about it. It is a value: it belongs to whoever
 * holds it, needs no release, and is safe to pass between threads.
 *
 *     vd_status status = vd_picture_load(context, "map.png", &picture);
 *     if (status.code != VD_OK) {
 *         fprintf(stderr, "%s\n", status.message);
 *     }
 */
#ifndef VEDUTA_STATUS_H
#define VEDUTA_STATUS_H

#include <veduta/api.h>

VD_BEGIN_DECLARATIONS

typedef enum vd_code {
    VD_OK = 0,
    VD_ERROR_ARGUMENT,    /* the caller's own mistake: a field out of range, a null pointer */
    VD_ERROR_MEMORY,      /* the allocator returned null */
    VD_ERROR_IO,          /* a file could not be opened, read, written or renamed */
    VD_ERROR_FORMAT,      /* a file is not what it claims to be, or is damaged */
    VD_ERROR_LIMIT,       /* the input is larger than this library accepts */
    VD_ERROR_UNSUPPORTED, /* well-formed, but this build or version cannot do it */
    VD_ERROR_CANCELLED,   /* the job was cancelled or ran past its deadline */
    VD_ERROR_EMPTY,       /* there is nothing to draw; the sentence says why */
    VD_CODE_COUNT
} vd_code;

#define VD_MESSAGE_BYTES 380

typedef struct vd_status {
    vd_code code;
    char message[VD_MESSAGE_BYTES]; /* UTF-8, NUL-terminated; empty when code is VD_OK */
} vd_status;

/* Returns success: code VD_OK and an empty message. */
VD_API vd_status vd_success(void);

/* Returns a failure with a formatted message, cut at VD_MESSAGE_BYTES - 1 bytes. */
VD_API vd_status vd_failure(vd_code code, const char *format, ...) VD_PRINTF(2, 3);

/* Returns the code's name, such as "format"; "unknown" for a value outside the enumeration. */
VD_API const char *vd_code_name(vd_code code);

VD_END_DECLARATIONS

#endif
