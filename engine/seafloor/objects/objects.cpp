#include <ensonify/engine/seafloor/objects/objects.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <ensonify/engine/random.h>
#include <ensonify/engine/seafloor/objects/facets.h>
#include <ensonify/engine/seafloor/objects/path_reader.h>
#include <ensonify/engine/seafloor/objects/set_down.h>
#include <ensonify/engine/seafloor/objects/shapes.h>
#include <ensonify/engine/seafloor/objects/spacing.h>
#include <ensonify/refine/mesh_reader.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;

constexpr int max_tries = 1000;
constexpr double max_table_faces = 4e6;  // for the round bodies of a table, refined for its lobe
constexpr int max_round = 512;           // facets around a body

/// The table with facets of round shapes as small as its material's lobe needs, within the limits
/// above.
ObjectOptions refined(ObjectOptions table, std::span<const Material> materials) {
  const std::optional<double> lobe_rad = lobe_width_rad(table.material, materials);
  if (!lobe_rad) return table;
  constexpr double finer = 0.87;  // a margin, since facets differ in size
  // A ball with n facets around it has about n^2 / 1.5 faces, and up to four times that, since
  // edges are only halved.
  const double affordable = std::sqrt(0.375 * max_table_faces / std::max(table.count, 1));
  table.size.facet_rad = std::max(finer * facet_over_lobe * *lobe_rad,
                                  2.0 * std::numbers::pi / std::min<double>(affordable, max_round));
  return table;
}

constexpr double far_m = 1e5;  // size of an object up to which floats resolve a centimetre

/// A warning for an object so large that one of its vertices may be misplaced: names the farthest
/// vertex and the precision that is left.
std::optional<std::string> warning_of_extent(const refine::TriangleMesh& mesh,
                                             const std::filesystem::path& file) {
  const refine::Bounds box = refine::bounds(mesh);
  const float extent_m = (box.highest - box.lowest).maxCoeff();
  if (!(extent_m > far_m)) return std::nullopt;
  std::vector<std::uint32_t> used;
  for (const refine::Face& face : mesh.faces) used.insert(used.end(), face.begin(), face.end());
  Eigen::Vector3f middle;  // the median, which a few distant vertices do not move
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const auto half = used.begin() + std::ssize(used) / 2;
    std::ranges::nth_element(used, half, {},
                             [&](std::uint32_t vertex) { return mesh.positions[vertex][axis]; });
    middle[axis] = mesh.positions[*half][axis];
  }
  const std::uint32_t farthest = *std::ranges::max_element(
      used, {}, [&](std::uint32_t vertex) { return (mesh.positions[vertex] - middle).norm(); });
  return fmt::format(
      "{}: is {:.3g} m long, where positions have a precision of {:.2g} m; vertex {} (from 0) is "
      "the farthest, {:.3g} m from the middle: if it is misplaced, move or remove it",
      file.filename().string(), extent_m, std::nextafter(0.5f * extent_m, 1e30f) - 0.5f * extent_m,
      farthest, (mesh.positions[farthest] - middle).norm());
}

/// Makes the objects of one of the scene's [[objects]] tables.
class Table {
 public:
  Table(const ObjectOptions& options, std::size_t number, std::uint64_t seed, const BedGrid& bed,
        std::span<const Material> materials)
      : options_(refined(options, materials)), number_(number), seed_(seed), bed_(bed) {
    const std::string name = options.shape.empty() ? options.mesh.path.string() : options.shape;
    what_ = options.shape.empty() ? name : fmt::format("objects.{} ({})", number, name);
    if (!options_.path_file.path.empty()) options_.path = read_path(options_.path_file.path);
    if (options.shape.empty()) {
      const refine::TriangleMesh read = refine::read_mesh(options.mesh.path);
      warning_ = warning_of_extent(read, options.mesh.path);
      if (warning_) what_ = *warning_;
      refine::RepairedMesh repaired =
          refine::repair(read, options.weld_tolerance_m / options.scale);
      mesh_ = std::move(repaired.mesh);
      report_ = repaired.report;
    }
  }

