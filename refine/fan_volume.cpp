#include <ensonify/refine/fan_volume.h>

#include <algorithm>
#include <numbers>
#include <stdexcept>

namespace ensonify::refine {
namespace {

// Margins for rounding, independent of the radius: for directions and a tracer's arithmetic, about
// a hundred float steps of the range; for the ray's origin, one float step there; at least 1 mm.
constexpr double slack_of_range = 1e-5;
constexpr double slack_of_origin = 2e-7;
constexpr double min_slack_m = 1e-3;

void check(const FanVolume& volume) {
  Eigen::Matrix3d frame;
  frame << volume.array_axis, volume.middle, volume.pole;
  constexpr double right_angle = std::numbers::pi / 2.0;
  // Written so that NaN fails.
  if (!((frame.transpose() * frame).isIdentity(1e-9) && volume.apex.allFinite()))
    throw std::invalid_argument("FanVolume: the frame must be orthonormal and the apex finite");
  if (!(volume.truncation_rad >= 0.0 && volume.truncation_rad <= right_angle &&
        volume.elevation_low_rad >= -right_angle && volume.elevation_high_rad <= right_angle &&
        volume.elevation_low_rad <= volume.elevation_high_rad))
    throw std::invalid_argument(
        "FanVolume: truncation must be in 0 to 90 degrees, elevations in order within +-90");
  if (!(volume.range_m >= 0.0 && std::isfinite(volume.range_m)))
    throw std::invalid_argument("FanVolume: the range must be finite and not negative");
}

}  // namespace

void ViewTest::look_at(std::span<const FanVolume> volumes) {
  volumes_.clear();
  for (const FanVolume& v : volumes) {
    check(v);
    const double sin_truncation = std::sin(v.truncation_rad);
    volumes_.push_back({.apex = v.apex,
                        .axis = v.array_axis,
                        .middle = v.middle,
                        .pole = v.pole,
                        .cos_truncation = std::cos(v.truncation_rad),
                        .sin2_truncation = sin_truncation * sin_truncation,
                        .cos_low = std::cos(v.elevation_low_rad),
                        .sin_low = std::sin(v.elevation_low_rad),
                        .cos_high = std::cos(v.elevation_high_rad),
                        .sin_high = std::sin(v.elevation_high_rad),
                        .range_m = v.range_m,
                        .slack_m = v.margin_m + std::max(min_slack_m, slack_of_range * v.range_m) +
                                   slack_of_origin * v.apex.lpNorm<Eigen::Infinity>()});
  }
}

}  // namespace ensonify::refine
