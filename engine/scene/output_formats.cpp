#include <ensonify/engine/scene/output_formats.h>

#include <array>

#include <ensonify/engine/output/exr.h>
#include <ensonify/engine/output/jsf.h>
#include <ensonify/engine/output/npz.h>
#include <ensonify/engine/output/xtf.h>

namespace ensonify::engine {

std::span<const OutputFormat> output_formats() {
  static constexpr std::array formats{
      OutputFormat{"exr", "The layers as NAME.exr.", &OutputOptions::exr, &encode_exr},
      OutputFormat{"npz", "The layers as NAME.npz.", &OutputOptions::npz, &encode_npz},
      OutputFormat{"xtf", "The recording as NAME.xtf.", &OutputOptions::xtf, &encode_xtf},
      OutputFormat{"jsf", "The recording as NAME.jsf (EdgeTech).", &OutputOptions::jsf,
                   &encode_jsf},
  };
  return formats;
}

}  // namespace ensonify::engine
