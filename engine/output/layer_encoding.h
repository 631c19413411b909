#pragma once

#include <string>
#include <vector>

namespace ensonify::engine {

/// The compression of an EXR file; all kinds are without loss.
enum class ExrCompression { none, rle, zip, piz };

/// How the files of layers (EXR and NPZ) are written.
struct LayerEncoding {
  /// Measured time and file size for 77 MB of layers (rippled sand): none 0.12 s, 77 MB; rle 0.12
  /// s, 45 MB; piz 0.64 s, 29 MB; zip 1.07 s, 32 MB.
  ExrCompression exr_compression = ExrCompression::rle;
  std::vector<std::string> layers;  ///< names of the layers to write; empty: all
};

}  // namespace ensonify::engine
