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

std::string table(const Results& results) {
  std::string text;
  if (!results.pings.empty())
    text +=
        fmt::format("{:<28} {:>9} {:>9} {:>8} {:>17} {:>6}   {}\n", "case", "faces", "rays/ping",
                    "pings/s", "ms/ping (spread)", "ratio", "ms: surface trace echo speckle");
  for (const Measurement& m : results.pings)
    text += fmt::format(
        "{:<28} {:>9} {:>9.0f} {:>8.1f} {:>6.2f} ({:.2f}-{:.2f}) {:>6.2f}   {:.3f} {:.3f} "
        "{:.3f} {:.3f}\n",
        m.name, m.faces, m.rays_per_ping, 1e3 / m.ping_ms.median, m.ping_ms.median,
        m.ping_ms.lowest, m.ping_ms.highest,
        m.ping_ms.median / results.pings.front().ping_ms.median, m.surface_ms, m.trace_ms,
        m.echo_ms, m.speckle_ms);
  if (!results.traces.empty())
    text += fmt::format("{:<38} {:>9} {:>9} {:>9} {:>20} {:>6} {:>14}   {}\n", "trace", "faces",
                        "rays/pair", "build ms", "us/pair (spread)", "ratio", "us: query take",
                        "instruction set");
  for (const TraceMeasurement& m : results.traces)
    text += fmt::format(
        "{:<38} {:>9} {:>9.0f} {:>9.1f} {:>8.0f} ({:.0f}-{:.0f}) {:>6.3f} {:>8.0f} {:>5.0f}   {}\n",
        m.name, m.faces, m.rays, m.build_ms, m.pair_us.median, m.pair_us.lowest, m.pair_us.highest,
        m.ratio, m.query_us.median, m.take_us.median, m.code_path);
  if (!results.refinements.empty())
    text += fmt::format(
        "{:<28} {:>8} {:>7} {:>8} {:>20} {:>20}   {:>33} {:>16} {:>8} {:>7} {:>6}\n", "refinement",
        "faces", "build s", "first ms", "refine ms (spread)", "query ms (spread)",
        "splits (forced) / ecols (blocked)", "active V / F", "exact F", "growth", "B/V");
  for (const RefinementMeasurement& m : results.refinements)
    text += fmt::format(
        "{:<28} {:>8} {:>7.1f} {:>8.2f} {:>7.3f} ({:.3f}-{:.3f}) {:>7.3f} ({:.3f}-{:.3f})   "
        "{:>7.0f} "
        "({:.1f}) / {:>6.0f} ({:.1f}) {:>7} / {:>6} {:>8} {:>7.3f} {:>6.1f}\n",
        m.name, m.faces, m.build_s, m.first_ms, m.refine_ms.median, m.refine_ms.lowest,
        m.refine_ms.highest, m.query_ms.median, m.query_ms.lowest, m.query_ms.highest, m.splits,
        m.forced_splits, m.collapses, m.blocked_collapses, m.active_vertices, m.active_faces,
        m.exact_faces, m.growth, m.bytes_per_vertex);
  if (!results.costs.empty())
    text += fmt::format("{:<36} {:>9} {:>24} {:>24} {:>6}\n", "cost", "faces",
                        "ms/ping without (spread)", "with (spread)", "ratio");
  for (const CostMeasurement& m : results.costs)
    text +=
        fmt::format("{:<36} {:>9} {:>10.2f} ({:.2f}-{:.2f}) {:>10.2f} ({:.2f}-{:.2f}) {:>6.2f}\n",
                    m.name, m.faces, m.without_ms.median, m.without_ms.lowest, m.without_ms.highest,
                    m.with_ms.median, m.with_ms.lowest, m.with_ms.highest, m.ratio);
  return text;
}

std::string json(const Results& results) {
  nlohmann::ordered_json report{{"version", ENSONIFY_VERSION},
                                {"compiler", ENSONIFY_COMPILER},
                                {"processor", processor()},
                                {"cores", std::thread::hardware_concurrency()},
                                {"threads", 1}};
  for (const Measurement& m : results.pings)
    report["cases"].push_back({{"name", m.name},
                               {"faces", m.faces},
                               {"rays_per_ping", m.rays_per_ping},
                               {"instruction_set", m.code_path},
                               {"prepare_s", m.prepare_s},
                               {"pings_per_s", 1e3 / m.ping_ms.median},
                               {"ping_ms", m.ping_ms.median},
                               {"ping_ms_lowest", m.ping_ms.lowest},
                               {"ping_ms_highest", m.ping_ms.highest},
                               {"ratio", m.ping_ms.median / results.pings.front().ping_ms.median},
                               {"surface_ms", m.surface_ms},
                               {"trace_ms", m.trace_ms},
                               {"echo_ms", m.echo_ms},
                               {"speckle_ms", m.speckle_ms}});
  for (const TraceMeasurement& m : results.traces)
    report["traces"].push_back({{"name", m.name},
                                {"faces", m.faces},
                                {"rays", m.rays},
                                {"instruction_set", m.code_path},
                                {"build_ms", m.build_ms},
                                {"query_us", m.query_us.median},
                                {"take_us", m.take_us.median},
                                {"pair_us", m.pair_us.median},
                                {"pair_us_lowest", m.pair_us.lowest},
                                {"pair_us_highest", m.pair_us.highest},
                                {"ratio", m.ratio}});
  for (const RefinementMeasurement& m : results.refinements)
    report["refinements"].push_back({{"name", m.name},
                                     {"faces", m.faces},
                                     {"build_s", m.build_s},
                                     {"bytes_per_vertex", m.bytes_per_vertex},
                                     {"first_ms", m.first_ms},
                                     {"refine_ms", m.refine_ms.median},
                                     {"query_ms", m.query_ms.median},
                                     {"splits", m.splits},
                                     {"forced_splits", m.forced_splits},
                                     {"blocked_collapses", m.blocked_collapses},
                                     {"collapses", m.collapses},
                                     {"active_vertices", m.active_vertices},
                                     {"active_faces", m.active_faces},
                                     {"exact_faces", m.exact_faces},
                                     {"growth", m.growth}});
  for (const CostMeasurement& m : results.costs)
    report["costs"].push_back({{"name", m.name},
                               {"faces", m.faces},
                               {"without_ms", m.without_ms.median},
                               {"with_ms", m.with_ms.median},
                               {"ratio", m.ratio}});
  return report.dump(2) + "\n";
}

}  // namespace ensonify::bench
