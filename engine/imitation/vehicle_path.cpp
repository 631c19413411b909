#include <ensonify/engine/imitation/vehicle_path.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include <fmt/format.h>

#include <ensonify/engine/base/quantile.h>
#include <ensonify/engine/base/units.h>
#include <ensonify/engine/recording/headings.h>
#include <ensonify/engine/recording/recording_reader.h>
#include <ensonify/engine/sonar/vehicle/recorded_track.h>
#include <ensonify/scatter/sea_water.h>

namespace ensonify::engine {
namespace {

using Values = std::vector<double>;
using MaybeValues = std::vector<std::optional<double>>;
constexpr double place_smoothing_s = 3.0;  // positions are often rounded, or rarer than pings

/// The values, with gaps filled by fill_gaps(). Empty if fewer than half of the values are known.
Values filled(MaybeValues maybe) {
  const auto known = std::ranges::count_if(maybe, [](const auto& value) { return !!value; });
  if (2 * known < std::ssize(maybe)) return {};
  fill_gaps(maybe);
  Values values;
  for (const std::optional<double>& value : maybe) values.push_back(value.value());
  return values;
}

/// One number of each ping, with gaps filled.
template <class F>
Values column(const RecordedLine& line, F&& value_of) {
  MaybeValues values;
  for (const RecordedPing& ping : line.pings) values.push_back(std::invoke(value_of, ping));
  return filled(std::move(values));
}

bool all_equal(const Values& values) {
  return std::ranges::adjacent_find(values, std::ranges::not_equal_to()) == values.end();
}

/// The mean of the values within `reach` places of each value.
Values moving_mean(const Values& values, std::size_t reach) {
  Values sums(values.size() + 1, 0.0), means(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) sums[i + 1] = sums[i] + values[i];
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t first = i < reach ? 0 : i - reach,
                      end = std::min(i + reach + 1, values.size());
    means[i] = (sums[end] - sums[first]) / static_cast<double>(end - first);
  }
  return means;
}

/// The median of the values within `reach` places of one.
double median_around(const Values& values, std::size_t i, std::size_t reach) {
  const std::size_t begin = i < reach ? 0 : i - reach, end = std::min(i + reach + 1, values.size());
  return median(Values(values.begin() + static_cast<std::ptrdiff_t>(begin),
                       values.begin() + static_cast<std::ptrdiff_t>(end)));
}

Values moving_median(const Values& values, std::size_t reach) {
  Values medians;
  for (std::size_t i = 0; i < values.size(); ++i)
    medians.push_back(median_around(values, i, reach));
  return medians;
}

/// Single values, or two neighbours, more than `far` off the median around them become that median.
Values without_single(Values values, double far) {
  const Values usual = moving_median(values, 2);
  for (std::size_t i = 0; i < values.size(); ++i)
    if (std::abs(values[i] - usual[i]) > far) values[i] = usual[i];
  return values;
}

/// The median of the values around one value. It has equally many values before and after it;
/// otherwise, near an end of the line, a slope would look like a difference.
double usual_at(const Values& values, std::size_t i) {
  constexpr std::size_t fewest = 5, most = 40;
  return median_around(values, i, std::clamp(std::min(i, values.size() - 1 - i), fewest, most));
}

/// Whether the time between two pings is so long that the recording paused, or its clock was set.
bool is_pause(double step_s, double usual_s) { return step_s > 2.0 * usual_s; }

/// The mean time from ping to ping, without pauses and without steps of a clock that was set back.
/// Unset if no time is later than the one before. It is a mean because times may be rounded: an XTF
/// has hundredths of a second.
std::optional<double> mean_interval_s(const Values& t_s) {
  Values forward;
  for (std::size_t i = 1; i < t_s.size(); ++i)
    if (t_s[i] > t_s[i - 1]) forward.push_back(t_s[i] - t_s[i - 1]);
  const double usual_s = median(std::move(forward));
  double sum_s = 0.0, steps = 0.0;
  for (std::size_t i = 1; i < t_s.size(); ++i) {
    const double step_s = t_s[i] - t_s[i - 1];
    if (is_pause(std::abs(step_s), usual_s)) continue;
    sum_s += step_s;
    steps += 1.0;
  }
  return sum_s > 0.0 ? std::optional(sum_s / steps) : std::nullopt;
}

void set_times(const RecordedLine& line, VehiclePath& path) {
  path.t_s = column(line, &RecordedPing::t_s);
  if (const std::optional<double> interval_s = mean_interval_s(path.t_s)) {
    path.ping_interval_s = *interval_s;
    path.time = {Confidence::stated, "times of the pings"};
    const bool ascend =
        std::ranges::adjacent_find(path.t_s, std::ranges::greater_equal()) == path.t_s.end();
    if (ascend) return;
    path.time = {Confidence::measured, "times that do not ascend, made even"};
  } else {
    Values ranges;
    for (const RecordedPing& ping : line.pings) ranges.push_back(ping.range_m);
    const double speed_mps =
        line.sound_speed_mps > 0.0 ? line.sound_speed_mps : scatter::nominal_sound_speed_mps;
    path.ping_interval_s = 2.0 * median(ranges) / speed_mps;
    path.time = {Confidence::assumed,
                 "the pings have no times that ascend: two-way time of the range"};
  }
  const double begin_s = path.t_s.empty() ? 0.0 : path.t_s.front();
  path.t_s.resize(line.pings.size());
  for (std::size_t i = 0; i < path.t_s.size(); ++i)
    path.t_s[i] = begin_s + static_cast<double>(i) * path.ping_interval_s;
}

/// Replaces places that are far from the places of neighbouring pings.
void leave_out_jumps(NavigationLog& log) {
  constexpr std::size_t around = 20;
  constexpr double far_m = 200.0;
  const Values x = moving_median(log.x_m, around), y = moving_median(log.y_m, around);
  for (std::size_t i = 0; i < x.size(); ++i)
    if (std::hypot(log.x_m[i] - x[i], log.y_m[i] - y[i]) > far_m) {
      log.x_m[i] = x[i];
      log.y_m[i] = y[i];
    }
}

/// The medians of latitudes and of longitudes. Single wrong positions do not change them.
std::optional<GeographicPlace> median_place(const RecordedLine& line) {
  Values latitudes_rad, longitudes_rad;
  for (const RecordedPing& ping : line.pings)
    if (ping.place) {
      latitudes_rad.push_back(ping.place->latitude_rad);
      longitudes_rad.push_back(ping.place->longitude_rad);
    }
  if (latitudes_rad.empty()) return std::nullopt;
  return GeographicPlace{median(std::move(latitudes_rad)), median(std::move(longitudes_rad))};
}

/// The places of the pings, in metres east and north of `origin`; without it, on the file's map.
NavigationLog places_of(const RecordedLine& line, const std::optional<GeographicPlace>& origin,
                        const Values& t_s) {
  const auto place_of = [&](const RecordedPing& ping) -> std::optional<Eigen::Vector2d> {
    if (!origin) return ping.place_m;
    if (!ping.place) return std::nullopt;
    const Eigen::Vector2d place = tangent_place(*ping.place, *origin).place;
    constexpr double wrong_m = 100e3;  // no line is so long
    return place.norm() < wrong_m ? std::optional(place) : std::nullopt;
  };
  const auto part = [&](Eigen::Index which) {
    return column(line, [&](const RecordedPing& ping) -> std::optional<double> {
      const std::optional<Eigen::Vector2d> place = place_of(ping);
      return place ? std::optional((*place)[which]) : std::nullopt;
    });
  };
  NavigationLog log;
  log.t_s = t_s;
  log.x_m = part(0);
  log.y_m = part(1);
  if (!log.x_m.empty()) leave_out_jumps(log);
  return log;
}

/// Makes a path at the stated speed along the headings; to the north if there are none.
void go_by_heading(const RecordedLine& line, const std::string& why, VehiclePath& path) {
  const Values speeds = column(line, &RecordedPing::speed_mps);
  const double speed_mps = speeds.empty() ? 1.5 : median(speeds);
  double x_m = 0.0, y_m = 0.0;
  for (std::size_t i = 0; i < path.t_s.size(); ++i) {
    const double way_m = i == 0 ? 0.0 : speed_mps * (path.t_s[i] - path.t_s[i - 1]),
                 heading_rad = path.heading_rad.empty() ? 0.0 : path.heading_rad[i];
    path.x_m.push_back(x_m += way_m * std::sin(heading_rad));
    path.y_m.push_back(y_m += way_m * std::cos(heading_rad));
  }
  path.place = {Confidence::assumed,
                fmt::format("{}: {} at {:.2f} m/s, {} speed", why,
                            path.heading_rad.empty() ? "straight north" : "along the headings",
                            speed_mps, speeds.empty() ? "a usual" : "the stated")};
}

/// Moves the origin to the middle of the path's bounds, and returns where this middle was. Throws
/// RecordingError for a path that is too long.
Eigen::Vector2d move_origin_to_middle(VehiclePath& path) {
  const auto [west, east] = std::ranges::minmax(path.x_m);
  const auto [south, north] = std::ranges::minmax(path.y_m);
  constexpr double max_m = 10e3;
  if (!(east - west < max_m && north - south < max_m))
    throw RecordingError(fmt::format(
        "the positions of the pings span {:.3g} x {:.3g} km, expected one line of at most {:.0f} "
        "km; split the recording",
        1e-3 * (east - west), 1e-3 * (north - south), 1e-3 * max_m));
  Eigen::Vector2d middle(0.5 * (west + east), 0.5 * (south + north));
  for (double& x_m : path.x_m) x_m -= middle.x();
  for (double& y_m : path.y_m) y_m -= middle.y();
  return middle;
}

void set_places(const RecordedLine& line, VehiclePath& path) {
  const std::optional<GeographicPlace> origin = median_place(line);
  const NavigationLog log = places_of(line, origin, path.t_s);
  const auto pings = std::ssize(line.pings),
             placed = std::ranges::count_if(
                 line.pings, [](const auto&ping) { return ping.place || ping.place_m; });
  if (placed == 0) {
    go_by_heading(line, "no positions", path);
  } else if (log.x_m.empty()) {
    go_by_heading(line, fmt::format("only {} of {} pings have a position", placed, pings), path);
  } else if (all_equal(log.x_m) && all_equal(log.y_m)) {
    go_by_heading(line, "all positions are the same", path);
  } else {
    const RecordedTrack track(log, place_smoothing_s);
    for (const double t_s : path.t_s) {
      const Eigen::Vector3d place = track.at(t_s).position;
      path.x_m.push_back(place.x());
      path.y_m.push_back(place.y());
    }
    const bool towed = std::ranges::any_of(
        line.pings, [](const RecordedPing& ping) { return ping.layback_m.has_value(); });
    path.place = {
        Confidence::stated,
        fmt::format("positions of {}{}, smoothed over 3 s",
                    placed == pings ? "the pings"
                                    : fmt::format("{} of {} pings, interpolated", placed, pings),
                    towed ? ", which are the ship's less the layback" : "")};
  }
  const Eigen::Vector2d middle = move_origin_to_middle(path);
  if (origin && path.place.how == Confidence::stated)
    path.origin = place_of_tangent(middle, *origin).where;
  double length_m = 0.0, time_s = 0.0;
  for (std::size_t i = 1; i < path.t_s.size(); ++i) {
    const double step_s = path.t_s[i] - path.t_s[i - 1];
    if (is_pause(step_s, path.ping_interval_s)) continue;
    length_m += std::hypot(path.x_m[i] - path.x_m[i - 1], path.y_m[i] - path.y_m[i - 1]);
    time_s += step_s;
  }
  path.speed_mps = time_s > 0.0 ? length_m / time_s : 0.0;
}

void set_attitude(const RecordedLine& line, VehiclePath& path) {
  // No sidescan sonar works at larger angles: such values are wrong.
  const auto within = [](std::optional<double> angle_rad, double max_rad) {
    return angle_rad && std::abs(*angle_rad) <= max_rad ? angle_rad : std::nullopt;
  };
  constexpr double far_rad = 5.0 * degree;  // no vehicle turns so far and back within two pings
  path.roll_rad = without_single(
      column(line, [&](const RecordedPing& ping) { return within(ping.roll_rad, 90.0 * degree); }),
      far_rad);
  path.pitch_rad = without_single(
      column(line, [&](const RecordedPing& ping) { return within(ping.pitch_rad, 60.0 * degree); }),
      far_rad);
  const ChosenHeadings headings = choose_headings(line);
  path.heading_instead = headings.instead;
  // Only headings that are known are unwrapped, so that a gap does not become a turn.
  MaybeValues unwrapped;
  double last = 0.0;
  for (const std::optional<double>& heading_rad : headings.rad) {
    if (heading_rad) last += std::remainder(*heading_rad - last, 2.0 * std::numbers::pi);
    unwrapped.push_back(heading_rad ? std::optional(last) : std::nullopt);
  }
  path.heading_rad = filled(std::move(unwrapped));
  std::string from;
  for (Values* values : {&path.roll_rad, &path.pitch_rad})
    if (std::ranges::all_of(*values, [](double value) { return value == 0.0; }))
      values->clear();  // the file does not use this field
  for (const auto& [values, name] :
       {std::pair{&path.roll_rad, "roll"},
        {&path.pitch_rad, "pitch"},
        {&path.heading_rad, headings.of_gyro ? "the ship's heading" : "heading"}})
    if (!values->empty()) from += fmt::format("{}{}", from.empty() ? "" : ", ", name);
  path.attitude = from.empty() ? Evidence{Confidence::assumed, "no attitude: level, on course"}
                               : Evidence{Confidence::stated, from + " of the pings"};
  if (!headings.instead.empty()) path.attitude.why += "; " + headings.instead;
}

/// Finds the altitude of each ping. Throws RecordingError if the line neither shows nor states it.
void set_altitudes(const LineWithBed& line, VehiclePath& path) {
  const std::size_t pings = line.pings.size();
  const Values ranges = first_bed_echoes_m(line);
  const Values stated_m = column(line, &RecordedPing::altitude_m);
  if (stated_m.empty() && ranges_are_even(line))
    throw RecordingError(
        "the recording is equally bright at all ranges, the water column as well, as an automatic "
        "gain makes it, or noise that hides all echoes, and its pings have no altitude; expected "
        "altitudes, or a recording without automatic gain");
  if (stated_m.empty() && ranges.empty())
    throw RecordingError(
        "the recording shows no bottom line in most of its pings, and they have no altitude; "
        "expected a water column before the bed, or altitudes");
  const std::vector<Side> sides = line.sides();
  if (std::ranges::all_of(sides, [&](Side side) { return line.bed(side).doubtful(); }))
    throw RecordingError(fmt::format(
        "what lies before the bottom line is only {:.1f} dB darker than the bed behind it, as where "
        "noise hides the water column or where it was cut off, and most pings have no altitude; "
        "expected a water column that is {:.0f} dB darker or more, or altitudes",
        std::max(line.bed(sides.front()).water_darker_db, 0.0), clearly_darker_db));
  path.altitude_m = ranges.empty() ? moving_median(stated_m, 2) : ranges;
  if (!ranges.empty() && !path.pitch_rad.empty())
    for (std::size_t i = 0; i < pings; ++i) path.altitude_m[i] *= std::cos(path.pitch_rad[i]);
  const bool shown = !ranges.empty() &&
                     std::ranges::any_of(sides, [&](Side side) { return !line.bed(side).stated; });
  path.altitude = shown ? Evidence{Confidence::measured, "bottom line"}
                        : Evidence{Confidence::stated, "altitudes that they state"};
  const Values depths = column(line, &RecordedPing::depth_m);
  const double highest_m = std::ranges::max(path.altitude_m);
  if (!depths.empty()) {
    Values beds(pings);
    for (std::size_t i = 0; i < pings; ++i) beds[i] = depths[i] + path.altitude_m[i];
    path.bed_depth_m = median(std::move(beds));
    path.depth = {Confidence::stated,
                  fmt::format("depths of the pings and the {}", path.altitude.why)};
  } else {
    path.bed_depth_m = highest_m + 2.0;
    path.depth = {Confidence::assumed, "no depths: the sonar stays 2 m below the sea surface"};
  }
  path.bed_depth_m = std::max(path.bed_depth_m, highest_m + 0.5);
}

}  // namespace

