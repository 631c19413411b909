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
// receiver's bandwidth from its manual and NOAA. No document was found for the pulse lengths, for
// the source levels, and for the beams and the transmitter of the Klein 5000. Here each pulse
// length is that of a setting for the longest range. The beams of the Klein 5000 are 0.2 m apart,
// which is its resolution at 75 m. Its transmitter gives the outer beams half of its power at 15 m.
// presets.md compares the reach of each preset with its range.
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

struct ImagingRow {
  std::string_view name, instrument;
  double frequency_hz, field_of_view_deg;
  int beams;
  double beamwidth_deg, vertical_beamwidth_deg, tilt_deg, range_m;
  PulseKind pulse;
  double bandwidth_hz, pulse_length_ms;
  bool focused;
  std::string_view documented;
};

// Sources. Oculus and BlueView: third parties' transcriptions of the makers' data sheets. ARIS:
// Sound Metrics' software development kit (frequencies, numbers and spacing of beams, pulse
// lengths), Ocean Networks Canada (vertical beam). Gemini: manual 0703-SOM-00002. No document was
// found for source levels, bandwidths, and whether and where receivers are focused; the ARIS
// focuses with a lens. Ranges are those of usual work: at the documents' longest ranges (120 m for
// the Oculus M750d and the Gemini) a frame would have five million values.
// clang-format off
constexpr std::string_view fan_keys =
    "frequency_hz field_of_view_deg beams array_length_m vertical_beamwidth_deg";
constexpr std::array imaging_rows{
  // name, instrument,
  //     f Hz  fov beams  deg vert tilt range pulse        B Hz    ms focus documented
  ImagingRow{"oculus-m750d-low", "Blueprint Oculus M750d, 750 kHz",
         750e3, 130, 512, 1.0,  20,  0,  30, PulseKind::lfm, 60e3, 1.0, true, fan_keys},
  ImagingRow{"oculus-m750d-high", "Blueprint Oculus M750d, 1.2 MHz",
        1200e3, 130, 512, 0.6,  20,  0,  20, PulseKind::lfm, 80e3, 0.5, true, fan_keys},
  ImagingRow{"oculus-m1200d-low", "Blueprint Oculus M1200d, 1.2 MHz",
        1200e3, 130, 512, 0.6,  20,  0,  20, PulseKind::lfm, 80e3, 0.5, true, fan_keys},
  ImagingRow{"oculus-m1200d-high", "Blueprint Oculus M1200d, 2.1 MHz",
        2100e3,  60, 512, 0.4,  12,  0,  10, PulseKind::lfm, 120e3, 0.3, true, fan_keys},
  ImagingRow{"blueview-m900-130", "Teledyne BlueView M900-130",
         900e3, 130, 768, 1.0,  20,  0,  30, PulseKind::lfm, 60e3, 1.0, true,
         "frequency_hz field_of_view_deg beams vertical_beamwidth_deg"},
  ImagingRow{"aris-1800-low", "Sound Metrics ARIS Explorer 1800, 1.1 MHz",
        1100e3,  28,  96, 0.5,  14,  0,  20, PulseKind::cw,  50e3, 0.020, true,
        "frequency_hz field_of_view_deg beams pulse pulse_length_s"},
  ImagingRow{"aris-1800-high", "Sound Metrics ARIS Explorer 1800, 1.8 MHz",
        1800e3,  28,  96, 0.3,  14,  0,  10, PulseKind::cw, 100e3, 0.010, true,
        "frequency_hz field_of_view_deg beams pulse pulse_length_s"},
  ImagingRow{"aris-3000-low", "Sound Metrics ARIS Explorer 3000, 1.8 MHz",
        1800e3,  30, 128, 0.3,  14,  0,  10, PulseKind::cw, 100e3, 0.010, true,
        "frequency_hz field_of_view_deg beams vertical_beamwidth_deg pulse pulse_length_s"},
  ImagingRow{"aris-3000-high", "Sound Metrics ARIS Explorer 3000, 3.0 MHz",
        3000e3,  30, 128, 0.25, 14,  0,   5, PulseKind::cw, 150e3, 0.006, true,
        "frequency_hz field_of_view_deg beams vertical_beamwidth_deg pulse pulse_length_s"},
  ImagingRow{"gemini-720is", "Tritech Gemini 720is",
         720e3, 120, 512, 1.0,  20, 10,  30, PulseKind::lfm, 60e3, 1.0, true,
         "frequency_hz field_of_view_deg beams array_length_m vertical_beamwidth_deg tilt_deg pulse"},
  ImagingRow{"imagenex-852-echo", "Imagenex 852, echo sounder",
         330e3,  30,   1, 30,   30,  0,  50, PulseKind::cw,  40e3, 0.027, false,
         "frequency_hz array_length_m vertical_beamwidth_deg range_m"},
};
// clang-format on

