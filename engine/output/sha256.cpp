#include <ensonify/engine/output/sha256.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <fmt/format.h>

#include <ensonify/engine/base/made_once.h>

namespace ensonify::engine {
namespace {

using Words = std::array<std::uint32_t, 64>;

/// The first 32 bits of the fractions of roots of the first 64 primes (FIPS 180-4, 4.2.2, 5.3.3).
Words fractions_of_roots(double (*root)(double)) {
  Words words{};
  std::size_t count = 0;
  for (unsigned n = 2; count < words.size(); ++n) {
    bool prime = true;
    for (unsigned d = 2; d * d <= n && prime; ++d) prime = n % d != 0;
    if (!prime) continue;
    // A root is below 18 and needs 5 + 32 bits; a double has 53.
    const double fraction = root(n) - std::floor(root(n));
    words[count++] = static_cast<std::uint32_t>(fraction * 0x1p32);
  }
  return words;
}

Words round_constants() {
  return fractions_of_roots([](double n) { return std::cbrt(n); });
}

class Sha256 {
 public:
  /// Adds a block of 64 bytes (6.2.2).
  void add(const unsigned char* block) {
    const Words& k = made_once<round_constants>();
    Words w{};
    for (std::size_t t = 0; t < 16; ++t)
      for (std::size_t i = 0; i < 4; ++i) w[t] = w[t] << 8 | block[4 * t + i];
    for (std::size_t t = 16; t < 64; ++t) {
      const std::uint32_t s0 = std::rotr(w[t - 15], 7) ^ std::rotr(w[t - 15], 18) ^ w[t - 15] >> 3;
      const std::uint32_t s1 = std::rotr(w[t - 2], 17) ^ std::rotr(w[t - 2], 19) ^ w[t - 2] >> 10;
      w[t] = w[t - 16] + s0 + w[t - 7] + s1;
    }
    auto [a, b, c, d, e, f, g, h] = hash_;
    for (std::size_t t = 0; t < 64; ++t) {
      const std::uint32_t t1 = h + (std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25)) +
                               ((e & f) ^ (~e & g)) + k[t] + w[t];
      const std::uint32_t t2 =
          (std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22)) + ((a & b) ^ (a & c) ^ (b & c));
      h = g, g = f, f = e, e = d + t1, d = c, c = b, b = a, a = t1 + t2;
    }
    const std::array sums{a, b, c, d, e, f, g, h};
    for (std::size_t i = 0; i < sums.size(); ++i) hash_[i] += sums[i];
  }
  std::string digits() const {
    std::string text;
    for (const std::uint32_t word : hash_) text += fmt::format("{:08x}", word);
    return text;
  }

 private:
  static std::array<std::uint32_t, 8> first_hash() {
    const Words words = fractions_of_roots([](double n) { return std::sqrt(n); });
    std::array<std::uint32_t, 8> hash{};
    for (std::size_t i = 0; i < hash.size(); ++i) hash[i] = words[i];
    return hash;
  }
  std::array<std::uint32_t, 8> hash_ = first_hash();
};

}  // namespace

std::string sha256(std::string_view bytes) {
  Sha256 hash;
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  std::size_t at = 0;
  for (; at + 64 <= bytes.size(); at += 64) hash.add(data + at);
  // The last blocks: the rest of the bytes, a set bit, zeros, and the length in bits (5.1.1).
  std::string rest(bytes.substr(at));
  rest += '\x80';
  rest.append((120 - rest.size() % 64) % 64, '\0');
  for (int shift = 56; shift >= 0; shift -= 8)
    rest += static_cast<char>(std::uint64_t{bytes.size()} * 8 >> shift & 0xff);
  for (at = 0; at < rest.size(); at += 64)
    hash.add(reinterpret_cast<const unsigned char*>(rest.data()) + at);
  return hash.digits();
}

}  // namespace ensonify::engine
