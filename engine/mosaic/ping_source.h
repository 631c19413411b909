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
  std::vector<bool> lit;      ///< by bin: whether the bin shows seabed or an object
};

/// The sides of one ping, one per sector of the sonar.
using ShownPing = std::vector<ShownSide>;

/// Reads pings of runs from the runs' images and places them on the ground. Keeps one image open.
class PingSource {
 public:
  /// `layer` is one of mosaic_layers. For `brightness` the values are squared amplitudes after the
  /// recorder's gain, relative to full scale.
  PingSource(Positions positions, const std::string& layer);

  /// Reads the pings [begin, end) of a run. Throws SceneError for a damaged image.
  std::vector<ShownPing> read(const RecordedRun& run, std::size_t begin, std::size_t end);

 private:
  ShownPing shown(const RecordedRun& run, const MosaicPing& ping, std::size_t row) const;

  Positions positions_;
  bool power_;                       // whether samples become squared amplitudes
  std::vector<std::string> layers_;  // x_m and y_m (only for the truth), the shown layer, region
  std::size_t value_;                // place of the shown layer in layers_
  std::vector<std::vector<float>> rows_;
  std::filesystem::path file_;
  std::unique_ptr<ImageReader> image_;
};

}  // namespace ensonify::engine
