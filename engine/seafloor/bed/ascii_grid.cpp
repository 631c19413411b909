#include <ensonify/engine/seafloor/bed/ascii_grid.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstddef>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

#include <ensonify/refine/read_file.h>

namespace ensonify::engine {
namespace {

/// Whether a word is a number. A number beyond the range of a double is one, too.
bool is_number(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error != std::errc::invalid_argument && end == word.data() + word.size();
}

}  // namespace

std::string fault_of_ascii_grid(const std::filesystem::path& file, int columns, int rows) {
  refine::FileReader in(file);
  const std::size_t promised = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  std::size_t found = 0, line_number = 0;
  for (std::string line; in.next_line(line);) {
    ++line_number;
    constexpr const char* blank = " \t\r\v\f";
    std::size_t begin = line.find_first_not_of(blank);
    for (; begin != std::string::npos; begin = line.find_first_not_of(blank, begin)) {
      const std::size_t end = std::min(line.find_first_of(blank, begin), line.size());
      const std::string_view word = std::string_view(line).substr(begin, end - begin);
      if (!is_number(word)) {
        // Lines of the header begin with a word and end with a digit.
        if (found == 0 && !std::isdigit(static_cast<unsigned char>(word.back()))) break;
        return fmt::format("line {}: '{}' is not a number{}", line_number, word.substr(0, 40),
                           word.find(',') == word.npos ? "" : ", expected a decimal point");
      }
      if (found == 0 && (word.starts_with('n') || word.starts_with('N')))  // GDAL would skip it
        return fmt::format(
            "line {}: a first height of '{}' cannot be read; write a number there, such as the "
            "value of NODATA_value",
            line_number, word);
      ++found;
      begin = end;
    }
  }
  if (found == promised) return {};
  return fmt::format(
      "holds {} heights where its header promises {} x {} = {}; it is truncated or its header is "
      "wrong",
      found, columns, rows, promised);
}

}  // namespace ensonify::engine
