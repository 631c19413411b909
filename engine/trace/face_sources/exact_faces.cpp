#include <ensonify/engine/trace/face_sources/exact_faces.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include <ensonify/refine/active_mesh.h>
#include <ensonify/refine/footprint.h>
#include <ensonify/refine/grid_footprint.h>
#include <ensonify/refine/mesh_clusters.h>
#include <ensonify/refine/tile_collapse.h>
#include <ensonify/refine/tiles_in_view.h>

namespace ensonify::engine {
namespace {

using refine::FanVolume;

/// The active mesh as a source of exact faces. There is one active mesh, which always has the state
/// of the last ping, and two lists of its faces, used alternately.
struct Refined {
  std::shared_ptr<const refine::ProgressiveMesh> progressive;
  refine::ActiveMesh mesh{*progressive};
  explicit Refined(const FaceSourceParts& parts) : progressive(parts.progressive) {}
  refine::ExactFaces faces(std::span<const FanVolume> volumes, std::size_t) {
    mesh.refine(volumes);
    return mesh.exact_faces();
  }
  void reset() { mesh.reset(); }
};

/// The active mesh of a bed in clusters.
struct RefinedClusters {
  std::shared_ptr<refine::MeshClusters> clusters;
  refine::ActiveClusters active{*clusters};
  refine::ClustersInView far_ahead{*clusters};
  explicit RefinedClusters(const FaceSourceParts& parts) : clusters(parts.clusters) {}
  refine::ExactFaces faces(std::span<const FanVolume> volumes, std::size_t) {
    return active.refine(volumes);
  }
  void make_ready(std::span<const FanVolume> volumes) {
    for (const std::size_t cluster : far_ahead.find(volumes)) clusters->get(cluster);
  }
  void reset() { active.reset(); }
};

/// The top-down query as a source of exact faces.
struct Walked {
  std::shared_ptr<const refine::ProgressiveMesh> progressive;
  std::array<std::optional<refine::Footprint>, 2> footprints;
  explicit Walked(const FaceSourceParts& parts) : progressive(parts.progressive) {}
  refine::ExactFaces faces(std::span<const FanVolume> volumes, std::size_t turn) {
    std::optional<refine::Footprint>& footprint = footprints[turn];
    if (!footprint) footprint.emplace(*progressive);
    return footprint->query(volumes);
  }
  void reset() {}
};

/// The query over a bed of heights and its objects.
struct Gridded {
  std::shared_ptr<const refine::HeightGrid> grid;
  std::shared_ptr<const refine::BallTree> objects;
  std::array<refine::GridFootprint, 2> footprints{refine::GridFootprint(*grid, *objects),
                                                  refine::GridFootprint(*grid, *objects)};
  refine::TilesInView far_ahead{*grid};
  explicit Gridded(const FaceSourceParts& parts) : grid(parts.grid), objects(parts.objects) {}
  refine::ExactFaces faces(std::span<const FanVolume> volumes, std::size_t turn) {
    return footprints[turn].query(volumes);
  }
  void make_ready(std::span<const FanVolume> volumes) {
    if (grid->tiles_in_file() == nullptr) return;
    far_ahead.look_at(volumes);
    far_ahead.for_each([](const refine::HeightGrid::Tile&, int, int) {});
  }
  void reset() {}
};

/// The query over the objects on a bed of heights, without the bed.
struct ObjectFaces {
  std::shared_ptr<const refine::HeightGrid> grid;
  std::shared_ptr<const refine::BallTree> objects;
  struct List {
    std::vector<refine::Face> faces;
    std::vector<std::uint32_t> numbers;
  };
  std::array<List, 2> lists;
  refine::ViewTest view;
  explicit ObjectFaces(const FaceSourceParts& parts) : grid(parts.grid), objects(parts.objects) {}
  refine::ExactFaces faces(std::span<const FanVolume> volumes, std::size_t turn) {
    List& list = lists[turn];
    list.faces.clear();
    list.numbers.clear();
    view.look_at(volumes);
    const std::span<const refine::Face> all = objects->triangles().faces;
    // Faces lie far apart in memory: all are fetched before the first is copied.
    objects->walk(view, [&](std::uint32_t face, const refine::BallTree::Corners&) {
      __builtin_prefetch(&all[face]);
      list.numbers.push_back(face);
    });
    for (std::uint32_t& number : list.numbers) {
      list.faces.push_back(all[number]);
      number += static_cast<std::uint32_t>(grid->faces());
    }
    return {objects->triangles().positions, list.faces, list.numbers};
  }
  void reset() {}
};

/// A bound, in metres, on how far a point within range moves by the rotation between two volumes.
double turned_m(const FanVolume& from, const FanVolume& to) {
  const double turned = (from.array_axis - to.array_axis).norm() +
                        (from.middle - to.middle).norm() + (from.pole - to.pole).norm();
  return turned * std::max(from.range_m, to.range_m);
}
/// The same bound for rotation and translation together.
double moved_m(const FanVolume& from, const FanVolume& to) {
  return (to.apex - from.apex).norm() + turned_m(from, to);
}

bool same_shape(const FanVolume& a, const FanVolume& b) {
  return a.truncation_rad == b.truncation_rad && a.elevation_low_rad == b.elevation_low_rad &&
         a.elevation_high_rad == b.elevation_high_rad && a.range_m == b.range_m;
}

void take_volumes(std::span<const RayFan> fans, std::vector<FanVolume>& volumes) {
  volumes.clear();
  for (const RayFan& fan : fans) volumes.push_back(fan_volume_of(fan));
}

/// Exact faces, the intersector over them, and the volumes they were built for.
struct Stage {
  std::unique_ptr<Intersector> intersector;
  refine::Triangles triangles;
  std::vector<FanVolume> built;  // empty while there are no faces

