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

/// Encodes the layers of a sonar's image piece by piece, since these are most of a run's bytes.
using EncodeLayers = void (*)(const Waterfall&, const ImageOrigin&, const refine::WriteAt&);
/// Encodes, for one sonar or several, the recording that the sonars' own program would make.
using EncodeRecording = std::vector<std::byte> (*)(std::span<const Recording>);

/// A format in which a run writes the image of a sonar, if the scene requests it.
struct OutputFormat {
  std::string_view name;  ///< the key in [output], which is also the extension of the file
  std::string_view help;
  bool OutputOptions::*wanted;
  std::variant<EncodeLayers, EncodeRecording> encode;
};

/// All formats, in the order of the keys in [output]. A new format is a new row in the source.
std::span<const OutputFormat> output_formats();

}  // namespace ensonify::engine
