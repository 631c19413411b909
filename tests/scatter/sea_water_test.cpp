#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "support/catch.h"
#include "support/data.h"

#include <ensonify/scatter/angle.h>
#include <ensonify/scatter/sea_water.h>

using namespace ensonify::scatter;

namespace {

/// Chen and Millero's speed for a temperature on the scale of their paper, IPTS-68.
double chen_millero_mps(double t68_c, double salinity_psu, double pressure_dbar) {
  return chen_millero_sound_speed_mps(
      {.temperature_c = t68_c / 1.00024, .salinity_psu = salinity_psu}, pressure_dbar);
}

// UNESCO 44's table of sound speed: one row per pressure of 0, 1000 ... 10000 dbar, one column per
// temperature of 0, 10 ... 40 degrees (IPTS-68).
struct UnescoTable {
  double salinity_psu;
  double mps[11][5];
};
const UnescoTable unesco_tables[] = {{25.0,
                                      {{1435.8, 1477.7, 1510.3, 1535.2, 1553.4},
                                       {1452.0, 1494.1, 1527.0, 1552.1, 1570.6},
                                       {1468.6, 1510.7, 1543.6, 1569.0, 1587.6},
                                       {1485.6, 1527.5, 1560.3, 1585.7, 1604.5},
                                       {1502.8, 1544.3, 1576.9, 1602.4, 1621.3},
                                       {1520.4, 1561.3, 1593.6, 1619.0, 1638.0},
                                       {1538.1, 1578.4, 1610.3, 1635.5, 1654.6},
                                       {1556.0, 1595.6, 1626.9, 1651.9, 1671.0},
                                       {1574.1, 1612.8, 1643.5, 1668.2, 1687.2},
                                       {1592.2, 1630.1, 1660.2, 1684.5, 1703.3},
                                       {1610.4, 1647.4, 1676.8, 1700.6, 1719.2}}},
                                     {30.0,
                                      {{1442.5, 1483.7, 1515.9, 1540.4, 1558.3},
                                       {1458.8, 1500.2, 1532.5, 1557.3, 1575.4},
                                       {1475.4, 1516.8, 1549.2, 1574.1, 1592.3},
                                       {1492.4, 1533.6, 1565.8, 1590.8, 1609.2},
                                       {1509.7, 1550.4, 1582.4, 1607.4, 1626.0},
                                       {1527.2, 1567.4, 1599.1, 1624.0, 1642.7},
                                       {1544.9, 1584.4, 1615.7, 1640.4, 1659.2},
                                       {1562.7, 1601.5, 1632.3, 1656.8, 1675.6},
                                       {1580.7, 1618.7, 1648.9, 1673.1, 1691.8},
                                       {1598.8, 1636.0, 1665.5, 1689.3, 1707.8},
                                       {1616.8, 1653.3, 1682.1, 1705.4, 1723.5}}},
                                     {35.0,
                                      {{1449.1, 1489.8, 1521.5, 1545.6, 1563.2},
                                       {1465.5, 1506.3, 1538.1, 1562.4, 1580.2},
                                       {1482.3, 1523.0, 1554.7, 1579.2, 1597.1},
                                       {1499.3, 1539.7, 1571.3, 1595.9, 1613.9},
                                       {1516.5, 1556.5, 1587.9, 1612.5, 1630.7},
                                       {1534.0, 1573.4, 1604.5, 1629.0, 1647.3},
                                       {1551.6, 1590.4, 1621.0, 1645.4, 1663.8},
                                       {1569.4, 1607.5, 1637.6, 1661.7, 1680.1},
                                       {1587.2, 1624.6, 1654.1, 1677.9, 1696.2},
                                       {1605.2, 1641.8, 1670.6, 1694.0, 1712.2},
                                       {1623.2, 1659.0, 1687.2, 1710.1, 1727.8}}}};

// UNESCO 44's table of depth: one row per latitude of 0, 30, 45, 60, 90 degrees, one column per
// pressure.
constexpr double depth_latitudes_deg[] = {0.0, 30.0, 45.0, 60.0, 90.0};
constexpr double depth_pressures_dbar[] = {500.0, 1000.0, 5000.0, 9000.0};
constexpr double depths_m[5][4] = {{496.65, 992.12, 4915.04, 8771.07},
                                   {496.00, 990.81, 4908.56, 8759.51},
                                   {495.34, 989.50, 4902.08, 8747.95},
                                   {494.69, 988.19, 4895.60, 8736.40},
                                   {494.03, 986.88, 4889.13, 8724.85}};

struct AbsorptionCase {
  double frequency_hz, temperature_c, salinity_psu, depth_m, ph;
  double francois_garrison_db_per_km, ainslie_mccolm_db_per_km;
};
constexpr AbsorptionCase absorption_cases[] = {{100e3, 27.0, 35.0, 0.0, 8.1, 35.662, 35.378},
                                               {120e3, 12.0, 34.0, 20.0, 8.0, 40.168, 41.108},
                                               {300e3, 15.0, 35.0, 10.0, 8.0, 85.514, 89.206}};

}  // namespace

