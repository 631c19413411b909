#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <ensonify/engine/sonar/instrument/sonar.h>

namespace ensonify::engine {

/// The receive beams of an imaging sonar: one line array, steered to several directions.
///
/// A direction has a sine: its component along the array's axis. Steered to the sine s, an array of
/// length L receives from the sine u the field Shading::field(L (u - s) / lambda, F (1 - s^2)),
/// with F = L^2 / (2 lambda r) times the defocus, because the steered array appears shorter by the
/// cosine (Fresnel's approximation). Lobes beyond Sonar::side_lobes count as 0.
class SteeredBeams {
 public:
  /// bins: of the tables that the beams are formed from; at least the sonar's.
  SteeredBeams(const Sonar& sonar, double wavelength_m, std::size_t bins);

  std::size_t size() const { return sines_.size(); }
  /// Where a beam looks.
  double sine(std::size_t beam) const { return sines_[beam]; }
  /// The field that a beam receives from a direction whose sine is greater than the beam's by
  /// `off`, over that on its axis in the far field, from the range of a bin.
  std::complex<float> field(std::size_t beam, std::size_t bin, double off) const {
    return value(row_of(beam, bin), static_cast<float>(off * x_per_sine_));
  }

  /// One thread's memory for for_each_weight().
  struct Scratch {
    struct Run {
      std::size_t from, until;
      float sine;
    };
    std::vector<Run> runs;
  };
  /// For the bins of one plane, whose directions have these sines: calls f(beam, from, until, w)
  /// for each beam that receives something of them and each run of bins [from, until) with the
  /// field w. Sines are rounded to a 128th of the distance of two nulls.
  template <class F>
  void for_each_weight(const float* sines, std::size_t bins, Scratch& scratch, F&& f) const {
    cut_runs(sines, bins, scratch);
    float low = 2.0f, high = -2.0f;
    for (const Scratch::Run& run : scratch.runs) {
      low = std::min(low, run.sine);
      high = std::max(high, run.sine);
    }
    // The sines fall from beam to beam.
    const auto begin = std::ranges::partition_point(
        sines_, [&](double sine) { return sine > double(high + widest_); });
    const auto end = std::partition_point(
        begin, sines_.end(), [&](double sine) { return sine >= double(low - widest_); });
    for (auto at = begin; at != end; ++at) {
      const auto beam = static_cast<std::size_t>(at - sines_.begin());
      const auto axis = static_cast<float>(*at);
      for (const Scratch::Run& run : scratch.runs) {
        const std::complex<float> weight = field(beam, run.from, double(run.sine - axis));
        if (weight != 0.0f) f(beam, run.from, run.until, weight);
      }
    }
  }

 private:
  static constexpr float columns_per_x = 64.0f;
  struct Row {
    std::size_t first;
    float columns;
  };
  void cut_runs(const float* sines, std::size_t bins, Scratch& scratch) const;
  void add_row(const Shading& shading, double nearness, double lobes_x);
  const Row& row_of(std::size_t beam, std::size_t bin) const {
    if (rows_.size() == 1) return rows_[0];
    const int row = row_of_bin_[bin] + row_of_beam_[beam];
    return rows_[static_cast<std::size_t>(std::max(row, 0))];
  }
  std::complex<float> value(const Row& row, float x) const {
    const float place = std::abs(x) * columns_per_x;
    if (!(place < row.columns)) return 0.0f;
    const auto column = static_cast<std::size_t>(place);
    const std::complex<float>* at = &values_[row.first + column];
    return at[0] + (place - static_cast<float>(column)) * (at[1] - at[0]);
  }

  double x_per_sine_;
  float widest_ = 0.0f;  // the farthest that any beam receives from its axis, as a sine
  std::vector<double> sines_;
  std::vector<int> row_of_bin_, row_of_beam_;  // their sum is a row; below 0: the first
  std::vector<Row> rows_;
  std::vector<std::complex<float>> values_;
};

}  // namespace ensonify::engine
