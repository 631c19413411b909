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

/// How a sonar sees a target in parts of a run: its body, and its shadow in those parts that show
/// no body.
struct TargetSights {
  Sight body, shadow;
};

/// The record of a part of a run when its files are written (the content of its part.json), or of
/// the whole run. Counts and verification as in RunReport.
struct PartRecord {
  std::string run_xxh128;  ///< hash_of() the plan of its run
  PingRange pings;
  std::string surface;    ///< as in SeafloorOrigin
  std::string code_path;  ///< as SimulatorInternals::code_path()
  LabelNames names;       ///< of the labels in the files
  /// Counts of the seafloor: vertices, faces, repairs. The same for all parts.
  std::map<std::string, std::uint64_t> seafloor;
  /// Pings, rays, hits, starved bins, ...; those of several parts add up.
  std::map<std::string, std::uint64_t> counts;
  std::map<std::string, std::uint64_t> verification;
  std::uint64_t pings_over_hole = 0;
  /// By name of the sonar: how much of the seafloor's objects was seen; empty if that was not
  /// counted.
  std::map<std::string, std::vector<ObjectVisibility>> object_visibility;
  /// By name of the sonar, then by instance.
  std::map<std::string, std::map<std::uint32_t, TargetSights>> target_sights;
  std::vector<std::string> warnings;  ///< about the scene and its track; the same for all parts
  std::vector<FileRecord> files;

  /// Adds the part that follows. Throws SceneError if it was made in another way: with
  /// other code, or over another seafloor.
  PartRecord& operator+=(const PartRecord& next);
  /// All counts, those of the seafloor included.
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
