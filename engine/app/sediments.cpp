#include <memory>
#include <optional>

#include <fmt/format.h>

#include <ensonify/engine/seafloor/material.h>
#include <ensonify/scatter/sediment.h>
#include <ensonify/scatter/solid_target.h>

#include "app.h"

namespace ensonify::engine::app {
namespace {

using scatter::Sediment;

std::string row(std::string_view name, std::optional<double> mean_grain_size_phi,
                const Sediment& s) {
  return fmt::format("{},{},{},{},{},{},{},{},{}\n", name,
                     mean_grain_size_phi ? fmt::to_string(*mean_grain_size_phi) : "",
                     s.density_ratio, s.sound_speed_ratio, s.loss, s.volume, s.exponent,
                     s.strength_cm4,
                     s.lambert_mu_db ? fmt::format("{:.4g}", *s.lambert_mu_db) : "");
}

void print_sediments(std::optional<double> mean_grain_size_phi) {
  std::string out =
      "name,mean_grain_size_phi,density_ratio,sound_speed_ratio,loss,volume,exponent,"
      "strength_cm4,lambert_mu_db\n";
  if (mean_grain_size_phi)
    out += row("", mean_grain_size_phi, scatter::sediment_of_grain_size(*mean_grain_size_phi));
  else
    for (const scatter::NamedSediment& s : scatter::named_sediments())
      out += row(s.name, s.mean_grain_size_phi, s.sediment);
  print(out);
}

}  // namespace

void add_sediments(CLI::App& app, Action& action) {
  const auto mean_grain_size_phi = std::make_shared<std::optional<double>>();
  CLI::App& command = *app.add_subcommand(
      "sediments",
      fmt::format(
          "List the named seabeds and their parameters, one row per name (CSV), or the parameters "
          "of one grain size. Names from the same row of the handbook (APL-UW TR 9407, table 2) "
          "have equal parameters; rock and stones have no grain size. Rock scatters by Lambert's "
          "law with the measured lambert_mu_db; handbook rock has the handbook's strength. A "
          "material can also be a cover ({}) or a solid ({}), which have none of these parameters",
          cover_names(), scatter::solid_names()));
  add_value(command, "--mean-grain-size-phi", *mean_grain_size_phi, "PHI",
            "Print the parameters of this mean grain size, -1 to 9")
      ->check(number());
  command.callback([&action, mean_grain_size_phi] {
    action = [mean_grain_size_phi] { print_sediments(*mean_grain_size_phi); };
  });
}

}  // namespace ensonify::engine::app
