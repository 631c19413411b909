#include <ensonify/engine/scene/tables/track_reader.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/base/csv_table.h>
#include <ensonify/engine/base/lower_case.h>
#include <ensonify/engine/base/units.h>
#include <ensonify/engine/recording/headings.h>
#include <ensonify/engine/recording/recording_reader.h>
#include <ensonify/engine/seafloor/bed/geographic.h>
#include <ensonify/engine/seafloor/bed/reference_map.h>

namespace ensonify::engine {
namespace {

enum TrackColumn : std::size_t {
  t_s,
  time_s,
  utc_s,
  x_m,
  y_m,
  easting_m,
  northing_m,
  lat_deg,
  lon_deg,
  z_m,
  depth_m,
  altitude_m,
  roll_deg,
  pitch_deg,
  heading_deg
};
constexpr std::array<CsvColumn, 15> track_columns{{{"t_s", false},
                                                   {"time_s", false},
                                                   {"utc_s", false},
                                                   {"x_m", false},
                                                   {"y_m", false},
                                                   {"easting_m", false},
                                                   {"northing_m", false},
                                                   {"lat_deg", false},
                                                   {"lon_deg", false},
                                                   {"z_m", false},
                                                   {"depth_m", false},
                                                   {"altitude_m", false, {}, true},
                                                   {"roll_deg", false},
                                                   {"pitch_deg", false},
                                                   {"heading_deg", false}}};
constexpr CsvFormat track_format{.row = "pose", .columns = track_columns};
constexpr double farthest_m = 1e9, longest_s = 1e12;  // larger values are refused as meaningless

/// The column of recordings with this name; null if recordings have none.
const PingColumn* recorded_column(std::string_view name) {
  const auto found = std::ranges::find(ping_columns(), name, &PingColumn::name);
  return found == ping_columns().end() ? nullptr : &*found;
}

/// A number of a ping whose beams have separate packets: the middle between its outermost beams.
std::optional<double> middle_value(const PingColumn& column, const RecordedPing& rear,
                                   const RecordedPing& front) {
  const std::optional<double> from = column.value(rear), to = column.value(front);
  if (!from || !to) return std::nullopt;
  const bool is_angle = column.name.ends_with("_deg");
  return *from + 0.5 * (is_angle ? std::remainder(*to - *from, 360.0) : *to - *from);
}

/// The time and the outermost beams of one ping; one beam twice if the ping has one packet.
struct PingBeams {
  double t_s;
  const RecordedPing *rear, *front;
};

/// The values of a column for all pings; NaN for pings that do not state it.
std::vector<double> recorded_values(const PingColumn& column, std::span<const PingBeams> pings) {
  std::vector<double> values;
  for (const auto& [t_s, rear, front] : pings)
    values.push_back(
        middle_value(column, *rear, *front).value_or(std::numeric_limits<double>::quiet_NaN()));
  return values;
}

/// Replaces NaN by linear interpolation in time between the values before and after it. At least
/// one value must be known.
void fill_gaps(std::vector<double>& values, std::span<const PingBeams> pings, bool is_angle_deg) {
  const auto begin = values.begin();
  auto last = std::ranges::find_if_not(values, [](double value) { return std::isnan(value); });
  std::fill(begin, last, *last);
  const auto time_s = [&](auto at) { return pings[static_cast<std::size_t>(at - begin)].t_s; };
  for (auto next = last + 1; next != values.end(); ++next) {
    if (std::isnan(*next)) continue;
    const double change = is_angle_deg ? std::remainder(*next - *last, 360.0) : *next - *last;
    for (auto at = last + 1; at != next; ++at)
      *at = *last + change * (time_s(at) - time_s(last)) / (time_s(next) - time_s(last));
    last = next;
  }
  std::fill(last + 1, values.end(), *last);
}

/// The navigation of a recording's first line: its pings that have a place, and a time later than
/// that of all earlier pings. If some of them lack a height or an angle, it is interpolated; if
/// most of them lack it, it is left out.
CsvTable navigation_table(const std::filesystem::path& file, Vertical vertical,
                          std::vector<std::string>& warnings) {
  RecordedLine line;
  try {
    line = std::move(read_recording(file).front());
  } catch (const RecordingError& error) {
    throw SceneError(error.what());
  }
  warnings = line.warnings;
  const ChosenHeadings headings = choose_headings(line);
  if (!headings.instead.empty())
    warnings.push_back(fmt::format("{}: {}", file.string(), headings.instead));
  for (std::size_t i = 0; i < line.pings.size(); ++i) line.pings[i].heading_rad = headings.rad[i];
  std::vector<PingBeams> pings;
  std::vector<int> numbers;
  std::size_t not_after = 0, nowhere = 0;
  for (std::size_t i = 0; i < line.pings.size(); ++i) {
    const RecordedPing& ping = line.pings[i];
    if (!ping.t_s || !(ping.place || ping.place_m)) {
      ++nowhere;
      continue;
    }
    if (!pings.empty() && !(*ping.t_s > pings.back().t_s)) {
      RecordedPing const*& front = pings.back().front;
      if (*ping.t_s == pings.back().t_s && ping.beam > front->beam)
        front = &ping;
      else
        ++not_after;
      continue;
    }
    pings.push_back({*ping.t_s, &ping, &ping});
    numbers.push_back(static_cast<int>(i + 1));
  }
  if (not_after > 0)
    warnings.push_back(
        fmt::format("{}: {} of its {} pings are left out, because their times are not after those "
                    "before (an XTF has hundredths of a second)",
                    file.string(), not_after, line.pings.size()));
  if (pings.empty())
    throw SceneError(fmt::format(
        "{}: none of its {} pings has a time and a position, so it is no track; give a CSV file",
        file.string(), line.pings.size()));
  if (nowhere > 0)
    warnings.push_back(
        fmt::format("{}: {} of its {} pings have no time or no position and are left "
                    "out; the track goes on between the others",
                    file.string(), nowhere, line.pings.size()));
  std::vector<bool> has;
  std::vector<double> values(pings.size() * track_columns.size(), 0.0);
  for (std::size_t i = 0; i < track_columns.size(); ++i) {
    const std::string_view name = track_columns[i].name;
    has.push_back(false);
    const PingColumn* const column = recorded_column(name);
    if (!column) continue;
    std::vector<double> of_pings = recorded_values(*column, pings);
    const auto lacking = static_cast<std::size_t>(
        std::ranges::count_if(of_pings, [](double value) { return std::isnan(value); }));
    if (lacking == pings.size()) continue;
    // All pings have a place of the same kind, or this column is not used. If a depth is kept, an
    // altitude has no effect.
    const bool needed =
        i >= z_m && !(i == altitude_m && has[depth_m] && vertical == Vertical::depth);
    if (lacking > 0 && !needed) continue;
    has.back() = 2 * lacking <= pings.size();
    if (lacking > 0)
      warnings.push_back(fmt::format("{}: {} of its {} pings have no {}, which is {}",
                                     file.string(), lacking, pings.size(), name,
                                     has.back() ? "interpolated between the others" : "not used"));
    if (!has.back()) continue;
    fill_gaps(of_pings, pings, name.ends_with("_deg"));
    for (std::size_t row = 0; row < pings.size(); ++row)
      values[row * track_columns.size() + i] = of_pings[row];
  }
  return CsvTable::of(file.string(), std::move(has), std::move(values), std::move(numbers));
}

class TrackReader {
 public:
  TrackReader(const CsvTable& table, std::string_view name, const TrackOptions& track,
              const LocalFrame& frame)
      : table_(table), name_(name), track_(track), frame_(frame) {}

