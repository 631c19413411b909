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
#include <ensonify/engine/units.h>
#include <ensonify/refine/mesh_reader.h>
#include <ensonify/refine/parallel_for.h>

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
                                             const ObjectOptions& table) {
  const refine::Bounds box = refine::bounds(mesh);
  const float extent = (box.highest - box.lowest).maxCoeff();  // in units of the mesh
  if (!(table.scale * extent > far_m)) return std::nullopt;
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
      table.mesh.path.filename().string(), table.scale * extent,
      table.scale * (std::nextafter(0.5f * extent, 1e30f) - 0.5f * extent), farthest,
      table.scale * (mesh.positions[farthest] - middle).norm());
}

/// A warning for an object that is wider than the bed.
std::optional<std::string> warning_of_size(const refine::TriangleMesh& mesh,
                                           const ObjectOptions& table, const BedGrid& bed) {
  const auto width_m = [](const refine::Bounds& box) {
    return double((box.highest - box.lowest).head<2>().maxCoeff());
  };
  const double own_m = table.scale * width_m(refine::bounds(mesh));
  const double bed_m = width_m(bed.bounds());
  if (!(own_m > bed_m)) return std::nullopt;
  return fmt::format(
      "{}: is {:.4g} m wide, and the seafloor {:.4g} m; is it in millimetres? Then set scale = 0.001",
      table.mesh.path.filename().string(), own_m, bed_m);
}

refine::RepairedMesh repaired(const refine::TriangleMesh& read, const ObjectOptions& table) {
  return refine::repair_file(read, table.weld_tolerance_m / table.scale, table.mesh.path);
}

/// The mesh of a table's file; with a length, scaled so that its longer side seen from above has
/// it.
refine::TriangleMesh read_fitted(const ObjectOptions& table, const MemoryPlan& plan) {
  refine::TriangleMesh mesh =
      read_mesh_to_repair(table.mesh.path, plan, "use a coarser mesh of the object");
  if (!table.size.length_m) return mesh;
  Eigen::AlignedBox2f box;
  for (const refine::Face& face : mesh.faces)
    for (const std::uint32_t vertex : face) box.extend(mesh.positions[vertex].head<2>().eval());
  const double longer = box.isEmpty() ? 0.0 : box.sizes().maxCoeff();
  if (!(longer > 0.0))
    throw refine::MeshError(fmt::format(
        "{}: has no length seen from above, so it cannot be scaled to length_m; give its scale",
        table.mesh.path.string()));
  for (Eigen::Vector3f& p : mesh.positions) p *= static_cast<float>(*table.size.length_m / longer);
  return mesh;
}

/// An object before it is set down.
struct Body {
  refine::TriangleMesh mesh;
  std::vector<ObjectPart> parts;
  std::vector<std::uint16_t> face_part;  // one per face
  double sunk_m = 0.0;                   // as ShapeBody's
};

/// What all tables need, and the faces of the objects so far.
class Placing {
 public:
  Placing(std::uint64_t its_seed, const BedGrid& its_bed, std::span<const Material> its_materials,
          const MemoryPlan& its_plan, const WorkControl& control)
      : seed(its_seed),
        bed(its_bed),
        materials(its_materials),
        plan(its_plan),
        threads(control.threads),
        stop_check_(control.stop_check) {}

  const std::uint64_t seed;
  const BedGrid& bed;
  const std::span<const Material> materials;
  const MemoryPlan& plan;
  const int threads;

  /// Call it before each object is set down. `faces`: of that object.
  void take(std::size_t faces, const std::string& what) {
    if (stop_check_) stop_check_();
    constexpr double faces_between = 1e5;  // of two looks at the memory in use, which take a while
    const auto more = static_cast<double>(faces);
    if (faces_ + more >= checked_ + faces_between) {
      require_object_fits(more, faces_, what, plan);
      checked_ = faces_ + more;
    }
    faces_ += more;
  }

 private:
  const std::function<void()>& stop_check_;
  double faces_ = 0.0, checked_ = 0.0;
};

/// Makes the bodies of one of the scene's [[objects]] tables.
class Source {
 public:
  Source(const ObjectOptions& options, std::size_t number, const Placing& placing)
      : options_(refined(options, placing.materials)), number_(number), seed_(placing.seed) {
    const std::string name = options.shape.empty() ? options.mesh.path.string() : options.shape;
    what_ = options.shape.empty() ? name : fmt::format("objects.{} ({})", number, name);
    if (!options_.path_file.path.empty()) options_.path = read_path(options_.path_file.path);
    if (options.shape.empty()) {
      const refine::TriangleMesh read = read_fitted(options, placing.plan);
      warning_ = warning_of_extent(read, options);
      if (!warning_) warning_ = warning_of_size(read, options, placing.bed);
      if (warning_) what_ = *warning_;
      refine::RepairedMesh sound = repaired(read, options);
      mesh_ = std::move(sound.mesh);
      report_ = sound.report;
    }
  }

