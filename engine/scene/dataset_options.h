#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/scene/schema.h>

namespace ensonify::engine {

/// Which samples are for training, validation and test.
struct SplitOptions {
  double train = 0.8, val = 0.1, test = 0.1;  ///< shares, of any sum
  std::string by = "seafloor";  ///< what is kept together: the seabed, or a key of the recipe
  std::vector<std::string> held_out_val, held_out_test;  ///< its values that go there, nothing else
};

/// Rectangles cut from pictures.
struct TileOptions {
  int width_px = 0, height_px = 0;
  double width_m = 0.0, height_m = 0.0;  ///< instead
  double stride = 1.0;                   ///< from tile to tile, in tiles
  bool any() const { return width_px > 0 || width_m > 0.0; }
};

/// Squares about targets, and elsewhere.
struct ChipOptions {
  int size_px = 0;
  double size_m = 0.0;  ///< instead
  int backgrounds = 0;  ///< squares a picture without a target, at random places
  bool any() const { return size_px > 0 || size_m > 0.0; }
};

/// What a dataset holds beside each sample's scene and its run.
struct DatasetOptions {
  std::string title;
  int samples = 16;
  int seafloors = 0;          ///< shared by the samples, neighbours together; 0: one each
  int samples_per_tar = 0;    ///< 0: folders
  int renders = 1;            ///< displays of each sample, each with its own draw of display.*
  bool slant = true;          ///< labels of the lines in slant range
  double ground_px_m = 0.0;   ///< edge of the pixels of the lines in ground range; 0: none
  double min_visible = 0.25;  ///< share of a target in a picture below which it is ignored
  std::vector<std::string> licences;
  SplitOptions split;
  TileOptions tiles;
  ChipOptions chips;
};

/// The keys of [dataset] and its tables.
const std::vector<Section<DatasetOptions>>& dataset_sections();

/// The [dataset] of a recipe's text; `name` stands for the file. Throws SceneError.
DatasetOptions parse_dataset_options(std::string_view text, std::string_view name);

/// A commented recipe: every key of [dataset], how to draw a key of a scene, and where those are
/// found.
std::string dump_recipe();

}  // namespace ensonify::engine
