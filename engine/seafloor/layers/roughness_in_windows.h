#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <tuple>

#include <ensonify/engine/seafloor/bed/fractal.h>
#include <ensonify/engine/seafloor/bed/height_blocks.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/layers/layer_draws.h>

namespace ensonify::engine {

/// The roughness layers of a bed that is made in windows: fields over the whole bed, with the
/// statistics of one transform. Each field is prepared when it is first needed. Thread-safe.
class RoughnessInWindows {
 public:
  /// Only the size of the bed is used. The cells must be square.
  explicit RoughnessInWindows(const Heightfield& whole);

  /// Adds a layer's roughness to a window of the bed. Throws what add_fractal() throws.
  void add(Heightfield& window, const FractalRelief& relief, const LayerDraws& draws);

 private:
  /// The number of a layer and its values: layers with the same number have the same random
  /// numbers, but may have different values.
  using Layer = std::tuple<std::uint64_t, double, double, double>;
  Heightfield whole_;
  std::mutex mutex_;  // guards fields_
  std::map<Layer, std::unique_ptr<FieldInWindows>> fields_;
};

}  // namespace ensonify::engine
