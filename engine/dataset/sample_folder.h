#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace ensonify::engine {

/// The files of a dataset's samples.
///
///     samples/000003          a finished sample; it appears complete, in one step
///     samples/.000003.0.tmp   the same while it is made
///     samples/.000003.lock    locked (flock) by the process that makes it, until it ends
///     tars/000001.tar         samples M to 2M-1, instead of their folders (M: samples per tar)
class SampleFolders {
 public:
  SampleFolders(std::filesystem::path dataset, std::size_t samples_per_tar);

  bool finished(std::size_t number) const;  ///< as a folder or in its tar
  std::filesystem::path sample(std::size_t number) const;
  std::filesystem::path tar(std::size_t number) const;
  const std::filesystem::path& dataset() const { return dataset_; }

  static std::string name_of(std::size_t sample);  ///< 000003
  /// The name of a sample's file in a tar: `000003.scene.toml`. For a file in a subfolder it is
  /// `000003-tiles-NAME_0000.png`, so that WebDataset reads an image and its labels as one record.
  static std::string name_in_tar(std::size_t sample, const std::string& file);

 private:
  std::filesystem::path dataset_;
  std::size_t samples_per_tar_;
};

}  // namespace ensonify::engine
