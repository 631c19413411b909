#include <ensonify/engine/sonar/instrument/presets.h>

#include <array>
#include <cmath>
#include <utility>

#include <ensonify/engine/base/made_once.h>
#include <ensonify/engine/base/units.h>
#include <ensonify/scatter/kind_named.h>
#include <ensonify/scatter/sea_water.h>

namespace ensonify::engine {
namespace {

using scatter::nominal_sound_speed_mps;

struct PresetRow {
  std::string_view name, instrument;
  double frequency_hz, beamwidth_deg;
  PulseKind pulse;
  double bandwidth_hz, pulse_length_ms, range_m, source_level_db;
  double vertical_beamwidth_deg, tilt_deg;
  std::string_view documented;
  int beams = 1;
  double transmitter_m = 0.0;  // 0: the receiver transmits
};

// Sources. EdgeTech: frequencies, dual simultaneous linear FM chirps and the 4125's range at 600
// kHz from the manual of the 4200 (0004842 rev. N, 1.3.2) and a survey report. Klein 3900:
// frequencies from USGS Data Series 739. Klein 5000: frequency, five beams per side and the
// receiver's bandwidth from its manual and NOAA. No document was found for the pulse lengths, the
// source levels, and the beams and transmitter of the Klein 5000. Here the pulse lengths are those
// of a setting for the longest range. The beams of the Klein 5000 are 0.2 m apart, which is its
// resolution at 75 m. Its transmitter gives the outer beams half of its power at 15 m. presets.md
// compares the reach of each preset with its range.
// clang-format off
constexpr std::array rows{
  // name, instrument,
  //       f Hz    deg  pulse           B Hz   ms  range  SL  vert tilt documented
  PresetRow{"edgetech-4200-100-400-low", "EdgeTech 4200, 100/400 kHz",
           100e3, 0.64, PulseKind::lfm, 11e3,   20, 500, 210, 50, 20, "frequency_hz pulse"},
  PresetRow{"edgetech-4200-100-400-high", "EdgeTech 4200, 100/400 kHz",
           400e3, 0.30, PulseKind::lfm, 35e3,   10, 150, 205, 50, 20, "frequency_hz pulse"},
  PresetRow{"edgetech-4200-300-600-low", "EdgeTech 4200, 300/600 kHz",
           300e3, 0.28, PulseKind::lfm, 30e3,   12, 230, 210, 50, 20, "frequency_hz pulse"},
  PresetRow{"edgetech-4200-300-600-high", "EdgeTech 4200, 300/600 kHz",
           600e3, 0.26, PulseKind::lfm, 40e3,    5, 120, 210, 50, 20, "frequency_hz pulse"},
  PresetRow{"edgetech-4200-300-900-low", "EdgeTech 4200, 300/900 kHz",
           300e3, 0.28, PulseKind::lfm, 30e3,   12, 230, 210, 50, 20, "frequency_hz pulse"},
  PresetRow{"edgetech-4200-300-900-high", "EdgeTech 4200, 300/900 kHz",
           900e3, 0.20, PulseKind::lfm, 40e3,    3,  75, 210, 50, 20, "frequency_hz pulse"},
  PresetRow{"edgetech-4125-400-900-low", "EdgeTech 4125, 400/900 kHz",
           400e3, 0.46, PulseKind::lfm, 40e3,   10, 150, 205, 50, 20, ""},
  PresetRow{"edgetech-4125-400-900-high", "EdgeTech 4125, 400/900 kHz",
           900e3, 0.28, PulseKind::lfm, 75e3,    3,  75, 210, 50, 20, ""},
  PresetRow{"edgetech-4125-600-1600-low", "EdgeTech 4125, 600/1600 kHz",
           600e3, 0.33, PulseKind::lfm, 50e3,    5, 120, 210, 50, 20, "frequency_hz pulse"},
  PresetRow{"edgetech-4125-600-1600-high", "EdgeTech 4125, 600/1600 kHz",
          1600e3, 0.20, PulseKind::lfm, 80e3,    3,  35, 210, 50, 20, "frequency_hz pulse"},
  PresetRow{"klein-3000-low", "Klein 3000",
           132e3, 0.70, PulseKind::cw,  10e3,  0.4, 600, 225, 40, 10, ""},
  PresetRow{"klein-3000-high", "Klein 3000",
           445e3, 0.21, PulseKind::cw,  20e3,  0.1, 150, 220, 40, 10, ""},
  PresetRow{"klein-3900-low", "Klein 3900",
           445e3, 0.21, PulseKind::cw,  20e3,  0.1, 150, 220, 40, 10, "frequency_hz"},
  PresetRow{"klein-3900-high", "Klein 3900",
           900e3, 0.21, PulseKind::cw,  40e3, 0.05,  50, 215, 40, 10, "frequency_hz"},
  PresetRow{"klein-5000", "Klein 5000",
           455e3, 0.20, PulseKind::cw,  20e3,  0.1, 150, 220, 40, 10,
           "frequency_hz bandwidth_hz beams", 5, 0.055},
  PresetRow{"marine-sonic-300", "Marine Sonic, 300 kHz",
           300e3, 0.80, PulseKind::cw,  30e3,  0.1, 200, 210, 40, 15, ""},
  PresetRow{"marine-sonic-600", "Marine Sonic, 600 kHz",
           600e3, 0.40, PulseKind::cw,  50e3, 0.02,  75, 210, 40, 15, ""},
  PresetRow{"marine-sonic-900", "Marine Sonic, 900 kHz",
           900e3, 0.40, PulseKind::cw,  75e3, 0.02,  40, 210, 40, 15, ""},
  PresetRow{"deepvision-de340", "DeepVision DE340",
           340e3, 0.90, PulseKind::lfm, 30e3,    2, 200, 205, 60, 20, ""},
  PresetRow{"deepvision-de680", "DeepVision DE680",
           680e3, 0.70, PulseKind::lfm, 60e3,    2, 100, 205, 60, 20, ""},
  PresetRow{"deepvision-de1000", "DeepVision DE1000",
          1000e3, 0.70, PulseKind::lfm, 80e3,    2,  50, 205, 60, 20, ""},
};
// clang-format on

std::vector<Preset> made_presets() {
  std::vector<Preset> made;
  for (const PresetRow& row : rows) {
    Preset& preset = made.emplace_back(Preset{.name = row.name,
                                              .instrument = row.instrument,
                                              .beamwidth_rad = row.beamwidth_deg * degree,
                                              .documented = row.documented});
    Sonar& sonar = preset.sonar;
    sonar.preset = row.name;
    sonar.frequency_hz = row.frequency_hz;
    sonar.pulse = {.kind = row.pulse,
                   .bandwidth_hz = row.bandwidth_hz,
                   .length_s = 1e-3 * row.pulse_length_ms,
                   .window = row.pulse == PulseKind::lfm ? PulseWindow::hann : PulseWindow::none};
    sonar.range_m = row.range_m;
    sonar.source_level_db = row.source_level_db;
    sonar.vertical.beamwidth_rad = row.vertical_beamwidth_deg * degree;
    sonar.vertical.tilt_rad = row.tilt_deg * degree;
    sonar.vertical.floor_db = -30.0;  // typical of a baffled array, towards the surface
    // Recordings show no nulls below the axis: fits to one recording have -13 dB at 69 degrees.
    sonar.vertical.floor_below_db = -13.0;
    // The length is rounded to a millimetre.
    const double length_m = Shading().beam_width_x() * nominal_sound_speed_mps / row.frequency_hz /
                            preset.beamwidth_rad;
    sonar.array_length_m = std::round(1e3 * length_m) / 1e3;
    if (row.transmitter_m > 0.0)
      sonar.receive_array_length_m = std::exchange(sonar.array_length_m, row.transmitter_m);
    sonar.beams = row.beams;
    sonar.focused = row.beams > 1;
    // A bin is as long as the pulse's resolution, c T / 2 of a tone or c / 2B of a sweep, or
    // shorter: the number of bins is rounded up to a multiple of 100.
    const double resolution_m =
        0.5 * nominal_sound_speed_mps *
        (row.pulse == PulseKind::cw ? sonar.pulse.length_s : 1.0 / row.bandwidth_hz);
    sonar.bins = 100 * static_cast<int>(std::ceil(row.range_m / resolution_m / 100.0));
  }
  return made;
}

}  // namespace

std::span<const Preset> presets() { return made_once<made_presets>(); }

std::vector<std::string_view> preset_names() {
  std::vector<std::string_view> names;
  for (const Preset& preset : presets()) names.push_back(preset.name);
  return names;
}

const Sonar& preset_sonar(std::string_view name) {
  return scatter::kind_named(presets(), "preset", name).sonar;
}

}  // namespace ensonify::engine
