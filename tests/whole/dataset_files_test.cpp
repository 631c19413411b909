// A dataset as other programs read it: YOLO's files, COCO's outlines, numbers and names of classes;
// and the warnings of merge.

#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include <fmt/format.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/png_pixels.h"
#include "support/program.h"
#include "support/tiny_recipe.h"

#include <ensonify/engine/output/tar.h>

using namespace ensonify::tests;
namespace fs = std::filesystem;

namespace {

using Json = nlohmann::json;

/// Makes a dataset, merges it and returns merge's stderr.
std::string made(const TemporaryFolder& folder, const std::string& recipe,
                 const std::string& dataset = "set", const std::vector<std::string>& more = {}) {
  write_text(folder / "recipe.toml", recipe);
  const Outcome outcome =
      run_program(folder.path(), {"generate", "recipe.toml", "-o", dataset, "--quiet"});
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  std::vector<std::string> arguments{"merge", dataset, "--quiet"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  const Outcome merged = run_program(folder.path(), arguments);
  INFO(merged.err);
  REQUIRE(merged.code == 0);
  return merged.err;
}

std::vector<std::uint16_t> mask(const fs::path& file, bool wide) {
  const std::string png = read_text(file);
  return png_pixels(std::as_bytes(std::span(png)), wide);
}

/// The type of a column with these types in its rows, as Arrow infers it from JSON: an empty list
/// or a null has no type.
Json common_type(const Json& a, const Json& b) {
  if (a.is_null()) return b;
  if (b.is_null() || a == b) return a;
  if (a.is_object() && b.is_object()) {
    Json type = a;
    for (const auto& [key, value] : b.items()) type[key] = common_type(type[key], value);
    return type;
  }
  REQUIRE(a.is_string());
  REQUIRE(b.is_string());
  return "double";  // and an int64
}

Json column_type(const Json& value) {
  if (value.is_object()) {
    Json type = Json::object();
    for (const auto& [key, member] : value.items()) type[key] = column_type(member);
    return type;
  }
  if (!value.is_array())
    return value.is_null()             ? Json()
           : value.is_number_integer() ? Json("int64")
                                       : Json(value.type_name());
  Json type;
  for (const Json& element : value) type = common_type(type, column_type(element));
  return {{"list of", type}};
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

/// A row of a label file: class and coordinates.
using BoxRow = std::pair<int, std::vector<double>>;
std::vector<BoxRow> label_rows(const fs::path& label) {
  std::vector<BoxRow> rows;
  std::istringstream lines(read_text(label));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    BoxRow& row = rows.emplace_back();
    words >> row.first;
    for (double value = 0; words >> value;) row.second.push_back(value);
  }
  return rows;
}

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

/// The box of a row, as verify_image_label of Ultralytics' data/utils.py makes it: middle and size,
/// or of a polygon (more than 6 columns) the bounds of its corners.
std::array<double, 4> box_of(const BoxRow& row) {
  const std::vector<double>& values = row.second;
  if (values.size() == 4) return {values[0], values[1], values[2], values[3]};
  REQUIRE((values.size() >= 6 && values.size() % 2 == 0));
  std::array<double, 2> low{1, 1}, high{0, 0};
  for (std::size_t i = 0; i < values.size(); ++i) {
    REQUIRE((values[i] >= 0.0 && values[i] <= 1.0));
    low[i % 2] = std::min(low[i % 2], values[i]);
    high[i % 2] = std::max(high[i % 2], values[i]);
  }
  return {(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, high[0] - low[0], high[1] - low[1]};
}

/// Outlines load like boxes, from a tree of their own, and have the same classes and boxes.
std::size_t check_segments(const fs::path& set, const std::string& group) {
  std::size_t outlines = 0;
  for (const char* split : {"train", "val", "test"}) {
    const auto boxes = load_yolo(set / "yolo" / (group + ".yaml"), split),
               segments = load_yolo(set / "yolo_segment" / (group + ".yaml"), split);
    REQUIRE(boxes.size() == segments.size());
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      CAPTURE(segments[i].label);
      CHECK(fs::equivalent(boxes[i].picture, segments[i].picture));
      const auto as_boxes = label_rows(boxes[i].label), as_outlines = label_rows(segments[i].label);
      REQUIRE(as_boxes.size() == as_outlines.size());
      for (std::size_t k = 0; k < as_boxes.size(); ++k) {
        CHECK(as_boxes[k].first == as_outlines[k].first);
        const auto a = box_of(as_boxes[k]), b = box_of(as_outlines[k]);
        for (std::size_t j = 0; j < 4; ++j) CHECK(a[j] == Approx(b[j]).margin(2e-6));
        ++outlines;
      }
    }
  }
  return outlines;
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

/// Turns over the pixels of a polygon, counted column by column, by the rule of pycocotools
/// (rleFrPoly of common/maskApi.c): the border is drawn on a grid five times as fine; where it
/// crosses the middle of a column of pixels, all further pixels of the picture turn over.
void turn_over(const std::vector<double>& xy, std::size_t columns, std::size_t rows,
               std::vector<bool>& pixels) {
  constexpr int fine = 5;
  std::vector<std::array<int, 2>> border;
  const std::size_t corners = xy.size() / 2;
  for (std::size_t i = 0; i < corners; ++i) {
    const auto corner = [&](std::size_t k) {
      const auto rounded = [](double x) { return static_cast<int>(std::lround(x)); };
      return std::array{rounded(fine * xy[2 * (k % corners)]),
                        rounded(fine * xy[2 * (k % corners) + 1])};
    };
    const auto from = corner(i), to = corner(i + 1);
    REQUIRE((from[0] == to[0] || from[1] == to[1]));  // our outlines have no slanted edges
    const int steps = std::max(std::abs(to[0] - from[0]), std::abs(to[1] - from[1]));
    for (int k = 0; k <= steps; ++k)
      border.push_back({from[0] + k * (to[0] - from[0]) / std::max(steps, 1),
                        from[1] + k * (to[1] - from[1]) / std::max(steps, 1)});
  }
  for (std::size_t i = 1; i < border.size(); ++i) {
    if (border[i][0] == border[i - 1][0]) continue;
    const double column = (std::min(border[i][0], border[i - 1][0]) + 0.5) / fine - 0.5;
    if (std::floor(column) != column || column < 0 || column > double(columns) - 1) continue;
    const double row = (std::min(border[i][1], border[i - 1][1]) + 0.5) / fine - 0.5;
    const auto first = static_cast<std::size_t>(column) * rows +
                       static_cast<std::size_t>(std::ceil(std::clamp(row, 0.0, double(rows))));
    for (std::size_t k = first; k < pixels.size(); ++k) pixels[k] = !pixels[k];
  }
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
    std::vector<bool> part(columns * rows);
    turn_over(polygon.get<std::vector<double>>(), columns, rows, part);
    for (std::size_t i = 0; i < part.size(); ++i)
      if (part[i]) pixels[i % rows * columns + i / rows] = true;
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
      CHECK(check_segments(yolo / "..", group) > 0);
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
  CHECK_FALSE(fs::exists(folder / "set/yolo_segment"));
  CHECK_FALSE(fs::exists(folder / "set/hub"));
  CHECK(fs::exists(folder / "set/coco/slant_line_train.json"));
  CHECK(read_text(folder / "set/pictures/000000_left-right.png").starts_with("\x89PNG"));
}

TEST_CASE("WebDataset groups the records of each kind and split, from folders and from tars") {
  const TemporaryFolder folder;
  made(folder, tiny_recipe, "set", {"--webdataset"});
  made(folder, changed(tiny_recipe, "seafloors = 4", "seafloors = 4\nsamples_per_tar = 3"), "tars",
       {"--webdataset"});
  std::size_t records = 0;
  for (const auto& entry : fs::directory_iterator(folder / "set/webdataset")) {
    const std::string name = entry.path().filename().string();
    CAPTURE(name);
    CHECK(read_text(entry.path()) == read_text(folder / "tars/webdataset" / name));
    // webdataset's group_by_keys (tariterators.py): the key is the path up to the first dot of the
    // file's name; a new key begins a new record, and a repeated extension is an error.
    const std::size_t end = name.rfind("-000000.tar");
    REQUIRE(end != std::string::npos);
    const Json coco = Json::parse(read_text(folder / "set/coco" / (name.substr(0, end) + ".json")));
    std::map<std::string, std::map<std::string, std::vector<std::byte>>> found;
    std::string last;
    ensonify::engine::read_tar(
        entry.path(), [&](const std::string& member, std::vector<std::byte> content) {
          const std::size_t dot = member.find('.', member.rfind('/') + 1);
          const std::string key = member.substr(0, dot);
          if (key != last) CHECK_FALSE(found.contains(key));
          last = key;
          const bool is_new = found[key].emplace(member.substr(dot + 1), std::move(content)).second;
          CHECK(is_new);
        });
    CHECK(2 * found.size() == coco.at("images").size());  // two displays in each record
    for (const auto& [key, files] : found) {
      CAPTURE(key);
      for (const char* extension : {"png", "r1.png", "class.png", "sediment.png", "instance.png",
                                    "region.png", "json", "txt", "r1.txt"})
        CHECK(files.contains(extension));
      CHECK(files.size() == 9);
      const std::vector<std::byte>& json = files.at("json");
      const Json labels =
          Json::parse(std::string(reinterpret_cast<const char*>(json.data()), json.size()));
      CHECK(name.starts_with(labels.at("geometry").get<std::string>() + "_"));
      CHECK(name.ends_with(labels.at("split").get<std::string>().append("-000000.tar")));
      ++records;
    }
  }
  CHECK(records > 16);
}

TEST_CASE("the Hub's ImageFolder finds each picture and its metadata, and the card's configs") {
  const TemporaryFolder folder;
  made(folder, changed(tiny_recipe, "samples = 8",
                       "title = \"Crates: \\\"and\\\" mines\"\nlicence = \"CC-BY-4.0\"\n"
                       "creator = \"A. Maker\"\nsamples = 8"));
  const std::string card = read_text(folder / "set/README.md");
  REQUIRE(card.starts_with("---\n"));
  const std::string yaml = card.substr(4, card.find("\n---\n") - 3);
  CHECK(yaml.find("pretty_name: \"Crates: \\\"and\\\" mines\"\n") != std::string::npos);
  CHECK(yaml.find("license: \"cc-by-4.0\"\n") != std::string::npos);
  CHECK(yaml.find("- config_name: slant_tile\n") != std::string::npos);
  CHECK(card.find("![pictures/000000_left-right.png](pictures/000000_left-right.png)") !=
        std::string::npos);
  CHECK(read_text(folder / "set/pictures/000000_left-right.png") ==
        read_text(folder / "set/samples/000000/left-right.png"));
  // datasets' folder_based_builder.py: every picture that a split's patterns find has one row,
  // whose file_name is its path from the folder of metadata.jsonl.
  std::istringstream lines(yaml);
  std::size_t pictures = 0, boxes = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.find("path: ") == std::string::npos) continue;
    REQUIRE(line.ends_with("/*"));
    const fs::path split =
        folder / "set" /
        line.substr(line.find("path: ") + 6, line.size() - line.find("path: ") - 8);
    CAPTURE(split);
    std::set<std::string> named, found;
    std::istringstream rows(read_text(split / "metadata.jsonl"));
    for (std::string text; std::getline(rows, text);) {
      const Json row = Json::parse(text);
      CHECK(named.insert(row.at("file_name").get<std::string>()).second);
      const Json& objects = row.at("objects");
      CHECK(objects.at("bbox").size() == objects.at("categories").size());
      CHECK(objects.at("bbox").size() == objects.at("names").size());
      boxes += objects.at("bbox").size();
      CHECK(row.at("seen_from").at("altitude_m").get<double>() > 0.0);
    }
    for (const auto& entry : fs::directory_iterator(split))
      if (entry.path().filename() != "metadata.jsonl") {
        found.insert(entry.path().filename().string());
        CHECK(read_text(entry.path()).starts_with("\x89PNG"));
      }
    CHECK(named == found);
    CHECK(found.size() > 0);
    pictures += found.size();
  }
  CHECK(boxes > 0);
  std::size_t all = 0;
  const Json merged =
      Json::parse(run_program(folder.path(), {"merge", "set", "--json", "--quiet"}).out);
  for (const auto& [group, count] : merged.at("images").items()) all += count.get<std::size_t>();
  CHECK(pictures == all);

  const Json croissant = Json::parse(read_text(folder / "set/croissant.json"));
  CHECK(croissant.at("@type") == "sc:Dataset");
  CHECK(croissant.at("conformsTo") == "http://mlcommons.org/croissant/1.0");
  CHECK(croissant.at("license") == "https://spdx.org/licenses/CC-BY-4.0");
  CHECK_FALSE(croissant.contains("url"));
  std::set<std::string> ids;
  for (const Json& part : croissant.at("distribution")) {
    const auto id = part.at("@id").get<std::string>();
    CAPTURE(id);
    CHECK(ids.insert(id).second);
    if (part.at("@type") != "cr:FileObject") continue;
    const std::string text = read_text(folder / "set" / part.at("contentUrl").get<std::string>());
    CHECK(part.at("contentSize") == std::to_string(text.size()) + " B");
    write_text(folder / "hashed", text);
    REQUIRE(std::system(("sha256sum '" + (folder / "hashed").string() + "' > '" +
                         (folder / "sum").string() + "'")
                            .c_str()) == 0);
    CHECK(read_text(folder / "sum").starts_with(part.at("sha256").get<std::string>()));
  }
  for (const Json& records : croissant.at("recordSet")) {
    CHECK(ids.insert(records.at("@id").get<std::string>()).second);
    for (const Json& field : records.at("field")) {
      CHECK(ids.insert(field.at("@id").get<std::string>()).second);
      if (field.contains("source"))
        CHECK(ids.contains(field.at("source").at("fileSet").at("@id").get<std::string>()));
    }
  }
}

TEST_CASE("the splits of each of the Hub's configurations have columns of the same types") {
  const TemporaryFolder folder;
  // The samples of the test set have no object.
  made(folder,
       changed(changed(tiny_recipe, "train = 2\nval = 1\ntest = 1\n",
                       "train = 1\nval = 0\nby = \"draw.kind\"\nheld_out_test = [\"none\"]\n"
                       "[draw]\nkind = { choice = [\"some\", \"none\"], stratified = true }\n"),
               "[[objects]]\n",
               "[[objects]]\npresent = { by = \"draw.kind\", table = { some = true, none = "
               "false } }\n"));
  std::istringstream card(read_text(folder / "set/README.md"));
  std::map<std::string, std::map<std::string, Json>> types;  // by configuration and split
  std::string config, split;
  for (std::string line;
       std::getline(card, line) && line != "# A dataset of simulated sidescan sonar";) {
    const auto rest = [&](const std::string& begin, std::string& value) {
      if (line.starts_with(begin)) value = line.substr(begin.size());
      return line.starts_with(begin);
    };
    std::string path;
    if (rest("- config_name: ", config) || rest("  - split: ", split)) continue;
    if (!rest("    path: ", path)) continue;
    REQUIRE(path.ends_with("/*"));
    std::istringstream rows(
        read_text(folder / "set" / path.substr(0, path.size() - 1) / "metadata.jsonl"));
    Json type;
    for (std::string row; std::getline(rows, row);)
      type = common_type(type, column_type(Json::parse(row)));
    types[config][split] = type;
  }
  REQUIRE(types.contains("slant_line"));
  CHECK(types["slant_line"].contains("train"));
  CHECK(types["slant_line_without_targets"].contains("test"));
  for (const auto& [name, by_split] : types) {
    CAPTURE(name);
    for (const auto& [one, type] : by_split) {
      CAPTURE(one);
      CHECK(type == by_split.begin()->second);
      CHECK((type.dump().find("null") == std::string::npos) != name.ends_with("_without_targets"));
    }
  }

  // There is no val set. Ultralytics cannot read an empty list.
  std::size_t lists = 0;
  for (const char* yolo : {"yolo", "yolo_segment"})
    for (const auto& entry : fs::directory_iterator(folder / "set" / yolo)) {
      if (entry.path().extension() == ".txt") CHECK(fs::file_size(entry.path()) > 0);
      if (entry.path().extension() != ".yaml") continue;
      CAPTURE(entry.path());
      std::istringstream yaml(read_text(entry.path()));
      for (std::string line; std::getline(yaml, line) && line != "names:"; ++lists) {
        CHECK_FALSE(line.starts_with("val:"));
        CHECK(fs::exists(entry.path().parent_path() / line.substr(line.find(": ") + 2)));
      }
    }
  CHECK(lists > 0);
}

TEST_CASE("chips that are too small for their targets are counted") {
  const TemporaryFolder folder;
  const std::string recipe = changed(tiny_recipe, "size_px = 9", "size_px = 2");
  const std::string warned = made(folder, recipe);
  std::size_t chips = 0, without = 0;
  for (const auto& file : fs::recursive_directory_iterator(folder / "set/samples")) {
    if (file.path().parent_path().filename() != "chips" || file.path().extension() != ".json")
      continue;
    const Json image = Json::parse(read_text(file.path()));
    if (image.at("kind") != "chip") {
      CHECK(image.at("of_instance").is_null());
      continue;
    }
    ++chips;
    bool labelled = false;
    for (const Json& target : image.at("targets"))
      labelled |= target.at("instance") == image.at("of_instance") &&
                  target.at("shown_fraction").get<double>() >= 0.25;
    without += !labelled;
  }
  CHECK(without > 0);
  CHECK(warned.find(fmt::format("{} of {} chips about a target have no label of it", without,
                                chips)) != std::string::npos);
  const Json merged =
      Json::parse(run_program(folder.path(), {"merge", "set", "--json", "--quiet"}).out);
  CHECK(merged.at("chips_without_target") == without);
  const Outcome rehearsed =
      run_program(folder.path(), {"generate", "recipe.toml", "-o", "none", "--dry-run"});
  CHECK(Json::parse(rehearsed.out).at("chips_without_target") > 0);
  CHECK(rehearsed.err.find("chips about objects will show less of them") != std::string::npos);
}

TEST_CASE("shadows can be a class, with one number in masks, COCO, YOLO and layers") {
  const TemporaryFolder folder;
  made(folder, changed(tiny_recipe, "renders = 2", "renders = 1\nshadow_class = true"));
  const Json dataset = Json::parse(read_text(folder / "set/dataset.json"));
  CHECK(dataset.at("classes") == Json{"crate", "mine", "shadow", "seabed"});
  const int number = 3;
  CHECK(dataset.at("shadow_class") == number);
  std::size_t shadows = 0;
  for (const char* split : {"train", "val", "test"})
    for (const char* group : {"slant_line", "slant_tile", "ground_line"}) {
      const std::string name = std::string(group) + "_" + split;
      const Json coco = Json::parse(read_text(folder / "set/coco" / (name + ".json")));
      CHECK(coco.at("categories").at(number - 1).at("name") == "shadow");
      const auto listed =
          load_yolo(folder / "set/yolo_segment" / (std::string(group) + ".yaml"), split);
      for (const Json& image : coco.at("images")) {
        const fs::path picture = folder / "set" / image.at("file_name").get<std::string>();
        CAPTURE(picture);
        const std::vector<std::uint16_t> classes =
            mask(folder / "set" / image.at("masks").at("class").get<std::string>(), false);
        std::vector<bool> annotated(classes.size());
        int rows = 0;
        for (const Json& annotation : coco.at("annotations")) {
          if (annotation.at("image_id") != image.at("id") || annotation.at("category_id") != number)
            continue;
          ++rows;
          const std::vector<bool> shadow =
              pixels_of(annotation.at("segmentation"), image.at("width"), image.at("height"));
          for (std::size_t i = 0; i < shadow.size(); ++i) annotated[i] = annotated[i] || shadow[i];
          CHECK(annotation.at("area").get<std::ptrdiff_t>() == std::ranges::count(shadow, true));
        }
        for (std::size_t i = 0; i < classes.size(); ++i)
          if ((classes[i] == number) != annotated[i]) FAIL("pixel " << i);
        for (const Labelled& one : listed)
          if (fs::equivalent(one.picture, picture)) {
            for (const BoxRow& row : label_rows(one.label)) rows -= row.first == number - 1;
            CHECK(rows == 0);
          }
        shadows += std::ranges::count(annotated, true) > 0;
      }
    }
  CHECK(shadows > 4);
  const auto png = read_text(folder / "set/samples/000000/left-right.class.png");
  CHECK(png.find(R"(["none","crate","mine","shadow","seabed"])") != std::string::npos);
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
                   "train = 1\nval = 1e-9\nby = \"objects.0.shape\"\nheld_out_test = [\"box\"]\n"),
           "held");
  CHECK(held.find("no picture of the split train shows the class crate:") != std::string::npos);
  CHECK(held.find("no picture of the split test shows the class mine:") != std::string::npos);
  CHECK(held.find("the split val is empty") != std::string::npos);
  CHECK(held.find("share a seabed") == std::string::npos);
  // A split without a share is meant to be empty.
  const std::string none = made(folder, changed(tiny_recipe, "test = 1\n", "test = 0\n"), "none");
  CHECK(none.find("the split test") == std::string::npos);

  const std::string shared =
      made(folder, changed(tiny_recipe, "[seafloor]\n", "[seafloor]\nseed = 7\n"), "shared");
  CHECK(shared.find("the splits test, train, val share a seabed, because the recipe sets "
                    "seafloor.seed = 7: remove it") != std::string::npos);
  const Json json =
      Json::parse(run_program(folder.path(), {"merge", "shared", "--json", "--quiet"}).out);
  REQUIRE(json.at("warnings").size() >= 1);
}

