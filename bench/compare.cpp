#include "compare.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include <fmt/format.h>
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
        all[one.at("name")] = {median, 0.5 * (high - low) / median};
      }
  } catch (const Json::exception& error) {
    throw std::runtime_error(fmt::format("not a report of this program: {}", error.what()));
  }
  return all;
}

}  // namespace

std::vector<Change> compare(const Json& before, const Json& now) {
  const std::map<std::string, Speedup> old = speedups(before);
  std::vector<Change> changes;
  for (const auto& [name, speedup] : speedups(now)) {
    const auto then = old.find(name);
    if (then == old.end()) continue;
    changes.push_back({name, then->second.median, speedup.median,
                       std::hypot(then->second.spread, speedup.spread)});
  }
  return changes;
}

std::string table(const std::vector<Change>& changes) {
  std::string text = fmt::format("{:<46} {:>8} {:>8} {:>8} {:>7}\n", "speedup of", "before", "now",
                                 "change", "noise");
  for (const Change& c : changes)
    text +=
        fmt::format("{:<46} {:>8.2f} {:>8.2f} {:>+7.1f}% {:>6.1f}%{}\n", c.name, c.before, c.now,
                    100.0 * (c.now / c.before - 1.0), 100.0 * c.noise, c.fell() ? "  fell" : "");
  return text + fmt::format("{} of {} fell by more than the noise\n",
                            std::ranges::count_if(changes, &Change::fell), changes.size());
}

}  // namespace ensonify::bench
