#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <ensonify/engine/dataset/card.h>
#include <ensonify/engine/output/tar.h>

namespace ensonify::engine {

/// Called often while a merge works. What it throws ends the merge.
using MergeStep = std::function<void(std::string_view stage, std::size_t done, std::size_t of)>;

/// Writes and lists the files that a merge adds to a dataset. Functions throw std::system_error.
class MergedFiles {
 public:
  MergedFiles(std::filesystem::path folder, MergeStep step)
      : step(std::move(step)), folder_(std::move(folder)) {}

  const MergeStep step;

  /// `name` is relative to the dataset's folder.
  void write(const std::string& name, const std::string& text);
  /// Makes a whole folder of the dataset again. fill(path) fills it at a temporary path. If the
  /// merge is stopped before the folder is complete, a hidden folder is left, which the next merge
  /// removes, because removing many files takes long.
  void write_folder(const std::string& name,
                    const std::function<void(const std::filesystem::path&)>& fill);
  /// Writes a file into a folder that is being made.
  static void stage(const std::filesystem::path& file, const std::string& text);
  /// Adds to index() a file that stage() has written.
  void add_to_index(const std::string& name, const std::string& text);
  /// Removes the temporary files and folders that killed merges left.
  void remove_leftovers() const;

  const std::filesystem::path& folder() const { return folder_; }
  /// The files and folders that were written.
  const std::vector<std::filesystem::path>& files() const { return files_; }
  /// The files that croissant.json names.
  const std::vector<IndexFile>& index() const { return index_; }

 private:
  std::filesystem::path folder_;
  std::vector<std::filesystem::path> files_;
  std::vector<IndexFile> index_;
};

/// Writes tars for WebDataset: FOLDER/GROUP-000000.tar and so on, each with 1000 records of one
/// group of pictures. The files of a record are consecutive; their names are KEY.EXTENSION.
class WebDatasetWriter {
 public:
  static constexpr std::size_t records_per_tar = 1000;

  explicit WebDatasetWriter(std::filesystem::path folder) : folder_(std::move(folder)) {}
  /// Adds KEY.EXTENSION. Files of a record must be added one after another. Throws as TarFile.
  void add(const std::string& group_name, const std::string& key, const std::string& extension,
           std::span<const std::byte> content);
  void finish();

 private:
  struct Group {
    std::unique_ptr<TarFile> tar;
    std::string key;
    std::size_t records = 0;
  };
  std::filesystem::path folder_;
  std::map<std::string, Group> groups_;
};

}  // namespace ensonify::engine
