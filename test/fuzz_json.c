/* fuzz_json.c: any bytes as an options file, and what comes out of it as settings. */
#include <stdint.h>
#include <stdlib.h>

#include "../app/render_settings.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    vd_options options;
    vd_render_settings settings;
    vd_status status = vd_options_init(&options, "render", vd_render_table, OPTION_COUNT);
    if (status.code != VD_OK) {
        return 0;
    }
    status = vd_options_read_json(&options, (const char *)data, size, "fuzz.json", "folder");
    if (status.code == VD_OK) {
        status = vd_render_apply_preset(&options);
    }
    if (status.code == VD_OK) {
        status = vd_render_settings_read(&options, &settings);
    }
    /* What was refused says why, and what was taken is within its bounds. */
    if ((status.code != VD_OK) != (status.message[0] != '\0') ||
        (status.code == VD_OK && (settings.width < 1 || settings.width > VD_MAX_SIDE ||
                                  (settings.input_count < 1 && settings.function == NULL) ||
                                  !(settings.camera.fov > 0.0 && settings.camera.fov < 180.0)))) {
        abort();
    }
    vd_options_finish(&options);
    return 0;
}
