#include <ensonify/engine/recording/ping_order.h>

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <optional>
#include <tuple>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/recording/some_pings.h>

namespace ensonify::engine {
namespace {

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

}  // namespace

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

void put_in_order(RecordedLine& line, std::string_view name) {
  std::vector<std::size_t> order = all_pings(line);
  if (times_ascend(line, order)) return;
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return line.pings[i].number; });
  if (!times_ascend(line, order)) return;
  line = some_pings(line, order);
  line.warnings.push_back(
      fmt::format("{}: its pings are not in the order of their numbers and times; sorted", name));
}

}  // namespace ensonify::engine
