/* generate_forest.h: `veduta generate forest`. */
#ifndef VEDUTA_APP_GENERATE_FOREST_H
#define VEDUTA_APP_GENERATE_FOREST_H

/* Takes the argument vector of `veduta generate`, whose argv[1] is "forest"; returns the exit
 * status. */
int vd_generate_forest(int argc, char **argv);

#endif