TEST_CASE("Mackenzie's sound speed has its check value: 25 degrees, 35 psu, 1000 m") {
  CHECK(sound_speed_mps({.temperature_c = 25.0, .salinity_psu = 35.0}, 1000.0) ==
        Approx(1550.744).margin(0.0005));
}

TEST_CASE("Chen and Millero's sound speed has UNESCO 44's check value and fits its table") {
  CHECK(chen_millero_mps(40.0, 40.0, 10000.0) == Approx(1731.995).margin(0.0005));
  for (const UnescoTable& table : unesco_tables)
    for (int p = 0; p < 11; ++p)
      for (int t = 0; t < 5; ++t) {
        CAPTURE(table.salinity_psu, p, t);
        CHECK(std::abs(chen_millero_mps(10.0 * t, table.salinity_psu, 1000.0 * p) -
                       table.mps[p][t]) < 0.05);
      }
}

TEST_CASE("Chen and Millero's formula uses the temperature scale of its coefficients") {
  // Pond and Pickard, Introductory Dynamical Oceanography (1986), at 20 degrees IPTS-68.
  CHECK(chen_millero_mps(20.0, 35.0, 5000.0) == Approx(1604.4763).margin(0.0001));
  // The same number on ITS-90 is 4.8 mK more, and the table has 2.78 m/s per degree there.
  CHECK(chen_millero_sound_speed_mps({.temperature_c = 20.0, .salinity_psu = 35.0}, 5000.0) -
            chen_millero_mps(20.0, 35.0, 5000.0) ==
        Approx(0.0048 * (1629.0 - 1573.4) / 20.0).epsilon(0.02));
}

TEST_CASE("Leroy's sound speed has its reference value and is the same in both hemispheres") {
  const SeaWater water = {.temperature_c = 12.0, .salinity_psu = 35.0};
  CHECK(leroy_sound_speed_mps(water, 100.0, 45.0 * degree) == Approx(1498.469).margin(0.0005));
  CHECK(sound_speed_mps(water, 100.0) == Approx(1498.456).margin(0.0005));
  for (const double latitude_deg : {10.0, 45.0, 90.0})
    CHECK(leroy_sound_speed_mps(water, 5000.0, latitude_deg * degree) ==
          leroy_sound_speed_mps(water, 5000.0, -latitude_deg * degree));
  // Gravity, and so pressure at a depth, grows from the equator to the pole.
  CHECK(leroy_sound_speed_mps(water, 5000.0, 90.0 * degree) -
            leroy_sound_speed_mps(water, 5000.0, 0.0) ==
        Approx(0.54));
}

TEST_CASE("The sound speeds agree within 0.4 m/s in real waters") {
  struct Place {
    double temperature_c, salinity_psu, depth_m, latitude_deg;
  };
  for (const auto& [t, s, d, latitude] : {Place{25.0, 36.0, 0.0, 20.0},
                                          {15.0, 38.5, 100.0, 40.0},
                                          {10.0, 35.0, 50.0, 55.0},
                                          {5.0, 32.0, 20.0, 60.0},
                                          {4.0, 35.0, 1500.0, 30.0},
                                          {2.0, 34.7, 4000.0, 30.0},
                                          {1.0, 34.7, 6000.0, 45.0}}) {
    CAPTURE(t, s, d, latitude);
    const SeaWater water = {.temperature_c = t, .salinity_psu = s};
    const double mackenzie = sound_speed_mps(water, d);
    CHECK(std::abs(leroy_sound_speed_mps(water, d, latitude * degree) - mackenzie) < 0.4);
    // In deep water, Chen and Millero are known to be too fast: Millero and Li, JASA 95, 2757
    // (1994).
    const double beyond =
        chen_millero_sound_speed_mps(water, pressure_at_depth_dbar(d, latitude * degree)) -
        mackenzie;
    CHECK(beyond > -0.4);
    CHECK(beyond < (d <= 1000.0 ? 0.4 : 1.3));
  }
}

