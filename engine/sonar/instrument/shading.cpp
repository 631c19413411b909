#include <ensonify/engine/sonar/instrument/shading.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/sonar/instrument/sinc.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

using std::numbers::pi;
constexpr std::size_t known_nulls = 32;  // more than a sonar's side lobes
constexpr double farthest_x = 512.0;     // where a search for a null ends

/// Amplitude of the main lobe divided by the amplitude of the side lobes.
double lobe_ratio(double side_lobe_db) { return scatter::amplitude_from_db(-side_lobe_db); }

/// A^2 of Taylor's line source.
double taylor_a2(double side_lobe_db) {
  const double a = std::acosh(lobe_ratio(side_lobe_db)) / pi;
  return a * a;
}

/// The Chebyshev polynomial of a degree, at z >= -1.
double chebyshev_polynomial(int degree, double z) {
  return std::abs(z) <= 1.0 ? std::cos(degree * std::acos(z)) : std::cosh(degree * std::acosh(z));
}

/// Where a function is least that has one minimum between a and b.
template <class F>
double place_of_minimum(F&& f, double a, double b) {
  for (int i = 0; i < 50; ++i) {
    const double third = (b - a) / 3.0;
    if (f(a + third) < f(b - third))
      b -= third;
    else
      a += third;
  }
  return 0.5 * (a + b);
}

}  // namespace

Shading Shading::hann() {
  Shading made;
  made.waves_ = {0.5};
  made.find_nulls();
  return made;
}

int Shading::min_nbar(double side_lobe_db) {
  return static_cast<int>(std::lround(2.0 * taylor_a2(side_lobe_db) + 0.5));
}

Shading Shading::taylor(double side_lobe_db, int nbar) {
  if (nbar < min_nbar(side_lobe_db))
    throw std::invalid_argument(
        fmt::format("Taylor's side lobes of {} dB need an nbar of {} or more, and it is {}",
                    side_lobe_db, min_nbar(side_lobe_db), nbar));
  const double a2 = taylor_a2(side_lobe_db);
  const double sigma2 = nbar * nbar / (a2 + (nbar - 0.5) * (nbar - 0.5));
  Shading made;
  for (int m = 1; m < nbar; ++m) {
    double over = 1.0, under = 1.0;
    for (int n = 1; n < nbar; ++n) {
      over *= 1.0 - m * m / (sigma2 * (a2 + (n - 0.5) * (n - 0.5)));
      if (n != m) under *= 1.0 - double(m * m) / double(n * n);
    }
    made.waves_.push_back((m % 2 == 1 ? 0.5 : -0.5) * over / under);
  }
  made.find_nulls();
  return made;
}

// The sum of w_n exp(i psi (n - (N - 1) / 2)) over N elements is T(z0 cos(psi / 2)), where T is the
// Chebyshev polynomial of degree N - 1. The weights are its Fourier coefficients, from N values of
// psi.
Shading Shading::chebyshev(double side_lobe_db) {
  constexpr int elements = chebyshev_elements, degree = elements - 1;
  const double z0 = std::cosh(std::acosh(lobe_ratio(side_lobe_db)) / degree);
  std::vector<double> weights;
  for (int n = 0; n < elements; ++n) {
    const double place = n - 0.5 * degree;
    double sum = chebyshev_polynomial(degree, z0);
    for (int k = 1; k < elements / 2; ++k)
      sum += 2.0 * chebyshev_polynomial(degree, z0 * std::cos(pi * k / elements)) *
             std::cos(2.0 * pi * k * place / elements);
    weights.push_back(sum);
  }
  for (int n = 0; n < elements / 2; ++n)  // symmetric to the last bit
    weights[static_cast<std::size_t>(degree - n)] = weights[static_cast<std::size_t>(n)];
  return of_weights(weights);
}

Shading Shading::of_weights(std::span<const double> weights) {
  if (weights.empty())
    throw std::invalid_argument("there are no weights, expected one for each element");
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  if (!(sum > 0.0))
    throw std::invalid_argument(
        fmt::format("the sum of the weights is {}, expected more than 0", sum));
  for (std::size_t i = 0; i < weights.size(); ++i)
    if (const double other = weights[weights.size() - 1 - i];
        !(std::abs(weights[i] - other) <= 1e-6 * std::abs(weights[i])))
      throw std::invalid_argument(
          fmt::format("weight {} is {} from one end and {} from the other, expected the same",
                      i + 1, weights[i], other));
  Shading made;
  if (std::ranges::all_of(weights, [&](double w) { return w == weights[0]; })) return made;
  for (const double w : weights)
    made.elements_.push_back(w * static_cast<double>(weights.size()) / sum);
  made.find_nulls();
  return made;
}

