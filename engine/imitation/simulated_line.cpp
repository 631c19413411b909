#include <ensonify/engine/imitation/simulated_line.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <string>

#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/ping_all.h>
#include <ensonify/engine/sonar/reception/recorder.h>
#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {

RecordedLine simulated_line(const LineModel& model, const std::filesystem::path& folder,
                            int threads, const AfterPings& after_pings, double* gain_db) {
  const auto write = [&](const char* name, const std::string& text) {
    refine::write_file(folder / name, text);
  };
  write("navigation.csv", navigation_csv(model));
  if (model.has_pattern()) write("beam.csv", beam_csv(model));
  if (!model.tones.steps.empty()) refine::write_file(folder / "tones.png", tones_png(model));
  const std::string text = scene_text(model);
  write("scene.toml", text);
  // The folder is a temporary one: if numbers of the recording make a wrong scene, its name would
  // tell the user nothing.
  const Scene scene = parse_scene(text, "the recording's scene", {}, ScenePaths{folder, {}});
  Simulator simulator(scene, {.threads = threads});
  const ScenePings pings = ping_all(
      scene, simulator, threads,
      [&](std::span<const Waterfall>, std::size_t done, std::size_t of) { after_pings(done, of); });
  const Waterfall& image = pings.images.front();
  const Recorder& recorder = SimulatorInternals::recorder(simulator, 0);
  if (gain_db) {
    const double bin_m = image.sonar.bin_m();
    *gain_db = 20.0 * std::log10(recorder.gain(0)) - model.range_law.spreading * std::log10(bin_m) -
               (model.range_law.absorption ? 2.0 * model.absorption_db_per_m * bin_m : 0.0);
  }
  RecordedLine line{.format = "run",
                    .sonar = image.sonar.name,
                    .frequency_hz = image.sonar.frequency_hz,
                    .samples = static_cast<std::size_t>(image.sonar.bins)};
  const std::size_t bins = line.samples, columns = image.columns();
  const double full_scale = recorder.full_scale(), scale = model.recorder.full_scale / full_scale;
  const auto recorded = [&](std::uint32_t sample) { return static_cast<float>(scale * sample); };
  for (std::size_t row = 0; row < image.rows(); ++row) {
    // The path may leave pings out.
    const double interval_s = model.path.ping_interval_s,
                 number = (model.path.t_s[row] - model.path.t_s.front()) / interval_s;
    line.pings.push_back({.number = static_cast<std::uint64_t>(std::lround(number)),
                          .altitude_m = model.path.altitude_m[row] + model.altitude_shift_m,
                          .range_m = image.sonar.range_m,
                          .samples = bins,
                          .unrecorded = model.unrecorded});
    const auto begin = image.pixels.sample.begin() + static_cast<std::ptrdiff_t>(row * columns);
    const auto half = begin + static_cast<std::ptrdiff_t>(bins);
    if (model.port)
      std::transform(std::make_reverse_iterator(half), std::make_reverse_iterator(begin),
                     std::back_inserter(line.port), recorded);
    if (model.starboard)
      std::transform(model.port ? half : begin, begin + static_cast<std::ptrdiff_t>(columns),
                     std::back_inserter(line.starboard), recorded);
  }
  for (std::vector<float>* side : {&line.port, &line.starboard})
    for (std::size_t first = 0; first < side->size(); first += bins)
      std::fill_n(side->begin() + static_cast<std::ptrdiff_t>(first), model.unrecorded, 0.0f);
  return line;
}

}  // namespace ensonify::engine
