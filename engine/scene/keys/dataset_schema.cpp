#include <ensonify/engine/scene/keys/dataset_options.h>

#include <ensonify/engine/base/made_once.h>

namespace ensonify::engine {

// clang-format off
namespace {
std::vector<Section<DatasetOptions>> made_dataset_sections() {
  using D = DatasetOptions;
  return {
      {"dataset",
       "How many samples, and which files each has in addition to those of a run.",
       {
           {"title", "", {}, "Title on the dataset's card.", at(&D::title), {}, "text"},
           {"samples", "", {1, max_samples}, "Number of samples.", at(&D::samples)},
           {"seafloors", "", {0, max_samples},
            "Number of seabeds; neighbouring samples share one: seafloor.*, objects and materials "
            "are drawn once per seabed. 0: one for each sample.",
            at(&D::seafloors)},
           {"samples_per_tar", "", {0, max_samples},
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
           {"least_px", "", {0, 1e9},
            "An object is ignored likewise, in all masks and lists of labels, if its body has fewer "
            "pixels in the image; 0: a box may have one pixel.",
            at(&D::least_px)},
           {"shadow_class", "", {},
            "The shadows of targets are a class, shadow, with its number in the class masks, in "
            "COCO and in YOLO files.",
            at(&D::shadow_class)},
           {"licences", "", {},
            "One line per asset, for the card: \"wreck.stl: CC BY 4.0, by ...\".",
            at(&D::licences)},
           {"licence", "", {},
            "Licence of the whole dataset, as an SPDX identifier such as CC-BY-4.0, for README.md "
            "and croissant.json.",
            at(&D::licence), {}, "an identifier"},
           {"creator", "", {}, "Who made the dataset, for croissant.json.", at(&D::creator)},
           {"url", "", {}, "Its page, for croissant.json.", at(&D::url), {}, "an address"},
           {"published", "", {}, "Its date, for croissant.json.", at(&D::published), {},
            "a date, YYYY-MM-DD"},
       }},
      {"dataset.split",
       "Which samples are for training, validation and test. Samples of one group are always in "
       "the same split.",
       {
           {"train", "", {0, 1e6}, "Share of the training samples, of the sum of all three.",
            at(&D::split, &SplitOptions::train)},
           {"val", "", {0, 1e6}, "The same for validation.", at(&D::split, &SplitOptions::val)},
           {"test", "", {0, 1e6}, "The same for the test.", at(&D::split, &SplitOptions::test)},
           {"by", "", {},
            "What makes a group: seafloor, a key of the recipe such as objects.0.mesh or "
            "draw.site, which is then drawn once per seabed, or a list of these: samples that "
            "agree in all of them are a group.",
            at(&D::split, &SplitOptions::by)},
           {"held_out_val", "", {},
            "Values of these keys that make up the validation set.",
            at(&D::split, &SplitOptions::held_out_val)},
           {"held_out_test", "", {},
            "Values of these keys that make up the test set.",
            at(&D::split, &SplitOptions::held_out_test)},
       }},
      {"dataset.tiles",
       "Each line is cut into tiles, in pixels or in metres; the last tiles end with the line.",
       {
           {"width_px", "", {0, 65536}, "Width of a tile across the track; 0: no tiles.",
            at(&D::tiles, &TileOptions::width_px)},
           {"height_px", "", {0, 65536}, "Its height along the track.",
            at(&D::tiles, &TileOptions::height_px)},
           {"width_m", "m", {0, 1e5}, "Width across the track in metres, instead of width_px.",
            at(&D::tiles, &TileOptions::width_m)},
           {"height_m", "m", {0, 1e5}, "Height along the track in metres, instead of height_px.",
            at(&D::tiles, &TileOptions::height_m)},
           {"stride", "", {0.01, 100},
            "Distance from one tile to the next, in tiles: 0.5 lets them overlap by half.",
            at(&D::tiles, &TileOptions::stride)},
           {"least_bed", "", {0, 1},
            "Tiles with a smaller share of bed, objects and shadows are left out.",
            at(&D::tiles, &TileOptions::least_bed)},
       }},
      {"dataset.chips",
       "Square images of targets with their shadows.",
       {
           {"size_px", "", {0, 65536},
            "Edge in pixels; 0: no chips. With size_m or margin, chips are resampled to this many "
            "pixels.",
            at(&D::chips, &ChipOptions::size_px)},
           {"size_m", "m", {0, 1e5}, "Edge in metres.",
            at(&D::chips, &ChipOptions::size_m)},
           {"margin", "", {0, 100},
            "Instead of size_m: the edge follows from the target. The border on each side, as a "
            "share of the target's longer side; [0.1, 0.5]: drawn between these for each chip.",
            at(&D::chips, &ChipOptions::margin)},
           {"with_shadow", "", {},
            "The chip is centred on the target with its shadow, as far as it shows the whole body; "
            "false: on its body.",
            at(&D::chips, &ChipOptions::with_shadow)},
           {"classes", "", {}, "Classes of the targets that have chips; empty: all.",
            at(&D::chips, &ChipOptions::classes)},
           {"least_px", "", {0, 1e9},
            "No chip of a target whose body has fewer pixels in the line; 0: also of a target "
            "whose shadow alone is seen.",
            at(&D::chips, &ChipOptions::least_px)},
           {"backgrounds", "", {0, 1000},
            "Number of chips of the same size without a target, at random places, per line.",
            at(&D::chips, &ChipOptions::backgrounds)},
           {"hard_negatives", "", {0, 1000},
            "Number of chips per line of things that resemble a target but are not of `classes`: "
            "targets of other classes, shadows of the relief, ground that is not plain seabed.",
            at(&D::chips, &ChipOptions::hard_negatives)},
       }},
  };
}
}  // namespace
const std::vector<Section<DatasetOptions>>& dataset_sections() { return made_once<made_dataset_sections>(); }
// clang-format on

}  // namespace ensonify::engine
