#include "report.h"

#include <fstream>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace ensonify::bench {
namespace {

std::string processor() {
  std::ifstream cpus("/proc/cpuinfo");
  for (std::string line; std::getline(cpus, line);)
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  return "unknown";
}

}  // namespace

std::string table(const std::vector<Measurement>& results,
                  const std::vector<TraceMeasurement>& traces) {
  std::string text;
  if (!results.empty())
    text +=
        fmt::format("{:<28} {:>9} {:>9} {:>8} {:>17} {:>6}   {}\n", "case", "faces", "rays/ping",
                    "pings/s", "ms/ping (spread)", "ratio", "ms: surface trace echo speckle");
  for (const Measurement& m : results)
    text += fmt::format(
        "{:<28} {:>9} {:>9.0f} {:>8.1f} {:>6.2f} ({:.2f}-{:.2f}) {:>6.2f}   {:.3f} {:.3f} "
        "{:.3f} {:.3f}\n",
        m.name, m.faces, m.rays_per_ping, 1e3 / m.ping_ms.median, m.ping_ms.median,
        m.ping_ms.lowest, m.ping_ms.highest, m.ping_ms.median / results.front().ping_ms.median,
        m.surface_ms, m.trace_ms, m.echo_ms, m.speckle_ms);
  if (!traces.empty())
    text += fmt::format("{:<38} {:>9} {:>9} {:>20} {:>6}   {}\n", "trace", "rays/pair", "build ms",
                        "us/pair (spread)", "ratio", "instruction set");
  for (const TraceMeasurement& m : traces)
    text += fmt::format("{:<38} {:>9.0f} {:>9.1f} {:>8.0f} ({:.0f}-{:.0f}) {:>6.3f}   {}\n", m.name,
                        m.rays, m.build_ms, m.pair_us.median, m.pair_us.lowest, m.pair_us.highest,
                        m.ratio, m.code_path);
  return text;
}

std::string json(const std::vector<Measurement>& results,
                 const std::vector<TraceMeasurement>& traces) {
  nlohmann::ordered_json report{{"version", ENSONIFY_VERSION},
                                {"compiler", ENSONIFY_COMPILER},
                                {"processor", processor()},
                                {"cores", std::thread::hardware_concurrency()},
                                {"threads", 1}};
  for (const Measurement& m : results)
    report["cases"].push_back({{"name", m.name},
                               {"faces", m.faces},
                               {"rays_per_ping", m.rays_per_ping},
                               {"instruction_set", m.code_path},
                               {"prepare_s", m.prepare_s},
                               {"pings_per_s", 1e3 / m.ping_ms.median},
                               {"ping_ms", m.ping_ms.median},
                               {"ping_ms_lowest", m.ping_ms.lowest},
                               {"ping_ms_highest", m.ping_ms.highest},
                               {"ratio", m.ping_ms.median / results.front().ping_ms.median},
                               {"surface_ms", m.surface_ms},
                               {"trace_ms", m.trace_ms},
                               {"echo_ms", m.echo_ms},
                               {"speckle_ms", m.speckle_ms}});
  for (const TraceMeasurement& m : traces)
    report["traces"].push_back({{"name", m.name},
                                {"rays", m.rays},
                                {"instruction_set", m.code_path},
                                {"build_ms", m.build_ms},
                                {"pair_us", m.pair_us.median},
                                {"pair_us_lowest", m.pair_us.lowest},
                                {"pair_us_highest", m.pair_us.highest},
                                {"ratio", m.ratio}});
  return report.dump(2) + "\n";
}

}  // namespace ensonify::bench
