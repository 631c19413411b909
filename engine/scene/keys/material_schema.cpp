#include <fmt/format.h>

#include <ensonify/engine/base/made_once.h>
#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/seafloor/material.h>
#include <ensonify/scatter/solid_target.h>

namespace ensonify::engine {
namespace {

std::string material_model_help() {
  std::string help;
  for (const MaterialModel& model : material_models())
    help += fmt::format("{}{}: {}", help.empty() ? "" : "; ", model.name, model.help);
  return help + ".";
}

std::string material_like_help() {
  return fmt::format(
      "The sediment (`ensonify sediments` lists them) or solid ({}) that it starts from.",
      scatter::solid_names());
}

// clang-format off
Section<Material> made_material_section() {
  return {
      "material.NAME",
      "A material that the scene defines: a known one, and what differs from it. seafloor.material "
      "and the objects' material refer to it by NAME (letters, digits, _ and -).",
      {
          {"model", "", {},
           made_once<material_model_help>(), at(&Material::model), words_of(material_models())},
          {"like", "", {},
           made_once<material_like_help>(), at(&Material::like)},
          {"mean_grain_size_phi", "phi", {-1, 9},
           "Mean grain size: it starts from the sediment of that size instead.",
           at(&Material::mean_grain_size_phi)},
          {"density_ratio", "", {1, 3}, "A sediment's density over the water's.",
           at(&Material::density_ratio)},
          {"sound_speed_ratio", "", {0.8, 3}, "Its sound speed over the water's.",
           at(&Material::sound_speed_ratio)},
          {"loss", "", {0, 0.1}, "Imaginary over real part of its wavenumber.",
           at(&Material::loss)},
          {"volume", "", {0, 1}, "Its volume scattering cross-section over attenuation.",
           at(&Material::volume)},
          {"exponent", "", {2.001, 3.999}, "Exponent of its relief's spectrum.",
           at(&Material::exponent)},
          {"strength_cm4", "cm^4", {0, 1}, "Strength of its relief's spectrum.",
           at(&Material::strength_cm4)},
          {"strength_offset_db", "dB", {-100, 100},
           "Added to its backscattering strength, whatever the model.",
           at(&Material::strength_offset_db)},
          {"gsab_lambert_db", "dB", {-100, 20},
           "For gsab: level at vertical of the part that is like Lambert's law, 10 log10 C.",
           at(&Material::gsab_lambert_db)},
          {"gsab_lambert_exponent", "", {0, 20}, "Its power of the cosine, D; 2 is Lambert's law.",
           at(&Material::gsab_lambert_exponent)},
          {"gsab_specular_db", "dB", {-100, 60},
           "For gsab: level at vertical of the specular lobe, 10 log10 A; unset: no lobe.",
           at(&Material::gsab_specular_db)},
          {"gsab_specular_width_deg", "degrees", {0.01, 90},
           "Its width B: at this angle from vertical it is 2.2 dB lower.",
           at(&Material::gsab_specular_width_rad)},
          {"gsab_transitional_db", "dB", {-100, 60},
           "For gsab: level at vertical of the wider lobe between the two, 10 log10 E; unset: none.",
           at(&Material::gsab_transitional_db)},
          {"gsab_transitional_width_deg", "degrees", {0.01, 90}, "Its width F.",
           at(&Material::gsab_transitional_width_rad)},
          {"table", "", {},
           "For table: CSV file with grazing_deg, strength_db and, for several frequencies, "
           "frequency_hz; a path as for seafloor.survey.",
           at(&Material::table)},
          {"lambert_mu_db", "dB", {-100, -5}, "For lambert: 10 log10(mu).",
           at(&Material::lambert_mu_db)},
          {"diffuse_db", "dB", {-100, -4.98}, "A solid's diffuse part, 10 log10(mu).",
           at(&Material::diffuse_db)},
          {"specular", "", {0, 1}, "Share of the energy that a solid reflects.",
           at(&Material::specular)},
          {"texture_patch_m", "m", {0.01, 10},
           "Side of the patches that scatter unevenly below the sonar's cell, if texture = true; "
           "unset, this key and the next six are typical of the sediment. intensity_mean does not "
           "contain this texture.",
           at(&Material::texture_patch_m)},
          {"texture_shape", "", {0, 1000},
           "Shape of the gamma distribution of a patch's cross-section, at 10 degrees grazing. A "
           "cell of n patches has n times that shape, and K distributed echoes: small is spiky; 0: "
           "all patches are alike. The cell is the pulse's: a longer bin samples it.",
           at(&Material::texture_shape)},
          {"texture_exponent", "", {0, 8},
           "That shape grows with the sine of the grazing angle to this power.",
           at(&Material::texture_exponent)},
          {"glint_share", "", {0, 0.9},
           "Share of the mean cross-section, at 10 degrees grazing, that comes from single stones "
           "and shells; at steeper angles it falls with the squared sine.",
           at(&Material::glint_share)},
          {"glints_per_m2", "per m^2", {0.01, 1000}, "Number of these.",
           at(&Material::glints_per_m2)},
          {"variation_db", "dB", {0, 6}, "Rms of the slow change of strength over the ground, at low grazing angles.",
           at(&Material::variation_db)},
          {"variation_m", "m", {2, 1000}, "Its longest scale; it goes down to 1 m.",
           at(&Material::variation_m)},
          {"lobe_width_deg", "degrees", {0, 45},
           "Rms tilt of its roughness: half the width of the lobe; 0: smooth.",
           at(&Material::lobe_width_rad)},
      }};
}
}  // namespace
const Section<Material>& material_section() { return made_once<made_material_section>(); }
// clang-format on

}  // namespace ensonify::engine
