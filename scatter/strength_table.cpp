#include <ensonify/scatter/strength_table.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <utility>

#include <ensonify/scatter/decibel.h>

namespace ensonify::scatter {
namespace {

constexpr double nonzero_grazing_rad = 1e-6;

double strength_db(const StrengthCurve& curve, double grazing_rad) {
  const auto& angles = curve.grazing_rad;
  const auto& levels = curve.strength_db;
  if (grazing_rad <= angles.front())
    return angles.front() > 0.0
               ? levels.front() + 2.0 * to_db(std::sin(grazing_rad) / std::sin(angles.front()))
               : levels.front();
  if (grazing_rad >= angles.back()) return levels.back();
  const auto next =
      static_cast<std::size_t>(std::ranges::upper_bound(angles, grazing_rad) - angles.begin());
  const double place = (grazing_rad - angles[next - 1]) / (angles[next] - angles[next - 1]);
  return std::lerp(levels[next - 1], levels[next], place);
}

bool in_order(const StrengthCurve& curve) {
  const auto& angles = curve.grazing_rad;
  return angles.size() >= 2 && angles.size() == curve.strength_db.size() &&
         std::ranges::adjacent_find(angles, std::not_fn(std::less{})) == angles.end() &&
         angles.front() >= 0.0 && angles.back() <= std::numbers::pi / 2.0 &&
         std::ranges::all_of(curve.strength_db, [](double db) { return std::isfinite(db); });
}

}  // namespace

StrengthTable::StrengthTable(std::vector<StrengthCurve> curves) : curves_(std::move(curves)) {
  const auto frequency = &StrengthCurve::frequency_hz;
  const bool frequencies_in_order =
      std::ranges::adjacent_find(curves_, std::not_fn(std::less{}), frequency) == curves_.end() &&
      (curves_.size() == 1 || std::ranges::all_of(
                                  curves_, [](double hz) { return hz > 0.0; }, frequency));
  if (curves_.empty() || !frequencies_in_order || !std::ranges::all_of(curves_, in_order))
    throw std::invalid_argument(
        "a strength table needs curves of increasing frequency, each of two or more angles that "
        "increase from 0 to pi/2, with a finite strength for each");
}

MeasuredBottom::MeasuredBottom(std::shared_ptr<const StrengthTable> table, double frequency_hz,
                               double offset_db)
    : table_(std::move(table)), offset_db_(offset_db) {
  const std::vector<StrengthCurve>& curves = table_->curves();
  const auto above =
      std::ranges::lower_bound(curves, frequency_hz, {}, &StrengthCurve::frequency_hz);
  above_ = above == curves.end() ? &curves.back() : &*above;
  below_ = above == curves.begin() ? &curves.front() : &*(above - 1);
  if (above_ != below_)
    weight_of_above_ = std::clamp(std::log(frequency_hz / below_->frequency_hz) /
                                      std::log(above_->frequency_hz / below_->frequency_hz),
                                  0.0, 1.0);
}

double MeasuredBottom::cross_section(double grazing_rad) const {
  grazing_rad = std::max(grazing_rad, nonzero_grazing_rad);  // decibels of 0 are infinite
  const double below_db = strength_db(*below_, grazing_rad);
  if (weight_of_above_ == 0.0) return from_db(below_db + offset_db_);
  const double above_db = strength_db(*above_, grazing_rad);
  return from_db(std::lerp(below_db, above_db, weight_of_above_) + offset_db_);
}

}  // namespace ensonify::scatter
