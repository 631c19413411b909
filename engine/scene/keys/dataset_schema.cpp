#include <ensonify/engine/scene/keys/dataset_options.h>

namespace ensonify::engine {

// clang-format off
const std::vector<Section<DatasetOptions>>& dataset_sections() {
  using D = DatasetOptions;
  static const std::vector<Section<DatasetOptions>> sections = {
      {"dataset",
       "How many samples, and which files each has in addition to those of a run.",
       {
           {"title", "", {}, "Title on the dataset's card.", at(&D::title)},
           {"samples", "", {1, 999999}, "Number of samples.", at(&D::samples)},
           {"seafloors", "", {0, 999999},
            "Number of seabeds; neighbouring samples share one: seafloor.*, objects and materials "
            "are drawn once per seabed. 0: one for each sample.",
            at(&D::seafloors)},
           {"samples_per_tar", "", {0, 999999},
            "Number of samples in each WebDataset tar, without files for YOLO; 0: one folder per "
            "sample.",
            at(&D::samples_per_tar)},
           {"renders", "", {1, 1000},
            "Number of images of each sample; display.* is drawn again for each.", at(&D::renders)},
           {"slant", "", {}, "Labels, tiles and chips of the lines as recorded, in slant range.",
            at(&D::slant)},
           {"ground_px_m", "m", {0, 100},
            "Lines in ground range too, over a level bed at the depth straight below, with square "
            "pixels of this size; 0: none.",
            at(&D::ground_px_m)},
           {"least_visible", "", {0, 1},
            "An object is ignored (no label, 255 in the masks) in an image that shows less than "
            "this share of what the whole line shows.",
            at(&D::min_visible)},
           {"licences", "", {},
            "One line per asset, for the card: \"wreck.stl: CC BY 4.0, by ...\".",
            at(&D::licences)},
       }},
      {"dataset.split",
       "Which samples are for training, validation and test. What is held together never crosses.",
       {
           {"train", "", {0, 1e6}, "Share of the training samples, of the sum of all three.",
            at(&D::split, &SplitOptions::train)},
           {"val", "", {0, 1e6}, "The same.", at(&D::split, &SplitOptions::val)},
           {"test", "", {0, 1e6}, "The same.", at(&D::split, &SplitOptions::test)},
           {"by", "", {},
            "What is held together: seafloor, or a key of the recipe such as objects.0.mesh or "
            "draw.site, which is then drawn once per seabed.",
            at(&D::split, &SplitOptions::by)},
           {"held_out_val", "", {},
            "Values of that key that make up the validation set.",
            at(&D::split, &SplitOptions::held_out_val)},
           {"held_out_test", "", {},
            "Values of that key that make up the test set.",
            at(&D::split, &SplitOptions::held_out_test)},
       }},
      {"dataset.tiles",
       "Each line is cut into tiles, in pixels or in metres; the last tiles end with the line.",
       {
           {"width_px", "", {0, 65536}, "Across the track; 0: none.",
            at(&D::tiles, &TileOptions::width_px)},
           {"height_px", "", {0, 65536}, "Along it.", at(&D::tiles, &TileOptions::height_px)},
           {"width_m", "m", {0, 1e5}, "Across the track, instead.",
            at(&D::tiles, &TileOptions::width_m)},
           {"height_m", "m", {0, 1e5}, "Along it.", at(&D::tiles, &TileOptions::height_m)},
           {"stride", "", {0.01, 100},
            "From one tile to the next, in tiles: 0.5 lets them overlap by half.",
            at(&D::tiles, &TileOptions::stride)},
       }},
      {"dataset.chips",
       "Square images of targets with their shadows.",
       {
           {"size_px", "", {0, 65536}, "Edge; 0: none.", at(&D::chips, &ChipOptions::size_px)},
           {"size_m", "m", {0, 1e5}, "Edge in metres, instead.",
            at(&D::chips, &ChipOptions::size_m)},
           {"backgrounds", "", {0, 1000},
            "Number of chips of the same size without a target, at random places, per line.",
            at(&D::chips, &ChipOptions::backgrounds)},
       }},
  };
  return sections;
}
// clang-format on

}  // namespace ensonify::engine
