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

/// Whether the middle of a scattered feature may be at a place.
using Allowed = std::function<bool(double x_m, double y_m)>;

/// One number of a layer of relief: its key in scenes, unit, allowed range and help.
template <class Relief>
struct ReliefValue {
  std::string_view key;  ///< ends with the unit; if that is degrees, the member is in radians
  std::string_view unit;
  double low = 0.0, high = 0.0;  ///< the allowed range, ends included, in the key's unit
  std::string_view help;         ///< one sentence
  std::variant<double Relief::*, int Relief::*> member;
};

// How a layer is added to a level field. The function's type decides how the layer joins the bed.
// `marked` gets the number of a feature, from 1, at the points of the feature. `weight` is the
// softened area, 0 to 1.

/// Everywhere in the area, fading out at the area's border. Where `weight` is 0, the heights are
/// not used. The layer has no features.
template <class Relief>
using AddEverywhere = void (*)(Heightfield&, const Relief&, const LayerDraws&,
                               std::span<const double> weight);
/// As AddEverywhere, with features that end at the area's border.
template <class Relief>
using AddMarked = void (*)(Heightfield&, const Relief&, const LayerDraws&,
                           std::span<std::uint32_t> marked);
/// Features that are complete if their middle is in the area.
template <class Relief>
using AddScattered = void (*)(Heightfield&, const Relief&, const LayerDraws&, const Allowed&,
                              std::span<std::uint32_t> marked);
/// Ground that rises with `weight` and covers what is lower. The layer has no features.
template <class Relief>
using AddRising = void (*)(Heightfield&, const Relief&, const LayerDraws&,
                           std::span<const double> weight, std::span<std::uint32_t> marked);

/// The definition of one kind of layer. The file of each kind has a function that returns it, such
/// as `const ReliefKind<PitRelief>& kind_of(const PitRelief&)`. seabed.h lists the kinds.
template <class Relief>
struct ReliefKind {
  std::string_view list;  ///< scenes have the layer as [[seafloor.LIST]]
  std::string_view help;
  Purpose purpose;              ///< of the layer's random numbers
  std::string_view class_name;  ///< in the labels; empty: the class of the bed
  std::string_view material;    ///< empty: the material of the bed
  Area area = {};               ///< where the layer lies by default
  std::variant<AddEverywhere<Relief>, AddMarked<Relief>, AddScattered<Relief>, AddRising<Relief>>
      add;
  double Relief::*size_m = nullptr;  ///< size of the features; a warning reports larger cells
  std::vector<ReliefValue<Relief>> values;

  /// Whether the layer's features are numbered in the labels, and so are targets of a dataset.
  bool has_instances() const {
    return std::holds_alternative<AddMarked<Relief>>(add) ||
           std::holds_alternative<AddScattered<Relief>>(add);
  }
};

/// Throws std::invalid_argument, for example "pits: 'depth_ratio' is 2, expected 0 to 1", for a
/// value outside its range. `value` is in radians for a key in degrees.
void check_relief_value(std::string_view list, std::string_view key, double low, double high,
                        double value);

/// Calls check_relief_value() for all values of a relief.
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
/// `mean_square` is the mean of (diameter / diameter_m)^2.
void check_cover(std::string_view list, double per_hectare, double diameter_m,
                 double mean_square = 1.0);

}  // namespace ensonify::engine