bool begins_behind_edge(const RecordedPing& ping, std::size_t edge) {
  return ping.unrecorded > 0 && edge <= ping.unrecorded + bed_found_early;
}

double nearest_bed(const RecordedLine& line, std::size_t ping, std::size_t edge) {
  const RecordedPing& its = line.pings[ping];
  return begins_behind_edge(its, edge) && its.altitude_m && its.range_m > 0.0
             ? *its.altitude_m / its.range_m * static_cast<double>(line.samples)
             : static_cast<double>(edge);
}

Values first_bed_echoes_m(const LineWithBed& line) {
  const std::size_t pings = line.pings.size();
  std::vector<Values> found(pings);
  for (const Side side : line.sides()) {
    const std::vector<std::size_t>& bed = line.bed(side).edge;
    for (std::size_t i = 0; i < pings; ++i)
      if (bed[i] > 0 && bed[i] < line.samples && !begins_behind_edge(line.pings[i], bed[i]))
        found[i].push_back(line.sample_range_m(i, bed[i]));
  }
  constexpr double unlike_sides = 1.12, far_off = 0.25;
  MaybeValues nearest(pings);
  for (std::size_t i = 0; i < pings; ++i) {
    if (found[i].empty()) continue;
    const auto [low, high] = std::ranges::minmax(found[i]);
    nearest[i] = high > unlike_sides * low ? high : 0.5 * (low + high);
  }
  const Values whole = filled(nearest);
  if (whole.empty()) return {};
  for (std::size_t i = 0; i < pings; ++i)
    if (std::abs(whole[i] / usual_at(whole, i) - 1.0) > far_off) nearest[i].reset();
  return moving_median(filled(std::move(nearest)), 2);
}

