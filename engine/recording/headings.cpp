#include <ensonify/engine/recording/headings.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include <fmt/format.h>

#include <ensonify/engine/base/quantile.h>
#include <ensonify/engine/base/units.h>
#include <ensonify/engine/recording/places.h>

namespace ensonify::engine {
namespace {

using Angles = std::vector<std::optional<double>>;  // by ping

double turn(double angle_rad) { return std::remainder(angle_rad, 2.0 * std::numbers::pi); }

/// The vector from one ping to another, in metres east and north. Unset if the pings do not both
/// have `place` or both `place_m`.
std::optional<Eigen::Vector2d> way_m(const RecordedPing& from, const RecordedPing& to) {
  if (from.place && to.place)
    return metres_per_radian(from.place->latitude_rad)
        .cwiseProduct(Eigen::Vector2d(turn(to.place->longitude_rad - from.place->longitude_rad),
                                      to.place->latitude_rad - from.place->latitude_rad));
  if (from.place_m && to.place_m) return *to.place_m - *from.place_m;
  return std::nullopt;
}

/// The course in each ping; unset: unknown. Places may be rounded, or change less often than the
/// pings, so the course is taken between places that are at least `apart_m` apart.
Angles courses(const std::vector<RecordedPing>& pings) {
  constexpr double apart_m = 10.0;
  Angles courses_rad(pings.size());
  std::size_t last = 0;
  while (last < pings.size() && !pings[last].place && !pings[last].place_m) ++last;
  for (std::size_t i = last + 1; i < pings.size(); ++i) {
    const std::optional<Eigen::Vector2d> way = way_m(pings[last], pings[i]);
    if (!way || way->norm() < apart_m) continue;
    std::fill(courses_rad.begin() + static_cast<std::ptrdiff_t>(last),
              courses_rad.begin() + static_cast<std::ptrdiff_t>(i) + 1,
              std::atan2(way->x(), way->y()));
    last = i;
  }
  return courses_rad;
}

/// The median of the absolute angle between a[i] and b[i]; unset if no ping has both.
std::optional<double> usual_angle_rad(const Angles& a, const Angles& b) {
  std::vector<double> between_rad;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const std::optional<double>&of_a = a[i], &of_b = b[i];
    if (of_a && of_b) between_rad.push_back(std::abs(turn(*of_a - *of_b)));
  }
  if (between_rad.empty()) return std::nullopt;
  return median(std::move(between_rad));
}

bool most_have(const Angles& angles) {
  const auto known =
      std::ranges::count_if(angles, [](const auto& angle) { return angle.has_value(); });
  return known > 0 && 2 * known >= std::ssize(angles);
}

}  // namespace

ChosenHeadings choose_headings(const RecordedLine& line) {
  constexpr double most_off_rad = 60.0 * degree;  // a vehicle's crab angle is less
  constexpr double most_off_zero_rad = 10.0 * degree;
  ChosenHeadings chosen;
  Angles gyro;
  for (const RecordedPing& ping : line.pings) {
    chosen.rad.push_back(ping.heading_rad);
    gyro.push_back(ping.gyro_rad);
  }
  const Angles course = courses(line.pings);
  const auto is_off = [](const std::optional<double>& angle_rad, double most_rad) {
    return angle_rad && *angle_rad > most_rad;
  };
  const bool has_gyro = most_have(gyro) && !is_off(usual_angle_rad(gyro, course), most_off_rad);
  const bool has_heading = most_have(chosen.rad);
  const bool zero = has_heading && std::ranges::all_of(chosen.rad, [](const auto& heading_rad) {
                      return heading_rad.value_or(0.0) == 0.0;
                    });
  const std::optional<double> off_rad = usual_angle_rad(chosen.rad, course);
  std::string why;
  if (!has_heading) {
    if (!has_gyro) return chosen;
    why = "most pings have no heading";
  } else if (zero) {
    const bool contradicted =
        is_off(off_rad, most_off_zero_rad) ||
        (has_gyro && is_off(usual_angle_rad(chosen.rad, gyro), most_off_zero_rad));
    if (!contradicted) return chosen;
    why = "the heading is 0 in every ping";
    if (off_rad) why += fmt::format(", but the course is {:.0f} degrees off it", *off_rad / degree);
  } else {
    if (!off_rad || !is_off(off_rad, most_off_rad)) return chosen;
    why = fmt::format(
        "the stated headings are {:.0f} degrees off the course, unless port and starboard are "
        "exchanged",
        *off_rad / degree);
  }
  chosen.of_gyro = has_gyro;
  chosen.rad = has_gyro ? std::move(gyro) : Angles(line.pings.size());
  chosen.instead =
      fmt::format("{}; {} is the heading", why, has_gyro ? "the ship's gyro" : "the course");
  return chosen;
}

}  // namespace ensonify::engine
