#include <ensonify/engine/imitation/crab.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/base/quantile.h>
#include <ensonify/engine/base/units.h>
#include <ensonify/engine/comparison/bed_drift.h>
#include <ensonify/engine/comparison/line_statistics.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t window = 64;          // pings from which one crab angle is found
constexpr double min_off_rad = 4 * degree;  // the least difference that is corrected
constexpr double min_off_samples = 0.25;    // the same, as a drift in samples per ping

/// The crab angle in the middle of a window of pings: stated by headings, and shown by samples.
struct Crab {
  double ping, stated_rad, shown_rad;
  bool has_long_forms;
};

double turn(double angle_rad) { return std::remainder(angle_rad, 2.0 * std::numbers::pi); }

double rms(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(values.size(), 1)));
}

/// Whether the bed has long forms in pings [first, first + window), on the mean of both sides. Then
/// its drift does not show how the vehicle moves.
bool has_long_forms(const LineWithBed& line, std::size_t first, double step_m) {
  // The speckle of two pings is alike if they are less than an array's length apart.
  constexpr double longest_array_m = 0.5;  // of most sonars' arrays
  constexpr double min_lag = 4, max_lag = 0.5 * window;
  // Scenes with ripples or trawl marks have 0.3 to 0.8. Most others and two real recordings have
  // less than 0.25.
  constexpr double max_likeness = 0.25;
  const auto lag =
      static_cast<std::size_t>(std::clamp(std::ceil(longest_array_m / step_m), min_lag, max_lag));
  double likeness = 0.0;
  for (const Side side : {Side::port, Side::starboard})
    likeness +=
        0.5 * lasting_likeness(line, side, line.bed(side).first_sample, first, first + window, lag);
  return likeness > max_likeness;
}

/// The crab angles of all windows in which both angles are known.
std::vector<Crab> crabs_of(const LineWithBed& line, const VehiclePath& path) {
  std::vector<Crab> crabs;
  for (std::size_t first = 0; first + window <= line.pings.size(); first += window / 2) {
    const std::size_t end = first + window, last = end - 1;
    const auto drift_of = [&](Side side) {
      return bed_drift_m(line, side, line.bed(side).first_sample, first, end);
    };
    const std::optional<double> drift_m =
        sideways_drift_m(drift_of(Side::port), drift_of(Side::starboard));
    const double east_m = path.x_m[last] - path.x_m[first],
                 north_m = path.y_m[last] - path.y_m[first];
    const double step_m = std::hypot(east_m, north_m) / static_cast<double>(last - first);
    if (!drift_m || !(step_m > 0.0)) continue;
    // In the middle of what bed_drift_m() uses: from twice the first return to the end.
    const double middle_m = path.altitude_m[first + window / 2] + 0.5 * line.pings[first].range_m;
    const double cos_grazing =
        std::sqrt(std::max(0.0, 1.0 - std::pow(path.altitude_m[first + window / 2] / middle_m, 2)));
    const double sideways = *drift_m / (cos_grazing * step_m);
    if (!(std::abs(sideways) < 1.0)) continue;
    const double course_rad = std::atan2(east_m, north_m);
    double stated_rad = 0.0;
    for (std::size_t i = first; i < end && !path.heading_rad.empty(); ++i)
      stated_rad += turn(path.heading_rad[i] - course_rad) / double{window};
    crabs.push_back({static_cast<double>(first) + 0.5 * window, stated_rad, std::asin(sideways),
                     has_long_forms(line, first, step_m)});
  }
  return crabs;
}

}  // namespace

HeadingCheck correct_heading(const LineWithBed& line, VehiclePath& path) {
  HeadingCheck check;
  if (line.port.empty() || line.starboard.empty() || path.place.how != Confidence::stated)
    return check;
  std::vector<Crab> crabs = crabs_of(line, path);
  constexpr std::size_t fewest = 3;
  if (crabs.size() < fewest) return check;
  const std::size_t most = crabs.size() / 2 + 1;
  std::erase_if(crabs, [](const Crab& crab) { return crab.has_long_forms; });
  check.long_forms = crabs.size() < std::max(fewest, most);
  if (check.long_forms) return check;
  std::vector<double> off, mirrored;
  for (const Crab& crab : crabs) {
    off.push_back(crab.shown_rad - crab.stated_rad);
    mirrored.push_back(crab.shown_rad + crab.stated_rad);
  }
  const double sample_m = line.pings[0].range_m / static_cast<double>(line.samples);
  const double way_m = path.speed_mps * path.ping_interval_s;
  const double least = std::max(min_off_rad, std::atan2(min_off_samples * sample_m, way_m));
  if (!(std::abs(median(off)) > least)) return check;
  check.off_rad = rms(off);
  check.exchanged = rms(mirrored) < least && rms(mirrored) < 0.5 * check.off_rad;
  std::vector<double> headings;
  for (std::size_t i = 0, next = 0; i < path.x_m.size(); ++i) {
    while (next < crabs.size() && crabs[next].ping <= static_cast<double>(i)) ++next;
    const std::size_t before = next == 0 ? 0 : next - 1, after = std::min(next, crabs.size() - 1);
    const double share = before == after ? 0.0
                                         : (static_cast<double>(i) - crabs[before].ping) /
                                               (crabs[after].ping - crabs[before].ping);
    const double heading = heading_rad(path, i) + std::lerp(off[before], off[after], share);
    headings.push_back(i == 0 ? heading : headings.back() + turn(heading - headings.back()));
  }
  path.heading_rad = std::move(headings);
  path.attitude = {Confidence::measured,
                   fmt::format("{}; headings turned by {:.0f} degrees (rms), so that the bed moves "
                               "sideways as the samples show",
                               path.attitude.why, check.off_rad / degree)};
  return check;
}

}  // namespace ensonify::engine
