#include <ensonify/engine/run/parts.h>

#include <algorithm>
#include <functional>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

namespace ensonify::engine {
namespace {

constexpr double max_bytes_of_one_part = 1024.0 * 1024 * 1024;
constexpr double bytes_of_a_part = 64.0 * 1024 * 1024;
constexpr std::size_t step_pings = 64;  // the default size of a block: parts have whole blocks

}  // namespace

RunParts::RunParts(std::vector<std::size_t> first_pings, std::size_t pings)
    : first_pings_(std::move(first_pings)), pings_(pings) {
  const auto no_more = std::ranges::adjacent_find(first_pings_, std::ranges::greater_equal());
  if (first_pings_.empty() || first_pings_.front() != 0 || no_more != first_pings_.end() ||
      first_pings_.back() >= pings)
    throw std::invalid_argument("RunParts: a run or a part without pings");
}

std::size_t RunParts::longest() const {
  std::size_t longest = 0;
  for (std::size_t part = 0; part < count(); ++part) longest = std::max(longest, range(part).count);
  return longest;
}

PingRange RunParts::range(std::size_t part) const {
  const std::size_t first = first_pings_[part];
  return {first, (part + 1 < count() ? first_pings_[part + 1] : pings_) - first};
}

std::size_t RunParts::part_of(std::size_t ping) const {
  return static_cast<std::size_t>(std::ranges::upper_bound(first_pings_, ping) -
                                  first_pings_.begin()) -
         1;
}

std::string RunParts::number(std::size_t part) const {
  // All numbers of a run have the same width, so that names sort as parts do.
  const std::size_t digits = std::max<std::size_t>(4, fmt::formatted_size("{}", count()));
  return fmt::format("{:0{}}", part + 1, digits);
}

std::string RunParts::folder(std::size_t part) const { return "part_" + number(part); }

std::filesystem::path RunParts::file(std::size_t part, const std::string& sonar,
                                     std::string_view ending) const {
  return std::filesystem::path(folder(part)) / fmt::format("{}_{}{}", sonar, number(part), ending);
}

std::size_t pings_per_part(const OutputOptions& output, std::span<const Sonar> sonars,
                           std::size_t pings) {
  if (output.pings_per_file > 0)
    return std::min(pings, static_cast<std::size_t>(output.pings_per_file));
  if (image_bytes(sonars, pings) <= max_bytes_of_one_part) return pings;
  const double steps = bytes_of_a_part / image_bytes(sonars, step_pings);
  return step_pings * std::max<std::size_t>(1, static_cast<std::size_t>(steps));
}

RunParts equal_parts(std::size_t pings, std::size_t pings_per_part) {
  const std::size_t whole_run = 0;
  return parts_of_legs({&whole_run, 1}, pings, pings_per_part);
}

RunParts parts_of_legs(std::span<const std::size_t> leg_starts, std::size_t pings,
                       std::size_t pings_per_part) {
  if (pings_per_part == 0) throw std::invalid_argument("RunParts: a part without pings");
  std::vector<std::size_t> first_pings;
  for (std::size_t leg = 0; leg < leg_starts.size(); ++leg) {
    const std::size_t end = leg + 1 < leg_starts.size() ? leg_starts[leg + 1] : pings;
    for (std::size_t first = leg_starts[leg]; first < end; first += pings_per_part)
      first_pings.push_back(first);
  }
  return {std::move(first_pings), pings};
}

std::size_t pings_in_memory(const Scene& scene, const RunParts& parts, int threads) {
  const auto written = static_cast<std::size_t>(threads);
  const std::size_t of_parts = std::min(parts.pings(), parts.longest() * (written + 1));
  if (parts.count() == 1) return of_parts;
  return of_parts +
         std::min(parts.count(), written) * 2 * neighbour_pings(scene.display, scene.sonars);
}

}  // namespace ensonify::engine