  const std::optional<refine::RepairReport>& report() const { return report_; }
  const std::optional<std::string>& warning() const { return warning_; }

  PlacedObjects::One one(std::size_t number, Layout& layout) const {
    const Spot spot{options_.east_m, options_.north_m, options_.heading_rad, options_.scale};
    const refine::TriangleMesh mesh = mesh_of(number);
    PlacedObjects::One placed =
        set_down_at(mesh, spot);  // first, since it refuses a line that is too long
    layout.take(discs(mesh, spot));
    return placed;
  }

  std::vector<PlacedObjects::One> many(Layout& layout) const {
    const PlacementArea area = area_of();
    std::vector<PlacedObjects::One> all;
    for (std::size_t number = 0; number < static_cast<std::size_t>(options_.count); ++number) {
      const refine::TriangleMesh mesh = mesh_of(number);
      const std::optional<Spot> spot = find_room(mesh, number, area, layout);
      if (!spot)
        throw refine::MeshError(fmt::format(
            "{}: only {} of {} objects found room after {} tries each; use fewer or smaller "
            "objects, a smaller gap_m or margin_m, or a larger area over the seafloor",
            what_, number, options_.count, max_tries));
      all.push_back(set_down_at(mesh, *spot));
    }
    return all;
  }

 private:
  bool is_line() const { return !options_.shape.empty() && shape_named(options_.shape).along_path; }

  refine::TriangleMesh mesh_of(std::size_t number) const {
    if (options_.shape.empty() || is_line()) return mesh_;
    try {
      return make_body(shape_named(options_.shape), options_.size,
                       RandomStream(seed_, Purpose::object_shape, {number_, number}));
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(fmt::format("{}: {}", what_, error.what()));
    }
  }

  PlacedObjects::One set_down_at(const refine::TriangleMesh& mesh, const Spot& spot) const {
    SetDown placed = is_line() ? lay_down(options_, spot, bed_, what_)
                               : set_down(mesh, options_, spot, bed_, what_);
    const refine::Bounds box = refine::bounds(placed.mesh);
    const Vector3d low = box.lowest.cast<double>(), high = box.highest.cast<double>();
    return {std::move(placed.mesh),
            {.table = number_,
             .middle_m = 0.5 * (low + high),
             .size_m = high - low,
             .heading_rad = spot.heading_rad,
             .scale = spot.scale,
             .buried = placed.buried}};
  }

  /// The part of the bed that an object covers: discs along the longer side of its bounding
  /// rectangle.
  std::vector<Disc> discs(const refine::TriangleMesh& mesh, const Spot& spot) const {
    const Eigen::Rotation2Dd turn(-spot.heading_rad);
    const Vector2d place(spot.east_m, spot.north_m);
    if (is_line()) return discs_of_path(turn, place, spot.scale);
    const refine::Bounds own = refine::bounds(mesh);
    const Vector3d middle = 0.5 * (own.lowest.cast<double>() + own.highest.cast<double>());
    const Eigen::Matrix3d tilt = (Eigen::AngleAxisd(options_.pitch_rad, Vector3d::UnitX()) *
                                  Eigen::AngleAxisd(options_.roll_rad, Vector3d::UnitY()))
                                     .toRotationMatrix();
    Eigen::AlignedBox2d box;
    for (const Eigen::Vector3f& p : mesh.positions)
      box.extend((tilt * (p.cast<double>() - middle)).head<2>().eval());
    const int longer = box.sizes().y() >= box.sizes().x() ? 1 : 0;
    const double length_m = box.sizes()[longer], width_m = box.sizes()[1 - longer];
    const int pieces =
        static_cast<int>(std::clamp(std::ceil(length_m / std::max(width_m, 1e-9)), 1.0, 64.0));
    std::vector<Disc> all;
    for (int k = 0; k < pieces; ++k) {
      Vector2d at = box.center();
      at[longer] = box.min()[longer] + (k + 0.5) * length_m / pieces;
      all.push_back({place + spot.scale * (turn * at),
                     0.5 * spot.scale * std::hypot(width_m, length_m / pieces)});
    }
    return all;
  }

