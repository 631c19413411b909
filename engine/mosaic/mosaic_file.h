#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <ensonify/refine/atomic_file.h>

class GDALDataset;

namespace ensonify::engine {

/// The type of a GeoTIFF's pixels.
enum class PixelType {
  brightness,  ///< 8 bits; 0 is no data
  value,       ///< float; NaN is no data
  label,       ///< 16 bits; 65535 is no data
};

/// A GeoTIFF of one band that is written block by block, in tiles of 256 x 256 pixels that are
/// compressed without loss. Blocks that are not written have no data and take no space. finish()
/// puts the file in place; without finish() the destructor removes it. All functions throw
/// std::runtime_error if the file cannot be written.
class MosaicFile {
 public:
  /// `corner_m` is the upper left corner of the upper left pixel, east and north, in world
  /// coordinates. `reference` is the coordinate reference system of the world coordinates as WKT;
  /// it may be empty. `texts` become the file's metadata, by name.
  MosaicFile(const std::filesystem::path& file, std::int64_t columns, std::int64_t rows,
             const Eigen::Vector2d& corner_m, double pixel_m, PixelType type,
             const std::string& description, const std::string& reference,
             const std::map<std::string, std::string>& texts);
  ~MosaicFile();
  MosaicFile(const MosaicFile&) = delete;
  MosaicFile& operator=(const MosaicFile&) = delete;

  /// Writes columns x rows pixels from (left, top) on, row by row from the top; NaN: no data.
  void write(std::int64_t left, std::int64_t top, std::int64_t columns, std::int64_t rows,
             std::vector<float> pixels);
  /// Adds overviews and puts the file in place. `progress` is called with the done share of the
  /// overviews. If `progress` returns false, finish() returns false and leaves no file.
  bool finish(const std::function<bool(double share)>& progress);

 private:
  std::filesystem::path file_;
  PixelType type_;
  refine::NewFile new_file_;
  std::unique_ptr<GDALDataset> dataset_;
};

}  // namespace ensonify::engine
