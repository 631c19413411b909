#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/base/scene_error.h>

namespace ensonify::engine {

/// A column that a reader asks for.
struct CsvColumn {
  std::string_view name;
  bool required = true;
  std::string_view alias = {};  ///< an instrument's name for it, used if `name` is missing
  bool may_be_empty = false;    ///< whether a field may be empty; it is then NaN
  bool may_be_infinite = false;
};

struct CsvFormat {
  std::string_view row;  ///< what a row is, such as "sample", for messages
  std::span<const CsvColumn> columns;
  bool may_have_no_rows = false;
  std::uintmax_t max_bytes = 64 << 20;
};

/// Columns of an untrusted CSV file: numbers, which are finite unless the column allows otherwise.
///
/// A header row names the columns, in any order; unknown columns are skipped. Then one row per
/// line. Blank lines, lines that begin with #, a byte-order mark, CRLF or CR and quoted fields are
/// accepted, and so are lines that begin with % above the header row, as instruments write them.
/// Every fault throws SceneError with `file:line: what is wrong, what was expected`.
class CsvTable {
 public:
  static CsvTable read(const std::filesystem::path& file, const CsvFormat& format);
  /// The same from text; `name` stands for the file in messages.
  static CsvTable parse(std::string_view text, std::string_view name, const CsvFormat& format);

  /// A table that does not come from a CSV file: which columns it has, its values row by row, and
  /// the numbers of its rows for messages.
  static CsvTable of(std::string name, std::vector<bool> has, std::vector<double> values,
                     std::vector<int> row_numbers);

  std::size_t rows() const { return lines_.size(); }
  /// Whether the file has a column, by its index in CsvFormat::columns.
  bool has(std::size_t column) const { return has_[column]; }
  double at(std::size_t row, std::size_t column) const {
    return values_[row * has_.size() + column];
  }
  /// The headings of columns that the reader did not ask for, quoted for a message.
  const std::vector<std::string>& unknown() const { return unknown_; }
  /// An error about a row, for the reader to throw.
  SceneError fault(std::size_t row, std::string_view what) const;

 private:
  friend class CsvReader;
  CsvTable() = default;

  std::string name_;
  std::vector<bool> has_;
  std::vector<double> values_;  // row by row; 0 in columns that are not there
  std::vector<int> lines_;      // of the rows
  std::vector<std::string> unknown_;
};

}  // namespace ensonify::engine
