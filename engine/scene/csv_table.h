#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// A column that a reader wants.
struct CsvColumn {
  std::string_view name;
  bool required = true;
  std::string_view alias = {};  ///< what an instrument calls it, where the name is not there
};

/// The wanted columns of an untrusted CSV file: finite numbers.
///
/// A header row names the columns, in any order, others being passed over; then a row a line. Blank
/// lines, lines that begin with #, a byte-order mark, CRLF and quotes about a field are fine, and
/// so are lines that begin with % above the header row, as instruments write them. Every
/// fault throws SceneError with `file:line: what is wrong, what was expected`.
class CsvTable {
 public:
  /// A regular file of at most 64 MiB; `a_row` is what one is, as in "sample".
  static CsvTable read(const std::filesystem::path& file, std::string_view a_row,
                       std::span<const CsvColumn> columns);
  /// The same from text; `name` stands for the file in messages.
  static CsvTable parse(std::string_view text, std::string_view name, std::string_view a_row,
                        std::span<const CsvColumn> columns);

  std::size_t rows() const { return lines_.size(); }  ///< one at least
  /// Whether a column, by its number among those wanted, is there.
  bool has(std::size_t column) const { return has_[column]; }
  double at(std::size_t row, std::size_t column) const {
    return values_[row * has_.size() + column];
  }
  /// What is wrong in a row, for the reader to throw.
  SceneError fault(std::size_t row, std::string_view what) const;

 private:
  friend class CsvReader;
  CsvTable() = default;

  std::string name_;
  std::vector<bool> has_;
  std::vector<double> values_;  // row by row; 0 in columns that are not there
  std::vector<int> lines_;      // of the rows
};

}  // namespace ensonify::engine
