#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <ensonify/engine/run/parts.h>

namespace ensonify::engine {

/// The request for a run in several parts: the content of its run.json. The bytes of the parts
/// depend on nothing else.
struct RunPlan {
  std::string scene_toml;  ///< all keys, defaults included
  std::uint64_t seed = 0;
  std::string intersector;
  std::string reference;  ///< the coordinate reference system, from world_reference()
  std::size_t verify_pings = 0;
  RunParts parts;
  std::string version, libraries;  ///< program_version(), library_versions()
  /// By key of the scene: the hash of the file that the key names.
  std::map<std::string, std::string> files;
};

/// The plan of a run of this scene. The arguments are members of RunPlan.
RunPlan make_plan(const Scene& scene, const std::string& reference, std::size_t verify_pings,
                  const RunParts& parts);

std::filesystem::path plan_file(const std::filesystem::path& folder);  ///< run.json
std::string plan_json(const RunPlan& plan);
std::string hash_of(const RunPlan& plan);  ///< the hash of plan_json(plan)
/// Reads plan_file(folder). Throws SceneError with the file's name if it is not the plan of a run.
RunPlan read_plan(const std::filesystem::path& folder);

/// What differs between two plans, in words: "sonar.sidescan.range_m was 50 and is 75".
std::vector<std::string> differences(const RunPlan& before, const RunPlan& now);

}  // namespace ensonify::engine
