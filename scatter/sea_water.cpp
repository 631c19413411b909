#include <ensonify/scatter/sea_water.h>

#include <cmath>

namespace ensonify::scatter {

double sound_speed_mps(const SeaWater& water, double depth_m) {
  const double T = water.temperature_c;
  const double S = water.salinity_psu;
  const double D = depth_m;
  return 1448.96 + 4.591 * T - 5.304e-2 * T * T + 2.374e-4 * T * T * T + 1.340 * (S - 35.0) +
         1.630e-2 * D + 1.675e-7 * D * D - 1.025e-2 * T * (S - 35.0) - 7.139e-13 * T * D * D * D;
}

double absorption_db_per_m(const SeaWater& water, double depth_m, double frequency_hz) {
  const double T = water.temperature_c;
  const double S = water.salinity_psu;
  const double D = depth_m;
  const double f = frequency_hz / 1000.0;  // the paper counts in kHz
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

}  // namespace ensonify::scatter