  const ObjectOptions& options() const { return options_; }
  std::size_t number() const { return number_; }
  const std::string& what() const { return what_; }
  const std::optional<refine::RepairReport>& report() const { return report_; }
  const std::optional<std::string>& warning() const { return warning_; }
  bool is_line() const { return !options_.shape.empty() && shape_named(options_.shape).along_path; }

  /// Copy number `copy`; of a line, only its labels.
  Body body(std::size_t copy) const {
    Body body{.mesh = {}, .parts = parts_of(options_), .face_part = {}};
    if (options_.shape.empty()) {
      body.mesh = mesh_;
    } else if (!is_line()) {
      const RandomStream form =
          options_.shape_seed ? RandomStream(*options_.shape_seed, Purpose::object_shape, {0, copy})
                              : RandomStream(seed_, Purpose::object_shape, {number_, copy});
      try {
        const ShapeKind& kind = shape_named(options_.shape);
        ShapeBody made = make_body(kind, options_.size, form, options_.variant);
        body.mesh = std::move(made.mesh);
        const bool depth_given = options_.burial || options_.height_m;
        if (kind.several || !depth_given) body.sunk_m = made.sunk_m;
        // Part 0 is the object's own label, and those of the shape follow.
        for (const std::uint8_t part : made.face_part)
          body.face_part.push_back(static_cast<std::uint16_t>(part + 1));
      } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(fmt::format("{}: {}", what_, error.what()));
      }
    }
    const bool one_of_several = body.parts.size() > 1;
    body.face_part.resize(body.mesh.faces.size(), one_of_several ? 1 : 0);
    return body;
  }

 private:
  ObjectOptions options_;
  std::size_t number_;
  std::uint64_t seed_;
  std::string what_;
  refine::TriangleMesh mesh_;
  std::optional<refine::RepairReport> report_;
  std::optional<std::string> warning_;
};

/// Moves a body's middle to x = y = 0, and the bed as it is meant to z = 0.
void centre(Body& body) {
  const refine::Bounds box = refine::bounds(body.mesh);
  Eigen::Vector3f shift = 0.5f * (box.lowest + box.highest);
  shift.z() = box.lowest.z() + static_cast<float>(body.sunk_m);
  for (Eigen::Vector3f& p : body.mesh.positions) p -= shift;
}

/// Adds a member of an assembly to its base, which is centred.
void join(Body& base, Body member, const ObjectOptions& options) {
  centre(member);
  const Eigen::Matrix3d turn = options.scale * attitude(options, options.heading_rad);
  double lowest_m = std::numeric_limits<double>::infinity(), highest_m = -lowest_m;
  for (Eigen::Vector3f& p : member.mesh.positions) {
    p = (turn * p.cast<double>()).cast<float>();
    lowest_m = std::min(lowest_m, double(p.z()));
    highest_m = std::max(highest_m, double(p.z()));
  }
  const double sunk_m =
      options.burial.value_or(0.0) * (highest_m - lowest_m) + options.scale * member.sunk_m;
  const Eigen::Vector3f shift(
      static_cast<float>(options.east_m), static_cast<float>(options.north_m),
      static_cast<float>(options.height_m.value_or(0.0) - sunk_m - lowest_m));
  const auto vertices = static_cast<std::uint32_t>(base.mesh.positions.size());
  const auto parts = static_cast<std::uint16_t>(base.parts.size());
  for (const Eigen::Vector3f& p : member.mesh.positions)
    base.mesh.positions.emplace_back(p + shift);
  for (const refine::Face& face : member.mesh.faces)
    base.mesh.faces.push_back({face[0] + vertices, face[1] + vertices, face[2] + vertices});
  base.parts.insert(base.parts.end(), member.parts.begin(), member.parts.end());
  for (const std::uint16_t part : member.face_part)
    base.face_part.push_back(static_cast<std::uint16_t>(part + parts));
}

/// Leaves the first part, the object's own label, and those different ones that faces have.
void merge_parts(PlacedObjects::One& object) {
  std::vector<ObjectPart> parts{object.parts.front()};
  std::vector<std::optional<std::uint16_t>> numbers(object.parts.size());
  for (std::uint16_t& part : object.face_part) {
    if (!numbers[part]) {
      const auto found = std::ranges::find(parts, object.parts[part]);
      numbers[part] = static_cast<std::uint16_t>(found - parts.begin());
      if (found == parts.end()) parts.push_back(object.parts[part]);
    }
    part = *numbers[part];
  }
  object.parts = std::move(parts);
  if (object.parts.size() == 1) object.face_part.clear();
}

