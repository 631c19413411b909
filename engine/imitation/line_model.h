#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <ensonify/engine/imitation/bed_levels.h>
#include <ensonify/engine/imitation/evidence.h>
#include <ensonify/engine/imitation/tone_map.h>
#include <ensonify/engine/imitation/vehicle_path.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/sonar/instrument/pulse.h>
#include <ensonify/scatter/sea_water.h>

namespace ensonify::engine {

/// Size and cell of a seabed about the middle of a path. It reaches beyond the range on all sides.
struct BedExtent {
  double east_m = 0.0, north_m = 0.0, cell_m = 0.0;
};

/// The numbers of an imitation: the values of its scene that are not defaults.
struct LineModel {
  VehiclePath path;
  RecorderSigns recorder;
  RangeLaw range_law;
  /// What range_slope_db() and grazing_levels_of_sides() find in the recording.
  double range_slope_db = std::numeric_limits<double>::quiet_NaN();
  std::array<GrazingLevels, 2> levels_db{};
  double sound_speed_mps = scatter::nominal_sound_speed_mps, absorption_db_per_m = 0.0;
  double frequency_hz = 400e3, range_m = 50.0, array_length_m = 0.5;
  Pulse pulse{.bandwidth_hz = 20e3};
  std::size_t samples = 0;
  std::size_t unrecorded = 0;  ///< as RecordedPing::unrecorded; a scene cannot state it
  bool port = true, starboard = true;
  /// The recorder's gain for the sediment's own strength; unset: the sonar finds a gain itself.
  std::optional<double> gain_db;
  double ping_gain_db = 0.0;  ///< as ReceiverOptions::ping_gain_db
  double output_noise_db = -60.0;
  double beamwidth_rad = 0.0, tilt_rad = 0.0;  ///< width and axis of the vertical beam
  /// The two-way level of the vertical beam, by side and cell of grazing angle, in dB re its
  /// largest level. Empty: the beam has beamwidth_rad and tilt_rad.
  std::array<std::vector<double>, 2> vertical_db;
  /// Added to the path's altitudes, because the first return may not be the bottom line.
  double altitude_shift_m = 0.0;
  std::string material = "medium sand";
  double height_at_1m_m = 0.01;
  double texture_shape = 0.0;  ///< as Material::texture_shape of the bed's material; 0: none
  double glint_share = 0.0;    ///< as Material::glint_share
  BedExtent bed;
  ToneMap tones;                             ///< of this bed
  std::map<std::string, Evidence> evidence;  ///< by the key's whole name

  bool has_pattern() const { return !vertical_db[0].empty(); }
  Confidence how(const std::string& key) const {
    const auto found = evidence.find(key);
    return found == evidence.end() ? Confidence::assumed : found->second.how;
  }
  bool has_texture() const { return texture_shape > 0.0; }
  double bin_m() const { return range_m / static_cast<double>(samples); }
};

/// The size of the seabed for the model's path and range.
BedExtent bed_extent(const LineModel& model);

/// One key of the scene, with its evidence.
struct FoundKey {
  std::string section, key;
  std::string value;  ///< as TOML
  Evidence evidence;
  std::string name() const { return section.empty() ? key : section + "." + key; }
};
/// All keys of the model's scene, by section. Sections of lists end with the number in the list.
std::vector<FoundKey> found_keys(const LineModel& model);

/// The model's scene, with the content of the files that it names. Its numbers are rounded in the
/// same way as in the files of write_scene().
Scene scene_of(const LineModel& model);
/// Writes scene.toml, navigation.csv and, if the model has a pattern or tones, beam.csv and
/// tones.png. Reading these files gives scene_of().
void write_scene(const LineModel& model, const std::filesystem::path& folder);
/// A dataset recipe with distributions about the model's numbers. Its data folder needs beam.csv.
std::string recipe_text(const LineModel& model);

}  // namespace ensonify::engine
