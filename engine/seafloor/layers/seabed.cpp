#include <ensonify/engine/seafloor/layers/seabed.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {
namespace {

using Marks = std::vector<std::uint32_t>;

class LayerStack {
 public:
  LayerStack(Heightfield& field, const std::string& material, std::uint64_t seed)
      : field_(field), base_(field), seed_(seed) {
    map_.kinds = {{material, "seabed"}};
    map_.point_kind.assign(field.z_m.size(), 0);
  }
  SeabedMap map() && { return std::move(map_); }

  /// Calls lay(layer, mask, draws) for each layer of a list, and says whose fault an exception is.
  template <class ReliefLayer, class Lay>
  void each(const std::vector<ReliefLayer>& list, const char* name, Purpose purpose, Lay lay) {
    for (std::size_t i = 0; i < list.size(); ++i) {
      name_ = fmt::format("{}.{}", name, i);
      const Area& area = list[i].area;
      const LayerDraws draws{seed_, purpose,
                             area.number > 0 ? static_cast<std::uint64_t>(area.number) : i + 1};
      const auto blamed = [&](const std::exception& error) {
        return fmt::format("seafloor.{}: {}", name_, error.what());
      };
      try {
        lay(list[i], area_mask(area, {base_, has_material_}, draws), draws);
      } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(blamed(error));
      } catch (const refine::MeshError& error) {
        throw refine::MeshError(blamed(error));
      }
    }
  }

  void lay_patch(const Patch& patch, const std::vector<double>& mask) {
    if (patch.rise_m != 0.0) {
      const std::vector<double> weight = softened(mask, field_, patch.area.border_m);
      for (std::size_t i = 0; i < weight.size(); ++i) field_.z_m[i] += patch.rise_m * weight[i];
    }
    paint(patch.material, patch.class_name, [&](std::size_t i) { return mask[i] > 0.0; });
  }

  /// A layer that fades out at the area's border.
  template <class Relief, class Add>
  Marks lay(const ReliefLayer<Relief>& layer, const std::vector<double>& mask, Add add) {
    Heightfield relief = level();
    Marks marked(relief.z_m.size(), 0);
    add(relief, marked);
    const std::vector<double> weight = softened(mask, field_, layer.area.border_m);
    for (std::size_t i = 0; i < weight.size(); ++i) field_.z_m[i] += weight[i] * relief.z_m[i];
    for (std::size_t i = 0; i < weight.size(); ++i)
      if (!(weight[i] > 0.5)) marked[i] = 0;
    paint(layer, [&](std::size_t i) { return marked[i] != 0; });
    return marked;
  }

  /// A layer of things that stand whole where their middle is in the area.
  template <class Relief, class Add>
  Marks scatter(const ReliefLayer<Relief>& layer, const std::vector<double>& mask, Add add) {
    Heightfield relief = level();
    Marks marked(relief.z_m.size(), 0);
    const auto nearest = [](double place, double cell, int count) {
      return static_cast<int>(
          std::clamp(std::round(place / cell + 0.5 * (count - 1)), 0.0, count - 1.0));
    };
    add(relief, marked, [&](double x_m, double y_m) {
      return mask[field_.index(nearest(x_m, field_.cell_east_m, field_.columns),
                               nearest(y_m, field_.cell_north_m, field_.rows))] > 0.0;
    });
    for (std::size_t i = 0; i < relief.z_m.size(); ++i) field_.z_m[i] += relief.z_m[i];
    paint(layer, [&](std::size_t i) { return marked[i] != 0; });
    return marked;
  }

  void lay_outcrop(const ReliefLayer<OutcropRelief>& layer, const std::vector<double>& mask,
                   const LayerDraws& draws) {
    Heightfield rock = level();
    Marks marked(rock.z_m.size(), 0);
    add_outcrops(rock, layer.relief, draws, softened(mask, field_, layer.area.border_m), marked);
    for (std::size_t i = 0; i < marked.size(); ++i) {
      const double top_m = base_.z_m[i] + rock.z_m[i];
      marked[i] = marked[i] != 0 && top_m > field_.z_m[i];
      if (marked[i] != 0) field_.z_m[i] = top_m;
      if (marked[i] != 0 && !map_.point_feature.empty()) map_.point_feature[i] = 0;
    }
    paint(layer, [&](std::size_t i) { return marked[i] != 0; });
  }

