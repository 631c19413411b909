#include <ensonify/engine/trace/exact/exact_side.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace ensonify::engine {
namespace {

__extension__ using Wide = unsigned __int128;

// A number as an integer times a power of two.
struct Binary {
  bool negative;
  std::uint64_t integer;
  int exponent;
};
using BinaryVector = std::array<Binary, 3>;

// Integers with as many bits as the significands: 53 with exponents down to -1126 for doubles
// (the smallest denormal is 2^52 * 2^-1126), 24 and -172 for floats.
template <class Vector>
BinaryVector binary_of(const Vector& v) {
  constexpr int bits = std::numeric_limits<typename Vector::Scalar>::digits;
  BinaryVector out;
  for (std::size_t i = 0; i < 3; ++i) {
    int exponent = 0;
    const double fraction = std::frexp(std::abs(static_cast<double>(v[i])), &exponent);
    out[i] = {v[i] < 0, static_cast<std::uint64_t>(fraction * (std::uint64_t{1} << bits)),
              exponent - bits};
  }
  return out;
}

// A sum of products of three numbers without rounding: a fixed-point number in digits of 2^32 that
// covers the whole range (Kulisch's long accumulator), so nothing is lost to underflow or overflow.
// The lowest bit of a product of two doubles and a float is at least 2^-2424; with all of them
// within 1e18 < 2^60 none reaches 2^180.
class ExactSum {
 public:
  /// z must have at most 24 bits.
  void add(bool minus, const Binary& x, const Binary& y, const Binary& z) {
    if (x.integer == 0 || y.integer == 0 || z.integer == 0) return;
    const int place = x.exponent + y.exponent + z.exponent - lowest_exponent;
    const auto first = static_cast<std::size_t>(place / digit_bits);
    const std::uint64_t shifted = z.integer << (place % digit_bits);  // below 2^55
    const Wide both = Wide{x.integer} * y.integer;                    // below 2^106
    const bool negative = minus ^ x.negative ^ y.negative ^ z.negative;
    put(negative, first, Wide{static_cast<std::uint64_t>(both)} * shifted);
    put(negative, first + 2, (both >> 64) * shifted);
    lowest_ = std::min(lowest_, first);
  }

  int sign() const {
    std::int64_t carry = 0, any = 0;
    for (std::size_t i = lowest_; i < digits_.size(); ++i) {
      const std::int64_t digit = digits_[i] + carry;
      any |= digit & digit_mask;
      carry = digit >> digit_bits;
    }
    return carry < 0 ? -1 : any != 0;
  }

 private:
  static constexpr int digit_bits = 32;
  static constexpr std::int64_t digit_mask = 0xffffffff;
  static constexpr int lowest_exponent = -2424;
  static constexpr int highest_exponent = 180 + 5;  // of a sum of 18 products

  void put(bool negative, std::size_t first, Wide value) {
    for (std::size_t i = first; i < first + 4; ++i, value >>= digit_bits) {
      const auto digit = static_cast<std::int64_t>(static_cast<std::uint64_t>(value) & digit_mask);
      digits_[i] += negative ? -digit : digit;
    }
  }

  // Carries stay in the digits' upper halves until sign(); the last digits only ever receive zeros.
  std::array<std::int64_t, (highest_exponent - lowest_exponent) / digit_bits + 6> digits_{};
  std::size_t lowest_ = digits_.size();
};

// Adds (or subtracts) d . (b x c).
void add_determinant(ExactSum& sum, bool minus, const BinaryVector& d, const BinaryVector& b,
                     const BinaryVector& c) {
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    sum.add(minus, d[i], b[j], c[k]);
    sum.add(!minus, d[i], b[k], c[j]);
  }
}

// The sign of d . (u x v) for u = p - o and v = q - o in doubles; 0 if rounding may have changed
// it. Differences, products and sums err by 9 half units at most, relative to the sum of the
// absolute products; and by less than `denormal` where these are too small for a relative error.
int rounded_side(const Eigen::Vector3d& o, const Eigen::Vector3d& d, const Eigen::Vector3f& p,
                 const Eigen::Vector3f& q) {
  constexpr double relative = 2e-15, denormal = 1e-280;
  const Eigen::Vector3d u = p.cast<double>() - o, v = q.cast<double>() - o;
  double product = 0.0, sum = 0.0;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const double plus = d[i] * u[j] * v[k], minus = d[i] * u[k] * v[j];
    product += plus - minus;
    sum += std::abs(plus) + std::abs(minus);
  }
  if (!(std::abs(product) > relative * sum + denormal)) return 0;
  return product < 0.0 ? -1 : 1;
}

}  // namespace

// d . ((p - o) x (q - o)) = d . (p x q) - d . (o x q) + d . (o x p), linear in o: moving o by a
// unit along an axis adds the last two terms with o = that axis.
int exact_side(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
               const Eigen::Vector3f& from, const Eigen::Vector3f& to) {
  if (const int side = rounded_side(origin, direction, from, to)) return side;
  const BinaryVector d = binary_of(direction), p = binary_of(from), q = binary_of(to);
  const auto depend_on = [&](ExactSum& sum, const Eigen::Vector3d& at) {
    const BinaryVector o = binary_of(at);
    add_determinant(sum, true, d, o, q);
    add_determinant(sum, false, d, o, p);
  };
  ExactSum product;
  add_determinant(product, false, d, p, q);
  depend_on(product, origin);
  int sign = product.sign();
  for (int axis = 0; axis < 3 && sign == 0; ++axis) {
    ExactSum moved;
    depend_on(moved, Eigen::Vector3d::Unit(axis));
    sign = moved.sign();
  }
  return sign;
}

}  // namespace ensonify::engine
