/* outline.c: text as paths: its memory, and the layers that draw it. */
#include <string.h>
#include <veduta/outline.h>

void vd_outline_finish(vd_outline *outline) {
    if (outline == NULL) {
        return;
    }
    if (outline->context != NULL) {
        /* The path only lends its arrays to readers; they are ours. */
        vd_release(outline->context, (void *)outline->path.points);
    }
    memset(outline, 0, sizeof *outline);
}

void vd_layer_color(vd_rgba8 color, uint16_t out[4]) {
    const uint32_t straight[3] = {color.r, color.g, color.b};
    for (int i = 0; i < 3; i++) {
        out[i] = (uint16_t)((straight[i] * color.a * 257 + 127) / 255);
    }
    out[3] = (uint16_t)(color.a * 257);
}

vd_letters vd_letters_default(double size_px) {
    return (vd_letters){.color = {255, 255, 255, 255},
                        .halo = {18, 24, 32, 190},
                        .halo_width = 0.6 + 0.06 * size_px};
}

int vd_outline_layers(const vd_outline *outline, double x, double y, const vd_letters *letters,
                      vd_stroke *stroke, vd_layer layers[2]) {
    vd_layer letter = vd_layer_default();
    letter.path = outline->path;
    letter.picture_from_path.x0 = x;
    letter.picture_from_path.y0 = y;
    vd_layer_color(letters->color, letter.fill);
    if (letters->halo.a == 0 || !(letters->halo_width > 0)) {
        layers[0] = letter;
        return 1;
    }
    *stroke = vd_stroke_default();
    stroke->width = 2 * letters->halo_width;
    stroke->join = VD_JOIN_ROUND;
    vd_layer_color(letters->halo, stroke->color);
    layers[0] = letter;
    layers[0].filled = false;
    layers[0].stroke = stroke;
    layers[1] = letter;
    return 2;
}