double Shading::at(double u) const {
  if (!elements_.empty()) {
    const double place = (u + 0.5) * static_cast<double>(elements_.size());
    const double border = std::round(place);
    const auto weight = [&](double number) {
      const double last = static_cast<double>(elements_.size() - 1);
      return elements_[static_cast<std::size_t>(std::clamp(number, 0.0, last))];
    };
    if (std::abs(place - border) < 1e-6) return 0.5 * (weight(border - 1.0) + weight(border));
    return weight(std::floor(place));
  }
  if (waves_.empty()) return 1.0;
  const double turn = std::cos(2.0 * pi * u);  // and cos(2 pi m u) by recurrence
  double before = 1.0, now = turn, sum = 1.0;
  for (const double wave : waves_) {
    sum += 2.0 * wave * now;
    const double next = 2.0 * turn * now - before;
    before = now;
    now = next;
  }
  return sum;
}

double Shading::far_field(double x) const {
  if (!elements_.empty()) {
    const auto count = static_cast<double>(elements_.size());
    double sum = 0.0;
    for (std::size_t i = 0; i < elements_.size(); ++i)
      sum += elements_[i] * std::cos(2.0 * pi * x * ((static_cast<double>(i) + 0.5) / count - 0.5));
    return sum / count * sinc(x / count);
  }
  double sum = sinc(x);
  for (std::size_t i = 0; i < waves_.size(); ++i) {
    const auto m = static_cast<double>(i + 1);
    sum += waves_[i] * (sinc(x - m) + sinc(x + m));
  }
  return sum;
}

std::complex<double> Shading::field(double x, double nearness) const {
  if (std::abs(nearness) < 1e-3) return far_field(x);
  // A step of Simpson's rule is at most an eighth of the fastest turn of the phase, and a
  // sixteenth where side lobes may be low.
  const int least = 32 + 2 * static_cast<int>(4.0 * (std::abs(nearness) + std::abs(x)));
  const int steps = uniform() ? least : whole_steps(2 * least);
  // Both halves of the array give the same, so the sum is over u = k / steps from the middle to one
  // end. The turns by 2 pi F u^2 and the cosines of 2 pi x u follow by recurrences.
  const int half = steps / 2;
  const double du = 1.0 / steps;
  const std::complex<double> turn_of_turn = std::polar(1.0, 4.0 * pi * nearness * du * du);
  std::complex<double> turned = 1.0, turn = std::polar(1.0, 2.0 * pi * nearness * du * du),
                       sum = 0.0;
  const double cos_step = std::cos(2.0 * pi * x * du);
  double cosine = 1.0, cosine_before = cos_step;
  for (int k = 0; k <= half; ++k) {
    const double rule = k == half ? 1.0 : (half + k) % 2 == 1 ? 4.0 : 2.0;
    sum += (k == 0 ? 1.0 : 2.0) * rule * at(k * du) * cosine * turned;
    turned *= turn;
    turn *= turn_of_turn;
    cosine_before = std::exchange(cosine, 2.0 * cos_step * cosine - cosine_before);
  }
  return sum * (du / 3.0);
}

double Shading::null_x(int number) const {
  const auto last = static_cast<int>(nulls_.size());
  if (number <= 0) return 0.0;
  if (uniform()) return number;
  return number <= last ? nulls_[static_cast<std::size_t>(number - 1)]
                        : nulls_.back() + (number - last);
}

// Nulls, and dips that do not reach zero, are where the power is least between two lobes.
void Shading::find_nulls() {
  constexpr double step = 1.0 / 32.0;
  const auto power = [&](double x) {
    const double amplitude = far_field(x);
    return amplitude * amplitude;
  };
  double before = power(0.0), here = power(step);
  for (double x = step; x < farthest_x && nulls_.size() < known_nulls; x += step) {
    const double next = power(x + step);
    if (here < before && here <= next)
      nulls_.push_back(place_of_minimum(power, x - step, x + step));
    before = here;
    here = next;
  }
  if (nulls_.empty()) nulls_.push_back(farthest_x);
}

double Shading::beam_width_x() const {
  if (uniform()) return 0.886;  // Urick, Principles of Underwater Sound (1983), table 3.2
  double inside = 0.0, outside = null_x(1);
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (inside + outside), amplitude = far_field(middle);
    (amplitude * amplitude > 0.5 ? inside : outside) = middle;
  }
  return 2.0 * inside;
}

double Shading::noise_width_x() const {
  double sum = 0.0;
  if (!elements_.empty()) {
    for (const double w : elements_) sum += w * w;
    return sum / static_cast<double>(elements_.size());
  }
  for (const double wave : waves_) sum += wave * wave;
  return 1.0 + 2.0 * sum;
}

int Shading::whole_steps(int steps) const {
  if (elements_.empty()) return steps;
  const int unit = 2 * static_cast<int>(elements_.size());
  return (steps + unit - 1) / unit * unit;
}

}  // namespace ensonify::engine