/// Makes the objects of one of the scene's [[objects]] tables, or of an assembly of several.
class Table {
 public:
  /// `members` are the numbers of the tables that belong to table `number`, which is one of them.
  Table(std::span<const ObjectOptions> tables, std::size_t number,
        std::span<const std::size_t> members, Placing& placing)
      : number_(number), seed_(placing.seed), bed_(placing.bed), placing_(placing) {
    for (const std::size_t member : members) {
      ObjectOptions options = tables[member];
      options.count = tables[number].count;  // an assembly's members are as many as its base
      sources_.emplace_back(options, member, placing);
    }
    options_ = base().options();
    what_ = base().what();
  }

  const std::vector<Source>& sources() const { return sources_; }

  PlacedObjects::One one(std::size_t number, Layout& layout) const {
    const Spot spot{options_.east_m, options_.north_m, options_.heading_rad, options_.scale};
    const Body body = body_of(number);
    placing_.take(body.mesh.faces.size(), what_);  // a line has few
    PlacedObjects::One placed =
        set_down_at(body, spot);  // first, since it refuses a line that is too long
    layout.take(discs(body.mesh, spot));
    return placed;
  }

  std::vector<PlacedObjects::One> many(Layout& layout) const {
    const PlacementArea area = area_of();
    const auto count = static_cast<std::size_t>(options_.count);
    const std::size_t at_once = 2 * static_cast<std::size_t>(placing_.threads);
    std::vector<PlacedObjects::One> all(count);
    std::vector<Body> bodies;
    std::vector<Spot> spots;
    for (std::size_t first = 0; first < count; first += at_once) {
      const std::size_t some = std::min(at_once, count - first);
      bodies.assign(some, {});
      spots.clear();
      refine::parallel_for(some, placing_.threads,
                           [&](std::size_t i, int) { bodies[i] = body_of(first + i); });
      // One after another, because each keeps its distance from those before it.
      for (std::size_t i = 0; i < some; ++i) {
        const std::optional<Spot> spot = find_room(bodies[i].mesh, first + i, area, layout);
        if (!spot)
          throw refine::MeshError(fmt::format(
              "{}: only {} of {} objects found room after {} tries each; use fewer or smaller "
              "objects, a smaller gap_m or margin_m, or a larger area over the seafloor",
              what_, first + i, options_.count, max_tries));
        placing_.take(bodies[i].mesh.faces.size(), what_);
        spots.push_back(*spot);
      }
      refine::parallel_for(some, placing_.threads, [&](std::size_t i, int) {
        all[first + i] = set_down_at(bodies[i], spots[i]);
      });
    }
    return all;
  }

 private:
  const Source& base() const { return sources_.front(); }
  bool is_line() const { return base().is_line(); }

  /// The base with the members of its assembly.
  Body body_of(std::size_t copy) const {
    Body body = base().body(copy);
    if (sources_.size() == 1) return body;
    centre(body);
    for (std::size_t i = 1; i < sources_.size(); ++i) {
      Body member = sources_[i].body(copy);
      // The whole object has the class of its base, unless its parts have their own classes.
      if (!options_.part_classes)
        for (ObjectPart& part : member.parts) part.class_name = options_.class_name;
      join(body, std::move(member), sources_[i].options());
    }
    body.sunk_m = std::max(0.0, -double(refine::bounds(body.mesh).lowest.z()));
    return body;
  }

  PlacedObjects::One set_down_at(const Body& body, const Spot& spot) const {
    SetDown placed = is_line() ? lay_down(options_, spot, bed_, what_)
                               : set_down(body.mesh, options_, spot, bed_, what_, body.sunk_m);
    const refine::Bounds box = refine::bounds(placed.mesh);
    const Vector3d low = box.lowest.cast<double>(), high = box.highest.cast<double>();
    PlacedObjects::One object{.mesh = std::move(placed.mesh),
                              .record = {.table = number_,
                                         .middle_m = 0.5 * (low + high),
                                         .size_m = high - low,
                                         .heading_rad = spot.heading_rad,
                                         .scale = spot.scale,
                                         .buried = placed.buried},
                              .parts = body.parts,
                              .face_part = body.face_part};
    merge_parts(object);
    return object;
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
    const double radius_m =
        0.5 * scale * line_diameter_m(shape_named(options_.shape), options_.size);
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

  std::vector<Source> sources_;  // the base first
  ObjectOptions options_;        // the base's
  std::size_t number_;
  std::uint64_t seed_;
  const BedGrid& bed_;
  Placing& placing_;
  std::string what_;
};

}  // namespace

