#include <ensonify/engine/output/recording.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <numbers>

#include <ensonify/engine/seafloor/bed/reference_map.h>
#include <ensonify/engine/sonar/instrument/mounting.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

using std::numbers::pi;
// A place in the open North Sea, away from real surveys.
constexpr GeographicPlace usual_origin{54.5 * pi / 180.0, 3.5 * pi / 180.0};
constexpr std::int64_t usual_start_s = 946684800;  // 2000-01-01
constexpr double counts_from_1970_s = 1e8;         // three years; no track is so long
constexpr int max_bits = 15;                       // some readers use signed 16-bit numbers

/// The recorder's samples, without the lowest bits beyond max_bits.
std::vector<std::uint16_t> recorded_samples(const Waterfall& waterfall) {
  const int too_many_bits = std::max(0, waterfall.sonar.receiver.bits - max_bits);
  std::vector<std::uint16_t> samples(waterfall.pixels.sample.size());
  for (std::size_t i = 0; i < samples.size(); ++i)
    samples[i] = static_cast<std::uint16_t>(waterfall.pixels.sample[i] >> too_many_bits);
  return samples;
}

/// The map from local positions, in metres, to places on Earth. `frame` must outlive it.
PlaceOfMap place_of_local(const RecordingFrame& frame) {
  if (frame.origin)
    return [&](const Eigen::Vector2d& at) { return place_of_tangent(at, *frame.origin); };
  if (frame.utm_zone != 0)
    return [&](const Eigen::Vector2d& at) {
      return place_of_utm(frame.world_origin.head<2>() + at, frame.utm_zone);
    };
  if (const PlaceOfMap of_world = place_of_reference(frame.reference))
    return [&, of_world](const Eigen::Vector2d& at) {
      return of_world(frame.world_origin.head<2>() + at);
    };
  return [](const Eigen::Vector2d& at) { return place_of_tangent(at, usual_origin); };
}

/// The samples in the columns of a sonar with both sides: columns of other sectors are left out,
/// and a side that the sonar lacks has zeros.
std::vector<std::uint16_t> with_both_sides(const Waterfall& waterfall,
                                           std::vector<std::uint16_t> samples) {
  if (waterfall.sonar.sides == Sides::both) return samples;
  const LineLayout own = waterfall.layout(), both(Sides::both, own.bins());
  std::vector<std::uint16_t> made(waterfall.rows() * both.columns(), 0);
  for (const Side side : {Side::port, Side::starboard}) {
    const auto place = place_of(waterfall.sonar.sectors(), name_of(side));
    if (!place) continue;
    const std::size_t to = both.first_column(static_cast<std::size_t>(side));
    for (std::size_t row = 0; row < waterfall.rows(); ++row)
      std::copy_n(&samples[row * own.columns() + own.first_column(*place)], own.bins(),
                  &made[row * both.columns() + to]);
  }
  return made;
}

}  // namespace

std::span<const std::uint16_t> Recording::side(std::size_t row, Side which) const {
  return std::span(samples).subspan(
      layout().columns() * row + layout().first_column(static_cast<std::size_t>(which)), bins);
}

std::vector<PingInTime> pings_by_time(std::span<const Recording> sonars,
                                      std::span<const std::size_t> which) {
  std::vector<PingInTime> all;
  for (std::size_t of = 0; of < which.size(); ++of)
    for (std::size_t number = 0; number < sonars[which[of]].pings.size(); ++number)
      all.push_back({of, number});
  std::ranges::stable_sort(
      all, {}, [&](const PingInTime& p) { return sonars[which[p.of]].pings[p.number].unix_ms; });
  return all;
}

std::optional<std::int64_t> unix_time(std::string_view text) {
  constexpr std::string_view form = "0000-00-00T00:00:00Z";
  if (text.size() != form.size()) return std::nullopt;
  for (std::size_t i = 0; i < form.size(); ++i)
    if (form[i] == '0' ? text[i] < '0' || text[i] > '9' : text[i] != form[i]) return std::nullopt;
  const auto number = [&](std::size_t at, std::size_t digits) {
    int value = 0;
    std::from_chars(text.data() + at, text.data() + at + digits, value);
    return value;
  };
  const std::chrono::year_month_day day{std::chrono::year(number(0, 4)),
                                        std::chrono::month(static_cast<unsigned>(number(5, 2))),
                                        std::chrono::day(static_cast<unsigned>(number(8, 2)))};
  const int hour = number(11, 2), minute = number(14, 2), second = number(17, 2);
  if (!day.ok() || hour > 23 || minute > 59 || second > 59) return std::nullopt;
  return std::chrono::sys_days(day).time_since_epoch().count() * std::int64_t{86400} + hour * 3600 +
         minute * 60 + second;
}

