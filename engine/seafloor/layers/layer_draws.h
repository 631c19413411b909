#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/base/work_control.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::engine {

class RoughnessInWindows;

/// What the random numbers of a layer are for: the `what` of LayerDraws::of(). Each kind of relief
/// has a separate Purpose, so different kinds may use equal numbers.
namespace layer_stream {
enum OfRoughness : std::uint64_t { roughness = 1 };
enum OfBedforms : std::uint64_t { bends = 1, crest_heights, forks, phase_shifts, near_heights };
enum OfTrawlMarks : std::uint64_t { tows = 1, port_doors, starboard_doors, sweeps };
enum OfPits : std::uint64_t { pits = 1 };
enum OfBoulders : std::uint64_t { boulders = 1, boulder_density, broken_faces };
enum OfOutcrops : std::uint64_t { rock = 1, strike, main_joints, cross_joints, blocks, fallen };
enum OfArea : std::uint64_t { patches = 100, border_shift_east, border_shift_north };
constexpr std::uint64_t finer =
    10;  ///< added to a number of OfArea for the finer waves of the field
enum OfBorder : std::uint64_t { mixed_border = 200 };
}  // namespace layer_stream

/// The random numbers of one layer of the seabed. They depend only on the seed, the layer's purpose
/// and number, what they are for, and the lattice cell of a place. So layers do not change each
/// other, and the extent of the bed changes nothing at a place.
struct LayerDraws {
  std::uint64_t seed = 0;
  Purpose purpose = Purpose::test;
  std::uint64_t number = 0;
  RoughnessInWindows* roughness = nullptr;  ///< for a bed that is made in windows; otherwise null
  WorkControl control = {};                 ///< as in lay_seabed()

  RandomStream of(std::uint64_t what, std::int64_t column = 0, std::int64_t row = 0) const {
    return RandomStream(seed, purpose,
                        {number, what,
                         (static_cast<std::uint64_t>(column) << 32) ^
                             (static_cast<std::uint64_t>(row) & 0xffffffffu)});
  }
};

/// A log-normal diameter of at most largest_of_median times the median, from two uniform numbers.
inline double random_diameter_m(double median_m, double spread, double largest_of_median, double u,
                                double v) {
  const double normal = std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * std::numbers::pi * v);
  return median_m * std::min(largest_of_median, std::exp(spread * normal));
}

/// A second uniform number, from the low bits of the first.
inline double lower_bits(double random) { return 1024.0 * random - std::floor(1024.0 * random); }

/// Number of random numbers of each scattered feature.
inline constexpr std::size_t feature_draws = 10;

/// Calls f(x_m, y_m, draws) for the points of a Poisson process with this density, in a fixed
/// order, over a grid and `margin_m` beyond its border. The numbers `draws` are uniform in (0, 1]
/// and depend on the place of the point, not on the grid.
template <class F>
void for_each_scattered(const Heightfield& grid, double per_m2, double margin_m,
                        const LayerDraws& draws, std::uint64_t what, F&& f) {
  if (!(per_m2 > 0.0)) return;
  const double side_m = 1.0 / std::sqrt(per_m2);  // one point per lattice cell on average
  const auto cell_at = [&](double place_m) {
    return static_cast<std::int64_t>(std::floor(place_m / side_m));
  };
  const std::int64_t east = cell_at(grid.x_m(grid.columns - 1) + margin_m),
                     north = cell_at(grid.y_m(grid.rows - 1) + margin_m);
  for (std::int64_t row = cell_at(grid.y_m(0) - margin_m); row <= north; ++row)
    for (std::int64_t column = cell_at(grid.x_m(0) - margin_m); column <= east; ++column) {
      const RandomStream cell = draws.of(what, column, row);
      std::array<double, 1> count;
      cell.uniform(count);
      const std::size_t points = poisson_count(1.0, count[0], 16);
      for (std::uint64_t point = 0; point < points; ++point) {
        std::array<double, feature_draws> u;
        cell.uniform(u, 4 + feature_draws * point);
        draws.control.check_stop();
        f((static_cast<double>(column) + u[0]) * side_m, (static_cast<double>(row) + u[1]) * side_m,
          u);
      }
    }
}

}  // namespace ensonify::engine
