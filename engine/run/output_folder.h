#pragma once

#include <filesystem>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/output/manifest.h>
#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {

/// The folder of a run, made if missing. Removes the files that it wrote, unless the run is kept.
/// Several threads may write.
class OutputFolder {
 public:
  /// A staged folder's files are synced later, all at once, by refine::put_in_place(). Throws
  /// std::system_error if the folder cannot be made or written to.
  OutputFolder(std::filesystem::path folder, bool staged);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  /// Throws std::system_error as refine::write_file() or, if staged, write_staged(), and what
  /// `write_content` throws.
  void write(const std::string& name, const refine::WriteContent& write_content);
  void write(const std::string& name, std::span<const std::byte> content);
  void keep() { kept_ = true; }
  /// By name, whatever the order of writing.
  std::vector<FileRecord> records() const;
  const std::filesystem::path& path() const { return folder_; }
  double disk_s() const { return disk_s_; }  ///< as RunReport::disk_s

 private:
  std::filesystem::path folder_;
  bool staged_;
  bool made_ = false;
  bool kept_ = false;
  std::mutex mutex_;  // of the members below
  double disk_s_ = 0.0;
  std::map<std::string, FileRecord> records_;
};

}  // namespace ensonify::engine
