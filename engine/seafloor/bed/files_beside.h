#pragma once

#include <filesystem>
#include <vector>

namespace ensonify::engine {

/// The files beside a raster that GDAL opens without being asked. This class finds them by their
/// names and checks them before GDAL opens them. Each must be a regular file (GDAL would wait on a
/// named pipe without end) of a limited size, in the raster's folder or below it. If the file is a
/// link, its target must lie there, too. A mask and overviews must be TIFF files, because GDAL
/// would take any format, also formats that name other files and hosts.
class FilesBeside {
 public:
  /// Finds no files beside a file that is no raster or cannot be opened. Throws refine::MeshError
  /// with the name of the refused file.
  explicit FilesBeside(const std::filesystem::path& raster);

  /// The raster's metadata (.aux.xml), mask, reference system (.prj) and place (world files, .tab).
  const std::vector<std::filesystem::path>& read() const { return read_; }
  /// The value of GDAL_PAM_ENABLED while the raster is open. If it were YES without an .aux.xml
  /// file, GDAL would look for an .aux file of ERDAS, which can name other files.
  const char* reads_metadata() const { return has_metadata_ ? "YES" : "NO"; }
  /// The .aux file of ERDAS, of which GDAL takes overviews for lower resolutions; empty: none.
  const std::filesystem::path& erdas_file() const { return erdas_file_; }

 private:
  std::vector<std::filesystem::path> read_;
  std::filesystem::path erdas_file_;
  bool has_metadata_ = false;
};

}  // namespace ensonify::engine
