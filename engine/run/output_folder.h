#pragma once

#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/output/staging.h>
#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {

/// Throws SceneError if the folder contains a file or folder with one of these names.
void require_none_of(const std::filesystem::path& folder, std::span<const std::string> names);

/// The manifest of a run's folder and the files that the manifest lists. Empty if there is no
/// manifest. Only the manifest if it is damaged.
std::vector<std::filesystem::path> files_of_run(const std::filesystem::path& folder);

/// The folder of a run, made if it is missing. The files of an earlier run in it stay until keep()
/// replaces them by the new files, all at once. Without keep(), the new run leaves nothing behind.
/// Several threads may write.
class OutputFolder {
 public:
  /// `staged`: the caller moves the whole folder to its place later, with refine::put_in_place().
  /// Throws std::system_error if the folder cannot be made or written to.
  OutputFolder(std::filesystem::path folder, bool staged);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  /// Begins a run of one part. Throws SceneError while another process makes a run there,
  /// std::system_error.
  void begin();
  /// Throws SceneError if the folder contains a file or folder with one of these names that no
  /// earlier run in this folder has made.
  void require_own(std::span<const std::string> names) const;
  /// Throws std::system_error as refine::write_staged(), and what `write_content` throws.
  void write(const std::string& name, const refine::WriteContent& write_content);
  void write(const std::string& name, std::span<const std::byte> content);
  void write(const std::string& name, std::string_view text);
  /// Writes a file that is visible while the run lasts; write() replaces it later. Does nothing if
  /// the folder has a finished run, whose files must stay until keep(). Throws as
  /// refine::write_file().
  void show(const std::string& name, std::span<const std::byte> content);
  /// Puts the files in place, the manifest last. Throws std::system_error.
  void keep();
  /// The records of the written files, ordered by name.
  std::vector<FileRecord> records() const;
  double disk_s() const { return disk_s_; }  ///< as RunReport::disk_s

 private:
  void replace_earlier_run();

  std::filesystem::path folder_;
  bool staged_;
  std::vector<std::filesystem::path> made_;
  bool kept_ = false;
  bool holds_earlier_run_ = false;
  bool after_killed_ = false;  // begin() found the temporary folder of a killed run
  std::optional<Claim> claim_;
  std::optional<StagingFolder> staging_;  // where the files are until they are kept
  std::set<std::string> shown_;
  std::mutex mutex_;  // guards the members below
  double disk_s_ = 0.0;
  std::map<std::string, FileRecord> records_;
};

}  // namespace ensonify::engine
