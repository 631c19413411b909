#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <ensonify/engine/image/label_names.h>
#include <ensonify/engine/image/truth.h>
#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/run/run_plan.h>
#include <ensonify/engine/simulator/ping_all.h>

namespace ensonify::engine {

/// How a sonar sees a target in one or more parts of a run. A part that shows the target's body
/// adds to `body`; a part that shows only the shadow adds to `shadow`.
struct TargetSights {
  Sight body, shadow;
};

/// The record of a part of a run (the content of part.json) or of a whole run. Counts and
/// verification are as in RunReport.
struct PartRecord {
  std::string run_xxh128;  ///< hash_of() the run's plan
  PingRange pings;
  std::string surface;    ///< as in SeafloorOrigin
  std::string code_path;  ///< as SimulatorInternals::code_path()
  LabelNames names;       ///< of the labels in the files
  /// Counts of the seafloor: vertices, faces, repairs. The same for all parts.
  std::map<std::string, std::uint64_t> seafloor;
  /// Pings, rays, hits, starved bins, ...; of several parts the sums.
  std::map<std::string, std::uint64_t> counts;
  std::map<std::string, std::uint64_t> verification;
  std::uint64_t pings_over_hole = 0;
  /// By name of the sonar: how much it saw of each object of the seafloor; empty if not counted.
  std::map<std::string, std::vector<ObjectVisibility>> object_visibility;
  /// By name of the sonar, then by instance.
  std::map<std::string, std::map<std::uint32_t, TargetSights>> target_sights;
  std::vector<std::string> warnings;  ///< about the scene and its track; the same for all parts
  std::vector<FileRecord> files;

  /// Adds the record of the next part. Throws SceneError if the surface, the code path or the
  /// seafloor of that part is another one.
  PartRecord& operator+=(const PartRecord& next);
  /// `counts` and `seafloor` together.
  std::map<std::string, std::uint64_t> all_counts() const;
};

inline constexpr const char* part_json_name = "part.json";
std::string part_json(const PartRecord& record);
/// Throws SceneError with the file's name if it cannot be read.
PartRecord read_part_json(const std::filesystem::path& file);

/// Warnings that follow from the counts of a whole run.
std::vector<std::string> warnings_of(const PartRecord& run, const std::string& intersector);

/// The content of manifest.json of a whole run, with the versions of the program and its libraries.
/// It does not depend on when or where the run was made.
std::string manifest_json(const RunPlan& plan, const PartRecord& run);

}  // namespace ensonify::engine
