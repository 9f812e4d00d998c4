/* api.h: how Veduta's symbols are exported, and nothing else.
 *
 * Every public header includes this one. A function marked VD_API is part of the library's binary
 * interface; everything else is hidden. VD_MUST_USE marks results that must not be dropped.
 */
#ifndef VEDUTA_API_H
#define VEDUTA_API_H

#if defined(__GNUC__)
#define VD_API __attribute__((visibility("default")))
#define VD_MUST_USE __attribute__((warn_unused_result))
#define VD_PRINTF(format_index, first_index)                                                       \
    __attribute__((format(printf, format_index, first_index)))
#else
#define VD_API
#define VD_MUST_USE
#define VD_PRINTF(format_index, first_index)
#endif

#ifdef __cplusplus
#define VD_BEGIN_DECLARATIONS extern "C" {
#define VD_END_DECLARATIONS }
#else
#define VD_BEGIN_DECLARATIONS
#define VD_END_DECLARATIONS
#endif

#endif
