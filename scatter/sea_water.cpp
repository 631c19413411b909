#include <ensonify/scatter/sea_water.h>

#include <cmath>
#include <initializer_list>
#include <iterator>
#include <numbers>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>

#include <ensonify/scatter/angle.h>

namespace ensonify::scatter {
namespace {

constexpr Interval temperatures_c = {-4, 50};
constexpr Interval salinities_psu = {0, 50};
constexpr Interval acidities = {6, 9};
constexpr Interval depths_m = {0, 12000};
constexpr Interval pressures_dbar = {0, 12500};  // the pressures of those depths
constexpr Interval latitudes_rad = {-std::numbers::pi / 2, std::numbers::pi / 2};

void check(std::string_view what, double value, Interval expected, std::string_view unit) {
  if (!expected.holds(value))
    throw std::invalid_argument(fmt::format("sea water: {} is {}, expected {} to {}{}", what, value,
                                            expected.low, expected.high, unit));
}

void check(const SeaWater& water) {
  check("temperature", water.temperature_c, temperatures_c, " degrees Celsius");
  check("salinity", water.salinity_psu, salinities_psu, " psu");
  check("pH", water.ph, acidities, "");
}

void check(const SeaWater& water, double depth_m) {
  check(water);
  check("depth", depth_m, depths_m, " m");
}

void check(const SeaWater& water, double depth_m, double frequency_hz) {
  check(water, depth_m);
  if (!(frequency_hz > 0.0 && std::isfinite(frequency_hz)))
    throw std::invalid_argument(
        fmt::format("sea water: frequency is {} Hz, expected more than 0", frequency_hz));
}

void check_latitude(double latitude_rad) {
  if (!latitudes_rad.holds(latitude_rad))
    throw std::invalid_argument(fmt::format("sea water: latitude is {} degrees, expected -90 to 90",
                                            latitude_rad / degree));
}

double polynomial(std::initializer_list<double> ascending, double x) {
  double sum = 0.0;
  for (auto a = std::rbegin(ascending); a != std::rend(ascending); ++a) sum = sum * x + *a;
  return sum;
}

/// The geopotential of the standard ocean at a pressure in dbar: the part of UNESCO 44's formula
/// that does not depend on latitude.
double geopotential(double p) {
  return polynomial({0.0, 9.72659, -2.2512e-5, 2.279e-10, -1.82e-15}, p);
}

/// The mean gravity, in m/s^2, between the surface and a pressure in dbar of the standard ocean.
double mean_gravity(double p, double latitude_rad) {
  const double x = std::pow(std::sin(latitude_rad), 2);
  return 9.780318 * (1.0 + 5.2788e-3 * x + 2.36e-5 * x * x) + 1.092e-6 * p;
}

}  // namespace

double sound_speed_mps(const SeaWater& water, double depth_m) {
  check(water, depth_m);
  const double T = water.temperature_c;
  const double S = water.salinity_psu;
  const double D = depth_m;
  return 1448.96 + 4.591 * T - 5.304e-2 * T * T + 2.374e-4 * T * T * T + 1.340 * (S - 35.0) +
         1.630e-2 * D + 1.675e-7 * D * D - 1.025e-2 * T * (S - 35.0) - 7.139e-13 * T * D * D * D;
}

double temperature_of_sound_speed_c(double mps, double salinity_psu, double depth_m) {
  auto [low, high] = mackenzie_fit.temperature_c;
  for (int step = 0; step < 50; ++step) {  // speed grows with temperature in the whole fit
    const double middle = 0.5 * (low + high);
    (sound_speed_mps({.temperature_c = middle, .salinity_psu = salinity_psu}, depth_m) < mps
         ? low
         : high) = middle;
  }
  return 0.5 * (low + high);
}

double chen_millero_sound_speed_mps(const SeaWater& water, double pressure_dbar) {
  check(water);
  check("pressure", pressure_dbar, pressures_dbar, " dbar");
  const double T = 1.00024 * water.temperature_c;  // IPTS-68, Saunders, WOCE Newsletter 10 (1990)
  const double S = water.salinity_psu;
  const double P = pressure_dbar / 10.0;  // bar
  const double Cw = polynomial(
      {polynomial({1402.388, 5.03711, -5.80852e-2, 3.3420e-4, -1.47800e-6, 3.1464e-9}, T),
       polynomial({0.153563, 6.8982e-4, -8.1788e-6, 1.3621e-7, -6.1185e-10}, T),
       polynomial({3.1260e-5, -1.7107e-6, 2.5974e-8, -2.5335e-10, 1.0405e-12}, T),
       polynomial({-9.7729e-9, 3.8504e-10, -2.3643e-12}, T)},
      P);
  const double A =
      polynomial({polynomial({1.389, -1.262e-2, 7.164e-5, 2.006e-6, -3.21e-8}, T),
                  polynomial({9.4742e-5, -1.2580e-5, -6.4885e-8, 1.0507e-8, -2.0122e-10}, T),
                  polynomial({-3.9064e-7, 9.1041e-9, -1.6002e-10, 7.988e-12}, T),
                  polynomial({1.100e-10, 6.649e-12, -3.389e-13}, T)},
                 P);
  const double B = -1.922e-2 - 4.42e-5 * T + (7.3637e-5 + 1.7945e-7 * T) * P;
  const double D = 1.727e-3 - 7.9836e-6 * P;
  return Cw + A * S + B * S * std::sqrt(S) + D * S * S;
}

double leroy_sound_speed_mps(const SeaWater& water, double depth_m, double latitude_rad) {
  check(water, depth_m);
  check_latitude(latitude_rad);
  const double T = water.temperature_c;
  const double S = water.salinity_psu;
  const double Z = depth_m;
  const double phi = std::abs(latitude_rad) * 180.0 / std::numbers::pi;
  return 1402.5 + 5.0 * T - 5.44e-2 * T * T + 2.1e-4 * T * T * T + 1.33 * S - 1.23e-2 * S * T +
         8.7e-5 * S * T * T + 1.56e-2 * Z + 2.55e-7 * Z * Z - 7.3e-12 * Z * Z * Z +
         1.2e-6 * Z * (phi - 45.0) - 9.5e-13 * T * Z * Z * Z + 3e-7 * T * T * Z + 1.43e-5 * S * Z;
}

double absorption_db_per_m(const SeaWater& water, double depth_m, double frequency_hz) {
  check(water, depth_m, frequency_hz);
  const double T = water.temperature_c;
  const double S = water.salinity_psu;
  const double D = depth_m;
  const double f = frequency_hz / 1000.0;  // kHz, as in the paper
  const double c = 1412.0 + 3.21 * T + 1.19 * S + 0.0167 * D;
  const double theta = 273.0 + T;

  const double A1 = 8.86 / c * std::pow(10.0, 0.78 * water.ph - 5.0);  // boric acid
  const double f1 = 2.8 * std::sqrt(S / 35.0) * std::pow(10.0, 4.0 - 1245.0 / theta);

  const double A2 = 21.44 * S / c * (1.0 + 0.025 * T);  // magnesium sulphate
  const double P2 = 1.0 - 1.37e-4 * D + 6.2e-9 * D * D;
  const double f2 = 8.17 * std::pow(10.0, 8.0 - 1990.0 / theta) / (1.0 + 0.0018 * (S - 35.0));

  const double A3 =  // pure water
      T <= 20.0 ? 4.937e-4 - 2.59e-5 * T + 9.11e-7 * T * T - 1.50e-8 * T * T * T
                : 3.964e-4 - 1.146e-5 * T + 1.45e-7 * T * T - 6.5e-10 * T * T * T;
  const double P3 = 1.0 - 3.83e-5 * D + 4.9e-10 * D * D;

  const double db_per_km = A1 * f1 * f * f / (f1 * f1 + f * f) +
                           A2 * P2 * f2 * f * f / (f2 * f2 + f * f) + A3 * P3 * f * f;
  return db_per_km / 1000.0;
}

double ainslie_mccolm_absorption_db_per_m(const SeaWater& water, double depth_m,
                                          double frequency_hz) {
  check(water, depth_m, frequency_hz);
  const double T = water.temperature_c;
  const double S = water.salinity_psu;
  const double z = depth_m / 1000.0;
  const double f = frequency_hz / 1000.0;  // kHz, as in the paper
  const double f1 = 0.78 * std::sqrt(S / 35.0) * std::exp(T / 26.0);
  const double f2 = 42.0 * std::exp(T / 17.0);
  const double boric_acid =
      0.106 * f1 * f * f / (f1 * f1 + f * f) * std::exp((water.ph - 8.0) / 0.56);
  const double magnesium_sulphate =
      0.52 * (1.0 + T / 43.0) * (S / 35.0) * f2 * f * f / (f2 * f2 + f * f) * std::exp(-z / 6.0);
  const double pure_water = 0.00049 * f * f * std::exp(-(T / 27.0 + z / 17.0));
  return (boric_acid + magnesium_sulphate + pure_water) / 1000.0;
}

double depth_of_pressure_m(double pressure_dbar, double latitude_rad) {
  check("pressure", pressure_dbar, pressures_dbar, " dbar");
  check_latitude(latitude_rad);
  return geopotential(pressure_dbar) / mean_gravity(pressure_dbar, latitude_rad);
}

double pressure_at_depth_dbar(double depth_m, double latitude_rad) {
  check("depth", depth_m, depths_m, " m");
  check_latitude(latitude_rad);
  // A decibar is nearly a metre of depth, so each step reduces the error to at most a twentieth.
  double p = depth_m;
  for (int step = 0; step < 16; ++step)
    p += depth_m - geopotential(p) / mean_gravity(p, latitude_rad);
  return p;
}

}  // namespace ensonify::scatter
