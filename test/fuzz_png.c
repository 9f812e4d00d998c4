/* Any bytes as a PNG: an error or a picture whose every value can be read. */
#include <stdlib.h>
#include <veduta/picture.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    vd_context_def def = vd_context_def_default();
    def.threads = 1;
    vd_context *context = NULL;
    vd_picture *picture = NULL;
    if (vd_context_create(&def, &context).code != VD_OK) {
        return 0;
    }
    if (vd_picture_decode(context, data, size, "fuzz.png", &picture).code == VD_OK) {
        vd_comparison comparison;
        if (vd_picture_compare(picture, picture, 0.0, &comparison, NULL).code == VD_OK &&
            comparison.differing_pixels != 0) {
            abort();
        }
        vd_picture_destroy(&picture);
    }
    vd_context_destroy(&context);
    return 0;
}
