#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include <ensonify/engine/sonar/aperture.h>
#include <ensonify/engine/sonar/beam.h>
#include <ensonify/engine/trace/ray_fan.h>

namespace ensonify::engine {

/// The two-way beam along one plane of a fan after another. What it is beside the vertical pattern at
/// transmission, squared, changes slowly, and is interpolated between the corners of a lattice: of every few
/// rays, at most a degree apart, and of ranges 1.6 to 3.1 % apart. Corners are computed when a ray comes
/// near them.
class PlaneBeam {
 public:
  /// All of these must stay while the planes are walked.
  void begin(const Beam& beam, const RayFan& fan, const Aperture& aperture,
             const Reception& reception, Side side);
  void begin_plane(std::size_t plane);

  /// Two-way power times solid angle per radian of elevation of the plane's ray at a range. Of a plane's
  /// rays those within the beam, best in ascending order.
  float weight(std::size_t elevation, double range_m) {
    if (table_) return table_[elevation];
    if (elevation < cell_.first || elevation > cell_.last) move_to(elevation);
    if (cell_.dark) return static_cast<float>(two_way(elevation, range_m));
    range_m = std::max(range_m, nearest_m);
    const auto bits = std::bit_cast<std::uint64_t>(range_m) >> step_bits;
    const std::size_t place = bits % kept;
    if (left_.row[place] != bits) fill(left_, cell_.first, bits);
    if (right_.row[place] != bits) fill(right_, cell_.last, bits);
    const double from_m = std::bit_cast<double>(bits << step_bits);
    const double until_m = std::bit_cast<double>((bits + 1) << step_bits);
    const double along = (range_m - from_m) / (until_m - from_m);
    const double across = static_cast<double>(elevation - cell_.first) * cell_.per_ray;
    const double sent = sent_[elevation];
    const double left = left_.near[place] + along * (left_.far[place] - left_.near[place]);
    const double right = right_.near[place] + along * (right_.far[place] - right_.near[place]);
    return static_cast<float>(sent * sent * (left + across * (right - left)));
  }

 private:
  static constexpr int step_bits = 52 - 5;  // 2^5 steps of range an octave
  static constexpr std::size_t kept = 4;    // steps of range
  static constexpr std::size_t most_rays = 32;
  static constexpr std::uint64_t none = 0;  // no row's: that would be at range 0
  static constexpr double nearest_m = 1e-3;
  struct Edge {  // a ray at the lattice's ranges: at the beginning and the end of a step
    std::array<std::uint64_t, kept> row = {none, none, none, none};
    std::array<double, kept> near{}, far{};
  };
  struct Cell {
    std::size_t first = 1, last = 0;  // rays
    double per_ray = 0.0;
    bool dark = false;  // by the vertical pattern: nothing to divide by
  };
  void move_to(std::size_t elevation);
  void fill(Edge& edge, std::size_t elevation, std::uint64_t row) const;
  double two_way(std::size_t elevation, double range_m) const;

  const Beam* beam_ = nullptr;
  const RayFan* fan_ = nullptr;
  const Aperture* aperture_ = nullptr;
  const Reception* reception_ = nullptr;
  Side side_ = Side::port;
  std::size_t plane_ = 0;
  const float* table_ = nullptr;  // of the plane, where range does not matter
  const float* sent_ = nullptr;   // of the plane: the vertical pattern
  Cell cell_;
  Edge left_, right_;
};

}  // namespace ensonify::engine
