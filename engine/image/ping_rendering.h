#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include <ensonify/engine/image/camera.h>
#include <ensonify/engine/image/display.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/sonar/vehicle/track.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/refine/active_mesh.h>

namespace ensonify::engine {

/// One ping over a seafloor, all in the seafloor's local metres.
struct ViewSubject {
  const Seafloor& seafloor;
  const refine::ActiveMesh& mesh;  ///< of the seafloor, refined for the fans
  std::span<const RayFan> fans;
  std::span<const Pose> track;
  std::size_t ping;  ///< among the track's
};

struct ViewOptions {
  std::size_t width_px = 1600;
  std::size_t height_px = 1000;
  int threads = 1;
  /// Told how many rows are done, from one thread at a time; what it throws ends the work.
  std::function<void(std::size_t done, std::size_t of)> progress;
};

struct PingRendering {
  Picture picture;
  Camera camera;
};

/// A perspective picture of one ping (as fig. 5 of the paper), without vertical exaggeration: the
/// active mesh with its edges, the exact faces and objects in colours of their own; each fan's
/// middle plane as a sheet that ends where the bed ends it, with rings of equal range; the track;
/// the sonar, enlarged, over a plumb line. The camera stands behind the sonar, to starboard and
/// above, where all of the fans is in view. The same on any number of threads. Throws
/// std::invalid_argument for a picture without pixels, no fans, or a ping that is not there, and
/// what the tracer throws.
PingRendering shade(const ViewSubject& subject, const ViewOptions& options);

}  // namespace ensonify::engine
