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
  std::string_view alias = {};  ///< an instrument's heading, if `name` is missing
  bool may_be_empty = false;    ///< an empty field then has the value NaN
  bool may_be_infinite = false;
};

struct CsvFormat {
  std::string_view row;  ///< what a row is, for messages, such as "sample"
  std::span<const CsvColumn> columns;
  bool may_have_no_rows = false;
  std::uintmax_t max_bytes = 64 << 20;
};

/// The columns of an untrusted CSV file. Their values are numbers, which are finite unless the
/// column allows otherwise.
///
/// A header row names the columns, in any order; unknown columns are skipped. Each further line is
/// a row. Accepted are blank lines, lines that begin with #, a byte-order mark, line ends CRLF or
/// CR, and quoted fields. Above the header row it also accepts lines that begin with %, which
/// instruments write. Every fault throws SceneError with `file:line: what is wrong, what was
/// expected`.
class CsvTable {
 public:
  static CsvTable read(const std::filesystem::path& file, const CsvFormat& format);
  /// Reads a table from a text; `name` replaces the file's name in messages.
  static CsvTable parse(std::string_view text, std::string_view name, const CsvFormat& format);

  /// Makes a table that does not come from a CSV file. `has`: whether each column is there.
  /// `values`: row by row. `row_numbers`: the numbers of the rows in messages.
  static CsvTable of(std::string name, std::vector<bool> has, std::vector<double> values,
                     std::vector<int> row_numbers);

  std::size_t rows() const { return lines_.size(); }
  /// Whether the file has a column; `column` is an index of CsvFormat::columns.
  bool has(std::size_t column) const { return has_[column]; }
  double at(std::size_t row, std::size_t column) const {
    return values_[row * has_.size() + column];
  }
  /// The headings of columns that the reader did not ask for, quoted for a message.
  const std::vector<std::string>& unknown() const { return unknown_; }
  /// An error about a row, which the caller throws.
  SceneError fault(std::size_t row, std::string_view what) const;

 private:
  friend class CsvReader;
  CsvTable() = default;

  std::string name_;
  std::vector<bool> has_;
  std::vector<double> values_;  // row by row; 0 in missing columns
  std::vector<int> lines_;      // the line number of each row
  std::vector<std::string> unknown_;
};

}  // namespace ensonify::engine
