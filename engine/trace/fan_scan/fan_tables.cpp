#include <ensonify/engine/trace/fan_scan/fan_tables.h>

#include <algorithm>
#include <array>
#include <bit>
#include <bitset>
#include <cmath>
#include <stdexcept>

#include <ensonify/engine/trace/beam_ranges.h>
#include <ensonify/engine/trace/intersector.h>

namespace ensonify::engine {
namespace {

constexpr double rounding = 1e-12;  // elevations this close may be in either order
constexpr std::size_t max_known = 32;

}  // namespace

void FanTables::take(std::shared_ptr<const FanGrid> grid) {
  grid_.reset();
  check_grid(*grid);
  const std::size_t elevations = grid->elevation_rad.size();
  ascending.assign(elevations + 2, -2.0);
  sin_elevation.assign(elevations + widest_vector, 0.0f);
  cos_elevation.assign(elevations + widest_vector, 0.0f);
  for (std::size_t j = 0; j < elevations; ++j) {
    const double sine = grid->sin_elevation[j], cosine = grid->cos_elevation[j];
    const double q = sine / (cosine + std::abs(sine));
    if (!(cosine >= 0.0 && q >= ascending[j] - rounding))
      throw std::invalid_argument(
          "fan_scan needs a fan whose elevations ascend and are within 90 degrees of its middle");
    ascending[j + 1] = std::max(q, ascending[j]);
    sin_elevation[j] = static_cast<float>(sine);
    cos_elevation[j] = static_cast<float>(cosine);
  }
  ascending[elevations + 1] = 2.0;

  first = ascending[1];
  const double span = ascending[elevations] - first;
  steps_per_q = span > 0.0 ? static_cast<double>(steps) / span : 0.0;
  lay_lines(span);

  sin_azimuth.clear(), cos_azimuth.clear(), tan_azimuth.clear();
  left_out_from.clear(), left_out_until.clear(), uneven.clear();
  for (std::size_t k = 0; k < grid->planes.size(); ++k) {
    sin_azimuth.push_back(grid->planes[k].sin_azimuth);
    cos_azimuth.push_back(grid->planes[k].cos_azimuth);
    tan_azimuth.push_back(static_cast<float>(sin_azimuth.back() / cos_azimuth.back()));
    std::int64_t from = 0, until = 0;
    int ranges = 0;
    for_beam_ranges(*grid, k, [&](std::size_t begin, std::size_t end, bool within) {
      if (within) return;
      from = static_cast<std::int64_t>(begin);
      until = static_cast<std::int64_t>(end);
      ++ranges;
    });
    const bool even = ranges <= 1;
    left_out_from.push_back(even ? from : 0);
    left_out_until.push_back(even ? until : 0);
    uneven.push_back(!even);
  }
  grid_ = std::move(grid);
}

// For each step, the straight line between the fractional ray numbers at its ends.
void FanTables::lay_lines(double span) {
  const auto rays = static_cast<std::int64_t>(sin_elevation.size() - widest_vector);
  const auto q_of = [&](std::int64_t ray) { return ascending[static_cast<std::size_t>(ray) + 1]; };
  std::array<float, steps> below, rise;
  double number = 0.0;
  std::int64_t last = 0;  // the last ray at or below q
  for (std::size_t step = 0; step < steps; ++step) {
    const double q = first + span * static_cast<double>(step + 1) / static_cast<double>(steps);
    while (last + 1 < rays && q_of(last + 1) <= q) ++last;
    const double gap = last + 1 < rays ? q_of(last + 1) - q_of(last) : 0.0;
    const double onwards = gap > 0.0 ? std::clamp((q - q_of(last)) / gap, 0.0, 1.0) : 0.0;
    const double next = static_cast<double>(last) + onwards;
    below[step] = static_cast<float>(number + 0.5);
    rise[step] = static_cast<float>(next - number);
    number = next;
  }
  // Each ray's number must come out within 0.5; otherwise the steps up to its neighbours are marked
  // as bad.
  const auto step_of = [&](std::int64_t ray) {
    const double stepped = (q_of(std::clamp<std::int64_t>(ray, 0, rays - 1)) - first) * steps_per_q;
    return std::clamp<std::int64_t>(static_cast<std::int64_t>(stepped), 0, steps - 1);
  };
  std::bitset<steps> bad;
  for (std::int64_t ray = 0; ray < rays; ++ray) {
    const std::int64_t step = step_of(ray);
    const auto at = static_cast<std::size_t>(step);
    const double fraction = (q_of(ray) - first) * steps_per_q - static_cast<double>(step);
    const double guess = double(below[at]) - 0.5 + std::min(fraction, 1.0) * double(rise[at]);
    if (std::abs(guess - static_cast<double>(ray)) <= 0.49) continue;
    const std::int64_t from = std::max<std::int64_t>(step_of(ray - 1) - 1, 0);
    const std::int64_t until = std::min(step_of(ray + 1) + 2, steps);
    for (std::int64_t i = from; i < until; ++i) bad[static_cast<std::size_t>(i)] = true;
  }
  lines.resize(steps);
  for (std::size_t step = 0; step < steps; ++step) {
    const auto bits = [](float value) {
      return std::uint64_t{std::bit_cast<std::uint32_t>(value)};
    };
    lines[step] = bits(bad[step] ? -below[step] : below[step]) | bits(rise[step]) << 32;
  }
}

const FanTables& KnownFanTables::of(const std::shared_ptr<const FanGrid>& grid) {
  auto found = std::ranges::find(known_, grid.get(), [](const auto& one) { return one->grid(); });
  if (found == known_.end()) {
    if (known_.size() < max_known) known_.push_back(std::make_unique<FanTables>());
    found = known_.end() - 1;
    (*found)->take(grid);
  }
  std::rotate(known_.begin(), found, found + 1);
  return *known_.front();
}

}  // namespace ensonify::engine
