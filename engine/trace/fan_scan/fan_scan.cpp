#include <ensonify/engine/trace/fan_scan/fan_scan.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <stdexcept>

#include <Eigen/Geometry>

#include <ensonify/engine/simd/cache_lines.h>
#include <ensonify/engine/trace/fan_scan/face_blocks.h>
#include <ensonify/engine/trace/fan_scan/fan_tables.h>
#include <ensonify/engine/trace/fan_scan/scan_kernel.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector3d;

/// Memory of one query; it grows to the largest fan's need and is kept.
struct Scratch {
  KnownFanTables known_tables;
  ScanBatch batch;
  CacheLines<double> crossings;
  CacheLines<std::int64_t> counts, claimed_from, claimed_until;
  CacheLines<MetBlock> blocks_met;
  CacheLines<std::uint32_t> index, nearest, doubtful;
  CacheLines<float> nearness;  // 0 between queries; `nearest` is then no_candidate
  CacheLines<double> forms, face_planes;
};

template <class Vector>
auto* at_least(Vector& vector, std::size_t size) {
  if (vector.size() < size) vector.resize(size);
  return vector.data();
}

/// The hit of a ray on a face whose interval contains the ray, where rounding may spoil the
/// quotient t because the ray sees the face edge on or begins on it.
Hit place_on_face(refine::Triangles triangles, std::uint32_t index, const Ray& ray) {
  const Vector3d a = triangles.corner(index, 0) - ray.origin,
                 b = triangles.corner(index, 1) - ray.origin,
                 c = triangles.corner(index, 2) - ray.origin;
  const Vector3d ab = b - a, ac = c - a, normal = ab.cross(ac);
  const double far = std::sqrt(std::max({a.squaredNorm(), b.squaredNorm(), c.squaredNorm()}));
  const double longest =
      std::sqrt(std::max({ab.squaredNorm(), ac.squaredNorm(), (c - b).squaredNorm()}));
  const double in_plane = normal.dot(a) / normal.dot(ray.direction);
  // If the ray lies in the plane, in_plane is NaN, and t becomes the near end.
  const double t = std::min(std::max(std::max(0.0, far - longest), in_plane), far);
  if (t > ray.t_max) return {};
  // The point of the face's plane that is nearest to the ray's point at t.
  const Vector3d p = t * ray.direction - a;
  const double n2 = normal.squaredNorm();
  const double u = std::clamp(p.cross(ac).dot(normal) / n2, 0.0, 1.0);
  const double v = std::clamp(ab.cross(p).dot(normal) / n2, 0.0, 1.0 - u);
  return {triangles.number(index), index, t, u, v};
}

class FanScan final : public Intersector {
 public:
  void build(refine::Triangles triangles) override {
    triangles_ = {};
    blocks_.take(triangles);
    triangles_ = triangles;
  }

  std::string_view code_path() const override { return "portable"; }

  void intersect(const RayFan& fan, std::span<Hit> hits) const override {
    check_fan(fan, hits);
    if (hits.empty()) return;
    const Borrowed scratch(*this);
    const FanTables& tables = scratch->known_tables.of(fan.grid);
    const ScanArgs args = scan(fan, tables, *scratch, true);
    for (std::size_t plane = 0; plane < fan.planes(); ++plane)
      finish(args, fan, tables, plane, hits.subspan(plane * fan.elevations()), *scratch);
  }

  bool list_runs(const RayFan& fan, FanRuns& runs) const override {
    check_frame(fan);
    const Borrowed scratch(*this);
    const FanTables& tables = scratch->known_tables.of(fan.grid);
    if (std::ranges::find(tables.uneven, 1) != tables.uneven.end()) return false;
    runs.start(*fan.grid);
    const ScanArgs args = scan(fan, tables, *scratch, false);
    const RunRows rows{runs.begin.data(), runs.end.data(),  runs.index.data(),   runs.face.data(),
                       runs.level.data(), runs.pole.data(), runs.distance.data()};
    std::int64_t count = 0;
    for (std::int64_t plane = 0; plane < args.planes; ++plane) {
      const std::int64_t from = scratch->batch.claimed_from[plane];
      const std::int64_t until = scratch->batch.claimed_until[plane];
      const std::int64_t before = std::min(until, args.left_out_from[plane]);
      const std::int64_t behind = std::max(from, args.left_out_until[plane]);
      count = engine::list_runs(args, plane, from, before, rows, count);
      count = engine::list_runs(args, plane, behind, until, rows, count);
      runs.first.push_back(static_cast<std::size_t>(count));
    }
    return true;
  }

  void intersect(std::span<const Ray>, std::span<Hit>) const override {
    throw std::invalid_argument(
        "fan_scan takes fans only, no lists of rays; use embree or pluecker for lists");
  }

 private:
  /// Scratch memory from the pool; returned by the destructor.
  class Borrowed {
   public:
    explicit Borrowed(const FanScan& owner) : owner_(owner) {
      const std::lock_guard lock(owner.pool_mutex_);
      if (owner.pool_.empty()) {
        ++owner.lent_;
        owner.pool_.reserve(owner.lent_);
        scratch_ = std::make_unique<Scratch>();
      } else {
        scratch_ = std::move(owner.pool_.back());
        owner.pool_.pop_back();
      }
    }
    ~Borrowed() {
      const std::lock_guard lock(owner_.pool_mutex_);
      owner_.pool_.push_back(std::move(scratch_));
    }
    Borrowed(const Borrowed&) = delete;
    Scratch& operator*() const { return *scratch_; }
    Scratch* operator->() const { return scratch_.get(); }

