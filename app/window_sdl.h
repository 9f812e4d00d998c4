/* window_sdl.h: SDL2, opened when a window is wanted. Loading it takes longer than all of
 * `veduta info`, so the program does not link it; its functions are called through this table. */
#ifndef VEDUTA_APP_WINDOW_SDL_H
#define VEDUTA_APP_WINDOW_SDL_H

#define SDL_MAIN_HANDLED
#include <SDL.h>
#include <veduta/status.h>

/* Every function of SDL that the window uses. */
#define VD_SDL_FUNCTIONS(X)                                                                        \
    X(Init)                                                                                        \
    X(GetCurrentVideoDriver)                                                                       \
    X(GetError)                                                                                    \
    X(SetHint)                                                                                     \
    X(CreateWindow)                                                                                \
    X(SetWindowTitle)                                                                              \
    X(SetWindowFullscreen)                                                                         \
    X(SetWindowSize)                                                                               \
    X(SetWindowMinimumSize)                                                                        \
    X(GetWindowFlags)                                                                              \
    X(GetWindowSize)                                                                               \
    X(GetWindowSurface)                                                                            \
    X(UpdateWindowSurface)                                                                         \
    X(GetWindowDisplayIndex)                                                                       \
    X(GetCurrentDisplayMode)                                                                       \
    X(ConvertPixels)                                                                               \
    X(LockSurface)                                                                                 \
    X(UnlockSurface)                                                                               \
    X(WaitEvent)                                                                                   \
    X(WaitEventTimeout)                                                                            \
    X(PollEvent)                                                                                   \
    X(PushEvent)                                                                                   \
    X(RegisterEvents)                                                                              \
    X(SetClipboardText)                                                                            \
    X(free)

typedef struct vd_sdl {
#define VD_SDL_FIELD(name) __typeof__(SDL_##name) *name;
    VD_SDL_FUNCTIONS(VD_SDL_FIELD)
#undef VD_SDL_FIELD
} vd_sdl;

/* Fills the table. SDL stays loaded until the program ends. Returns VD_ERROR_UNSUPPORTED when it is
 * not there or lacks a function. */
VD_MUST_USE vd_status vd_sdl_open(vd_sdl *out);

#endif