refine::TriangleMesh mesh_of(const ObjectOptions& options, std::uint64_t seed,
                             std::span<const Material> materials, std::uint64_t number) {
  const ObjectOptions table = refined(options, materials);
  refine::TriangleMesh mesh;
  if (table.shape.empty())
    mesh = repaired(read_fitted(table, {}), table).mesh;
  else
    mesh =
        make_body(shape_named(table.shape), table.size,
                  table.shape_seed ? RandomStream(*table.shape_seed, Purpose::object_shape, {0, 0})
                                   : RandomStream(seed, Purpose::object_shape, {0, number}),
                  table.variant)
            .mesh;
  const refine::Bounds box = refine::bounds(mesh);
  const Eigen::Vector3f middle = 0.5f * (box.lowest + box.highest);
  for (Eigen::Vector3f& p : mesh.positions) p = static_cast<float>(table.scale) * (p - middle);
  mesh.world_origin = Vector3d::Zero();
  return mesh;
}

std::vector<ObjectPart> parts_of(const ObjectOptions& table) {
  std::vector<ObjectPart> parts{
      {table.class_name, table.material, table.shape.empty()}};  // a shape's outside is known
  if (table.shape.empty()) return parts;
  for (const ShapePart& part : shape_named(table.shape).parts)
    parts.push_back(
        {table.part_classes ? fmt::format("{}.{}", table.class_name, part.name) : table.class_name,
         part.material.empty() ? table.material : std::string(part.material), false});
  return parts;
}

std::vector<std::size_t> bases_of(std::span<const ObjectOptions> tables) {
  std::vector<std::size_t> bases(tables.size());
  for (std::size_t t = 0; t < tables.size(); ++t) {
    bases[t] = t;
    if (!tables[t].assembly.empty())
      bases[t] = static_cast<std::size_t>(
          std::ranges::find(tables, tables[t].assembly, &ObjectOptions::assembly) - tables.begin());
  }
  return bases;
}

std::size_t count_of(std::span<const ObjectOptions> tables) {
  const std::vector<std::size_t> bases = bases_of(tables);
  std::size_t sum = 0;
  for (std::size_t t = 0; t < tables.size(); ++t)
    if (bases[t] == t) sum += static_cast<std::size_t>(std::max(tables[t].count, 1));
  return sum;
}

namespace {

/// Collects bodies whose facets are too wide for their material's lobe; warns of the worst one.
class CoarseFacets {
 public:
  void look_at(const Source& source, const refine::TriangleMesh& mesh,
               std::span<const Material> materials) {
    const ObjectOptions& table = source.options();
    const std::optional<double> lobe_rad = lobe_width_rad(table.material, materials);
    if (!lobe_rad) return;
    const double facet_rad = facet_angle_rad(mesh);
    if (!(facet_rad > facet_over_lobe * *lobe_rad)) return;
    ++count_;
    if (facet_rad / *lobe_rad <= worst_) return;
    worst_ = facet_rad / *lobe_rad;
    const bool is_mesh = table.shape.empty();
    what_ = fmt::format(
        "objects.{} ({}): neighbouring facets differ by {:.2g} degrees, too much for the lobe of "
        "{}, {:.2g} degrees wide: it is bright from some sides and invisible from others; use {}a "
        "material with a lobe_width_deg of {:.2g} or more",
        source.number(), is_mesh ? table.mesh.path.filename().string() : table.shape,
        facet_rad / degree, table.material, *lobe_rad / degree,
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
                            const BedGrid& bed, std::span<const Material> materials,
                            const MemoryPlan& plan, const WorkControl& control) {
  PlacedObjects placed;
  Placing placing(seed, bed, materials, plan, control);
  CoarseFacets coarse;
  Layout layout;
  std::vector<std::vector<PlacedObjects::One>> of_table(tables.size());
  const std::vector<std::size_t> bases = bases_of(tables);
  std::vector<std::vector<std::size_t>> members(tables.size());
  for (std::size_t t = 0; t < tables.size(); ++t) members[bases[t]].push_back(t);
  for (const bool at_random : {false, true})
    for (std::size_t t = 0; t < tables.size(); ++t) {
      if (bases[t] != t || (tables[t].count > 0) != at_random) continue;
      const Table table(tables, t, members[t], placing);
      for (const Source& source : table.sources()) {
        if (source.report())
          placed.repairs.emplace_back(source.options().mesh.path, *source.report());
        if (source.warning()) placed.warnings.push_back(*source.warning());
      }
      if (at_random)
        of_table[t] = table.many(layout);
      else
        of_table[t].push_back(table.one(0, layout));
      if (of_table[t].empty()) continue;
      for (const Source& source : table.sources())
        coarse.look_at(source,
                       table.sources().size() == 1 ? of_table[t].front().mesh : source.body(0).mesh,
                       materials);
    }
  if (auto warning = coarse.warning()) placed.warnings.push_back(std::move(*warning));
  for (std::vector<PlacedObjects::One>& objects : of_table)
    std::ranges::move(objects, std::back_inserter(placed.objects));
  return placed;
}

}  // namespace ensonify::engine