  NavigationLog read() {
    read_times();
    log_.roll_rad = angles(roll_deg);
    log_.pitch_rad = angles(pitch_deg);
    log_.heading_rad = angles(heading_deg);
    read_places();
    warn_of_other_names();
    for (double& x : log_.x_m) x += track_.middle_east_m;
    for (double& y : log_.y_m) y += track_.middle_north_m;
    if (table_.has(z_m)) {
      log_.z_m = column(z_m, farthest_m);
    } else if (table_.has(depth_m)) {
      log_.z_m = column(depth_m, farthest_m);
      for (double& z : log_.z_m) z = -z;
    }
    // The table of a run has height and altitude; over a hole the altitude is empty.
    const bool needed = log_.z_m.empty() || track_.vertical == Vertical::altitude;
    if (table_.has(altitude_m) && (needed || is_complete(altitude_m)))
      log_.altitude_m = column(altitude_m, farthest_m);
    return std::move(log_);
  }

 private:
  [[noreturn]] void fail(std::string_view what) const {
    throw SceneError(fmt::format("{}: {}", name_, what));
  }

  std::vector<double> column(TrackColumn number, double largest) const {
    std::vector<double> values;
    for (std::size_t row = 0; row < table_.rows(); ++row) {
      values.push_back(table_.at(row, number));
      if (std::isnan(values.back()))
        throw table_.fault(
            row, fmt::format("{} is empty, expected a number", track_columns[number].name));
      if (!(std::abs(values.back()) <= largest))
        throw table_.fault(row, fmt::format("{} is {}, expected {:g} at most",
                                            track_columns[number].name, values.back(), largest));
    }
    return values;
  }

