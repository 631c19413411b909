#include <exception>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "cases.h"
#include "costs.h"
#include "measure.h"
#include "refinement.h"
#include "report.h"
#include "traces.h"

int main(int argc, char** argv) try {
  using namespace ensonify::bench;
  CLI::App app("Times pings of ensonify on one thread, case by case");
  std::string filter;
  int rounds = 5, pings = 40;
  bool as_json = false;
  app.add_option("--filter", filter, "only cases whose name holds this");
  app.add_option("--rounds", rounds, "turns through the cases")->check(CLI::Range(1, 1000));
  app.add_option("--pings", pings, "pings a turn")->check(CLI::Range(1, 1000));
  app.add_flag("--json", as_json, "print JSON instead of a table");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  std::vector<Case> cases;
  for (Case& one : all_cases())
    if (one.name.find(filter) != std::string::npos) cases.push_back(std::move(one));
  Results results{.traces = measure_traces(filter, rounds, pings),
                  .refinements = measure_refinement(filter),
                  .costs = measure_costs(filter, rounds, pings)};
  if (cases.empty() && results.traces.empty() && results.refinements.empty() &&
      results.costs.empty()) {
    fmt::print(stderr, "ensonify-bench: no case's name holds '{}'\n", filter);
    return 2;
  }
  results.pings = measure(cases, rounds, pings);
  fmt::print("{}", as_json ? json(results) : table(results));
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "ensonify-bench: {}\n", error.what());
  return 1;
}
