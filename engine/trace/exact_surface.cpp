#include <ensonify/engine/trace/exact_surface.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include <ensonify/refine/active_mesh.h>
#include <ensonify/refine/footprint.h>
#include <ensonify/refine/mesh_repair.h>
#include <ensonify/refine/tile_collapse.h>

namespace ensonify::engine {
namespace {

using refine::ViewVolume;

/// The active mesh as a source of exact faces.
struct Refined {
  refine::ActiveMesh mesh;
  explicit Refined(const refine::ProgressiveMesh& of) : mesh(of) {}
  refine::ExactFaces faces(std::span<const ViewVolume> volumes) {
    mesh.refine(volumes);
    return mesh.exact_faces();
  }
  void reset() { mesh.reset(); }
};

/// The top-down query as one.
struct Walked {
  refine::Footprint footprint;
  explicit Walked(const refine::ProgressiveMesh& of) : footprint(of) {}
  refine::ExactFaces faces(std::span<const ViewVolume> volumes) { return footprint.query(volumes); }
  void reset() {}
};

IntersectorOptions for_one_ping(IntersectorOptions options) {
  options.for_one_ping = true;
  return options;
}

/// No point within range of the one volume is farther than this from the same point of the other.
double moved_m(const ViewVolume& from, const ViewVolume& to) {
  const double turned = (from.array_axis - to.array_axis).norm() +
                        (from.middle - to.middle).norm() + (from.pole - to.pole).norm();
  return (to.apex - from.apex).norm() + turned * std::max(from.range_m, to.range_m);
}

bool same_shape(const ViewVolume& a, const ViewVolume& b) {
  return a.truncation_rad == b.truncation_rad && a.elevation_low_rad == b.elevation_low_rad &&
         a.elevation_high_rad == b.elevation_high_rad && a.range_m == b.range_m;
}

template <class Source>
class ExactSurface final : public Surface {
 public:
  explicit ExactSurface(const SurfaceParts& parts)
      : progressive_(parts.progressive),
        source_(*progressive_),
        intersector_(make_intersector(parts.intersector, {}, for_one_ping(parts.options))),
        tree_pings_(parts.tree_pings) {}

  const Intersector& prepare(std::span<const RayFan> fans) override {
    wanted_.clear();
    for (const RayFan& fan : fans) wanted_.push_back(view_volume(fan));
    if (!still_inside()) {
      const double margin_m = tree_pings_ > 1 ? (tree_pings_ - 1) * advance_m() : 0.0;
      for (ViewVolume& volume : wanted_) volume.margin_m = margin_m;
      const refine::ExactFaces exact = source_.faces(wanted_);
      triangles_ = {exact.points, exact.faces, exact.source_faces};
      intersector_->build(triangles_);
      std::swap(built_, wanted_);
      last_ = built_;
    } else {
      last_ = wanted_;
    }
    return *intersector_;
  }

  refine::Triangles triangles() const override { return triangles_; }

  void reset() override {
    source_.reset();
    built_.clear();
    last_.clear();
  }

 private:
  /// Whether the tree that is there holds all that the wanted volumes can touch.
  bool still_inside() const {
    if (tree_pings_ <= 1 || wanted_.size() != built_.size() || wanted_.empty()) return false;
    for (std::size_t i = 0; i < wanted_.size(); ++i)
      if (!same_shape(wanted_[i], built_[i]) || moved_m(built_[i], wanted_[i]) > built_[i].margin_m)
        return false;
    return true;
  }
  /// How far the fans went since the last ping; none the first time.
  double advance_m() const {
    double most_m = 0.0;
    if (last_.size() == wanted_.size())
      for (std::size_t i = 0; i < wanted_.size(); ++i)
        most_m = std::max(most_m, moved_m(last_[i], wanted_[i]));
    return most_m;
  }

  std::shared_ptr<const refine::ProgressiveMesh> progressive_;
  Source source_;
  std::unique_ptr<Intersector> intersector_;
  refine::Triangles triangles_;
  int tree_pings_;
  std::vector<ViewVolume> wanted_, built_, last_;
};

}  // namespace

std::unique_ptr<Surface> make_refined_surface(const SurfaceParts& parts) {
  return std::make_unique<ExactSurface<Refined>>(parts);
}

std::unique_ptr<Surface> make_footprint_surface(const SurfaceParts& parts) {
  return std::make_unique<ExactSurface<Walked>>(parts);
}

std::shared_ptr<const refine::ProgressiveMesh> make_progressive_mesh(
    const refine::TriangleMesh& mesh, int threads) {
  const refine::RepairedMesh manifold = refine::repair(mesh, -1.0);
  refine::ProgressiveMeshArrays built = refine::build_by_tiles(manifold.mesh, threads);
  for (std::uint32_t& face : built.source_face)
    if (face != refine::ProgressiveMesh::none) face = manifold.source_face[face];
  return std::make_shared<const refine::ProgressiveMesh>(std::move(built));
}

ViewVolume view_volume(const RayFan& fan) {
  const FanGrid& grid = *fan.grid;
  return {.apex = fan.origin,
          .array_axis = fan.array_axis,
          .middle = fan.middle,
          .pole = fan.pole,
          .truncation_rad = std::asin(std::min(grid.sin_truncation, 1.0)),
          .elevation_low_rad = grid.elevation_rad.front(),
          .elevation_high_rad = grid.elevation_rad.back(),
          .range_m = fan.range_m};
}

}  // namespace ensonify::engine
