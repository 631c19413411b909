#include <ensonify/engine/scene/checks/check.h>

#include <algorithm>
#include <map>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/engine/scene/checks/require-inl.h>
#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/seafloor/base.h>
#include <ensonify/engine/seafloor/layers/area_files.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/refine/triangle_mesh.h>
#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/ground_texture.h>
#include <ensonify/scatter/sea_water.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector2d;

/// Calls f(layer, name of the layer) for each patch and each layer of relief.
template <class F>
void for_each_layer(const Scene& scene, F f) {
  for_each_list(scene, [&](const auto& section, const auto& list) {
    if constexpr (requires { list.front().area.on; })
      for (std::size_t i = 0; i < list.size(); ++i)
        f(list[i], fmt::format("{}.{}", section.name, i));
  });
}

class Check {
 public:
  Check(const Scene& scene, const Require& require) : bed_(scene.seafloor), require_(require) {}

  void area(const Area& area, const std::string& name) const {
    const std::string polygon = name + ".polygon_m";
    const std::size_t points = area.polygon_m.size();
    require_(points == 0 || (points >= 3 && points <= 1000), polygon,
             "'{}' has {} points, expected a polygon of three to 1000 points", polygon, points);
    if (const auto sides = crossing_sides(area.polygon_m))
      require_(false, polygon,
               "'{}' crosses itself: the sides from point {} and from point {} meet; expected "
               "points in their order around",
               polygon, sides->first + 1, sides->second + 1);
    if (!area.polygon_m.empty()) {
      Vector2d low = area.polygon_m[0], high = low;
      for (const Vector2d& p : area.polygon_m) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
      }
      on_the_seabed(low, high, polygon);
    }
    if (area.radius_m > 0.0) {
      const Vector2d middle(area.middle_east_m, area.middle_north_m);
      on_the_seabed(middle.array() - area.radius_m, middle.array() + area.radius_m,
                    name + ".radius_m");
    }
    ordered(area.shallowest_m, area.deepest_m, name + ".deepest_m", "shallowest_m");
    ordered(area.gentlest_rad, area.steepest_rad, name + ".steepest_deg", "gentlest_deg");
  }

  /// Requires that the box around an area overlaps the seabed. Only for a generated seabed, since
  /// the extent of a survey is not known yet.
  void on_the_seabed(const Vector2d& low, const Vector2d& high, const std::string& key) const {
    if (bed_.kind != SeafloorKind::fractal) return;
    const Vector2d half = 0.5 * Vector2d(bed_.extent_east_m, bed_.extent_north_m);
    require_((low.array() < half.array()).all() && (high.array() > -half.array()).all(), key,
             "'{}' lies outside the seabed: it reaches from {} to {} m east and from {} to {} "
             "m north, and the seabed {} m east and west and {} m north and south",
             key, low.x(), high.x(), low.y(), high.y(), half.x(), half.y());
  }

 private:
  void ordered(const std::optional<double>& least, const std::optional<double>& most,
               const std::string& key, std::string_view other) const {
    require_(!least || !most || *least < *most, key,
             "'{}' must be more than {}, or nothing is left between them", key, other);
  }

  const SeafloorOptions& bed_;
  const Require& require_;
};

/// The materials that the bed can have under a layer.
std::vector<std::string> materials_of(const SeafloorOptions& bed) {
  std::vector<std::string> names = {bed.material};
  for (const Patch& patch : bed.seabed.patches) names.push_back(patch.material);
  return names;
}

}  // namespace

void check_material(const Scene& scene, std::string_view material, const std::string& key,
                    const Require& require) {
  try {
    const Material its = material_named(material, scene.materials);
    for (const Sonar& sonar : scene.sonars)
      backscatter_of(its, sonar.frequency_hz, scatter::nominal_sound_speed_mps, 0.0);
    texture_of(its);
  } catch (const std::invalid_argument& error) {
    require(false, key, "'{}': {}", key, error.what());
  }
}

