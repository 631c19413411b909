#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/scene/keys/schema.h>

namespace ensonify::engine {

/// Which samples are for training, validation and test.
struct SplitOptions {
  double train = 0.8, val = 0.1, test = 0.1;  ///< shares, of any sum
  std::string by = "seafloor";  ///< what is kept together: the seabed, or a key of the recipe
  std::vector<std::string> held_out_val, held_out_test;  ///< values of `by` that make up the set
};

/// Rectangles cut from images.
struct TileOptions {
  int width_px = 0, height_px = 0;
  double width_m = 0.0, height_m = 0.0;  ///< instead
  double stride = 1.0;                   ///< from tile to tile, in tiles
  bool any() const { return width_px > 0 || width_m > 0.0; }
};

/// Squares about targets, and at other places.
struct ChipOptions {
  int size_px = 0;
  double size_m = 0.0;  ///< instead
  int backgrounds = 0;  ///< squares without a target per image, at random places
  bool any() const { return size_px > 0 || size_m > 0.0; }
};

/// What a dataset holds in addition to each sample's scene and run.
struct DatasetOptions {
  std::string title;
  int samples = 16;
  int seafloors = 0;          ///< shared by neighbouring samples; 0: one per sample
  int samples_per_tar = 0;    ///< 0: folders
  int renders = 1;            ///< displays of each sample, each with its own draw of display.*
  bool slant = true;          ///< labels of the lines in slant range
  double ground_px_m = 0.0;   ///< edge of the pixels of the lines in ground range; 0: none
  double min_visible = 0.25;  ///< share of a target in an image below which it is ignored
  std::vector<std::string> licences;
  SplitOptions split;
  TileOptions tiles;
  ChipOptions chips;
};

/// The keys of [dataset] and its tables.
const std::vector<Section<DatasetOptions>>& dataset_sections();

/// The [dataset] of a recipe's text; `name` stands for the file. Throws SceneError.
DatasetOptions parse_dataset_options(std::string_view text, std::string_view name);

/// A commented recipe: every key of [dataset], how to draw a key of a scene, and where the keys of
/// scenes are documented.
std::string dump_recipe();

}  // namespace ensonify::engine
