#include <ensonify/engine/scene/checks/object_check.h>

#include <algorithm>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/seafloor/objects/objects.h>
#include <ensonify/engine/seafloor/objects/shapes.h>
#include <ensonify/engine/seafloor/seafloor.h>

namespace ensonify::engine {
namespace {

/// Finds the faults of one table. The first fault counts.
class Faults {
 public:
  Faults(const ObjectOptions& object, const std::string& name) : object_(object), name_(name) {}

  std::optional<ObjectFault> first() {
    what_it_is();
    if (!object_.shape.empty()) {
      form(shape_named(object_.shape));
      sizes(shape_named(object_.shape));
    }
    motion(!object_.shape.empty() && shape_named(object_.shape).along_path);
    path(!object_.shape.empty() && shape_named(object_.shape).along_path);
    many();
    if (object_.burial.value_or(0.0) != 0.0 && object_.height_m.value_or(0.0) != 0.0)
      add("burial", "'{0}.burial' and '{0}.height_m' are both given, expected one of them");
    return fault_;
  }

 private:
  template <class... More>
  void add(std::string_view key, fmt::format_string<const std::string&, const More&...> message,
           const More&... more) {
    if (!fault_)
      fault_ = {key.empty() ? name_ : fmt::format("{}.{}", name_, key),
                fmt::format(message, name_, more...)};
  }

  void what_it_is() {
    if (object_.mesh.empty() && object_.shape.empty())
      add("", "'{}' has no mesh: give its file as mesh = \"...\", or a shape = \"...\" by name");
    if (!object_.mesh.empty() && !object_.shape.empty())
      add("shape", "'{0}.shape' and '{0}.mesh' are both given, expected one of them");
    if (object_.class_name.empty()) add("class", "'{}.class' is empty, expected a name");
    if (object_.class_name == name_of_number_0)
      add("class", "'{}.class' is \"{}\", which is the name of number 0: expected another name",
          name_of_number_0);
    for (const Dimension& dimension : all_dimensions())
      if (object_.shape.empty() && dimension.size != &ShapeSize::length_m &&
          object_.size.*dimension.size)
        add(dimension.key,
            "'{}.{}' is a shape's size, and this is a mesh: change its length_m or scale instead",
            dimension.key);
    if (object_.shape.empty() && object_.size.facet_m)
      add("facet_m", "'{}.facet_m' is for shapes, and this is a mesh");
    if (!object_.shape.empty() && object_.weld_tolerance_m != 0.0)
      add("weld_m", "'{}.weld_m' is for meshes, and this is a shape");
    if (object_.shape.empty() && !object_.variant.empty())
      add("variant", "'{}.variant' is for shapes, and this is a mesh");
    if (object_.shape.empty() && object_.shape_seed)
      add("shape_seed", "'{}.shape_seed' is for shapes, and this is a mesh");
  }

  void form(const ShapeKind& kind) {
    if (!object_.variant.empty() && kind.variants.empty())
      add("variant", "'{}.variant' is given, but a {} has no variants", kind.name);
    if (!object_.variant.empty() && std::ranges::count(kind.variants, object_.variant) == 0)
      add("variant", "'{}.variant' is \"{}\", and a {} is one of: {}", object_.variant, kind.name,
          fmt::format("{}", fmt::join(kind.variants, ", ")));
    if (kind.family && object_.size.facet_m)
      add("facet_m", "'{}.facet_m' is not for a {}, whose facets follow from its material",
          kind.name);
  }

  void sizes(const ShapeKind& kind) {
    std::string has;
    for (const Dimension& own : kind.dimensions)
      has += fmt::format("{}{}", has.empty() ? "" : ", ", own.key);
    for (const Dimension& dimension : all_dimensions()) {
      bool own = false;
      for (const Dimension& d : kind.dimensions) own = own || d.size == dimension.size;
      if (object_.size.*dimension.size && !own)
        add(dimension.key, "'{}.{}' is not a size of a {}, which has {}", dimension.key, kind.name,
            has);
    }
    constexpr double largest_m = 1000.0;  // the largest value of the keys of sizes
    const Dimension& first = kind.dimensions.front();
    const double usual_m = std::max(first.usual_m, first.max_m);
    const double scaled_m =
        (object_.size.*first.size).value_or(usual_m) * object_.scale * object_.scale_max;
    if (scaled_m > largest_m)
      add("scale", "'{}.scale' makes a {} with a {} of {:.4g} m, expected at most {} m", kind.name,
          first.key, scaled_m, largest_m);
  }

