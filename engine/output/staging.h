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
// One rule removes what killed processes leave: who claims a place removes the temporaries of that
// place. So a staging folder is made only by a process that has claimed its place. A temporary
// file that refine::NewFile writes is removed by the file's next writer.

/// The exclusive right to make a folder or a file at a place, held during this object's life. On a
/// file system without locks every process gets it: two may make the same bytes, and one result is
/// discarded.
class Claim {
 public:
  /// None while another Claim, of this or another process, holds it. Throws std::system_error if
  /// the lock file cannot be made.
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

/// A temporary folder next to its final place. Removed on destruction unless put_in_place().
class StagingFolder {
 public:
  explicit StagingFolder(const std::filesystem::path& place);
  ~StagingFolder();
  StagingFolder(const StagingFolder&) = delete;
  StagingFolder& operator=(const StagingFolder&) = delete;
  const std::filesystem::path& path() const { return folder_; }
  /// Writes folders and names to the disk (the files must already be there) and renames the folder
  /// to its final place, unless that exists already.
  void put_in_place();

  /// Keeps the temporary folder when this object ends.
  void leave() { folder_.clear(); }
  /// Removes it now. `between` is called before each file; what it throws leaves the others to the
  /// next claim.
  void remove(const std::function<void()>& between);

  static std::filesystem::path lock_of(const std::filesystem::path& place);
  /// The temporary folders of a place. If this process holds the lock of the place, killed
  /// processes left them.
  static std::vector<std::filesystem::path> left_behind(const std::filesystem::path& place);
  /// The names of the places in a folder that have a lock or a temporary: of processes that make
  /// them, were killed, or could not remove something.
  static std::set<std::string> places_with_remains(const std::filesystem::path& folder);
  static void remove_left_behind(
      const std::filesystem::path& place, const std::function<void()>& between = [] {});
  /// The claim to a place, after removing the temporary folders that killed processes left there;
  /// none while another process holds it. `between` is called before each file that is removed.
  /// Throws as Claim::try_take(), and what `between` throws.
  static std::optional<Claim> try_claim(
      const std::filesystem::path& place, const std::function<void()>& between = [] {});
  /// The same, but waits while another process holds it. `waiting` is called often, also before
  /// each file that is removed; what it throws ends the waiting.
  static Claim wait_for(const std::filesystem::path& place, const std::function<void()>& waiting);

 private:
  std::filesystem::path place_, folder_;
};

}  // namespace ensonify::engine
