#include <ensonify/engine/trace/ray_fan.h>

#include <algorithm>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <utility>

#include <Eigen/Geometry>

#include <ensonify/engine/trace/fan_frame.h>

namespace ensonify::engine {
namespace {

constexpr double right_angle = std::numbers::pi / 2.0;
constexpr double share_to_range = 0.65;  // of the elevations: even in range over a flat bed
// Even in range beyond that range, up to `rising` times as far, for a bed that rises.
constexpr double share_rising = 0.15;
constexpr double rising = 4.0;
// The shares where the bed reaches above the sonar: even in range over a flat bed, and over a
// slope.
constexpr double share_to_range_below_slope = 0.35, share_slope = 0.45;
// Planes outside the main lobe at mid-sector are needed only at the sector's ends, where a plane's
// rays are closer to broadside: their spacing may grow. At 1.5 the sum over planes is within
// 0.01 dB of the beam's integral up to 50 degrees from mid-sector.
constexpr double plane_growth = 1.5;

/// Slant range divided by height at which a ray of depression `depression_rad` meets a flat bed;
/// past nadir, 1.
double flat_range_over_height(double depression_rad) {
  return 1.0 / std::sin(std::clamp(depression_rad, 1e-9, right_angle));
}

/// Past nadir, where a ray meets the bed on the other side: slant range divided by height, minus 1.
double more_past_nadir(double depression_rad) {
  return flat_range_over_height(2.0 * right_angle - depression_rad) - 1.0;
}

/// The factor from each width to the next for which `count` widths have the sum `sum`; the first
/// width is 1.
double growth_for(int count, double sum) {
  const auto made = [&](double growth) {
    double total = 0.0;
    for (int i = 0; i < count; ++i) total = total * growth + 1.0;
    return total;
  };
  double below = 1.0, above = std::max(2.0, sum);
  if (count < 2 || made(below) >= sum * (1.0 - 1e-9)) return 1.0;
  for (int step = 0; step < 60; ++step) {
    const double middle = 0.5 * (below + above);
    (made(middle) < sum ? below : above) = middle;
  }
  return above;
}

/// Planes at even steps of the sine of azimuth.
std::vector<FanGrid::Plane> lay_even_planes(double sine_step, double widest_rad) {
  const int count = static_cast<int>(std::ceil(2.0 * std::sin(widest_rad) / sine_step));
  std::vector<FanGrid::Plane> planes;
  for (int i = 0; i < count; ++i) {
    const double middle = (i - 0.5 * (count - 1)) * sine_step;
    const double end = std::min(middle + 0.5 * sine_step, 1.0),
                 begin = std::max(middle - 0.5 * sine_step, -1.0);
    planes.push_back({middle, std::sqrt(1.0 - middle * middle), std::asin(end) - std::asin(begin)});
  }
  return planes;
}

std::vector<FanGrid::Plane> lay_planes(const FanLayout& layout, double widest_rad) {
  std::vector<double> edges{0.0};  // of the planes' cells on one side of broadside
  const double main_beam_rad = std::max(layout.main_lobe_rad, layout.main_beam_rad);
  // A single plane on a side stands for all of the main beam.
  double width = layout.planes == 2 ? main_beam_rad : 2.0 * layout.main_lobe_rad / layout.planes;
  const double growth = growth_for(layout.planes / 2, main_beam_rad / width);
  while (edges.back() < widest_rad * (1.0 - 1e-9)) {
    if (edges.back() > main_beam_rad * (1.0 - 1e-9))
      width *= std::max(growth, plane_growth);
    else if (edges.size() > 1)
      width *= growth;
    edges.push_back(std::min(edges.back() + width, widest_rad));
  }
  std::vector<FanGrid::Plane> planes;
  const auto add = [&](double azimuth, double cell) {
    planes.push_back({std::sin(azimuth), std::cos(azimuth), cell});
  };
  for (std::size_t i = edges.size(); i-- > 1;)
    add(-0.5 * (edges[i] + edges[i - 1]), edges[i] - edges[i - 1]);
  for (std::size_t i = 1; i < edges.size(); ++i)
    add(0.5 * (edges[i] + edges[i - 1]), edges[i] - edges[i - 1]);
  return planes;
}

/// The place at which a growing function has a value. It lies between `below`, where the function
/// is less than the value by about `missing`, and `above`. The search starts at `guess` and uses
/// the secant method, or halves the interval where a secant leads outside. For a smooth function
/// the error is far below a millionth of the way from `below`.
template <class Growing>
double place_of(const Growing& function, double value, double below, double missing, double above,
                double guess) {
  double last = below, last_off = -missing, place = guess;
  for (int step = 0; step < 100 && above - below > 1e-15; ++step) {
    const double off = function(place) - value;
    (off < 0.0 ? below : above) = place;
    const double next = place - off * (place - last) / (off - last_off);
    const bool inside = next >= below && next <= above;
    if (std::abs(off) < 1e-6 * missing) return inside ? next : place;
    last = std::exchange(place, inside ? next : 0.5 * (below + above));
    last_off = off;
  }
  return below;
}

/// Distributes launch angles so that the ranges of their bent rays are even between two ranges.
/// These are divided by the height of the sonar. A range that several launch angles reach counts
/// once for each of them.
class BentDistribution {
 public:
  BentDistribution(std::span<const LaunchRange> bent, double from, double to) : bent_(bent) {
    for (std::size_t i = 0; i < bent.size(); ++i) {
      const double last = i == 0 ? 0.0 : sum_.back();
      const double change = i == 0 ? 0.0
                                   : std::clamp(bent[i].range_over_height, from, to) -
                                         std::clamp(bent[i - 1].range_over_height, from, to);
      sum_.push_back(std::isnan(change) ? last : last + std::abs(change));
    }
  }
  /// Grows as the depression falls.
  double at(double depression_rad) const {
    if (bent_.empty()) return 0.0;
    const auto next = std::ranges::lower_bound(bent_, depression_rad, std::greater(),
                                               &LaunchRange::depression_rad);
    if (next == bent_.begin()) return 0.0;
    if (next == bent_.end()) return sum_.back();
    const auto i = static_cast<std::size_t>(next - bent_.begin());
    const double share = (bent_[i - 1].depression_rad - depression_rad) /
                         (bent_[i - 1].depression_rad - bent_[i].depression_rad);
    return std::lerp(sum_[i - 1], sum_[i], share);
  }