  std::vector<Disc> discs_of_path(const Eigen::Rotation2Dd& turn, const Vector2d& place,
                                  double scale) const {
    const double radius_m = line_diameter_m(shape_named(options_.shape), options_.size);
    std::vector<Disc> all;
    for (std::size_t i = 0; i + 1 < options_.path.size(); ++i) {
      const Vector2d a = place + scale * (turn * options_.path[i]);
      const Vector2d b = place + scale * (turn * options_.path[i + 1]);
      const double steps = std::max(1.0, std::ceil((b - a).norm() / radius_m));
      for (double k = 0.0; k <= steps; ++k) all.push_back({a + k / steps * (b - a), radius_m});
    }
    return all;
  }

  PlacementArea area_of() const {
    if (!options_.area.empty()) return PlacementArea(options_.area);
    if (options_.area_radius_m > 0.0)
      return PlacementArea(Disc{{options_.east_m, options_.north_m}, options_.area_radius_m});
    const refine::Bounds box = bed_.bounds();
    const Vector2d low = box.lowest.head<2>().cast<double>(),
                   high = box.highest.head<2>().cast<double>();
    return PlacementArea({low, {high.x(), low.y()}, high, {low.x(), high.y()}});
  }

  std::optional<Spot> find_room(const refine::TriangleMesh& mesh, std::size_t number,
                                const PlacementArea& area, Layout& layout) const {
    std::array<double, 2> drawn{};
    RandomStream(seed_, Purpose::object_place, {number_, number, 1}).uniform(drawn);
    Spot spot;
    spot.heading_rad = options_.heading_rad + (2.0 * drawn[0] - 1.0) * options_.heading_spread_rad;
    spot.scale = options_.scale *
                 (options_.scale_min + drawn[1] * (options_.scale_max - options_.scale_min));
    const std::vector<Disc> own = discs(mesh, spot);  // about the origin
    std::vector<Disc> moved = own;
    const RandomStream places(seed_, Purpose::object_place, {number_, number, 0});
    for (std::uint64_t k = 0; k < max_tries; ++k) {
      places.uniform(drawn, 2 * k);
      const Vector2d place = area.at(drawn[0], drawn[1]);
      for (std::size_t i = 0; i < own.size(); ++i) moved[i].middle = own[i].middle + place;
      const bool fits = std::ranges::all_of(moved, [&](const Disc& disc) {
        return area.holds(disc, options_.margin_m) && is_over_bed(disc);
      });
      if (!fits || !layout.is_free(moved, options_.gap_m)) continue;
      layout.take(moved);
      spot.east_m = place.x();
      spot.north_m = place.y();
      return spot;
    }
    return std::nullopt;
  }

  bool is_over_bed(const Disc& disc) const {
    constexpr int rim_points = 8;
    const auto finite = [&](const Vector2d& p) {
      return std::isfinite(bed_.height_m(p.x(), p.y()));
    };
    if (!finite(disc.middle)) return false;
    for (int k = 0; k < rim_points; ++k)
      if (!finite(disc.middle + Eigen::Rotation2Dd(2.0 * std::numbers::pi * k / rim_points) *
                                    Vector2d(disc.radius_m, 0.0)))
        return false;
    return true;
  }

  ObjectOptions options_;
  std::size_t number_;
  std::uint64_t seed_;
  const BedGrid& bed_;
  std::string what_;
  refine::TriangleMesh mesh_;
  std::optional<refine::RepairReport> report_;
  std::optional<std::string> warning_;
};

}  // namespace

