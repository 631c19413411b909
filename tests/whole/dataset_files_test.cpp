// A dataset as other programs read it: YOLO's files, COCO's outlines, numbers and names of classes;
// and the warnings of merge.

#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>

#include "support/catch.h"
#include "support/png_pixels.h"
#include "support/program.h"
#include "support/tiny_recipe.h"

using namespace ensonify::tests;
namespace fs = std::filesystem;

namespace {

using Json = nlohmann::json;

/// Makes a dataset, merges it and returns merge's stderr.
std::string made(const TemporaryFolder& folder, const std::string& recipe,
                 const std::string& dataset = "set") {
  write_text(folder / "recipe.toml", recipe);
  const Outcome outcome =
      run_program(folder.path(), {"generate", "recipe.toml", "-o", dataset, "--quiet"});
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  const Outcome merged = run_program(folder.path(), {"merge", dataset, "--quiet"});
  INFO(merged.err);
  REQUIRE(merged.code == 0);
  return merged.err;
}

std::vector<std::uint16_t> mask(const fs::path& file, bool wide) {
  const std::string png = read_text(file);
  return png_pixels(std::as_bytes(std::span(png)), wide);
}

/// Changes the working directory during its life.
class WorkingFolder {
 public:
  explicit WorkingFolder(const fs::path& folder) : before_(fs::current_path()) {
    fs::current_path(folder);
  }
  ~WorkingFolder() { fs::current_path(before_); }

 private:
  fs::path before_;
};

struct Labelled {
  fs::path picture, label;
};

/// The files that Ultralytics 8 loads for a split, by its rules for paths (check_det_dataset and
/// img2label_paths of data/utils.py, get_img_files of data/base.py).
std::vector<Labelled> load_yolo(const fs::path& yaml, const std::string& split) {
  std::map<std::string, std::string> keys;
  std::istringstream lines(read_text(yaml));
  for (std::string line; std::getline(lines, line);)
    if (const std::size_t colon = line.find(": "); colon != std::string::npos)
      keys[line.substr(0, colon)] = line.substr(colon + 2);
  fs::path root = keys.contains("path") ? fs::path(keys["path"]) : yaml.parent_path();
  if (root.empty()) root = ".";
  if (!fs::exists(root)) root = "/datasets-of-ultralytics" / root;
  const fs::path list = fs::weakly_canonical(root / keys.at(split));
  REQUIRE(fs::is_regular_file(list));
  std::vector<Labelled> all;
  std::istringstream entries(read_text(list));
  for (std::string entry; std::getline(entries, entry);) {
    if (entry.starts_with("./"))
      for (std::size_t at = 0; (at = entry.find("./", at)) != std::string::npos;) {
        const std::string parent = list.parent_path().string() + "/";
        entry.replace(at, 2, parent);
        at += parent.size();
      }
    std::string label = entry.substr(0, entry.rfind('.')) + ".txt";
    if (const std::size_t at = label.rfind("/images/"); at != std::string::npos)
      label.replace(at, 8, "/labels/");
    all.push_back({entry, label});
  }
  return all;
}

void check_loads(const fs::path& yaml, std::size_t pictures) {
  CAPTURE(yaml, fs::current_path());
  std::size_t count = 0;
  for (const char* split : {"train", "val", "test"})
    for (const auto& [picture, label] : load_yolo(yaml, split)) {
      ++count;
      CAPTURE(picture, label);
      REQUIRE(read_text(picture).starts_with("\x89PNG"));
      REQUIRE(fs::is_regular_file(label));
      REQUIRE(fs::equivalent(label, fs::canonical(picture).replace_extension(".txt")));
    }
  CHECK(count == pictures);
}

/// The pixels of an annotation's segmentation, row by row, as in pycocotools' annToMask.
std::vector<bool> pixels_of(const Json& segmentation, std::size_t columns, std::size_t rows) {
  std::vector<bool> pixels(columns * rows);
  if (segmentation.is_object()) {
    REQUIRE(segmentation.at("size") == Json{rows, columns});
    std::size_t at = 0;
    bool inside = false;
    for (const std::size_t run : segmentation.at("counts").get<std::vector<std::size_t>>()) {
      for (std::size_t i = 0; i < run; ++i, ++at)
        pixels.at(at % rows * columns + at / rows) = inside;
      inside = !inside;
    }
    REQUIRE(at == pixels.size());
    return pixels;
  }
  for (const Json& polygon : segmentation) {
    const auto xy = polygon.get<std::vector<int>>();
    for (std::size_t row = 0; row < rows; ++row)
      for (std::size_t column = 0; column < columns; ++column) {
        bool inside = false;
        for (std::size_t i = 0; i < xy.size(); i += 2) {
          const std::size_t j = (i + 2) % xy.size();
          inside ^= xy[i] == xy[j] && xy[i] > static_cast<int>(column) &&
                    std::min(xy[i + 1], xy[j + 1]) <= static_cast<int>(row) &&
                    std::max(xy[i + 1], xy[j + 1]) > static_cast<int>(row);
        }
        if (inside) pixels[row * columns + column] = true;
      }
  }
  return pixels;
}

/// The mask file of a kind for a picture; all displays of a picture share it.
fs::path mask_of(std::string picture, const std::string& kind) {
  picture.erase(picture.size() - 4);
  if (const std::size_t at = picture.rfind(".r"); at != std::string::npos) picture.erase(at);
  return picture + "." + kind + ".png";
}

struct ExrLabels {
  std::vector<std::uint32_t> numbers;  ///< row by row from the top of the picture
  std::vector<std::string> names;
};
ExrLabels read_exr(const fs::path& path, const char* layer, const char* names) {
  Imf::InputFile file(path.c_str(), 0);
  const Imath::V2i last = file.header().dataWindow().max;
  const auto columns = static_cast<std::size_t>(last.x) + 1,
             rows = static_cast<std::size_t>(last.y) + 1;
  std::vector<std::uint32_t> oldest_first(columns * rows);
  Imf::FrameBuffer frame;
  frame.insert(layer,
               Imf::Slice(Imf::UINT, reinterpret_cast<char*>(oldest_first.data()), 4, 4 * columns));
  file.setFrameBuffer(frame);
  file.readPixels(0, last.y);
  ExrLabels labels;
  for (std::size_t row = rows; row-- > 0;)
    labels.numbers.insert(labels.numbers.end(),
                          oldest_first.begin() + static_cast<std::ptrdiff_t>(row * columns),
                          oldest_first.begin() + static_cast<std::ptrdiff_t>((row + 1) * columns));
  const auto* text = file.header().findTypedAttribute<Imf::StringAttribute>(names);
  REQUIRE(text);
  labels.names = Json::parse(text->value()).get<std::vector<std::string>>();
  return labels;
}

}  // namespace

