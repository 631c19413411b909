#include <ensonify/engine/recording/recording_reader.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <optional>
#include <tuple>

#include <fmt/format.h>

#include <ensonify/engine/recording/formats.h>
#include <ensonify/engine/recording/sides.h>
#include <ensonify/engine/recording/some_pings.h>
#include <ensonify/refine/read_file.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;

/// A format: the test of a file's first bytes, and the parser.
struct Format {
  bool (*is)(std::span<const std::byte> begin);
  std::vector<RecordedLine> (*parse)(std::span<const std::byte> bytes, std::string_view name);
};
constexpr std::array formats{Format{&is_xtf, &parse_xtf}, Format{&is_jsf, &parse_jsf}};

constexpr std::size_t begin_bytes = 1024;  // enough to identify the format

std::span<const std::byte> bytes_of(const std::string& content) {
  return std::as_bytes(std::span(content));
}

std::vector<std::size_t> all_pings(const RecordedLine& line) {
  std::vector<std::size_t> all(line.pings.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

/// The lexicographical order of the samples of two pings, side by side.
std::strong_ordering compare_samples(const RecordedLine& line, std::size_t a, std::size_t b) {
  for (const Side side : line.sides()) {
    const std::span<const float> one = line.row(side, a), other = line.row(side, b);
    for (std::size_t k = 0; k < one.size(); ++k)
      if (one[k] != other[k])
        return one[k] < other[k] ? std::strong_ordering::less : std::strong_ordering::greater;
  }
  return std::strong_ordering::equal;
}

bool has_echo(const RecordedLine& line, std::size_t ping) {
  return std::ranges::any_of(line.sides(), [&](Side side) {
    return std::ranges::any_of(line.row(side, ping), [](float value) { return value != 0.0f; });
  });
}

bool times_ascend(const RecordedLine& line, const std::vector<std::size_t>& order) {
  std::optional<double> before_s;
  for (const std::size_t i : order) {
    const std::optional<double>& t_s = line.pings[i].t_s;
    if (!t_s) continue;
    if (before_s && *t_s < *before_s) return false;
    before_s = t_s;
  }
  return true;
}

/// Leaves out repeated pings, with a warning: pings with the number, beam, time, range and samples
/// of an earlier ping. A ping stays if it has neither number nor time, or if all its samples are 0.
void leave_out_repeated(RecordedLine& line, std::string_view name) {
  const auto key = [&](std::size_t i) {
    const RecordedPing& ping = line.pings[i];
    return std::tuple(ping.number, ping.beam, ping.t_s, ping.samples, ping.range_m);
  };
  std::vector<std::size_t> order = all_pings(line);
  std::ranges::stable_sort(order, {}, key);
  const auto same_key = [&](std::size_t a, std::size_t b) { return key(a) == key(b); };
  if (std::ranges::adjacent_find(order, same_key) == order.end()) return;
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) {
    if (!same_key(a, b)) return key(a) < key(b);
    return compare_samples(line, a, b) < 0;
  });
  std::vector<bool> repeated(order.size(), false);
  for (std::size_t k = 1; k < order.size(); ++k) {
    const RecordedPing& ping = line.pings[order[k]];
    repeated[order[k]] = (ping.number > 0 || ping.t_s) && same_key(order[k - 1], order[k]) &&
                         compare_samples(line, order[k - 1], order[k]) == 0 &&
                         has_echo(line, order[k]);
  }
  std::vector<std::size_t> kept = all_pings(line);
  std::erase_if(kept, [&](std::size_t i) { return repeated[i]; });
  if (kept.size() == line.pings.size()) return;
  std::string warning = fmt::format(
      "{}: {} of {} pings are there before, with the same number, time and samples; "
      "left out",
      name, line.pings.size() - kept.size(), line.pings.size());
  line = some_pings(line, kept);
  line.warnings.push_back(std::move(warning));
}

/// Sorts the pings by number, with a warning, if their times do not ascend but do ascend after
/// sorting. If they do not ascend even then, a clock was set, and the order stays.
void put_in_order(RecordedLine& line, std::string_view name) {
  std::vector<std::size_t> order = all_pings(line);
  if (times_ascend(line, order)) return;
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return line.pings[i].number; });
  if (!times_ascend(line, order)) return;
  line = some_pings(line, order);
  line.warnings.push_back(
      fmt::format("{}: its pings are not in the order of their numbers and times; sorted", name));
}

/// Some recorders do not change the date at midnight. Where a time is about a day less than the
/// time before it, a day is added to this and the following times, until the date changes.
void pass_midnight(std::vector<RecordedPing>& pings) {
  constexpr double day_s = 86400.0, max_step_s = 7200.0;
  double added_s = 0.0;
  std::optional<double> before_s;
  for (RecordedPing& ping : pings) {
    if (!ping.t_s) continue;
    if (before_s) {
      const double step_s = *ping.t_s + added_s - *before_s;
      if (step_s >= -day_s && step_s <= max_step_s - day_s)
        added_s += day_s;
      else if (added_s > 0.0 && step_s >= day_s - max_step_s)  // the date has changed
        added_s -= day_s;
    }
    *ping.t_s += added_s;
    before_s = ping.t_s;
  }
}