void check_seabed(const Scene& scene, const Require& require) {
  const SeafloorOptions& bed = scene.seafloor;
  const Check check(scene, require);
  require(bed.kind == SeafloorKind::survey || bed.detail.cell_m == 0.0, "seafloor.detail.cell_m",
          "'seafloor.detail.cell_m' needs seafloor.kind = \"survey\"");
  const std::vector<std::string> materials = materials_of(bed);
  for_each_layer(scene, [&](const auto& layer, const std::string& name) {
    require(bed.is_grid(), name,
            "'{}' needs a grid of heights: seafloor.kind = \"fractal\" or \"survey\"", name);
    check.area(layer.area, name);
    require(layer.area.on.empty() || std::ranges::count(materials, layer.area.on) > 0, name + ".on",
            "'{}.on' is \"{}\", but no part of the map has this material; expected one of {}", name,
            layer.area.on, fmt::format("{}", fmt::join(materials, ", ")));
    require(layer.class_name != name_of_number_0, name + ".class",
            "'{}.class' is \"{}\", which is the name of number 0: expected another name", name,
            name_of_number_0);
    if (layer.material.empty()) return;
    check_material(scene, layer.material, name + ".material", require);
  });
  for (std::size_t i = 0; i < bed.seabed.patches.size(); ++i)
    for (const auto& [text, name] : {std::pair(&bed.seabed.patches[i].material, "material"),
                                     std::pair(&bed.seabed.patches[i].class_name, "class")}) {
      const std::string key = fmt::format("seafloor.patches.{}.{}", i, name);
      require(!text->empty(), key, "'{}' is empty, expected a name", key);
    }
  for_each_list(scene, [&](const auto& section, const auto& list) {
    if constexpr (requires { list.front().area.on; }) {
      std::map<std::size_t, std::size_t> layer_of;  // index by number
      for (std::size_t i = 0; i < list.size(); ++i) {
        const Area& area = list[i].area;
        const std::size_t number = area.number_at(i);
        const std::size_t other = layer_of.emplace(number, i).first->second;
        const std::string key = fmt::format("{}.{}", section.name, i);
        require(
            other == i, area.number > 0 ? key + ".number" : key,
            "'{}' has the number {} as '{}.{}', and so would lie exactly on it; give each layer "
            "of the list a different number",
            key, number, section.name, other);
      }
    }
  });
  if (bed.kind == SeafloorKind::fractal)
    for (std::size_t i = 0; i < bed.seabed.bedforms.size(); ++i) {
      const double wavelength_m = bed.seabed.bedforms[i].relief.wavelength_m;
      const std::string key = fmt::format("seafloor.crests.{}.wavelength_m", i);
      require(bed.cell_m <= 0.25 * wavelength_m, key,
              "crests {} m apart need cells of {} m or less, and seafloor.cell_m is {}",
              wavelength_m, 0.25 * wavelength_m, bed.cell_m);
    }
}

void check_seabed_files(const Scene& scene,
                        const std::function<std::string(std::string_view key)>& place) {
  const SeafloorOptions& bed = scene.seafloor;
  // The extent of a survey is known only after reading it.
  if (bed.kind != SeafloorKind::fractal) return;
  const Heightfield grid = base_grid(bed);
  const Require require(place);
  const Check check(scene, require);
  for_each_layer(scene, [&](const auto& layer, const std::string& name) {
    const auto read = [&](const char* key, const InputFile& file, const auto& action) {
      if (file.path.empty()) return;
      const std::string whole = fmt::format("{}.{}", name, key);
      try {
        action(whole);
      } catch (const refine::MeshError& error) {
        require(false, whole, "'{}': {}", whole, error.what());
      }
    };
    read("image", layer.area.image, [&](const std::string&) {
      read_area_image(layer.area.image.path, grid, layer.area.image_value);
    });
    read("outline", layer.area.outline, [&](const std::string& key) {
      Eigen::Array2d low = Eigen::Array2d::Constant(1e300), high = -low;
      for (const PolygonWithHoles& outline : read_outlines(layer.area.outline.path, grid))
        for (const Vector2d& p : outline.border) {
          low = low.min(p.array());
          high = high.max(p.array());
        }
      check.on_the_seabed(low, high, key);
    });
  });
}

}  // namespace ensonify::engine
