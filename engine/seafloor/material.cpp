#include <ensonify/engine/seafloor/material.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/engine/base/units.h>
#include <ensonify/scatter/composite_roughness.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/energy_bound.h>
#include <ensonify/scatter/ground_texture.h>
#include <ensonify/scatter/gsab.h>
#include <ensonify/scatter/nearest_names.h>
#include <ensonify/scatter/solid_target.h>
#include <ensonify/scatter/strength_table.h>
#include <ensonify/scatter/validity.h>

namespace ensonify::engine {
namespace {

using scatter::Sediment, scatter::Solid;

constexpr std::string_view solid = "solid", lambert = "lambert", gsab = "gsab", table = "table";

/// What covers a bed and scatters by Lambert's law. Dense Posidonia has -23 dB, nearly the same at
/// all angles and frequencies (Lyons and Pouliquen 1998). The mu of seagrass, -15 dB, gives -23 dB
/// at a grazing angle of 23 degrees. The mu of shells is a typical value.
struct Cover {
  std::string_view name;
  double mu_db;
  scatter::GroundTexture texture;  // typical values
};
constexpr std::array covers = {
    Cover{"seagrass", -15.0, {.patch_m = 0.15, .shape = 0.6, .exponent = 1.0, .variation_db = 1.8}},
    Cover{"shells",
          -14.0,
          {.shape = 0.4, .glint_share = 0.3, .glints_per_m2 = 30.0, .variation_db = 1.8}}};

/// Texture of a rough solid (growth, plates, edges), the same at all grazing angles. With this
/// shape, samples change from ping to ping as on a wreck in a recording at 600 kHz
/// (tests/engine/seafloor/material_test.cpp). The other values are typical.
constexpr scatter::GroundTexture of_rough_solids{
    .patch_m = 0.1, .shape = 1.7, .exponent = 0.0, .variation_db = 2.5, .variation_m = 5.0};

bool is_solid(std::string_view name) {
  const std::vector<scatter::NamedSolid> solids = scatter::named_solids();
  return std::ranges::find(solids, name, &scatter::NamedSolid::name) != solids.end();
}

/// From all lists, for example "; the nearest names are 'steel' (a solid) and 'silt' (a sediment)".
std::string nearest_materials(std::string_view name, std::span<const Material> own) {
  std::vector<std::string_view> names, lists;
  const auto add = [&](std::string_view list, const auto& items) {
    for (const auto& item : items) {
      names.push_back(item.name);
      lists.push_back(list);
    }
  };
  const std::vector<scatter::NamedSediment> sediments = scatter::named_sediments();
  const std::vector<scatter::NamedSolid> solids = scatter::named_solids();
  add("of this scene", own);
  add("a sediment", sediments);
  add("a cover", covers);
  add("a solid", solids);
  const std::vector<std::string_view> nearest =
      scatter::nearest_names(name.substr(0, 64), names, 3, name.npos);
  std::string text;
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    const auto at = std::ranges::find(names, nearest[i]) - names.begin();
    text += fmt::format("{}'{}' ({})",
                        i == 0                   ? ""
                        : i + 1 < nearest.size() ? ", "
                                                 : " and ",
                        nearest[i], lists[static_cast<std::size_t>(at)]);
  }
  return fmt::format("; the nearest {} {}", nearest.size() == 1 ? "name is" : "names are", text);
}

/// The error for a material whose `like` is not in the list of its model.
std::invalid_argument fault_of_like(const Material& material, std::string_view expected) {
  const std::vector<scatter::NamedSediment> sediments = scatter::named_sediments();
  const std::string_view like = std::string_view(material.like).substr(0, 64);
  std::string what = "is not known" + nearest_materials(like, {});
  if (is_solid(like)) what = "is a solid";
  if (std::ranges::find(covers, like, &Cover::name) != covers.end()) what = "is a cover";
  if (std::ranges::find(sediments, like, &scatter::NamedSediment::name) != sediments.end())
    what = "is a sediment";
  return std::invalid_argument(fmt::format("like = \"{}\" {}; {}", like, what, expected));
}

Sediment parameters_of(const Material& material) {
  Sediment sediment;
  if (material.mean_grain_size_phi) {
    sediment = scatter::sediment_of_grain_size(*material.mean_grain_size_phi);
  } else {
    try {
      sediment = scatter::sediment_named(material.like);
    } catch (const std::invalid_argument&) {
      throw fault_of_like(
          material,
          fmt::format("model = \"{}\" is for sediments, a solid needs model = \"solid\", a cover "
                      "model = \"lambert\" and lambert_mu_db",
                      material.model));
    }
  }
  using Parameter = std::pair<std::optional<double> Material::*, double Sediment::*>;
  for (const auto& [given, parameter] :
       {Parameter{&Material::density_ratio, &Sediment::density_ratio},
        Parameter{&Material::sound_speed_ratio, &Sediment::sound_speed_ratio},
        Parameter{&Material::loss, &Sediment::loss},
        Parameter{&Material::volume, &Sediment::volume},
        Parameter{&Material::exponent, &Sediment::exponent},
        Parameter{&Material::strength_cm4, &Sediment::strength_cm4}})
    if (material.*given) {
      sediment.*parameter = *(material.*given);
      sediment.lambert_mu_db.reset();  // it was measured on a bed with the named parameters
    }
  sediment.strength_offset_db = material.strength_offset_db;
  scatter::check(sediment);
  return sediment;
}

Solid solid_of(const Material& material) {
  if (!is_solid(material.like))
    throw fault_of_like(material,
                        fmt::format("model = \"solid\" is for solids: {}", scatter::solid_names()));
  Solid known = scatter::solid_named(material.like);
  known.diffuse_db = material.diffuse_db.value_or(known.diffuse_db);
  known.specular = material.specular.value_or(known.specular);
  known.lobe_width_rad = material.lobe_width_rad.value_or(known.lobe_width_rad);
  known.diffuse_db += material.strength_offset_db;
  known.specular *= scatter::from_db(material.strength_offset_db);
  return known;
}

/// Reads a lobe of gsab. Throws if only one of level and width is given.
void read_lobe(std::string_view name, const std::optional<double>& level_db,
               const std::optional<double>& its_width_rad, double& level, double& width_rad) {
  if (level_db.has_value() != its_width_rad.has_value())
    throw std::invalid_argument(fmt::format(
        "of gsab_{0}_db and gsab_{0}_width_deg one is missing, expected both or none", name));
  if (!level_db) return;
  level = scatter::from_db(*level_db);
  width_rad = *its_width_rad;
}

scatter::Gsab gsab_of(const Material& material) {
  if (!material.gsab_lambert_db)
    throw std::invalid_argument(
        "model = \"gsab\" needs gsab_lambert_db, the level of its Lambert-like part");
  scatter::Gsab made{.lambert = scatter::from_db(*material.gsab_lambert_db),
                     .lambert_exponent = material.gsab_lambert_exponent};
  read_lobe("specular", material.gsab_specular_db, material.gsab_specular_width_rad, made.specular,
            made.specular_width_rad);
  read_lobe("transitional", material.gsab_transitional_db, material.gsab_transitional_width_rad,
            made.transitional, made.transitional_width_rad);
  const double offset = scatter::from_db(material.strength_offset_db);
  for (double* const level : {&made.specular, &made.lambert, &made.transitional}) *level *= offset;
  return made;
}

const scatter::StrengthTable& strengths_of(const Material& material) {
  if (!material.measured)
    throw std::invalid_argument(
        "model = \"table\" needs a CSV file of strengths: name it as the material's table");
  return *material.measured;
}

/// Descriptions of what a table lacks for a sonar of this frequency.
std::vector<std::string> gaps_of(const scatter::StrengthTable& strengths, double frequency_hz) {
  std::vector<std::string> gaps;
  const std::vector<scatter::StrengthCurve>& curves = strengths.curves();
  const double lowest_hz = curves.front().frequency_hz, highest_hz = curves.back().frequency_hz;
  if (curves.size() > 1 && (frequency_hz < lowest_hz || frequency_hz > highest_hz))
    gaps.push_back(fmt::format(
        "its table has {:g} to {:g} kHz: at {:g} kHz the strengths of {:g} kHz are used",
        lowest_hz / 1e3, highest_hz / 1e3, frequency_hz / 1e3,
        std::clamp(frequency_hz, lowest_hz, highest_hz) / 1e3));
  double first_rad = 0.0, last_rad = std::numbers::pi / 2.0;
  for (const scatter::StrengthCurve& curve : curves) {
    first_rad = std::max(first_rad, curve.grazing_rad.front());
    last_rad = std::min(last_rad, curve.grazing_rad.back());
  }
  if (first_rad > 1.0 * degree)
    gaps.push_back(fmt::format(
        "its table begins at {:.3g} degrees: below, the strength falls by Lambert's law",
        first_rad / degree));
  if (last_rad < 89.0 * degree)
    gaps.push_back(fmt::format("its table ends at {:.3g} degrees: above, the last strength is used",
                               last_rad / degree));
  return gaps;
}

/// A model that has separate keys in a material, instead of a sediment's parameters.
struct OwnModel {
  std::string_view name, help;
  std::unique_ptr<scatter::Backscatter> (*make)(const Material& material, double frequency_hz);
};
constexpr std::array own_models = {
    OwnModel{solid, "a diffuse part and a specular lobe",
             [](const Material& material, double) -> std::unique_ptr<scatter::Backscatter> {
               const Solid smooth_solid = solid_of(material);
               static_cast<void>(scatter::SolidTarget(smooth_solid));  // throws
               return std::make_unique<scatter::SolidTarget>(smooth_solid.rough());
             }},
    OwnModel{gsab, "the generic model that is fitted to measurements (gsab_ keys)",
             [](const Material& material, double) -> std::unique_ptr<scatter::Backscatter> {
               return std::make_unique<scatter::GsabBottom>(gsab_of(material));
             }},
    OwnModel{
        table, "strengths from a CSV file",
        [](const Material& material, double frequency_hz) -> std::unique_ptr<scatter::Backscatter> {
          strengths_of(material);
          return std::make_unique<scatter::MeasuredBottom>(material.measured, frequency_hz,
                                                           material.strength_offset_db);
        }},
};

/// Null for a model of bottom_model_kinds().
const OwnModel* own_model(const Material& material) {
  const auto found = std::ranges::find(own_models, material.model, &OwnModel::name);
  return found == own_models.end() ? nullptr : &*found;
}

}  // namespace