  /// What an object that moves cannot be.
  void motion(bool along_path) {
    if (!object_.moves()) return;
    const std::string_view key = object_.speed_mps ? "speed_mps" : "poses";
    const auto refuse = [&](bool given, std::string_view why) {
      if (given) add(key, "'{0}.{1}' moves the object, but {2}", key, why);
    };
    refuse(along_path, "what lies along a path is at rest");
    refuse(object_.count > 0, "objects with a count are at rest: leave count out");
    refuse(!object_.assembly.empty(), "assemblies are at rest: leave assembly out");
    refuse(object_.part_classes, "part_classes is for objects at rest");
    refuse(object_.burial.value_or(0.0) != 0.0 || object_.height_m.value_or(0.0) < 0.0,
           "a part of it is in the bed: leave burial out, and give a height_m of 0 or more");
    refuse(object_.scour_ratio > 0.0 || object_.tail_ratio > 0.0,
           "scour_ratio and tail_ratio are for objects at rest");
    if (object_.speed_mps && !object_.poses.empty())
      add("poses", "'{0}.poses' and '{0}.speed_mps' are both given, expected one of them");
    if (object_.speed_mps && object_.path.empty() == object_.path_file.empty())
      add("speed_mps",
          "'{0}.speed_mps' needs a path: give either path = [[east, north], ...] or path_file = "
          "\"...\"");
  }

  void path(bool along_path) {
    const bool points = !object_.path.empty(), file = !object_.path_file.empty();
    if (!along_path) {
      if ((points || file) && !object_.speed_mps)
        add(points ? "path" : "path_file",
            "'{}' has a path, which is for a pipeline, cable, rope or chain, or with speed_mps for "
            "an object that moves");
      if (object_.sag_radius_m)
        add("sag_radius_m", "'{}.sag_radius_m' is for a pipeline, cable, rope or chain");
      if (object_.burial_spread > 0.0)
        add("burial_spread", "'{}.burial_spread' is for a pipeline, cable, rope or chain");
      return;
    }
    if (points == file)
      add(points ? "path_file" : "",
          "'{0}' lies along a path: give either path = [[east, north], ...] or path_file = "
          "\"...\"");
    double length_m = 0.0;
    for (std::size_t i = 0; i + 1 < object_.path.size(); ++i)
      length_m += (object_.path[i + 1] - object_.path[i]).norm();
    if (points && !(length_m > 0.0))
      add("path", "'{}.path' has no length, expected two different points or more");
    if (object_.pitch_rad != 0.0 || object_.roll_rad != 0.0 || object_.follow_slope)
      add("",
          "'{}' lies along a path as the bed does: leave pitch_deg, roll_deg and follow_slope out");
    if (object_.burial_spread > 0.0 && !object_.burial)
      add("burial_spread", "'{0}.burial_spread' changes the burial: give '{0}.burial'");
  }

  void many() {
    if (object_.count == 0) {
      const ObjectOptions usual;
      if (!object_.area.empty()) needs_count("area");
      if (object_.area_radius_m != 0.0) needs_count("area_radius_m");
      if (object_.margin_m != 0.0) needs_count("margin_m");
      if (object_.gap_m != 0.0) needs_count("gap_m");
      if (object_.heading_spread_rad != usual.heading_spread_rad) needs_count("heading_spread_deg");
      if (object_.scale_min != 1.0) needs_count("scale_min");
      if (object_.scale_max != 1.0) needs_count("scale_max");
    }
    if (object_.scale_min > object_.scale_max)
      add("scale_max", "'{0}.scale_max' is {1}, less than scale_min, which is {2}",
          object_.scale_max, object_.scale_min);
    if (!object_.area.empty() && object_.area.size() < 3)
      add("area", "'{}.area' has {} points, expected a polygon of three or more",
          object_.area.size());
    if (!object_.area.empty() && object_.area_radius_m > 0.0)
      add("area_radius_m",
          "'{0}.area' and '{0}.area_radius_m' are both given, expected one of them");
  }
  void needs_count(std::string_view key) {
    add(key, "'{}.{}' is for objects at random places: give their count too", key);
  }

  const ObjectOptions& object_;
  const std::string& name_;
  std::optional<ObjectFault> fault_;
};

}  // namespace

std::optional<ObjectFault> fault_of(const ObjectOptions& object, const std::string& name) {
  return Faults(object, name).first();
}

std::optional<ObjectFault> fault_of_assemblies(std::span<const ObjectOptions> objects) {
  const std::vector<std::size_t> bases = bases_of(objects);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const ObjectOptions& object = objects[i];
    const std::string name = fmt::format("objects.{}", i);
    if (!object.assembly.empty() && !object.shape.empty() && shape_named(object.shape).along_path)
      return ObjectFault{
          name + ".assembly",
          fmt::format("'{}' is laid along a path, and cannot be part of an assembly", name)};
    if (bases[i] == i) continue;
    const auto whole = [&](std::string_view key) {
      return ObjectFault{
          fmt::format("{}.{}", name, key),
          fmt::format("'{}.{}' is for a whole assembly: give it to its first object, "
                      "objects.{}",
                      name, key, bases[i])};
    };
    if (object.count != 0) return whole("count");
    if (object.follow_slope) return whole("follow_slope");
    if (object.part_classes) return whole("part_classes");
    if (object.scour_ratio != 0.0) return whole("scour_ratio");
    if (object.tail_ratio != 0.0) return whole("tail_ratio");
    if (object.current_rad != 0.0) return whole("current_deg");
  }
  return std::nullopt;
}

}  // namespace ensonify::engine