 private:
  std::span<const LaunchRange> bent_;
  std::vector<double> sum_;
};

/// The share of a fan's rays below an elevation: some are even in slant range, some in range beyond
/// the fan's own, some over a rising slope, and the rest even in angle.
class ElevationShares {
 public:
  explicit ElevationShares(const FanLayout& layout)
      : middle_rad_(0.5 * (layout.sector_low_rad + layout.sector_high_rad)),
        half_sector_rad_(0.5 * (layout.sector_high_rad - layout.sector_low_rad)),
        tilt_rad_(layout.roll_tilt_rad),
        most_past_nadir_(std::max(layout.range_over_height - 1.0, 0.0)),
        slope_rad_(layout.rise_rad + std::asin(1.0 / std::max(layout.range_over_height, 1.0))),
        bends_(!layout.bent.empty()),
        rises_(layout.rise_rad > 0.0),
        bent_within_(layout.bent, 0.0, layout.range_over_height),
        bent_beyond_(layout.bent, layout.range_over_height, rising * layout.range_over_height) {
    const double high_rad = layout.sector_high_rad + tilt_rad_,
                 low_rad = layout.sector_low_rad + tilt_rad_;
    const double end = flat_range_over_height(low_rad);
    const double farthest = std::min(layout.range_over_height, end);
    within_ = {within(high_rad), bends_ ? within(low_rad) : farthest - past_nadir(low_rad)};
    if (bends_) {
      beyond_ = {bent_beyond_.at(high_rad), bent_beyond_.at(low_rad)};
    } else {
      beyond_ = {farthest, std::min(rising * layout.range_over_height, end)};
    }
    // The slope whose end, at the end of the range, is at rise_rad above the horizontal.
    slope_ = {over_slope(layout.sector_high_rad),
              std::min(layout.range_over_height, over_slope(layout.sector_low_rad))};
    if (within_.is_there()) range_share_ = rises_ ? share_to_range_below_slope : share_to_range;
    if (beyond_.is_there() && !rises_) rising_share_ = share_rising;
    if (slope_.is_there() && rises_) slope_share_ = share_slope;
  }