TEST_CASE("YOLO's files load from any working directory and any place of the dataset") {
  const TemporaryFolder folder;
  // Ultralytics finds labels by replacing "images" in the path, which here occurs above the
  // dataset.
  fs::create_directories(folder / "images/of mine");
  const std::string set = "images/of mine/set";
  made(folder, tiny_recipe, set);
  const Json merged =
      Json::parse(run_program(folder.path(), {"merge", set, "--json", "--quiet"}).out);
  std::size_t groups = 0;
  const auto check_all = [&](const fs::path& yolo) {
    groups = 0;
    for (const char* group : {"slant_line", "slant_tile", "slant_chip", "ground_line"}) {
      std::size_t pictures = 0;
      for (const auto& [name, count] : merged.at("images").items())
        if (name.starts_with(std::string(group) + ",")) pictures += count.get<std::size_t>();
      CHECK(pictures > 0);
      check_loads(yolo / (std::string(group) + ".yaml"), pictures);
      ++groups;
    }
  };
  for (const fs::path& from : {folder.path(), folder / (set + "/yolo"), fs::path("/")}) {
    const WorkingFolder here(from);
    check_all(folder / (set + "/yolo"));
    check_all(fs::relative(folder / (set + "/yolo"), from));
  }
  fs::rename(folder / set, folder / "moved");
  check_all(folder / "moved/yolo");
  CHECK(groups == 4);
}

TEST_CASE("a dataset in tars has no YOLO lists, which need separate files") {
  const TemporaryFolder folder;
  made(folder, changed(tiny_recipe, "seafloors = 4", "seafloors = 4\nsamples_per_tar = 4"));
  CHECK_FALSE(fs::exists(folder / "set/yolo"));
  CHECK(fs::exists(folder / "set/coco/slant_line_train.json"));
}

