/* llvmpipe.c: the peer of `veduta bench raster`: Mesa's software renderer, through surfaceless EGL.
 *
 *   veduta-llvmpipe MODEL.mesh SIZE depth|phong MATRIX… RUNS SECONDS [OUT.rgba]
 *
 * Draws the mesh into an off-screen picture of SIZE × SIZE, 8-bit colour and 32-bit float depth,
 * by the 16 numbers of a row-major matrix to homogeneous picture space (include/veduta/shader.h),
 * and prints the milliseconds of each run: clear, draw, glFinish, nothing read back; at least RUNS
 * of them, more while SECONDS last; then "peak" and the most bytes it had resident. Vertices are in
 * a buffer object, shaders compiled by a first run that does not count. LP_NUM_THREADS sets the
 * threads. OUT gets the pixels. Any other renderer than llvmpipe is refused.
 */
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GLES3/gl3.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include "mesh_file.h"

static void fail(const char *what) {
    fprintf(stderr, "veduta-llvmpipe: %s\n", what);
    exit(1);
}

static double now_ms(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

/* ---- the model --------------------------------------------------------------------------------*/

typedef struct model {
    mesh_file file;
    float *normals; /* [vertex_count][3] */
} model;

static model read_model(const char *path) {
    model m;
    if (!mesh_file_read(path, &m.file)) {
        fail("cannot read the model");
    }
    m.normals = calloc((size_t)m.file.vertex_count + 1, 12);
    if (m.normals == NULL) {
        fail("out of memory");
    }
    return m;
}

/* The shader normalizes. */
static void compute_normals(model *m) {
    for (size_t t = 0; t < m->file.triangle_count; t++) {
        const unsigned *v = m->file.indices + 3 * t;
        const float *a = m->file.positions + 3 * v[0], *b = m->file.positions + 3 * v[1];
        const float *c = m->file.positions + 3 * v[2];
        double p[3], q[3];
        for (int i = 0; i < 3; i++) {
            p[i] = (double)b[i] - (double)a[i];
            q[i] = (double)c[i] - (double)a[i];
        }
        for (int k = 0; k < 3; k++) {
            float *n = m->normals + 3 * v[k];
            n[0] += (float)(p[1] * q[2] - p[2] * q[1]);
            n[1] += (float)(p[2] * q[0] - p[0] * q[2]);
            n[2] += (float)(p[0] * q[1] - p[1] * q[0]);
        }
    }
    for (size_t v = 0; v < m->file.vertex_count; v++) {
        float *n = m->normals + 3 * v;
        const float length = sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (int i = 0; i < 3 && length > 0; i++) {
            n[i] /= length;
        }
    }
}

/* ---- OpenGL -----------------------------------------------------------------------------------*/

#define VERSION "#version 300 es\n"
#define SNAP VERSION "#define SNAP\n"

/* Row 0 of the picture is row 0 of the memory: y is not turned round. */
static const char vertex_text[] =
    "uniform mat4 picture; uniform float size;\n"
    "in vec3 position; in vec3 normal; out vec3 n;\n"
    "void main() {\n"
    "#ifdef SNAP\n"
    "  vec4 p = picture[0] * position.x + (picture[1] * position.y +\n"
    "           (picture[2] * position.z + picture[3]));\n"
    "  p.xy = floor(p.xy / p.w * 256.0 + 0.5) / 256.0 * p.w;\n"
    "#else\n"
    "  vec4 p = picture * vec4(position, 1.0);\n"
    "#endif\n"
    "  n = normal;\n"
    "  gl_Position = vec4(2.0 * p.xy / size - p.ww, 2.0 * p.z - p.w, p.w);\n"
    "}\n";

static const char depth_text[] =
    "precision highp float; in vec3 n; out vec4 color;\n"
    "void main() { float z = gl_FragCoord.z; color = vec4(vec3(z * z * z), 1.0); }\n";

/* vd_phong_default and vd_material_default for a view along −z, y up, x to the right. */
static const char phong_text[] =
    "precision highp float; in vec3 n; out vec4 color;\n"
    "vec3 encode(vec3 c) {\n"
    "  c = clamp(c, 0.0, 1.0);\n"
    "  return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055,\n"
    "             vec3(greaterThan(c, vec3(0.0031308))));\n"
    "}\n"
    "vec3 light(vec3 m, vec3 to, vec3 lit) {\n"
    "  float c = dot(m, to);\n"
    "  if (c <= 0.0) return vec3(0.0);\n"
    "  float s = max((2.0 * c * m - to).z, 0.0);\n"
    "  s = s * s; s = s * s; s = s * s; s = s * s; s = s * s;\n"
    "  return lit * (0.8 * c + 0.1 * s);\n"
    "}\n"
    "void main() {\n"
    "  vec3 m = normalize(n); m = m.z < 0.0 ? -m : m;\n"
    "  vec3 sum = 0.8 * vec3(0.12, 0.13, 0.15);\n"
    "  sum += light(m, vec3(-0.48, -0.64, 0.6), vec3(0.85, 0.83, 0.8));\n"
    "  sum += light(m, vec3(0.8, -0.6, 0.0), vec3(0.15, 0.17, 0.2));\n"
    "  color = vec4(encode(sum), 1.0);\n"
    "}\n";

static void start_egl(void) {
    PFNEGLGETPLATFORMDISPLAYEXTPROC get_display =
        (PFNEGLGETPLATFORMDISPLAYEXTPROC)eglGetProcAddress("eglGetPlatformDisplayEXT");
    if (get_display == NULL) {
        fail("EGL has no platform displays");
    }
    EGLDisplay display = get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
    const EGLint wanted[] = {EGL_RENDERABLE_TYPE, EGL_OPENGL_ES3_BIT, EGL_SURFACE_TYPE,
                             EGL_PBUFFER_BIT, EGL_NONE};
    const EGLint version[] = {EGL_CONTEXT_CLIENT_VERSION, 3, EGL_NONE};
    EGLConfig config = NULL;
    EGLint count = 0;
    if (!eglInitialize(display, NULL, NULL) || !eglBindAPI(EGL_OPENGL_ES_API) ||
        !eglChooseConfig(display, wanted, &config, 1, &count) || count < 1) {
        fail("EGL does not start");
    }
    EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, version);
    if (!eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
        fail("EGL has no context without a surface");
    }
}

