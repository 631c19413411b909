#include <ensonify/engine/seafloor/objects/objects.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <stdexcept>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/base/scene_error.h>
#include <ensonify/engine/base/units.h>
#include <ensonify/engine/seafloor/objects/facets.h>
#include <ensonify/engine/seafloor/objects/set_down.h>
#include <ensonify/engine/seafloor/objects/shapes.h>
#include <ensonify/engine/seafloor/objects/spacing.h>
#include <ensonify/refine/parallel_for.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;

constexpr int max_tries = 1000;

/// What all tables need to place their objects, and the number of faces of the objects so far.
struct Placing {
  const std::uint64_t seed;
  const BedGrid& bed;
  const std::span<const Material> materials;
  const MemoryPlan& plan;
  const WorkControl& control;
  double faces_so_far = 0.0, checked_faces = 0.0;

  /// Counts the faces of an object before it is set down. Throws MemoryError if they do not fit.
  void take(std::size_t faces, const std::string& what) {
    control.check_stop();
    constexpr double faces_between = 1e5;  // between two checks of the memory, which are slow
    const auto more = static_cast<double>(faces);
    if (faces_so_far + more >= checked_faces + faces_between) {
      require_object_fits(more, faces_so_far, what, plan);
      checked_faces = faces_so_far + more;
    }
    faces_so_far += more;
  }
};

