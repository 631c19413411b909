#include <ensonify/engine/recording/xtf_navigation.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include <fmt/format.h>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/recording/places.h>

namespace ensonify::engine {
namespace {

std::optional<double> time_s(const RecordingBytes& ping) {
  using namespace std::chrono;
  const year_month_day date{year(ping.at<std::uint16_t>(14)), month(ping.at<std::uint8_t>(16)),
                            day(ping.at<std::uint8_t>(17))};
  if (!date.ok()) return std::nullopt;
  const auto days = static_cast<double>(sys_days(date).time_since_epoch().count());
  return days * 86400.0 + ping.at<std::uint8_t>(18) * 3600.0 + ping.at<std::uint8_t>(19) * 60.0 +
         ping.at<std::uint8_t>(20) + ping.at<std::uint8_t>(21) * 0.01;
}

/// The offsets of the sensor's place and of the ship's place in a ping's header.
constexpr std::size_t sensor_place = 160, ship_place = 128;

/// The layback of a ping whose header has no place of the sonar, or has the ship's place as the
/// place of the sonar; unset for other pings. If the header states none (not positive), it follows
/// from a straight cable to the sonar's depth. Unset if it is not positive or not less than 10 km.
std::optional<double> layback_m(const RecordingBytes& header) {
  const auto same = [&](std::size_t part) {
    return header.at<double>(sensor_place + part) == header.at<double>(ship_place + part);
  };
  const bool no_sensor =
      header.at<double>(sensor_place) == 0.0 && header.at<double>(sensor_place + 8) == 0.0;
  if (!no_sensor && !(same(0) && same(8))) return std::nullopt;
  const double cable_m = header.at<std::uint16_t>(182) + 0.01 * header.at<std::uint8_t>(249),
               depth_m = header.known<float>(192).value_or(0.0);
  constexpr double longest_m = 10e3;
  double towed_m = header.at<float>(184);
  if (!(towed_m > 0.0)) towed_m = std::sqrt(std::max(0.0, cable_m * cable_m - depth_m * depth_m));
  return towed_m > 0.0 && towed_m < longest_m ? std::optional(towed_m) : std::nullopt;
}

constexpr double farthest_m = 1e8;  // no map reaches farther from its origin

/// Sets the place of the sonar, else the place of the ship. If the file states degrees but the
/// place cannot be in degrees, it is kept as metres for take_as_metres().
void set_places(const RecordingBytes& header, bool geographic, RecordedPing& ping,
                LineBuilder& lines) {
  std::string impossible;  // text of the first impossible place
  for (const std::size_t y_offset : {sensor_place, ship_place}) {
    const double y = header.at<double>(y_offset), x = header.at<double>(y_offset + 8);
    if ((x == 0.0 && y == 0.0) || std::isnan(x) || std::isnan(y)) continue;
    const bool is_near = std::abs(x) <= farthest_m && std::abs(y) <= farthest_m;
    if (is_near && !geographic)
      ping.place_m = Eigen::Vector2d(x, y);
    else if (geographic && is_on_earth(y, x))
      ping.place = GeographicPlace{y * degree, x * degree};
    else {
      if (is_near && !ping.place_m) ping.place_m = Eigen::Vector2d(x, y);
      if (impossible.empty())
        impossible =
            geographic ? place_text(y, x) : fmt::format("{:.6g} m east, {:.6g} m north", x, y);
      continue;
    }
    if (!impossible.empty())
      lines.impossible("place of the sonar; the ship's is used", ping.number, impossible);
    break;
  }
  if (ping.place) ping.place_m.reset();
  if (!impossible.empty() && !ping.place && !ping.place_m)
    lines.impossible("place; it is left out", ping.number, impossible);
}

/// The angle in radians from a field in degrees; unset if it is not stated or impossible.
std::optional<double> angle_rad(const RecordingBytes& header, std::size_t offset,
                                std::string_view what, const RecordedPing& ping,
                                LineBuilder& lines) {
  const double value_deg = header.at<float>(offset);
  if (std::isnan(value_deg)) return std::nullopt;
  if (std::abs(value_deg) <= 360.0) return value_deg * degree;
  lines.impossible(fmt::format("{}; it is left out", what), ping.number,
                   fmt::format("{:g} degrees", value_deg));
  return std::nullopt;
}

/// Whether places that the file states in metres can only be longitudes and latitudes, because in
/// metres the vehicle would move less than a metre.
bool looks_geographic(const RecordedLine& line) {
  constexpr double max_moved_m = 1.0;
  Eigen::Vector2d low = Eigen::Vector2d::Constant(INFINITY), high = -low;
  for (const RecordedPing& ping : line.pings)
    if (ping.place_m) {
      low = low.cwiseMin(*ping.place_m);
      high = high.cwiseMax(*ping.place_m);
    }
  const double moved = (high - low).maxCoeff();
  return moved > 0.0 && moved < max_moved_m && low.x() >= -180.0 && high.x() <= 180.0 &&
         low.y() >= -90.0 && high.y() <= 90.0;
}

void take_as_degrees(RecordedLine& line, std::string_view name) {
  for (RecordedPing& ping : line.pings)
    if (ping.place_m) {
      ping.place = GeographicPlace{ping.place_m->y() * degree, ping.place_m->x() * degree};
      ping.place_m.reset();
    }
  line.warnings.push_back(
      fmt::format("{}: its header says that positions are metres, but they look like degrees; read "
                  "as longitudes and latitudes",
                  name));
}

/// Handles places that are too large for degrees in a file whose header states degrees. If all
/// places of the line are like this, they are metres. Otherwise they are damaged and left out.
void take_as_metres(RecordedLine& line, std::string_view name) {
  constexpr double nearest_m = 1000.0;  // least distance of a survey from the origin of its map
  const auto has_metres = [](const RecordedPing& ping) { return ping.place_m.has_value(); };
  if (std::ranges::none_of(line.pings, has_metres)) return;
  const bool all = std::ranges::all_of(line.pings, [](const RecordedPing& ping) {
    const double largest_m = ping.place_m ? ping.place_m->cwiseAbs().maxCoeff() : nearest_m;
    return !ping.place && largest_m >= nearest_m;
  });
  if (all)
    line.warnings.push_back(
        fmt::format("{}: its header says that positions are degrees, but they are too large; read "
                    "as metres east and north",
                    name));
  else {
    const auto first = std::ranges::find_if(line.pings, has_metres);
    const Eigen::Vector2d place = first->place_m.value_or(Eigen::Vector2d::Zero());
    line.warnings.push_back(impossible_value(
        name, static_cast<std::size_t>(std::ranges::count_if(line.pings, has_metres)),
        impossible_place, first->number, place_text(place.y(), place.x())));
    for (RecordedPing& ping : line.pings) {
      ping.place_m.reset();
      if (!ping.place) ping.layback_m.reset();  // a layback needs a place
    }
  }
}

}  // namespace

double xtf_sound_speed_mps(const RecordingBytes& ping) {
  const double computed = ping.at<float>(72), stated = ping.at<float>(32);
  for (const double speed_mps : {computed, stated, 2.0 * stated})
    if (is_sound_speed(speed_mps)) return speed_mps;
  return 0.0;
}

RecordedPing xtf_ping(const RecordingBytes& header, bool geographic, LineBuilder& lines) {
  RecordedPing ping{.number = header.at<std::uint32_t>(28),
                    .beam = header.at<std::uint8_t>(3),  // SubChannelNumber
                    .t_s = time_s(header)};
  set_places(header, geographic, ping, lines);
  if (header.known<float>(204) || header.known<float>(208) || header.known<float>(212)) {
    ping.pitch_rad = angle_rad(header, 204, "pitch", ping, lines);
    ping.roll_rad = angle_rad(header, 208, "roll", ping, lines);
    ping.heading_rad = angle_rad(header, 212, "heading", ping, lines);
  }
  if (header.known<float>(124))
    ping.gyro_rad = angle_rad(header, 124, "heading of the ship", ping, lines);
  if (ping.place || ping.place_m) ping.layback_m = layback_m(header);
  ping.depth_m = header.known<float>(192);
  ping.altitude_m = header.known<float>(196);
  if (const auto knots = header.known<float>(152)) ping.speed_mps = *knots * knot_mps;
  return ping;
}

void settle_units(RecordedLine& line, bool geographic, std::string_view name) {
  if (geographic)
    take_as_metres(line, name);
  else if (looks_geographic(line))
    take_as_degrees(line, name);
}

}  // namespace ensonify::engine
