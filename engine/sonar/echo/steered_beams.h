#pragma once

#include <algorithm>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include <ensonify/engine/sonar/echo/steered_kernel.h>
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
  /// bins: of the tables that the beams are formed from. stop_check is called often, because a long
  /// array has many near fields; what it throws ends the constructor.
  SteeredBeams(const Sonar& sonar, double wavelength_m, std::size_t bins,
               const std::function<void()>& stop_check = {});

  std::size_t size() const { return sines_.size(); }
  /// Where a beam looks.
  double sine(std::size_t beam) const { return sines_[beam]; }
  /// The field that a beam receives from a direction whose sine is greater than the beam's by
  /// `off`, over that on its axis in the far field, from the range of a bin.
  std::complex<float> field(std::size_t beam, std::size_t bin, double off) const;

  /// The same for the kernels; valid while this exists.
  BeamFields fields_of(std::size_t beam) const;

  /// One thread's memory for for_each_range().
  struct Scratch {
    struct Range {
      std::size_t first, last;
    };
    std::vector<Range> ranges;  // by beam
  };
  /// For a block of bins that begins at `bin`: calls f(beam, first, last) for each beam that may
  /// receive something from the planes [first, last). sines: the direction of what each plane sees
  /// in each bin, a row of `stride` for each plane. Planes of which wanted(plane) is false are left
  /// out at both ends.
  template <class Wanted, class F>
  void for_each_range(const float* sines, std::size_t planes, std::size_t stride, std::size_t bin,
                      Scratch& scratch, Wanted&& wanted, F&& f) const {
    scratch.ranges.assign(size(), {planes, 0});
    const double reach = reach_of_block_[bin / steered_block];
    std::size_t begin = 0, end = 0;  // neighbouring planes reach nearly the same beams
    for (std::size_t plane = 0; plane < planes; ++plane) {
      if (!wanted(plane)) continue;
      const float* of_plane = sines + plane * stride + bin;
      const auto [low, high] = std::minmax_element(of_plane, of_plane + steered_block);
      move_to(double(*high) + reach, begin);
      move_to(double(*low) - reach, end);
      for (std::size_t beam = begin; beam < end; ++beam) {
        scratch.ranges[beam].first = std::min(scratch.ranges[beam].first, plane);
        scratch.ranges[beam].last = plane + 1;
      }
    }
    for (std::size_t beam = 0; beam < size(); ++beam)
      if (const auto [first, last] = scratch.ranges[beam]; first < last) f(beam, first, last);
  }

 private:
  static constexpr float columns_per_x = 64.0f;
  /// The fields at one nearness.
  struct Row {
    std::size_t first;
    float columns;
  };
  /// The rows that the bins have in a beam. Beams of nearly the same bearing share them.
  struct RowsOfBins {
    std::vector<std::int32_t> first;
    std::vector<float> columns;
  };
  Row add_row(const Shading& shading, double nearness, double lobes_x,
              const std::function<void()>& stop_check);
  /// Moves `beam` to the first beam whose sine is at most `sine`. The sines fall from beam to beam.
  void move_to(double sine, std::size_t& beam) const {
    while (beam > 0 && sines_[beam - 1] <= sine) --beam;
    while (beam < sines_.size() && sines_[beam] > sine) ++beam;
  }

  double x_per_sine_;
  std::vector<double> sines_;
  std::vector<float> values_;  // real and imaginary parts, row by row
  bool is_real_ = true;        // whether all imaginary parts are 0
  std::vector<RowsOfBins> rows_;
  std::vector<std::size_t> rows_of_beam_;
  std::vector<double> reach_of_block_;  // the farthest that any beam receives from its axis
};

}  // namespace ensonify::engine