VehiclePath vehicle_path(const LineWithBed& line) {
  VehiclePath path;
  set_times(line, path);
  set_attitude(line, path);
  set_places(line, path);
  set_altitudes(line, path);
  return path;
}

bool has_several_beams(const RecordedLine& line) {
  std::size_t repeated = 0;
  bool in_parts = false;
  for (std::size_t i = 1; i < line.pings.size(); ++i) {
    const std::optional<double> t_s = line.pings[i].t_s;
    if (line.pings[i].beam > 0) return true;
    if (!t_s) continue;
    repeated += t_s == line.pings[i - 1].t_s;
    in_parts = in_parts || *t_s != std::floor(*t_s);
  }
  return in_parts && 3 * repeated > line.pings.size();
}

double course_rad(const VehiclePath& path, std::size_t ping) {
  const std::size_t before = ping < 8 ? 0 : ping - 8,
                    after = std::min(ping + 8, path.x_m.size() - 1);
  return std::atan2(path.x_m[after] - path.x_m[before], path.y_m[after] - path.y_m[before]);
}

double heading_rad(const VehiclePath& path, std::size_t ping) {
  return path.heading_rad.empty() ? course_rad(path, ping) : path.heading_rad[ping];
}

Oscillation oscillation_of(double interval_s, const Values& values) {
  if (values.size() < 20 || !(interval_s > 0.0)) return {};
  constexpr double slow_s = 10.0;
  const auto reach = static_cast<std::size_t>(std::max(1.0, 0.5 * slow_s / interval_s));
  const Values slow = moving_mean(values, reach);
  const auto window = static_cast<std::size_t>(std::max(1.0, 30.0 / interval_s));
  Values windows;  // mean squares of the windows
  double squares = 0.0, crossings = 0.0, before = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double fast = values[i] - slow[i];
    squares += fast * fast;
    const std::size_t counted = i % window + 1;
    if (counted == window || (i + 1 == values.size() && windows.empty())) {
      windows.push_back(squares / static_cast<double>(counted));
      squares = 0.0;
    }
    if (fast > 0.0 && before < 0.0) crossings += 1.0;
    if (fast != 0.0) before = fast;
  }
  Oscillation found;
  found.rms = std::sqrt(median(std::move(windows)));
  if (crossings > 1.0)
    found.period_s = interval_s * static_cast<double>(values.size() - 1) / crossings;
  return found;
}

VehiclePath some_pings(const VehiclePath& path, const std::vector<std::size_t>& indices) {
  VehiclePath some = path;
  for (Values VehiclePath::*column :
       {&VehiclePath::t_s, &VehiclePath::x_m, &VehiclePath::y_m, &VehiclePath::altitude_m,
        &VehiclePath::roll_rad, &VehiclePath::pitch_rad, &VehiclePath::heading_rad}) {
    const Values& all = path.*column;
    (some.*column).clear();
    if (!all.empty())
      for (const std::size_t i : indices) (some.*column).push_back(all[i]);
  }
  return some;
}

}  // namespace ensonify::engine