  bool is_complete(TrackColumn number) const {
    for (std::size_t row = 0; row < table_.rows(); ++row)
      if (std::isnan(table_.at(row, number))) return false;
    return true;
  }

  std::vector<double> angles(TrackColumn number) const {
    if (!table_.has(number)) return {};
    std::vector<double> values = column(number, 36000.0);
    for (double& value : values) value *= degree;
    return values;
  }

  bool has_both(TrackColumn one, TrackColumn other) const {
    if (table_.has(one) && table_.has(other)) return true;
    if (!table_.has(one) && !table_.has(other)) return false;
    const bool first = table_.has(one);
    fail(fmt::format("there is a column {} and no {}, expected both",
                     track_columns[first ? one : other].name,
                     track_columns[first ? other : one].name));
  }

  void read_times() {
    const std::array times{t_s, time_s, utc_s};
    const auto found =
        std::ranges::find_if(times, [&](TrackColumn number) { return table_.has(number); });
    if (found == times.end())
      fail("no column of times in the header row, expected t_s (or time_s, or utc_s)");
    log_.t_s = column(*found, longest_s);
    for (std::size_t row = 1; row < log_.t_s.size(); ++row)
      if (!(log_.t_s[row] > log_.t_s[row - 1]))
        throw table_.fault(
            row, fmt::format("{} is {}, not after {} of the row before, expected times "
                             "that ascend",
                             track_columns[*found].name, log_.t_s[row], log_.t_s[row - 1]));
  }

  void read_places() {
    if (has_both(x_m, y_m)) {
      log_.x_m = column(x_m, farthest_m);
      log_.y_m = column(y_m, farthest_m);
    } else if (has_both(easting_m, northing_m)) {
      if (!frame_.has_world)
        fail(
            "easting_m and northing_m are of a survey's world, and a generated seabed has none; "
            "give x_m and y_m, metres east and north of the seabed's middle");
      log_.x_m = column(easting_m, farthest_m);
      log_.y_m = column(northing_m, farthest_m);
      for (double& x : log_.x_m) x -= frame_.world_origin.x();
      for (double& y : log_.y_m) y -= frame_.world_origin.y();
    } else if (has_both(lat_deg, lon_deg)) {
      project();
    } else {
      fail(
          "no columns of places in the header row, expected x_m,y_m or easting_m,northing_m or "
          "lat_deg,lon_deg");
    }
  }

  void project() {
    const std::vector<double> latitude_deg = column(lat_deg, 90.0);
    const std::vector<double> longitude_deg = column(lon_deg, 360.0);
    const std::function<MapPlace(const GeographicPlace&)> onto_map =
        map_for(latitude_deg, longitude_deg);
    for (std::size_t row = 0; row < table_.rows(); ++row) {
      MapPlace map;
      try {
        map = onto_map({latitude_deg[row] * degree, longitude_deg[row] * degree});
      } catch (const std::invalid_argument& error) {
        throw table_.fault(row, error.what());
      }
      log_.x_m.push_back(map.place.x());
      log_.y_m.push_back(map.place.y());
      if (!log_.heading_rad.empty()) log_.heading_rad[row] -= map.convergence_rad;
    }
  }

