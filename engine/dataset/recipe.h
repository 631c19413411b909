#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/image/display.h>
#include <ensonify/engine/scene/keys/dataset_options.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// The name of the class of targets' shadows (with dataset.shadow_class).
inline constexpr std::string_view shadow_name = "shadow";

/// One sample of a recipe: what was drawn, and the scene that it makes.
struct SampleScene {
  Scene scene;
  std::size_t seafloor = 0;  ///< number of its seafloor in the dataset
  std::string split;         ///< train, val or test
  /// The drawn values, as in TOML, by the names that the keys have in the recipe.
  std::map<std::string, std::string> drawn;
  std::vector<Display> renders;  ///< the first is the scene's
};

struct DrawnKeys;  // sample_draws.h

/// A dataset's recipe: a scene with distributions in place of values, and a table [dataset]. The
/// draw of a key depends only on the recipe's seed, the key's name and the number of the sample, or
/// of its seafloor for a key that is drawn once per seafloor.
class Recipe {
 public:
  /// Reads a recipe. `overrides` are key=value, as for a scene; a value may be a distribution.
  /// Throws SceneError with `file:line:column` of the error, and refine::MeshError for a wrong file
  /// in `seafloor.progressive`, from which it reads names of labels.
  Recipe(const std::filesystem::path& file, const std::filesystem::path& data_folder,
         std::vector<std::string> overrides = {});
  /// Reads a recipe from text; `name` stands for the file.
  Recipe(std::string text, std::string name, const std::filesystem::path& data_folder,
         std::vector<std::string> overrides = {});
  Recipe(Recipe&&) noexcept;
  ~Recipe();

  const std::string& text() const { return text_; }
  const std::vector<std::string>& overrides() const { return overrides_; }
  const DatasetOptions& options() const { return options_; }
  std::size_t samples() const { return static_cast<std::size_t>(options_.samples); }
  std::size_t seafloors() const;
  /// The number of the sample's seafloor. Consecutive samples share a seafloor.
  std::size_t seafloor_of(std::size_t sample) const { return sample * seafloors() / samples(); }

  /// Throws SceneError if the drawn values do not make a valid scene, or if the lines of the scene
  /// are smaller than the tiles or chips that are cut from them.
  SampleScene sample(std::size_t number) const;

  /// Warnings that follow from the recipe and its draws before any sample is made: held-out values
  /// that no sample has, samples without labels.
  std::vector<std::string> warnings() const;

  /// Every name that the class of a label can have: sorted names of targets, then of ground. The
  /// name at index k has the number k + 1 in labels.
  std::vector<std::string> class_names() const;
  /// The number of names of targets, which are first.
  std::size_t target_classes() const { return targets_.size(); }
  std::vector<std::string> material_names() const { return materials_; }
  /// The files that the recipe can use and the files behind them (files_behind()), sorted:
  /// `data:PATH` in the data folder, other paths relative to the recipe's folder. Throws as
  /// files_behind().
  std::vector<std::string> assets() const;
  std::filesystem::path path_of(const std::string& asset) const;

 private:
  ScenePaths paths() const;
  Scene with_every_table() const;
  std::string text_, name_;
  std::vector<std::string> overrides_;
  std::filesystem::path data_folder_;
  DatasetOptions options_;
  std::unique_ptr<DrawnKeys> drawn_keys_;
  std::vector<std::string> targets_, grounds_, materials_;
  std::set<std::string> files_;
};

}  // namespace ensonify::engine
