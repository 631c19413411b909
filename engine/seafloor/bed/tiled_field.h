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
/// bands of two octaves and the long rest. The rest is one transform over a coarse grid. Each band
/// is white noise of a lattice that fits it, with a kernel of finite width: a place's height
/// depends on the noise around it alone, so it does not matter how the grid is cut up, and there
/// are no seams. Bands and rest overlap with weights whose squares add up to 1, so that the
/// spectrum is that of the single transform, within 2 %. The rest has no mean over the grid.
class TiledField {
 public:
  /// Cells of the coarse grid: 128 MB.
  static constexpr double max_coarse_cells = 16777216.0;

  static constexpr int block_points = 1024;  ///< of a block, in both directions

  /// Over a grid with square cells and without heights, with the noise of this seed and purpose,
  /// and of a layer's number. Throws std::invalid_argument for a field whose waves are too regular
  /// for kernels of at most 384 points to each side, and for cells that are not square.
  TiledField(const Heightfield& grid, SpectralField what, std::uint64_t seed, Purpose purpose,
             double coarse_cells = max_coarse_cells, std::uint64_t number = 0);
  ~TiledField();
  TiledField(const TiledField&) = delete;
  TiledField& operator=(const TiledField&) = delete;

  /// Adds the heights of a block: the points from (column, row) times block_points on, some of
  /// which may lie beyond the grid, row by row. Thread-safe.
  void add_block(int column, int row, std::vector<double>& z_m) const;

  int bands() const { return static_cast<int>(bands_.size()); }

 private:
  struct Band {
    int reach;                   // of the kernel, in points to each side
    std::vector<double> kernel;  // (2 reach + 1)^2; empty when there is a filter
    GridTransform transform;     // for a window and the reach around it
    std::vector<double> filter;  // the kernel's transform, which is real
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
