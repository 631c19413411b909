#include <ensonify/engine/base/random.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Random123/philox.h>

namespace ensonify::engine {
namespace {

// Converts 53 bits to a number in (0, 1]. It is never 0, so that its logarithm is finite.
double to_unit(std::uint64_t bits) { return (static_cast<double>(bits >> 11) + 1.0) * 0x1p-53; }

// Turns two uniform numbers into two independent standard normal ones.
void box_muller(double& a, double& b) {
  const double radius = std::sqrt(-2.0 * std::log(a));
  const double angle = 2.0 * std::numbers::pi * b;
  a = radius * std::cos(angle);
  b = radius * std::sin(angle);
}

}  // namespace

void RandomStream::uniform(std::span<double> out, std::uint64_t first) const {
  using Philox = r123::Philox4x64;
  const Philox::key_type key{{seed_, static_cast<std::uint64_t>(purpose_)}};
  const auto draw = [&](std::uint64_t block) {
    return Philox{}({{block, belongs_to_[0], belongs_to_[1], belongs_to_[2]}}, key);
  };
  constexpr std::size_t numbers = 4;  // numbers per block
  std::size_t i = 0;
  const auto take_some = [&](std::size_t end) {
    const Philox::ctr_type drawn = draw((first + i) / numbers);
    for (std::size_t k = (first + i) % numbers; i < end; ++i, ++k) out[i] = to_unit(drawn[k]);
  };
  const std::size_t before_block = (numbers - first % numbers) % numbers;
  if (before_block > 0 && !out.empty()) take_some(std::min(before_block, out.size()));
  for (; i + numbers <= out.size(); i += numbers) {
    const Philox::ctr_type drawn = draw((first + i) / numbers);
    for (std::size_t k = 0; k < numbers; ++k) out[i + k] = to_unit(drawn[k]);
  }
  if (i < out.size()) take_some(out.size());
}

void RandomStream::normal(std::span<double> out, std::uint64_t first) const {
  // Numbers 2k and 2k+1 are the cosine and the sine of one pair. Whole pairs are computed in place;
  // half of a pair is computed separately.
  std::array<double, 2> half{};
  std::size_t i = 0;
  if (first % 2 == 1 && !out.empty()) {
    uniform(half, first - 1);
    box_muller(half[0], half[1]);
    out[i++] = half[1];
  }
  const std::size_t pairs_end = i + (out.size() - i) / 2 * 2;
  uniform(out.subspan(i, pairs_end - i), first + i);
  for (; i < pairs_end; i += 2) box_muller(out[i], out[i + 1]);
  if (i < out.size()) {
    uniform(half, first + i);
    box_muller(half[0], half[1]);
    out[i] = half[0];
  }
}

void RandomStream::exponential(std::span<double> out, std::uint64_t first) const {
  uniform(out, first);
  for (double& x : out) x = -std::log(x);
}

std::size_t poisson_count(double mean, double uniform, std::size_t most) {
  std::size_t count = 0;
  for (double term = std::exp(-mean), below = term; uniform > below && count < most; below += term)
    term = term * mean / static_cast<double>(++count);
  return count;
}

}  // namespace ensonify::engine
