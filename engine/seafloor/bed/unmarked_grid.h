#pragma once

#include <filesystem>
#include <list>
#include <span>
#include <string>

namespace ensonify::engine {

/// GDAL does not read a text grid that begins with a byte-order mark. This class keeps a copy of
/// the grid without the mark in GDAL's memory, with copies of the files beside the grid.
class UnmarkedGrid {
 public:
  /// Throws refine::MeshError if a file cannot be read.
  UnmarkedGrid(const std::filesystem::path& file,
               std::span<const std::filesystem::path> files_beside);
  ~UnmarkedGrid();
  UnmarkedGrid(const UnmarkedGrid&) = delete;
  UnmarkedGrid& operator=(const UnmarkedGrid&) = delete;

  /// The name of the copy for GDAL.
  const std::string& name() const { return copies_.front().name; }

 private:
  /// A file in GDAL's memory; GDAL reads `content` in place.
  struct Copy {
    std::string name, content;
  };
  void add(const std::filesystem::path& file, const std::string& stem);

  std::list<Copy> copies_;
};

}  // namespace ensonify::engine
