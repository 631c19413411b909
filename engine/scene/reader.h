#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/scene/scene_paths.h>

namespace ensonify::engine {

/// Reads a scene file, then applies overrides `key=value`. The key is a whole name with dots; the
/// value is TOML, or a bare word, which is a string. An override can change a sonar of the scene,
/// but cannot add one. Every fault throws SceneError with `file:line:column: what is wrong, what
/// was expected`, or for an override `-D key=value: ...`. For an unknown key the message suggests
/// the nearest known key.
Scene read_scene(const std::filesystem::path& file, std::span<const std::string> overrides = {},
                 const std::filesystem::path& data_folder = {});

/// Reads a scene from a text; `name` replaces the file's name in messages. The scene also has the
/// materials `known`, which the text may name.
Scene parse_scene(std::string_view text, std::string_view name,
                  std::span<const std::string> overrides = {}, const ScenePaths& paths = {},
                  std::span<const Material> known = {});

/// An override key=value as TOML: a bare word becomes a string. Throws SceneError for a text that
/// is not of the form key=value.
std::string toml_override(const std::string& override_text);

/// An override as the place of a fault in messages: "-D key=value", shortened.
std::string place_of_override(std::string_view override_text);

/// The text "; with -D key=value -D ..." for a message about keys that overrides may have changed;
/// empty if there are no overrides.
std::string with_overrides(std::span<const std::string> overrides);

/// The values that were drawn for one scene of a dataset's recipe.
struct DrawnValues {
  /// The drawn values as TOML, by the key's whole name; an empty text leaves the key out.
  std::map<std::string, std::string, std::less<>> values;
  /// Tables of lists that the scene does not have, by their numbers in the recipe, such as
  /// `objects.1`. In `values`, tables have the numbers that they have in the scene.
  std::set<std::string, std::less<>> absent;
  /// Overrides as for a scene. Their keys may be missing in the recipe's text.
  std::vector<std::string> overrides = {};
};

/// A scene from a recipe's text, with drawn values instead of the recipe's distributions. The
/// tables [dataset] and [draw] and the keys `present` of lists are skipped.
Scene parse_recipe(std::string_view text, std::string_view name, const DrawnValues& drawn,
                   const ScenePaths& paths);

/// parse_recipe() without checks: options may contradict each other, and files may be missing.
Scene parse_recipe_unchecked(std::string_view text, std::string_view name,
                             const DrawnValues& drawn);

/// The text of a scene file or a recipe file of at most 1 MiB. Throws SceneError.
std::string read_scene_text(const std::filesystem::path& file);

}  // namespace ensonify::engine
