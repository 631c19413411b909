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

/// The layers that a mosaic can show. `brightness` is the amplitude of `sample`, relative to the
/// run's mean at the same side, range and height, as a picture shows it; the others are those of
/// the images. Numbers of `class` and `sediment` are those of the first run, and names that only
/// other runs have follow; the file's metadata have the names, as in attributes.h.
inline constexpr std::array<std::string_view, 8> mosaic_layers{
    "brightness", "sample",   "intensity", "intensity_mean",
    "region",     "sediment", "class",     "instance"};

struct MosaicOptions {
  std::string sonar;     ///< its name; empty: the only one
  double pixel_m = 0.0;  ///< 0: the bin or the spacing of pings, whichever is larger, rounded
  Positions positions = Positions::truth;
  std::string layer = "brightness";  ///< one of mosaic_layers
  Overlap overlap = Overlap::newest;
  /// Pixels along each side of the blocks that are computed one after another; 0: chosen for about
  /// 100 MB. It does not change the mosaic.
  std::int64_t block_px = 0;
  /// Called with the stage ("pings", "blocks", "overviews") and how much of it is done. Returning
  /// false stops the work. May be empty.
  std::function<bool(std::string_view stage, std::size_t done, std::size_t of)> progress = {};
};

struct MosaicReport {
  std::int64_t columns = 0, rows = 0;
  double pixel_m = 0.0;
  std::size_t pings = 0;
  bool has_reference = false;  ///< whether the file has a coordinate reference system
};

/// Lays one sonar of one or several runs on the ground and writes a GeoTIFF, north up, in the
/// world's coordinates.
///
/// Every bin covers the ground halfway to the neighbouring bins and pings. A pixel has the mean of
/// the bins that cover it, or, for labels, the label at its centre. Pings farther apart than four
/// times the usual spacing are not joined. The images are read by rows and the mosaic is made by
/// blocks, so memory does not grow with their size, except by about 50 bytes per ping.
///
/// Throws SceneError for runs that are damaged or do not fit together, std::invalid_argument for
/// wrong options, Stopped, and std::runtime_error if the file cannot be written. The file appears
/// only when it is complete.
MosaicReport make_mosaic(std::span<const std::filesystem::path> runs,
                         const std::filesystem::path& file, const MosaicOptions& options);

}  // namespace ensonify::engine
