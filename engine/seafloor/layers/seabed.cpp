#include <ensonify/engine/seafloor/layers/seabed.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/engine/base/scene_error.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {
namespace {

using Mask = std::vector<double>;          // of an area: 1 inside, 0 outside
using Marks = std::vector<std::uint32_t>;  // number of the feature at each point, 0: none

class LayerStack {
 public:
  LayerStack(Heightfield& field, const std::string& material, std::uint64_t seed,
             RoughnessInWindows* roughness, const WorkControl& control)
      : field_(field), base_(field), seed_(seed), roughness_(roughness), control_(control) {
    map_.kinds = {{material, "seabed"}};
    map_.point_kind.assign(field.z_m.size(), 0);
  }
  SeabedMap map() && { return std::move(map_); }

  /// Calls lay(layer, mask, draws) for each layer of a list. Exceptions begin with the layer's key.
  template <class Layer, class Lay>
  void each(const std::vector<Layer>& list, std::string_view name, Purpose purpose, Lay lay) {
    for (std::size_t i = 0; i < list.size(); ++i) {
      name_ = fmt::format("{}.{}", name, i);
      const Area& area = list[i].area;
      const LayerDraws draws{seed_, purpose, area.number_at(i), roughness_, control_};
      control_.check_stop();
      const auto fault = [&](const std::exception& error) {
        const std::string key = "seafloor." + name_;
        return SceneError(key, fmt::format("{}: {}", key, error.what()));
      };
      try {
        const Mask mask = area_mask(area, {base_, has_material_}, draws);
        if (!area.on.empty() && !field_.is_window() &&
            std::ranges::none_of(mask, [](double inside) { return inside > 0.0; }))
          map_.warnings.push_back(nowhere_on_warning(name_));
        lay(list[i], mask, draws);
      } catch (const std::invalid_argument& error) {
        throw fault(error);
      } catch (const refine::MeshError& error) {
        throw fault(error);
      }
    }
  }

  void lay_patch(const Patch& patch, const Mask& mask, const LayerDraws& draws) {
    const std::vector<double> weight = softened(mask, field_, patch.area.border_m);
    for (std::size_t i = 0; i < weight.size(); ++i) field_.z_m[i] += patch.rise_m * weight[i];
    // In the border, the weight is the probability that a point gets the patch's sediment.
    paint(patch.material, patch.class_name, [&](std::size_t i) {
      if (weight[i] == 0.0 || weight[i] == 1.0) return weight[i] == 1.0;
      const auto columns = static_cast<std::size_t>(field_.columns);
      std::array<double, 1> draw;
      draws
          .of(layer_stream::mixed_border,
              field_.first_column + static_cast<std::int64_t>(i % columns),
              field_.first_row + static_cast<std::int64_t>(i / columns))
          .uniform(draw);
      return draw[0] <= weight[i];
    });
  }

  template <class Relief>
  void lay_relief(const ReliefLayer<Relief>& layer, const Mask& mask, const LayerDraws& draws) {
    const ReliefKind<Relief>& kind = kind_of(layer.relief);
    const Marks marked =
        std::visit([&](auto add) { return lay(layer, mask, draws, add); }, kind.add);
    if (!layer.class_name.empty() || !layer.material.empty())
      paint(layer.material, layer.class_name, [&](std::size_t i) { return marked[i] != 0; });
    if (kind.has_instances() && !layer.class_name.empty()) assign_instances(marked);
  }

 private:
  // Each lay() adds a layer to the heights and returns the feature of each point.
  template <class Relief>
  Marks lay(const ReliefLayer<Relief>& layer, const Mask& mask, const LayerDraws& draws,
            AddEverywhere<Relief> add) {
    Heightfield relief = level();
    const std::vector<double> weight = softened(mask, field_, layer.area.border_m);
    add(relief, layer.relief, draws, weight);
    return lay_fading(relief, weight, Marks(relief.z_m.size(), 1));
  }
  template <class Relief>
  Marks lay(const ReliefLayer<Relief>& layer, const Mask& mask, const LayerDraws& draws,
            AddMarked<Relief> add) {
    Heightfield relief = level();
    Marks marked(relief.z_m.size(), 0);
    add(relief, layer.relief, draws, marked);
    return lay_fading(relief, softened(mask, field_, layer.area.border_m), std::move(marked));
  }
  template <class Relief>
  Marks lay(const ReliefLayer<Relief>& layer, const Mask& mask, const LayerDraws& draws,
            AddScattered<Relief> add) {
    Heightfield relief = level();
    Marks marked(relief.z_m.size(), 0);
    const auto nearest = [](double place, double cell, int in_all, int first, int count) {
      return static_cast<int>(
          std::clamp(std::round(place / cell + 0.5 * (in_all - 1)) - first, 0.0, count - 1.0));
    };
    const Allowed in_area = [&](double x_m, double y_m) {
      return mask[field_.index(nearest(x_m, field_.cell_east_m, field_.columns_in_all(),
                                       field_.first_column, field_.columns),
                               nearest(y_m, field_.cell_north_m, field_.rows_in_all(),
                                       field_.first_row, field_.rows))] > 0.0;
    };
    add(relief, layer.relief, draws, in_area, marked);
    for (std::size_t i = 0; i < relief.z_m.size(); ++i) field_.z_m[i] += relief.z_m[i];
    return marked;
  }
  template <class Relief>
  Marks lay(const ReliefLayer<Relief>& layer, const Mask& mask, const LayerDraws& draws,
            AddRising<Relief> add) {
    Heightfield rock = level();
    Marks marked(rock.z_m.size(), 0);
    add(rock, layer.relief, draws, softened(mask, field_, layer.area.border_m), marked);
    for (std::size_t i = 0; i < marked.size(); ++i) {
      const double top_m = base_.z_m[i] + rock.z_m[i];
      marked[i] = marked[i] != 0 && top_m > field_.z_m[i];
      if (marked[i] != 0) field_.z_m[i] = top_m;
      if (marked[i] != 0 && !map_.point_feature.empty()) map_.point_feature[i] = 0;
    }
    return marked;
  }

