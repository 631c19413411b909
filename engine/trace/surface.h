#pragma once

#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include <ensonify/engine/trace/intersector.h>
#include <ensonify/engine/trace/ray_fan.h>

namespace ensonify::engine {

/// Which triangles are there for a ping, whatever intersects them. Faces keep their numbers in the
/// seafloor's mesh, and their corners' order.
class Surface {
 public:
  virtual ~Surface() = default;
  /// The intersector over the faces that these fans can touch; good until the next call.
  virtual const Intersector& prepare(std::span<const RayFan> fans) = 0;
};

/// All faces, built once, shared by every worker.
class StaticSurface final : public Surface {
 public:
  explicit StaticSurface(std::shared_ptr<const Intersector> whole) : whole_(std::move(whole)) {}
  const Intersector& prepare(std::span<const RayFan>) override { return *whole_; }

 private:
  std::shared_ptr<const Intersector> whole_;
};

/// The surfaces there are, by the names of `--surface`.
std::vector<std::string_view> surface_names();

/// One worker's surface of that name; `whole` is over all faces. Throws std::invalid_argument, listing
/// the names there are.
std::unique_ptr<Surface> make_surface(std::string_view name,
                                      std::shared_ptr<const Intersector> whole);

}  // namespace ensonify::engine