bool is_sediment(const Material& material) {
  return !own_model(material) && scatter::bottom_model_kind(material.model).by_sediment;
}

std::vector<MaterialModel> material_models() {
  std::vector<MaterialModel> models;
  for (const scatter::BottomModelKind& kind : scatter::bottom_model_kinds())
    models.push_back({kind.name, kind.help});
  for (const OwnModel& model : own_models) models.push_back({model.name, model.help});
  return models;
}

std::string cover_names() {
  std::string names;
  for (const Cover& cover : covers)
    names += fmt::format("{}{}", names.empty() ? "" : ", ", cover.name);
  return names;
}

Material material_named(std::string_view name, std::span<const Material> own) {
  const auto found = std::ranges::find(own, name, &Material::name);
  if (found != own.end()) return *found;
  Material known{.name = std::string(name), .like = std::string(name)};
  if (is_solid(name)) {
    known.model = solid;
    return known;
  }
  if (const auto cover = std::ranges::find(covers, name, &Cover::name); cover != covers.end()) {
    known.model = lambert;
    known.lambert_mu_db = cover->mu_db;
    return known;
  }
  try {
    scatter::sediment_named(name);
  } catch (const std::invalid_argument&) {
    throw std::invalid_argument(fmt::format(
        "material '{}' is not known{}; covers are {}; solids are {}; or "
        "describe one in a table [material.NAME]",
        name.substr(0, 64), nearest_materials(name, own), cover_names(), scatter::solid_names()));
  }
  return known;
}

