#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <numeric>
#include <optional>

#include <fmt/format.h>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/scene/checks/extrapolation.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/seafloor/material.h>
#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/energy_bound.h>
#include <ensonify/scatter/reflection.h>

#include "app.h"

namespace ensonify::engine::app {
namespace {

using scatter::Sediment;

struct Parameter {
  const char* option;
  double Sediment::*member;
  const char* help;
};
constexpr std::array<Parameter, 6> parameters = {
    {{"--density-ratio", &Sediment::density_ratio, "Density, sediment over water, 1 to 3"},
     {"--sound-speed-ratio", &Sediment::sound_speed_ratio,
      "Sound speed, sediment over water, 0.8 to 3"},
     {"--loss", &Sediment::loss, "Imaginary over real part of the wavenumber, 0 to 0.1"},
     {"--volume", &Sediment::volume, "Volume cross-section over attenuation, 0 to 1"},
     {"--exponent", &Sediment::exponent, "Exponent of the roughness spectrum, between 2 and 4"},
     {"--strength-cm4", &Sediment::strength_cm4,
      "Strength of the roughness spectrum, cm^4, 0 to 1"}}};

constexpr double min_angle_deg = 0.001;  // the models' lowest angle; at 0 nothing returns

struct BackscatterArguments {
  double frequency_hz = 0.0;
  double sound_speed_mps = 0.0;
  std::optional<std::string> sediment;
  std::optional<double> mean_grain_size_phi;
  std::array<std::optional<double>, parameters.size()> given;
  std::string model = "tr9407";
  std::optional<std::string> material;
  std::filesystem::path scene, data_folder;
  std::vector<double> angles_deg = std::vector<double>(90);

