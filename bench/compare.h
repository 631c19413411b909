#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace ensonify::bench {

/// A change of a speedup since an older report: a cell's over static Embree packets, a run's or a
/// dataset's over one thread.
struct Change {
  std::string name;
  double before = 0.0, now = 0.0;
  /// Relative noise of now / before: half the spreads of both reports, added as independent errors.
  double noise = 0.0;
  bool fell() const { return now < before * (1.0 - noise); }
};

/// Every case whose speedup is in both reports. Throws std::runtime_error for JSON that is not a
/// report of this program.
std::vector<Change> compare(const nlohmann::ordered_json& before,
                            const nlohmann::ordered_json& now);

/// A table of the changes; its last line has the number that fell.
std::string table(const std::vector<Change>& changes);

}  // namespace ensonify::bench
