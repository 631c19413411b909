#include <ensonify/engine/sonar/instrument/presets.h>

#include <array>
#include <cmath>
#include <numbers>

#include <ensonify/scatter/kind_named.h>

namespace ensonify::engine {
namespace {

constexpr double degree = std::numbers::pi / 180.0;
constexpr double sound_speed_mps = 1500.0;

struct PresetRow {
  std::string_view name, instrument;
  double frequency_hz, beamwidth_deg, bandwidth_hz, range_m, source_level_db;
  double vertical_beamwidth_deg, tilt_deg;
  std::string_view documented;
};

// Sources. EdgeTech: frequencies, dual simultaneous chirps and the 4125's range at 600 kHz from the
// manual of the 4200 and a survey report. Klein 3900: frequencies from USGS Data Series 739. Klein
// 5000: frequency, five beams per side and the receiver's bandwidth from its manual and NOAA (one
// of the five beams is simulated).
// clang-format off
constexpr std::array rows{
  // name, instrument,
  //       f Hz    deg   B Hz  range  SL  vert tilt documented
  PresetRow{"edgetech-4200-100-400-low", "EdgeTech 4200, 100/400 kHz",
           100e3, 0.64, 11e3, 500, 215, 50, 20, "frequency_hz"},
  PresetRow{"edgetech-4200-100-400-high", "EdgeTech 4200, 100/400 kHz",
           400e3, 0.30, 35e3, 150, 215, 50, 20, "frequency_hz"},
  PresetRow{"edgetech-4200-300-600-low", "EdgeTech 4200, 300/600 kHz",
           300e3, 0.28, 30e3, 230, 215, 50, 20, "frequency_hz"},
  PresetRow{"edgetech-4200-300-600-high", "EdgeTech 4200, 300/600 kHz",
           600e3, 0.26, 40e3, 120, 215, 50, 20, "frequency_hz"},
  PresetRow{"edgetech-4200-300-900-low", "EdgeTech 4200, 300/900 kHz",
           300e3, 0.28, 30e3, 230, 215, 50, 20, "frequency_hz"},
  PresetRow{"edgetech-4200-300-900-high", "EdgeTech 4200, 300/900 kHz",
           900e3, 0.20, 40e3,  75, 215, 50, 20, "frequency_hz"},
  PresetRow{"edgetech-4125-400-900-low", "EdgeTech 4125, 400/900 kHz",
           400e3, 0.46, 40e3, 150, 210, 50, 20, ""},
  PresetRow{"edgetech-4125-400-900-high", "EdgeTech 4125, 400/900 kHz",
           900e3, 0.28, 75e3,  75, 210, 50, 20, ""},
  PresetRow{"edgetech-4125-600-1600-low", "EdgeTech 4125, 600/1600 kHz",
           600e3, 0.33, 50e3, 120, 210, 50, 20, "frequency_hz"},
  PresetRow{"edgetech-4125-600-1600-high", "EdgeTech 4125, 600/1600 kHz",
          1600e3, 0.20, 80e3,  35, 210, 50, 20, "frequency_hz"},
  PresetRow{"klein-3000-low", "Klein 3000",
           132e3, 0.70, 10e3, 600, 220, 40, 10, ""},
  PresetRow{"klein-3000-high", "Klein 3000",
           445e3, 0.21, 20e3, 150, 220, 40, 10, ""},
  PresetRow{"klein-3900-low", "Klein 3900",
           445e3, 0.21, 20e3, 150, 220, 40, 10, "frequency_hz"},
  PresetRow{"klein-3900-high", "Klein 3900",
           900e3, 0.21, 40e3,  50, 215, 40, 10, "frequency_hz"},
  PresetRow{"klein-5000", "Klein 5000",
           455e3, 0.20, 20e3, 150, 220, 40, 10, "frequency_hz bandwidth_hz"},
  PresetRow{"marine-sonic-300", "Marine Sonic, 300 kHz",
           300e3, 0.80, 30e3, 200, 210, 40, 15, ""},
  PresetRow{"marine-sonic-600", "Marine Sonic, 600 kHz",
           600e3, 0.40, 50e3,  75, 210, 40, 15, ""},
  PresetRow{"marine-sonic-900", "Marine Sonic, 900 kHz",
           900e3, 0.40, 75e3,  40, 210, 40, 15, ""},
  PresetRow{"deepvision-de340", "DeepVision DE340",
           340e3, 0.90, 30e3, 200, 205, 60, 20, ""},
  PresetRow{"deepvision-de680", "DeepVision DE680",
           680e3, 0.70, 60e3, 100, 205, 60, 20, ""},
  PresetRow{"deepvision-de1000", "DeepVision DE1000",
          1000e3, 0.70, 80e3,  50, 205, 60, 20, ""},
};
// clang-format on

Preset preset_of(const PresetRow& row) {
  Preset preset{.name = row.name,
                .instrument = row.instrument,
                .beamwidth_rad = row.beamwidth_deg * degree,
                .documented = row.documented};
  Sonar& sonar = preset.sonar;
  sonar.preset = row.name;
  sonar.frequency_hz = row.frequency_hz;
  sonar.pulse.bandwidth_hz = row.bandwidth_hz;
  sonar.range_m = row.range_m;
  sonar.source_level_db = row.source_level_db;
  sonar.vertical.beamwidth_rad = row.vertical_beamwidth_deg * degree;
  sonar.vertical.tilt_rad = row.tilt_deg * degree;
  // The pattern sinc^2 is one half at 0.443 lambda / L on either side of the axis. The length is
  // rounded to a millimetre.
  const double length_m = 0.886 * sound_speed_mps / row.frequency_hz / preset.beamwidth_rad;
  sonar.array_length_m = std::round(1e3 * length_m) / 1e3;
  // A bin is as long as the pulse's resolution c / 2B or shorter: the number of bins is rounded
  // up to a multiple of 100.
  const double resolution_m = 0.5 * sound_speed_mps / row.bandwidth_hz;
  sonar.bins = 100 * static_cast<int>(std::ceil(row.range_m / resolution_m / 100.0));
  return preset;
}

}  // namespace

std::span<const Preset> presets() {
  static const std::vector<Preset> all = [] {
    std::vector<Preset> made;
    for (const PresetRow& row : rows) made.push_back(preset_of(row));
    return made;
  }();
  return all;
}

std::vector<std::string_view> preset_names() {
  std::vector<std::string_view> names;
  for (const Preset& preset : presets()) names.push_back(preset.name);
  return names;
}

const Sonar& preset_sonar(std::string_view name) {
  return scatter::kind_named(presets(), "preset", name).sonar;
}

}  // namespace ensonify::engine
