#include <array>
#include <cmath>
#include <limits>
#include <random>

#include <Eigen/Geometry>

#include "support/catch.h"

#include <ensonify/engine/trace/exact/exact_side.h>

using namespace ensonify::engine;
using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

__extension__ using Wide = __int128;

struct Case {
  Vector3d o, d;
  Vector3f p, q;

  int side() const { return exact_side(o, d, p, q); }
};

int sign_of(Wide x) { return (x > 0) - (x < 0); }

/// The sign with the origin actually moved, by (B^-1, B^-2, B^-3) with B = 2^14, in integers, that
/// is with everything times B^3. For components that are integers below 16.
int sign_by_moving(const Case& c) {
  constexpr Wide b = 1 << 14;
  std::array<Wide, 3> o{b * b, b, 1}, d, p, q;
  for (int i = 0; i < 3; ++i) {
    o[i] += static_cast<Wide>(c.o[i]) * b * b * b;
    d[i] = static_cast<Wide>(c.d[i]);
    p[i] = static_cast<Wide>(c.p[i]) * b * b * b - o[i];
    q[i] = static_cast<Wide>(c.q[i]) * b * b * b - o[i];
  }
  Wide sum = 0;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    sum += d[i] * (p[j] * q[k] - p[k] * q[j]);
  }
  return sign_of(sum);
}

/// The sign of the product alone, for components that are integers below 2^30.
int sign_of_product(const Case& c) {
  Wide sum = 0;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const auto at = [&](const Vector3f& v, int axis) {
      return static_cast<Wide>(v[axis]) - static_cast<Wide>(c.o[axis]);
    };
    sum += static_cast<Wide>(c.d[i]) * (at(c.p, j) * at(c.q, k) - at(c.p, k) * at(c.q, j));
  }
  return sign_of(sum);
}

Case random_case(std::mt19937& random, int below) {
  std::uniform_int_distribution<int> integer(-below, below);
  Case c;
  for (int i = 0; i < 3; ++i) {
    c.o[i] = integer(random), c.d[i] = integer(random);
    c.p[i] = static_cast<float>(integer(random)), c.q[i] = static_cast<float>(integer(random));
  }
  return c;
}

}  // namespace

TEST_CASE("a side is the sign that a small actual move of the ray gives") {
  std::mt19937 random(1);
  int ties = 0;
  for (int i = 0; i < 50000; ++i) {
    const Case c = random_case(random, 1 + i % 4);
    REQUIRE(c.side() == sign_by_moving(c));
    REQUIRE(exact_side(c.o, c.d, c.q, c.p) == -c.side());
    ties += sign_of_product(c) == 0;
  }
  CHECK(ties > 5000);
}

TEST_CASE("a side is right where double is wrong: large integers that nearly cancel") {
  std::mt19937 random(2);
  std::uniform_int_distribution<int> last(-1, 1);
  int wrong_in_double = 0;
  for (int i = 0; i < 20000; ++i) {
    Case c = random_case(random, 1 << 23);
    //   o --> d --> close by p + k (q - p)
    const Vector3d p = c.p.cast<double>(), q = c.q.cast<double>();
    c.o = p + (1 + i % 5) * (q - p) + 2.0 * c.d;
    for (int axis = 0; axis < 3; ++axis) c.o[axis] += last(random);
    const int expected = sign_of_product(c);
    if (expected != 0) REQUIRE(c.side() == expected);
    const double product = c.d.dot((p - c.o).cross(q - c.o));
    wrong_in_double += ((product > 0) - (product < 0)) != expected;
  }
  CHECK(wrong_in_double > 0);
}

// Stretching space along an axis, or the direction, by a power of two changes no side: so integers
// can test the whole domain.
TEST_CASE("a side is exact for the smallest denormals and for 1e18") {
  std::mt19937 random(3);
  std::uniform_int_distribution<int> of_space(-140, 50), of_direction(-930, 50);
  for (int i = 0; i < 20000; ++i) {
    Case c = random_case(random, 15);
    const int expected = c.side();
    c.d *= std::ldexp(1.0, of_direction(random));
    for (int axis = 0; axis < 3; ++axis) {
      const float stretch = std::ldexp(1.0f, of_space(random));
      c.o[axis] *= stretch, c.d[axis] *= stretch;
      c.p[axis] *= stretch, c.q[axis] *= stretch;
    }
    if (c.d.lpNorm<Eigen::Infinity>() <= 1e18) REQUIRE(c.side() == expected);
  }
}

// The product is linear in the origin: from a tie, the smallest move along an axis gives the sign
// of that axis' part, and so does a large one.
TEST_CASE("the smallest denormal decides a tie before the tie rule does") {
  std::mt19937 random(4);
  int decided = 0;
  for (int i = 0; i < 20000; ++i) {
    Case c = random_case(random, 2);
    c.o.setZero();
    if (sign_of_product(c) != 0) continue;
    for (int axis = 0; axis < 3; ++axis)
      for (const double way : {1.0, -1.0}) {
        Case far = c, near = c;
        far.o[axis] = way;
        near.o[axis] = way * std::numeric_limits<double>::denorm_min();
        if (sign_of_product(far) == 0) continue;
        near.d *= 0x1p-1073;
        REQUIRE(near.side() == sign_of_product(far));
        ++decided;
      }
  }
  CHECK(decided > 1000);
}

TEST_CASE("an edge along the ray, or without length, has no side") {
  const Vector3f p(1, 2, 3), q(2, 4, 3);
  CHECK(exact_side({5, 5, 5}, {1, 2, 0}, p, q) == 0);
  CHECK(exact_side({5, 5, 5}, {-0.5, -1, 0}, p, q) == 0);
  CHECK(exact_side({5, 5, 5}, {1, 2, 3}, p, p) == 0);
  CHECK(exact_side({5, 5, 5}, {1, std::nextafter(2.0, 3.0), 0}, p, q) != 0);
}
