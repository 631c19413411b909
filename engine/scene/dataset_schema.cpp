#include <ensonify/engine/scene/dataset_options.h>

#include <ensonify/engine/scene/option_at.h>

namespace ensonify::engine {

// clang-format off
const std::vector<Section<DatasetOptions>>& dataset_sections() {
  using D = DatasetOptions;
  static const std::vector<Section<DatasetOptions>> sections = {
      {"dataset",
       "How many samples, and what is kept of each beside what a run writes.",
       {
           {"title", "", {}, "What it is called on its card.", at(&D::title)},
           {"samples", "", {1, 999999}, "How many there are.", at(&D::samples)},
           {"seafloors", "", {0, 999999},
            "So many seabeds are shared among the samples, neighbours together: seafloor.*, objects and "
            "materials are drawn once a seabed. 0: one each.",
            at(&D::seafloors)},
           {"samples_per_tar", "", {0, 999999},
            "WebDataset tars of so many samples, without files for YOLO; 0: a folder a sample.", at(&D::samples_per_tar)},
           {"renders", "", {1, 1000},
            "Pictures of each sample, for each of which display.* is drawn anew.", at(&D::renders)},
           {"slant", "", {}, "Labels, tiles and chips of the lines as recorded, in slant range.",
            at(&D::slant)},
           {"ground_px_m", "m", {0, 100},
            "Lines in ground range too, over a bed as level as it is straight below, with square pixels "
            "of this size; 0: none.",
            at(&D::ground_px_m)},
           {"least_visible", "", {0, 1},
            "An object of which a picture shows less than this share of what the whole line shows is "
            "ignored: no label, and 255 in the masks.",
            at(&D::min_visible)},
           {"licences", "", {}, "A line an asset, for the card: \"wreck.stl: CC BY 4.0, by ...\".",
            at(&D::licences)},
       }},
      {"dataset.split",
       "Which samples are for training, validation and test. What is held together never crosses.",
       {
           {"train", "", {0, 1e6}, "Share, of the sum of all three.", at(&D::split, &SplitOptions::train)},
           {"val", "", {0, 1e6}, "The same.", at(&D::split, &SplitOptions::val)},
           {"test", "", {0, 1e6}, "The same.", at(&D::split, &SplitOptions::test)},
           {"by", "", {},
            "What is held together: seafloor, or a key of the recipe as objects.0.mesh or draw.site, which "
            "is then drawn once a seabed.",
            at(&D::split, &SplitOptions::by)},
           {"held_out_val", "", {}, "Values of that key that are for validation, and nothing else is.",
            at(&D::split, &SplitOptions::held_out_val)},
           {"held_out_test", "", {}, "Values of that key that are for the test, and nothing else is.",
            at(&D::split, &SplitOptions::held_out_test)},
       }},
      {"dataset.tiles",
       "Each line cut into tiles, in pixels or in metres; the last ones end with the line.",
       {
           {"width_px", "", {0, 65536}, "Across the track; 0: none.", at(&D::tiles, &TileOptions::width_px)},
           {"height_px", "", {0, 65536}, "Along it.", at(&D::tiles, &TileOptions::height_px)},
           {"width_m", "m", {0, 1e5}, "Across the track, instead.", at(&D::tiles, &TileOptions::width_m)},
           {"height_m", "m", {0, 1e5}, "Along it.", at(&D::tiles, &TileOptions::height_m)},
           {"stride", "", {0.01, 100}, "From one tile to the next, in tiles: 0.5 lets them overlap by half.",
            at(&D::tiles, &TileOptions::stride)},
       }},
      {"dataset.chips",
       "Squares about targets with their shadows.",
       {
           {"size_px", "", {0, 65536}, "Edge; 0: none.", at(&D::chips, &ChipOptions::size_px)},
           {"size_m", "m", {0, 1e5}, "Edge, instead: so many metres both ways.",
            at(&D::chips, &ChipOptions::size_m)},
           {"backgrounds", "", {0, 1000},
            "As large, without a target, at random places: so many a line.",
            at(&D::chips, &ChipOptions::backgrounds)},
       }},
  };
  return sections;
}
// clang-format on

}  // namespace ensonify::engine
