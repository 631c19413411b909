#pragma once

#include <filesystem>
#include <vector>

namespace ensonify::engine {

/// No height on Earth is larger, up or down; larger values mark missing heights.
inline constexpr double max_height_m = 12000.0;

/// A height of plus or minus this marks a missing height, even if the file does not declare it.
inline constexpr double usual_missing_m = 9999.0;

/// Whether a file begins with a line of three numbers, after comments (#) and one line of names.
bool are_soundings(const std::filesystem::path& file);

/// Scattered soundings on a grid of square cells. The soundings of a cell are replaced by their
/// mean, and heights are interpolated linearly in the triangles between these means. A cell that is
/// more than 2 cells from all cells with soundings is a hole.
class Soundings {
 public:
  /// Reads lines of x (east), y (north) and z (up) in metres, separated by blanks, commas or
  /// semicolons; further columns are ignored. The first line may name the columns, in any order
  /// (easting, northing, depth ...). Throws refine::MeshError for a line that is no sounding, for a
  /// height that is beyond max_height_m or marks a missing height, for names or decimal commas that
  /// leave the columns unknown, and if the grid would have fewer than 2 x 2 cells or more than 1000
  /// cells per sounding.
  Soundings(const std::filesystem::path& file, double cell_m);

  double west_m, south_m;  ///< the grid's edges
  int columns, rows;

  /// The heights, row by row from the south; NaN in holes. Throws refine::MeshError if all
  /// soundings lie on a line.
  std::vector<double> heights() const;

 private:
  std::filesystem::path file_;
  double cell_m_;
  std::vector<double> x_m_, y_m_, z_m_;
};

}  // namespace ensonify::engine
