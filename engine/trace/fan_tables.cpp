#include <ensonify/engine/trace/fan_tables.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <ensonify/engine/trace/fan_kernel.h>

namespace ensonify::engine {
namespace {

constexpr double rounding = 1e-12;  // two elevations so close may be in either order

}  // namespace

void FanTables::take(std::shared_ptr<const FanGrid> grid) {
  grid_.reset();
  const std::size_t elevations = grid->elevation_rad.size();
  ascending.assign(elevations + 2, -2.0);
  sin_elevation.assign(elevations + widest_vector, 0.0f);
  cos_elevation.assign(elevations + widest_vector, 0.0f);
  for (std::size_t j = 0; j < elevations; ++j) {
    const double sine = grid->sin_elevation[j], cosine = grid->cos_elevation[j];
    const double q = sine / (cosine + std::abs(sine));
    if (!(cosine >= 0.0 && q >= ascending[j] - rounding))
      throw std::invalid_argument(
          "fan_scan takes a fan whose elevations ascend, within 90 degrees of its middle");
    ascending[j + 1] = std::max(q, ascending[j]);
    sin_elevation[j] = static_cast<float>(sine);
    cos_elevation[j] = static_cast<float>(cosine);
  }
  ascending[elevations + 1] = 2.0;

  first = ascending[1];
  const double span = ascending[elevations] - first;
  steps_per_q = span > 0.0 ? static_cast<double>(steps) / span : 0.0;
  below.resize(steps + 1);
  std::size_t j = 0;
  for (std::size_t step = 0; step <= steps; ++step) {
    const double q = first + span * static_cast<double>(step) / static_cast<double>(steps);
    while (j < elevations && ascending[j + 1] < q) ++j;
    below[step] = static_cast<double>(j);
  }

  sin_azimuth.clear(), cos_azimuth.clear();
  left_out_from.clear(), left_out_until.clear(), uneven.clear();
  for (std::size_t k = 0; k < grid->planes.size(); ++k) {
    sin_azimuth.push_back(grid->planes[k].sin_azimuth);
    cos_azimuth.push_back(grid->planes[k].cos_azimuth);
    std::int64_t from = 0, until = 0, outside = 0;
    for (std::size_t e = 0; e < elevations; ++e) {
      if (grid->within_beam(k, e)) continue;
      if (outside++ == 0) from = static_cast<std::int64_t>(e);
      until = static_cast<std::int64_t>(e) + 1;
    }
    const bool even = until - from == outside;
    left_out_from.push_back(even ? from : 0);
    left_out_until.push_back(even ? until : 0);
    uneven.push_back(!even);
  }
  grid_ = std::move(grid);
}

}  // namespace ensonify::engine
