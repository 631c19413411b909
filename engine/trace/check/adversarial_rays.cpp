#include <ensonify/engine/trace/check/adversarial_rays.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>

#include <Eigen/Geometry>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/trace/nearest_floats.h>

namespace ensonify::engine {

using Eigen::Vector3d;

namespace {

constexpr int looks = 5;  // rays; the corners of the faces they hit give planes and elevations
constexpr int looks_per_plane = 5;  // rays; the crossed edges of the faces they hit give elevations
constexpr double widest_rad = 0.6;  // half a fan's width

/// The longest edge divided by the smallest height.
double thinness(refine::Triangles triangles, std::uint32_t face) {
  const Vector3d a = triangles.corner(face, 0), b = triangles.corner(face, 1),
                 c = triangles.corner(face, 2);
  const double longest =
      std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  return longest / std::max((b - a).cross(c - a).norm(), 1e-30);
}

/// A fan's tables, collected from directions in its frame (along the array, middle, pole).
class Tables {
 public:
  void add_plane(const Vector3d& d) {
    const double across = std::hypot(d.x(), d.y());
    if (across > 0.0 && d.y() > 0.0) planes_.push_back({d.x() / across, d.y() / across, 1e-3});
  }
  void add_elevation(const Vector3d& d) {
    const double across = std::hypot(d.x(), d.y()), length = d.norm();
    if (across > 0.0) elevations_.push_back({d.z() / length, across / length});
  }

  std::shared_ptr<const FanGrid> grid(double middle_depression_rad) {
    const auto tidy = [](auto& rows, auto sine) {
      std::ranges::sort(rows, {}, sine);
      // Not std::ranges::unique: clang 14 cannot compile it with libstdc++ 12.
      const auto same = [&](const auto& a, const auto& b) { return a.*sine == b.*sine; };
      rows.erase(std::unique(rows.begin(), rows.end(), same), rows.end());
    };
    tidy(planes_, &FanGrid::Plane::sin_azimuth);
    tidy(elevations_, &Elevation::sine);
    FanGrid grid(FanLayout{.sector_high_rad = 1.0, .truncation_rad = 1.0, .main_lobe_rad = 1.0});
    grid.middle_depression_rad = middle_depression_rad;
    // Every ray is just within the beam: face sources may leave out everything beyond it.
    double sine = 0.0, level = 0.0;
    for (const FanGrid::Plane& plane : planes_) sine = std::max(sine, std::abs(plane.sin_azimuth));
    for (const Elevation& e : elevations_) level = std::max(level, e.cosine);
    grid.sin_truncation = level * sine;
    grid.planes = planes_;
    grid.elevation_rad.clear(), grid.sin_elevation.clear(), grid.cos_elevation.clear();
    for (const Elevation& e : elevations_) {
      grid.elevation_rad.push_back(std::atan2(e.sine, e.cosine));
      grid.sin_elevation.push_back(e.sine);
      grid.cos_elevation.push_back(e.cosine);
    }
    return std::make_shared<const FanGrid>(std::move(grid));
  }

  std::span<const FanGrid::Plane> planes() const { return planes_; }
  bool has_elevations() const { return !elevations_.empty(); }

 private:
  struct Elevation {
    double sine, cosine;
  };
  std::vector<FanGrid::Plane> planes_;
  std::vector<Elevation> elevations_;
};

}  // namespace

/// Uniform numbers in (0, 1], in sequence.
class AdversarialRays::Dice {
 public:
  Dice(std::uint64_t seed, std::uint64_t what, std::uint64_t number)
      : stream_(seed, Purpose::agreement, {what, number, 0}) {}

  double roll() {
    if (used_ == drawn_.size()) {
      stream_.uniform(drawn_, next_);
      next_ += drawn_.size();
      used_ = 0;
    }
    return drawn_[used_++];
  }
  double roll(double from, double to) { return from + (to - from) * roll(); }
  /// One of [0, count).
  std::uint32_t pick(std::size_t count) {
    const auto n = static_cast<std::uint32_t>(roll() * static_cast<double>(count));
    return std::min(n, static_cast<std::uint32_t>(count - 1));
  }
  int sign() { return roll() < 0.5 ? -1 : 1; }
  double power_of_ten(double from, double to) { return std::pow(10.0, roll(from, to)); }
  /// Uniform over the sphere.
  Vector3d direction() {
    const double z = roll(-1.0, 1.0), turn = roll(0.0, 2.0 * std::numbers::pi);
    const double across = std::sqrt(std::max(0.0, 1.0 - z * z));
    return {across * std::cos(turn), across * std::sin(turn), z};
  }
  Vector3d upwards() {
    Vector3d d = direction();
    d.z() = std::abs(d.z());
    return d;
  }

