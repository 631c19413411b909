#pragma once

#include <cstdint>
#include <vector>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/seafloor/bed/grid_transform.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/bed/spectral.h>
#include <ensonify/engine/seafloor/bed/wave_bands.h>

namespace ensonify::engine {

/// A SpectralField over a grid that is too large for one transform. The waves are divided into
/// bands of two octaves, and a rest of longer waves. The rest is one transform over a coarse grid.
/// Each band is white noise on a lattice of a suitable spacing, convolved with a kernel of finite
/// width. So the height at a place depends only on the noise around the place: any division of the
/// grid into windows gives the same heights, without seams. Bands and rest overlap with weights
/// whose squares add up to 1, so that the spectrum is that of a single transform, within 2 %. The
/// mean of the rest over the grid is zero.
class TiledField {
 public:
  /// The most cells of the coarse grid: 128 MB.
  static constexpr double max_coarse_cells = 16777216.0;

  static constexpr int block_points = 1024;  ///< points of a block, in each direction

  /// The field over `grid`, which has square cells and needs no heights. The noise follows from
  /// seed, purpose and `number`, the number of a layer. Throws std::invalid_argument for a field
  /// whose waves are too regular for kernels of at most 384 points to each side, and for cells that
  /// are not square.
  TiledField(const Heightfield& grid, SpectralField what, std::uint64_t seed, Purpose purpose,
             double coarse_cells = max_coarse_cells, std::uint64_t number = 0);
  TiledField(const TiledField&) = delete;
  TiledField& operator=(const TiledField&) = delete;

  /// Adds the heights of a block to z_m, row by row: the block_points x block_points points from
  /// point (column, row) * block_points on. Some points may lie beyond the grid. Thread-safe.
  void add_block(int column, int row, std::vector<double>& z_m) const;

  int bands() const { return static_cast<int>(bands_.size()); }

 private:
  struct Band {
    int reach;                   // points of the kernel to each side
    std::vector<double> kernel;  // (2 reach + 1)^2; empty when there is a filter
    GridTransform transform;     // for a window with the reach around it
    std::vector<double> filter;  // the transform of the kernel, which is real
  };
  double amplitude(std::size_t band, double kx, double ky) const;
  double spacing_m(std::size_t band) const;
  Band make_band(std::size_t number, int points) const;
  static void fill_filter(Band& band);
  void take_mean_over(const Heightfield& grid);
  std::vector<double> waves(std::size_t band, const LatticeWindow& window) const;
  std::vector<double> waves_of(std::size_t number, const LatticeWindow& window) const;

  double cell_m_;
  SpectralField what_;
  std::uint64_t seed_;
  Purpose purpose_;
  std::uint64_t number_;
  std::size_t band_count_ = 1;
  std::vector<Band> bands_;
  Heightfield coarse_;
};

}  // namespace ensonify::engine
