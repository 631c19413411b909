#include <ensonify/engine/imitation/near_sediments.h>

#include <algorithm>
#include <cmath>

#include <ensonify/engine/seafloor/material.h>
#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/energy_bound.h>

namespace ensonify::engine {

std::vector<NearSediment> nearest_sediments(const LineModel& model, const GrazingLevels& excess_db,
                                            bool rock_too) {
  const auto backscatter = [&](std::string_view name) {
    return backscatter_of(material_named(name, {}), model.frequency_hz, model.sound_speed_mps, 0.0);
  };
  const auto strength = [](const scatter::Backscatter& material) {
    GrazingLevels levels;
    for (std::size_t i = 0; i < grazing_cells; ++i)
      levels[i] = scatter::to_db(material.cross_section(grazing_cell_rad(i)));
    return levels;
  };
  const GrazingLevels base = strength(*backscatter(model.material));
  std::vector<NearSediment> all;
  for (const scatter::NamedSediment& sediment : scatter::named_sediments()) {
    if (!rock_too && !sediment.mean_grain_size_phi) continue;
    const auto its_backscatter = backscatter(sediment.name);
    if (scatter::energy_excess(*its_backscatter)) continue;
    const GrazingLevels levels = strength(*its_backscatter);
    std::vector<double> off;
    for (std::size_t i = first_sediment_cell; i < end_sediment_cell; ++i)
      if (const double left = excess_db[i] - (levels[i] - base[i]); std::isfinite(left))
        off.push_back(left);
    if (off.size() < 5) return {};
    double mean = 0.0;
    for (const double left : off) mean += left / static_cast<double>(off.size());
    double squares = 0.0;
    for (const double left : off) squares += (left - mean) * (left - mean);
    all.push_back(
        {std::string(sediment.name), std::sqrt(squares / static_cast<double>(off.size()))});
  }
  std::ranges::stable_sort(all, {}, &NearSediment::rms_db);
  return all;
}

}  // namespace ensonify::engine