  /// Warns about unknown columns that may be a missing column under another name.
  void warn_of_other_names() {
    struct Name {
      std::string_view begin;
      TrackColumn column;
    };
    constexpr std::array<Name, 8> names{{{"'z", z_m},
                                         {"'depth", depth_m},
                                         {"'alt", altitude_m},
                                         {"'roll", roll_deg},
                                         {"'pitch", pitch_deg},
                                         {"'head", heading_deg},
                                         {"'hdg", heading_deg},
                                         {"'yaw", heading_deg}}};
    const bool has_height = table_.has(z_m) || table_.has(depth_m) || table_.has(altitude_m);
    for (const std::string& quoted : table_.unknown()) {
      const std::string lower = lower_case(quoted);
      for (const Name& name : names) {
        const bool height = name.column < roll_deg;
        if (table_.has(name.column) || (height && has_height) || !lower.starts_with(name.begin))
          continue;
        if (name.column == z_m && std::isalpha(static_cast<unsigned char>(lower[2]))) continue;
        log_.warnings.push_back(
            fmt::format("{}: its column {} is not read; if it is {}, name it so", name_, quoted,
                        track_columns[name.column].name));
      }
    }
  }

  std::function<MapPlace(const GeographicPlace&)> map_for(
      const std::vector<double>& latitude_deg, const std::vector<double>& longitude_deg) {
    const MapOfPlace onto_world =
        frame_.utm_zone != 0 ? [zone = frame_.utm_zone](
                                   const GeographicPlace& where) { return utm_place(where, zone); }
                             : map_of_reference(frame_.reference);
    if (onto_world)
      return [this, onto_world](const GeographicPlace& where) {
        MapPlace map = onto_world(where);
        map.place -= frame_.world_origin.head<2>();
        return map;
      };
    if (track_.origin_latitude_rad && track_.origin_longitude_rad)
      return tangent_plane({*track_.origin_latitude_rad, *track_.origin_longitude_rad});
    if (frame_.has_world)
      fail(
          "lat_deg and lon_deg cannot be put onto this seabed, whose file gives no coordinate "
          "reference system for its metres: give easting_m,northing_m, or the "
          "place of the seabed's middle as track.origin_lat_deg and track.origin_lon_deg");
    const auto middle_rad = [](const std::vector<double>& values) {
      const auto [low, high] = std::ranges::minmax(values);
      return 0.5 * (low + high) * degree;
    };
    // -180 to 180, also for a track over the meridian of 180 degrees
    std::vector<double> off_first_deg;
    for (const double longitude : longitude_deg)
      off_first_deg.push_back(std::remainder(longitude - longitude_deg.front(), 360.0));
    const GeographicPlace middle{middle_rad(latitude_deg),
                                 longitude_deg.front() * degree + middle_rad(off_first_deg)};
    log_.origin = middle;
    return tangent_plane(middle);
  }

  static std::function<MapPlace(const GeographicPlace&)> tangent_plane(
      const GeographicPlace& origin) {
    return [origin](const GeographicPlace& where) { return tangent_place(where, origin); };
  }

  const CsvTable& table_;
  std::string_view name_;
  const TrackOptions& track_;
  const LocalFrame& frame_;
  NavigationLog log_;
};

}  // namespace

NavigationLog parse_track(std::string_view text, std::string_view name, const TrackOptions& track,
                          const LocalFrame& frame) {
  return TrackReader(CsvTable::parse(text, name, track_format), name, track, frame).read();
}

NavigationLog read_track(const TrackOptions& track, const LocalFrame& frame) {
  const std::filesystem::path& file = track.file.path;
  std::vector<std::string> warnings;
  const CsvTable table = is_recording(file) ? navigation_table(file, track.vertical, warnings)
                                            : CsvTable::read(file, track_format);
  NavigationLog log = TrackReader(table, file.string(), track, frame).read();
  log.warnings.insert(log.warnings.begin(), warnings.begin(), warnings.end());
  return log;
}

}  // namespace ensonify::engine