TEST_CASE("every outline in COCO's files equals its instance in the masks, with or without holes") {
  const TemporaryFolder folder;
  // Crossing furrows, and boulders in furrows, make holes.
  made(folder, changed(tiny_recipe, "[track]\n", R"([[seafloor.trawl_marks]]
count = 6
width_m = 1.5
depth_m = 0.3
door_spacing_m = 6
heading_spread_deg = 60
class = "trawl mark"
[track]
)"));
  std::size_t outlines = 0, holes = 0;
  for (const auto& entry : fs::directory_iterator(folder / "set/coco")) {
    const Json coco = Json::parse(read_text(entry.path()));
    std::map<int, const Json*> images;
    for (const Json& image : coco.at("images")) images[image.at("id").get<int>()] = &image;
    for (const Json& annotation : coco.at("annotations")) {
      const Json& image = *images.at(annotation.at("image_id").get<int>());
      const auto columns = image.at("width").get<std::size_t>(),
                 rows = image.at("height").get<std::size_t>();
      const std::string file =
          (folder / "set").string() + "/" + image.at("file_name").get<std::string>();
      CAPTURE(file, annotation.at("instance").get<int>());
      const std::vector<std::uint16_t> instances = mask(mask_of(file, "instance"), true);
      const Json& segmentation = annotation.at("segmentation");
      const std::vector<bool> outline = pixels_of(segmentation, columns, rows);
      std::size_t wrong = 0, area = 0;
      for (std::size_t i = 0; i < outline.size(); ++i) {
        const bool own = instances[i] == annotation.at("instance").get<int>();
        wrong += outline[i] != own;
        area += own;
      }
      CHECK(wrong == 0);
      CHECK(annotation.at("area").get<std::size_t>() == area);
      CHECK(annotation.at("iscrowd") == 0);
      ++outlines;
      holes += segmentation.is_object();
    }
  }
  CAPTURE(outlines, holes);
  CHECK(holes > 0);
  CHECK(outlines > 2 * holes);
}

TEST_CASE("classes and sediments have the same numbers in layers, masks and dataset.json") {
  const TemporaryFolder folder;
  made(folder, tiny_recipe);
  const Json dataset = Json::parse(read_text(folder / "set/dataset.json"));
  std::set<std::string> seen;
  for (const auto& entry : fs::directory_iterator(folder / "set/samples")) {
    CAPTURE(entry.path());
    for (const auto& [layer, kind, names, list] :
         {std::tuple("class", "class", "class_names", "classes"),
          std::tuple("sediment", "sediment", "sediment_names", "sediments")}) {
      const ExrLabels exr = read_exr(entry.path() / "left-right.exr", layer, names);
      const std::vector<std::uint16_t> pixels =
          mask(entry.path() / (std::string("left-right.") + kind + ".png"), false);
      REQUIRE(pixels.size() == exr.numbers.size());
      std::size_t labelled = 0, wrong = 0;
      for (std::size_t i = 0; i < pixels.size(); ++i) {
        if (pixels[i] == 0 || pixels[i] == 255) continue;
        ++labelled;
        wrong += pixels[i] != exr.numbers[i];
        seen.insert(exr.names.at(exr.numbers[i]));
      }
      CHECK(labelled > 0);
      CHECK(wrong == 0);
      CHECK(exr.names.front() == "none");
      CHECK(std::vector<std::string>(exr.names.begin() + 1, exr.names.end()) ==
            dataset.at(list).get<std::vector<std::string>>());
      const Json manifest = Json::parse(read_text(entry.path() / "manifest.json"));
      CHECK(manifest.at(std::string(list) == "classes" ? "classes" : "materials") == exr.names);
    }
  }
  CHECK(seen == std::set<std::string>{"crate", "mine", "plain", "seabed"});
}

TEST_CASE("merge warns of classes that a split does not show, empty splits and shared seabeds") {
  const TemporaryFolder folder;
  const std::string plain = made(folder, tiny_recipe, "plain");
  CHECK(plain.find("share a seabed") == std::string::npos);
  CHECK(plain.find("is empty") == std::string::npos);

  const std::string held =
      made(folder,
           changed(tiny_recipe, "train = 2\nval = 1\ntest = 1\n",
                   "train = 1\nval = 0\nby = \"objects.0.shape\"\nheld_out_test = [\"box\"]\n"),
           "held");
  CHECK(held.find("no picture of the split train shows the class crate:") != std::string::npos);
  CHECK(held.find("no picture of the split test shows the class mine:") != std::string::npos);
  CHECK(held.find("the split val is empty") != std::string::npos);
  CHECK(held.find("share a seabed") == std::string::npos);

  const std::string shared =
      made(folder, changed(tiny_recipe, "[seafloor]\n", "[seafloor]\nseed = 7\n"), "shared");
  CHECK(shared.find("the splits test, train, val share a seabed, because the recipe sets "
                    "seafloor.seed = 7: remove it") != std::string::npos);
  const Json json =
      Json::parse(run_program(folder.path(), {"merge", "shared", "--json", "--quiet"}).out);
  REQUIRE(json.at("warnings").size() >= 1);
}
