#include <ensonify/engine/scene/tables/strength_table_reader.h>

#include <array>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/base/csv_table.h>
#include <ensonify/engine/base/units.h>

namespace ensonify::engine {
namespace {

using scatter::StrengthCurve, scatter::StrengthTable;

enum StrengthColumn : std::size_t { grazing, strength, frequency };
constexpr std::array<CsvColumn, 3> strength_columns = {
    {{"grazing_deg"}, {"strength_db"}, {"frequency_hz", false}}};
constexpr CsvFormat strength_format{.row = "strength", .columns = strength_columns};

/// The value in a column. Throws SceneError if it is not in the range.
double value(const CsvTable& table, std::size_t row, StrengthColumn column, double low,
             double high) {
  const double value = table.at(row, column);
  if (!(value >= low && value <= high))
    throw table.fault(row, fmt::format("{} is {}, expected {} to {}", strength_columns[column].name,
                                       value, low, high));
  return value;
}

std::shared_ptr<const StrengthTable> strengths_of(const CsvTable& table) {
  constexpr const char* sort =
      "sort the rows by frequency_hz, then by grazing_deg, with each angle once";
  std::vector<StrengthCurve> curves;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const double angle_deg = value(table, row, grazing, 0.0, 90.0);
    const double level_db = value(table, row, strength, -200.0, 60.0);
    const double hz = table.has(frequency) ? value(table, row, frequency, 1.0, 1e9) : 0.0;
    if (curves.empty() || hz > curves.back().frequency_hz) {
      if (!curves.empty() && curves.back().grazing_rad.size() < 2)
        throw table.fault(row, "the frequency before has a single angle, expected two at least");
      curves.push_back({.frequency_hz = hz});
    } else if (hz < curves.back().frequency_hz) {
      throw table.fault(row, fmt::format("frequency_hz is {} after {}: {}", hz,
                                         curves.back().frequency_hz, sort));
    } else if (const double before_deg = table.at(row - 1, grazing); angle_deg <= before_deg) {
      throw table.fault(row,
                        fmt::format("grazing_deg is {} after {}: {}", angle_deg, before_deg, sort));
    }
    curves.back().grazing_rad.push_back(angle_deg * degree);
    curves.back().strength_db.push_back(level_db);
  }
  if (curves.back().grazing_rad.size() < 2)
    throw table.fault(table.rows() - 1, "a single angle, expected two at least");
  return std::make_shared<const StrengthTable>(std::move(curves));
}

}  // namespace

std::shared_ptr<const StrengthTable> parse_strength_table(std::string_view text,
                                                          std::string_view name) {
  return strengths_of(CsvTable::parse(text, name, strength_format));
}

std::shared_ptr<const StrengthTable> read_strength_table(const std::filesystem::path& file) {
  return strengths_of(CsvTable::read(file, strength_format));
}

}  // namespace ensonify::engine
