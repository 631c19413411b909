#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/sonar/echo/echo.h>
#include <ensonify/engine/sonar/instrument/sonar.h>

namespace ensonify::engine {

/// An array that listens.
struct ArrayFrame {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< local metres
  Eigen::Vector3d axis = Eigen::Vector3d::UnitY();   ///< unit, along the array
  Eigen::Vector3d down = -Eigen::Vector3d::UnitZ();  ///< unit, across it: the sonar's own down
};

/// The scatterers of the ground, as an array's beam sums them up.
///
/// The ground is cut into cells: across the look a little less than a bin, along the array a
/// quarter of its length (and twice, four times ... that where the beam is wide). Each holds one
/// scatterer of complex normal strength at a random place along the array, which depends on the
/// seed, the frequency and the cell alone. A bin is the sum over the cells of its row that the beam
/// covers, each with the two-way pattern there, phase included (the array's Fresnel integral,
/// transmitter times receiver), and the phase of its place across. So what two pings, or two
/// passes, have in common is what theory says: along the track the Fourier transform of the squared
/// pattern (van Cittert and Zernike), across it the loss by a change of the grazing angle. The sum
/// is divided by the root of its weights' squares: each bin's variance is 1.
///
/// Cells lie along one of 12 directions, 15 degrees apart, the one next to the array's: two passes
/// that differ by more than the beam have nothing in common anyway. What is sent by a height's
/// change is taken for common to the whole row.
class Scatterers {
 public:
  /// reference_heading_rad: one of the 12 directions.
  Scatterers(const Sonar& sonar, double sound_speed_mps, std::uint64_t seed,
             double reference_heading_rad);

  /// What gather() needs on a thread, kept from ping to ping.
  struct Memory {
    std::uint32_t frame_key = 0;
    std::vector<std::uint32_t> across_cell, across_within, first_cell, cells, placeless;
    std::vector<float> first_column, phase_turns;
  };
  /// Finds the cells that each bin hears whose intensity_mean is not 0. Places are the line's.
  void place(const ArrayFrame& listener, const BinLayers& bins, Memory& memory) const;
  /// The field of a look of that variance in each bin, in whole groups of the kernels'
  /// (signal_kernel.h); 0 where the bin has no cells.
  void gather(const Memory& memory, int look, std::span<const float> power, float* re,
              float* im) const;
  /// Integral of the two-way power pattern along the array, m, at a bin's range.
  double width_m(std::size_t bin) const { return width_of_bin_m_[bin]; }
  /// That pattern so far along the array from its middle, to the axis' at a bin's range.
  double pattern(std::size_t bin, double along_m) const;

 private:
  static constexpr int columns_per_cell = 32;
  struct Row {  ///< of ranges that are much the same
    double cells_per_m;
    float reach;  ///< cells to either side
    int level;    ///< of cells
    double width_m;
    std::uint32_t first_weight;
  };
  struct Frame {
    Eigen::Vector2d along, across;
    std::uint32_t key;
  };
  const Frame& frame_of(const ArrayFrame& listener) const;
  void place_side_lobes(const BinLayers& bins, Memory& memory) const;
  Row make_row(const Sonar& sonar, double wavelength_m, double range_m);

  double cell_m_, turns_per_cell_;
  double reference_rad_;
  std::vector<std::uint16_t> row_of_bin_;
  std::vector<double> width_of_bin_m_;
  std::vector<Row> rows_;
  // Of each bin, in whole groups:
  std::vector<float> cells_per_m_, reach_;
  std::vector<std::uint32_t> first_weight_, key_;
  std::uint32_t columns_;       // of a row of weights, the last ones 0
  std::vector<float> weights_;  // real and imaginary parts over the distance from the beam's middle
  std::vector<Frame> frames_;
};

}  // namespace ensonify::engine