/// Removes the parts that no face has and parts that are equal. The first part stays.
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
  /// `members` are the numbers of the tables of the assembly, with the base `number` first.
  Table(std::span<const ObjectOptions> tables, std::size_t number,
        std::span<const std::size_t> members, Placing& placing)
      : number_(number), placing_(placing) {
    for (const std::size_t member : members) {
      ObjectOptions options = tables[member];
      options.count = tables[number].count;  // the base has the count of the whole assembly
      sources_.emplace_back(options, member, placing.seed, placing.bed, placing.materials,
                            placing.plan);
    }
    options_ = base().options;
  }

  const std::vector<BodySource>& sources() const { return sources_; }

  PlacedObjects::One one(Layout& layout) const {
    const Spot spot{options_.east_m, options_.north_m, options_.heading_rad, options_.scale};
    const ObjectBody body = body_of(0);
    placing_.take(body.mesh.faces.size(), base().what);  // 0 for a line, which has few
    PlacedObjects::One placed =
        set_down_at(body, spot, 0);  // before discs(), because it refuses too long lines
    layout.take(discs(body.mesh, spot));
    return placed;
  }

  std::vector<PlacedObjects::One> many(Layout& layout) const {
    const PlacementArea area = area_of();
    const auto count = static_cast<std::size_t>(options_.count);
    const std::size_t at_once = 2 * static_cast<std::size_t>(placing_.control.threads);
    std::vector<PlacedObjects::One> all(count);
    std::vector<ObjectBody> bodies;
    std::vector<Spot> spots;
    for (std::size_t first = 0; first < count; first += at_once) {
      const std::size_t some = std::min(at_once, count - first);
      bodies.assign(some, {});
      spots.clear();
      refine::parallel_for(some, placing_.control.threads,
                           [&](std::size_t i, int) { bodies[i] = body_of(first + i); });
      // One after another, because each object keeps its distance from earlier objects.
      for (std::size_t i = 0; i < some; ++i) {
        const std::optional<Spot> spot = find_room(bodies[i].mesh, first + i, area, layout);
        if (!spot)
          throw refine::MeshError(fmt::format(
              "{}: only {} of {} objects found room after {} tries each; use fewer or smaller "
              "objects, a smaller gap_m or margin_m, or a larger area over the seafloor",
              base().what, first + i, options_.count, max_tries));
        placing_.take(bodies[i].mesh.faces.size(), base().what);
        spots.push_back(*spot);
      }
      refine::parallel_for(some, placing_.control.threads, [&](std::size_t i, int) {
        all[first + i] = set_down_at(bodies[i], spots[i], first + i);
      });
    }
    return all;
  }

 private:
  const BodySource& base() const { return sources_.front(); }
  bool is_line() const { return base().is_line(); }

  /// The base with the members of its assembly.
  ObjectBody body_of(std::size_t copy) const {
    ObjectBody body = base().body(copy);
    if (sources_.size() == 1) return body;
    centre(body);
    for (std::size_t i = 1; i < sources_.size(); ++i) {
      ObjectBody member = sources_[i].body(copy);
      // The whole object has the class of its base, unless its parts have separate classes.
      if (!options_.part_classes)
        for (ObjectPart& part : member.parts) part.class_name = options_.class_name;
      add_member(body, std::move(member), sources_[i].options);
    }
    body.sunk_m = std::max(0.0, -double(refine::bounds(body.mesh).lowest.z()));
    return body;
  }

  PlacedObjects::One set_down_at(const ObjectBody& body, const Spot& spot, std::size_t copy) const {
    const BedGrid& bed = placing_.bed;
    const RandomStream burial(placing_.seed, Purpose::object_burial, {number_, copy});
    SetDown placed = is_line() ? lay_down(options_, spot, bed, base().what, burial)
                               : set_down(body.mesh, options_, spot, bed, base().what, body.sunk_m);
    const Eigen::AlignedBox3d box = placed.mesh.box();
    const Vector3d middle_m = placed.mesh.place + box.center();
    PlacedObjects::One object{.mesh = placed.mesh.in_floats(),
                              .own = std::move(placed.mesh),
                              .record = {.table = number_,
                                         .middle_m = middle_m,
                                         .size_m = box.sizes(),
                                         .heading_rad = spot.heading_rad,
                                         .scale = spot.scale,
                                         .buried = placed.buried},
                              .parts = body.parts,
                              .face_part = body.face_part};
    merge_parts(object);
    return object;
  }

  /// What an object covers of the bed: discs along the longer side of its bounding rectangle.
  std::vector<Disc> discs(const refine::TriangleMesh& mesh, const Spot& spot) const {
    const Eigen::Rotation2Dd turn(-spot.heading_rad);
    const Vector2d place(spot.east_m, spot.north_m);
    if (is_line()) return discs_of_path(turn, place, spot.scale);
    const Vector3d middle = refine::bounds(mesh).middle();
    const Eigen::Matrix3d tilt = attitude(options_, 0.0);
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
    const refine::Bounds box = placing_.bed.bounds();
    const Vector2d low = box.lowest.head<2>().cast<double>(),
                   high = box.highest.head<2>().cast<double>();
    return PlacementArea({low, {high.x(), low.y()}, high, {low.x(), high.y()}});
  }

  std::optional<Spot> find_room(const refine::TriangleMesh& mesh, std::size_t number,
                                const PlacementArea& area, Layout& layout) const {
    std::array<double, 2> drawn{};
    RandomStream(placing_.seed, Purpose::object_place, {number_, number, 1}).uniform(drawn);
    Spot spot;
    spot.heading_rad = options_.heading_rad + (2.0 * drawn[0] - 1.0) * options_.heading_spread_rad;
    spot.scale = options_.scale *
                 (options_.scale_min + drawn[1] * (options_.scale_max - options_.scale_min));
    const std::vector<Disc> own = discs(mesh, spot);  // about the origin
    std::vector<Disc> moved = own;
    const RandomStream places(placing_.seed, Purpose::object_place, {number_, number, 0});
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
      return std::isfinite(placing_.bed.height_m(p.x(), p.y()));
    };
    if (!finite(disc.middle)) return false;
    for (int k = 0; k < rim_points; ++k)
      if (!finite(disc.middle + Eigen::Rotation2Dd(2.0 * std::numbers::pi * k / rim_points) *
                                    Vector2d(disc.radius_m, 0.0)))
        return false;
    return true;
  }

  std::vector<BodySource> sources_;  // the base first
  ObjectOptions options_;            // options of the base
  std::size_t number_;
  Placing& placing_;
};

