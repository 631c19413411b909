#pragma once

#include <filesystem>
#include <string>

namespace ensonify::engine {

/// A text grid that begins with a byte-order mark, which GDAL does not take: a copy without it in
/// GDAL's memory, next to one of its .prj.
class UnmarkedGrid {
 public:
  /// Throws std::system_error if a file cannot be read.
  explicit UnmarkedGrid(const std::filesystem::path& file);
  ~UnmarkedGrid();
  UnmarkedGrid(const UnmarkedGrid&) = delete;
  UnmarkedGrid& operator=(const UnmarkedGrid&) = delete;

  /// What GDAL opens.
  const std::string& name() const { return name_; }
  /// The file of which a file in GDAL's memory is the copy.
  std::filesystem::path original(const std::string& copy) const;

 private:
  std::filesystem::path file_, reference_file_;  // the latter is empty if there is none
  std::string text_, reference_;                 // GDAL reads them in place
  std::string name_, reference_name_;
};

}  // namespace ensonify::engine
