#include <ensonify/engine/run/parts.h>

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

namespace ensonify::engine {
namespace {

constexpr double max_bytes_of_one_part = 1024.0 * 1024 * 1024;
constexpr double bytes_of_a_part = 64.0 * 1024 * 1024;
constexpr std::size_t step_pings = 64;  // parts of whole blocks of the default size

}  // namespace

RunParts::RunParts(std::size_t pings, std::size_t pings_per_part)
    : pings_(pings), pings_per_part_(pings_per_part) {
  if (pings == 0 || pings_per_part == 0)
    throw std::invalid_argument("RunParts: a run or a part without pings");
}

std::size_t RunParts::count() const { return (pings_ + pings_per_part_ - 1) / pings_per_part_; }

PingRange RunParts::range(std::size_t part) const {
  const std::size_t first = part * pings_per_part_;
  return {first, std::min(pings_per_part_, pings_ - first)};
}

std::string RunParts::number(std::size_t part) const {
  // All numbers of a run have the same width, so that names sort as parts do.
  const std::size_t digits = std::max<std::size_t>(4, fmt::formatted_size("{}", count()));
  return fmt::format("{:0{}}", part + 1, digits);
}

std::string RunParts::folder(std::size_t part) const { return "part_" + number(part); }

std::size_t pings_per_part(const OutputOptions& output, std::span<const Sonar> sonars,
                           std::size_t pings) {
  if (output.pings_per_file > 0)
    return std::min(pings, static_cast<std::size_t>(output.pings_per_file));
  if (image_bytes(sonars, pings) <= max_bytes_of_one_part) return pings;
  const double steps = bytes_of_a_part / image_bytes(sonars, step_pings);
  return step_pings * std::max<std::size_t>(1, static_cast<std::size_t>(steps));
}

}  // namespace ensonify::engine
