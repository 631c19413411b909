#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace ensonify::engine {

/// The files of a dataset's samples.
///
///     samples/000003          a finished sample; it appears complete, in one step
///     samples/.000003.0.tmp   a sample in the making
///     samples/.000003.lock    locked (flock) by the process that makes it, until it ends
///     tars/000001.tar         samples M to 2M-1, instead of their folders (M: samples per tar)
class SampleFolders {
 public:
  SampleFolders(std::filesystem::path dataset, std::size_t samples_per_tar);

  bool finished(std::size_t sample) const;  ///< as a folder or in its tar
  std::filesystem::path sample(std::size_t number) const;
  std::filesystem::path tar(std::size_t number) const;
  const std::filesystem::path& dataset() const { return dataset_; }

  static std::string name_of(std::size_t sample);  ///< 000003
  /// The name of a sample's file in a tar: `000003.scene.toml`; a file in a subfolder becomes
  /// `000003-tiles-NAME_0000.png`, so that WebDataset reads each image and its labels as one
  /// record.
  static std::string name_in_tar(std::size_t sample, const std::string& file);

 private:
  std::filesystem::path dataset_;
  std::size_t samples_per_tar_;
};

/// The exclusive right to make a sample or a tar, held during this object's life. On a file system
/// without locks every process gets it: two may make the same bytes, and one result is discarded.
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

  static std::filesystem::path lock_of(const std::filesystem::path& place);
  /// Removes temporary folders that killed processes left; requires an exclusive claim to `place`.
  static void clear(const std::filesystem::path& place);

 private:
  std::filesystem::path place_, folder_;
};

}  // namespace ensonify::engine
