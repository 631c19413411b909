#include "report.h"

#include <fstream>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/trace/embree/embree.h>

#include "commit.h"

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
  if (!results.cells.empty())
    text += fmt::format("{:<46} {:>9} {:>8} {:>22} {:>20} {:>8}   {}\n", "whole pings", "faces",
                        "pings/s", "ms/ping (4/5 within)", "faster x (within)", "agrees",
                        "ms: surface trace echo");
  for (const Cell& c : results.cells)
    text += c.agrees()
                ? fmt::format(
                      "{:<46} {:>9} {:>8.0f} {:>8.3f} ({:.3f}-{:.3f}) {:>6.2f} ({:.2f}-{:.2f}) "
                      "{:>8}   {:.3f} {:.3f} {:.3f}\n",
                      c.name, c.faces, 1e3 / c.ping_ms.median, c.ping_ms.median, c.ping_ms.low,
                      c.ping_ms.high, c.speedup.median, c.speedup.low, c.speedup.high, "yes",
                      c.surface_ms, c.trace_ms, c.echo_ms)
                : fmt::format("{:<46} {:>9} not timed, because it disagrees with the reference\n",
                              c.name, c.faces);
  if (results.harness) text += words(*results.harness) + "\n";
  if (!results.runs.empty())
    text += fmt::format("{:<28} {:>8} {:>7} {:>10} {:>10} {:>9} {:>9} {:>9} {:>20}\n",
                        "from scene or recipe to files", "threads", "pings", "prepare s", "pings s",
                        "files s", "pings/s", "samples/s", "faster x (within)");
  for (const PipelineMeasurement& m : results.runs)
    text += fmt::format(
        "{:<28} {:>8} {:>7} {:>10.2f} {:>10.2f} {:>9.2f} {:>9.1f} {:>9} {:>6.2f} ({:.2f}-{:.2f})\n",
        m.name, m.threads, m.pings, m.prepare_s, m.pings_s, m.files_s, m.pings_per_s,
        m.samples > 0 ? fmt::format("{:.2f}", m.samples_per_s) : "", m.speedup.median,
        m.speedup.low, m.speedup.high);
  if (!results.traces.empty())
    text += fmt::format("{:<38} {:>9} {:>9} {:>9} {:>20} {:>6} {:>14}   {}\n", "trace", "faces",
                        "rays/pair", "build ms", "us/pair (spread)", "ratio", "us: query take",
                        "instruction set");
  for (const TraceMeasurement& m : results.traces)
    text += fmt::format(
        "{:<38} {:>9} {:>9.0f} {:>9.1f} {:>8.0f} ({:.0f}-{:.0f}) {:>6.3f} {:>8.0f} {:>5.0f}   {}\n",
        m.name, m.faces, m.rays, m.build_ms, m.pair_us.median, m.pair_us.low, m.pair_us.high,
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
        m.name, m.faces, m.build_s, m.first_ms, m.refine_ms.median, m.refine_ms.low,
        m.refine_ms.high, m.query_ms.median, m.query_ms.low, m.query_ms.high, m.splits,
        m.forced_splits, m.collapses, m.blocked_collapses, m.active_vertices, m.active_faces,
        m.exact_faces, m.growth, m.bytes_per_vertex);
  if (!results.costs.empty())
    text += fmt::format("{:<36} {:>9} {:>24} {:>24} {:>6}\n", "cost", "faces",
                        "ms/ping without (spread)", "with (spread)", "ratio");
  for (const CostMeasurement& m : results.costs)
    text +=
        fmt::format("{:<36} {:>9} {:>10.2f} ({:.2f}-{:.2f}) {:>10.2f} ({:.2f}-{:.2f}) {:>6.2f}\n",
                    m.name, m.faces, m.without_ms.median, m.without_ms.low, m.without_ms.high,
                    m.with_ms.median, m.with_ms.low, m.with_ms.high, m.ratio);
  return text;
}

std::string words(const Harness& harness) {
  return fmt::format(
      "measuring adds {:.2f} us to a ping, {:.2f} % of the fastest cell's {:.0f} us; the stages' "
      "times "
      "account for {:.1f} to {:.1f} % of the pings'",
      harness.ping_us, 100.0 * harness.share(), harness.fastest_ping_us,
      100.0 * harness.stages_over_ping.low, 100.0 * harness.stages_over_ping.high);
}

