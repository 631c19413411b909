#include <ensonify/engine/base/csv_table.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <ensonify/engine/base/number_in.h>
#include <ensonify/refine/printable.h>
#include <ensonify/refine/read_file.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t longest_line = 4096;

/// A piece of an untrusted file for a message: shortened, printable and in quotes.
std::string quoted(std::string_view text) {
  return '\'' + refine::printable(refine::shortened(text, 40)) + '\'';
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view space = " \t\r";
  text.remove_prefix(std::min(text.find_first_not_of(space), text.size()));
  return text.substr(0, text.find_last_not_of(space) + 1);
}

/// The end of the quoted field at the beginning of a line; 0 if the line begins with none. Commas
/// in a quoted field do not separate fields, and two quotes in it stand for one.
std::size_t end_of_quotes(std::string_view line) {
  const std::size_t begin = line.find_first_not_of(" \t");
  if (begin == std::string_view::npos || line[begin] != '"') return 0;
  std::size_t end = line.find('"', begin + 1);
  while (end != std::string_view::npos && line.substr(end).starts_with("\"\""))
    end = line.find('"', end + 2);
  return end == std::string_view::npos ? 0 : end;
}

void split(std::string_view line, std::vector<std::string_view>& fields) {
  fields.clear();
  for (;;) {
    const std::size_t comma = line.find(',', end_of_quotes(line));
    std::string_view field = trimmed(line.substr(0, comma));
    if (field.size() >= 2 && field.front() == '"' && field.back() == '"')
      field = trimmed(field.substr(1, field.size() - 2));
    fields.push_back(field);
    if (comma == std::string_view::npos) return;
    line.remove_prefix(comma + 1);
  }
}

/// The expected header row, such as "depth_m,soundspeed_mps[,note]", followed by "(or Depth
/// (Meter),...)" if columns have an alias.
std::string header_of(std::span<const CsvColumn> columns) {
  std::string header, aliases;
  for (const CsvColumn& column : columns) {
    const std::string_view comma = header.empty() ? "" : ",";
    header += fmt::format(fmt::runtime(column.required ? "{}{}" : "[{}{}]"), comma, column.name);
    if (!column.alias.empty())
      aliases += fmt::format("{}{}", aliases.empty() ? "" : ",", column.alias);
  }
  return aliases.empty() ? header : fmt::format("{} (or {})", header, aliases);
}

}  // namespace

/// Fills a table from text.
class CsvReader {
 public:
  CsvReader(std::string_view text, std::string_view name, const CsvFormat& format)
      : text_(text), format_(format), columns_(format.columns) {
    if (text_.starts_with("\xef\xbb\xbf")) text_.remove_prefix(3);
    table_.name_ = name;
  }

  CsvTable read() {
    if (refine::is_utf16(text_)) fail(refine::utf16_fault);
    std::string_view line;
    do {
      if (!next_line(line))
        fail(fmt::format("the file is empty, expected a header row with {}", header_of(columns_)));
    } while (line.starts_with('%'));
    read_header(line);
    while (next_line(line)) read_row(line);
    if (table_.rows() == 0 && !format_.may_have_no_rows)
      fail(fmt::format("no {} follows the header row, expected at least one", format_.row));
    return std::move(table_);
  }

 private:
  [[noreturn]] void fail(std::string_view what) const {
    throw SceneError(fmt::format("{}:{}: {}", table_.name_, std::max(line_, 1), what));
  }

  /// The next line that is neither blank nor a comment.
  bool next_line(std::string_view& line) {
    while (!text_.empty()) {
      const std::size_t end = std::min(text_.find_first_of("\r\n"), text_.size());
      line = trimmed(text_.substr(0, end));
      text_.remove_prefix(end);
      text_.remove_prefix(text_.starts_with("\r\n") ? 2 : std::min<std::size_t>(1, text_.size()));
      ++line_;
      if (line.size() > longest_line)
        fail(fmt::format("a line of more than {} characters, expected one {} per line",
                         longest_line, format_.row));
      if (!line.empty() && !line.starts_with('#')) return true;
    }
    return false;
  }

  void read_header(std::string_view line) {
    split(line, fields_);
    for (const char separator : {';', '\t'})
      if (fields_.size() == 1 && line.find(separator) != std::string_view::npos)
        fail(fmt::format("the columns are separated by {}, expected commas, and decimal points",
                         separator == ';' ? "semicolons" : "tabs"));
    for (const CsvColumn& column : columns_) {
      std::string_view heading = column.name;
      auto found = std::ranges::find(fields_, heading);
      if (found == fields_.end() && !column.alias.empty())
        found = std::ranges::find(fields_, heading = column.alias);
      headings_.push_back(heading);
      table_.has_.push_back(found != fields_.end());
      place_.push_back(static_cast<std::size_t>(found - fields_.begin()));
      if (found == fields_.end()) {
        if (!column.required) continue;
        fail(fmt::format("no column {} in {}, expected a header row with {}", column.name,
                         quoted(line), header_of(columns_)));
      }
      if (std::find(found + 1, fields_.end(), heading) != fields_.end())
        fail(fmt::format("column {} appears twice, expected it once", heading));
    }
    width_ = fields_.size();
    for (std::size_t i = 0; i < width_; ++i)
      if (std::ranges::find(place_, i) == place_.end())
        table_.unknown_.push_back(quoted(fields_[i]));
  }

  void read_row(std::string_view line) {
    split(line, fields_);
    if (fields_.size() != width_)
      fail(fmt::format("{} values in {}, expected {} as in the header row", fields_.size(),
                       quoted(line), width_));
    for (std::size_t i = 0; i < columns_.size(); ++i)
      table_.values_.push_back(table_.has_[i] ? value(i) : 0.0);
    table_.lines_.push_back(line_);
  }

  double value(std::size_t column) const {
    const std::string_view field = fields_[place_[column]];
    if (field.empty() && columns_[column].may_be_empty)
      return std::numeric_limits<double>::quiet_NaN();
    const std::string_view digits =
        field.starts_with('+') && !field.starts_with("+-") ? field.substr(1) : field;
    const std::optional value = number_in<double>(digits);
    if (!value || std::isnan(*value) || (std::isinf(*value) && !columns_[column].may_be_infinite))
      fail(fmt::format("{} is {}, expected a number such as 12.5", headings_[column],
                       quoted(field)));
    return *value;
  }

  std::string_view text_;
  const CsvFormat& format_;
  std::span<const CsvColumn> columns_;
  int line_ = 0;
  std::vector<std::string_view> fields_;    // the fields of the current line
  std::vector<std::size_t> place_;          // the index of each column's field
  std::vector<std::string_view> headings_;  // the name of each column in the header row
  std::size_t width_ = 0;                   // the number of fields in the header row
  CsvTable table_;
};

CsvTable CsvTable::parse(std::string_view text, std::string_view name, const CsvFormat& format) {
  return CsvReader(text, name, format).read();
}

CsvTable CsvTable::read(const std::filesystem::path& file, const CsvFormat& format) {
  return parse(refine::read_user_file<SceneError>(file, format.max_bytes), file.string(), format);
}

CsvTable CsvTable::of(std::string name, std::vector<bool> has, std::vector<double> values,
                      std::vector<int> row_numbers) {
  CsvTable table;
  table.name_ = std::move(name);
  table.has_ = std::move(has);
  table.values_ = std::move(values);
  table.lines_ = std::move(row_numbers);
  return table;
}

SceneError CsvTable::fault(std::size_t row, std::string_view what) const {
  return SceneError(fmt::format("{}:{}: {}", name_, lines_[row], what));
}

}  // namespace ensonify::engine
