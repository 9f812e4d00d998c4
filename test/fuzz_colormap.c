/* Fuzzes the colour map readers. The first byte chooses the name's ending. */
#include <stdlib.h>
#include <veduta/colormap.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (size < 1) {
        return 0;
    }
    vd_colormap map;
    const char *name = data[0] % 2 ? "x.cpt" : "x.txt";
    if (vd_colormap_decode((const char *)data + 1, size - 1, name, &map).code != VD_OK) {
        return 0;
    }
    if (map.count < 1 || map.count > VD_COLORMAP_MAX_STOPS) {
        abort();
    }
    for (int i = 0; i < map.count; i++) {
        if (i > 0 && !(map.stops[i - 1].value <= map.stops[i].value)) {
            abort();
        }
        double value = map.stops[i].value;
        (void)vd_colormap_at(&map, value, 0.0, 1.0);
        (void)vd_colormap_at(&map, value * 1.5 + 1.0, -1e300, 1e300);
    }
    return 0;
}
