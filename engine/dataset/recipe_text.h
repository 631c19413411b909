#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/dataset/distribution.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/scene/scene_paths.h>

namespace ensonify::engine {

/// A recipe's text without its [dataset].
struct RecipeText {
  std::uint64_t seed = 1;
  bool has_seafloor_seed = false;
  std::map<std::string, Distribution, std::less<>> distributions;  ///< by the key's whole name
  /// The values of keys without a distribution: numbers, words, true and false.
  std::map<std::string, std::string, std::less<>> values;
  std::map<std::string, std::size_t, std::less<>> lists;  ///< length of each list of tables
  std::set<std::string, std::less<>> overridden;          ///< keys of the scene that overrides set
};

/// Finds a recipe's distributions. An override key=value becomes a distribution of one value, or
/// the distribution that it gives. A file data:PATH with a * becomes a choice of the files in the
/// data folder that it matches. Throws SceneError with `file:line:column` for a distribution that
/// is not valid, and for a * that matches no file.
RecipeText parse_recipe_text(std::string_view text, std::string_view name,
                             const std::filesystem::path& data_folder,
                             std::span<const std::string> overrides);

/// The text that a TOML string stands for; other values stay unchanged.
std::string plain_text(const std::string& value);

/// Whether a key is a table, or lies in it.
bool in_table(std::string_view key, std::string_view table);

/// The names that labels can have in the samples of a recipe.
struct PossibleNames {
  std::set<std::string> targets;            ///< classes of objects and of features of the bed
  std::set<std::string> grounds{"seabed"};  ///< the other classes
  std::set<std::string> materials;
};

/// The names of labels in `scene`, which has every optional table of the recipe, and those that can
/// be drawn. Reads the files in `seafloor.progressive`; throws refine::MeshError for another file.
PossibleNames possible_names(const RecipeText& text, Scene& scene, const ScenePaths& paths);

/// The values that can be drawn for a key, then `value`.
std::vector<std::string> possible_values(const RecipeText& text, const std::string& key,
                                         const std::string& value);

/// A recipe's text, and how often its keys are drawn.
struct DrawnKeys : RecipeText {
  std::set<std::string, std::less<>> of_seafloor;  ///< keys that are drawn once per seafloor
  std::size_t renders = 1;                         ///< per sample
};

/// A number that selects the random stream of a key.
std::uint64_t key_number(std::string_view key);
/// The number in (0, 1] at an index of a stratified_number() sequence with seeds of the stream.
double stratified(const RandomStream& stream, std::uint64_t index);

/// The values of one sample's keys, drawn as described at Recipe.
class SampleDraws {
 public:
  /// `text` must outlive this object.
  SampleDraws(const DrawnKeys& text, std::size_t sample, std::size_t seafloor, std::size_t render)
      : text_(text), sample_(sample), seafloor_(seafloor), render_(render) {}

  /// A key's value as in TOML; empty: the key is left out. Throws SceneError for a key without a
  /// value, for a key that depends on itself, and for more than `most_levels` keys that depend on
  /// each other one after the other. `asked_by` is the place for messages.
  const std::string& value(const std::string& key, const std::string& asked_by);

 private:
  double number(const std::string& key, const Distribution& d);
  std::string draw(const std::string& stream_name, const Distribution& d, const std::string& key);
  std::string adjusted(std::string drawn, const Distribution& d);

  const DrawnKeys& text_;
  std::size_t sample_, seafloor_, render_;
  std::map<std::string, std::optional<std::string>> known_;  // none: being drawn
  int open_ = 0;                                             // keys that are being drawn
};

}  // namespace ensonify::engine