static GLuint compile(GLenum kind, const char *head, const char *text) {
    GLuint shader = glCreateShader(kind);
    GLint ok = 0;
    glShaderSource(shader, 2, (const char *[2]){head, text}, NULL);
    glCompileShader(shader);
    glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
    if (!ok) {
        char log[1000];
        glGetShaderInfoLog(shader, sizeof log, NULL, log);
        fail(log);
    }
    return shader;
}

static void make_target(int size) {
    GLuint buffers[2], frame;
    glGenRenderbuffers(2, buffers);
    glGenFramebuffers(1, &frame);
    glBindFramebuffer(GL_FRAMEBUFFER, frame);
    glBindRenderbuffer(GL_RENDERBUFFER, buffers[0]);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, size, size);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, buffers[0]);
    glBindRenderbuffer(GL_RENDERBUFFER, buffers[1]);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT32F, size, size);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, buffers[1]);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
        fail("the picture is too large for Mesa");
    }
    glViewport(0, 0, size, size);
}

/* `head` is VERSION, or SNAP for the picture that is compared: it rounds vertices to 1/256 pixel
 * before Mesa's own transformations have rounded them otherwise, which moves a few of a large
 * picture's vertices to the next 1/256. Timed runs do not have it. */
static void load(const model *m, const char *head, const char *shading, int size, char **matrix) {
    GLuint program = glCreateProgram(), buffers[3];
    glAttachShader(program, compile(GL_VERTEX_SHADER, head, vertex_text));
    glAttachShader(program, compile(GL_FRAGMENT_SHADER, VERSION,
                                    strcmp(shading, "phong") == 0 ? phong_text : depth_text));
    glBindAttribLocation(program, 0, "position");
    glBindAttribLocation(program, 1, "normal");
    glLinkProgram(program);
    glUseProgram(program);
    float columns[16];
    for (int i = 0; i < 16; i++) {
        columns[i % 4 * 4 + i / 4] = (float)atof(matrix[i]);
    }
    glUniformMatrix4fv(glGetUniformLocation(program, "picture"), 1, GL_FALSE, columns);
    glUniform1f(glGetUniformLocation(program, "size"), (float)size);
    glGenBuffers(3, buffers);
    const float *arrays[2] = {m->file.positions, m->normals};
    for (GLuint i = 0; i < 2; i++) {
        glBindBuffer(GL_ARRAY_BUFFER, buffers[i]);
        glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)m->file.vertex_count * 12, arrays[i],
                     GL_STATIC_DRAW);
        glVertexAttribPointer(i, 3, GL_FLOAT, GL_FALSE, 0, NULL);
        if (i == 0 || strcmp(shading, "phong") == 0) {
            glEnableVertexAttribArray(i);
        }
    }
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers[2]);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)m->file.triangle_count * 12, m->file.indices,
                 GL_STATIC_DRAW);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
    glClearDepthf(0.0f);
    glClearColor(0, 0, 0, 1);
    glEnable(GL_CULL_FACE);
    glFrontFace(GL_CW); /* y is not turned round */
}

