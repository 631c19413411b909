#include <ensonify/engine/seafloor/bed/soundings.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include <Eigen/Core>
#include <fmt/format.h>
#include <gdal_alg.h>

#include <ensonify/engine/base/lower_case.h>
#include <ensonify/engine/seafloor/bed/refuse_file.h>
#include <ensonify/engine/seafloor/bed/survey.h>
#include <ensonify/engine/seafloor/bed/survey_checks.h>
#include <ensonify/refine/read_file.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {
namespace {

constexpr int closed_cells = 2;  // most distance of a cell from a cell with soundings

using Sounding = std::array<double, 3>;

constexpr std::string_view blanks = " \t\r";

std::string_view without_blanks(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(blanks), text.size()));
  return text.substr(0, text.find_last_not_of(blanks) + 1);
}

/// The columns of x, y and z in a line.
struct Columns {
  std::array<std::size_t, 3> place{0, 1, 2};
  char separator = '\0';  ///< zero: any of blanks, commas and semicolons
};

std::vector<std::string_view> fields_of(std::string_view line, char separator) {
  std::vector<std::string_view> fields;
  line = without_blanks(line);
  const auto ends = [&](char c) {
    return separator ? c == separator : std::string_view(" \t,;").find(c) != std::string_view::npos;
  };
  for (bool more = !line.empty(); more;) {
    const auto length = static_cast<std::size_t>(std::ranges::find_if(line, ends) - line.begin());
    fields.push_back(without_blanks(line.substr(0, length)));
    line.remove_prefix(length);
    more = !line.empty();
    if (!separator) line = without_blanks(line);
    if (more && ends(line.front())) line.remove_prefix(1);
    if (!separator) line = without_blanks(line);
  }
  return fields;
}

std::optional<Sounding> sounding_of(std::string_view line, const Columns& columns) {
  const std::vector<std::string_view> fields = fields_of(line, columns.separator);
  Sounding sounding{};
  for (std::size_t i = 0; i < 3; ++i) {
    if (columns.place[i] >= fields.size()) return std::nullopt;
    std::string_view field = fields[columns.place[i]];
    field.remove_prefix(field.starts_with('+'));
    const auto [end, error] =
        std::from_chars(field.data(), field.data() + field.size(), sounding[i]);
    if (error != std::errc() || end != field.data() + field.size() || !std::isfinite(sounding[i]))
      return std::nullopt;
  }
  return sounding;
}

/// Whether the numbers of a line have decimal commas, so that commas do not separate fields.
bool has_decimal_commas(std::string_view line) {
  const bool clear = line.find_first_of(";\t") != line.npos;
  std::size_t with = 0, fields = 0;
  for (std::string_view rest = without_blanks(line); !rest.empty() && fields < 3; ++fields) {
    const std::string_view field = rest.substr(0, rest.find_first_of(clear ? ";\t" : " "));
    const std::size_t comma = without_blanks(field).find(',');
    with += comma != field.npos && comma + 1 < without_blanks(field).size();
    rest.remove_prefix(std::min(field.size() + 1, rest.size()));
    if (!clear) rest = without_blanks(rest);
  }
  return clear ? with > 0 : with == 3;
}

/// The meaning of a column's name (which may have a unit): 0, 1 or 2 for x, y or z in metres; 3 for
/// longitude or latitude; 4 for one of these in another unit of length. Unset for other names.
std::optional<std::size_t> meaning_of(std::string_view word) {
  std::string name(word);
  std::erase_if(name, [](char c) { return c == '"' || c == '\''; });
  name = lower_case(std::move(name));
  const std::size_t end = std::min(name.find_first_of(" _(["), name.size());
  std::string unit = name.substr(end);
  std::erase_if(unit,
                [](char c) { return std::string_view(" _()[]").find(c) != std::string::npos; });
  constexpr std::array<std::string_view, 8> others{"ft",   "feet",   "foot", "us",
                                                   "yard", "fathom", "km",   "cm"};
  const bool other_length =
      std::ranges::any_of(others, [&](std::string_view other) { return unit.starts_with(other); });
  if (!is_metre(unit) && !unit.starts_with("deg") && !other_length) return std::nullopt;
  constexpr std::array<std::array<std::string_view, 7>, 4> names{
      {{"x", "east", "easting"},
       {"y", "north", "northing"},
       {"z", "height", "elevation", "elev", "up", "depth", "altitude"},
       {"lon", "long", "longitude", "lat", "latitude"}}};
  name.resize(end);
  for (std::size_t i = 0; i < names.size() && !name.empty(); ++i)
    if (std::ranges::find(names[i], name) != names[i].end()) return other_length ? 4 : i;
  return std::nullopt;
}