  double below(double elevation_rad) const {
    const double depression_rad = middle_rad_ - elevation_rad + tilt_rad_;
    const double r = flat_range_over_height(depression_rad);
    const double by_angle = (elevation_rad + half_sector_rad_) / (2.0 * half_sector_rad_);
    const double by_range = within_.share_to(within(depression_rad));
    const double by_farther = beyond_.share_to(bends_ ? bent_beyond_.at(depression_rad) : r);
    const double straight = range_share_ * by_range + rising_share_ * by_farther +
                            (1.0 - range_share_ - rising_share_ - slope_share_) * by_angle;
    if (!rises_) return straight;
    return straight + slope_share_ * slope_.share_to(over_slope(middle_rad_ - elevation_rad));
  }

 private:
  struct Stretch {  // an interval of range divided by height
    double begin = 0.0, end = 0.0;
    bool is_there() const { return end > begin; }
    double share_to(double r) const {
      return is_there() ? std::clamp((r - begin) / (end - begin), 0.0, 1.0) : 0.0;
    }
  };
  /// Grows with the range, up to the fan's range, from the far side of nadir to the near side.
  double within(double depression_rad) const {
    return (bends_ ? bent_within_.at(depression_rad) : flat_range_over_height(depression_rad)) -
           past_nadir(depression_rad);
  }
  double past_nadir(double depression_rad) const {  // rays hardly bend there
    return std::min(more_past_nadir(depression_rad), most_past_nadir_);
  }
  double over_slope(double depression_rad) const {
    return flat_range_over_height(std::max(depression_rad + tilt_rad_ + slope_rad_, 0.0));
  }

  double middle_rad_, half_sector_rad_, tilt_rad_, most_past_nadir_, slope_rad_;
  bool bends_, rises_;
  BentDistribution bent_within_, bent_beyond_;
  Stretch within_, beyond_, slope_;
  double range_share_ = 0.0, rising_share_ = 0.0, slope_share_ = 0.0;
};

/// Elevations from one end of the sector to the other, with equal shares between neighbours.
std::vector<double> lay_elevations(const ElevationShares& shares, double half_sector, int count) {
  const auto distribution = [&](double elevation) { return shares.below(elevation); };
  std::vector<double> elevations(static_cast<std::size_t>(count), -half_sector);
  const double share = 1.0 / (count - 1);  // between two elevations
  double step_rad = 2.0 * half_sector * share;
  for (std::size_t j = 1; j < elevations.size(); ++j) {
    const double before = elevations[j - 1];
    elevations[j] = place_of(distribution, static_cast<double>(j) * share, before, share,
                             half_sector, std::min(before + step_rad, half_sector));
    step_rad = elevations[j] - before;
  }
  elevations.back() = half_sector;
  return elevations;
}

}  // namespace

FanGrid::FanGrid(const FanLayout& layout)
    : middle_depression_rad(0.5 * (layout.sector_low_rad + layout.sector_high_rad)),
      sin_truncation(std::sin(layout.truncation_rad)) {
  const double half_sector = 0.5 * (layout.sector_high_rad - layout.sector_low_rad);
  if (!(half_sector > 0.0 && half_sector < right_angle))
    throw std::invalid_argument("FanLayout: the sector must be between 0 and 180 degrees wide");
  if (!(layout.main_lobe_rad > 0.0 && layout.truncation_rad > 0.0))
    throw std::invalid_argument(
        "FanLayout: the main lobe and the truncation angle must be positive");
  if (layout.planes < 2 || layout.planes % 2 != 0 || layout.elevations < 2)
    throw std::invalid_argument(
        "FanLayout: needs an even number of planes and at least two elevations");

  const double widest_rad = std::asin(std::min(1.0, sin_truncation / std::cos(half_sector)));
  planes = layout.sine_step > 0.0 ? lay_even_planes(layout.sine_step, widest_rad)
                                  : lay_planes(layout, widest_rad);
  elevation_rad = lay_elevations(ElevationShares(layout), half_sector, layout.elevations);
  for (double e : elevation_rad) {
    sin_elevation.push_back(std::sin(e));
    cos_elevation.push_back(std::cos(e));
  }
}

FanFrame frame_of(const RayFan& fan) {
  FanFrame frame{};
  Eigen::Vector3d::Map(frame.origin.data()) = fan.origin;
  Eigen::Matrix3d::Map(frame.axes.data()) << fan.array_axis, fan.middle, fan.pole;
  frame.handedness = fan.array_axis.cross(fan.middle).dot(fan.pole) < 0.0 ? -1.0 : 1.0;
  return frame;
}

}  // namespace ensonify::engine
