#include "compare.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace ensonify::bench {
namespace {

using Json = nlohmann::ordered_json;

struct Speedup {
  double median, spread;  // half the spread, relative
};

std::map<std::string, Speedup> speedups(const Json& report) {
  std::map<std::string, Speedup> all;
  try {
    for (const char* list : {"cells", "runs"})
      for (const Json& one : report.value(list, Json::array())) {
        if (!one.value("agrees", true) || !one.contains("speedup")) continue;
        const double median = one.at("speedup");
        const double low = one.at("speedup_low"), high = one.at("speedup_high");
        if (low == 1.0 && high == 1.0) continue;  // what the others are compared with
        all[one.at("name")] = {median, 0.5 * (high - low) / median};
      }
  } catch (const Json::exception& error) {
    throw std::runtime_error(fmt::format("not a report of this program: {}", error.what()));
  }
  return all;
}

}  // namespace

Comparison compare(const Json& before, const Json& now) {
  std::map<std::string, Speedup> old = speedups(before);
  Comparison comparison;
  for (const auto& [name, speedup] : speedups(now)) {
    const auto then = old.find(name);
    if (then == old.end()) {
      comparison.only_now.push_back(name);
      continue;
    }
    comparison.changes.push_back({name, then->second.median, speedup.median,
                                  std::hypot(then->second.spread, speedup.spread)});
    old.erase(then);
  }
  for (const auto& [name, speedup] : old) comparison.only_before.push_back(name);
  return comparison;
}

std::string table(const Comparison& comparison) {
  const std::vector<Change>& changes = comparison.changes;
  std::string text = fmt::format("{:<46} {:>8} {:>8} {:>8} {:>7}\n", "speedup of", "before", "now",
                                 "change", "noise");
  for (const Change& c : changes)
    text +=
        fmt::format("{:<46} {:>8.2f} {:>8.2f} {:>+7.1f}% {:>6.1f}%{}\n", c.name, c.before, c.now,
                    100.0 * (c.now / c.before - 1.0), 100.0 * c.noise, c.fell() ? "  fell" : "");
  text += fmt::format("{} of {} fell by more than the noise\n",
                      std::ranges::count_if(changes, &Change::fell), changes.size());
  for (const auto& [names, where] : {std::pair{&comparison.only_before, "in the older report"},
                                     {&comparison.only_now, "measured now"}})
    if (!names->empty())
      text += fmt::format("{} {} only: {}\n", names->size(), where, fmt::join(*names, ", "));
  return text;
}

}  // namespace ensonify::bench