TEST_CASE("merge warns of labels of a few pixels, which dataset.least_px leaves out everywhere") {
  const TemporaryFolder folder;
  const std::string recipe = changed(tiny_recipe, "shape = { choice = [\"box\", \"cylinder\"] }",
                                     "shape = { choice = [\"box\", \"cylinder\"] }\nscale = 0.15");
  const std::string small = made(folder, recipe, "small");
  CHECK(small.find(" labels of objects cover fewer than 4 pixels: to leave such objects out of all "
                   "labels and masks, set dataset.least_px = 4") != std::string::npos);
  const std::string large =
      made(folder, changed(recipe, "samples = 8", "samples = 8\nleast_px = 1000000"), "large");
  CHECK(large.find("fewer than 4 pixels") == std::string::npos);
  const Json coco = Json::parse(read_text(folder / "large" / "coco" / "slant_line_train.json"));
  CHECK(coco.at("annotations").empty());
  for (const auto& file : fs::recursive_directory_iterator(folder / "large" / "samples"))
    if (file.path().extension() == ".txt") CHECK(read_text(file.path()).empty());
}

TEST_CASE("dataset.tiles.least_bed leaves out tiles of water") {
  const TemporaryFolder folder;
  const auto bed_shares = [&](const std::string& least) {
    const std::string set = "set" + least;
    made(folder, changed(tiny_recipe, "width_px = 64", "width_px = 20\nleast_bed = " + least), set);
    std::vector<double> shares;
    for (const auto& file : fs::recursive_directory_iterator(folder / set / "samples"))
      if (file.path().parent_path().filename() == "tiles" &&
          file.path().string().ends_with(".region.png")) {
        double bed = 0.0;
        const std::vector<std::uint16_t> regions = mask(file.path(), false);
        for (const std::uint16_t region : regions) bed += region >= 2;  // seabed, object, shadow
        shares.push_back(bed / static_cast<double>(regions.size()));
      }
    return shares;
  };
  std::vector<double> all = bed_shares("0");
  const std::vector<double> some = bed_shares("0.6");
  const auto left_out = std::erase_if(all, [](double share) { return share < 0.6; });
  CHECK(left_out > 0);
  CHECK(some.size() == all.size());
  CHECK(std::ranges::min(some) >= 0.6);
}

