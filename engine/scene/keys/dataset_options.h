#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/scene/keys/schema.h>

namespace ensonify::engine {

/// Names of samples have six digits.
inline constexpr int max_samples = 999999;

inline constexpr std::array split_names{"train", "val", "test"};

/// Which samples are for training, validation and test.
struct SplitOptions {
  double train = 0.8, val = 0.1, test = 0.1;  ///< shares, of any sum
  /// What is kept together: samples with the same seabed ("seafloor") and the same values of these
  /// keys of the recipe.
  std::vector<std::string> by = {"seafloor"};
  std::vector<std::string> held_out_val, held_out_test;  ///< values of `by` in these sets
};

/// Rectangles cut from images.
struct TileOptions {
  int width_px = 0, height_px = 0;
  double width_m = 0.0, height_m = 0.0;  ///< instead of pixels
  double stride = 1.0;                   ///< from tile to tile, in tiles
  double least_bed = 0.0;                ///< share of bed, objects and shadows; the rest is water
  bool any() const { return width_px > 0 || width_m > 0.0; }
};

/// Squares about targets, and at other places.
struct ChipOptions {
  int size_px = 0;      ///< with size_m or margin: the chip is resampled to this
  double size_m = 0.0;  ///< on the ground or in slant range
  /// Instead of size_m: the free border on each side, as a share of the target's longer side; of
  /// two numbers, one between them is drawn for each chip.
  std::vector<double> margin;
  bool with_shadow = true;           ///< the target is body and shadow, or the body alone
  std::vector<std::string> classes;  ///< of the targets that have chips; empty: all
  int least_px = 0;                  ///< of a target's body in the line's image
  int backgrounds = 0;               ///< squares without a target per image, at random places
  int hard_negatives = 0;            ///< likewise, on what looks like a target
  bool any() const { return size_px > 0 || size_m > 0.0 || !margin.empty(); }
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
  int least_px = 0;           ///< pixels of an object's body below which it is ignored
  bool shadow_class = false;  ///< the shadows of targets are a class
  std::vector<std::string> licences;
  std::string licence, creator, url, published;  ///< of the whole dataset, for its descriptions
  SplitOptions split;
  TileOptions tiles;
  ChipOptions chips;
};

/// The keys of [dataset] and its tables.
const std::vector<Section<DatasetOptions>>& dataset_sections();

/// The [dataset] of a recipe's text, with overrides key=value; `name` stands for the file. Throws
/// SceneError.
DatasetOptions parse_dataset_options(std::string_view text, std::string_view name,
                                     std::span<const std::string> overrides = {});

/// A commented recipe: every key of [dataset], how to draw a key of a scene, and where the keys of
/// scenes are documented.
std::string dump_recipe();

}  // namespace ensonify::engine
