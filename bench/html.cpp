#include "html.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace ensonify::bench {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view style = R"(<style>
:root { color-scheme: light dark; --paper: #fbfaf7; --ink: #1d2429; --soft: #6b747b; --line: #d9d6ce; }
@media (prefers-color-scheme: dark) {
  :root { --paper: #14181b; --ink: #e4e2dc; --soft: #98a1a8; --line: #333a40; }
}
body { background: var(--paper); color: var(--ink); font: 16px/1.55 Georgia, serif; margin: 2.5rem auto;
       max-width: 62rem; padding: 0 1.5rem; }
h1, h2, h3 { font-weight: normal; line-height: 1.2; } h1 { font-size: 2rem; } h2 { margin-top: 3rem; }
p.note, figcaption, .small { color: var(--soft); font-size: .88rem; }
figure { margin: 1.2rem 0; overflow-x: auto; } .pair { display: flex; flex-wrap: wrap; gap: 1rem 2rem; }
svg text { fill: var(--ink); font: 12px system-ui, sans-serif; } svg .soft { fill: var(--soft); }
svg .grid { stroke: var(--line); stroke-width: 1; } svg .curve { fill: none; stroke-width: 2; }
svg .paper { fill: var(--soft); opacity: .18; }
table { border-collapse: collapse; font: 13px/1.4 system-ui, sans-serif; } td, th { padding: .2rem .7rem; }
th { text-align: left; border-bottom: 1px solid var(--ink); font-weight: 600; }
td { border-bottom: 1px solid var(--line); } td.n { text-align: right; font-variant-numeric: tabular-nums; }
.key { display: inline-flex; flex-wrap: wrap; gap: .2rem 1.1rem; font: 13px system-ui, sans-serif; }
.key i { display: inline-block; width: 1.3rem; height: .5rem; margin-right: .4rem; border-radius: 2px; }
</style>
)";

/// Escapes text for HTML: paths and processor names come from the machine.
std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '&')
      out += "&amp;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

constexpr std::string_view separator = " · ";
std::string scheme_of(const Json& cell) {
  const int query_pings = cell.at("query_pings");
  return fmt::format(
      "{}{}{}{}", cell.at("surface").get<std::string>(), separator,
      cell.at("intersector").get<std::string>(),
      query_pings > 1 ? fmt::format("{}{} pings per query", separator, query_pings) : "");
}

/// The report's cells by bed, size and scheme, in order of first appearance.
class Grid {
 public:
  explicit Grid(const Json& report) {
    if (!report.contains("cells")) return;
    for (const Json& cell : report.at("cells")) {
      cells_.push_back(&cell);
      remember(beds, cell.at("bed"));
      remember(sizes, cell.at("size"));
      remember(schemes, scheme_of(cell));
    }
  }
  const Json* at(const std::string& bed, const std::string& size, const std::string& scheme) const {
    for (const Json* cell : cells_)
      if (cell->at("bed") == bed && cell->at("size") == size && scheme_of(*cell) == scheme)
        return cell;
    return nullptr;
  }
  /// The cell, if it was timed.
  const Json* timed(const std::string& bed, const std::string& size,
                    const std::string& scheme) const {
    const Json* cell = at(bed, size, scheme);
    return cell && cell->at("agrees").get<bool>() ? cell : nullptr;
  }
  bool empty() const { return cells_.empty(); }
  /// One hue per face source and intersector; schemes with several pings per query are dashed.
  std::string colour(const std::string& scheme) const {
    std::vector<std::string> hues;
    for (const std::string& other : schemes) remember(hues, of_one_ping(other));
    const auto place = std::ranges::find(hues, of_one_ping(scheme)) - hues.begin();
    return fmt::format("hsl({} 70% {}%)", 360 * place / std::ssize(hues), place % 2 ? 64 : 50);
  }
  static bool dashed(const std::string& scheme) { return of_one_ping(scheme) != scheme; }
  std::vector<std::string> beds, sizes, schemes;

