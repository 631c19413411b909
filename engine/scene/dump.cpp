#include <fmt/format.h>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/scene/keys/dataset_options.h>
#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/seafloor/objects/shapes.h>

namespace ensonify::engine {
namespace {

template <class Owner>
void dump(std::string& out, const Section<Owner>& section, std::string_view heading,
          const Owner& owner, bool with_comments) {
  if (with_comments && !heading.empty()) out += fmt::format("\n# {}\n", section.help);
  if (!heading.empty()) out += fmt::format("{}{}\n", with_comments ? "" : "\n", heading);
  for (const Key<Owner>& key : section.keys) {
    const std::optional<std::string> value = option_text(key, owner);
    if (with_comments) out += fmt::format("# {}\n", help_text(key));
    if (value)
      out += fmt::format("{} = {}\n", key.name, *value);
    else if (with_comments)
      out += fmt::format("# {} =\n", key.name);
  }
}

/// Dumps an optional table as an example that is commented out.
template <class Owner>
void dump_example(std::string& out, const Section<Owner>& section, std::string_view heading) {
  Owner example;
  std::string text;
  dump(text, section, heading, example, true);
  for (std::size_t begin = 0, end; begin < text.size(); begin = end + 1) {
    end = text.find('\n', begin);
    const std::string line = text.substr(begin, end - begin);
    out += fmt::format("{}{}\n", line.empty() || line.starts_with('#') ? "" : "# ", line);
  }
}

/// The default of a key as text for readers. Degrees have four digits, since the exact text of a
/// value in radians may have seventeen.
template <class Owner>
std::string default_text(const Key<Owner>& key, const Owner& owner) {
  const ConstOption option = key.option(owner);
  if (const auto* value = std::get_if<const double*>(&option); value && key.in_degrees())
    return fmt::format("{:.4g}", **value / degree);
  return option_text(key, owner).value_or("unset");
}

template <class Owner>
void describe(std::string& out, const Section<Owner>& section, std::string_view heading,
              const Owner& owner) {
  out += fmt::format("\n## {}\n", heading.empty() ? "The top of the file" : heading);
  out +=
      fmt::format("\n{}\n\n| key | is | expected | default |\n|---|---|---|---|\n", section.help);
  for (const Key<Owner>& key : section.keys)
    out += fmt::format("| `{}` | {} | {} | {} |\n", key.name, key.help, expectation(key),
                       default_text(key, owner));
}

void describe_shapes(std::string& out) {
  out +=
      "\nShapes; y is along the heading, z up. The default sizes are typical ones, those from a to "
      "b are drawn, the others follow from the form. A part with a named material has it instead "
      "of the object's.\n\n"
      "| shape | is | sizes, with defaults | variants | parts |\n|---|---|---|---|---|\n";
  for (const ShapeKind& kind : shape_kinds()) {
    std::string sizes;
    for (const Dimension& dimension : kind.dimensions) {
      sizes += fmt::format("{}`{}`", sizes.empty() ? "" : ", ", dimension.key);
      if (dimension.usual_m > 0.0) sizes += fmt::format(" {}", dimension.usual_m);
      if (dimension.max_m > 0.0) sizes += fmt::format(" to {}", dimension.max_m);
    }
    std::string parts;
    for (const ShapePart& part : kind.parts)
      parts += fmt::format("{}{}{}", parts.empty() ? "" : ", ", part.name,
                           part.material.empty() ? "" : fmt::format(" ({})", part.material));
    out += fmt::format("| `{}` | {} | {} | {} | {} |\n", kind.name, kind.help, sizes,
                       fmt::join(kind.variants, ", "), parts);
  }
}

}  // namespace

std::string dump_scene(const Scene& scene, bool with_comments) {
  std::string out;
  if (with_comments)
    out += "# A scene of ensonify with every key. Keys that are commented out are unset.\n\n";
  out += "version = 1\n";
  for (const auto& section : scene_sections()) {
    if (section.name == "track") {
      for_each_list(scene, [&](const auto& list_section, const auto& list) {
        const std::string heading = fmt::format("[[{}]]", list_section.name);
        for (const auto& item : list) dump(out, list_section, heading, item, with_comments);
        if (with_comments && list.empty()) dump_example(out, list_section, heading);
      });
      for (const Material& material : scene.materials)
        dump(out, material_section(), fmt::format("[material.{}]", material.name), material,
             with_comments);
      if (with_comments && scene.materials.empty())
        dump_example(out, material_section(), "[material.NAME]");
    }
    const std::string heading = section.name.empty() ? "" : fmt::format("[{}]", section.name);
    dump(out, section, heading, scene, with_comments);
    if (section.name == "track")
      for (const Sonar& sonar : scene.sonars)
        dump(out, sonar_section(), fmt::format("[sonar.{}]", sonar.name), sonar, with_comments);
  }
  return out;
}

std::string dump_recipe() {
  std::string out =
      R"(# A recipe of ensonify: a scene, [dataset], and distributions in place of values.
#
# Any key of a scene (`ensonify dump-default run` prints them all) can be drawn for each sample:
#
#   altitude_m = { uniform = [3, 12] }                   uniform between the two
#   altitude_m = { log_uniform = [3, 12] }               its logarithm is uniform
#   altitude_m = { normal = [7, 2], between = [3, 12] }  mean and deviation, cut off
#   legs = { int = [2, 5] }                              a whole number, ends included
#   material = { choice = ["steel", "wood"], weights = [3, 1] }
#   height_m = { unset = true }                          left out; useful in tables
#
# stratified = true   spreads the samples evenly over the range or the choices (not for normal)
# times = "KEY"       multiplies by another key's value, or by several: times = ["KEY", "KEY"]
# plus = "KEY"        then adds another key's value
# by = "KEY", table = { VALUE = ..., default = ... }   a value or a distribution for each value of
#                     another key; * in VALUE stands for anything but /
# mesh = "data:hulls/*.stl"   one of the files of the data folder that it matches
# present = ...       in a table of a list, such as [[objects]]: whether the table is there
#
# [draw] has keys that you define for others to refer to. All keys of [dataset] follow:

version = 1
seed = 1                 # of all draws; each sample's scene has its own

[draw]
side = { choice = [-1, 1] }

[[objects]]
shape = "cylinder"
east_m = {times = ["sonar.sidescan.range_m", "draw.side"], uniform = [0.3, 0.8], stratified = true}
heading_deg = { uniform = [0, 360], stratified = true }

[track]
altitude_m = { times = "sonar.sidescan.range_m", uniform = [0.08, 0.15] }

[sonar.sidescan]
range_m = { log_uniform = [30, 75] }
)";
  DatasetOptions options;
  for (const auto& section : dataset_sections())
    dump(out, section, fmt::format("[{}]", section.name), options, true);
  return out;
}

