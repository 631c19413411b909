#pragma once

#include <filesystem>
#include <vector>

namespace ensonify::engine {

/// The files beside a raster that GDAL opens by itself, found by their names and checked before it
/// does. Each is a regular file (a named pipe would be waited for without end) of a limited size,
/// and lies in the raster's folder or below it, also behind a link. A mask and overviews are TIFF
/// files: GDAL would take any format, also those that name other files and hosts.
class FilesBeside {
 public:
  /// None for a file that is no raster, or cannot be opened. Throws refine::MeshError, which names
  /// the file beside the raster.
  explicit FilesBeside(const std::filesystem::path& raster);

  /// Those that say something about the raster: its metadata (.aux.xml), its mask, its reference
  /// system (.prj) and its place (world files, .tab).
  const std::vector<std::filesystem::path>& read() const { return read_; }
  /// What GDAL_PAM_ENABLED has to be while the raster is open. Without an .aux.xml file GDAL would
  /// look for ERDAS's .aux, which can name other files.
  const char* reads_metadata() const { return has_metadata_ ? "YES" : "NO"; }
  /// ERDAS's .aux, of which GDAL takes overviews when it reads fewer pixels than there are; empty
  /// if there is none.
  const std::filesystem::path& erdas_file() const { return erdas_file_; }

 private:
  std::vector<std::filesystem::path> read_;
  std::filesystem::path erdas_file_;
  bool has_metadata_ = false;
};

}  // namespace ensonify::engine
