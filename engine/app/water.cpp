#include <array>
#include <memory>
#include <optional>
#include <string>

#include <fmt/format.h>

#include <ensonify/engine/base/units.h>
#include <ensonify/scatter/sea_water.h>

#include "app.h"

namespace ensonify::engine::app {
namespace {

struct WaterArguments {
  scatter::SeaWater water;
  std::optional<double> depth_m, pressure_dbar;
  double latitude_deg = 45.0;
  std::optional<double> frequency_hz;
};

/// One line of warning per quantity that lies outside the range to which the formula was fitted.
std::string warnings(std::string_view formula, const scatter::FittedWater& fit,
                     const scatter::SeaWater& water, double depth_m,
                     std::optional<double> frequency_hz) {
  struct Quantity {
    std::string_view name, unit;
    scatter::Interval fitted;
    double value;
  };
  const std::array quantities = {
      Quantity{"temperature", " degrees Celsius", fit.temperature_c, water.temperature_c},
      Quantity{"salinity", " psu", fit.salinity_psu, water.salinity_psu},
      Quantity{"depth", " m", fit.depth_m, depth_m}, Quantity{"pH", "", fit.ph, water.ph},
      Quantity{"frequency", " Hz", fit.frequency_hz, frequency_hz.value_or(fit.frequency_hz.low)}};
  std::string lines;
  for (const auto& [name, unit, fitted, value] : quantities)
    if (!fitted.holds(value))
      lines += fmt::format(
          "ensonify: warning: {} is fitted to {} {} to {}{}, but here it is {:.6g}: the value is "
          "an extrapolation\n",
          formula, name, fitted.low, fitted.high, unit, value);
  return lines;
}

void print_water(const WaterArguments& arguments) {
  const auto& water = arguments.water;
  const double latitude_rad = arguments.latitude_deg * degree;
  const double depth_m = arguments.depth_m
                             ? *arguments.depth_m
                             : scatter::depth_of_pressure_m(*arguments.pressure_dbar, latitude_rad);
  const double pressure_dbar = arguments.pressure_dbar
                                   ? *arguments.pressure_dbar
                                   : scatter::pressure_at_depth_dbar(depth_m, latitude_rad);
  std::string out = "quantity,formula,value\n", err;
  const auto line = [&](std::string_view quantity, std::string_view formula, double value,
                        const scatter::FittedWater& fit) {
    out += fmt::format("{},{},{}\n", quantity, formula, value);
    err += warnings(formula, fit, water, depth_m, arguments.frequency_hz);
  };
  constexpr std::string_view speed = "sound_speed_mps", absorption = "absorption_db_per_km";
  line(speed, "mackenzie", scatter::sound_speed_mps(water, depth_m), scatter::mackenzie_fit);
  line(speed, "chen-millero", scatter::chen_millero_sound_speed_mps(water, pressure_dbar),
       scatter::chen_millero_fit);
  line(speed, "leroy", scatter::leroy_sound_speed_mps(water, depth_m, latitude_rad),
       scatter::leroy_fit);
  if (const auto f = arguments.frequency_hz) {
    line(absorption, "francois-garrison", 1000.0 * scatter::absorption_db_per_m(water, depth_m, *f),
         scatter::francois_garrison_fit);
    line(absorption, "ainslie-mccolm",
         1000.0 * scatter::ainslie_mccolm_absorption_db_per_m(water, depth_m, *f),
         scatter::ainslie_mccolm_fit);
  }
  write_note(err);
  print(out);
}

}  // namespace

void add_water(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<WaterArguments>();
  CLI::App& command =
      *app.add_subcommand("water",
                          "Print the sound speed in sea water and, for a frequency, the "
                          "absorption, one formula per line. Output: quantity,formula,value. "
                          "Values outside the range that a formula was fitted to get a warning on "
                          "stderr. Depth and pressure are converted by UNESCO 44");
  command
      .add_option("--temperature-c", arguments->water.temperature_c,
                  "Temperature, degrees Celsius (ITS-90)")
      ->required()
      ->check(number());
  command.add_option("--salinity-psu", arguments->water.salinity_psu, "Salinity, psu")
      ->required()
      ->check(number());
  CLI::Option_group& place = *command.add_option_group("Depth", "One of these two");
  place.add_option("--depth-m", arguments->depth_m, "Depth, m")->check(number());
  place
      .add_option("--pressure-dbar", arguments->pressure_dbar,
                  "Pressure above atmospheric pressure, dbar")
      ->check(number());
  place.require_option(1);
  command.add_option("--latitude-deg", arguments->latitude_deg, "Latitude, degrees")
      ->capture_default_str()
      ->check(number());
  command.add_option("--ph", arguments->water.ph, "pH value")
      ->capture_default_str()
      ->check(number());
  command.add_option("--frequency-hz", arguments->frequency_hz, "Frequency, Hz")->check(number());
  command.callback([&action, arguments] { action = [arguments] { print_water(*arguments); }; });
}

}  // namespace ensonify::engine::app
