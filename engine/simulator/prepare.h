#pragma once

#include <compare>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <ensonify/engine/preparation.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/seafloor/bed_height.h>
#include <ensonify/engine/seafloor/make_seafloor.h>
#include <ensonify/engine/seafloor/seafloor.h>

namespace ensonify::refine {
class MeshClusters;
}

namespace ensonify::engine {

/// A scene's seafloor as its face source needs it. Simulators share it.
struct PreparedSeafloor {
  /// For `static` it has its mesh. For `footprint` it has its grid, if there is one; for `refined`,
  /// if the grid is made in tiles. Otherwise it has its progressive mesh.
  Seafloor seafloor;
  /// The same bed and objects for `refined`, where the bed is made in tiles.
  std::shared_ptr<refine::MeshClusters> clusters;
  SeafloorOrigin origin;
  std::vector<std::string> warnings;  ///< warnings about the cache

  /// Finds the height of the bed, for a seafloor without a progressive mesh. The first call makes
  /// the grid, with this stop check. Any number of threads may call. The seafloor must not change
  /// afterwards.
  const BedGrid& bed(const std::function<void()>& stop_check = {}) const;

 private:
  mutable std::once_flag bed_once_;
  mutable std::optional<BedGrid> bed_;
};

/// Finds the height of a prepared seafloor's bed: in its progressive mesh, if it has one, otherwise
/// by PreparedSeafloor::bed(). One thread at a time.
class BedHeight {
 public:
  /// The seafloor must outlive this.
  explicit BedHeight(const PreparedSeafloor& prepared);
  double height_m(double x_m, double y_m);
  std::optional<BedPoint> top(double x_m, double y_m);

 private:
  const BedGrid* grid_ = nullptr;
  std::optional<PlumbLine> plumb_line_;  // without a grid
};

/// What decides how a scene's seafloor is prepared, in addition to the seafloor itself; `auto`
/// depends on nothing else. Scenes with the same seafloor and the same key can share a
/// PreparedSeafloor.
struct PreparationKey {
  std::string surface, intersector;       ///< as in RunOptions
  std::optional<std::size_t> line_pings;  ///< none: the track is no single line

  auto operator<=>(const PreparationKey&) const = default;
};
PreparationKey preparation_key(const Scene& scene);

/// Makes a scene's seafloor and, for a surface that needs it, its progressive mesh; or finds both
/// in the cache; or returns how.seafloor, if there is one. A cached file that is damaged or belongs
/// to another seafloor is made again; if it cannot be written, there is a warning. Throws what
/// seafloor_of() throws, SceneError, and MemoryError before it allocates memory that is not
/// available.
std::shared_ptr<const PreparedSeafloor> prepare_seafloor(const Scene& scene,
                                                         const Preparation& how);

/// The scene for a session, whose number of pings is unknown: `auto` becomes `static`, with which a
/// ping costs least. An analysis may not save time. Not for a bed that is made in tiles.
Scene with_session_surface(Scene scene);

/// Makes the scene's seafloor. Throws as make_seafloor(), but SceneError in place of
/// std::invalid_argument. An error about a layer or an object names its place in the scene's file.
/// MemoryError for a mesh that does not fit.
Seafloor seafloor_of(const Scene& scene, const MemoryPlan& plan = {}, BedForm form = BedForm::mesh,
                     const WorkControl& control = {});

/// The heights of the scene's bed, as make_heightfield() makes them. Throws as seafloor_of().
Heightfield heights_of(const Scene& scene, const MemoryPlan& plan = {},
                       const WorkControl& control = {});

}  // namespace ensonify::engine