std::unique_ptr<scatter::Backscatter> backscatter_of(const Material& material, double frequency_hz,
                                                     double sound_speed_mps,
                                                     double relief_spacing_m) {
  if (material.model == lambert)
    return std::make_unique<scatter::Lambert>(material.lambert_mu_db + material.strength_offset_db);
  if (const OwnModel* model = own_model(material)) return model->make(material, frequency_hz);
  const Sediment sediment = parameters_of(material);
  const double k_per_cm =
      scatter::relief_wavenumber_per_cm(sediment, frequency_hz, sound_speed_mps);
  return std::make_unique<scatter::Bottom>(
      sediment, frequency_hz, sound_speed_mps, material.model,
      relief_spacing_m > 0.0
          ? scatter::resolved_slope_fraction(sediment, k_per_cm, relief_spacing_m)
          : 0.0);
}

std::optional<Sediment> sediment_of(const Material& material) {
  if (!is_sediment(material)) return std::nullopt;
  return parameters_of(material);
}

scatter::GroundTexture texture_of(const Material& material) {
  scatter::GroundTexture texture;
  if (material.model == solid) {
    if (solid_of(material).lobe_width_rad > 0.0) texture = of_rough_solids;
  } else {
    const auto cover = std::ranges::find(covers, material.like, &Cover::name);
    texture = cover != covers.end() ? cover->texture
                                    : scatter::ground_texture_of(parameters_of(material));
  }
  using Texture = scatter::GroundTexture;
  using Parameter = std::pair<std::optional<double> Material::*, double Texture::*>;
  for (const auto& [given, parameter] :
       {Parameter{&Material::texture_patch_m, &Texture::patch_m},
        Parameter{&Material::texture_shape, &Texture::shape},
        Parameter{&Material::texture_exponent, &Texture::exponent},
        Parameter{&Material::glint_share, &Texture::glint_share},
        Parameter{&Material::glints_per_m2, &Texture::glints_per_m2},
        Parameter{&Material::variation_db, &Texture::variation_db},
        Parameter{&Material::variation_m, &Texture::variation_m}})
    if (material.*given) texture.*parameter = *(material.*given);
  return texture;
}

