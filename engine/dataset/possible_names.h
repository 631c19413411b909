#pragma once

#include <set>
#include <string>
#include <vector>

#include <ensonify/engine/dataset/recipe_reader.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/scene/scene_paths.h>

namespace ensonify::engine {

/// The names that labels can have in the samples of a recipe.
struct PossibleNames {
  std::set<std::string> targets;            ///< classes of objects and of features of the bed
  std::set<std::string> grounds{"seabed"};  ///< the other classes
  std::set<std::string> materials;
};

/// The names of labels in `scene`, which has every optional table of the recipe, and those that can
/// be drawn. Reads the files in `seafloor.progressive`; throws refine::MeshError if one is not such
/// a file.
PossibleNames possible_names(const RecipeText& text, Scene& scene, const ScenePaths& paths);

/// The values that can be drawn for a key, then `value`.
std::vector<std::string> possible_values(const RecipeText& text, const std::string& key,
                                         const std::string& value);

}  // namespace ensonify::engine
