#include <ensonify/engine/scene/checks/check.h>

#include <algorithm>

#include <fmt/format.h>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/scene/checks/name_check.h>
#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/engine/scene/keys/schema.h>

namespace ensonify::engine {
namespace {

/// Whether a key may have a value. Degrees may have rounding errors: they were radians before.
template <class Owner, class T>
bool may_be(const Key<Owner>& key, const T& value) {
  if constexpr (requires { value.has_value(); }) {
    return !value || may_be(key, *value);
  } else if constexpr (std::is_same_v<T, double>) {
    const double own = key.in_degrees() ? value / degree : value;
    const double rounding = key.in_degrees() ? 1e-9 : 0.0;
    return own >= key.range.low - rounding && own <= key.range.high + rounding;
  } else if constexpr (std::is_same_v<T, std::vector<double>>) {
    return std::ranges::all_of(
        value, [&](double number) { return number >= key.range.low && number <= key.range.high; });
  } else if constexpr (std::is_same_v<T, std::vector<Eigen::Vector2d>>) {
    return std::ranges::all_of(value, [&](const Eigen::Vector2d& point) {
      return point.minCoeff() >= key.range.low && point.maxCoeff() <= key.range.high;
    });
  } else if constexpr (std::is_same_v<T, std::string>) {
    return key.choices.empty() || value.empty() ||  // an empty text is unset
           std::ranges::find(key.choices, value) != key.choices.end();
  } else if constexpr (std::is_enum_v<T>) {
    return static_cast<std::size_t>(value) < key.choices.size();
  } else if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool>) {
    return double(value) >= key.range.low && double(value) <= key.range.high;
  } else {
    return true;  // truth values, files and lists of words have no range
  }
}

template <class Owner>
void check_keys(const Section<Owner>& section, const std::string& name, const Owner& owner) {
  for (const Key<Owner>& key : section.keys) {
    if (std::visit([&](const auto* value) { return may_be(key, *value); }, key.option(owner)))
      continue;
    throw SceneError(fmt::format(
        "the scene: '{}{}{}' is {}, expected {}", name, name.empty() ? "" : ".", key.name,
        option_text(key, owner).value_or("not one of its words"), expectation(key)));
  }
}

void check_name(const std::optional<std::string>& fault) {
  if (fault) throw SceneError("the scene: " + *fault);
}

}  // namespace

void check_values(const Scene& scene) {
  for (const Section<Scene>& section : scene_sections())
    check_keys(section, std::string(section.name), scene);
  for_each_list(scene, [](const auto& section, const auto& list) {
    for (std::size_t i = 0; i < list.size(); ++i)
      check_keys(section, fmt::format("{}.{}", section.name, i), list[i]);
  });
  for (const Material& material : scene.materials)
    check_keys(material_section(), "material." + material.name, material);
  if (scene.sonars.empty()) throw SceneError("the scene: there is no sonar, expected one or more");
  for (const Sonar& sonar : scene.sonars) {
    check_keys(sonar_section(), "sonar." + sonar.name, sonar);
    check_name(fault_of_name("sonar", sonar.name));
    check_name(fault_of_file_names(sonar.name, scene.sonars));
  }
  check_scene(scene, [](std::string_view) { return "the scene"; });
}

}  // namespace ensonify::engine