  /// Whether the stage has all faces that `volumes` can touch.
  bool holds(std::span<const FanVolume> volumes) const {
    return !volumes.empty() &&
           std::ranges::equal(built, volumes, [](const FanVolume& from, const FanVolume& to) {
             return same_shape(to, from) && !(moved_m(from, to) + to.margin_m > from.margin_m);
           });
  }
};

/// Pings use one stage while a spare thread prepares the other for later pings.
template <class Source>
class ExactFaces final : public FaceSource {
 public:
  explicit ExactFaces(const FaceSourceParts& parts)
      : intersector_(parts.intersector),
        options_(parts.options.of_one_ping()),
        tree_pings_(parts.tree_pings),
        source_(parts) {
    stages_[turn_].intersector = make_intersector(intersector_, {}, options_);
  }

  Faces prepare(std::span<const RayFan> fans) override {
    take_volumes(fans, wanted_);
    if (!stages_[turn_].holds(wanted_)) {
      widen(wanted_, last_, wide_);
      if constexpr (can_make_ready) look_far_ahead();
      const bool ready = ahead_.finish();
      if (std::exchange(fault_ahead_, false)) source_.reset();
      // The other stage is used only if it is what would be built now, because results must not
      // depend on whether a thread was free.
      if (ready && stages_[1 - turn_].built == wide_)
        turn_ = 1 - turn_;
      else
        build(turn_, wide_);
      ++version_;
    }
    std::swap(last_, wanted_);
    before_announced_ = last_;
    return {stages_[turn_].intersector.get(), stages_[turn_].triangles, version_};
  }

  bool announce(std::span<const RayFan> fans, refine::SpareThreads& spare) override {
    if (far_wanted_) {
      far_ahead_.send(spare);
      far_wanted_ = !far_ahead_.is_out();
    }
    if (ahead_.is_out()) return false;
    take_volumes(fans, announced_);
    if (stages_[turn_].holds(announced_)) {
      std::swap(before_announced_, announced_);
      return true;
    }
    widen(announced_, before_announced_, wide_ahead_);
    ahead_.send(spare);
    return false;
  }

  void reset() override {
    ahead_.finish();
    far_ahead_.finish();
    fault_ahead_ = far_wanted_ = false;
    source_.reset();
    for (Stage& stage : stages_) stage.built.clear();
    last_.clear();
  }