   private:
    const FanScan& owner_;
    std::unique_ptr<Scratch> scratch_;
  };

  /// Fills the z-buffer with the nearest face of each ray. The function that reads the z-buffer
  /// must clear it.
  ScanArgs scan(const RayFan& fan, const FanTables& tables, Scratch& scratch,
                bool hits_wanted) const {
    ScanArgs args = args_for(fan, tables);
    args.blocks_met = at_least(scratch.blocks_met, blocks_.boxes_in_row());
    find_blocks(args);

    const std::size_t planes = fan.planes(), elevations = fan.elevations();
    const std::size_t stride = (elevations / widest_vector + 2) * widest_vector;
    args.stride = static_cast<std::int64_t>(stride);
    const std::size_t candidates =
        static_cast<std::size_t>(args.blocks_met_count) * FaceBlocks::faces + widest_vector;
    args.max_candidates = static_cast<std::int64_t>(candidates);
    args.index = at_least(scratch.index, candidates);
    args.hits_wanted = hits_wanted;
    if (hits_wanted)
      args.forms = at_least(scratch.forms, 12 * candidates);
    else
      args.face_planes = at_least(scratch.face_planes, 4 * candidates);
    at_least(scratch.doubtful, elevations);
    if (scratch.nearness.size() < planes * stride) {
      scratch.nearness.assign(planes * stride, 0.0f);
      scratch.nearest.assign(planes * stride, ScanArgs::no_candidate);
    }
    args.nearness = scratch.nearness.data();
    args.nearest = scratch.nearest.data();
    scratch.batch.counts = at_least(scratch.counts, planes);
    scratch.batch.claimed_from = at_least(scratch.claimed_from, planes);
    scratch.batch.claimed_until = at_least(scratch.claimed_until, planes);
    scratch.batch.crossings =
        at_least(scratch.crossings, planes * ScanBatch::list_rows * ScanBatch::list_room);
    scan_faces(args, scratch.batch);
    return args;
  }

  /// Writes one plane's hits; may overwrite hits of later planes.
  void finish(const ScanArgs& args, const RayFan& fan, const FanTables& tables, std::size_t plane,
              std::span<Hit> hits, Scratch& scratch) const {
    const std::int64_t from = tables.left_out_from[plane], until = tables.left_out_until[plane];
    finish_rays(args, fan, plane, 0, from, hits, scratch);
    write_misses(hits.data() + from, until - from);
    finish_rays(args, fan, plane, until, args.elevations, hits, scratch);
    if (tables.uneven[plane])
      for (std::size_t e = 0; e < fan.elevations(); ++e)
        if (!fan.grid->within_beam(plane, e)) hits[e] = Hit{};
  }

  void finish_rays(const ScanArgs& args, const RayFan& fan, std::size_t plane, std::int64_t from,
                   std::int64_t until, std::span<Hit> hits, Scratch& scratch) const {
    std::uint32_t* doubtful = scratch.doubtful.data();
    const auto finish = [&](std::int64_t begin, std::int64_t end, Hit* to) {
      const std::int64_t doubts =
          engine::finish_rays(args, static_cast<std::int64_t>(plane), begin, end, to, doubtful);
      for (std::int64_t i = 0; i < doubts; ++i) {
        Hit& hit = to[doubtful[i] - begin];
        hit = place_on_face(triangles_, hit.index, fan.ray(plane, doubtful[i]));
      }
    };
    // Whole vectors are written, so the fan's last rays go through a separate array.
    constexpr std::int64_t room = widest_vector;
    const std::int64_t direct =
        std::clamp(static_cast<std::int64_t>(hits.size()) - room, from, until);
    finish(from, direct, hits.data() + from);
    std::array<Hit, 2 * widest_vector> last;
    finish(direct, until, last.data());
    std::copy_n(last.begin(), until - direct, hits.begin() + direct);
  }

  ScanArgs args_for(const RayFan& fan, const FanTables& tables) const {
    ScanArgs args{};
    args.frame = frame_of(fan);
    args.range_m = fan.range_m;
    args.planes = static_cast<std::int64_t>(fan.planes());
    args.elevations = static_cast<std::int64_t>(fan.elevations());
    args.sin_azimuth = tables.sin_azimuth.data();
    args.cos_azimuth = tables.cos_azimuth.data();
    args.tan_azimuth = tables.tan_azimuth.data();
    args.left_out_from = tables.left_out_from.data();
    args.left_out_until = tables.left_out_until.data();
    args.sin_elevation = fan.grid->sin_elevation.data();
    args.cos_elevation = fan.grid->cos_elevation.data();
    args.sin_elevation_rounded = tables.sin_elevation.data();
    args.cos_elevation_rounded = tables.cos_elevation.data();
    args.order = tables.order();
    args.block_rows = blocks_.rows_of.data();
    args.boxes = blocks_.boxes.data();
    args.blocks = static_cast<std::int64_t>(blocks_.count);
    args.boxes_in_row = static_cast<std::int64_t>(blocks_.boxes_in_row());
    args.numbers = triangles_.numbers.empty() ? nullptr : triangles_.numbers.data();
    return args;
  }

  refine::Triangles triangles_;
  FaceBlocks blocks_;
  mutable std::mutex pool_mutex_;
  mutable std::size_t lent_ = 0;
  mutable std::vector<std::unique_ptr<Scratch>> pool_;
};

}  // namespace

std::unique_ptr<Intersector> make_fan_scan(const IntersectorOptions&) {
  return std::make_unique<FanScan>();
}

}  // namespace ensonify::engine
