#include <ensonify/engine/imitation/line_fit.h>

#include <cmath>
#include <cstdint>

#include <ensonify/engine/comparison/line_source.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/ping_all.h>
#include <ensonify/engine/sonar/reception/recorder.h>

namespace ensonify::engine {

SimulatedLine simulated_line(const LineModel& model, int threads, const AfterPings& after_pings) {
  const Scene scene = scene_of(model);
  Simulator simulator(scene, {.threads = threads});
  const ScenePings pings = ping_all(
      scene, simulator, threads,
      [&](std::span<const Waterfall>, std::size_t done, std::size_t of) { after_pings(done, of); });
  const Waterfall& image = pings.images.front();
  const Recorder& recorder = SimulatorInternals::recorder(simulator, 0);
  SimulatedLine made{{.format = "run",
                      .sonar = image.sonar.name,
                      .frequency_hz = image.sonar.frequency_hz,
                      .samples = static_cast<std::size_t>(image.sonar.bins)},
                     20.0 * std::log10(recorder.gain(0)) -
                         model.range_law.gain_db(image.sonar.bin_m(), model.absorption_db_per_m)};
  RecordedLine& line = made.line;
  add_image_rows(image.sonar.sides, image.pixels.sample, image.rows(), line);
  const double scale = model.recorder.full_scale / recorder.full_scale();
  for (std::vector<float>* side : {&line.port, &line.starboard})
    for (std::size_t i = 0; i < side->size(); ++i)
      (*side)[i] =
          i % line.samples < model.unrecorded ? 0.0f : static_cast<float>(scale * (*side)[i]);
  for (std::size_t row = 0; row < image.rows(); ++row) {
    // The path may lack pings, so the number follows from the time.
    const double number =
        (model.path.t_s[row] - model.path.t_s.front()) / model.path.ping_interval_s;
    line.pings.push_back({.number = static_cast<std::uint64_t>(std::lround(number)),
                          .altitude_m = model.path.altitude_m[row] + model.altitude_shift_m,
                          .range_m = image.sonar.range_m,
                          .samples = line.samples,
                          .unrecorded = model.unrecorded});
  }
  return made;
}

}  // namespace ensonify::engine
