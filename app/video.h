/* video.h: frames into a video file, by the ffmpeg program, or into numbered pictures.
 *
 * ffmpeg is a program of its own, started without a shell and fed through a pipe: no library of its
 * is linked, and what goes wrong in it ends it and not us. It writes beside the file that was asked
 * for, which is renamed when all is there: also after an interruption, when the frames so far are a
 * video that plays.
 */
#ifndef VEDUTA_APP_VIDEO_H
#define VEDUTA_APP_VIDEO_H

#include <veduta/veduta.h>

typedef enum vd_video_kind {
    VD_VIDEO_MP4 = 0, /* H.264 */
    VD_VIDEO_WEBM,    /* VP9 */
    VD_VIDEO_GIF,
    VD_VIDEO_FRAMES, /* numbered PNGs */
    VD_VIDEO_KIND_COUNT
} vd_video_kind;

typedef struct vd_video_def {
    const char *path; /* not kept */
    vd_video_kind kind;
    int width, height;
    double fps;
    int quality; /* 1 … 100 */
} vd_video_def;

/* Tells what a name's ending asks for; `option` is whose name it is. Returns VD_ERROR_ARGUMENT for
 * other endings and for a picture's name without a place for the number. */
VD_MUST_USE vd_status vd_video_kind_of(const char *option, const char *path, vd_video_kind *out);

/* Checks size and rate, and that ffmpeg is there. Returns VD_ERROR_ARGUMENT or
 * VD_ERROR_UNSUPPORTED. */
VD_MUST_USE vd_status vd_video_check(const vd_video_def *def);

/* Writes the name of frame `number`: the pattern's one {}, {:05}, %d or %05d replaced. False when
 * the pattern has none or several, or the name is too long. */
bool vd_frame_name(const char *pattern, int number, char *out, size_t out_bytes);

typedef struct vd_video vd_video;

/* Starts ffmpeg. Not for VD_VIDEO_FRAMES. *out is ended by vd_video_finish. Returns
 * VD_ERROR_UNSUPPORTED (there is no ffmpeg), VD_ERROR_IO or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_video_open(const vd_video_def *def, vd_video **out);

/* Hands over one frame's colours; alpha is left out. Blocks while ffmpeg is behind. Returns
 * VD_ERROR_IO with the last that ffmpeg said. */
VD_MUST_USE vd_status vd_video_write(vd_video *video, const vd_frame *frame);

/* Bytes that ffmpeg has written so far. Any thread. */
uint64_t vd_video_bytes(const vd_video *video);

/* Ends the video and *video, and waits for ffmpeg to complete the file. A video with frames is
 * renamed to its name, one without is removed, and so is one that ffmpeg failed with. *bytes (may
 * be null) receives the file's size. */
VD_MUST_USE vd_status vd_video_finish(vd_video **video, uint64_t *bytes);

#endif
