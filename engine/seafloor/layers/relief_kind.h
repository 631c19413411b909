#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/layers/area.h>
#include <ensonify/engine/seafloor/layers/layer_draws.h>

namespace ensonify::engine {

/// Whether a scattered feature may stand at a place.
using Allowed = std::function<bool(double x_m, double y_m)>;

/// One number of a layer of relief: a key of the scene, and what may be given for it. Its range and
/// its documentation are defined here only.
template <class Relief>
struct ReliefValue {
  std::string_view key;  ///< ends with the unit; the member of a key in degrees is in radians
  std::string_view unit;
  double low = 0.0, high = 0.0;  ///< the allowed range, ends included, in the key's unit
  std::string_view help;         ///< one sentence
  std::variant<double Relief::*, int Relief::*> member;
};

/// How a layer is added to a level field. The function's type decides how the layer joins the bed.
/// `marked` takes the number of a feature, from 1, at the points that belong to it. `weight` is the
/// softened area, 0 to 1.

/// All over the area, fading out at its border: where `weight` is 0, the heights are not used. The
/// layer has no features.
template <class Relief>
using AddEverywhere = void (*)(Heightfield&, const Relief&, const LayerDraws&,
                               std::span<const double> weight);
/// The same with features, which end where the area does.
template <class Relief>
using AddMarked = void (*)(Heightfield&, const Relief&, const LayerDraws&,
                           std::span<std::uint32_t> marked);
/// Features that are whole wherever their middle is in the area.
template <class Relief>
using AddScattered = void (*)(Heightfield&, const Relief&, const LayerDraws&, const Allowed&,
                              std::span<std::uint32_t> marked);
/// Ground that rises from below the bed where `weight` grows, and covers what lies lower. It has no
/// features.
template <class Relief>
using AddRising = void (*)(Heightfield&, const Relief&, const LayerDraws&,
                           std::span<const double> weight, std::span<std::uint32_t> marked);

/// The definition of one kind of layer. Each kind has one, in its own file:
/// `const ReliefKind<PitRelief>& kind_of(const PitRelief&)`. seabed.h lists the kinds.
template <class Relief>
struct ReliefKind {
  std::string_view list;  ///< scenes have the layer as [[seafloor.LIST]]
  std::string_view help;
  Purpose purpose;              ///< of its random numbers
  std::string_view class_name;  ///< in the labels; empty: as the bed, for forms of the sediment
  std::string_view material;    ///< empty: as the bed
  Area area = {};               ///< where it lies by default
  std::variant<AddEverywhere<Relief>, AddMarked<Relief>, AddScattered<Relief>, AddRising<Relief>>
      add;
  double Relief::*size_m = nullptr;  ///< of its features, which cells must be fine enough to show
  std::vector<ReliefValue<Relief>> values;

  /// Whether its features are numbered in the labels, and so are targets of a dataset.
  bool has_instances() const {
    return std::holds_alternative<AddMarked<Relief>>(add) ||
           std::holds_alternative<AddScattered<Relief>>(add);
  }
};

/// Throws std::invalid_argument, "pits: 'depth_ratio' is 2, expected 0 to 1", for a value outside
/// its range. `value` is the member's (radians for a key in degrees).
void check_relief_value(std::string_view list, std::string_view key, double low, double high,
                        double value);

/// The same for all values of a relief.
template <class Relief>
void check_relief(const Relief& relief) {
  const ReliefKind<Relief>& kind = kind_of(relief);
  for (const ReliefValue<Relief>& row : kind.values)
    std::visit(
        [&](auto member) {
          check_relief_value(kind.list, row.key, row.low, row.high, relief.*member);
        },
        row.member);
}

/// Throws std::invalid_argument for features that would cover the bed more than twenty times.
/// mean_square: of their diameters, in squares of diameter_m.
void check_cover(std::string_view list, double per_hectare, double diameter_m,
                 double mean_square = 1.0);

}  // namespace ensonify::engine
