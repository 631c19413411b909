#include <ensonify/engine/random.h>

#include <cmath>
#include <numbers>

#include <Random123/philox.h>

namespace ensonify::engine {
namespace {

// 53 bits to (0, 1]: never zero, so that its logarithm is finite.
double to_unit(std::uint64_t bits) { return (static_cast<double>(bits >> 11) + 1.0) * 0x1p-53; }

}  // namespace

void Stream::uniform(std::span<double> out, std::uint64_t first) const {
  using Philox = r123::Philox4x64;
  const Philox::key_type key{{seed_, static_cast<std::uint64_t>(purpose_)}};
  std::uint64_t drawn_block = ~std::uint64_t{0};
  Philox::ctr_type drawn{};
  for (std::size_t i = 0; i < out.size(); ++i) {
    const std::uint64_t index = first + i;
    if (index / 4 != drawn_block) {
      drawn_block = index / 4;
      drawn = Philox{}({{drawn_block, belongs_to_[0], belongs_to_[1], belongs_to_[2]}}, key);
    }
    out[i] = to_unit(drawn[index % 4]);
  }
}

void Stream::normal(std::span<double> out, std::uint64_t first) const {
  // Numbers 2k and 2k+1 are the cosine and sine of one Box-Muller pair.
  std::array<double, 2> pair{};
  for (std::size_t i = 0; i < out.size(); ++i) {
    const std::uint64_t index = first + i;
    if (i == 0 || index % 2 == 0) uniform(pair, index - index % 2);
    const double radius = std::sqrt(-2.0 * std::log(pair[0]));
    const double angle = 2.0 * std::numbers::pi * pair[1];
    out[i] = radius * (index % 2 == 0 ? std::cos(angle) : std::sin(angle));
  }
}

void Stream::exponential(std::span<double> out, std::uint64_t first) const {
  uniform(out, first);
  for (double& x : out) x = -std::log(x);
}

}  // namespace ensonify::engine
