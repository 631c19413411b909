#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <ensonify/engine/run/run_control.h>

namespace ensonify::engine {

/// Runs a whole scene and writes its files into a folder, which is made if it does not exist. The
/// threads compute aligned blocks of pings. Each sonar's picture is written during the pings, its
/// layers and tables after them, and the manifest last.
///
/// A run of one part (see OutputOptions::pings_per_file) that fails or is stopped removes its
/// files. A run in several parts writes the files of each part into a separate folder while the
/// next parts are computed; a folder appears in one step, when it is complete. The images of such a
/// run take the memory of a few parts. After a failure, a stop or a kill, the same call makes the
/// missing parts, with the same bytes. Several processes may run the scene into one folder: each
/// part is made by one of them.
///
/// Throws Stopped, SceneError (also if the folder has parts of another run, or if a file that the
/// scene names would be overwritten), refine::MeshError, MemoryError, std::system_error,
/// std::bad_alloc, and std::invalid_argument in the cases in which Simulator does.
RunReport run(const Scene& scene, const std::filesystem::path& folder, const RunControl& control);

/// What merge_run() found.
struct RunMergeReport {
  std::size_t parts = 0;
  std::vector<std::size_t> missing;   ///< parts, counted from 1
  std::vector<std::string> damaged;   ///< one message per file
  std::vector<std::string> warnings;  ///< the warnings of the manifest
};

/// Whether a folder holds a run in several parts, finished or not.
bool is_run_in_parts(const std::filesystem::path& folder);

/// Checks the hash of every file of a run in several parts. If no file is missing or damaged,
/// writes the pictures, targets and manifest of the whole run. progress(done, of) gets the number
/// of parts checked and of all parts; if it returns false, Stopped is thrown. Throws SceneError for
/// a damaged plan, record or picture, std::system_error.
RunMergeReport merge_run(const std::filesystem::path& folder,
                         const std::function<bool(std::size_t done, std::size_t of)>& progress);

}  // namespace ensonify::engine