  /// Tells the things of the layer apart that was laid last, each marked by its number.
  template <class Relief>
  void assign_instances(const ReliefLayer<Relief>& layer, const Marks& marked) {
    if (layer.class_name.empty()) return;
    map_.point_feature.resize(marked.size(), 0);
    const auto before = static_cast<std::uint32_t>(map_.feature_layer.size());
    map_.feature_layer.resize(before + std::ranges::max(marked), name_);
    for (std::size_t i = 0; i < marked.size(); ++i)
      if (marked[i] != 0) map_.point_feature[i] = before + marked[i];
  }

 private:
  Heightfield level() const {
    Heightfield zero = field_;
    std::ranges::fill(zero.z_m, 0.0);
    return zero;
  }

  template <class Relief, class Here>
  void paint(const ReliefLayer<Relief>& layer, Here here) {
    if (!layer.class_name.empty() || !layer.material.empty())
      paint(layer.material, layer.class_name, here);
  }
  template <class Here>
  void paint(const std::string& material, const std::string& class_name, Here here) {
    constexpr std::uint16_t unknown = 65535;
    std::vector<std::uint16_t> becomes(map_.kinds.size(), unknown);  // kinds as they were before
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
  std::string name_;  // of the layer that is being laid
  SeabedMap map_;
  std::function<bool(std::size_t, const std::string&)> has_material_ =
      [this](std::size_t point, const std::string& material) {
        return map_.kinds[map_.point_kind[point]].material == material;
      };
};

}  // namespace

SeabedMap lay_seabed(Heightfield& field, const SeabedOptions& options, const std::string& material,
                     std::uint64_t seed) {
  if (options.empty()) return {{{material, "seabed"}}, {}};
  LayerStack layers(field, material, seed);
  layers.each(options.patches, "patches", Purpose::seabed_patch,
              [&](const Patch& patch, const auto& mask, const LayerDraws&) {
                layers.lay_patch(patch, mask);
              });
  layers.each(options.roughness, "roughness", Purpose::roughness_layer,
              [&](const auto& layer, const auto& mask, const LayerDraws& draws) {
                layers.lay(layer, mask, [&](Heightfield& relief, Marks& marked) {
                  add_fractal(relief, layer.relief, draws.of(1));
                  std::ranges::fill(marked, 1u);
                });
              });
  layers.each(options.crests, "crests", Purpose::crest_layer,
              [&](const auto& layer, const auto& mask, const LayerDraws& draws) {
                layers.lay(layer, mask, [&](Heightfield& relief, Marks& marked) {
                  add_crests(relief, layer.relief, draws);
                  std::ranges::fill(marked, 1u);
                });
              });
  layers.each(options.trawl_marks, "trawl_marks", Purpose::furrow_layer,
              [&](const auto& layer, const auto& mask, const LayerDraws& draws) {
                layers.assign_instances(
                    layer, layers.lay(layer, mask, [&](Heightfield& relief, Marks& marked) {
                      add_trawl_marks(relief, layer.relief, draws, marked);
                    }));
              });
  layers.each(options.pits, "pits", Purpose::pit_layer,
              [&](const auto& layer, const auto& mask, const LayerDraws& draws) {
                layers.assign_instances(
                    layer,
                    layers.scatter(layer, mask, [&](auto& relief, auto& marked, auto allowed) {
                      add_pits(relief, layer.relief, draws, allowed, marked);
                    }));
              });
  layers.each(options.outcrops, "outcrops", Purpose::outcrop_layer,
              [&](const auto& layer, const auto& mask, const LayerDraws& draws) {
                layers.lay_outcrop(layer, mask, draws);
              });
  layers.each(options.boulders, "boulders", Purpose::boulder_layer,
              [&](const auto& layer, const auto& mask, const LayerDraws& draws) {
                layers.assign_instances(
                    layer,
                    layers.scatter(layer, mask, [&](auto& relief, auto& marked, auto allowed) {
                      add_boulders(relief, layer.relief, draws, allowed, marked);
                    }));
              });
  return std::move(layers).map();
}

}  // namespace ensonify::engine
