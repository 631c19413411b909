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

/// What one query needs; it grows to what the largest fan took, and stays there.
struct Scratch {
  FanTables tables;
  ScanBatch batch;
  CacheLines<double> crossings;
  CacheLines<std::int64_t> counts;
  CacheLines<std::uint32_t> met_blocks, index, nearest, doubtful;
  CacheLines<float> nearness;  // 0 between queries, as nearest is no_slot
  CacheLines<double> forms, face_planes;
};

template <class Vector>
auto* at_least(Vector& vector, std::size_t size) {
  if (vector.size() < size) vector.resize(size);
  return vector.data();
}

/// Where a ray meets a face whose interval it is in, though rounding may spoil the quotient t: the
/// ray sees the face on edge, or begins on it.
Hit place_on_face(refine::Triangles triangles, std::uint32_t index, const Ray& ray) {
  const Vector3d a = triangles.corner(index, 0) - ray.origin,
                 b = triangles.corner(index, 1) - ray.origin,
                 c = triangles.corner(index, 2) - ray.origin;
  const Vector3d ab = b - a, ac = c - a, normal = ab.cross(ac);
  const double far = std::sqrt(std::max({a.squaredNorm(), b.squaredNorm(), c.squaredNorm()}));
  const double longest =
      std::sqrt(std::max({ab.squaredNorm(), ac.squaredNorm(), (c - b).squaredNorm()}));
  const double in_plane = normal.dot(a) / normal.dot(ray.direction);
  // No number, if the ray lies in the plane, counts as the near end.
  const double t = std::min(std::max(std::max(0.0, far - longest), in_plane), far);
  if (t > ray.t_max) return {};
  // The point of the face's plane that is nearest to the ray's.
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
    const Borrowed scratch(*this, fan);
    const ScanArgs pass = scan(fan, *scratch, true);
    for (std::size_t plane = 0; plane < fan.planes(); ++plane)
      finish(pass, fan, plane, hits.subspan(plane * fan.elevations()), *scratch);
  }

  bool list_runs(const RayFan& fan, FanRuns& runs) const override {
    check_frame(fan);
    const Borrowed scratch(*this, fan);
    const FanTables& tables = scratch->tables;
    if (std::ranges::find(tables.uneven, 1) != tables.uneven.end()) return false;
    runs.start(*fan.grid);
    const ScanArgs pass = scan(fan, *scratch, false);
    const RunRows rows{runs.begin.data(), runs.end.data(),  runs.index.data(),   runs.face.data(),
                       runs.level.data(), runs.pole.data(), runs.distance.data()};
    std::int64_t count = 0;
    for (std::int64_t plane = 0; plane < pass.planes; ++plane) {
      const std::int64_t from = pass.left_out_from[plane], until = pass.left_out_until[plane];
      count = engine::list_runs(pass, plane, 0, from, rows, count);
      count = engine::list_runs(pass, plane, until, pass.elevations, rows, count);
      runs.first.push_back(static_cast<std::size_t>(count));
    }
    return true;
  }

  void intersect(std::span<const Ray>, std::span<Hit>) const override {
    throw std::invalid_argument(
        "fan_scan takes fans only, no list of rays; take embree or pluecker for those");
  }

 private:
  /// Some scratch of the pool, with the fan's tables; given back at the end.
  class Borrowed {
   public:
    Borrowed(const FanScan& owner, const RayFan& fan) : Borrowed(owner) {
      if (scratch_->tables.grid() != fan.grid.get()) scratch_->tables.take(fan.grid);
    }
    ~Borrowed() {
      const std::lock_guard lock(owner_.pool_mutex_);
      owner_.pool_.push_back(std::move(scratch_));
    }
    Borrowed(const Borrowed&) = delete;
    Scratch& operator*() const { return *scratch_; }
    Scratch* operator->() const { return scratch_.get(); }

   private:
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
    const FanScan& owner_;
    std::unique_ptr<Scratch> scratch_;
  };

  /// What the fan's rays are nearest to; whoever reads it forgets it.
  ScanArgs scan(const RayFan& fan, Scratch& scratch, bool hits_wanted) const {
    const FanTables& tables = scratch.tables;
    ScanArgs pass = pass_over(fan, tables);
    pass.met_blocks = at_least(scratch.met_blocks, blocks_.boxes_in_row() + widest_vector);
    find_blocks(pass);

    const std::size_t planes = fan.planes(), elevations = fan.elevations();
    const std::size_t stride = (elevations / widest_vector + 2) * widest_vector;
    pass.stride = static_cast<std::int64_t>(stride);
    const std::size_t slots =
        static_cast<std::size_t>(pass.met) * FaceBlocks::faces + widest_vector;
    pass.slots = static_cast<std::int64_t>(slots);
    pass.index = at_least(scratch.index, slots);
    pass.hits_wanted = hits_wanted;
    if (hits_wanted)
      pass.forms = at_least(scratch.forms, 12 * slots);
    else
      pass.face_planes = at_least(scratch.face_planes, 4 * slots);
    at_least(scratch.doubtful, elevations);
    if (scratch.nearness.size() < planes * stride) {
      scratch.nearness.assign(planes * stride, 0.0f);
      scratch.nearest.assign(planes * stride, ScanArgs::no_slot);
    }
    pass.nearness = scratch.nearness.data();
    pass.nearest = scratch.nearest.data();
    scratch.batch.counts = at_least(scratch.counts, planes);
    scratch.batch.crossings =
        at_least(scratch.crossings, planes * ScanBatch::list_rows * ScanBatch::list_room);
    scan_faces(pass, scratch.batch);
    return pass;
  }

  /// One plane's hits; those of the planes behind it may be overwritten.
  void finish(const ScanArgs& pass, const RayFan& fan, std::size_t plane, std::span<Hit> hits,
              Scratch& scratch) const {
    const FanTables& tables = scratch.tables;
    const std::int64_t from = tables.left_out_from[plane], until = tables.left_out_until[plane];
    finish_rays(pass, fan, plane, 0, from, hits, scratch);
    write_misses(hits.data() + from, until - from);
    finish_rays(pass, fan, plane, until, pass.elevations, hits, scratch);
    if (tables.uneven[plane])
      for (std::size_t e = 0; e < fan.elevations(); ++e)
        if (!fan.grid->within_beam(plane, e)) hits[e] = Hit{};
  }

  void finish_rays(const ScanArgs& pass, const RayFan& fan, std::size_t plane, std::int64_t from,
                   std::int64_t until, std::span<Hit> hits, Scratch& scratch) const {
    std::uint32_t* doubtful = scratch.doubtful.data();
    const auto finish = [&](std::int64_t begin, std::int64_t end, Hit* to) {
      const std::int64_t doubts =
          engine::finish_rays(pass, static_cast<std::int64_t>(plane), begin, end, to, doubtful);
      for (std::int64_t i = 0; i < doubts; ++i) {
        Hit& hit = to[doubtful[i] - begin];
        hit = place_on_face(triangles_, hit.index, fan.ray(plane, doubtful[i]));
      }
    };
    // Whole registers are written, so the last rays of all go through a place of their own.
    constexpr std::int64_t room = widest_vector;
    const std::int64_t direct =
        std::clamp(static_cast<std::int64_t>(hits.size()) - room, from, until);
    finish(from, direct, hits.data() + from);
    std::array<Hit, 2 * widest_vector> last;
    finish(direct, until, last.data());
    std::copy_n(last.begin(), until - direct, hits.begin() + direct);
  }

  ScanArgs pass_over(const RayFan& fan, const FanTables& tables) const {
    ScanArgs pass{};
    pass.frame = frame_of(fan);
    pass.range_m = fan.range_m;
    pass.planes = static_cast<std::int64_t>(fan.planes());
    pass.elevations = static_cast<std::int64_t>(fan.elevations());
    pass.sin_azimuth = tables.sin_azimuth.data();
    pass.cos_azimuth = tables.cos_azimuth.data();
    pass.tan_azimuth = tables.tan_azimuth.data();
    pass.left_out_from = tables.left_out_from.data();
    pass.left_out_until = tables.left_out_until.data();
    pass.sin_elevation = fan.grid->sin_elevation.data();
    pass.cos_elevation = fan.grid->cos_elevation.data();
    pass.sin_elevation_rounded = tables.sin_elevation.data();
    pass.cos_elevation_rounded = tables.cos_elevation.data();
    pass.ascending = tables.ascending.data();
    pass.lines = tables.lines.data();
    pass.first_q = tables.first;
    pass.steps_per_q = tables.steps_per_q;
    pass.steps = static_cast<double>(FanTables::steps);
    pass.block_rows = blocks_.rows_of.data();
    pass.boxes = blocks_.boxes.data();
    pass.blocks = static_cast<std::int64_t>(blocks_.count);
    pass.boxes_in_row = static_cast<std::int64_t>(blocks_.boxes_in_row());
    pass.numbers = triangles_.numbers.empty() ? nullptr : triangles_.numbers.data();
    return pass;
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
