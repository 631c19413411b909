#include <ensonify/engine/trace/fan_scan.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <stdexcept>

#include <Eigen/Geometry>

#include <ensonify/engine/trace/cache_lines.h>
#include <ensonify/engine/trace/face_blocks.h>
#include <ensonify/engine/trace/fan_kernel.h>
#include <ensonify/engine/trace/fan_tables.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector3d;

constexpr std::size_t widest_vector = 64;  // floats

/// What one query needs; it grows to what the largest fan took, and stays there.
struct Scratch {
  FanTables tables;
  FanBatch batch;
  CacheLines<std::int64_t> crossings;
  CacheLines<std::uint32_t> met_blocks, nearest, doubtful;
  CacheLines<float> nearness;
  CacheLines<double> forms;
};

template <class Vector>
auto* at_least(Vector& vector, std::size_t size) {
  if (vector.size() < size) vector.resize(size);
  return vector.data();
}

/// Where a ray meets a face whose interval it is in, though rounding may spoil the quotient t: the ray
/// sees the face on edge, or begins on it.
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
    const Borrowed scratch(*this);
    if (hits.empty()) return;
    if (scratch->tables.grid() != fan.grid.get()) scratch->tables.take(fan.grid);
    scan(fan, hits, *scratch);
  }

  void intersect(std::span<const Ray>, std::span<Hit>) const override {
    throw std::invalid_argument(
        "fan_scan takes fans only, no list of rays; take embree or pluecker for those");
  }

 private:
  /// Some scratch of the pool, given back at the end.
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

  void scan(const RayFan& fan, std::span<Hit> hits, Scratch& scratch) const {
    const FanTables& tables = scratch.tables;
    FanPass pass = pass_over(fan, tables);
    pass.met_blocks = at_least(scratch.met_blocks, blocks_.boxes_in_row() + widest_vector);
    find_blocks(pass);

    const std::size_t planes = fan.planes(), elevations = fan.elevations();
    const std::size_t stride = (elevations / widest_vector + 2) * widest_vector;
    pass.stride = static_cast<std::int64_t>(stride);
    pass.slots = pass.met * static_cast<std::int64_t>(FaceBlocks::faces);
    pass.forms = at_least(scratch.forms, 12 * static_cast<std::size_t>(pass.slots));
    pass.nearness = at_least(scratch.nearness, planes * stride);
    pass.nearest = at_least(scratch.nearest, planes * stride);
    scratch.batch.crossings = at_least(scratch.crossings, planes * batch_faces + widest_vector);
    std::fill_n(pass.nearness, planes * stride, 0.0f);
    scan_faces(pass, scratch.batch);

    std::uint32_t* doubtful = at_least(scratch.doubtful, elevations);
    for (std::size_t plane = 0; plane < planes; ++plane) {
      const std::span<Hit> row = hits.subspan(plane * elevations, elevations);
      const std::int64_t doubts =
          finish_plane(pass, static_cast<std::int64_t>(plane), row.data(), doubtful);
      for (std::int64_t i = 0; i < doubts; ++i) {
        Hit& hit = row[doubtful[i]];
        hit = place_on_face(triangles_, hit.index, fan.ray(plane, doubtful[i]));
      }
      leave_out(tables.planes[plane], fan, plane, row);
    }
  }

  /// Rays outside the beam are misses.
  static void leave_out(const FanTables::Plane& table, const RayFan& fan, std::size_t plane,
                        std::span<Hit> row) {
    if (table.even)
      std::fill(row.begin() + table.left_out_from, row.begin() + table.left_out_until, Hit{});
    else
      for (std::size_t e = 0; e < row.size(); ++e)
        if (!fan.grid->within_beam(plane, e)) row[e] = Hit{};
  }

  FanPass pass_over(const RayFan& fan, const FanTables& tables) const {
    FanPass pass{};
    for (Eigen::Index i = 0; i < 3; ++i) {
      const auto k = static_cast<std::size_t>(i);
      pass.origin[k] = fan.origin[i];
      pass.axes[k] = fan.array_axis[i];
      pass.axes[3 + k] = fan.middle[i];
      pass.axes[6 + k] = fan.pole[i];
    }
    pass.range_m = fan.range_m;
    pass.planes = static_cast<std::int64_t>(fan.planes());
    pass.elevations = static_cast<std::int64_t>(fan.elevations());
    pass.sin_azimuth = tables.sin_azimuth.data();
    pass.cos_azimuth = tables.cos_azimuth.data();
    pass.sin_elevation = fan.grid->sin_elevation.data();
    pass.cos_elevation = fan.grid->cos_elevation.data();
    pass.sin_elevation_rounded = tables.sin_elevation.data();
    pass.cos_elevation_rounded = tables.cos_elevation.data();
    pass.ascending = tables.ascending.data();
    pass.below = tables.below.data();
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
