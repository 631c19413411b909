#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace ensonify::engine {

/// The heights of a BAG of variable resolution (Open Navigation Surface, Format Specification
/// Document 1.6): a coarse grid, and for each of its cells a finer grid, called a
/// refinement. They are read here on one grid with the finest cells of all, with linear
/// interpolation between the points of coarser refinements. HDF5 is not safe for threads: one at a
/// time may use objects of this class, and GDAL on files of HDF5.
class VariableResolution {
 public:
  /// Throws refine::MeshError for tables that cannot be read or contradict themselves. `coarse_m`
  /// is the size of the coarse grid's cells, to the east and to the north.
  VariableResolution(const std::filesystem::path& file, double coarse_east_m,
                     double coarse_north_m);
  ~VariableResolution();

  double cell_m() const { return finest_m_; }  ///< of the finest refinement
  double columns() const;                      ///< of its cells, in all of the coarse grid
  double rows() const;

  /// A part of the grid; columns count from the west, rows from the south.
  struct Window {
    int first_column, first_row, columns, rows;
  };
  enum class What { height, uncertainty };

  /// Row by row from the south; NaN where there is none. Throws refine::MeshError.
  void read(What what, const Window& window, std::span<double> values) const;

 private:
  struct File;
  struct Refinement {
    std::uint32_t first, across, up;  // its first point in the file's list, and how many
    float cell_east_m, cell_north_m;
    float west_m, south_m;  // of its south-western point from the coarse cell's corner
    int steps;              // number of finest cells along one of its cells
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