TEST_CASE("Leroy's sound speed agrees with a second implementation in warm, deep and salty water") {
  const auto mps = [](double t, double s, double d, double latitude_deg) {
    return leroy_sound_speed_mps({.temperature_c = t, .salinity_psu = s}, d, latitude_deg * degree);
  };
  CHECK(mps(24.0, 38.5, 4000.0, 60.0) == Approx(1603.356752).margin(1e-6));
  CHECK(mps(20.0, 37.0, 2500.0, 30.0) == Approx(1565.5761625).margin(1e-6));
}

TEST_CASE("Sound is faster in warmer, saltier and deeper water by every formula") {
  const auto slopes = [](const std::function<double(const SeaWater&, double)>& speed) {
    for (double t = 0.0; t < 29.0; t += 1.0)
      for (double s = 30.0; s < 39.0; s += 3.0)
        for (double d = 0.0; d < 1900.0; d += 200.0) {
          const double here = speed({.temperature_c = t, .salinity_psu = s}, d);
          CHECK(speed({.temperature_c = t + 0.1, .salinity_psu = s}, d) > here);
          CHECK(speed({.temperature_c = t, .salinity_psu = s + 0.1}, d) > here);
          CHECK(speed({.temperature_c = t, .salinity_psu = s}, d + 1.0) > here);
        }
  };
  slopes(sound_speed_mps);
  slopes(chen_millero_sound_speed_mps);
  slopes([](const SeaWater& water, double d) { return leroy_sound_speed_mps(water, d, 0.7); });
}

TEST_CASE("Distilled water at the surface has the measured sound speed") {
  // Del Grosso and Mader, JASA 52, 1442 (1972): 1482.34 m/s at 20 degrees.
  CHECK(chen_millero_mps(20.0, 0.0, 0.0) == Approx(1482.34).margin(0.05));
  CHECK(chen_millero_mps(0.0, 0.0, 0.0) == Approx(1402.388).margin(1e-9));
}

TEST_CASE("Depth and pressure convert as in UNESCO 44, and back without loss") {
  CHECK(depth_of_pressure_m(10000.0, 30.0 * degree) == Approx(9712.653).margin(0.0005));
  CHECK(pressure_at_depth_dbar(9712.653, 30.0 * degree) == Approx(10000.0).margin(0.0005));
  for (int i = 0; i < 5; ++i)
    for (int k = 0; k < 4; ++k) {
      CAPTURE(i, k);
      CHECK(std::abs(depth_of_pressure_m(depth_pressures_dbar[k], depth_latitudes_deg[i] * degree) -
                     depths_m[i][k]) < 0.0051);
    }
  for (const double latitude_deg : {-90.0, -20.0, 0.0, 45.0, 90.0})
    for (double depth_m = 0.0; depth_m <= 12000.0; depth_m += 93.75) {
      const double p = pressure_at_depth_dbar(depth_m, latitude_deg * degree);
      CHECK(depth_of_pressure_m(p, latitude_deg * degree) == Approx(depth_m).epsilon(1e-14));
    }
}

TEST_CASE("Depth grows with pressure by the weight of the standard ocean's water") {
  // dz/dp = 1e4 Pa / (rho g), with rho g of sea water at the surface at 45 degrees: 1028.1 x 9.806.
  CHECK(depth_of_pressure_m(1.0, 45.0 * degree) == Approx(1e4 / (1028.1 * 9.8062)).epsilon(2e-4));
  double last = 0.0;
  for (double p = 10.0; p <= 12500.0; p += 10.0) {
    const double depth_m = depth_of_pressure_m(p, 0.3);
    CHECK(depth_m - last > 9.2);
    CHECK(depth_m - last < 10.0);
    last = depth_m;
  }
}

TEST_CASE("Absorption has its reference values by both formulas, and they agree within a tenth") {
  for (const AbsorptionCase& c : absorption_cases) {
    CAPTURE(c.frequency_hz);
    const SeaWater water = {c.temperature_c, c.salinity_psu, c.ph};
    const double fg = 1000.0 * absorption_db_per_m(water, c.depth_m, c.frequency_hz);
    const double am = 1000.0 * ainslie_mccolm_absorption_db_per_m(water, c.depth_m, c.frequency_hz);
    CHECK(fg == Approx(c.francois_garrison_db_per_km).epsilon(1e-4));
    CHECK(am == Approx(c.ainslie_mccolm_db_per_km).epsilon(1e-4));
    CHECK(am / fg == Approx(1.0).margin(0.1));
  }
}