void warn_of_times(RecordedLine& line, std::string_view name) {
  double latest_s = -std::numeric_limits<double>::infinity();
  std::size_t back = 0;
  for (const RecordedPing& ping : line.pings)
    if (ping.t_s) {
      back += *ping.t_s < latest_s;
      latest_s = std::max(latest_s, *ping.t_s);
    }
  if (back > 0)
    line.warnings.push_back(
        fmt::format("{}: {} of {} pings have times before those of earlier pings; a track leaves "
                    "them out, and an imitation uses evenly spaced times",
                    name, back, line.pings.size()));
}

/// Warns if the pings from `first` on, of the file `name`, begin before the latest earlier ping.
void warn_of_order(RecordedLine& line, std::size_t first, std::string_view name) {
  const std::span<const RecordedPing> pings = line.pings, next = pings.subspan(first);
  const auto latest =
      std::ranges::max_element(pings.first(first), {}, [](const auto& ping) { return ping.t_s; });
  const auto begin =
      std::ranges::find_if(next, [](const auto& ping) { return ping.t_s.has_value(); });
  if (begin != next.end() && begin->t_s < latest->t_s)
    line.warnings.push_back(
        fmt::format("{}: begins before the end of the files before it, expected files in their "
                    "order; a track leaves its earlier pings out, and an imitation uses evenly "
                    "spaced times",
                    name));
}

/// Appends the pings of `next`, a line of the file `name`.
void append(RecordedLine& line, RecordedLine next, std::string_view name) {
  const std::size_t samples = std::max(line.samples, next.samples);
  set_samples(line, samples);
  set_samples(next, samples);
  const auto join = [&](std::vector<float>& to, const std::vector<float>& more) {
    if (to.empty() && more.empty()) return;
    to.resize(line.pings.size() * samples, 0.0f);
    to.insert(to.end(), more.begin(), more.end());
    to.resize((line.pings.size() + next.pings.size()) * samples, 0.0f);
  };
  join(line.port, next.port);
  join(line.starboard, next.starboard);
  const std::size_t first = line.pings.size();
  line.pings.insert(line.pings.end(), next.pings.begin(), next.pings.end());
  line.warnings.insert(line.warnings.end(), next.warnings.begin(), next.warnings.end());
  leave_out_repeated(line, name);
  pass_midnight(line.pings);
  warn_of_order(line, first, name);
}

}  // namespace

bool is_recording(const fs::path& file) {
  const std::string begin = refine::begin_of_file(file, begin_bytes);
  return std::ranges::any_of(formats,
                             [&](const Format& format) { return format.is(bytes_of(begin)); });
}

std::vector<RecordedLine> parse_recording(std::span<const std::byte> bytes, std::string_view name) {
  const auto found =
      std::ranges::find_if(formats, [&](const Format& format) { return format.is(bytes); });
  if (found == formats.end())
    throw RecordingError(fmt::format("{}: is no recording, expected an XTF or a JSF file", name));
  std::vector<RecordedLine> lines = found->parse(bytes, name);
  for (RecordedLine& line : lines) {
    turn_reversed_sides(line, name);
    leave_out_repeated(line, name);
    put_in_order(line, name);
    pass_midnight(line.pings);
    warn_of_times(line, name);
  }
  return lines;
}

std::vector<RecordedLine> read_recording(const fs::path& file) {
  return parse_recording(bytes_of(refine::read_user_file<RecordingError>(file)), file.string());
}

std::vector<RecordedLine> read_recordings(std::span<const fs::path> files) {
  struct Part {
    std::string name;
    std::vector<RecordedLine> lines;
  };
  std::vector<Part> parts;
  for (const fs::path& file : files) {
    Part part{file.string(), read_recording(file)};
    if (!parts.empty()) {
      const std::vector<RecordedLine>& first = parts.front().lines;
      if (part.lines.size() != first.size() || part.lines.front().format != first.front().format)
        throw RecordingError(fmt::format(
            "{}: has {} lines of {}, and {} has {} of {}; expected files of one recording",
            part.name, part.lines.size(), part.lines.front().format, parts.front().name,
            first.size(), first.front().format));
    }
    const auto other = std::ranges::find_if(parts, [&](const Part& earlier) {
      return std::ranges::equal(earlier.lines, part.lines, are_sides_of_one);
    });
    if (other == parts.end()) {
      parts.push_back(std::move(part));
      continue;
    }
    for (std::size_t i = 0; i < part.lines.size(); ++i)
      join_sides(other->lines[i], part.lines[i], part.name);
  }
  std::vector<RecordedLine> lines;
  for (Part& part : parts) {
    for (std::size_t i = 0; i < lines.size(); ++i)
      append(lines[i], std::move(part.lines[i]), part.name);
    if (lines.empty()) lines = std::move(part.lines);
    part.lines.clear();
  }
  return lines;
}

}  // namespace ensonify::engine