 private:
  RandomStream stream_;
  std::array<double, 32> drawn_;
  std::size_t used_ = drawn_.size();
  std::uint64_t next_ = 0;
};

AdversarialRays::AdversarialRays(refine::Triangles triangles, std::uint64_t seed)
    : triangles_(triangles), seed_(seed) {
  if (triangles.faces.empty())
    throw std::invalid_argument("AdversarialRays: the mesh has no face to aim at");
  box_ = refine::bounds(triangles);
  size_m_ = std::max((box_.highest - box_.lowest).cast<double>().norm(), 1e-6);

  std::vector<float> by_face(triangles.faces.size());
  for (std::uint32_t face = 0; face < by_face.size(); ++face)
    by_face[face] = static_cast<float>(thinness(triangles, face));
  thin_.resize(by_face.size());
  std::iota(thin_.begin(), thin_.end(), 0u);
  const std::size_t hundredth = (thin_.size() + 99) / 100;
  std::ranges::nth_element(thin_, thin_.begin() + static_cast<std::ptrdiff_t>(hundredth - 1),
                           [&](std::uint32_t a, std::uint32_t b) {
                             return by_face[a] != by_face[b] ? by_face[a] > by_face[b] : a < b;
                           });
  thin_.resize(hundredth);
  thin_.shrink_to_fit();
}

void AdversarialRays::aim(std::uint64_t list, std::span<Ray> rays) const {
  Dice dice(seed_, 0, list);
  for (Ray& ray : rays) ray = draw_ray(dice);
}

void AdversarialRays::aim_down(std::uint64_t list, std::span<Ray> rays) const {
  Dice dice(seed_, 4, list);
  const Vector3d low = box_.lowest.cast<double>(), high = box_.highest.cast<double>();
  for (Ray& ray : rays) {
    Vector3d place;
    if (dice.roll() < 0.2)  // anywhere, including slightly outside
      for (const int axis : {0, 1})
        place[axis] = low[axis] + dice.roll(-0.02, 1.02) * (high[axis] - low[axis]);
    else
      place = draw_target(dice, draw_face(dice), static_cast<int>(dice.pick(3)));
    place.z() = high.z() + 1.0;
    ray = {place, -Vector3d::UnitZ()};
  }
}

std::uint32_t AdversarialRays::draw_face(Dice& dice) const {
  return dice.roll() < 0.3 ? thin_[dice.pick(thin_.size())] : dice.pick(triangles_.faces.size());
}

Vector3d AdversarialRays::draw_target(Dice& dice, std::uint32_t face, int corner) const {
  Vector3d a = triangles_.corner(face, corner);
  const Vector3d b = triangles_.corner(face, (corner + 1) % 3),
                 c = triangles_.corner(face, (corner + 2) % 3);
  switch (dice.pick(4)) {
    case 0: return a;
    case 1: return 0.5 * (a + b);
    case 2: return a + dice.roll() * (b - a);
    default: return a + dice.roll() * (b + dice.roll() * (c - b) - a);
  }
}

Ray AdversarialRays::draw_ray(Dice& dice) const {
  const std::uint32_t face = draw_face(dice);
  const auto corner = static_cast<int>(dice.pick(3));
  const Vector3d a = triangles_.corner(face, corner), b = triangles_.corner(face, (corner + 1) % 3),
                 c = triangles_.corner(face, (corner + 2) % 3);
  Vector3d target = draw_target(dice, face, corner);
  const double far_m = size_m_ * dice.power_of_ten(-3.0, 0.3);
  const Vector3d normal = (b - a).cross(c - a).normalized();  // zero for a face without area

  Vector3d origin = target;
  switch (dice.pick(8)) {
    case 0:
    case 1: origin = nearest_floats(target + far_m * dice.upwards()); break;
    case 2: origin = nearest_floats(target - far_m * dice.upwards()); break;
    case 3: {  // along a line of the grid, in the vertical plane through the target
      const int axis = static_cast<int>(dice.pick(2));
      const double keep = target[axis];
      origin = nearest_floats(target + far_m * dice.upwards());
      origin[axis] = keep;
      break;
    }
    case 4: {  // nearly in the face's plane
      const Vector3d along = (a + dice.roll() * (b - a) - c).normalized() * dice.sign();
      const double rise = dice.power_of_ten(-7.0, -0.5) * dice.sign();
      origin = nearest_floats(target + far_m * (along + rise * normal));
      break;
    }
    case 5:  // along an edge
      target = b;
      origin = a - std::exp2(std::floor(dice.roll(0.0, 8.0))) * (b - a);
      break;
    case 6: origin = nearest_floats(target + dice.power_of_ten(3.0, 6.0) * dice.upwards()); break;
    default: target = origin + dice.direction(); break;  // off the surface
  }
  if (target == origin) target = origin - Vector3d::UnitZ();

  // A power of two keeps the aim exact; the target is at t = 1 / scale.
  const double scale = dice.roll() < 0.5 ? 1.0 : std::exp2(std::floor(dice.roll(-10.0, 10.0)));
  Ray ray{origin, scale * (target - origin)};
  switch (dice.pick(12)) {
    case 0: ray.t_max = 1.0 / scale; break;
    case 1: ray.t_min = 1.0 / scale; break;
    case 2: ray.t_max = dice.roll(0.5, 1.5) / scale; break;
    default: break;
  }
  return ray;
}

/// A fan without its grid, aimed at a target. Half of them have axes along the mesh's grid: the
/// plane at azimuth 0 is then exactly an x or y plane.
RayFan AdversarialRays::draw_frame(Dice& dice) const {
  const std::uint32_t face = draw_face(dice);
  const Vector3d target = triangles_.corner(face, static_cast<int>(dice.pick(3)));
  RayFan fan;
  if (dice.roll() < 0.5) {
    const auto axis = static_cast<int>(dice.pick(2));
    fan.array_axis = dice.sign() * Vector3d::Unit(axis);
    fan.middle = dice.sign() * Vector3d::Unit(1 - axis);
    fan.pole = Vector3d::UnitZ();
    if (dice.roll() < 0.7) {  // looks 45 degrees down
      const Vector3d level = fan.middle;
      fan.middle = std::numbers::sqrt2 / 2.0 * (level - Vector3d::UnitZ());
      fan.pole = std::numbers::sqrt2 / 2.0 * (level + Vector3d::UnitZ());
    }
  } else {
    // Fans need unit axes; three rotations leave the quaternion's length off by some roundings.
    const Eigen::Matrix3d turn = (Eigen::AngleAxisd(dice.roll(-3.0, 3.0), Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(dice.roll(-1.5, 0.3), Vector3d::UnitX()) *
                                  Eigen::AngleAxisd(dice.roll(-0.3, 0.3), Vector3d::UnitY()))
                                     .normalized()
                                     .toRotationMatrix();
    fan.array_axis = turn.col(0);
    fan.middle = turn.col(1);
    fan.pole = turn.col(2);
  }
  const double far_m = size_m_ * dice.power_of_ten(-2.0, -0.5);
  const Vector3d ahead = fan.middle + dice.roll(-0.4, 0.4) * fan.pole;
  fan.origin = nearest_floats(target - far_m * ahead);
  for (const int axis : {0, 1})  // puts the plane through the target, exactly
    if (std::abs(fan.array_axis[axis]) == 1.0) fan.origin[axis] = target[axis];
  fan.range_m = dice.roll() < 0.3 ? (target - fan.origin).norm() : size_m_;
  return fan;
}

RayFan AdversarialRays::aim(std::uint64_t number, const Intersector& reference) const {
  Dice dice(seed_, 1, number);
  RayFan fan = draw_frame(dice);
  Eigen::Matrix3d to_frame;
  to_frame << fan.array_axis.transpose(), fan.middle.transpose(), fan.pole.transpose();
  const auto seen = [&](std::uint32_t face, int corner) -> Vector3d {
    return to_frame * (triangles_.corner(face, corner) - fan.origin);
  };
  const auto look = [&](double azimuth, double elevation) {
    const Vector3d d(std::cos(elevation) * std::sin(azimuth),
                     std::cos(elevation) * std::cos(azimuth), std::sin(elevation));
    const Ray ray{fan.origin, to_frame.transpose() * d};
    Hit hit;
    reference.intersect({&ray, 1}, {&hit, 1});
    return hit;
  };

  // Mostly as narrow as beams: faces left out by mistake are at the beam's edges.
  const double narrow_rad = widest_rad * dice.power_of_ten(-3.5, 0.0);
  Tables tables;
  tables.add_plane(Vector3d::UnitY());
  for (int i = 0; i < looks; ++i) {
    const double azimuth = dice.roll(-narrow_rad, narrow_rad);
    const Hit hit = look(azimuth, dice.roll(-widest_rad, widest_rad));
    for (int k = 0; hit && k < 3; ++k) {
      tables.add_plane(seen(hit.face, k));
      tables.add_elevation(seen(hit.face, k));
    }
  }
  for (const FanGrid::Plane& plane : tables.planes())
    for (int i = 0; i < looks_per_plane; ++i) {
      const Hit hit = look(std::atan2(plane.sin_azimuth, plane.cos_azimuth),
                           dice.roll(-widest_rad, widest_rad));
      for (int k = 0; hit && k < 3; ++k) {
        // Where the plane crosses the edge, or a corner that lies in the plane.
        const Vector3d p = seen(hit.face, k), q = seen(hit.face, (k + 1) % 3);
        const double p_off = plane.cos_azimuth * p.x() - plane.sin_azimuth * p.y();
        const double q_off = plane.cos_azimuth * q.x() - plane.sin_azimuth * q.y();
        if ((p_off <= 0.0) != (q_off <= 0.0))
          tables.add_elevation(p + p_off / (p_off - q_off) * (q - p));
      }
    }
  if (dice.roll() < 0.5 ||
      !tables.has_elevations())  // otherwise the outermost rays hit something too
    for (const double e : {-widest_rad, widest_rad})
      tables.add_elevation({0.0, std::cos(e), std::sin(e)});
  fan.grid = tables.grid(std::asin(std::clamp(-fan.middle.z(), -1.0, 1.0)));
  return fan;
}

}  // namespace ensonify::engine