 private:
  /// Widens the volumes to cover the next pings if the motion of the last two continues: half the
  /// distance from the middle of their path, and the whole rotation.
  void widen(const std::vector<FanVolume>& volumes, const std::vector<FanVolume>& before,
             std::vector<FanVolume>& wide) const {
    wide = volumes;
    if (!go_on(before, volumes)) return;
    const double more = (tree_pings_ - 1) * (1.0 + 1e-6);  // and a margin for rounding
    for (std::size_t i = 0; i < wide.size(); ++i) {
      const Eigen::Vector3d half_way = 0.5 * more * (volumes[i].apex - before[i].apex);
      // Origins are rounded to floats: by up to sqrt(3) u of their largest coordinate, u = 2^-24.
      // This error counts once in the last apex, 1 + more times in the middle and `more` times in
      // half the way: 2 sqrt(3) (1 + more) u.
      const double rounding_m = 0x1p-22 * (1.0 + more) * wide[i].apex.lpNorm<Eigen::Infinity>();
      wide[i].apex += half_way;
      wide[i].margin_m += half_way.norm() + more * turned_m(before[i], volumes[i]) + rounding_m;
    }
  }
  void build(std::size_t turn, std::vector<FanVolume>& volumes) {
    Stage& stage = stages_[turn];
    stage.built.clear();
    if (!stage.intersector) stage.intersector = make_intersector(intersector_, {}, options_);
    const refine::ExactFaces exact = source_.faces(volumes, turn);
    stage.triangles = {exact.points, exact.faces, exact.source_faces};
    stage.intersector->build(stage.triangles);
    std::swap(stage.built, volumes);
  }
  /// Drops any error, because the ping that needs these faces builds them again and gets the error.
  void build_ahead() noexcept {
    try {
      build(1 - turn_, wide_ahead_);
    } catch (...) {
      fault_ahead_ = true;
    }
  }
  /// Starts what takes long to prepare for much later pings, if the motion continues.
  void look_far_ahead() {
    if (far_ahead_.is_running() || !go_on(last_, wanted_)) return;
    far_ahead_.finish();
    far_ = wanted_;
    for (std::size_t i = 0; i < far_.size(); ++i)
      far_[i].apex += far_ahead_pings * (wanted_[i].apex - last_[i].apex);
    far_wanted_ = true;
  }
  /// Drops any error, as build_ahead() does.
  void make_far_ready() noexcept {
    if constexpr (can_make_ready) try {
        source_.make_ready(far_);
      } catch (...) {
      }
  }
  /// Whether to expect that the motion continues: not at the first ping, nor after a leap (the end
  /// of a line).
  static bool go_on(const std::vector<FanVolume>& before, const std::vector<FanVolume>& volumes) {
    return std::ranges::equal(before, volumes, [](const FanVolume& from, const FanVolume& to) {
      return !(moved_m(from, to) > leap_of_range * to.range_m);
    });
  }

  static constexpr double leap_of_range = 0.05;
  static constexpr bool can_make_ready =
      requires(Source source, std::span<const FanVolume> volumes) {
    source.make_ready(volumes);
  };
  // Tiles are made 1024 x 1024 points at a time, in the time of about a hundred pings.
  static constexpr double far_ahead_pings = 200.0;

  std::string intersector_;
  IntersectorOptions options_;
  int tree_pings_;
  Source source_;
  std::array<Stage, 2> stages_;
  std::size_t turn_ = 0;  // the stage in use
  std::uint64_t version_ = 0;
  std::vector<FanVolume> wanted_, last_, wide_;  // wide_ also covers the next pings
  std::vector<FanVolume> announced_, before_announced_, wide_ahead_, far_;
  bool fault_ahead_ = false, far_wanted_ = false;
  // Declared last: they use the other members.
  refine::SpareThreads::BackgroundTask ahead_{[this] { build_ahead(); }};
  refine::SpareThreads::BackgroundTask far_ahead_{[this] { make_far_ready(); }};
};

}  // namespace

std::unique_ptr<FaceSource> make_refined_faces(const FaceSourceParts& parts) {
  if (parts.clusters) return std::make_unique<ExactFaces<RefinedClusters>>(parts);
  return std::make_unique<ExactFaces<Refined>>(parts);
}

std::unique_ptr<FaceSource> make_footprint_faces(const FaceSourceParts& parts) {
  if (!parts.grid) return std::make_unique<ExactFaces<Walked>>(parts);
  auto exact = std::make_unique<ExactFaces<Gridded>>(parts);
  if (&intersector_kind(parts.intersector) != &intersector_kind("fan_scan")) return exact;
  return make_scanned_grid(parts, std::move(exact));
}

std::unique_ptr<FaceSource> make_object_faces(const FaceSourceParts& parts) {
  return std::make_unique<ExactFaces<ObjectFaces>>(parts);
}

std::shared_ptr<const refine::ProgressiveMesh> make_progressive_mesh(
    const refine::TriangleMesh& mesh, int threads, const std::function<void()>& stop_check) {
  return std::make_shared<const refine::ProgressiveMesh>(
      refine::build_of_any_mesh(mesh, threads, refine::Borders::collapse, stop_check));
}

// A bent ray's point lies in direction d': its launch d, turned by up to the bend within a vertical
// plane. With k = cos'/cos of the two angles from the level, at most the widening,
//   d' = k d + (k sin - sin') z.
// So |d' . axis| <= k |d . axis| + |k sin - sin'| |axis . z|. The last difference is at most
// k - 1 + 2 sin(turn / 2); for k < 1 it is less than the turn's part plus 1 - k, and 1 - k is less
// than the widening minus 1, because k is at least the slowest speed divided by the fastest.
// Elevations change by at most the turn; what goes past 90 degrees is within the margin.
FanVolume fan_volume_of(const RayFan& fan) {
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
