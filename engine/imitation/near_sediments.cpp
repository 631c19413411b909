#include <ensonify/engine/imitation/near_sediments.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include <Eigen/Dense>

#include <ensonify/engine/base/quantile.h>
#include <ensonify/engine/base/units.h>
#include <ensonify/engine/seafloor/material.h>
#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/energy_bound.h>

namespace ensonify::engine {

namespace {

/// What is fitted in addition to the sediment: a constant, the altitude (in bins) and the gain over
/// range (in dB per factor of ten).
constexpr int unknowns = 3;
using Unknowns = Eigen::Matrix<double, unknowns, 1>;

/// The level of the bed in a cell of grazing angle.
struct Cell {
  std::size_t number;
  double weight;     ///< 1 / variance, dB^-2
  Unknowns changes;  ///< by how many dB the level changes with each unknown
};

/// The cells with a level, and how much each of them counts. The error of a level has these parts:
/// - an error that is the same in all cells: relief, cells of finite size, a beam that is not
///   stated;
/// - speckle, of the recording and of the simulation: a steeper cell has fewer samples;
/// - the noise floor, if it is near the level of the bed.
///
/// An error of the bottom line shifts the grazing angles of all cells. Where the level changes
/// steeply with the angle because of a narrow beam, an error of one bin can change the level of a
/// cell by more than the levels of two sediments differ.
std::vector<Cell> weighted_cells(const LineModel& model, const GrazingLevels& excess_db,
                                 bool beam_is_stated) {
  const std::vector<double>& altitudes_m = model.path.altitude_m;
  const double altitude_m = mean_of(altitudes_m),
               altitude_bins = altitude_m * static_cast<double>(model.samples) / model.range_m,
               rows = static_cast<double>(altitudes_m.size()) *
                      (model.port && model.starboard ? 2.0 : 1.0);
  // The contrast of the power is twice that of the amplitude.
  const double power_contrast =
      2.0 * speckle_of(model.recorder.detector, model.recorder.looks).contrast;
  const GrazingLevels level_db = mean_of_sides(model.levels_db);  // of the recording
  std::vector<Cell> cells;
  for (std::size_t i = first_sediment_cell; i < end_sediment_cell; ++i) {
    if (!std::isfinite(excess_db[i])) continue;
    const double grazing = grazing_cell_rad(i), sine = std::sin(grazing);
    // The range is altitude / sine.
    const double samples =
        rows * altitude_bins * std::cos(grazing) / (sine * sine) * grazing_cell_deg * degree;
    const double alike_db = beam_is_stated ? 0.1 : 3.0;
    constexpr double lines = 2.0, correlated_samples = 2.0,
                     db_per_share = 10.0 / std::numbers::ln10;
    const double speckle_db = samples > 0.0 ? db_per_share * power_contrast *
                                                  std::sqrt(lines * correlated_samples / samples)
                                            : 0.0;
    constexpr double floor_error_db = 1.0;
    const double floor_share =
                     std::min(1.0, scatter::from_db(model.recorder.column_db - level_db[i])),
                 floor_db = floor_error_db * floor_share;
    constexpr std::size_t around = 2;
    const double slope_db = (level_db[i + around] - level_db[i - around]) /
                            (2.0 * around * grazing_cell_deg * degree),
                 by_a_bin_db = slope_db * std::tan(grazing) / altitude_bins;
    cells.push_back({i,
                     1.0 / (alike_db * alike_db + speckle_db * speckle_db + floor_db * floor_db),
                     {1.0, std::isfinite(by_a_bin_db) ? by_a_bin_db : 0.0, -std::log10(sine)}});
  }
  return cells;
}

std::unique_ptr<scatter::Backscatter> bottom_of(const LineModel& model, std::string_view material) {
  return backscatter_of(material_named(material, {}), model.frequency_hz, model.sound_speed_mps,
                        0.0);
}

}  // namespace

GrazingLevels strength_db(const LineModel& model, std::string_view material) {
  GrazingLevels levels;
  const auto bottom = bottom_of(model, material);
  for (std::size_t i = 0; i < grazing_cells; ++i)
    levels[i] = scatter::to_db(bottom->cross_section(grazing_cell_rad(i)));
  return levels;
}

std::vector<NearSediment> nearest_sediments(const LineModel& model, const GrazingLevels& excess_db,
                                            bool beam_is_stated) {
  const GrazingLevels base = strength_db(model, model.material);
  const std::vector<Cell> cells = weighted_cells(model, excess_db, beam_is_stated);
  constexpr std::size_t fewest_cells = 5;
  if (cells.size() < fewest_cells) return {};
  // What is known before the fit, as 1 / variance: nothing of the constant; the altitude to one
  // bin; the gain over range to 1 dB per factor of ten.
  const Eigen::Matrix<double, unknowns, unknowns> known = Unknowns(0.0, 1.0, 1.0).asDiagonal();
  std::vector<NearSediment> all;
  for (const scatter::NamedSediment& sediment : scatter::named_sediments()) {
    if (!beam_is_stated && !sediment.mean_grain_size_phi) continue;
    if (scatter::energy_excess(*bottom_of(model, sediment.name))) continue;
    const GrazingLevels levels = strength_db(model, sediment.name);
    Eigen::Matrix<double, unknowns, unknowns> squares = known;
    Unknowns products = Unknowns::Zero();
    const auto left_db = [&](const Cell& cell) {
      return excess_db[cell.number] - (levels[cell.number] - base[cell.number]);
    };
    for (const Cell& cell : cells) {
      squares += cell.weight * cell.changes * cell.changes.transpose();
      products += cell.weight * left_db(cell) * cell.changes;
    }
    const Unknowns best = squares.ldlt().solve(products);
    double sum = best.dot(known * best), weights = 0.0;
    for (const Cell& cell : cells) {
      sum += cell.weight * std::pow(left_db(cell) - cell.changes.dot(best), 2);
      weights += cell.weight;
    }
    if (std::isfinite(sum))
      all.push_back({std::string(sediment.name), std::sqrt(sum / weights), sum});
  }
  std::ranges::stable_sort(all, {}, &NearSediment::chi_squared);
  return all;
}

std::size_t as_near_as_the_first(const std::vector<NearSediment>& sediments) {
  constexpr double clearly = 3.0;  // in standard deviations
  return static_cast<std::size_t>(std::ranges::count_if(sediments, [&](const NearSediment& one) {
    return one.chi_squared < sediments.front().chi_squared + clearly * clearly;
  }));
}

}  // namespace ensonify::engine