/// The columns that a header names; unset if it has other units, or names from which the columns do
/// not follow. If not all of x, y and z are named, up to three names are taken as x, y and z in
/// this order, unless a name contradicts it.
std::optional<Columns> columns_of(std::string_view header) {
  Columns columns;
  for (const char separator : {';', '\t', ','})
    if (!columns.separator && header.find(separator) != header.npos) columns.separator = separator;
  const std::vector<std::string_view> words = fields_of(header, columns.separator);
  std::array<std::optional<std::size_t>, 5> found;
  for (std::size_t i = 0; i < words.size(); ++i)
    if (const auto meaning = meaning_of(words[i]); meaning && !found[*meaning]) found[*meaning] = i;
  if (found[0] && found[1] && found[2]) {
    columns.place = {*found[0], *found[1], *found[2]};
    return columns;
  }
  for (std::size_t i = 0; i < 3; ++i)
    if (found[i] && *found[i] != i) return std::nullopt;
  if (found[3] || found[4] || words.size() > 3) return std::nullopt;
  return Columns{};
}

/// The lines that are neither empty nor comments, without a byte-order mark.
class Lines {
 public:
  explicit Lines(const std::filesystem::path& file) : in_(file) {}

  bool next() {
    while (in_.next_line(line_)) {
      if (number_++ == 0 && line_.starts_with("\xEF\xBB\xBF")) line_.erase(0, 3);
      const std::size_t begin = line_.find_first_not_of(" \t\r");
      if (begin != line_.npos && line_[begin] != '#') return true;
    }
    return false;
  }
  const std::string& line() const { return line_; }
  std::size_t number() const { return number_; }

 private:
  refine::FileReader in_;
  std::string line_;
  std::size_t number_ = 0;
};

}  // namespace

bool are_soundings(const std::filesystem::path& file) {
  Lines lines(file);
  if (!lines.next()) return false;
  if (sounding_of(lines.line(), {})) return true;
  const Columns columns = columns_of(lines.line()).value_or(Columns{});
  return lines.next() && (sounding_of(lines.line(), columns) || sounding_of(lines.line(), {}));
}

Soundings::Soundings(const std::filesystem::path& file, double cell_m)
    : file_(file), cell_m_(cell_m) {
  Lines lines(file);
  Columns place;
  for (bool first = true; lines.next(); first = false) {
    const auto refuse = [&](const std::string& what) {
      refuse_file(file, fmt::format("line {}: {}", lines.number(), what));
    };
    if (has_decimal_commas(lines.line()))
      refuse("has commas inside its fields; write the numbers with points");
    if (const std::optional<Sounding> sounding = sounding_of(lines.line(), place)) {
      const double z_m = (*sounding)[2];
      if (!(std::abs(z_m) <= max_height_m) || std::abs(z_m) == usual_missing_m)
        refuse(fmt::format("a height of {} m; if it marks a missing one, remove the line", z_m));
      x_m_.push_back((*sounding)[0]);
      y_m_.push_back((*sounding)[1]);
      z_m_.push_back(z_m);
    } else if (first) {  // the first line may have the names of the columns
      const std::optional<Columns> named = columns_of(lines.line());
      if (!named)
        refuse(
            fmt::format("'{}' does not name columns x, y and z (or easting, northing, depth) in "
                        "metres; name them so, or begin the line with # if x, y and z come first",
                        lines.line().substr(0, 40)));
      place = *named;
    } else {
      refuse(place.separator
                 ? fmt::format("'{}' has no numbers x y z where the first line names them",
                               lines.line().substr(0, 40))
                 : fmt::format("'{}' does not begin with three numbers, expected x y z",
                               lines.line().substr(0, 40)));
    }
  }
  const auto [west, east] = std::ranges::minmax(x_m_);
  const auto [south, north] = std::ranges::minmax(y_m_);
  west_m = std::floor(west / cell_m) * cell_m;
  south_m = std::floor(south / cell_m) * cell_m;
  const double across = std::floor((east - west_m) / cell_m) + 1.0,
               along = std::floor((north - south_m) / cell_m) + 1.0;
  if (!(across >= 2.0 && along >= 2.0))
    refuse_file(file,
                fmt::format("has soundings over {:.4g} x {:.4g} m, fewer than 2 x 2 cells of {} m; "
                            "check that they are in metres, or make {} smaller",
                            east - west, north - south, cell_m, cell_key));
  const double most = std::min(1000.0 * static_cast<double>(x_m_.size()), 1073741824.0);
  if (!(across * along <= most))
    refuse_file(file,
                fmt::format("would give {} soundings a grid of {:.0f} x {:.0f} cells; make {} "
                            "larger, or remove soundings that lie far off",
                            x_m_.size(), across, along, cell_key));
  columns = static_cast<int>(across);
  rows = static_cast<int>(along);
}

