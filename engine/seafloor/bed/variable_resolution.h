#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace ensonify::engine {

/// The heights of a BAG of variable resolution (Open Navigation Surface, Format Specification
/// Document 1.6). Such a file has a coarse grid, and for each cell of the coarse grid a finer grid,
/// called a refinement. This class reads all heights on one grid with the cells of the finest
/// refinement, with linear interpolation between the points of coarser refinements. HDF5 is not
/// safe for threads, so only one thread at a time may use objects of this class, or GDAL on HDF5
/// files.
class VariableResolution {
 public:
  /// `coarse_east_m` and `coarse_north_m` are the sizes of the coarse grid's cells. Throws
  /// refine::MeshError for tables that cannot be read or contradict each other.
  VariableResolution(const std::filesystem::path& file, double coarse_east_m,
                     double coarse_north_m);
  ~VariableResolution();

  double cell_m() const { return finest_m_; }  ///< of the finest refinement
  double columns() const;                      ///< of finest cells over the whole coarse grid
  double rows() const;

  /// A part of the grid; columns count from the west, rows from the south.
  struct Window {
    int first_column, first_row, columns, rows;
  };
  enum class What { height, uncertainty };

  /// Fills `values` by row from the south; NaN where there is none. Throws refine::MeshError.
  void read(What what, const Window& window, std::span<double> values) const;

 private:
  struct File;
  struct Refinement {
    std::uint32_t first, across, up;  // its first point in the file's list; columns and rows
    float cell_east_m, cell_north_m;
    float west_m, south_m;  // from the coarse cell's corner to its south-western point
    int steps;              // number of finest cells along a cell of the refinement
  };
  [[noreturn]] void fail() const;
  int coarse_column(int column) const;
  int coarse_row(int row) const;
  const Refinement& refinement(int coarse_column, int coarse_row) const;
  std::vector<float> points(What what, const Refinement& refinement) const;
  void read_steps(What what, const Window& window, std::span<double> values) const;
  void smooth(const Window& outer, std::span<const double> steps, const Window& inner,
              std::span<double> values) const;

  std::string name_;
  std::unique_ptr<File> file_;
  double coarse_east_m_, coarse_north_m_, finest_m_ = 0.0;
  int coarse_columns_ = 0, coarse_rows_ = 0;
  std::vector<Refinement> refinements_;  // by coarse cell, from the south-west
  int max_steps_ = 1;
};

}  // namespace ensonify::engine
