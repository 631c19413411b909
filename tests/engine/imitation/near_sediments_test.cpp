// Finds the sediment whose level over the angle is nearest to a line's level.

#include <cmath>
#include <vector>

#include "support/catch.h"

#include "made_line.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/imitation/imitate.h>
#include <ensonify/engine/imitation/line_fit.h>
#include <ensonify/engine/imitation/near_sediments.h>
#include <ensonify/engine/seafloor/material.h>
#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/decibel.h>

using namespace ensonify;
using namespace ensonify::engine;

TEST_CASE("the sediment whose backscatter explains the level over the angle is the nearest") {
  LineModel model;
  model.material = "medium sand";
  const auto strength_db = [&](const char* name, double grazing_rad) {
    return 10.0 * std::log10(backscatter_of(material_named(name, {}), model.frequency_hz,
                                            model.sound_speed_mps, 0.0)
                                 ->cross_section(grazing_rad));
  };
  for (const char* name : {"rough rock", "sandy gravel", "clay"}) {
    GrazingLevels excess_db;
    for (std::size_t i = 0; i < grazing_cells; ++i) {
      const double angle = (static_cast<double>(i) + 0.5) * grazing_cell_deg * degree;
      excess_db[i] = strength_db(name, angle) - strength_db("medium sand", angle) + 7.0;
    }
    const std::vector<NearSediment> sediments = nearest_sediments(model, excess_db, true);
    CAPTURE(name, sediments.front().name);
    CHECK(sediments.front().rms_db < 1e-6);
    CHECK(std::ranges::any_of(
        sediments, [&](const NearSediment& one) { return one.name == name && one.rms_db < 1e-6; }));
    // It would return more energy than arrives.
    CHECK(std::ranges::none_of(
        sediments, [](const NearSediment& one) { return one.name == "handbook rough rock"; }));
  }
  GrazingLevels none;
  none.fill(std::nan(""));
  CHECK(nearest_sediments(model, none, true).empty());
}

TEST_CASE("an error of the bottom line does not change the sediment that a narrow beam shows") {
  LineModel model;
  model.samples = 500;
  model.range_m = 40.0;
  model.path.altitude_m.assign(224, 7.0);
  const auto strength_db = [&](const char* name, double grazing_rad) {
    return 10.0 * std::log10(backscatter_of(material_named(name, {}), model.frequency_hz,
                                            model.sound_speed_mps, 0.0)
                                 ->cross_section(grazing_rad));
  };
  // A beam of 50 degrees at 20 degrees of depression: 12 dB two ways over half its width.
  const auto beam_db = [](double grazing_rad) {
    return -6.0 * std::pow((grazing_rad / degree - 20.0) / 25.0, 2);
  };
  for (const double bins : {-0.7, 0.0, 0.7}) {
    GrazingLevels excess_db;
    for (std::size_t i = 0; i < grazing_cells; ++i) {
      const double angle = grazing_cell_rad(i);
      // A range is altitude / sin(angle), so another altitude gives a range another angle.
      const double other = std::asin(std::min(1.0, std::sin(angle) * (1.0 + bins * 0.08 / 7.0)));
      for (const std::size_t side : {0u, 1u})
        model.levels_db[side][i] = beam_db(angle) + strength_db("fine sand", angle) + 10.0;
      excess_db[i] = strength_db("fine sand", angle) - strength_db("medium sand", angle) +
                     beam_db(other) - beam_db(angle);
    }
    const std::vector<NearSediment> sediments = nearest_sediments(model, excess_db, true);
    CAPTURE(bins, sediments.front().name);
    CHECK(sediments.front().name == "fine sand");
    // Silts have nearly one backscatter, sands have not.
    CHECK(as_near_as_the_first(sediments) < 6);
  }
  GrazingLevels excess_db;
  for (std::size_t i = 0; i < grazing_cells; ++i)
    excess_db[i] =
        strength_db("silt", grazing_cell_rad(i)) - strength_db("medium sand", grazing_cell_rad(i));
  CHECK(as_near_as_the_first(nearest_sediments(model, excess_db, true)) > 5);
}
