#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace ensonify::engine {

// Folders that appear complete, in one step, although several processes may make them:
//
//     000003          a finished folder
//     .000003.0.tmp   the same while it is made
//     .000003.lock    locked (flock) by the process that makes it, until it ends
//
// A killed process leaves temporary folders. The next process that claims the place removes them.
// So a process must claim a place before it makes a staging folder there. A temporary file of
// refine::NewFile is removed by the next process that writes this file.

/// The exclusive right to make a folder or a file at a place, during this object's life. On a file
/// system without locks every process gets the right: then two processes may make the same bytes,
/// and one result is discarded.
class Claim {
 public:
  /// Unset while another Claim, of this or another process, holds the lock file. Throws
  /// std::system_error if the lock file cannot be made.
  static std::optional<Claim> try_take(const std::filesystem::path& lock_file);
  Claim(Claim&& other) noexcept;
  Claim& operator=(Claim&&) = delete;
  ~Claim();                                      ///< removes the lock file
  bool exclusive() const { return exclusive_; }  ///< false on a file system without locks

 private:
  Claim(std::filesystem::path file, int descriptor)
      : file_(std::move(file)), descriptor_(descriptor) {}
  std::filesystem::path file_;
  int descriptor_;
  bool exclusive_ = true;
};

/// A temporary folder next to its final place. The destructor removes the folder, except after
/// put_in_place() or leave().
class StagingFolder {
 public:
  explicit StagingFolder(const std::filesystem::path& place);
  ~StagingFolder();
  StagingFolder(const StagingFolder&) = delete;
  StagingFolder& operator=(const StagingFolder&) = delete;
  const std::filesystem::path& path() const { return folder_; }
  /// Writes folders and names to the disk (the content of the files must already be on the disk)
  /// and renames the folder to its final place. Does not rename it if the final place exists.
  void put_in_place();

  /// The destructor will keep the temporary folder.
  void leave() { folder_.clear(); }
  /// Removes the temporary folder. `between` is called before each file is removed. If `between`
  /// throws, the remaining files stay until the next claim removes them.
  void remove(const std::function<void()>& between);

  /// The lock file of a place.
  static std::filesystem::path lock_of(const std::filesystem::path& place);
  /// The temporary folders of a place. If this process has the claim, killed processes left them.
  static std::vector<std::filesystem::path> left_behind(const std::filesystem::path& place);
  /// The names of the places in a folder that have a lock file or a temporary folder. A process
  /// makes such a place now, was killed, or could not remove something.
  static std::set<std::string> places_with_remains(const std::filesystem::path& folder);
  /// Takes the claim to a place and removes the temporary folders that killed processes left there.
  /// Unset while another process holds the claim. `between` is called before each file is removed.
  /// Throws as Claim::try_take(), and what `between` throws.
  static std::optional<Claim> try_claim(
      const std::filesystem::path& place, const std::function<void()>& between = [] {});
  /// As try_claim(), but waits while another process holds the claim. `waiting` is called every 0.1
  /// s and before each file is removed. It may throw to end the waiting.
  static Claim wait_for(const std::filesystem::path& place, const std::function<void()>& waiting);

 private:
  std::filesystem::path place_, folder_;
};

}  // namespace ensonify::engine