  BackscatterArguments() { std::iota(angles_deg.begin(), angles_deg.end(), 1.0); }
};

Sediment sediment_of(const BackscatterArguments& arguments) {
  Sediment sediment;
  if (arguments.sediment) {
    try {
      sediment = scatter::sediment_named(*arguments.sediment);
    } catch (const std::invalid_argument& unknown) {
      throw UsageError(
          fmt::format("{}; covers and solids are materials: --material NAME", unknown.what()));
    }
  } else if (arguments.mean_grain_size_phi) {
    sediment = scatter::sediment_of_grain_size(*arguments.mean_grain_size_phi);
  } else {
    for (std::size_t i = 0; i < parameters.size(); ++i)
      if (!arguments.given[i])
        throw UsageError(
            fmt::format("{} is missing: give --sediment, --mean-grain-size-phi, --material, or all "
                        "six parameters",
                        parameters[i].option));
  }
  for (std::size_t i = 0; i < parameters.size(); ++i)
    if (arguments.given[i]) {
      sediment.*parameters[i].member = *arguments.given[i];
      sediment.lambert_mu_db.reset();  // holds for the named bed's parameters only
    }
  return sediment;
}

std::string model_help() {
  std::string help;
  for (const scatter::BottomModelKind& kind : scatter::bottom_model_kinds())
    help += fmt::format("{}{} ({})", help.empty() ? "" : ", ", kind.name, kind.help);
  return help;
}

/// The seabed whose strength the command prints.
struct Seabed {
  std::unique_ptr<scatter::Backscatter> backscatter;
  std::optional<Sediment> sediment;  ///< none if the material is a solid, a cover or measured
  std::vector<std::string> warnings;
};

/// A material, with the warnings that a run would give.
Seabed seabed_of_material(const BackscatterArguments& arguments) {
  std::vector<Material> own;
  if (!arguments.scene.empty())
    own = read_scene(arguments.scene, {}, arguments.data_folder).materials;
  const Material material = material_named(*arguments.material, own);
  Seabed seabed{.backscatter = backscatter_of(material, arguments.frequency_hz,
                                              arguments.sound_speed_mps, 0.0),
                .sediment = sediment_of(material)};
  Sonar sonar;
  sonar.frequency_hz = arguments.frequency_hz;
  const std::array<std::string, 2> names = {"none", material.name};
  seabed.warnings =
      Extrapolation(std::span(&sonar, 1), names, own)
          .appended_to(warnings_of(material, *seabed.backscatter, sonar.frequency_hz));
  return seabed;
}

Seabed seabed_of(const BackscatterArguments& arguments) {
  if (arguments.material) return seabed_of_material(arguments);
  Seabed seabed{.sediment = sediment_of(arguments)};
  const scatter::BottomModelKind& model = scatter::bottom_model_kind(arguments.model);
  seabed.backscatter = std::make_unique<scatter::Bottom>(*seabed.sediment, arguments.frequency_hz,
                                                         arguments.sound_speed_mps, model.name);
  if (model.by_sediment)
    if (const auto warning =
            scatter::validity_warning(*seabed.sediment, arguments.frequency_hz, model.name))
      seabed.warnings.push_back(*warning);
  if (const auto excess = scatter::energy_excess(*seabed.backscatter))
    seabed.warnings.push_back(fmt::format("at {}", excess->text()));
  return seabed;
}

void print_backscatter(const BackscatterArguments& arguments) {
  const Seabed seabed = seabed_of(arguments);
  const auto* const bottom = dynamic_cast<const scatter::Bottom*>(seabed.backscatter.get());
  std::string out =
      "grazing_deg,strength_db,roughness,volume,kirchhoff,composite,large_roughness,"
      "reflection_loss_db,bound_db\n";
  for (const double angle_deg : arguments.angles_deg) {
    if (!(angle_deg >= 0.0 && angle_deg <= 90.0))
      throw UsageError(
          fmt::format("--angles-deg: {} is not a grazing angle, expected 0 to 90", angle_deg));
    const double grazing_rad = std::max(angle_deg, min_angle_deg) * degree;
    const double strength = seabed.backscatter->cross_section(grazing_rad);
    const scatter::BottomTerms terms =
        bottom ? bottom->terms(grazing_rad) : scatter::BottomTerms{.roughness = strength};
    const std::string loss_db =
        seabed.sediment
            ? fmt::format("{:.10g}", scatter::reflection_loss_db(*seabed.sediment, grazing_rad))
            : "";
    out += fmt::format("{},{:.10g},{:.10g},{:.10g},{:.10g},{:.10g},{:.10g},{},{:.10g}\n", angle_deg,
                       scatter::to_db(strength), terms.roughness, terms.volume, terms.kirchhoff,
                       terms.composite, terms.large_roughness, loss_db,
                       scatter::to_db(scatter::diffuse_bound(grazing_rad)));
  }
  print_warnings(seabed.warnings);
  print(out);
}

}  // namespace

void add_backscatter(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<BackscatterArguments>();
  CLI::App& command = *app.add_subcommand(
      "backscatter",
      "Print a seabed's backscatter strength over the grazing angle (CSV). Columns: "
      "grazing_deg,strength_db,roughness,volume,kirchhoff,composite,large_roughness,"
      "reflection_loss_db,bound_db. The columns roughness to large_roughness are linear "
      "cross-sections; bound_db is the most that an opaque surface can scatter back diffusely; "
      "strength_db is roughness + volume in decibels. Terms that a model does not have are 0. "
      "small-slope has roughness and volume. lambert has roughness alone, and so have rock, whose "
      "strength is measured, and a material that is not a sediment; the latter has no "
      "reflection_loss_db");
  command.add_option("--frequency-hz", arguments->frequency_hz, "Frequency of the sound, Hz")
      ->required()
      ->check(number(1.0, 1e9));
  command
      .add_option("--sound-speed-mps", arguments->sound_speed_mps,
                  "Sound speed in the water at the bed, m/s")
      ->required()
      ->check(number(1000.0, 2000.0));
  CLI::Option* const name = add_value(command, "--sediment", arguments->sediment, "NAME",
                                      "A named seabed (`ensonify sediments` lists them)");
  CLI::Option* const grain_size =
      add_value(command, "--mean-grain-size-phi", arguments->mean_grain_size_phi, "PHI",
                "The seabed by its mean grain size, -1 to 9")
          ->check(number())
          ->excludes(name);
  CLI::Option* const material =
      add_value(command, "--material", arguments->material, "NAME",
                "A material: one of --scene, or a named seabed, cover or solid");
  add_value(command, "--scene", arguments->scene, "SCENE",
            "The scene file that has [material.NAME], of any model: gsab and table too")
      ->needs(material);
  add_data(command, arguments->data_folder);
  std::vector<CLI::Option*> of_sediment = {name, grain_size};
  for (std::size_t i = 0; i < parameters.size(); ++i)
    of_sediment.push_back(
        command.add_option(parameters[i].option, arguments->given[i], parameters[i].help)
            ->check(number())
            ->group("A seabed's six parameters: all, or only those to change"));
  of_sediment.push_back(
      add_value(command, "--model", arguments->model, "NAME", model_help())->capture_default_str());
  for (CLI::Option* const other : of_sediment) material->excludes(other);
  add_value(command, "--angles-deg", arguments->angles_deg, "A,B,..",
            "Grazing angles, 0 to 90 (default: each degree from 1 to 90)")
      ->delimiter(',')
      ->check(number());
  command.callback(
      [&action, arguments] { action = [arguments] { print_backscatter(*arguments); }; });
}

}  // namespace ensonify::engine::app
