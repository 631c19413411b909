#include <ensonify/engine/seafloor/layers/pits.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <ensonify/engine/base/made_once.h>
#include <ensonify/engine/seafloor/bed/points_near.h>

namespace ensonify::engine {
namespace {

using std::numbers::pi;
constexpr double largest_pit_of_median = 3.5;
constexpr std::array outline_waves = {0.10, 0.07, 0.05};  // mean amplitudes / radius
constexpr double least_ragged = 0.5, most_ragged = 1.5;   // factors on the amplitudes
constexpr double rim_end = 1.4;                           // where the rim ends / radius
constexpr double most_bent = 0.5;                         // bend of a scour's axis / half width

/// From 0 for round pits to 1 for scours that are at least twice as long as wide. A current bends
/// scours and makes one of their sides steeper.
double scoured(const PitRelief& relief) { return std::min(1.0, relief.elongation - 1.0); }

/// The greatest distance of the rim from the middle, divided by diameter and stretch.
double reach(const PitRelief& relief) {
  const double outline = outline_waves[0] + outline_waves[1] + outline_waves[2];
  return 0.5 * (rim_end * (1.0 + most_ragged * outline) + scoured(relief) * most_bent);
}

}  // namespace

double reach_m(const PitRelief& relief) {
  return reach(relief) * std::sqrt(relief.elongation) * largest_pit_of_median * relief.diameter_m;
}

void add_pits(Heightfield& field, const PitRelief& relief, const LayerDraws& draws,
              const Allowed& allowed, std::span<std::uint32_t> marked) {
  check_relief(relief);
  check_cover("pits", relief.per_hectare, relief.diameter_m);
  std::vector<double> floor_m(field.z_m.size(), 0.0), rim_m(field.z_m.size(), 0.0);
  const double stretch = std::sqrt(relief.elongation), by_current = scoured(relief);
  std::uint32_t number = 0;
  const auto dig = [&](double x, double y, const auto& u) {
    if (!allowed(x, y)) return;
    ++number;
    const double diameter_m = random_diameter_m(relief.diameter_m, relief.diameter_spread,
                                                largest_pit_of_median, u[2], u[3]);
    const double depth_m =
        relief.depth_ratio * diameter_m * (0.4 + 1.2 * u[4]);  // old ones are filled
    // Some walls have slumped more than others, and floors differ in width and flatness.
    const double ragged = std::lerp(least_ragged, most_ragged, lower_bits(u[6]));
    const double lean = std::lerp(1.4 * lower_bits(u[7]), 1.0, by_current);
    const double bowl_power = 1.2 + 1.6 * lower_bits(u[8]);
    // Round pits have a random axis.
    const double heading =
        relief.elongation > 1.0 ? relief.heading_rad + 0.3 * (u[5] - 0.5) : 2.0 * pi * u[5];
    const double along_x = std::sin(heading), along_y = std::cos(heading);
    for_each_point_near(
        field, x, y, reach(relief) * stretch * diameter_m,
        [&](int column, int row, double dx, double dy) {
          const double along = (dx * along_x + dy * along_y) / (0.5 * diameter_m * stretch);
          const double axis = by_current * most_bent * std::sin(2.0 * along + 2.0 * pi * u[9]);
          const double across = (dx * along_y - dy * along_x) / (0.5 * diameter_m) * stretch - axis;
          const double angle = std::atan2(across, along);
          // Slumped walls are some hundredths of the radius inside or outside a circle.
          const double waves = outline_waves[0] * std::cos(2.0 * angle + 2.0 * pi * u[6]) +
                               outline_waves[1] * std::cos(3.0 * angle + 2.0 * pi * u[7]) +
                               outline_waves[2] * std::cos(5.0 * angle + 2.0 * pi * u[8]);
          const double r = std::hypot(along, across) / (1.0 + ragged * waves);
          if (r >= rim_end) return;
          const std::size_t point = field.index(column, row);
          if (r < 1.0) {
            // The deepest place is to one side of the middle. In a scour, it is behind the middle,
            // as a current leaves it.
            const double leaning = std::max(0.3, 1.0 - 0.5 * lean * along);
            const double steeper_side = 1.0 + by_current * (lower_bits(u[9]) - 0.5) * across;
            const double its_floor_m =
                -depth_m * std::pow(1.0 - r * r, bowl_power) * leaning * steeper_side;
            if (its_floor_m < floor_m[point] || marked[point] == 0) marked[point] = number;
            floor_m[point] = std::min(floor_m[point], its_floor_m);
          }
          const double from_rim = (r - 1.05) / 0.16;
          const double uneven = 1.0 + 0.5 * std::cos(angle + 2.0 * pi * u[7]);
          rim_m[point] = std::max(
              rim_m[point], depth_m * relief.rim_ratio * uneven * std::exp(-from_rim * from_rim));
        });
  };
  for_each_scattered(field, 1e-4 * relief.per_hectare, reach_m(relief), draws, layer_stream::pits,
                     dig);
  for (std::size_t i = 0; i < floor_m.size(); ++i) field.z_m[i] += floor_m[i] + rim_m[i];
}

namespace {
ReliefKind<PitRelief> pit_kind() {
  return {
      .list = "pits",
      .help = "A layer of scattered hollows: pockmarks, scours.",
      .purpose = Purpose::pit_layer,
      .class_name = "pockmark",
      .add = &add_pits,
      .size_m = &PitRelief::diameter_m,
      .values = {
          {"per_hectare", "", 0, 1e5, "How many in 100 x 100 m, on average.",
           &PitRelief::per_hectare},
          {"diameter_m", "m", 0.001, 10e3, "Median diameter.", &PitRelief::diameter_m},
          {"diameter_spread", "", 0, 2,
           "Standard deviation of its logarithm; none is larger than 3.5 medians.",
           &PitRelief::diameter_spread},
          {"depth_ratio", "", 0, 1, "Depth over diameter; about 0.09 for pockmarks.",
           &PitRelief::depth_ratio},
          {"rim_ratio", "", 0, 1, "Height of the rim over the depth.", &PitRelief::rim_ratio},
          {"elongation", "", 1, 20, "Length over width; scours are long.", &PitRelief::elongation},
          {"heading_deg", "degrees", -360, 360,
           "Heading of the long axis, from the steep end to the shallow one.",
           &PitRelief::heading_rad},
      }};
}
}  // namespace
const ReliefKind<PitRelief>& kind_of(const PitRelief&) { return made_once<pit_kind>(); }

}  // namespace ensonify::engine
