#include <ensonify/engine/mosaic/placed_side.h>

#include <algorithm>
#include <cmath>

#include <ensonify/engine/sonar/echo/echo.h>

namespace ensonify::engine {
namespace {

constexpr float farthest_m = 1e7f;   // from the origin; farther places are from a damaged file
constexpr double close_share = 0.3;  // of the height: distances from the track that are close

bool is(float region, Region kind) { return region == static_cast<float>(kind); }

bool has_place(const GroundLayers& layers, std::size_t bin) {
  return (is(layers.region[bin], Region::seabed) || is(layers.region[bin], Region::object)) &&
         std::abs(layers.x_m[bin]) < farthest_m && std::abs(layers.y_m[bin]) < farthest_m;
}

/// The horizontal unit vector abeam of the sonar, away from the array.
Eigen::Vector2d outwards(const MosaicPing& ping, const Sector& sector) {
  return sector.out * Eigen::Vector2d(std::cos(ping.heading_rad), -std::sin(ping.heading_rad));
}

/// Places from the true places of echoes. Entry k is the place at the slant range k * bin_m() / 2.
std::vector<Eigen::Vector2d> true_places(const MosaicPing& ping, const Sonar& sonar,
                                         const Sector& sector, const GroundLayers& layers) {
  const std::size_t bins = layers.region.size();
  std::size_t first = 0, last = bins - 1;
  while (first < bins && !has_place(layers, first)) ++first;
  if (first == bins) return {};
  while (!has_place(layers, last)) --last;

  std::vector<Eigen::Vector2d> places(2 * bins + 1);
  const auto centre = [](std::size_t bin) { return 2 * bin + 1; };
  for (std::size_t bin = first, before = first; bin <= last; ++bin) {
    if (!has_place(layers, bin)) continue;
    places[centre(bin)] = {layers.x_m[bin], layers.y_m[bin]};
    for (std::size_t gap = before + 1; gap < bin; ++gap)
      places[centre(gap)] = places[centre(before)] +
                            static_cast<double>(gap - before) / static_cast<double>(bin - before) *
                                (places[centre(bin)] - places[centre(before)]);
    before = bin;
  }
  for (std::size_t bin = first + 1; bin <= last; ++bin)
    places[2 * bin] = 0.5 * (places[centre(bin - 1)] + places[centre(bin)]);

  // Bins before the first echo and behind the last one are placed as over a level bed. But if the
  // first echo is close to the track, its bin begins at the track, because on a slope the echo from
  // straight below comes later.
  const Eigen::Vector2d out = outwards(ping, sector);
  const auto range_m = [&](std::size_t entry) {
    return ground_range_m(0.5 * static_cast<double>(entry) * sonar.bin_m(), ping.height_m);
  };
  const double abeam_m = std::max(0.0, out.dot(places[centre(first)] - ping.place_m));
  const bool close = abeam_m <= close_share * ping.height_m;
  for (std::size_t entry = 0; entry < centre(first); ++entry) {
    const double level_m = std::min(range_m(centre(first)) - range_m(entry), abeam_m);
    places[entry] = places[centre(first)] - (close ? abeam_m : level_m) * out;
  }
  for (std::size_t entry = centre(last) + 1; entry < places.size(); ++entry)
    places[entry] = places[centre(last)] + (range_m(entry) - range_m(centre(last))) * out;
  return places;
}

}  // namespace

double ground_range_m(double slant_m, double height_m) {
  return std::sqrt(std::max(slant_m * slant_m - height_m * height_m, 0.0));
}

PlacedSide place(const MosaicPing& ping, const Sonar& sonar, const Sector& sector,
                 Positions positions, const GroundLayers& layers) {
  const std::size_t bins = layers.region.size();
  PlacedSide placed;
  placed.shown.resize(bins);
  const bool truth = positions == Positions::truth;
  bool any = false;
  for (std::size_t bin = 0; bin < bins; ++bin) {
    const float region = layers.region[bin];
    const bool on_ground =
        truth
            ? is(region, Region::seabed) || is(region, Region::object) || is(region, Region::shadow)
            : ground_range_m(static_cast<double>(bin + 1) * sonar.bin_m(), ping.height_m) > 0.0;
    placed.shown[bin] = on_ground && !is(region, Region::no_data);
    any = any || placed.shown[bin];
  }
  if (!any) return {};
  if (truth) {
    placed.places_m = true_places(ping, sonar, sector, layers);
  } else {
    const Eigen::Vector2d out = outwards(ping, sector);
    for (std::size_t entry = 0; entry <= 2 * bins; ++entry)
      placed.places_m.emplace_back(
          ping.place_m +
          ground_range_m(0.5 * static_cast<double>(entry) * sonar.bin_m(), ping.height_m) * out);
  }
  return placed;
}

}  // namespace ensonify::engine
