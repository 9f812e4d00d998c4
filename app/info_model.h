/* info_model.h: what `veduta info` says of a model. */
#ifndef VEDUTA_APP_INFO_MODEL_H
#define VEDUTA_APP_INFO_MODEL_H

#include "run.h"

/* Loads a model and prints what it holds, as JSON or for people. */
VD_MUST_USE vd_status vd_info_model(vd_context *context, const char *path, bool json,
                                    const vd_notes *notes);

#endif