std::string schema_text() {
  std::string out =
      "# Scene files\n\n"
      "A scene is a TOML file that begins with `version = 1`. A key's unit is in its name. Every "
      "other key may be left out. `ensonify dump-default run` prints them all; `-D key=value` changes one "
      "by its whole name with dots, as in `-D sea.temperature_c=12`, `-D "
      "sonar.sidescan.range_m=50` or, for the first object, `-D objects.0.height_m=2`. In words "
      "such as `fan_scan`, `-` and `_` mean the same. A scene without a sonar has one, called "
      "`sidescan`.\n";
  const Scene scene;
  const Material material;
  for (const auto& section : scene_sections()) {
    if (section.name == "track") {
      for_each_list(scene,
                    [&]<class Item>(const Section<Item>& list_section, const std::vector<Item>&) {
                      const Item item{};
                      describe(out, list_section, fmt::format("[[{}]]", list_section.name), item);
                    });
      describe_shapes(out);
      describe(out, material_section(), "[material.NAME]", material);
    }
    describe(out, section, section.name.empty() ? "" : fmt::format("[{}]", section.name), scene);
    if (section.name == "track")
      describe(out, sonar_section(), "[sonar.NAME]", scene.sonars.front());
  }
  return out;
}

}  // namespace ensonify::engine
