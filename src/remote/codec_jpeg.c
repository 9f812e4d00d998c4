/* codec_jpeg.c: colours as a JPEG, through libjpeg-turbo's libjpeg.
 *
 * libjpeg reports errors by a function that must not return: it jumps back. Only files of one scan
 * are unpacked: one of many costs a pass over the picture for a few bytes each.
 */
#include "remote/coder.h"

#include <setjmp.h>
#include <stdio.h>
#include <string.h>
#include <jpeglib.h>
#include <jerror.h>

#ifndef JCS_EXTENSIONS
#error "needs libjpeg-turbo; build with VEDUTA_REMOTE=OFF where there is another libjpeg"
#endif

enum { FULL_COLOR_QUALITY = 90 }; /* from here on colours are not halved in resolution */

typedef struct jumper {
    struct jpeg_error_mgr errors; /* first: libjpeg knows only this */
    jmp_buf failed;
    int code;
    char message[JMSG_LENGTH_MAX];
} jumper;

static void fail(j_common_ptr jpeg) {
    jumper *j = (jumper *)jpeg->err;
    j->code = jpeg->err->msg_code;
    jpeg->err->format_message(jpeg, j->message);
    longjmp(j->failed, 1);
}

/* Level -1 is a warning: data are damaged. What we packed gives none. */
static void take_message(j_common_ptr jpeg, int level) {
    if (level < 0) {
        fail(jpeg);
    }
}

static void prepare(jumper *j) {
    jpeg_std_error(&j->errors);
    j->errors.error_exit = fail;
    j->errors.emit_message = take_message;
    j->code = 0;
    j->message[0] = '\0';
}

/* ---- packing ----------------------------------------------------------------------------------*/

typedef struct packer {
    struct jpeg_compress_struct jpeg;
    struct jpeg_destination_mgr destination;
    jumper jumper;
    vd_sink *sink;
} packer;

static void start_output(j_compress_ptr jpeg) {
    packer *p = jpeg->client_data;
    p->destination.next_output_byte = p->sink->out + p->sink->used;
    p->destination.free_in_buffer = p->sink->room - p->sink->used;
}

/* Called when there is no room left. */
static boolean empty_output(j_compress_ptr jpeg) {
    packer *p = jpeg->client_data;
    p->sink->full = true;
    longjmp(p->jumper.failed, 1);
}

static void end_output(j_compress_ptr jpeg) {
    packer *p = jpeg->client_data;
    p->sink->used = p->sink->room - p->destination.free_in_buffer;
}

static void write_picture(packer *p, const vd_encode_def *def, const vd_codec_picture *picture) {
    struct jpeg_compress_struct *jpeg = &p->jpeg;
    jpeg->dest = &p->destination;
    jpeg->image_width = (JDIMENSION)picture->width;
    jpeg->image_height = (JDIMENSION)picture->height;
    jpeg->input_components = 4;
    jpeg->in_color_space = JCS_EXT_RGBX;
    jpeg_set_defaults(jpeg);
    jpeg_set_quality(jpeg, def->quality, TRUE);
    jpeg->optimize_coding = def->effort >= 5;
    jpeg->dct_method = JDCT_ISLOW;
    if (def->quality >= FULL_COLOR_QUALITY) {
        jpeg->comp_info[0].h_samp_factor = jpeg->comp_info[0].v_samp_factor = 1;
    }
    jpeg_start_compress(jpeg, TRUE);
    while (jpeg->next_scanline < jpeg->image_height) {
        /* not written to */
        JSAMPROW row = (JSAMPROW)picture->rgba + 4 * picture->stride * (size_t)jpeg->next_scanline;
        (void)jpeg_write_scanlines(jpeg, &row, 1);
    }
    jpeg_finish_compress(jpeg);
}

/* What is packed with is the caller's and so outlives a jump. */
static bool pack(packer *p, const vd_encode_def *def, const vd_codec_picture *picture) {
    if (setjmp(p->jumper.failed) != 0) {
        return false;
    }
    jpeg_create_compress(&p->jpeg);
    write_picture(p, def, picture);
    return true;
}

vd_status vd_jpeg_pack(const vd_encode_def *def, const vd_codec_picture *picture, vd_sink *sink) {
    packer p = {.sink = sink,
                .destination = {.init_destination = start_output,
                                .empty_output_buffer = empty_output,
                                .term_destination = end_output}};
    prepare(&p.jumper);
    p.jpeg.err = &p.jumper.errors;
    p.jpeg.client_data = &p;
    if (sink->room == sink->used) {
        return vd_no_room(VD_CODEC_JPEG, sink);
    }
    const bool done = pack(&p, def, picture);
    jpeg_destroy_compress(&p.jpeg);
    if (done) {
        return vd_success();
    }
    return sink->full ? vd_no_room(VD_CODEC_JPEG, sink)
                      : vd_codec_memory(VD_CODEC_JPEG, picture->width, picture->height);
}

/* ---- unpacking --------------------------------------------------------------------------------*/

typedef struct unpacker {
    struct jpeg_decompress_struct jpeg;
    jumper jumper;
    const char *wrong; /* what is not libjpeg's failure */
} unpacker;

static const char *read_picture(struct jpeg_decompress_struct *jpeg, const vd_source *source) {
    (void)jpeg_read_header(jpeg, TRUE);
    if (jpeg->image_width != (JDIMENSION)source->width ||
        jpeg->image_height != (JDIMENSION)source->height) {
        return "the JPEG in it has another size";
    }
    if (jpeg->num_components != 3 || jpeg->progressive_mode || jpeg->arith_code ||
        jpeg_has_multiple_scans(jpeg)) {
        return "the JPEG in it is not three channels in one scan";
    }
    jpeg->out_color_space = JCS_EXT_RGBA;
    jpeg->dct_method = JDCT_ISLOW;
    (void)jpeg_start_decompress(jpeg);
    while (jpeg->output_scanline < jpeg->output_height) {
        JSAMPROW row = source->rgba + 4 * source->stride * (size_t)jpeg->output_scanline;
        (void)jpeg_read_scanlines(jpeg, &row, 1);
    }
    (void)jpeg_finish_decompress(jpeg);
    return jpeg->src->bytes_in_buffer != 0 ? "bytes are left over" : NULL;
}

static bool unpack(unpacker *u, const vd_source *source) {
    if (setjmp(u->jumper.failed) != 0) {
        return false;
    }
    jpeg_create_decompress(&u->jpeg);
    jpeg_mem_src(&u->jpeg, source->data, source->bytes);
    u->wrong = read_picture(&u->jpeg, source);
    return u->wrong == NULL;
}

vd_status vd_jpeg_unpack(const vd_source *source) {
    unpacker u = {.wrong = NULL};
    prepare(&u.jumper);
    u.jpeg.err = &u.jumper.errors;
    u.jpeg.client_data = &u;
    const bool done = unpack(&u, source);
    jpeg_destroy_decompress(&u.jpeg);
    if (done) {
        return vd_success();
    }
    if (u.jumper.code == JERR_OUT_OF_MEMORY) {
        return vd_codec_memory(VD_CODEC_JPEG, source->width, source->height);
    }
    return vd_damaged(VD_CODEC_JPEG, source, u.wrong != NULL ? u.wrong : u.jumper.message);
}
