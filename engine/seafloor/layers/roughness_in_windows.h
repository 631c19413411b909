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

/// The roughness layers of a bed that is made in windows: fields over the whole bed, each prepared
/// when it is first needed, of the statistics that a single transform has. Thread-safe.
class RoughnessInWindows {
 public:
  /// Only the size of the bed is used. Its cells must be square.
  explicit RoughnessInWindows(const Heightfield& whole);

  /// Adds a layer's roughness to a window of the bed. Throws what add_fractal() throws.
  void add(Heightfield& window, const FractalRelief& relief, const LayerDraws& draws);

 private:
  /// Layers may have one number, and so the same draws, but other values.
  using Layer = std::tuple<std::uint64_t, double, double, double>;
  Heightfield whole_;
  std::mutex mutex_;  // of the following
  std::map<Layer, std::unique_ptr<FieldInWindows>> fields_;
};

}  // namespace ensonify::engine
