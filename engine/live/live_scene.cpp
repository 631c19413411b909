#include <ensonify/engine/live/live_scene.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/json_text.h>
#include <ensonify/engine/image/line_layout.h>
#include <ensonify/engine/live/frames.h>
#include <ensonify/engine/scene/checks/check.h>
#include <ensonify/engine/simulator/internals.h>
#include <ensonify/engine/sonar/echo/echo.h>
#include <ensonify/scatter/sediment.h>

namespace ensonify::engine {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t map_points = 220;     // along the longer side of the map
constexpr std::size_t track_points = 1500;  // on the map, approximately

Bytes from_above(const Simulator& simulator, std::span<const Pose> poses) {
  const refine::Bounds bounds = simulator.seafloor().bounds();
  BedMap map{.lowest = bounds.lowest.head<2>(), .highest = bounds.highest.head<2>()};
  const Eigen::Vector2f size = map.highest - map.lowest;
  const float step = size.maxCoeff() / static_cast<float>(map_points - 1);
  map.columns = static_cast<std::size_t>(std::max(2.0f, std::round(size.x() / step) + 1));
  map.rows = static_cast<std::size_t>(std::max(2.0f, std::round(size.y() / step) + 1));
  for (std::size_t row = 0; row < map.rows; ++row)
    for (std::size_t column = 0; column < map.columns; ++column) {
      // Slightly inwards, so that the outermost points lie on the bed.
      const auto along = [](std::size_t i, std::size_t of) {
        return 0.001 + 0.998 * static_cast<double>(i) / static_cast<double>(of - 1);
      };
      const Eigen::Vector3d place(map.lowest.x() + size.x() * along(column, map.columns),
                                  map.lowest.y() + size.y() * along(row, map.rows), 0.0);
      map.heights_m.push_back(static_cast<float>(-simulator.altitude_m(place)));
    }
  const std::size_t every = 1 + poses.size() / track_points;
  for (std::size_t i = 0; i < poses.size(); i += every)
    map.track.emplace_back(poses[i].position.head<2>().cast<float>());
  map.track.emplace_back(poses.back().position.head<2>().cast<float>());
  return bed_frame(map);
}

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

LiveScene::LiveScene(const Scene& of, const Preparation& how)
    : scene((require_sidescans(of, "the live picture"), of)),
      memory(how.memory),
      simulator(scene, how),
      track(scene, simulator),
      bed(from_above(simulator, track.poses())) {}

Vehicle LiveScene::planned() const {
  const UsualPing& usual = SimulatorInternals::usual_ping(simulator);
  return {usual.altitude_m, usual.speed_mps};
}

std::vector<std::string> LiveScene::warnings() const {
  const std::span<const std::string> of_scene = simulator.warnings();
  std::vector<std::string> all(of_scene.begin(), of_scene.end());
  all.insert(all.end(), track.warnings().begin(), track.warnings().end());
  if (std::string warning = keys_without_effect(scene.display); !warning.empty())
    all.push_back(std::move(warning));
  return all;
}

Extrapolation LiveScene::extrapolation() const {
  return Extrapolation(simulator.sonars(), simulator.materials(), scene.materials);
}

double LiveScene::interval_s() const {
  const std::span<const Pose> poses = track.poses();
  const double between_s = poses.size() > 1 ? poses[1].t_s - poses[0].t_s : 0.0;
  return between_s > 0.0 ? between_s : 0.1;
}

Pose LiveScene::pose_at(double along) const {
  const std::span<const Pose> poses = track.poses();
  const auto i = static_cast<std::size_t>(along);
  const double share = along - static_cast<double>(i);
  Pose pose = poses[i];
  if (share == 0.0 || i + 1 >= poses.size()) return pose;
  const Pose& next = poses[i + 1];
  const auto mix = [&](double a, double b) { return a + share * (b - a); };
  const auto turn = [&](double a, double b) {
    return a + share * std::remainder(b - a, 2.0 * std::numbers::pi);
  };
  pose.position += share * (next.position - pose.position);
  pose.roll_rad = turn(pose.roll_rad, next.roll_rad);
  pose.pitch_rad = turn(pose.pitch_rad, next.pitch_rad);
  pose.heading_rad = turn(pose.heading_rad, next.heading_rad);
  pose.t_s = mix(pose.t_s, next.t_s);
  return pose;
}

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