refine::TriangleMesh mesh_of(const ObjectOptions& options, std::uint64_t seed,
                             std::span<const Material> materials) {
  const ObjectOptions table = refined(options, materials);
  refine::TriangleMesh mesh;
  if (table.shape.empty())
    mesh = refine::repair(refine::read_mesh(table.mesh.path), table.weld_tolerance_m / table.scale)
               .mesh;
  else
    mesh = make_body(shape_named(table.shape), table.size,
                     RandomStream(seed, Purpose::object_shape, {0, 0}));
  const refine::Bounds box = refine::bounds(mesh);
  const Eigen::Vector3f middle = 0.5f * (box.lowest + box.highest);
  for (Eigen::Vector3f& p : mesh.positions) p = static_cast<float>(table.scale) * (p - middle);
  mesh.world_origin = Vector3d::Zero();
  return mesh;
}

std::size_t count_of(std::span<const ObjectOptions> tables) {
  std::size_t sum = 0;
  for (const ObjectOptions& table : tables)
    sum += static_cast<std::size_t>(std::max(table.count, 1));
  return sum;
}

namespace {

/// Collects bodies whose facets are too wide for their material's lobe; warns of the worst one.
class CoarseFacets {
 public:
  void look_at(const ObjectOptions& table, std::size_t number, const refine::TriangleMesh& mesh,
               std::span<const Material> materials) {
    const std::optional<double> lobe_rad = lobe_width_rad(table.material, materials);
    if (!lobe_rad) return;
    const double facet_rad = facet_angle_rad(mesh);
    if (!(facet_rad > facet_over_lobe * *lobe_rad)) return;
    ++count_;
    if (facet_rad / *lobe_rad <= worst_) return;
    worst_ = facet_rad / *lobe_rad;
    constexpr double degree = std::numbers::pi / 180.0;
    const bool is_mesh = table.shape.empty();
    what_ = fmt::format(
        "objects.{} ({}): neighbouring facets differ by {:.2g} degrees, too much for the lobe of "
        "{}, {:.2g} degrees wide: it is bright from some sides and invisible from others; use {}a "
        "material with a lobe_width_deg of {:.2g} or more",
        number, is_mesh ? table.mesh.path.filename().string() : table.shape, facet_rad / degree,
        table.material, *lobe_rad / degree,
        is_mesh              ? fmt::format("a mesh with facets of {:.2g} degrees or less, or ",
                                           facet_over_lobe * *lobe_rad / degree)
        : table.size.facet_m ? "a smaller facet_m, or "
        : table.count > 0    ? "fewer objects, or "
                             : "",
        1.1 * facet_rad / facet_over_lobe / degree);
  }
  std::optional<std::string> warning() const {
    if (count_ == 0) return std::nullopt;
    const std::string others =
        count_ > 1 ? fmt::format(" (the same holds for {} more tables of objects)", count_ - 1)
                   : "";
    return what_ + others;
  }

 private:
  int count_ = 0;
  double worst_ = 0.0;
  std::string what_;
};

}  // namespace

PlacedObjects place_objects(std::span<const ObjectOptions> tables, std::uint64_t seed,
                            const BedGrid& bed, std::span<const Material> materials) {
  PlacedObjects placed;
  CoarseFacets coarse;
  Layout layout;
  std::vector<std::vector<PlacedObjects::One>> of_table(tables.size());
  for (const bool at_random : {false, true})
    for (std::size_t t = 0; t < tables.size(); ++t) {
      if ((tables[t].count > 0) != at_random) continue;
      const Table table(tables[t], t, seed, bed, materials);
      if (table.report()) placed.repairs.emplace_back(tables[t].mesh.path, *table.report());
      if (table.warning()) placed.warnings.push_back(*table.warning());
      if (at_random)
        of_table[t] = table.many(layout);
      else
        of_table[t].push_back(table.one(0, layout));
      if (!of_table[t].empty()) coarse.look_at(tables[t], t, of_table[t].front().mesh, materials);
    }
  if (auto warning = coarse.warning()) placed.warnings.push_back(std::move(*warning));
  for (std::vector<PlacedObjects::One>& objects : of_table)
    std::ranges::move(objects, std::back_inserter(placed.objects));
  return placed;
}

}  // namespace ensonify::engine
