#include <ensonify/engine/scene/tables/profile_reader.h>

#include <array>
#include <vector>

#include <ensonify/engine/base/csv_table.h>

namespace ensonify::engine {
namespace {

constexpr std::array<CsvColumn, 2> profile_columns = {
    {{.name = "depth_m", .alias = "Depth (Meter)"},
     {.name = "soundspeed_mps", .alias = "Sound velocity (Meters per Second)"}}};  // CastAway's
constexpr CsvFormat profile_format{.row = "sample", .columns = profile_columns};

scatter::SoundSpeedProfile profile_of(const CsvTable& table) {
  std::vector<scatter::SoundSpeedSample> samples;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    samples.push_back({.depth_m = table.at(row, 0), .sound_speed_mps = table.at(row, 1)});
    try {
      scatter::check_sound_speed_sample(samples.back());
    } catch (const std::invalid_argument& error) {
      throw table.fault(row, error.what());
    }
  }
  return scatter::SoundSpeedProfile(std::move(samples));
}

}  // namespace

scatter::SoundSpeedProfile parse_profile(std::string_view text, std::string_view name) {
  return profile_of(CsvTable::parse(text, name, profile_format));
}

scatter::SoundSpeedProfile read_profile(const std::filesystem::path& file) {
  return profile_of(CsvTable::read(file, profile_format));
}

}  // namespace ensonify::engine
