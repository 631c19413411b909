#include "pipeline.h"

#include <unistd.h>

#include <fmt/format.h>

#include <ensonify/engine/run.h>
#include <ensonify/refine/parallel_for.h>

#include "scenes.h"

namespace ensonify::bench {

std::vector<PipelineMeasurement> measure_pipeline(
    std::string_view pattern, bool quick, const std::function<void(std::string_view)>& progress) {
  namespace fs = std::filesystem;
  std::vector<PipelineMeasurement> all;
  const fs::path folder = fs::temp_directory_path() / fmt::format("ensonify-bench-{}", ::getpid());
  for (const auto& [bed, make] : {std::pair{"rippled", &ripples}, std::pair{"smooth", &fractal}})
    for (const int threads : {1, refine::thread_count(0)}) {
      const std::string name = fmt::format("run/{}/2M/{}", bed, threads);
      if (name.find(pattern) == std::string::npos || (!all.empty() && all.back().name == name))
        continue;
      if (progress) progress(name);
      engine::Scene scene = make(quick ? 0.5e6 : 2e6);
      scene.track.pings = quick ? 128 : 960;  // as long as the bed is
      const engine::RunReport report =
          engine::run(scene, folder, {.threads = threads, .cache = folder / "cache"});
      all.push_back({.name = name,
                     .threads = threads,
                     .pings = static_cast<std::size_t>(report.counts.at("pings")),
                     .prepare_s = report.prepare_s,
                     .pings_s = report.pings_s,
                     .files_s = report.files_s,
                     .pings_per_s = static_cast<double>(scene.track.pings) / report.pings_s});
      std::error_code ignored;
      fs::remove_all(folder, ignored);
    }
  return all;
}

}  // namespace ensonify::bench
