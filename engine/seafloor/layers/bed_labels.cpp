#include <ensonify/engine/seafloor/layers/bed_labels.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector3d;

/// The box around the points of one feature, and how many of the points have each kind.
struct Extent {
  Eigen::AlignedBox3d box;
  struct KindPoints {
    std::uint16_t kind;
    std::size_t points;
  };
  std::vector<KindPoints> kinds;

  void add(std::uint16_t kind) {
    const auto found = std::ranges::find(kinds, kind, &KindPoints::kind);
    if (found == kinds.end())
      kinds.push_back({kind, 1});
    else
      ++found->points;
  }
  /// The kind that most points have.
  std::uint16_t kind() const { return std::ranges::max(kinds, {}, &KindPoints::points).kind; }
};

std::vector<Extent> extents_of(const Heightfield& field, const SeabedMap& map) {
  std::vector<Extent> extents(map.feature_layer.size());
  // A face belongs to a feature if two of its points do: labels reach half a cell beyond a point.
  const Vector3d half_cell(0.5 * field.cell_east_m, 0.5 * field.cell_north_m, 0.0);
  for (int row = 0; row < field.rows; ++row)
    for (int column = 0; column < field.columns; ++column) {
      const std::size_t point = field.index(column, row);
      const std::uint32_t feature = map.point_feature[point];
      if (feature == 0 || std::isnan(field.z_m[point])) continue;
      Extent& extent = extents[feature - 1];
      extent.add(map.point_kind[point]);
      const Vector3d place(field.x_m(column), field.y_m(row), field.z_m[point]);
      extent.box.extend(place - half_cell);
      extent.box.extend(place + half_cell);
    }
  return extents;
}

/// The instance number of each feature of the map, 0 for features without a number. Adds the
/// records of the features to the seafloor.
std::vector<std::uint16_t> number_features(const Heightfield& field, const SeabedMap& map,
                                           std::size_t objects, Seafloor& seafloor) {
  std::vector<std::uint16_t> numbers(map.feature_layer.size(), 0);
  if (numbers.empty()) return numbers;
  const std::vector<Extent> extents = extents_of(field, map);
  for (std::size_t begin = 0, end = 0; begin < numbers.size(); begin = end) {
    const std::string& layer = map.feature_layer[begin];
    std::size_t there = 0;
    for (end = begin; end < numbers.size() && map.feature_layer[end] == layer; ++end)
      there += !extents[end].box.isEmpty();
    const std::size_t taken = seafloor.labels.size() + objects + seafloor.features.size();
    if (taken + there > max_labels) {
      seafloor.warnings.push_back(fmt::format(
          "seafloor.{}: its {} features are more than the {} instance numbers that are left; the "
          "truth has their class, but no instances of them",
          layer, there, max_labels - std::min(taken, max_labels)));
      continue;
    }
    for (std::size_t i = begin; i < end; ++i) {
      const Extent& extent = extents[i];
      if (extent.box.isEmpty()) continue;
      FeatureRecord& record = seafloor.features.emplace_back();
      numbers[i] = static_cast<std::uint16_t>(objects + seafloor.features.size());
      record = {layer, extent.box.center(), extent.box.sizes(), seafloor.labels[extent.kind()]};
      record.label.instance = numbers[i];
      record.label.feature = true;
    }
  }
  return numbers;
}

}  // namespace

std::uint16_t number_in(std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin() + 1, names.end(), name);
  const auto number = static_cast<std::uint16_t>(found - names.begin());
  if (found == names.end()) names.push_back(name);
  return number;
}

Label make_label(const std::string& material, const std::string& class_name, Seafloor& seafloor) {
  return {.sediment = number_in(seafloor.materials, material),
          .class_id = number_in(seafloor.classes, class_name)};
}

void label_bed(const Heightfield& field, const refine::HeightGrid& grid, const SeabedMap& map,
               std::size_t objects, Seafloor& seafloor) {
  const auto refuse_more = [&] {
    if (seafloor.labels.size() + objects > max_labels)
      throw std::invalid_argument(
          fmt::format("the seabed's map has more than {} labels (a material and a class, for each "
                      "feature) with {} objects; use fewer features, patches or objects",
                      max_labels, objects));
  };
  for (const SeabedMap::Kind& kind : map.kinds) {
    seafloor.labels.push_back(make_label(kind.material, kind.class_name, seafloor));
    refuse_more();
  }
  if (map.kinds.size() == 1 && map.feature_layer.empty()) return;

  const std::vector<std::uint16_t> instance = number_features(field, map, objects, seafloor);
  std::map<std::pair<std::uint16_t, std::uint16_t>, std::uint16_t> of_features;  // kind, instance
  const auto label_at = [&](std::size_t point) {
    const std::uint16_t kind = map.point_kind[point];
    const std::uint32_t feature = map.point_feature.empty() ? 0 : map.point_feature[point];
    const std::uint16_t number = feature == 0 ? std::uint16_t{0} : instance[feature - 1];
    if (number == 0) return kind;
    const auto next = static_cast<std::uint16_t>(seafloor.labels.size());
    const auto [found, is_new] = of_features.try_emplace({kind, number}, next);
    if (is_new) {
      Label label = seafloor.labels[kind];
      label.instance = number;
      label.feature = true;
      seafloor.labels.push_back(label);
      refuse_more();
    }
    return found->second;
  };
  seafloor.face_label.reserve(grid.faces());
  const auto points = static_cast<std::size_t>(field.columns);
  std::vector<std::uint16_t> south(points),
      north(points);  // labels of the points south and north of a row of cells
  std::vector<std::uint8_t> used;
  for (int row = 0; row < field.rows; ++row) {
    std::swap(south, north);
    grid.used_points(row, 0, field.columns - 1, 0, field.rows - 1, used);
    for (std::size_t i = 0; i < points; ++i)
      if (used[i] != 0) north[i] = label_at(field.index(0, row) + i);
    for (int column = 0; row > 0 && column + 1 < field.columns; ++column) {
      const refine::HeightGrid::Cell cell = grid.cell(column, row - 1);
      if (!cell.whole) continue;
      const auto i = static_cast<std::size_t>(column);
      const std::array corners{south[i], south[i + 1], north[i], north[i + 1]};
      for (const refine::Face& face : cell.faces) {
        const std::uint16_t a = corners[face[0]], b = corners[face[1]], c = corners[face[2]];
        seafloor.face_label.push_back(b == c ? b : a);
      }
    }
  }
}

}  // namespace ensonify::engine
