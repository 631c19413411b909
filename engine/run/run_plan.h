#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/simulator/ping_all.h>

namespace ensonify::engine {

/// The parts of a run: consecutive pings that have separate files. The files of a run of one part
/// are NAME.exr, ... in the run's folder; those of a run of several parts are
/// part_0001/NAME_0001.exr, ...
class RunParts {
 public:
  /// `first_pings`: the first ping of each part, ascending from 0. Throws std::invalid_argument if
  /// they do not ascend from 0, or if a part has no pings.
  RunParts(std::vector<std::size_t> first_pings, std::size_t pings);

  std::size_t count() const { return first_pings_.size(); }
  std::size_t pings() const { return pings_; }
  std::span<const std::size_t> first_pings() const { return first_pings_; }
  std::size_t longest() const;  ///< the most pings of a part
  PingRange range(std::size_t part) const;
  std::size_t part_of(std::size_t ping) const;
  /// The number of a part in names, from 0001.
  std::string number(std::size_t part) const;
  std::string folder(std::size_t part) const;  ///< part_0001
  /// The path of a sonar's file in the run's folder: part_0001/SONAR_0001.png.
  std::filesystem::path file(std::size_t part, const std::string& sonar,
                             std::string_view ending) const;

 private:
  std::vector<std::size_t> first_pings_;
  std::size_t pings_;
};

/// The most pings of a part: output.pings_per_file. If this is 0: all pings if their images take at
/// most 1 GiB, otherwise the number of pings whose images take 64 MiB.
std::size_t pings_per_part(const OutputOptions& output, std::span<const Sonar> sonars,
                           std::size_t pings);

/// Parts with `pings_per_part` pings each; the last part may have fewer.
RunParts equal_parts(std::size_t pings, std::size_t pings_per_part);

/// Divides each leg of the track like equal_parts(); no part has pings of two legs.
RunParts parts_of_legs(std::span<const std::size_t> leg_starts, std::size_t pings,
                       std::size_t pings_per_part);

/// The number of pings whose images are in memory at one time: while each thread writes one part,
/// together with its neighbour rows, another part is pinged.
std::size_t pings_in_memory(const Scene& scene, const RunParts& parts, int threads);

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