static void draw(const model *m) {
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glDrawElements(GL_TRIANGLES, (GLsizei)m->file.triangle_count * 3, GL_UNSIGNED_INT, NULL);
    glFinish();
}

static void save(const char *path, int size) {
    unsigned char *pixels = malloc((size_t)size * (size_t)size * 4);
    FILE *file = fopen(path, "wb");
    if (pixels == NULL || file == NULL) {
        fail("cannot save the picture");
    }
    glReadPixels(0, 0, size, size, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
    fwrite(pixels, 4, (size_t)size * (size_t)size, file);
    fclose(file);
    free(pixels);
}

/* A graphics card's driver would answer too. */
static void check_renderer(void) {
    const char *name = (const char *)glGetString(GL_RENDERER);
    if (name == NULL || strstr(name, "llvmpipe") == NULL) {
        fprintf(stderr, "veduta-llvmpipe: Mesa draws by %.80s, not by llvmpipe\n",
                name != NULL ? name : "nothing");
        exit(1);
    }
}

/* Not getrusage: its maximum counts what was there before exec, too. */
static void print_peak(void) {
    char line[128];
    long kilobytes = 0;
    FILE *file = fopen("/proc/self/status", "r");
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        if (sscanf(line, "VmHWM: %ld", &kilobytes) == 1) {
            printf("peak %ld\n", kilobytes * 1024);
        }
    }
    if (file != NULL) {
        fclose(file);
    }
}

enum { MOST_RUNS = 200 };

int main(int argc, char **argv) {
    if (argc < 22) {
        fail(
            "takes MODEL.mesh SIZE depth|phong, 16 numbers, RUNS SECONDS, and OUT.rgba or nothing");
    }
    const int size = atoi(argv[2]), least_runs = atoi(argv[20]);
    const double seconds = atof(argv[21]);
    setenv("LIBGL_ALWAYS_SOFTWARE", "1", 1);
    setenv("GALLIUM_DRIVER", "llvmpipe", 1);
    model m = read_model(argv[1]);
    if (strcmp(argv[3], "phong") == 0) {
        compute_normals(&m);
    }
    start_egl();
    check_renderer();
    make_target(size);
    load(&m, VERSION, argv[3], size, argv + 4);
    draw(&m);
    const double end_ms = now_ms() + seconds * 1e3;
    for (int i = 0; i < MOST_RUNS && (i < least_runs || now_ms() < end_ms); i++) {
        const double start = now_ms();
        draw(&m);
        printf("%.4f\n", now_ms() - start);
    }
    print_peak();
    if (argc > 22) {
        load(&m, SNAP, argv[3], size, argv + 4);
        draw(&m);
        save(argv[22], size);
    }
    return 0;
}