 private:
  static std::string of_one_ping(const std::string& scheme) {
    const std::size_t intersector = scheme.find(separator) + separator.size();
    return scheme.substr(0, scheme.find(separator, intersector));
  }
  static void remember(std::vector<std::string>& names, const std::string& name) {
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
  std::vector<const Json*> cells_;
};

std::string key(const Grid& grid) {
  std::string out = "<p class=\"key\">";
  for (const std::string& scheme : grid.schemes)
    out += fmt::format(
        "<span><i style=\"background:repeating-linear-gradient(90deg,{0} 0 5px,{1} 5px 8px)\"></i>"
        "{2}</span>",
        grid.colour(scheme), grid.dashed(scheme) ? "transparent" : grid.colour(scheme), scheme);
  return out + "</p>\n";
}

std::string number(double value) {
  if (value >= 100.0) return fmt::format("{:.0f}", value);
  return value >= 10.0 ? fmt::format("{:.1f}", value) : fmt::format("{:.2f}", value);
}

/// Pings per second over faces, both logarithmic; the paper's rate as a band.
std::string rate_chart(const Grid& grid, const std::string& bed) {
  constexpr double width = 430, height = 300, left = 52, right = 12, top = 26, bottom = 34;
  constexpr double lowest = 1.0, highest = 20000.0;
  const auto x = [&](std::size_t size) {
    const double steps = std::max<double>(1.0, static_cast<double>(grid.sizes.size()) - 1.0);
    return left + 18 + (width - left - right - 36) * static_cast<double>(size) / steps;
  };
  const auto y = [&](double rate) {
    const double share =
        std::log(std::clamp(rate, lowest, highest) / lowest) / std::log(highest / lowest);
    return height - bottom - (height - top - bottom) * share;
  };
  std::string out = fmt::format(
      "<svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" role=\"img\"><title>pings per "
      "second "
      "over faces: {2}</title>\n<text x=\"{3}\" y=\"16\">{2}</text>\n",
      width, height, bed, left);
  out += fmt::format(
      "<rect class=\"paper\" x=\"{}\" y=\"{:.1f}\" width=\"{}\" height=\"{:.1f}\"/><text "
      "class=\"soft\" "
      "x=\"{}\" y=\"{:.1f}\">the paper: 1 to 3</text>\n",
      left, y(3.0), width - left - right, y(1.0) - y(3.0), left + 6, y(1.55));
  for (const double rate : {1.0, 10.0, 100.0, 1000.0, 10000.0})
    out += fmt::format(
        "<line class=\"grid\" x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/><text "
        "class=\"soft\" "
        "text-anchor=\"end\" x=\"{}\" y=\"{:.1f}\">{:.0f}</text>\n",
        left, width - right, y(rate), y(rate), left - 6, y(rate) + 4, rate);
  for (std::size_t i = 0; i < grid.sizes.size(); ++i)
    out +=
        fmt::format("<text class=\"soft\" text-anchor=\"middle\" x=\"{:.1f}\" y=\"{}\">{}</text>\n",
                    x(i), height - 12, grid.sizes[i]);
  for (const std::string& scheme : grid.schemes) {
    std::string points, dots;
    for (std::size_t i = 0; i < grid.sizes.size(); ++i)
      if (const Json* cell = grid.timed(bed, grid.sizes[i], scheme)) {
        const double rate = cell->at("pings_per_s");
        points += fmt::format("{:.1f},{:.1f} ", x(i), y(rate));
        dots += fmt::format(
            "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.2\" fill=\"{}\"><title>{}, {}: {} pings/s"
            "</title></circle>",
            x(i), y(rate), grid.colour(scheme), scheme, grid.sizes[i], number(rate));
      }
    out += fmt::format("<polyline class=\"curve\" stroke=\"{}\"{} points=\"{}\"/>{}\n",
                       grid.colour(scheme), grid.dashed(scheme) ? " stroke-dasharray=\"7 4\"" : "",
                       points, dots);
  }
  return out + "</svg>\n";
}

/// Milliseconds per ping by stage, one bar per scheme.
std::string stage_chart(const Grid& grid, const std::string& bed, const std::string& size) {
  constexpr double width = 900, bar = 18, left = 250, right = 80;
  struct Stage {
    const char* key;
    const char* name;
    const char* colour;
  };
  constexpr Stage stages[] = {{"surface_ms", "find faces, build", "hsl(205 55% 52%)"},
                              {"trace_ms", "trace", "hsl(28 75% 55%)"},
                              {"echo_ms", "scatter and bin", "hsl(150 40% 45%)"}};
  std::vector<const Json*> cells;
  double longest = 0.0;
  for (const std::string& scheme : grid.schemes)
    if (const Json* cell = grid.timed(bed, size, scheme)) {
      // Slow schemes would leave no room for the others.
      if (cell->at("ping_ms").get<double>() > 40.0) continue;
      cells.push_back(cell);
      double all_ms = 0.0;
      for (const Stage& stage : stages) all_ms += cell->at(stage.key).get<double>();
      longest = std::max(longest, all_ms);
    }
  if (cells.empty()) return "";
  const double height = 34 + static_cast<double>(cells.size()) * (bar + 6) + 24;
  std::string out = fmt::format(
      "<svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" role=\"img\"><title>stages of a "
      "ping: "
      "{2}, {3}</title>\n<text x=\"0\" y=\"16\">{2}, {3} faces</text>\n",
      width, height, bed, size);
  double legend = left;
  for (const Stage& stage : stages) {
    out += fmt::format(
        "<rect x=\"{0}\" y=\"6\" width=\"11\" height=\"11\" fill=\"{1}\"/><text x=\"{2}\" "
        "y=\"16\">{3}</text>\n",
        legend, stage.colour, legend + 16, stage.name);
    legend += 150;
  }
  double y = 30;
  for (const Json* cell : cells) {
    out += fmt::format("<text text-anchor=\"end\" x=\"{}\" y=\"{:.0f}\">{}</text>", left - 8,
                       y + bar - 5, scheme_of(*cell));
    double x = left;
    for (const Stage& stage : stages) {
      const double wide = (width - left - right) * cell->at(stage.key).get<double>() / longest;
      out += fmt::format(
          "<rect x=\"{:.1f}\" y=\"{:.0f}\" width=\"{:.1f}\" height=\"{}\" fill=\"{}\"><title>{}: "
          "{} ms"
          "</title></rect>",
          x, y, wide, bar, stage.colour, stage.name, number(cell->at(stage.key)));
      x += wide;
    }
    out += fmt::format("<text class=\"soft\" x=\"{:.1f}\" y=\"{:.0f}\">{} ms</text>\n", x + 6,
                       y + bar - 5, number(cell->at("ping_ms")));
    y += bar + 6;
  }
  return out + "</svg>\n";
}

std::string memory_table(const Grid& grid) {
  std::string out =
      "<table><tr><th rowspan=\"2\">bed</th><th rowspan=\"2\">faces</th><th "
      "colspan=\"3\">memory, MB</th><th colspan=\"3\">prepared after, "
      "s</th></tr>\n<tr><th>static</th><th>footprint</th><th>refined</th><th>static</th><th>"
      "footprint</th><th>refined</th></tr>\n";
  for (const std::string& bed : grid.beds)
    for (const std::string& size : grid.sizes) {
      std::string memory, time;
      for (const char* scheme : {"static · embree", "footprint · fan_scan", "refined · embree"}) {
        const Json* cell = grid.at(bed, size, scheme);
        const auto add = [&](std::string& row, double value) {
          row += fmt::format("<td class=\"n\">{}</td>", cell ? number(value) : "");
        };
        add(memory,
            cell ? cell->at("mesh_mb").get<double>() + cell->at("progressive_mb").get<double>()
                 : 0.0);
        add(time, cell ? cell->at("prepare_s").get<double>() : 0.0);
      }
      out += fmt::format("<tr><td>{}</td><td>{}</td>{}{}</tr>\n", bed, size, memory, time);
    }
  return out + "</table>\n";
}

std::string agreement_table(const Json& report) {
  std::string out = "<table><tr><th>cell</th><th>instructions</th>";
  const Json& cells = report.at("cells");
  for (const auto& [verdict, count] : cells.front().at("verdicts").items())
    out += fmt::format("<th>{}</th>", verdict);
  out += "</tr>\n";
  for (const Json& cell : cells) {
    out += fmt::format("<tr><td>{}</td><td>{}</td>", cell.at("name").get<std::string>().substr(5),
                       cell.at("instruction_set").get<std::string>());
    for (const auto& [verdict, count] : cell.at("verdicts").items())
      out += fmt::format("<td class=\"n\">{}</td>", count.get<std::uint64_t>());
    out += "</tr>\n";
  }
  return out + "</table>\n";
}

/// The fastest cell of a bed and size, and the slowest that is not the reference.
std::string verdict_on(const Grid& grid, const std::string& bed, const std::string& size) {
  const Json *best = nullptr, *worst = nullptr;
  for (const std::string& scheme : grid.schemes) {
    const Json* cell = grid.timed(bed, size, scheme);
    if (!cell || cell->at("intersector") == "pluecker") continue;
    const double speedup = cell->at("speedup");
    if (!best || speedup > best->at("speedup").get<double>()) best = cell;
    if (!worst || speedup < worst->at("speedup").get<double>()) worst = cell;
  }
  if (!best) return "";
  std::string tree;
  const Json *fixed = grid.timed(bed, size, "static · embree"),
             *rebuilt = grid.timed(bed, size, "refined · embree");
  if (fixed && rebuilt)
    tree = fmt::format(
        " A tree rebuilt for every ping is {} times as fast as a static one.",
        number(fixed->at("ping_ms").get<double>() / rebuilt->at("ping_ms").get<double>()));
  return fmt::format(
      "<li><b>{}, {}</b>: fastest is {} with {} pings/s, {} times static Embree packets; slowest "
      "{} with {}.{}</li>\n",
      bed, size, scheme_of(*best), number(best->at("pings_per_s")), number(best->at("speedup")),
      scheme_of(*worst), number(worst->at("speedup")), tree);
}

std::string runs_table(const Json& runs) {
  std::string out =
      "<table><tr><th>run</th><th>threads</th><th>pings</th><th>prepare, s</th><th>pings, s</th>"
      "<th>files, s</th><th>pings/s</th><th>samples/s</th><th>faster than on one "
      "thread</th></tr>\n";
  for (const Json& run : runs) {
    out += fmt::format("<tr><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td>",
                       run.at("name").get<std::string>(), run.at("threads").get<int>(),
                       run.at("pings").get<int>());
    for (const char* key :
         {"prepare_s", "pings_s", "files_s", "pings_per_s", "samples_per_s", "speedup"})
      out += fmt::format("<td class=\"n\">{}</td>", run.contains(key) ? number(run.at(key)) : "");
    out += "</tr>\n";
  }
  return out + "</table>\n";
}

std::string costs_table(const Json& costs) {
  std::string out =
      "<table><tr><th>what</th><th>faces</th><th>without, ms/ping</th><th>with, "
      "ms/ping</th><th>ratio</th></tr>\n";
  for (const Json& cost : costs)
    out += fmt::format(
        "<tr><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td "
        "class=\"n\">{}</td></tr>\n",
        cost.at("name").get<std::string>(), cost.at("faces").get<std::uint64_t>(),
        number(cost.at("without_ms")), number(cost.at("with_ms")), number(cost.at("ratio")));
  return out + "</table>\n";
}

}  // namespace

