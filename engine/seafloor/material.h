#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/base/input_file.h>
#include <ensonify/scatter/sediment.h>

namespace ensonify::scatter {
class Backscatter;
struct GroundTexture;
struct Solid;
class StrengthTable;
}  // namespace ensonify::scatter

namespace ensonify::engine {

/// How a material can scatter: the bottom models (scatter::bottom_model_kinds(); `lambert` uses the
/// material's own mu), `solid`, and two models from measurements, `gsab` and `table`.
struct MaterialModel {
  std::string_view name;
  std::string_view help;
};
std::vector<MaterialModel> material_models();

/// What the bed or an object is made of: a named sediment or solid, and the parameters that differ
/// from it.
struct Material {
  std::string name;
  std::string model = "tr9407";      ///< the name of one of material_models()
  std::string like = "medium sand";  ///< a named sediment; for `solid` a named solid
  /// Instead of `like`: the sediment of this grain size.
  std::optional<double> mean_grain_size_phi;
  std::optional<double> density_ratio, sound_speed_ratio, loss, volume, exponent, strength_cm4;
  double lambert_mu_db = -27.0;
  std::optional<double> diffuse_db, specular, lobe_width_rad;
  std::optional<double> gsab_specular_db, gsab_specular_width_rad;  ///< none: no such lobe
  std::optional<double> gsab_lambert_db;                            ///< `gsab` needs it
  double gsab_lambert_exponent = 2.0;
  std::optional<double> gsab_transitional_db, gsab_transitional_width_rad;  ///< none: no such lobe
  InputFile table;                                         ///< a CSV file, for `table`
  std::shared_ptr<const scatter::StrengthTable> measured;  ///< its content, read with the scene
  double strength_offset_db = 0.0;  ///< added to the strength that the model gives
  /// What differs from the texture of `like` (scatter::GroundTexture).
  std::optional<double> texture_patch_m, texture_shape, texture_exponent;
  std::optional<double> glint_share, glints_per_m2, variation_db, variation_m;
};

/// Whether its model scatters by the parameters of a sediment. Throws std::invalid_argument for an
/// unknown model.
bool is_sediment(const Material& material);

/// The names of the covers, "seagrass, shells".
std::string cover_names();

/// The material of that name: one of `own` (the scene's), or else a named sediment, cover
/// or solid. Throws std::invalid_argument, with the nearest names, if there is
/// none.
Material material_named(std::string_view name, std::span<const Material> own);

/// Its backscatter at one frequency; for a solid, without smooth_specular(). `relief_spacing_m` is
/// the vertex spacing of a mesh that contains the sediment's own relief, whose slopes are then not
/// counted twice; 0: the mesh does not contain it. Throws std::invalid_argument for an unknown name
/// or model and for values outside their range.
std::unique_ptr<scatter::Backscatter> backscatter_of(const Material& material, double frequency_hz,
                                                     double sound_speed_mps,
                                                     double relief_spacing_m);

/// Its parameters if it is a sediment; nullopt for a cover or a solid. Throws as backscatter_of().
std::optional<scatter::Sediment> sediment_of(const Material& material);

/// How unevenly it scatters below the sonar's cell; a smooth solid does so evenly. Throws as
/// backscatter_of().
scatter::GroundTexture texture_of(const Material& material);

/// The solid, if it is one; nullopt for a sediment or a cover. Throws as backscatter_of().
std::optional<scatter::Solid> as_solid(const Material& material);

/// The part of the arriving energy that objects of this material reflect without scattering
/// (scatter::Solid::smooth_specular()); 0 unless it is a solid. Throws as backscatter_of().
double smooth_specular(const Material& material);

/// Half the width of the specular lobe of the material of that name; nullopt if it has no lobe.
std::optional<double> lobe_width_rad(std::string_view name, std::span<const Material> own);

/// Warnings, each to be given once per run, about a material and its backscatter at a frequency:
/// parameters outside their recommended range, what a table lacks, more energy than arrives
/// (scatter/energy_bound.h). Extrapolation (scene/checks/extrapolation.h) warns of frequencies.
std::vector<std::string> warnings_of(const Material& material,
                                     const scatter::Backscatter& backscatter, double frequency_hz);

}  // namespace ensonify::engine
