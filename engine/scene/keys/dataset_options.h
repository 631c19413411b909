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
  double train = 0.8, val = 0.1, test = 0.1;  ///< shares; their sum may be any number
  /// What defines a group, whose samples stay in one split: the seabed ("seafloor"), or keys of the
  /// recipe. Samples of a group have the same values of all of these.
  std::vector<std::string> by = {"seafloor"};
  std::vector<std::string> held_out_val, held_out_test;  ///< values of `by` in these splits
};

/// Rectangles cut from images.
struct TileOptions {
  int width_px = 0, height_px = 0;
  double width_m = 0.0, height_m = 0.0;  ///< instead of pixels
  double stride = 1.0;                   ///< distance from tile to tile, in tiles
  double least_bed = 0.0;  ///< least share of bed, objects and shadows in a tile; the rest is water
  bool any() const { return width_px > 0 || width_m > 0.0; }
};

/// Squares about targets, and at other places.
struct ChipOptions {
  int size_px = 0;      ///< with size_m or margin, the size to which chips are resampled
  double size_m = 0.0;  ///< edge in metres, on the ground or in slant range
  /// Instead of size_m: the free border on each side of the target, as a share of the target's
  /// longer side. With two numbers, a number between them is drawn for each chip.
  std::vector<double> margin;
  bool with_shadow = true;  ///< whether a chip shows the target with its shadow, or its body alone
  std::vector<std::string> classes;  ///< classes of the targets that get chips; empty: all
  int least_px = 0;                  ///< least size of a target's body in the line's image
  int backgrounds = 0;     ///< number per image of chips without a target, at random places
  int hard_negatives = 0;  ///< number per image of chips of what looks like a target
  bool any() const { return size_px > 0 || size_m > 0.0 || !margin.empty(); }
};

/// What a dataset holds in addition to each sample's scene and run.
struct DatasetOptions {
  std::string title;
  int samples = 16;
  int seafloors = 0;          ///< neighbouring samples share one; 0: one per sample
  int samples_per_tar = 0;    ///< 0: samples are in folders
  int renders = 1;            ///< images of each sample; display.* is drawn for each
  bool slant = true;          ///< whether there are labels in slant range
  double ground_px_m = 0.0;   ///< edge of the pixels of images in ground range; 0: no such images
  double min_visible = 0.25;  ///< a target is ignored if an image shows a smaller share of it
  int least_px = 0;           ///< an object is ignored if its body has fewer pixels
  bool shadow_class = false;  ///< whether the shadows of targets are a class
  std::vector<std::string> licences;
  std::string licence, creator, url, published;  ///< of the whole dataset, for its descriptions
  SplitOptions split;
  TileOptions tiles;
  ChipOptions chips;
};

/// The keys of [dataset] and its tables.
const std::vector<Section<DatasetOptions>>& dataset_sections();

/// The table [dataset] of a recipe's text, with overrides key=value. `name` replaces the file's
/// name in messages. Throws SceneError.
DatasetOptions parse_dataset_options(std::string_view text, std::string_view name,
                                     std::span<const std::string> overrides = {});

/// A commented recipe: every key of [dataset], how to draw a key of a scene, and where the keys of
/// scenes are described.
std::string dump_recipe();

}  // namespace ensonify::engine
