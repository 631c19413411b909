#include <ensonify/engine/sonar/reception/one_way_beams.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace ensonify::engine {
namespace {

constexpr double tables_per_octave = 4.0;
constexpr int columns = 256;
constexpr int farthest_null = 8, main_null = 2;
constexpr std::size_t overlap_steps = 32;

}  // namespace

OneWayBeams::OneWayBeams(const Sonar& sonar, double wavelength_m, double farthest_m)
    : nearest_m_(0.5 * (sonar.array_length_m + sonar.receive_length_m())) {
  const std::array arrays{sonar.transmit_array(wavelength_m), sonar.receive_array(wavelength_m)};
  const auto last = static_cast<int>(
      std::ceil(tables_per_octave * std::log2(std::max(farthest_m / nearest_m_, 2.0))));
  for (int i = 0; i <= last; ++i) {
    const double range_m = nearest_m_ * std::exp2(i / tables_per_octave);
    const std::array defocus{sonar.transmit_defocus(range_m), sonar.defocus(range_m)};
    const auto widest_m = [&](int null) {
      double widest = 0.0;
      for (const std::size_t i : {transmitter, receiver})
        widest = std::max(
            widest, arrays[i].half_width_m(arrays[i].shading.null_x(null), range_m, defocus[i]));
      return widest;
    };
    Row row{.range_m = range_m,
            .main_m = widest_m(main_null),
            .reach_m = widest_m(farthest_null),
            .power = {},
            .width_m = {}};
    const bool same = arrays[0] == arrays[1] && defocus[0] == defocus[1];
    for (const std::size_t i : {transmitter, receiver}) {
      const LineArray& array = arrays[i];
      for (int column = 0; column <= columns && !(same && i == receiver); ++column) {
        const double x = array.length_m / (wavelength_m * range_m) * row.reach_m * column / columns;
        row.power[i].push_back(static_cast<float>(
            std::norm(array.shading.field(x, array.nearness(range_m, defocus[i])))));
      }
    }
    if (same) row.power[receiver] = row.power[transmitter];
    for (const std::size_t i : {transmitter, receiver}) {
      const std::vector<float>& powers = row.power[i];
      const double ends = 0.5 * (double(powers.front()) + double(powers.back()));
      row.width_m[i] =
          2.0 * row.reach_m / columns * (std::accumulate(powers.begin(), powers.end(), 0.0) - ends);
    }
    rows_.push_back(std::move(row));
  }
  overlaps_.resize(rows_.size() * rows_.size() * overlap_steps);
  for (std::size_t i = 0; i < rows_.size(); ++i)
    for (std::size_t j = 0; j <= i; ++j)
      for (std::size_t step = 0; step < overlap_steps; ++step) {
        const double share = static_cast<double>(step) / overlap_steps;
        const double apart_m = (rows_[i].reach_m + rows_[j].reach_m) * share * share;
        overlaps_[(i * rows_.size() + j) * overlap_steps + step] =
            overlaps_[(j * rows_.size() + i) * overlap_steps + step] =
                overlap_m(rows_[i], rows_[j], apart_m);
      }
}

double OneWayBeams::overlap_m(const Row& one, const Row& other, double apart_m) const {
  if (one.reach_m > other.reach_m) return overlap_m(other, one, apart_m);
  const int parts = apart_m > 0.0 ? columns / 8 : columns;
  const double step_m = one.reach_m / parts;
  const auto both = [&](double along_m) {
    return one.at(transmitter, along_m) * other.at(receiver, along_m + apart_m) +
           one.at(receiver, along_m) * other.at(transmitter, along_m + apart_m);
  };
  double sum = 0.0;
  for (int part = 0; part < parts; ++part) {
    const double along_m = (part + 0.5) * step_m;
    sum += 0.5 * (both(along_m) + both(-along_m));
  }
  return sum * step_m;
}

double OneWayBeams::Row::at(Array array, double along_m) const {
  const double place = std::abs(along_m) / reach_m * columns;
  if (!(place < columns)) return 0.0;
  const auto column = static_cast<std::size_t>(place);
  const std::vector<float>& powers = power[array];
  return std::lerp(double(powers[column]), double(powers[column + 1]),
                   place - static_cast<double>(column));
}

double OneWayBeams::place_of(double range_m) const {
  return std::clamp(tables_per_octave * std::log2(range_m / nearest_m_), 0.0,
                    static_cast<double>(rows_.size() - 1));
}

const OneWayBeams::Row& OneWayBeams::row_of(double range_m) const {
  return rows_[static_cast<std::size_t>(std::lround(place_of(range_m)))];
}

double OneWayBeams::power(Array array, double range_m, double along_m) const {
  const Row& row = row_of(range_m);
  return row.at(array, along_m * row.range_m / range_m);
}

double OneWayBeams::main_m(double range_m) const {
  const Row& row = row_of(range_m);
  return row.main_m * range_m / row.range_m;
}

double OneWayBeams::overlap_m(double leg_m, double other_m, double apart_m) const {
  const double one = place_of(leg_m), other = place_of(other_m);
  const std::size_t last = rows_.size() - 2;
  const std::size_t i = std::min(static_cast<std::size_t>(one), last);
  const std::size_t j = std::min(static_cast<std::size_t>(other), last);
  const auto at = [&](std::size_t a, std::size_t b) {
    const double place = overlap_steps * std::sqrt(apart_m / (rows_[a].reach_m + rows_[b].reach_m));
    if (!(place < overlap_steps - 1)) return 0.0;
    const auto step = static_cast<std::size_t>(place);
    const double* overlaps = &overlaps_[(a * rows_.size() + b) * overlap_steps + step];
    return std::lerp(overlaps[0], overlaps[1], place - static_cast<double>(step));
  };
  const double share = other - static_cast<double>(j);
  return std::lerp(std::lerp(at(i, j), at(i, j + 1), share),
                   std::lerp(at(i + 1, j), at(i + 1, j + 1), share), one - static_cast<double>(i));
}

double OneWayBeams::spread_overlap_m(double leg_m, double other_m, double apart_m,
                                     double spread_m) const {
  if (!(spread_m > 0.0)) return overlap_m(leg_m, other_m, apart_m);
  const auto width_m = [&](double range_m, Array array) {
    const Row& row = row_of(range_m);
    return row.width_m[array] * range_m / row.range_m;
  };
  // The overlap's integral over all distances between the beams' middles.
  const double area_m2 = 0.5 * (width_m(leg_m, transmitter) * width_m(other_m, receiver) +
                                width_m(leg_m, receiver) * width_m(other_m, transmitter));
  const double deviation_m =
      area_m2 / (std::sqrt(2.0 * std::numbers::pi) * overlap_m(leg_m, other_m));
  const double share = 1.0 / std::hypot(1.0, spread_m / deviation_m);
  return share * overlap_m(leg_m, other_m, apart_m * share);
}

}  // namespace ensonify::engine