std::optional<Solid> as_solid(const Material& material) {
  if (material.model != solid) return std::nullopt;
  return solid_of(material);
}

double smooth_specular(const Material& material) {
  return material.model == solid ? solid_of(material).smooth_specular() : 0.0;
}

std::optional<double> lobe_width_rad(std::string_view name, std::span<const Material> own) {
  std::optional<Solid> of_name;
  if (const auto found = std::ranges::find(own, name, &Material::name); found != own.end())
    of_name = as_solid(*found);
  else if (is_solid(name))
    of_name = scatter::solid_named(name);
  if (!of_name || !(of_name->rough().specular > 0.0)) return std::nullopt;
  return of_name->lobe_width_rad;
}

std::vector<std::string> warnings_of(const Material& material,
                                     const scatter::Backscatter& backscatter, double frequency_hz) {
  std::vector<std::string> warnings;
  if (is_sediment(material)) {
    const double valid_hz =
        std::clamp(frequency_hz, scatter::lowest_valid_hz, scatter::highest_valid_hz);
    if (const auto warning = scatter::validity_warning(parameters_of(material), valid_hz))
      warnings.push_back(*warning);
  }
  if (material.model == table) warnings = gaps_of(strengths_of(material), frequency_hz);
  if (const auto excess = scatter::energy_excess(backscatter))
    warnings.push_back(fmt::format("at {:g} kHz and {}", frequency_hz / 1e3, excess->text()));
  for (std::string& warning : warnings)
    warning = fmt::format("material {}: {}", material.name, warning);
  return warnings;
}

}  // namespace ensonify::engine
