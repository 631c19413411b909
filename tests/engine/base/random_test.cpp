#include <ensonify/engine/base/random.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

#include "support/catch.h"

using namespace ensonify::engine;

namespace {

struct Moments {
  double mean = 0, variance = 0, skewness = 0, kurtosis = 0;
};

Moments moments(const std::vector<double>& x) {
  const auto n = static_cast<double>(x.size());
  Moments m{.mean = std::accumulate(x.begin(), x.end(), 0.0) / n};
  for (const double value : x) {
    const double d = value - m.mean;
    m.variance += d * d / n;
    m.skewness += d * d * d / n;
    m.kurtosis += d * d * d * d / n;
  }
  m.skewness /= std::pow(m.variance, 1.5);
  m.kurtosis /= m.variance * m.variance;
  return m;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b, std::size_t lag) {
  const Moments of_a = moments(a), of_b = moments(b);
  double sum = 0.0;
  for (std::size_t i = 0; i + lag < a.size(); ++i)
    sum += (a[i] - of_a.mean) * (b[i + lag] - of_b.mean);
  return sum / std::sqrt(of_a.variance * of_b.variance) / static_cast<double>(a.size() - lag);
}

}  // namespace

TEST_CASE("The generator is Philox4x64-10: the known answers of Random123 come out") {
  struct Case {
    std::array<std::uint64_t, 4> counter;
    std::array<std::uint64_t, 2> key;
    std::array<std::uint64_t, 4> answer;
  };
  const Case cases[] = {
      {{0, 0, 0, 0},
       {0, 0},
       {0x16554d9eca36314c, 0xdb20fe9d672d0fdc, 0xd7e772cee186176b, 0x7e68b68aec7ba23b}},
      {{0x243f6a8885a308d3, 0x13198a2e03707344, 0xa4093822299f31d0, 0x082efa98ec4e6c89},
       {0x452821e638d01377, 0xbe5466cf34e90c6c},
       {0xa528f45403e61d95, 0x38c72dbd566e9788, 0xa5a1610e72fd18b5, 0x57bd43b5e52b7fe6}}};
  for (const Case& c : cases) {
    const RandomStream stream(c.key[0], static_cast<Purpose>(c.key[1]),
                              {c.counter[1], c.counter[2], c.counter[3]});
    std::array<double, 4> drawn{};
    stream.uniform(drawn, 4 * c.counter[0]);
    for (std::size_t i = 0; i < 4; ++i)
      CHECK(drawn[i] == (static_cast<double>(c.answer[i] >> 11) + 1.0) / 9007199254740992.0);
  }
}

TEST_CASE("Uniform numbers fill 0 to 1 evenly and are not correlated") {
  std::vector<double> x(200000);
  RandomStream(1, Purpose::test).uniform(x);
  std::array<double, 50> bins{};
  for (const double value : x) {
    REQUIRE(value > 0.0);
    REQUIRE(value <= 1.0);
    bins[std::min<std::size_t>(49, static_cast<std::size_t>(value * 50.0))] += 1.0;
  }
  double chi2 = 0.0;
  for (const double count : bins) chi2 += (count - 4000.0) * (count - 4000.0) / 4000.0;
  CHECK(chi2 > 23.98);  // 49 degrees of freedom: 0.1 % and 99.9 %
  CHECK(chi2 < 85.35);
  for (const std::size_t lag : {1u, 2u, 3u, 4u, 8u}) CHECK(std::abs(correlation(x, x, lag)) < 0.01);
}

TEST_CASE("Normal numbers have the normal's moments and tails, and pairs are independent") {
  std::vector<double> x(400000);
  RandomStream(2, Purpose::test).normal(x);
  const Moments m = moments(x);
  CHECK(m.mean == Approx(0.0).margin(0.008));  // five standard errors each
  CHECK(m.variance == Approx(1.0).margin(0.012));
  CHECK(m.skewness == Approx(0.0).margin(0.02));
  CHECK(m.kurtosis == Approx(3.0).margin(0.04));
  double beyond_3 = 0.0;
  for (const double value : x) beyond_3 += std::abs(value) > 3.0;
  CHECK(beyond_3 / 400000.0 == Approx(0.0026998).margin(0.0004));
  std::vector<double> squares(x);
  for (double& value : squares) value *= value;
  for (const std::size_t lag : {1u, 2u, 3u}) {
    CHECK(std::abs(correlation(x, x, lag)) < 0.008);
    CHECK(std::abs(correlation(squares, squares, lag)) < 0.008);
  }
}

TEST_CASE("Exponential numbers have the exponential's moments") {
  std::vector<double> x(400000);
  RandomStream(3, Purpose::speckle).exponential(x);
  const Moments m = moments(x);
  CHECK(m.mean == Approx(1.0).margin(0.008));
  CHECK(m.variance == Approx(1.0).margin(0.025));
  CHECK(m.skewness == Approx(2.0).margin(0.1));
}

TEST_CASE("Counts of Poisson's distribution have its mean and its variance") {
  std::vector<double> uniform(100000);
  RandomStream(1, Purpose::test).uniform(uniform);
  for (const double mean : {0.3, 1.0, 7.5, 60.0}) {
    double sum = 0.0, squares = 0.0;
    for (const double u : uniform) {
      const auto count = static_cast<double>(poisson_count(mean, u, 200));
      sum += count;
      squares += count * count;
    }
    const auto n = static_cast<double>(uniform.size());
    CAPTURE(mean);
    CHECK(sum / n == Approx(mean).epsilon(0.01));
    CHECK(squares / n - std::pow(sum / n, 2) == Approx(mean).epsilon(0.02));
  }
  CHECK(poisson_count(60.0, 1.0, 5) == 5);
}

TEST_CASE("A number depends on its place in the stream and not on how it is fetched") {
  const RandomStream stream(7, Purpose::test, {1, 2, 3});
  std::vector<double> uniform(37), normal(37), exponential(37);
  stream.uniform(uniform);
  stream.normal(normal);
  stream.exponential(exponential);
  for (std::size_t first = 0; first < 37; ++first)
    for (std::size_t count = 0; first + count <= 37; ++count) {
      std::vector<double> u(count), n(count), e(count);
      stream.uniform(u, first);
      stream.normal(n, first);
      stream.exponential(e, first);
      for (std::size_t i = 0; i < count; ++i) {
        REQUIRE(u[i] == uniform[first + i]);
        REQUIRE(n[i] == normal[first + i]);
        REQUIRE(e[i] == exponential[first + i]);
      }
    }
}

TEST_CASE("Streams that differ in seed, purpose or owner are unrelated") {
  std::vector<double> x(50000), y(50000);
  RandomStream(7, Purpose::test, {1, 2, 3}).uniform(x);
  for (const RandomStream& other :
       {RandomStream(8, Purpose::test, {1, 2, 3}), RandomStream(7, Purpose::speckle, {1, 2, 3}),
        RandomStream(7, Purpose::test, {2, 2, 3}), RandomStream(7, Purpose::test, {1, 3, 3}),
        RandomStream(7, Purpose::test, {1, 2, 4})}) {
    other.uniform(y);
    CHECK(std::abs(correlation(x, y, 0)) < 0.02);
  }
}
