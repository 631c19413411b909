#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <ensonify/scatter/sediment.h>

namespace ensonify::scatter {
class Backscatter;
}

namespace ensonify::engine {

enum class MaterialModel { tr9407, small_slope, lambert, solid };

/// What the bed or an object is made of: a seabed or a solid that is known by name, and what
/// differs.
struct Material {
  std::string name;
  MaterialModel model = MaterialModel::tr9407;
  std::string like = "medium sand";           ///< a named sediment, for `solid` a named solid
  std::optional<double> mean_grain_size_phi;  ///< the seabed of that grain size instead
  std::optional<double> density_ratio, sound_speed_ratio, loss, volume, exponent, strength_cm4;
  double lambert_mu_db = -27.0;
  std::optional<double> diffuse_db, specular, lobe_width_rad;
  double strength_offset_db = 0.0;  ///< added to the strength of a sediment
};

/// The one of these that has the name, or else the sediment, cover (seagrass, shells) or solid
/// that is known by it. Throws
/// std::invalid_argument, with the names that are nearest, for another.
Material material_named(std::string_view name, std::span<const Material> own);

/// How it scatters at one frequency. `relief_spacing_m` is the spacing of a mesh that carries the
/// sediment's own relief, whose slopes then are not counted twice (0: it carries none). Throws
/// std::invalid_argument for a name that is not known and for values outside their range.
std::unique_ptr<scatter::Backscatter> backscatter_of(const Material& material, double frequency_hz,
                                                     double sound_speed_mps,
                                                     double relief_spacing_m);

/// Its parameters, if it is a sediment; a cover or a solid has none. Throws as above.
std::optional<scatter::Sediment> sediment_of(const Material& material);

/// Half the width of the lobe with which a solid of that name shines; none for what has no lobe.
std::optional<double> lobe_width_rad(std::string_view name, std::span<const Material> own);

/// What should be said once a run of the model's validity; nothing inside its range.
std::optional<std::string> validity_warning(const Material& material, double frequency_hz);

}  // namespace ensonify::engine