std::string csv(const Results& results) {
  std::string text =
      "cell,bed,size,faces,surface,intersector,query_pings,instruction_set,rays,pings_per_s,ping_"
      "ms,"
      "ping_ms_low,ping_ms_high,speedup,speedup_low,speedup_high,surface_ms,trace_ms,echo_ms,"
      "prepare_s,first_ping_ms,mesh_mb,progressive_mb,checked_rays";
  for (const std::string_view verdict : engine::verdict_names) text += fmt::format(",{}", verdict);
  text += ",threads,samples,pings,pings_s,files_s,wall_s,samples_per_s\n";
  for (const Cell& c : results.cells) {
    text += fmt::format("{},{},{},{},{},{},{},{},{:.0f},", c.name, c.bed, c.size, c.faces,
                        c.surface, c.intersector, c.query_pings, c.code_path, c.rays);
    if (c.agrees())
      text += fmt::format("{:.1f},{:.4f},{:.4f},{:.4f},{:.3f},{:.3f},{:.3f},{:.4f},{:.4f},{:.4f},",
                          1e3 / c.ping_ms.median, c.ping_ms.median, c.ping_ms.low, c.ping_ms.high,
                          c.speedup.median, c.speedup.low, c.speedup.high, c.surface_ms, c.trace_ms,
                          c.echo_ms);
    else
      text += ",,,,,,,,,,";
    text += fmt::format("{:.2f},{:.3f},{:.1f},{:.1f},{}", c.prepare_s, c.first_ping_ms, c.mesh_mb,
                        c.progressive_mb, c.checked_rays);
    for (const std::uint64_t count : c.verdicts) text += fmt::format(",{}", count);
    text += ",1,,,,,,\n";
  }
  for (const PipelineMeasurement& m : results.runs) {
    text +=
        fmt::format("{},,,,,,,,,{:.1f},,,,{:.3f},{:.3f},{:.3f},,,,{:.2f},,,,", m.name,
                    m.pings_per_s, m.speedup.median, m.speedup.low, m.speedup.high, m.prepare_s);
    text.append(engine::verdict_names.size(), ',');
    text +=
        fmt::format(",{},{},{},{:.2f},{:.2f},{:.2f},{}\n", m.threads,
                    m.samples > 0 ? std::to_string(m.samples) : "", m.pings, m.pings_s, m.files_s,
                    m.wall_s, m.samples > 0 ? fmt::format("{:.3f}", m.samples_per_s) : "");
  }
  return text;
}

nlohmann::ordered_json to_json(const Results& results) {
  nlohmann::ordered_json report{{"version", engine::program_version()},
                                {"commit", ENSONIFY_COMMIT},
                                {"compiler", ENSONIFY_COMPILER},
                                {"libraries", ENSONIFY_LIBRARIES},
                                {"processor", processor()},
                                {"instruction_sets", engine::instruction_sets()},
                                {"cores", std::thread::hardware_concurrency()}};
  for (const Cell& c : results.cells) {
    nlohmann::ordered_json verdicts;
    for (std::size_t i = 0; i < c.verdicts.size(); ++i)
      verdicts[engine::verdict_names[i]] = c.verdicts[i];
    nlohmann::ordered_json cell{{"name", c.name},
                                {"bed", c.bed},
                                {"size", c.size},
                                {"surface", c.surface},
                                {"intersector", c.intersector},
                                {"query_pings", c.query_pings},
                                {"instruction_set", c.code_path},
                                {"faces", c.faces},
                                {"rays", c.rays},
                                {"agrees", c.agrees()},
                                {"verdicts", verdicts},
                                {"prepare_s", c.prepare_s},
                                {"first_ping_ms", c.first_ping_ms},
                                {"mesh_mb", c.mesh_mb},
                                {"progressive_mb", c.progressive_mb}};
    if (c.agrees())
      cell.update({{"pings_per_s", 1e3 / c.ping_ms.median},
                   {"rays_per_s", 1e3 * c.rays / c.ping_ms.median},
                   {"ping_ms", c.ping_ms.median},
                   {"ping_ms_low", c.ping_ms.low},
                   {"ping_ms_high", c.ping_ms.high},
                   {"speedup", c.speedup.median},
                   {"speedup_low", c.speedup.low},
                   {"speedup_high", c.speedup.high},
                   {"surface_ms", c.surface_ms},
                   {"trace_ms", c.trace_ms},
                   {"echo_ms", c.echo_ms},
                   {"stages_over_ping", c.stages_over_ping}});
    report["cells"].push_back(std::move(cell));
  }
  if (results.harness)
    report["harness"] = {{"ping_us", results.harness->ping_us},
                         {"fastest_ping_us", results.harness->fastest_ping_us},
                         {"share", results.harness->share()},
                         {"stages_over_ping", results.harness->stages_over_ping.median},
                         {"stages_over_ping_low", results.harness->stages_over_ping.low},
                         {"stages_over_ping_high", results.harness->stages_over_ping.high},
                         {"words", words(*results.harness)}};
  for (const PipelineMeasurement& m : results.runs) {
    nlohmann::ordered_json run{{"name", m.name},
                               {"threads", m.threads},
                               {"pings", m.pings},
                               {"prepare_s", m.prepare_s},
                               {"pings_s", m.pings_s},
                               {"files_s", m.files_s},
                               {"wall_s", m.wall_s},
                               {"pings_per_s", m.pings_per_s},
                               {"speedup", m.speedup.median},
                               {"speedup_low", m.speedup.low},
                               {"speedup_high", m.speedup.high}};
    if (m.samples > 0) run.update({{"samples", m.samples}, {"samples_per_s", m.samples_per_s}});
    report["runs"].push_back(std::move(run));
  }
  for (const TraceMeasurement& m : results.traces)
    report["traces"].push_back({{"name", m.name},
                                {"faces", m.faces},
                                {"rays", m.rays},
                                {"instruction_set", m.code_path},
                                {"build_ms", m.build_ms},
                                {"query_us", m.query_us.median},
                                {"take_us", m.take_us.median},
                                {"pair_us", m.pair_us.median},
                                {"pair_us_low", m.pair_us.low},
                                {"pair_us_high", m.pair_us.high},
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
  return report;
}

}  // namespace ensonify::bench
