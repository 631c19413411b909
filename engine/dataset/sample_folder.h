#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace ensonify::engine {

/// Where the samples of a dataset lie, and who is at them.
///
///     samples/000003          a finished sample, there at once and whole
///     samples/.000003.0.tmp   one being made
///     samples/.000003.lock    held (flock) by the process that makes it; one that was killed holds
///     nothing tars/000001.tar         samples M to 2M-1, in place of their folders
class SampleFolders {
 public:
  SampleFolders(std::filesystem::path dataset, std::size_t samples_per_tar);

  bool finished(std::size_t sample) const;  ///< as a folder or in its tar
  std::filesystem::path sample(std::size_t number) const;
  std::filesystem::path tar(std::size_t number) const;
  const std::filesystem::path& dataset() const { return dataset_; }

  static std::string name_of(std::size_t sample);  ///< 000003
  /// The name in a tar of a sample's file: `000003.scene.toml`, and of those in its folders
  /// `000003-tiles-NAME_0000.png`, so that WebDataset takes each image with its labels as one
  /// record.
  static std::string name_in_tar(std::size_t sample, const std::string& file);

 private:
  std::filesystem::path dataset_;
  std::size_t samples_per_tar_;
};

/// The right to make something, such as a sample or a tar, as long as this lives. Where the file
/// system knows no locks everybody has it: the bytes are the same, and one of two folders is thrown
/// away.
class Claim {
 public:
  /// None while another process, or another part of this one, has it. Throws std::system_error.
  static std::optional<Claim> try_take(const std::filesystem::path& lock_file);
  Claim(Claim&& other) noexcept;
  Claim& operator=(Claim&&) = delete;
  ~Claim();                                      // takes the file away
  bool exclusive() const { return exclusive_; }  ///< false where there are no locks

 private:
  Claim(std::filesystem::path file, int descriptor)
      : file_(std::move(file)), descriptor_(descriptor) {}
  std::filesystem::path file_;
  int descriptor_;
  bool exclusive_ = true;
};

/// A folder in the making beside the place it is meant for, gone again unless it was put there.
class StagingFolder {
 public:
  explicit StagingFolder(const std::filesystem::path& place);
  ~StagingFolder();
  StagingFolder(const StagingFolder&) = delete;
  StagingFolder& operator=(const StagingFolder&) = delete;
  const std::filesystem::path& path() const { return folder_; }
  /// Brings folders and names to the disk (the files are there) and puts it in place, unless there
  /// is one already.
  void put_in_place();

  static std::filesystem::path lock_of(const std::filesystem::path& place);
  /// Removes what killed makers of this place left; only with an exclusive claim to it.
  static void clear(const std::filesystem::path& place);

 private:
  std::filesystem::path place_, folder_;
};

}  // namespace ensonify::engine