std::vector<double> Soundings::heights() const {
  struct Cell {
    double x_m = 0.0, y_m = 0.0, z_m = 0.0;
    std::size_t soundings = 0;
  };
  const auto row_length = static_cast<std::size_t>(columns);
  std::vector<Cell> cells(row_length * static_cast<std::size_t>(rows));
  for (std::size_t i = 0; i < x_m_.size(); ++i) {
    const double east_m = x_m_[i] - west_m, north_m = y_m_[i] - south_m;
    const auto column = static_cast<std::size_t>(east_m / cell_m_),
               row = static_cast<std::size_t>(north_m / cell_m_);
    Cell& cell = cells[std::min(row, static_cast<std::size_t>(rows) - 1) * row_length +
                       std::min(column, row_length - 1)];
    cell.x_m += east_m;
    cell.y_m += north_m;
    cell.z_m += z_m_[i];
    ++cell.soundings;
  }
  std::vector<double> x_m, y_m, z_m;
  std::vector<bool> closed(cells.size());
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const Cell& cell =
          cells[static_cast<std::size_t>(row) * row_length + static_cast<std::size_t>(column)];
      if (cell.soundings == 0) continue;
      const auto count = static_cast<double>(cell.soundings);
      x_m.push_back(cell.x_m / count);
      y_m.push_back(cell.y_m / count);
      z_m.push_back(cell.z_m / count);
      for (int r = std::max(row - closed_cells, 0); r <= std::min(row + closed_cells, rows - 1);
           ++r)
        for (int c = std::max(column - closed_cells, 0);
             c <= std::min(column + closed_cells, columns - 1); ++c)
          closed[static_cast<std::size_t>(r) * row_length + static_cast<std::size_t>(c)] = true;
    }
  cells = {};
  // Soundings on a line are found here, because Qhull would print a message.
  const auto from_first = [&](std::size_t i) {
    return Eigen::Vector2d(x_m[i] - x_m[0], y_m[i] - y_m[0]);
  };
  Eigen::Vector2d longest = from_first(0);
  for (std::size_t i = 1; i < x_m.size(); ++i)
    if (from_first(i).norm() > longest.norm()) longest = from_first(i);
  double twice_area_m2 = 0.0;
  for (std::size_t i = 1; i < x_m.size(); ++i) {
    const Eigen::Vector2d place = from_first(i);
    twice_area_m2 =
        std::max(twice_area_m2, std::abs(longest.x() * place.y() - longest.y() * place.x()));
  }
  if (!(twice_area_m2 > 1e-3 * cell_m_ * longest.norm()))
    refuse_file(file_, "has all its soundings on one line; a survey needs an area");
  constexpr double hole = std::numeric_limits<double>::quiet_NaN();
  // Outside of all triangles the height is the nearest mean within the size of a cell.
  const GDALGridLinearOptions how{
      .nSizeOfStructure = sizeof how, .dfRadius = cell_m_, .dfNoDataValue = hole};
  std::vector<double> heights(closed.size());
  if (GDALGridCreate(GGA_Linear, &how, static_cast<GUInt32>(x_m.size()), x_m.data(), y_m.data(),
                     z_m.data(), 0.0, columns * cell_m_, 0.0, rows * cell_m_,
                     static_cast<GUInt32>(columns), static_cast<GUInt32>(rows), GDT_Float64,
                     heights.data(), nullptr, nullptr) != CE_None)
    refuse_file(file_, "has soundings that make no triangles; is there enough memory?");
  for (std::size_t i = 0; i < heights.size(); ++i)
    if (!closed[i]) heights[i] = hole;
  return heights;
}

}  // namespace ensonify::engine
