#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <ensonify/engine/run/run_control.h>

namespace ensonify::engine {

/// Runs a whole scene into a folder (made if missing): its pings in aligned blocks over the
/// threads, each sonar's picture during the pings, its layers and tables at the end, the manifest
/// last.
///
/// A run of one part (see OutputOptions::pings_per_file) that fails or is stopped removes its
/// files. A run in several parts writes each part's files into a folder of its own while the next
/// ones are made; this folder appears complete, in one step. Its images take the memory of a few
/// parts. After a failure or a stop, or if the process is killed, the same call makes the missing
/// parts, to the same bytes. Several processes may share the folder: each part is made by one.
///
/// Throws Stopped, SceneError (also if the folder holds parts of another run, or a file that the
/// scene names would be overwritten), refine::MeshError, MemoryError, std::invalid_argument as
/// Simulator, std::system_error, std::bad_alloc.
RunReport run(const Scene& scene, const std::filesystem::path& folder, const RunControl& control);

/// What merge_run() found.
struct RunMergeReport {
  std::size_t parts = 0;
  std::vector<std::size_t> missing;   ///< parts, counted from 1
  std::vector<std::string> damaged;   ///< one message per file
  std::vector<std::string> warnings;  ///< of the manifest
};

/// Whether a folder holds a run in several parts, finished or not.
bool is_run_in_parts(const std::filesystem::path& folder);

/// Checks the hash of every file of a run in several parts; if all are there and sound, writes the
/// whole run's pictures, targets and manifest. progress(done, of) counts parts; if it returns
/// false, Stopped is thrown. Throws SceneError for a damaged plan, record or picture,
/// std::system_error.
RunMergeReport merge_run(const std::filesystem::path& folder,
                         const std::function<bool(std::size_t done, std::size_t of)>& progress);

}  // namespace ensonify::engine
