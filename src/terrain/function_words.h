/* function_words.h: the names that the formula language has of its own. */
#ifndef VEDUTA_TERRAIN_FUNCTION_WORDS_H
#define VEDUTA_TERRAIN_FUNCTION_WORDS_H

#include "terrain/function_program.h"

typedef enum vd_word_kind {
    VD_WORD_OPERATION = 0, /* `op` of each component */
    VD_WORD_HSV,
    VD_WORD_RGB, /* also a name that may be defined: the result */
    VD_WORD_MIX,
    VD_WORD_CLAMP,
    VD_WORD_X,
    VD_WORD_Y,
    VD_WORD_PI,
    VD_WORD_LOGIC /* and, or, not */
} vd_word_kind;

typedef struct vd_function_word {
    const char *name;
    const char *usage;
    vd_word_kind kind;
    int op; /* vd_function_op */
    int arguments;
    bool takes_colors;
} vd_function_word;

/* Returns the word, or null. */
const vd_function_word *vd_function_word_find(const char *name, size_t bytes);

/* Returns the name of the word that a misspelt one resembles, or null. */
const char *vd_function_word_near(const char *name, size_t bytes);

#endif