  /// Adds relief that fades out at the area's border, and clears marks where weight is at most 0.5.
  Marks lay_fading(const Heightfield& relief, const std::vector<double>& weight, Marks marked) {
    for (std::size_t i = 0; i < weight.size(); ++i) field_.z_m[i] += weight[i] * relief.z_m[i];
    for (std::size_t i = 0; i < weight.size(); ++i)
      if (!(weight[i] > 0.5)) marked[i] = 0;
    return marked;
  }

  /// Numbers the features of the last layer in the map. `marked` has their numbers in the layer.
  void assign_instances(const Marks& marked) {
    map_.point_feature.resize(marked.size(), 0);
    const auto before = static_cast<std::uint32_t>(map_.feature_layer.size());
    map_.feature_layer.resize(before + std::ranges::max(marked), name_);
    for (std::size_t i = 0; i < marked.size(); ++i)
      if (marked[i] != 0) map_.point_feature[i] = before + marked[i];
  }

  Heightfield level() const {
    Heightfield zero = field_;
    std::ranges::fill(zero.z_m, 0.0);
    return zero;
  }

  /// Changes material and class, unless they are empty, at the points i for which here(i) is true.
  template <class Here>
  void paint(const std::string& material, const std::string& class_name, Here here) {
    constexpr std::uint16_t unknown = 65535;
    std::vector<std::uint16_t> becomes(map_.kinds.size(), unknown);  // new kind of each kind
    for (std::size_t i = 0; i < map_.point_kind.size(); ++i) {
      if (!here(i)) continue;
      std::uint16_t& kind = becomes[map_.point_kind[i]];
      if (kind == unknown) {
        SeabedMap::Kind wanted = map_.kinds[map_.point_kind[i]];
        if (!material.empty()) wanted.material = material;
        if (!class_name.empty()) wanted.class_name = class_name;
        kind = number_of(wanted);
      }
      map_.point_kind[i] = kind;
    }
  }
  std::uint16_t number_of(const SeabedMap::Kind& kind) {
    const auto found = std::ranges::find(map_.kinds, kind);
    const auto number = static_cast<std::uint16_t>(found - map_.kinds.begin());
    if (found == map_.kinds.end()) map_.kinds.push_back(kind);
    return number;
  }

  Heightfield& field_;
  const Heightfield base_;
  std::uint64_t seed_;
  RoughnessInWindows* roughness_;
  const WorkControl& control_;
  std::string name_;  // name of the layer that is laid at present
  SeabedMap map_;
  std::function<bool(std::size_t, const std::string&)> has_material_ =
      [this](std::size_t point, const std::string& material) {
        return map_.kinds[map_.point_kind[point]].material == material;
      };
};

}  // namespace

bool SeabedOptions::empty() const {
  bool all = patches.empty();
  for_each_relief_list(*this, [&](const auto& list) { all = all && list.empty(); });
  return all;
}

SeabedMap lay_seabed(Heightfield& field, const SeabedOptions& options, const std::string& material,
                     std::uint64_t seed, RoughnessInWindows* roughness,
                     const WorkControl& control) {
  if (options.empty()) return {{{material, "seabed"}}, {}};
  LayerStack layers(field, material, seed, roughness, control);
  layers.each(options.patches, "patches", Purpose::seabed_patch,
              [&](const auto&... given) { layers.lay_patch(given...); });
  for_each_relief_list(options, [&]<class Relief>(const std::vector<ReliefLayer<Relief>>& list) {
    const ReliefKind<Relief>& kind = kind_of(Relief{});
    layers.each(list, kind.list, kind.purpose,
                [&](const auto&... given) { layers.lay_relief(given...); });
  });
  return std::move(layers).map();
}

std::string nowhere_on_warning(const std::string& layer) {
  return fmt::format(
      "seafloor.{}: has no effect, because nothing of its area has the material that its key 'on' "
      "names when it is laid",
      layer);
}

std::vector<std::string> coarse_cell_warnings(const Heightfield& grid,
                                              const SeabedOptions& seabed) {
  const double cell_m = std::max(grid.cell_east_m, grid.cell_north_m);
  std::vector<std::string> warnings;
  for_each_relief_list(seabed, [&]<class Relief>(const std::vector<ReliefLayer<Relief>>& list) {
    const ReliefKind<Relief>& kind = kind_of(Relief{});
    for (std::size_t i = 0; kind.size_m && i < list.size(); ++i)
      if (const double size_m = list[i].relief.*kind.size_m; cell_m > 0.5 * size_m)
        warnings.push_back(fmt::format(
            "seafloor.{}.{}: cells of {} m hardly show its features of {} m; make the cells {} m or "
            "smaller",
            kind.list, i, cell_m, size_m, 0.25 * size_m));
  });
  return warnings;
}

}  // namespace ensonify::engine
