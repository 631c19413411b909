#include <ensonify/engine/live/live_scene.h>

#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/json_text.h>
#include <ensonify/engine/image/line_layout.h>
#include <ensonify/engine/live/frames.h>
#include <ensonify/engine/sonar/echo/echo.h>
#include <ensonify/scatter/sediment.h>

namespace ensonify::engine {
namespace {

using Json = nlohmann::ordered_json;

Json colours_of(Palette palette) {
  Json colours = Json::array();
  for (int step = 0; step <= 255; ++step)
    for (const double channel : colour_of(palette, step / 255.0))
      colours.push_back(std::lround(255.0 * channel));
  return colours;
}

/// For each line its columns, as in LineLayout, and to which side of the vehicle its sector looks.
Json lines_of(const Sonar& sonar) {
  const LineLayout layout(sonar);
  Json lines = Json::array();
  for (std::size_t sector = 0; sector < layout.sectors(); ++sector)
    lines.push_back({{"name", sonar.sectors()[sector].name},
                     {"first", layout.first_column(sector)},
                     {"mirrored", layout.mirrored(sector)},
                     {"to_starboard", sonar.sectors()[sector].out}});
  return lines;
}

Json to_json(const Sonar& sonar) {
  return {{"name", sonar.name},
          {"sides", name_of(sonar.sides)},
          {"lines", lines_of(sonar)},
          {"bins", sonar.bins},
          {"range_m", sonar.range_m},
          {"bin_m", sonar.bin_m()},
          {"frequency_hz", sonar.frequency_hz},
          {"source_level_db", sonar.source_level_db},
          {"array_length_m", sonar.array_length_m}};
}

}  // namespace

Display line_display(Display display) {
  display.beam_normalisation = display.flat_field = false;
  display.smoothing_px = display.track_smoothing_px = 0.0;
  if (display.mapping == Mapping::equalised) display.mapping = Mapping::gamma;
  display.slant_range_correction = false;  // the page applies this and the palette
  display.speed_correction = false;
  display.palette = Palette::grey;
  return display;
}

std::string keys_without_effect(const Display& display) {
  std::string keys;
  const auto add = [&](bool is_set, std::string_view key) {
    if (is_set) keys += fmt::format("{}display.{}", keys.empty() ? "" : ", ", key);
  };
  add(display.speed_correction, "speed_correction");
  add(display.smoothing_px > 0.0, "smoothing_px");
  add(display.track_smoothing_px > 0.0, "track_smoothing_px");
  add(display.beam_normalisation, "beam_normalisation");
  add(display.flat_field, "flat_field");
  add(display.mapping == Mapping::equalised, "mapping = \"equalised\"");
  if (keys.empty()) return keys;
  return fmt::format(
      "the live view shows one column per bin, line by line, so that it has no {}: pictures of a run "
      "have",
      keys);
}

Bytes setting_frame(const LiveScene& live, const Display& display, const std::string& name) {
  const Simulator& simulator = live.simulator;
  const Display shown = line_display(display);
  Json sonars = Json::array();
  for (const Sonar& sonar : simulator.sonars()) sonars.push_back(to_json(sonar));
  Json colours;
  for (std::size_t i = 0; i < palette_names.size(); ++i)
    colours[palette_names[i]] = colours_of(static_cast<Palette>(i));
  std::vector<std::string> beds;
  for (const Material& material : live.scene.materials) beds.push_back(material.name);
  for (const scatter::NamedSediment& sediment : scatter::named_sediments())
    beds.emplace_back(sediment.name);
  const SeafloorOptions& bed = live.scene.seafloor;
  const Json json{{"scene", name},
                  {"sonars", sonars},
                  {"classes", simulator.classes()},
                  {"materials", simulator.materials()},
                  {"palette", name_of(display.palette)},
                  {"palettes", colours},
                  {"regions", region_names},
                  {"display",
                   {{"gain_db", shown.gain_db},
                    {"gamma", shown.gamma},
                    {"range_db", shown.range_db},
                    {"mapping", shown.mapping == Mapping::gamma ? "gamma" : "logarithmic"},
                    {"ground", display.slant_range_correction},
                    {"mid_amplitude", mid_amplitude}}},
                  {"beds", beds},
                  {"bed",
                   {{"material", bed.material},
                    {"fractal", bed.kind == SeafloorKind::fractal},
                    {"height_at_1m_m", bed.fractal.height_at_1m_m},
                    {"ripple_height_m", bed.ripples.rms_height_m},
                    {"ripple_length_m", bed.ripples.wavelength_m}}},
                  {"faces", simulator.seafloor().faces}};
  return json_frame(FrameKind::setting, json_text(json));
}

}  // namespace ensonify::engine
