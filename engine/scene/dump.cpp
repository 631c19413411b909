#include <fmt/format.h>

#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/scene/schema.h>

namespace ensonify::engine {
namespace {

template <class Owner>
std::string help_text(const Key<Owner>& key) {
  return fmt::format("{} ({})", key.help, expectation(key));
}

template <class Owner>
void dump(std::string& out, const Section<Owner>& section, std::string_view name, Owner& owner,
          bool with_comments) {
  if (with_comments && !name.empty()) out += fmt::format("\n# {}\n", section.help);
  if (!name.empty()) out += fmt::format("{}[{}]\n", with_comments ? "" : "\n", name);
  for (const Key<Owner>& key : section.keys) {
    const std::optional<std::string> value = option_text(key, owner);
    if (with_comments) out += fmt::format("# {}\n", help_text(key));
    if (value)
      out += fmt::format("{} = {}\n", key.name, *value);
    else if (with_comments)
      out += fmt::format("# {} =\n", key.name);
  }
}

template <class Owner>
void describe(std::string& out, const Section<Owner>& section, Owner& owner) {
  out += section.name.empty() ? fmt::format("\n## The top of the file\n")
                              : fmt::format("\n## [{}]\n", section.name);
  out +=
      fmt::format("\n{}\n\n| key | is | expected | default |\n|---|---|---|---|\n", section.help);
  for (const Key<Owner>& key : section.keys)
    out += fmt::format("| `{}` | {} | {} | {} |\n", key.name, key.help, expectation(key),
                       option_text(key, owner).value_or("unset"));
}

}  // namespace

std::string dump_scene(const Scene& scene, bool with_comments) {
  Scene copy = scene;
  std::string out;
  if (with_comments)
    out += "# A scene of ensonify, with every key. Those that are commented out are unset.\n\n";
  out += "version = 1\n";
  for (const auto& section : scene_sections()) {
    dump(out, section, section.name, copy, with_comments);
    if (section.name == "track")
      for (Sonar& sonar : copy.sonars)
        dump(out, sonar_section(), "sonar." + sonar.name, sonar, with_comments);
  }
  return out;
}

std::string schema_text() {
  std::string out =
      "# Scene files\n\n"
      "A scene is a TOML file that begins with `version = 1`. A key's unit is in its name; every "
      "key has "
      "a default. `ensonify dump-default run` prints them all; `-D key=value` changes one, its "
      "whole "
      "name with dots, as in `-D sea.temperature_c=12` or `-D sonar.sidescan.range_m=50`. A scene "
      "that "
      "names no sonar has one, called `sidescan`.\n";
  Scene scene;
  for (const auto& section : scene_sections()) {
    describe(out, section, scene);
    if (section.name == "track") describe(out, sonar_section(), scene.sonars.front());
  }
  return out;
}

}  // namespace ensonify::engine
