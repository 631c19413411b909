#include <ensonify/engine/comparison/comparison_page.h>
#include <ensonify/engine/comparison/line_source.h>
#include <ensonify/engine/comparison/line_statistics.h>
#include <ensonify/engine/run/files_read.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/refine/atomic_file.h>

#include "app.h"

namespace ensonify::engine::app {
namespace {

struct CompareArguments {
  std::filesystem::path a, b, html;
  std::string sonar_a, sonar_b;
  std::optional<double> limit;
  bool json = false;
};

std::string shown(double value) { return std::isnan(value) ? "-" : fmt::format("{:.4g}", value); }

void compare(const CompareArguments& arguments) {
  if (!arguments.html.empty())
    for (const std::filesystem::path& place : {arguments.a, arguments.b})
      require_not_read(arguments.html, files_of_line(place));
  const SignalWatch signals;
  const auto stop_if_asked = [] { stop_on_signal("stopped on request; nothing was written"); };
  const LineWithBed a(read_line(arguments.a, arguments.sonar_a));
  stop_if_asked();
  const LineWithBed b(read_line(arguments.b, arguments.sonar_b));
  stop_if_asked();
  print_warnings(a.warnings);
  print_warnings(b.warnings);
  nlohmann::ordered_json all = nlohmann::ordered_json::object();
  std::string out = "statistic,a,b,spread_of_a,ratio\n";
  std::string worst;
  std::size_t beyond = 0;
  const std::vector<ComparedStatistic> statistics = compare_lines(a, b, stop_if_asked);
  for (const ComparedStatistic& one : statistics) {
    out += fmt::format("{},{},{},{},{}\n", one.name, shown(one.a), shown(one.b), shown(one.spread),
                       shown(one.ratio()));
    all[one.name] = {
        {"a", one.a}, {"b", one.b}, {"spread_of_a", one.spread}, {"ratio", one.ratio()}};
    if (arguments.limit && one.ratio() > *arguments.limit && ++beyond == 1) worst = one.name;
  }
  if (!arguments.html.empty())
    refine::write_file(arguments.html, comparison_page(arguments.a.string(), a,
                                                       arguments.b.string(), b, statistics));
  if (arguments.json)
    print_object({{"statistics", all}});
  else
    print(out);
  if (beyond > 0)
    throw std::runtime_error(
        fmt::format("{} statistics differ by more than {} times the spread of {}; the first is {}",
                    beyond, *arguments.limit, arguments.a.string(), worst));
}

}  // namespace

void add_compare(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<CompareArguments>();
  CLI::App& command = *app.add_subcommand(
      "compare",
      "Compare how two lines look. A line is a recording (XTF, JSF), the folder of a run (its EXR, "
      "else its XTF or JSF), or a folder of waterfall pictures (PNG, JPEG; port left, newest ping on top). Prints one row per "
      "statistic, with the spread between the halves of A; a ratio is the difference of A and B "
      "over that spread, 'inf' where the halves are equal and B differs. '-': this line has no such "
      "value");
  command.add_option("A", arguments->a, "A recording, a run's folder, or a folder of pictures")
      ->required();
  command.add_option("B", arguments->b, "What is compared with it")->required();
  add_value(command, "--sonar-a", arguments->sonar_a, "NAME",
            "Which line of A: a run's sonar by name, a recording's line by number from 1");
  add_value(command, "--sonar-b", arguments->sonar_b, "NAME", "Which line of B");
  add_value(
      command, "--limit", arguments->limit, "X",
      "Exit code 1 if a ratio is larger than this; unknown ones do not count. Between two lines "
      "of one scene, chance alone makes 2 or 3 ratios in 60 larger than 10, and one line in "
      "four has one larger than 100")
      ->check(number(0.0, 1e6));
  add_value(command, "--html", arguments->html, "FILE",
            "Also write a page with both pictures and the table")
      ->check(a_path());
  command.add_flag("--json", arguments->json,
                   "Print one JSON object; unknown and infinite numbers are null");
  command.callback([&action, arguments] { action = [arguments] { compare(*arguments); }; });
}

}  // namespace ensonify::engine::app