std::string html(const Json& report) {
  const Grid grid(report);
  std::string out =
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\"><title>ensonify: the benchmark</title>\n";
  out += style;
  out += "</head><body>\n<h1>The speed of ensonify's pings</h1>\n";
  std::string sets;
  for (const Json& set : report.at("instruction_sets")) sets += set.get<std::string>() + " ";
  out += fmt::format("<p class=\"note\">ensonify {} ({}), {}; {}.<br>{}, {} cores; {}</p>\n",
                     escaped(report.at("version").get<std::string>()),
                     escaped(report.at("commit").get<std::string>()),
                     escaped(report.at("compiler").get<std::string>()),
                     escaped(report.at("libraries").get<std::string>()),
                     escaped(report.at("processor").get<std::string>()),
                     report.at("cores").get<int>(), sets);
  if (!grid.empty()) {
    out +=
        "<p>A cell is whole pings, two sides of 12 planes, 8 of them across the main lobe, and "
        "4096 elevations: faces found, rays "
        "traced, echoes "
        "scattered and binned, without speckle and noise; on one core, in thread time; "
        "their stages are in wall time, which is longer on a busy machine. "
        "Face sources: "
        "<i>static</i> has all faces in one static tree; <i>refined</i> and <i>footprint</i> "
        "give the exact "
        "faces that the fans can touch, found for every ping or every 8 pings. Speedups are over "
        "the faster of two static Embree packets, with the instructions that give the same bits on "
        "every machine and with this machine's widest registers (<i>embree-best</i>), turn by turn "
        "in one run. Each cell's hits of one ping agreed with an exact reference before it was "
        "timed.";
    if (report.contains("harness"))
      out +=
          fmt::format(" In this report {}.", report.at("harness").at("words").get<std::string>());
    out += "</p>\n<h2>Where each wins and loses</h2>\n<ul>\n";
    for (const std::string& size : grid.sizes)
      for (const std::string& bed : grid.beds) out += verdict_on(grid, bed, size);
    out +=
        "</ul>\n<h2>Pings per second over faces</h2>\n" + key(grid) + "<figure class=\"pair\">\n";
    for (const std::string& bed : grid.beds) out += rate_chart(grid, bed);
    out += "</figure>\n<h2>Where a ping's time goes</h2>\n";
    for (const std::string& size : grid.sizes)
      for (const std::string& bed : grid.beds)
        if (const std::string chart = stage_chart(grid, bed, size); !chart.empty())
          out += "<figure>" + chart + "</figure>\n";
    out +=
        "<h2>Memory, and the time to the first ping</h2>\n<figure>" + memory_table(grid) +
        "</figure>\n<p class=\"note\">Memory without trees: mesh, heights, or the mapped file of the "
        "progressive mesh. Prepared: the seafloor, its analysis for <i>refined</i>, and trees, on "
        "all threads.</p>\n";
  }
  if (report.contains("runs"))
    out +=
        "<h2>From scene or recipe to files</h2>\n<p>A run makes the seafloor, pings over it and "
        "writes its "
        "files; a dataset makes samples of a recipe, including seafloors and labels. Wall "
        "time; pings per second refer to a run's pings, or to a dataset's whole time. A dataset's "
        "stages are summed over threads.</p>\n<figure>" +
        runs_table(report.at("runs")) + "</figure>\n";
  if (report.contains("costs"))
    out +=
        "<h2>Other costs of a ping</h2>\n<p>Pings with and without the effect, alternately, in "
        "thread time: refracted rays, labels, and effects of the signal chain.</p>\n<figure>" +
        costs_table(report.at("costs")) + "</figure>\n";
  if (!grid.empty())
    out +=
        "<h2>Agreement</h2>\n<p>Rays of one ping by verdict, compared with the exact "
        "reference.</p>\n<figure>" +
        agreement_table(report) + "</figure>\n";
  return out + "</body></html>\n";
}

}  // namespace ensonify::bench
