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

/// Reads a scene file, then applies `key=value` overrides: the key's whole name with dots, a value
/// as in TOML (a bare word is a string). An override can change a sonar of the scene, not add one.
/// Every fault throws SceneError with `file:line:column: what is wrong, what was expected`, for an
/// override `-D key=value: ...`; for an unknown key with the nearest known one.
Scene read_scene(const std::filesystem::path& file, std::span<const std::string> overrides = {},
                 const std::filesystem::path& data_folder = {});

/// The same from text; `name` stands for the file in messages. The scene also has the materials
/// `known`, which the text may name.
Scene parse_scene(std::string_view text, std::string_view name,
                  std::span<const std::string> overrides = {}, const ScenePaths& paths = {},
                  std::span<const Material> known = {});

/// An override key=value as TOML: a bare word becomes a string. Throws SceneError for a text that
/// is not key=value.
std::string toml_override(const std::string& override_text);

/// An override as the place of a fault, "-D key=value", shortened.
std::string place_of_override(std::string_view override_text);

/// "; with -D key=value -D ...", for a message about keys that overrides may have changed; empty
/// without overrides.
std::string with_overrides(std::span<const std::string> overrides);

/// What was drawn for one scene of a dataset's recipe.
struct DrawnValues {
  /// By the key's whole name: a value as in TOML; an empty one leaves the key out.
  std::map<std::string, std::string, std::less<>> values;
  /// Tables of lists that the scene does not have, such as `objects.1`, by their numbers in the
  /// recipe. Later tables of such a list have in `values` the numbers that they have in the scene.
  std::set<std::string, std::less<>> absent;
  /// Overrides as for a scene, of keys that the recipe's text may not have.
  std::vector<std::string> overrides = {};
};

/// A scene from a recipe's text, with drawn values in place of the recipe's distributions. Its
/// tables [dataset] and [draw] and the keys `present` of lists are skipped.
Scene parse_recipe(std::string_view text, std::string_view name, const DrawnValues& drawn,
                   const ScenePaths& paths);

/// The same, but without checking that the options fit each other and that the files exist.
Scene parse_recipe_unchecked(std::string_view text, std::string_view name,
                             const DrawnValues& drawn);

/// The text of a scene or recipe file, at most 1 MiB. Throws SceneError.
std::string read_scene_text(const std::filesystem::path& file);

}  // namespace ensonify::engine
