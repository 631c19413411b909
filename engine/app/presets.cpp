#include <ensonify/engine/sonar/instrument/presets.h>

#include <fmt/format.h>

#include <ensonify/engine/base/units.h>

#include "app.h"

namespace ensonify::engine::app {
namespace {

void print_presets() {
  std::string out =
      "name,instrument,frequency_hz,bandwidth_hz,range_m,bins,source_level_db,array_length_m,"
      "horizontal_beamwidth_deg,vertical_beamwidth_deg,tilt_deg,pulse,pulse_length_s,documented,kind,"
      "field_of_view_deg,beams\n";
  for (const Preset& preset : presets()) {
    const Sonar& s = preset.sonar;
    const auto degrees = [](double rad) { return fmt::format("{:.6g}", rad / degree); };
    out += fmt::format(
        "{},\"{}\",{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", preset.name, preset.instrument,
        s.frequency_hz, s.pulse.bandwidth_hz, s.range_m, s.bins, s.source_level_db,
        s.array_length_m, degrees(preset.beamwidth_rad), degrees(s.vertical.beamwidth_rad),
        degrees(s.vertical.tilt_rad), s.pulse.kind == PulseKind::lfm ? "lfm" : "cw",
        s.pulse.transmitted_length_s(), preset.documented, s.steers() ? "imaging" : "sidescan",
        s.steers() ? degrees(s.field_of_view_rad) : "", s.beams);
  }
  print(out);
}

}  // namespace

void add_presets(CLI::App& app, Action& action) {
  CLI::App& command = *app.add_subcommand(
      "presets",
      "List the instruments for [sonar.NAME] preset = \"...\", one row per instrument (CSV). The "
      "column 'documented' names the keys whose values come from a document; the other values are "
      "typical ones");
  command.callback([&action] { action = print_presets; });
}

}  // namespace ensonify::engine::app
