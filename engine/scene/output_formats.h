#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include <ensonify/engine/output/attributes.h>
#include <ensonify/engine/output/recording.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {

/// Encodes the layers of a sonar's image, piece by piece: they take the most bytes of a run.
using EncodeLayers = void (*)(const Waterfall&, const ImageOrigin&, const refine::WriteAt&);
/// Encodes what the sonars' own program would have recorded, of one sonar or of several.
using EncodeRecording = std::vector<std::byte> (*)(std::span<const Recording>);

/// A format in which a run writes a sonar's image if the scene asks for it.
struct OutputFormat {
  std::string_view name;  ///< the key in [output], and the extension of the file
  std::string_view help;
  bool OutputOptions::*wanted;
  std::variant<EncodeLayers, EncodeRecording> encode;
};

/// All formats, in the order of the keys in [output]. A new format is a row here.
std::span<const OutputFormat> output_formats();

}  // namespace ensonify::engine