TEST_CASE("Absorption agrees with Francois and Garrison's table, to its digits") {
  struct Row {
    double temperature_c, salinity_psu, frequency_hz, db_per_km, rounding;
  };
  for (const auto& [t, s, f, db_per_km, rounding] : {Row{0.0, 30.0, 1e3, 0.061, 0.0005},
                                                     {0.0, 35.0, 1e3, 0.064, 0.0005},
                                                     {10.0, 35.0, 1e3, 0.060, 0.0005},
                                                     {0.0, 30.0, 10e3, 1.12, 0.005},
                                                     {0.0, 35.0, 10e3, 1.29, 0.005},
                                                     {10.0, 35.0, 10e3, 0.963, 0.0005},
                                                     {0.0, 30.0, 100e3, 21.0, 0.05},
                                                     {0.0, 35.0, 100e3, 23.4, 0.05},
                                                     {10.0, 35.0, 100e3, 33.6, 0.05}}) {
    CAPTURE(t, s, f);
    CHECK(std::abs(1000.0 * absorption_db_per_m({t, s, 8.0}, 0.0, f) - db_per_km) <= rounding);
  }
}

TEST_CASE("Absorption agrees with a second implementation in deep and in warm water") {
  for (const AbsorptionCase& c :
       {AbsorptionCase{1e6, 3.0, 34.7, 4000.0, 7.8, 376.735104, 360.757542},
        {30e3, 28.0, 36.0, 2000.0, 7.9, 3.066741210, 2.906987470},
        {1e6, 29.0, 36.0, 500.0, 8.2, 327.706538, 343.783820}}) {
    const SeaWater water = {c.temperature_c, c.salinity_psu, c.ph};
    CHECK(1000.0 * absorption_db_per_m(water, c.depth_m, c.frequency_hz) ==
          Approx(c.francois_garrison_db_per_km).epsilon(1e-8));
    CHECK(1000.0 * ainslie_mccolm_absorption_db_per_m(water, c.depth_m, c.frequency_hz) ==
          Approx(c.ainslie_mccolm_db_per_km).epsilon(1e-8));
  }
}

TEST_CASE("Depth reduces absorption equally in both formulas") {
  const SeaWater water = {.temperature_c = 4.0, .salinity_psu = 34.7, .ph = 8.0};
  for (const double f : {30e3, 100e3, 300e3, 1e6}) {
    CAPTURE(f);
    const auto share = [&](const auto& absorption) {
      return absorption(water, 4000.0, f) / absorption(water, 0.0, f);
    };
    CHECK(share(absorption_db_per_m) < 0.9);
    CHECK(share(absorption_db_per_m) ==
          Approx(share(ainslie_mccolm_absorption_db_per_m)).epsilon(0.1));
  }
}

TEST_CASE("Absorption grows with frequency, and fresh water absorbs less than the sea") {
  for (const auto absorption : {absorption_db_per_m, ainslie_mccolm_absorption_db_per_m}) {
    double last = 0.0;
    for (double f = 1e3; f < 2e6; f *= 1.2) {
      const double here = absorption({}, 20.0, f);
      CHECK(here > last);
      CHECK(absorption({.salinity_psu = 0.5}, 20.0, f) < here);
      last = here;
    }
  }
}

TEST_CASE(
    "Without salt absorption is that of viscosity, which grows as the square of the frequency") {
  for (const auto absorption : {absorption_db_per_m, ainslie_mccolm_absorption_db_per_m}) {
    const SeaWater fresh = {.temperature_c = 15.0, .salinity_psu = 0.0};
    const double at_1_khz = absorption(fresh, 0.0, 1e3);
    CHECK(at_1_khz > 0.0);
    CHECK(absorption(fresh, 0.0, 100e3) == Approx(1e4 * at_1_khz));
    // Pinkerton's alpha / f^2 of pure water at 15 degrees, 30e-15 s^2/m in nepers.
    CHECK(at_1_khz == Approx(30e-15 * 1e6 * 8.686).epsilon(0.1));
  }
}

TEST_CASE("Absorption does not jump where Francois and Garrison change polynomials at 20 degrees") {
  for (const double f : {10e3, 100e3, 1e6}) {
    const double below = absorption_db_per_m({.temperature_c = 20.0}, 0.0, f);
    const double above = absorption_db_per_m({.temperature_c = std::nextafter(20.0, 21.0)}, 0.0, f);
    CHECK(above == Approx(below).epsilon(2e-3));
  }
}

TEST_CASE("Acidity matters at low frequency only, where an alkaline sea absorbs more") {
  const SeaWater acid = {.ph = 7.7}, alkaline = {.ph = 8.3};
  for (const auto absorption : {absorption_db_per_m, ainslie_mccolm_absorption_db_per_m}) {
    CHECK(absorption(alkaline, 0.0, 1e3) > 1.8 * absorption(acid, 0.0, 1e3));
    CHECK(absorption(alkaline, 0.0, 300e3) == Approx(absorption(acid, 0.0, 300e3)).epsilon(0.005));
  }
}

