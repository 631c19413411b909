#include <ensonify/engine/scene/tables/vertical_pattern_reader.h>

#include <algorithm>
#include <numeric>

#include <fmt/format.h>

#include <ensonify/engine/base/csv_table.h>
#include <ensonify/engine/base/units.h>

namespace ensonify::engine {
namespace {

enum PatternColumn : std::size_t { depression, both, port, starboard };
constexpr std::array<CsvColumn, 4> pattern_columns = {
    {{"depression_deg"}, {"level_db", false}, {"port_db", false}, {"starboard_db", false}}};
constexpr CsvFormat pattern_format{.row = "level", .columns = pattern_columns};
constexpr double lowest_db = -200.0;

std::vector<VerticalLevel> side_of(const CsvTable& table, PatternColumn column) {
  std::vector<std::size_t> order(table.rows());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t row) { return table.at(row, depression); });
  std::vector<VerticalLevel> levels;
  for (const std::size_t row : order) {
    const double angle_deg = table.at(row, depression), level_db = table.at(row, column);
    if (!(angle_deg >= -90.0 && angle_deg <= 180.0))
      throw table.fault(
          row, fmt::format("depression_deg is {}, expected -90 (straight up) to 180", angle_deg));
    if (!(level_db >= lowest_db && level_db <= 0.0))
      throw table.fault(row, fmt::format("{} is {}, expected {} to 0, which is the pattern's peak",
                                         pattern_columns[column].name, level_db, lowest_db));
    const double depression_rad = angle_deg * degree;
    if (!levels.empty() && levels.back().depression_rad == depression_rad)
      throw table.fault(
          row, fmt::format("depression_deg {} is there twice, expected it once", angle_deg));
    levels.push_back({depression_rad, level_db});
  }
  return levels;
}

std::array<std::vector<VerticalLevel>, 2> pattern_of(const CsvTable& table) {
  const bool apart = table.has(port) && table.has(starboard);
  if (apart == table.has(both) || table.has(port) != table.has(starboard))
    throw table.fault(0, "expected the columns level_db, or port_db and starboard_db");
  if (table.rows() < 2) throw table.fault(0, "a single level, expected two at least");
  if (apart) return {side_of(table, port), side_of(table, starboard)};
  return {side_of(table, both), side_of(table, both)};
}

}  // namespace

std::array<std::vector<VerticalLevel>, 2> parse_vertical_pattern(std::string_view text,
                                                                 std::string_view name) {
  return pattern_of(CsvTable::parse(text, name, pattern_format));
}

std::array<std::vector<VerticalLevel>, 2> read_vertical_pattern(const std::filesystem::path& file) {
  return pattern_of(CsvTable::read(file, pattern_format));
}

}  // namespace ensonify::engine
