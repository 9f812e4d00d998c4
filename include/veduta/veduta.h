/* veduta.h: the whole core library in one include (geo.h belongs to veduta-io, model_import.h to
 * veduta-model, snapshot.h to veduta-snapshot, text.h to veduta-text, codec.h, server.h and
 * wire.h to veduta-remote: they are separate). */
#ifndef VEDUTA_VEDUTA_H
#define VEDUTA_VEDUTA_H

#include <veduta/api.h>
#include <veduta/brick_block.h>
#include <veduta/brick_view.h>
#include <veduta/bricks.h>
#include <veduta/camera.h>
#include <veduta/camera_path.h>
#include <veduta/classic.h>
#include <veduta/color.h>
#include <veduta/colormap.h>
#include <veduta/context.h>
#include <veduta/coverage.h>
#include <veduta/dem.h>
#include <veduta/display.h>
#include <veduta/frame.h>
#include <veduta/function.h>
#include <veduta/furniture.h>
#include <veduta/heightfield.h>
#include <veduta/impostor.h>
#include <veduta/job.h>
#include <veduta/label_layout.h>
#include <veduta/light.h>
#include <veduta/matrix.h>
#include <veduta/mesh.h>
#include <veduta/model.h>
#include <veduta/object.h>
#include <veduta/outline.h>
#include <veduta/particle_source.h>
#include <veduta/particles.h>
#include <veduta/peaks.h>
#include <veduta/picture.h>
#include <veduta/placed.h>
#include <veduta/raster.h>
#include <veduta/shader.h>
#include <veduta/shadow.h>
#include <veduta/splat.h>
#include <veduta/status.h>
#include <veduta/target.h>
#include <veduta/terrain.h>
#include <veduta/texture.h>
#include <veduta/vector.h>
#include <veduta/world.h>

#endif