TEST_CASE("the documented loader for PyTorch reads every picture, mask and box") {
  const TemporaryFolder folder;
  made(folder, tiny_recipe);
  std::ifstream page(source_folder() / "scenes/datasets.md");
  std::string code;
  bool inside = false;
  for (std::string line; std::getline(page, line);) {
    if (line == "```") inside = false;
    if (inside) code += line + "\n";
    if (line == "```python") inside = true;
  }
  REQUIRE(code.find("class Sidescan(") != std::string::npos);
  write_text(folder / "loader.py", code);
  // Without PyTorch, what the loader uses of it.
  fs::create_directory(folder / "stub");
  write_text(folder / "stub/torch.py", R"py(
from types import SimpleNamespace
utils = SimpleNamespace(data=SimpleNamespace(Dataset=object))
from_numpy = lambda array: array
)py");
  write_text(folder / "test.py", R"py(
import sys
try:
    import numpy, PIL
except ImportError:
    sys.exit(77)
try:
    import torch
except ImportError:
    sys.path.append("stub")
from loader import Sidescan
boxes = 0
for kind in ("slant_line", "slant_tile", "slant_chip", "ground_line"):
    for split in ("train", "val", "test"):
        data = Sidescan("set", kind, split)
        assert len(data) > 0
        for i in range(len(data)):
            image, target = data[i]
            height, width = target["classes"].shape
            assert tuple(image.shape) == (1, height, width)
            assert 0 <= image.min() and 0 < image.max() <= 1
            assert len(target["boxes"]) == len(target["labels"])
            for (x0, y0, x1, y1), label in zip(target["boxes"], target["labels"]):
                part = target["classes"][int(y0):int(y1), int(x0):int(x1)]
                assert (part == label).any() and part.shape == (y1 - y0, x1 - x0)
                boxes += 1
assert boxes > 16
)py");
  const int code_of_test = std::system(
      ("cd '" + folder.path().string() + "' && /usr/bin/python3 test.py 2> log").c_str());
  INFO(read_text(folder / "log"));
  if (code_of_test == 77 << 8)
    WARN("skipped: no numpy or PIL here");
  else
    CHECK(code_of_test == 0);
}
