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

/// How a material can scatter: one of scatter::bottom_model_kinds() (`lambert` uses
/// Material::lambert_mu_db), `solid`, or a model from measurements, `gsab` or `table`.
struct MaterialModel {
  std::string_view name;
  std::string_view help;
};
std::vector<MaterialModel> material_models();

/// What the bed or an object is made of: a named sediment or solid, with some parameters changed.
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
  std::shared_ptr<const scatter::StrengthTable> measured;  ///< read from `table`
  double strength_offset_db = 0.0;  ///< added to the strength that the model gives
  /// Values that replace those of the texture of `like` (scatter::GroundTexture).
  std::optional<double> texture_patch_m, texture_shape, texture_exponent;
  std::optional<double> glint_share, glints_per_m2, variation_db, variation_m;
};

/// Whether the model uses a sediment's parameters. Throws std::invalid_argument for unknown models.
bool is_sediment(const Material& material);

/// The names of the covers, "seagrass, shells".
std::string cover_names();

/// The material with this name: one of `own` (the scene's materials), or else a named sediment,
/// cover or solid. Throws std::invalid_argument, with the nearest names, if there is none.
Material material_named(std::string_view name, std::span<const Material> own);

/// The material's backscatter at one frequency; for a solid, without smooth_specular().
/// `relief_spacing_m` is the vertex spacing of a mesh that contains the sediment's relief: the
/// model then leaves out the slopes that the mesh has. 0: the mesh does not contain the relief.
/// Throws std::invalid_argument for an unknown name or model and for values outside their range.
std::unique_ptr<scatter::Backscatter> backscatter_of(const Material& material, double frequency_hz,
                                                     double sound_speed_mps,
                                                     double relief_spacing_m);

/// The parameters of a sediment; nullopt for other materials. Throws what backscatter_of() throws.
std::optional<scatter::Sediment> sediment_of(const Material& material);

/// How unevenly the material scatters within the sonar's cell; a smooth solid scatters evenly.
/// Throws what backscatter_of() throws.
scatter::GroundTexture texture_of(const Material& material);

/// The solid; nullopt for a material with another model. Throws what backscatter_of() throws.
std::optional<scatter::Solid> as_solid(const Material& material);

/// The share of the incident energy that objects of a solid reflect without scattering
/// (scatter::Solid::smooth_specular()); otherwise 0. Throws what backscatter_of() throws.
double smooth_specular(const Material& material);

/// Half the width of the specular lobe of the material with this name; nullopt without such a lobe.
std::optional<double> lobe_width_rad(std::string_view name, std::span<const Material> own);

/// Warnings about a material and its backscatter at a frequency: parameters outside their
/// recommended range, what a table lacks, and more scattered than incident energy
/// (scatter/energy_bound.h). Each warning is printed once per run. Extrapolation
/// (scene/checks/extrapolation.h) warns of frequencies.
std::vector<std::string> warnings_of(const Material& material,
                                     const scatter::Backscatter& backscatter, double frequency_hz);

}  // namespace ensonify::engine
