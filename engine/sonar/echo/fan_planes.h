#pragma once

#include <complex>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/sonar/echo/echo.h>
#include <ensonify/engine/sonar/echo/steered_kernel.h>
#include <ensonify/engine/trace/ray_fan.h>

namespace ensonify::engine {

/// What the planes of one fan receive of one ping through one element of a receiver: the input of
/// beams that are steered along the array. Tables have one row for each plane, and in it one value
/// for each range bin. There are more bins than the sonar has, because a pulse from beyond the last
/// bin reaches into it, and the bins make whole blocks.
struct FanPlanes {
  const RayFan* fan = nullptr;  ///< the fan of the planes; it must live until the next ping
  std::size_t planes = 0, bins = 0;
  /// The truth of each plane, in the sonar's bins. intensity_mean: as `energy`.
  std::vector<EchoLine> lines;
  std::vector<float> energy;    ///< expected, with gain and absorption, without the pulse; uPa^2
  std::vector<float> labelled;  ///< the part of `energy` that has the bin's label
  std::vector<float> sine;      ///< of the angle from the array's broadside at which it arrives
  std::vector<float> lit;       ///< weight of the plane where it sees the bin
  std::vector<float> shadowed;  ///< weight of the plane where the bin lies in shadow
  /// A number of each bin's label (instance, class and sediment). Labels whose class or sediment is
  /// above 255 may share a number; then `fraction` counts them as one.
  std::vector<std::uint32_t> label;
  /// Of each steered beam: its energy, as `energy`, summed over the planes; by beam and bin.
  std::vector<float> received;
  std::uint64_t rays = 0, hits = 0;

  /// A steady echo of an object.
  struct Glint {
    double range_m;
    double sine;
    std::complex<double> field;
    Eigen::Vector3d place;  ///< local metres
    Label label;
  };
  std::vector<Glint> glints;

  /// Keeps the memory.
  void make_room(std::size_t plane_count, std::size_t bin_count, std::size_t sonar_bins) {
    planes = plane_count, bins = whole_blocks(bin_count);
    for (auto* table : {&energy, &labelled, &sine, &lit, &shadowed})
      if (table->size() < planes * bins) table->resize(planes * bins);
    if (label.size() < planes * bins) label.resize(planes * bins);
    if (lines.size() < planes) lines.resize(planes);
    for (std::size_t i = 0; i < planes; ++i)
      if (lines[i].bins.intensity_mean.size() != sonar_bins) lines[i].bins.assign(sonar_bins);
  }
  float* energy_of(std::size_t plane) { return &energy[plane * bins]; }
  const float* energy_of(std::size_t plane) const { return &energy[plane * bins]; }
  float* labelled_of(std::size_t plane) { return &labelled[plane * bins]; }
  float* sine_of(std::size_t plane) { return &sine[plane * bins]; }
  const float* sine_of(std::size_t plane) const { return &sine[plane * bins]; }
  std::uint32_t* label_of(std::size_t plane) { return &label[plane * bins]; }
  float* lit_of(std::size_t plane) { return &lit[plane * bins]; }
  float* shadowed_of(std::size_t plane) { return &shadowed[plane * bins]; }
};

}  // namespace ensonify::engine
