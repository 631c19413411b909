#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>

#include <ensonify/engine/output/tar.h>

namespace ensonify::engine {

/// Writes tars for WebDataset: FOLDER/GROUP-000000.tar and so on, each with 1000 records of one
/// group of pictures. The files of a record are consecutive; their names are the record's key, a
/// dot and an extension.
class WebDatasetWriter {
 public:
  static constexpr std::size_t records_per_tar = 1000;

  explicit WebDatasetWriter(std::filesystem::path folder) : folder_(std::move(folder)) {}
  /// Adds the file KEY.EXTENSION. The files of a record must be added one after another. Throws as
  /// TarFile.
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
