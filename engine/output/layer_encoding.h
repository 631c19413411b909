#pragma once

#include <string>
#include <vector>

namespace ensonify::engine {

/// How EXR compresses, always without loss.
enum class ExrCompression { none, rle, zip, piz };

/// How the files of layers (EXR and NPZ) are written.
struct LayerEncoding {
  /// Measured on 77 MB of layers over rippled sand, in s and MB: none 0.12 and 77, rle 0.21 and 45,
  /// piz 0.64 and 29, zip 1.07 and 32.
  ExrCompression exr_compression = ExrCompression::rle;
  std::vector<std::string> layers;  ///< names of the layers to write; empty: all
};

}  // namespace ensonify::engine