/// The length of an array with this beam, one way, -3 dB to -3 dB, rounded to a millimetre.
double array_length_m(double beamwidth_rad, double frequency_hz) {
  const double length_m =
      Shading().beam_width_x() * nominal_sound_speed_mps / frequency_hz / beamwidth_rad;
  return std::round(1e3 * length_m) / 1e3;
}

/// A bin is as long as the pulse's resolution, c T / 2 of a tone or c / 2B of a sweep, or shorter:
/// the number of bins is rounded up to a multiple of 100.
int bins_of(const Sonar& sonar) {
  const double resolution_m =
      0.5 * nominal_sound_speed_mps *
      (sonar.pulse.kind == PulseKind::cw ? sonar.pulse.length_s : 1.0 / sonar.pulse.bandwidth_hz);
  return 100 * static_cast<int>(std::ceil(sonar.range_m / resolution_m / 100.0));
}

Preset imaging_preset(const ImagingRow& row) {
  Preset preset{.name = row.name,
                .instrument = row.instrument,
                .beamwidth_rad = row.beamwidth_deg * degree,
                .sonar = usual_sonar(SonarKind::imaging),
                .documented = row.documented};
  Sonar& sonar = preset.sonar;
  sonar.preset = row.name;
  sonar.frequency_hz = row.frequency_hz;
  sonar.field_of_view_rad = row.field_of_view_deg * degree;
  sonar.beams = row.beams;
  // Rounded to 10 micrometres.
  const double length_m = 0.5 * Shading().beam_width_x() * nominal_sound_speed_mps /
                          row.frequency_hz / std::sin(0.5 * preset.beamwidth_rad);
  sonar.array_length_m = std::round(1e5 * length_m) / 1e5;
  sonar.focused = row.focused;
  sonar.vertical.beamwidth_rad = row.vertical_beamwidth_deg * degree;
  sonar.vertical.tilt_rad = row.tilt_deg * degree;
  const double reach_rad = 1.25 * sonar.vertical.beamwidth_rad;
  sonar.sector_low_rad = sonar.vertical.tilt_rad - reach_rad;
  sonar.sector_high_rad = sonar.vertical.tilt_rad + reach_rad;
  sonar.range_m = row.range_m;
  sonar.pulse = {.kind = row.pulse,
                 .bandwidth_hz = row.bandwidth_hz,
                 .length_s = 1e-3 * row.pulse_length_ms,
                 .window = row.pulse == PulseKind::lfm ? PulseWindow::hann : PulseWindow::none};
  sonar.bins = bins_of(sonar);
  return preset;
}

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
    sonar.array_length_m = array_length_m(preset.beamwidth_rad, row.frequency_hz);
    if (row.transmitter_m > 0.0)
      sonar.receive_array_length_m = std::exchange(sonar.array_length_m, row.transmitter_m);
    sonar.beams = row.beams;
    sonar.focused = row.beams > 1;
    sonar.bins = bins_of(sonar);
  }
  for (const ImagingRow& row : imaging_rows) made.push_back(imaging_preset(row));
  return made;
}

}  // namespace

Sonar usual_sonar(SonarKind kind) {
  Sonar sonar;
  if (kind != SonarKind::imaging) return sonar;
  sonar.kind = kind;
  sonar.name = "imaging";
  sonar.frequency_hz = 750e3;
  sonar.source_level_db = 200.0;
  sonar.pulse = {
      .kind = PulseKind::lfm, .bandwidth_hz = 60e3, .length_s = 1e-3, .window = PulseWindow::hann};
  sonar.range_m = 30.0;
  sonar.bins = 1200;
  sonar.array_length_m = 0.1;  // 1 degree
  sonar.beams = 256;
  sonar.field_of_view_rad = 130.0 * degree;
  sonar.focused = true;
  sonar.vertical.beamwidth_rad = 20.0 * degree;
  sonar.vertical.tilt_rad = 0.0;
  sonar.sector_low_rad = -25.0 * degree;
  sonar.sector_high_rad = 25.0 * degree;
  sonar.planes = 8;  // with fewer, a wall that is seen obliquely has gaps in range
  sonar.elevations = 512;
  sonar.receiver.bed_level_db = -30.0;  // walls and glints are far above the bed
  return sonar;
}

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
