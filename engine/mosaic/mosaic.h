#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include <ensonify/engine/mosaic/canvas.h>
#include <ensonify/engine/mosaic/recorded_run.h>

namespace ensonify::engine {

/// The layers that a mosaic can show. `brightness` is the amplitude of `sample` divided by the
/// run's mean on the same side at the same ratio of range to height, as a picture shows it. The
/// others are layers of the images. Numbers of `class` and `sediment` are the numbers of the first
/// run; names that only later runs have get the next numbers. The file's metadata have the names,
/// as in attributes.h.
inline constexpr std::array<std::string_view, 8> mosaic_layers{
    "brightness", "sample",   "intensity", "intensity_mean",
    "region",     "sediment", "class",     "instance"};

struct MosaicOptions {
  std::string sonar;     ///< name of the sonar; empty: the runs have only one sonar
  double pixel_m = 0.0;  ///< 0: the larger of bin and spacing of pings, rounded
  Positions positions = Positions::truth;
  std::string layer = "brightness";  ///< one of mosaic_layers
  Overlap overlap = Overlap::newest;
  /// Pixels along each side of the blocks that are computed one after another; 0: chosen so that a
  /// block takes about 100 MB. The mosaic does not depend on it.
  std::int64_t block_px = 0;
  /// Called with the stage ("pings", "blocks", "overviews"), the number of done parts of the stage,
  /// and the number of its parts. If it returns false, the work stops. May be empty.
  std::function<bool(std::string_view stage, std::size_t done, std::size_t of)> progress = {};
};

struct MosaicReport {
  std::int64_t columns = 0, rows = 0;
  double pixel_m = 0.0;
  std::size_t pings = 0;
  bool has_reference = false;  ///< whether the file has a coordinate reference system
};

/// Makes a map of the echoes of one sonar of one or several runs and writes it as a GeoTIFF, north
/// up, in world coordinates.
///
/// Every bin covers the ground halfway to the neighbouring bins and pings. A pixel has the mean of
/// the bins that cover it, or, for labels, the label at the pixel's centre. The ground between
/// pings that are more than four times the usual spacing apart is not covered. The images are read
/// by rows and the mosaic is made by blocks, so memory grows only by about 50 bytes per ping.
///
/// Throws SceneError for runs that are damaged or do not fit together, std::invalid_argument for
/// wrong options, Stopped if `progress` returned false, and std::runtime_error if the file cannot
/// be written. The file appears only when it is complete.
MosaicReport make_mosaic(std::span<const std::filesystem::path> runs,
                         const std::filesystem::path& file, const MosaicOptions& options);

}  // namespace ensonify::engine