TEST_CASE("Water that no sea has is refused with the range in the message") {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  constexpr double inf = std::numeric_limits<double>::infinity();
  for (const double t : {-5.0, 51.0, nan, inf, -inf}) {
    const SeaWater water = {.temperature_c = t};
    CHECK_THROWS_WITH(sound_speed_mps(water, 0.0), Catch::Contains("expected -4 to 50"));
    CHECK_THROWS_AS(chen_millero_sound_speed_mps(water, 0.0), std::invalid_argument);
    CHECK_THROWS_AS(leroy_sound_speed_mps(water, 0.0, 0.0), std::invalid_argument);
    CHECK_THROWS_AS(absorption_db_per_m(water, 0.0, 1e5), std::invalid_argument);
    CHECK_THROWS_AS(ainslie_mccolm_absorption_db_per_m(water, 0.0, 1e5), std::invalid_argument);
  }
  for (const double s : {-1e-9, 51.0, nan, inf})
    CHECK_THROWS_WITH(sound_speed_mps({.salinity_psu = s}, 0.0), Catch::Contains("0 to 50 psu"));
  for (const double d : {-1.0, 12001.0, nan, inf}) {
    CHECK_THROWS_WITH(sound_speed_mps({}, d), Catch::Contains("depth"));
    CHECK_THROWS_AS(absorption_db_per_m({}, d, 1e5), std::invalid_argument);
    CHECK_THROWS_AS(pressure_at_depth_dbar(d, 0.0), std::invalid_argument);
  }
  for (const double p : {-1.0, 12501.0, nan, inf}) {
    CHECK_THROWS_WITH(depth_of_pressure_m(p, 0.0), Catch::Contains("0 to 12500 dbar"));
    CHECK_THROWS_AS(chen_millero_sound_speed_mps({}, p), std::invalid_argument);
  }
  for (const double latitude_rad : {-1.6, 1.6, nan}) {
    CHECK_THROWS_WITH(depth_of_pressure_m(10.0, latitude_rad), Catch::Contains("-90 to 90"));
    CHECK_THROWS_AS(leroy_sound_speed_mps({}, 10.0, latitude_rad), std::invalid_argument);
  }
  for (const double f : {0.0, -1.0, nan, inf})
    CHECK_THROWS_WITH(absorption_db_per_m({}, 0.0, f), Catch::Contains("frequency"));
  for (const double ph : {5.0, 9.5, nan}) {
    CHECK_THROWS_WITH(absorption_db_per_m({.ph = ph}, 0.0, 1e5), Catch::Contains("pH"));
    CHECK_THROWS_WITH(sound_speed_mps({.ph = ph}, 0.0), Catch::EndsWith("expected 6 to 9"));
  }
}

TEST_CASE("A cast's own pressure, temperature and salinity give the sound speed that it recorded") {
  const auto file =
      ensonify::tests::data_file("soundspeed/castaway__11E101663_20120821_122817.csv");
  if (!file) {
    WARN("skipped: the Castaway cast is missing");
    return;
  }
  std::ifstream stream(*file);
  int rows = 0;
  for (std::string line; std::getline(stream, line);) {
    if (line.starts_with('%') || line.starts_with("Pressure")) continue;
    std::istringstream fields(line);
    std::vector<double> value;
    for (std::string field; std::getline(fields, field, ',');) value.push_back(std::stod(field));
    REQUIRE(value.size() == 8);
    CAPTURE(line);
    CHECK(std::abs(chen_millero_sound_speed_mps(
                       {.temperature_c = value[2], .salinity_psu = value[5]}, value[0]) -
                   value[6]) < 0.02);
    ++rows;
  }
  CHECK(rows == 75);
}

TEST_CASE("A sound speed gives back its temperature, or the nearest one in the formula's range") {
  for (const double salinity_psu : {25.0, 35.0, 40.0})
    for (const double depth_m : {0.0, 20.0, 4000.0}) {
      for (const double temperature_c : {-1.9, 4.0, 13.7, 29.9}) {
        const SeaWater water{.temperature_c = temperature_c, .salinity_psu = salinity_psu};
        CHECK(temperature_of_sound_speed_c(sound_speed_mps(water, depth_m), salinity_psu,
                                           depth_m) == Approx(temperature_c).margin(1e-6));
      }
      CHECK(temperature_of_sound_speed_c(1000.0, salinity_psu, depth_m) == Approx(-2.0));
      CHECK(temperature_of_sound_speed_c(2000.0, salinity_psu, depth_m) == Approx(30.0));
    }
}
