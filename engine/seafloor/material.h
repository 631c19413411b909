#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/sediment.h>

namespace ensonify::engine {

/// How a material can scatter: the bottom models (scatter::bottom_model_kinds()), of which lambert
/// has the material's own mu, and solid.
struct MaterialModel {
  std::string_view name;
  std::string_view help;
};
std::vector<MaterialModel> material_models();

/// What the bed or an object is made of: a known sediment or solid, and what differs from it.
struct Material {
  std::string name;
  std::string model = "tr9407";      ///< the name of one of material_models()
  std::string like = "medium sand";  ///< a named sediment, for `solid` a named solid
  std::optional<double>
      mean_grain_size_phi;  ///< start from the sediment of that grain size instead
  std::optional<double> density_ratio, sound_speed_ratio, loss, volume, exponent, strength_cm4;
  double lambert_mu_db = -27.0;
  std::optional<double> diffuse_db, specular, lobe_width_rad;
  double strength_offset_db = 0.0;  ///< added to the strength of a sediment
};

/// The one of `own` that has the name, or else the known sediment, cover (seagrass, shells) or
/// solid of that name. Throws std::invalid_argument, with the nearest names, for another.
Material material_named(std::string_view name, std::span<const Material> own);

/// How it scatters at one frequency. `relief_spacing_m` is the spacing of a mesh that carries the
/// sediment's own relief, whose slopes then are not counted twice (0: it carries none). Throws
/// std::invalid_argument for an unknown name or model and for values outside their range.
std::unique_ptr<scatter::Backscatter> backscatter_of(const Material& material, double frequency_hz,
                                                     double sound_speed_mps,
                                                     double relief_spacing_m);

/// Its parameters, if it is a sediment; a cover or a solid has none. Throws as above.
std::optional<scatter::Sediment> sediment_of(const Material& material);

/// Half the width of the specular lobe of a solid of that name; none for what has no lobe.
std::optional<double> lobe_width_rad(std::string_view name, std::span<const Material> own);

/// A warning, given once per run, that the frequency lies outside the model's range; none inside
/// it.
std::optional<std::string> validity_warning(const Material& material, double frequency_hz);

}  // namespace ensonify::engine
