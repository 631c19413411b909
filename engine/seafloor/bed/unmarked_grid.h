#pragma once

#include <filesystem>
#include <list>
#include <span>
#include <string>

namespace ensonify::engine {

/// A text grid that begins with a byte-order mark, which GDAL does not take: a copy without it in
/// GDAL's memory, next to copies of the files beside it.
class UnmarkedGrid {
 public:
  /// Throws refine::MeshError if a file cannot be read.
  UnmarkedGrid(const std::filesystem::path& file,
               std::span<const std::filesystem::path> files_beside);
  ~UnmarkedGrid();
  UnmarkedGrid(const UnmarkedGrid&) = delete;
  UnmarkedGrid& operator=(const UnmarkedGrid&) = delete;

  /// What GDAL opens.
  const std::string& name() const { return copies_.front().name; }

 private:
  /// A file in GDAL's memory, which reads the content in place.
  struct Copy {
    std::string name, content;
  };
  void add(const std::filesystem::path& file, const std::string& stem);

  std::list<Copy> copies_;
};

}  // namespace ensonify::engine