/// Counts bodies whose facets are too wide for their material's lobe, and warns of the worst one.
class CoarseFacets {
 public:
  void look_at(const BodySource& source, const ObjectMesh& mesh,
               std::span<const Material> materials) {
    const ObjectOptions& table = source.options;
    const std::optional<double> lobe_rad = lobe_width_rad(table.material, materials);
    if (!lobe_rad) return;
    const double facet_rad = facet_angle_rad(mesh);
    if (!(facet_rad > facet_over_lobe * *lobe_rad)) return;
    ++count_;
    if (facet_rad / *lobe_rad <= worst_) return;
    worst_ = facet_rad / *lobe_rad;
    what_ = fmt::format(
        "objects.{} ({}): neighbouring facets differ by {:.2g} degrees, too much for the lobe of "
        "{}, {:.2g} degrees wide: it is bright from some sides and invisible from others; use {}a "
        "material with a lobe_width_deg of {:.2g} or more",
        source.number, source.name(), facet_rad / degree, table.material, *lobe_rad / degree,
        table.shape.empty()  ? fmt::format("a mesh with facets of {:.2g} degrees or less, or ",
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

/// The mean length of the edges of a mesh's faces.
double mean_edge_m(const ObjectMesh& mesh) {
  double sum_m = 0.0;
  for (std::uint32_t face = 0; face < mesh.faces.size(); ++face)
    for (int k = 0; k < 3; ++k)
      sum_m += (mesh.corner(face, (k + 1) % 3) - mesh.corner(face, k)).norm();
  return sum_m / (3.0 * static_cast<double>(mesh.faces.size()));
}

/// A warning of objects so far from the seabed's middle that the rounding of floats turns their
/// facets. The warning names the farthest object.
std::optional<std::string> warning_of_distance(const BodySource& source,
                                               std::span<const PlacedObjects::One> objects) {
  constexpr double most_turned = 0.1;  // rad, about 6 degrees
  const auto off_m = [](const PlacedObjects::One& object) {
    return object.record.middle_m.head<2>().cwiseAbs().maxCoeff();
  };
  const PlacedObjects::One& farthest = *std::ranges::max_element(objects, {}, off_m);
  const auto off = static_cast<float>(off_m(farthest));
  const double step_m = std::nextafter(off, std::numeric_limits<float>::infinity()) - off;
  const double edge_m = mean_edge_m(farthest.own);
  if (!(step_m > most_turned * edge_m)) return std::nullopt;
  return fmt::format(
      "objects.{} ({}): lies {:.3g} km from the middle of the seabed, where vertices are {:.2g} m "
      "apart, and the edges of its facets are {:.2g} m long: rays meet a rougher shape there, "
      "although its glints stay right; use larger facets, or a seabed whose middle is nearer",
      source.number, source.name(), 1e-3 * double(off), step_m, edge_m);
}

}  // namespace

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
    if (bases[t] == t && !tables[t].moves())
      sum += static_cast<std::size_t>(std::max(tables[t].count, 1));
  return sum;
}

PlacedObjects place_objects(std::span<const ObjectOptions> tables, std::uint64_t seed,
                            const BedGrid& bed, std::span<const Material> materials,
                            const MemoryPlan& plan, const WorkControl& control, bool moving) {
  PlacedObjects placed;
  Placing placing{seed, bed, materials, plan, control};
  CoarseFacets coarse;
  Layout layout;
  std::vector<std::vector<PlacedObjects::One>> of_table(tables.size());
  const std::vector<std::size_t> bases = bases_of(tables);
  std::vector<std::vector<std::size_t>> members(tables.size());
  for (std::size_t t = 0; t < tables.size(); ++t) members[bases[t]].push_back(t);
  const auto place_table = [&](std::size_t t) {
    const Table table(tables, t, members[t], placing);
    for (const BodySource& source : table.sources()) {
      if (source.report) placed.repairs.emplace_back(source.options.mesh.path, *source.report);
      if (source.warning) placed.warnings.push_back(*source.warning);
    }
    if (tables[t].count > 0)
      of_table[t] = table.many(layout);
    else
      of_table[t].push_back(table.one(layout));
    if (of_table[t].empty()) return;
    if (auto warning = warning_of_distance(table.sources().front(), of_table[t]))
      placed.warnings.push_back(std::move(*warning));
    for (const BodySource& source : table.sources())
      if (table.sources().size() == 1)
        coarse.look_at(source, of_table[t].front().own, materials);
      else
        coarse.look_at(source, source.body(0).mesh, materials);
  };
  for (const bool at_random : {false, true})
    for (std::size_t t = 0; t < tables.size(); ++t) {
      if (bases[t] != t || tables[t].moves() != moving || (tables[t].count > 0) != at_random)
        continue;
      try {
        place_table(t);
      } catch (const std::invalid_argument& error) {
        throw SceneError(fmt::format("objects.{}", t), error.what());
      } catch (const refine::MeshError& error) {
        throw SceneError(fmt::format("objects.{}", t), error.what());
      }
    }
  if (auto warning = coarse.warning()) placed.warnings.push_back(std::move(*warning));
  for (std::vector<PlacedObjects::One>& objects : of_table)
    std::ranges::move(objects, std::back_inserter(placed.objects));
  return placed;
}

}  // namespace ensonify::engine
