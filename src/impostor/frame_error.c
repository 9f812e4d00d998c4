/* frame_error.c: how far a picture is from what it should be (Lawlor 2004, eq. 5.1). */
#include <math.h>
#include <veduta/impostor.h>

double vd_frame_error(const vd_frame *generated, const vd_frame *reference) {
    uint64_t sum = 0;
    for (int y = 0; y < reference->height; y++) {
        const uint8_t *g = generated->rgba + 4 * (size_t)y * generated->stride;
        const uint8_t *r = reference->rgba + 4 * (size_t)y * reference->stride;
        for (int i = 0; i < 4 * reference->width; i++) {
            const int d = (int)g[i] - (int)r[i];
            sum += i % 4 == 3 ? 0u : (uint64_t)(d * d);
        }
    }
    const double pixels = (double)reference->width * (double)reference->height;
    return sqrt((double)sum / (255.0 * 255.0) / (0.1 * pixels));
}
