#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <ensonify/engine/mosaic/image_reader.h>
#include <ensonify/engine/mosaic/placed_side.h>
#include <ensonify/engine/mosaic/recorded_run.h>

namespace ensonify::engine {

/// One side of a ping on the ground, with the values of one layer.
struct ShownSide {
  PlacedSide ground;
  std::vector<float> values;  ///< by bin, near to far
  std::vector<bool> lit;      ///< by bin: whether it is seabed or an object
};

/// One per side that the sonar has, port first.
using ShownPing = std::vector<ShownSide>;

/// Reads pings of runs from their images and places them. It keeps one image open.
class PingSource {
 public:
  /// `layer` is one of mosaic_layers; for `brightness` the values are squared amplitudes over full
  /// scale, after the recorder's gain.
  PingSource(Positions positions, const std::string& layer);

  /// Pings `begin` to `end` - 1 of a run. Throws SceneError for a damaged image.
  std::vector<ShownPing> read(const RecordedRun& run, std::size_t begin, std::size_t end);

 private:
  ShownPing shown(const RecordedRun& run, const MosaicPing& ping, std::size_t row) const;

  Positions positions_;
  bool power_;                       // whether samples become squared amplitudes
  std::vector<std::string> layers_;  // x_m and y_m for the truth, the values, region
  std::size_t value_;                // where the values are; with `region` they are the same
  std::vector<std::vector<float>> rows_;
  std::filesystem::path file_;
  std::unique_ptr<ImageReader> image_;
};

}  // namespace ensonify::engine