std::int64_t unix_ms_of(std::string_view start_time, double first_s, double t_s) {
  const std::int64_t start_s =
      unix_time(start_time).value_or(first_s > counts_from_1970_s ? 0 : usual_start_s);
  return start_s * 1000 + std::llround(t_s * 1000.0);
}

Recording make_recording(const Waterfall& waterfall, std::vector<FullScale> full_scale,
                         const RecordingFrame& frame) {
  const Sonar& sonar = waterfall.sonar;
  const double wavelength_m = frame.sound_speed_mps / sonar.frequency_hz;
  const auto width_rad = [&](const LineArray& array) {
    return array.shading.beam_width_x() * wavelength_m / array.length_m;
  };
  Recording recording{.name = sonar.name,
                      .file = sonar.name,
                      .frequency_hz = sonar.frequency_hz,
                      .bandwidth_hz = sonar.pulse.kind == PulseKind::cw
                                          ? 1.0 / sonar.pulse.transmitted_length_s()
                                          : sonar.pulse.bandwidth_hz,
                      .pulse_length_s = sonar.pulse.transmitted_length_s(),
                      .range_m = sonar.range_m,
                      .beamwidth_rad = std::min(width_rad(sonar.transmit_array(wavelength_m)),
                                                width_rad(sonar.receive_array(wavelength_m))),
                      .vertical_beamwidth_rad = sonar.vertical.beamwidth_rad,
                      .tilt_rad = {sonar.vertical.tilt_rad + sonar.vertical.port_mount_rad,
                                   sonar.vertical.tilt_rad + sonar.vertical.starboard_mount_rad},
                      .full_scale = std::move(full_scale),
                      .frequency_rank = frame.frequency_rank,
                      .sound_speed_mps = frame.sound_speed_mps,
                      .bins = static_cast<std::size_t>(sonar.bins),
                      .port = sonar.has(Side::port),
                      .starboard = sonar.has(Side::starboard),
                      .samples = with_both_sides(waterfall, recorded_samples(waterfall))};
  const double first_s = waterfall.pings.empty() ? 0.0 : waterfall.pings.front().pose.t_s;
  const PlaceOfMap place_of = place_of_local(frame);
  for (std::size_t i = 0; i < waterfall.pings.size(); ++i) {
    const PingRow& ping = waterfall.pings[i];
    std::array<double, 2>& gain_db = recording.gain_db.emplace_back();
    for (const Side side : {Side::port, Side::starboard}) {
      const double gain = waterfall.line_of(ping, name_of(side)).gain;
      gain_db[static_cast<std::size_t>(side)] = scatter::to_db(gain * gain);
    }
    if (!ping.recorded) continue;
    const Pose pose = mounted(ping.reported, sonar.mounting);
    const double altitude_m = frame.altitude_m(mounted(ping.pose, sonar.mounting).position);
    const PlaceOnEarth there = place_of(pose.position.head<2>());
    double heading_rad = std::fmod(pose.heading_rad + there.convergence_rad, 2.0 * pi);
    if (heading_rad < 0.0) heading_rad += 2.0 * pi;
    recording.pings.push_back({.row = i,
                               .number = ping.number,
                               .beam = static_cast<int>(i) % sonar.beams,
                               .unix_ms = unix_ms_of(frame.start_time, first_s, ping.pose.t_s),
                               .interval_s = ping.interval_s,
                               .place = there.where,
                               .heading_rad = heading_rad,
                               .pitch_rad = pose.pitch_rad,
                               .roll_rad = pose.roll_rad,
                               .depth_m = -pose.position.z(),
                               .altitude_m = std::isnan(altitude_m) ? 0.0 : altitude_m,
                               .speed_mps = pose.velocity_mps.head<2>().norm()});
  }
  return recording;
}

}  // namespace ensonify::engine
