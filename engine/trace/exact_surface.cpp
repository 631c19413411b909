#include <ensonify/engine/trace/exact_surface.h>

#include <algorithm>
#include <cmath>
#include <numbers>
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
        intersector_(make_intersector(parts.intersector, {}, parts.options.of_one_ping())),
        tree_pings_(parts.tree_pings) {}

  const Intersector& prepare(std::span<const RayFan> fans) override {
    wanted_.clear();
    for (const RayFan& fan : fans) wanted_.push_back(view_volume(fan));
    if (!still_inside()) {
      const double margin_m = tree_pings_ > 1 ? (tree_pings_ - 1) * advance_m() : 0.0;
      for (ViewVolume& volume : wanted_) volume.margin_m += margin_m;
      const refine::ExactFaces exact = source_.faces(wanted_);
      triangles_ = {exact.points, exact.faces, exact.source_faces};
      intersector_->build(triangles_);
      ++version_;
      std::swap(built_, wanted_);
      last_ = built_;
    } else {
      last_ = wanted_;
    }
    return *intersector_;
  }

  refine::Triangles triangles() const override { return triangles_; }
  std::uint64_t version() const override { return version_; }

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
      if (!same_shape(wanted_[i], built_[i]) ||
          moved_m(built_[i], wanted_[i]) + wanted_[i].margin_m > built_[i].margin_m)
        return false;
    return true;
  }
  /// How far the fans went since the last ping; none the first time, nor after a leap (the end of a
  /// line), which nothing says will be made again.
  double advance_m() const {
    double most_m = 0.0;
    if (last_.size() == wanted_.size())
      for (std::size_t i = 0; i < wanted_.size(); ++i)
        most_m = std::max(most_m, moved_m(last_[i], wanted_[i]));
    const bool leap = most_m > 0.0 && most_m > leap_of_range * wanted_.front().range_m;
    return leap ? 0.0 : most_m;
  }

  static constexpr double leap_of_range = 0.05;

  std::shared_ptr<const refine::ProgressiveMesh> progressive_;
  Source source_;
  std::unique_ptr<Intersector> intersector_;
  refine::Triangles triangles_;
  std::uint64_t version_ = 0;
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
  try {
    return std::make_shared<const refine::ProgressiveMesh>(refine::build_by_tiles(mesh, threads));
  } catch (const refine::MeshError&) {
    // Not manifold as it is, as heightfields are: those need no repair, which takes as long.
    const refine::RepairedMesh manifold = refine::repair(mesh, -1.0);
    refine::ProgressiveMeshArrays built = refine::build_by_tiles(manifold.mesh, threads);
    for (std::uint32_t& face : built.source_face)
      if (face != refine::ProgressiveMesh::none) face = manifold.source_face[face];
    return std::make_shared<const refine::ProgressiveMesh>(std::move(built));
  }
}

// A bent ray's point lies in direction d', that of its launch d turned by up to the bend within a vertical
// plane. With k = cos'/cos of the two angles from the level, at most the widening, d' = k d + (k sin - sin')
// z: so |d' . axis| <= k |d . axis| + |k sin - sin'| |axis . z|, and the last difference is at most k - 1 +
// 2 sin(turn / 2), or with k < 1 less than the turn's part and 1 - k, which is less than k' - 1 for the
// slowest against the fastest. Elevations change by the turn at most; what that turns past 90 degrees is
// as near as the margin.
ViewVolume view_volume(const RayFan& fan) {
  constexpr double right_angle = 0.5 * std::numbers::pi;
  const FanGrid& grid = *fan.grid;
  const FanBend& bend = fan.bend;
  const double range_m = fan.range_m * bend.lengthening;
  const double tilted = std::abs(fan.array_axis.z()) *
                        (bend.widening - 1.0 + 2.0 * std::sin(0.5 * std::min(bend.turn_rad, 1.0)));
  const double low = grid.elevation_rad.front() - bend.turn_rad;
  const double high = grid.elevation_rad.back() + bend.turn_rad;
  const double past = std::max({0.0, -right_angle - low, high - right_angle});
  return {.apex = fan.origin,
          .array_axis = fan.array_axis,
          .middle = fan.middle,
          .pole = fan.pole,
          .truncation_rad = std::asin(std::min(grid.sin_truncation * bend.widening + tilted, 1.0)),
          .elevation_low_rad = std::max(low, -right_angle),
          .elevation_high_rad = std::min(high, right_angle),
          .range_m = range_m,
          .margin_m = past * range_m};
}

}  // namespace ensonify::engine
