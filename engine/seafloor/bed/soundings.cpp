#include <ensonify/engine/seafloor/bed/soundings.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include <Eigen/Core>
#include <fmt/format.h>
#include <gdal_alg.h>

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {
namespace {

constexpr int closed_cells = 2;  // from one with soundings

[[noreturn]] void refuse_soundings(const std::filesystem::path& file, const std::string& what) {
  throw refine::MeshError(fmt::format("{}: {}", file.string(), what));
}

using Sounding = std::array<double, 3>;

/// The first three numbers of a line.
std::optional<Sounding> sounding_of(std::string_view line) {
  Sounding sounding{};
  for (double& value : sounding) {
    const std::size_t begin = line.find_first_not_of(" \t,;\r");
    if (begin == line.npos) return std::nullopt;
    line.remove_prefix(begin + (line[begin] == '+'));
    const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), value);
    if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
    line.remove_prefix(static_cast<std::size_t>(end - line.data()));
    if (!line.empty() && std::string_view(" \t,;\r").find(line.front()) == line.npos)
      return std::nullopt;
  }
  return sounding;
}

/// Lines that say something, without a byte-order mark.
class Lines {
 public:
  explicit Lines(const std::filesystem::path& file) : in_(file, std::ios::binary) {}

  bool next() {
    while (std::getline(in_, line_)) {
      if (number_++ == 0 && line_.starts_with("\xEF\xBB\xBF")) line_.erase(0, 3);
      const std::size_t begin = line_.find_first_not_of(" \t\r");
      if (begin != line_.npos && line_[begin] != '#') return true;
    }
    return false;
  }
  const std::string& line() const { return line_; }
  std::size_t number() const { return number_; }
  bool at_end() const { return in_.eof(); }

 private:
  std::ifstream in_;
  std::string line_;
  std::size_t number_ = 0;
};

}  // namespace

bool are_soundings(const std::filesystem::path& file) {
  Lines lines(file);
  for (int tried = 0; tried < 2 && lines.next(); ++tried)
    if (sounding_of(lines.line())) return true;
  return false;
}

Soundings::Soundings(const std::filesystem::path& file, double cell_m)
    : file_(file), cell_m_(cell_m) {
  Lines lines(file);
  for (bool first = true; lines.next(); first = false)
    if (const std::optional<Sounding> sounding = sounding_of(lines.line())) {
      if (!(std::abs((*sounding)[2]) <= most_height_m))
        refuse_soundings(file, fmt::format("line {}: a height of {} m; if it marks a missing one, "
                                           "remove the line",
                                           lines.number(), (*sounding)[2]));
      x_m_.push_back((*sounding)[0]);
      y_m_.push_back((*sounding)[1]);
      z_m_.push_back((*sounding)[2]);
    } else if (!first) {  // the first may have the columns' names
      refuse_soundings(
          file, fmt::format("line {}: '{}' does not begin with three numbers, expected x y z",
                            lines.number(), lines.line().substr(0, 40)));
    }
  if (!lines.at_end()) refuse_soundings(file, "cannot be read to its end; check the disk");
  const auto [west, east] = std::ranges::minmax(x_m_);
  const auto [south, north] = std::ranges::minmax(y_m_);
  west_m = std::floor(west / cell_m) * cell_m;
  south_m = std::floor(south / cell_m) * cell_m;
  const double across = std::floor((east - west_m) / cell_m) + 1.0,
               along = std::floor((north - south_m) / cell_m) + 1.0;
  if (!(across >= 2.0 && along >= 2.0))
    refuse_soundings(
        file, fmt::format("has soundings over {:.4g} x {:.4g} m, fewer than 2 x 2 cells of {} m; "
                          "check that they are in metres, or make seafloor.survey_cell_m smaller",
                          east - west, north - south, cell_m));
  const double most = std::min(1000.0 * static_cast<double>(x_m_.size()), 1073741824.0);
  if (!(across * along <= most))
    refuse_soundings(
        file, fmt::format("would give {} soundings a grid of {:.0f} x {:.0f} cells; make "
                          "seafloor.survey_cell_m larger, or remove soundings that lie far off",
                          x_m_.size(), across, along));
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
  // Checked here, because Qhull would print.
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
    refuse_soundings(file_, "has all its soundings on one line; a survey needs an area");
  constexpr double hole = std::numeric_limits<double>::quiet_NaN();
  // Outside of all triangles: the nearest mean within a cell.
  const GDALGridLinearOptions how{
      .nSizeOfStructure = sizeof how, .dfRadius = cell_m_, .dfNoDataValue = hole};
  std::vector<double> heights(closed.size());
  if (GDALGridCreate(GGA_Linear, &how, static_cast<GUInt32>(x_m.size()), x_m.data(), y_m.data(),
                     z_m.data(), 0.0, columns * cell_m_, 0.0, rows * cell_m_,
                     static_cast<GUInt32>(columns), static_cast<GUInt32>(rows), GDT_Float64,
                     heights.data(), nullptr, nullptr) != CE_None)
    refuse_soundings(file_, "has soundings that make no triangles; is there enough memory?");
  for (std::size_t i = 0; i < heights.size(); ++i)
    if (!closed[i]) heights[i] = hole;
  return heights;
}

}  // namespace ensonify::engine
