#include <ensonify/engine/seafloor/objects/path_reader.h>

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include <ensonify/engine/base/csv_table.h>

namespace ensonify::engine {
namespace {

constexpr std::array<CsvColumn, 2> path_columns{{{"east_m"}, {"north_m"}}};
constexpr CsvFormat path_format{.row = "point", .columns = path_columns, .max_bytes = 4 << 20};
constexpr double farthest_m = 1e6;

}  // namespace

std::vector<Eigen::Vector2d> read_path(const std::filesystem::path& file) {
  const CsvTable table = CsvTable::read(file, path_format);
  std::vector<Eigen::Vector2d> path;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    path.emplace_back(table.at(row, 0), table.at(row, 1));
    if (path.back().cwiseAbs().maxCoeff() > farthest_m)
      throw table.fault(row, fmt::format("a point at {}, {}, expected at most {:g} m from 0, 0",
                                         path.back().x(), path.back().y(), farthest_m));
  }
  if (path.size() > 1 && std::ranges::count(path, path.front()) == std::ssize(path))
    throw table.fault(1, "the same point again, expected two different points or more");
  if (path.size() < 2) throw table.fault(0, "a single point, expected a path of two or more");
  return path;
}

}  // namespace ensonify::engine
