#include <ensonify/engine/dataset/picture_index-inl.h>

#include <limits>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/engine/base/json_text.h>
#include <ensonify/engine/base/untrusted.h>
#include <ensonify/engine/dataset/yolo_segments.h>

namespace ensonify::engine {
namespace {

using Json = nlohmann::ordered_json;

/// The loops (loops_of()) of an outline in a picture with these columns and rows.
std::vector<std::vector<Corner>> loops_of_outline(const Json& outline, std::size_t columns,
                                                  std::size_t rows) {
  if (outline.contains("rle")) {
    const auto runs = whole_numbers(outline.at("rle").at("counts")).get<std::vector<std::size_t>>();
    std::size_t left = columns * rows;
    for (const std::size_t run : runs) {
      if (run > left) throw std::runtime_error("an outline has more pixels than its picture");
      left -= run;
    }
    return loops_of(runs, rows);
  }
  std::vector<std::vector<Corner>> loops;
  for (const Json& polygon :
       whole_numbers(outline.at("polygons"), std::numeric_limits<int>::max())) {
    if (polygon.size() < 2) throw std::runtime_error("an outline has a polygon without corners");
    std::vector<Corner>& loop = loops.emplace_back();
    for (std::size_t i = 0; i + 1 < polygon.size(); i += 2)
      loop.push_back({polygon[i].get<int>(), polygon[i + 1].get<int>()});
  }
  return loops;
}

/// A row of YOLO's segmentation format.
std::string segment(std::size_t category, const Json& outline, const Json& image) {
  const auto columns = whole_numbers(image.at("width")).get<std::size_t>(),
             rows = whole_numbers(image.at("height")).get<std::size_t>();
  return yolo_segment(category - 1, loops_of_outline(outline, columns, rows), columns, rows);
}

/// COCO's segmentation: the polygons, or the run lengths if the outline has holes.
const Json& segmentation(const Json& outline) {
  return outline.contains("rle") ? outline.at("rle") : outline.at("polygons");
}

}  // namespace

void PictureIndex::add(std::size_t sample, const std::string& name, const PicturePaths& paths,
                       const Json& image, const IndexClasses& classes) {
  images_.push_back({{"id", images_.size() + 1},
                     {"file_name", paths.picture},
                     {"width", image.at("width")},
                     {"height", image.at("height")},
                     {"sample", sample},
                     {"sonar", image.at("sonar")},
                     {"pixel_across_m", image.at("pixel_across_m")},
                     {"pixel_along_m", image.at("pixel_along_m")},
                     {"masks", paths.masks},
                     {"seen_from", image.at("seen_from")}});
  yolo_list_ += fmt::format("./images/{}/{}\n", SampleFolders::name_of(sample), name);
  IndexedPicture picture{sample, name, ""};
  const std::size_t first_annotation = annotations_.size();
  for (const Json& target : image.at("targets")) {
    if (target.at("ignored").get<bool>()) continue;
    if (!target.at("body").is_null()) {
      add_target(target);
      picture.segments +=
          segment(whole_numbers(target.at("category_id")), target.at("body"), image);
    }
    if (classes.shadow_class > 0 && !target.at("shadow").is_null()) {
      add_shadow(target, classes.shadow_class);
      picture.segments += segment(classes.shadow_class, target.at("shadow"), image);
    }
  }
  hub_metadata_ += hub_row(image, picture, first_annotation, classes);
  pictures_.push_back(std::move(picture));
}

/// Adds an annotation of the picture that was added last.
Json& PictureIndex::add_outline(std::size_t category, const Json& outline) {
  return annotations_.emplace_back(Json{{"id", annotations_.size() + 1},
                                        {"image_id", images_.size()},
                                        {"category_id", category},
                                        {"bbox", outline.at("box")},
                                        {"area", outline.at("area_px")},
                                        {"segmentation", segmentation(outline)},
                                        {"iscrowd", 0}});
}

void PictureIndex::add_target(const Json& target) {
  Json& annotation = add_outline(whole_numbers(target.at("category_id")), target.at("body"));
  for (const auto& [key, value] : target.items())
    if (key != "body" && key != "shadow" && key != "category_id" && key != "ignored")
      annotation[key] = value;
  const Json& shadow = target.at("shadow");
  annotation["shadow_bbox"] = shadow.is_null() ? Json(nullptr) : shadow.at("box");
  annotation["shadow_area"] = shadow.is_null() ? Json(0) : shadow.at("area_px");
  annotation["shadow_segmentation"] = shadow.is_null() ? Json::array() : segmentation(shadow);
}

/// Adds a target's shadow as a separate annotation.
void PictureIndex::add_shadow(const Json& target, std::size_t shadow_class) {
  Json& annotation = add_outline(shadow_class, target.at("shadow"));
  annotation["instance"] = target.at("instance");
  annotation["shadow_of"] = target.at("class");
}

/// A line of the Hub's metadata.jsonl.
std::string PictureIndex::hub_row(const Json& image, const IndexedPicture& picture,
                                  std::size_t first_annotation, const IndexClasses& classes) const {
  Json boxes = Json::array(), categories = Json::array(), names = Json::array();
  for (std::size_t i = first_annotation; i < annotations_.size(); ++i) {
    const Json& category = annotations_[i].at("category_id");
    boxes.push_back(annotations_[i].at("bbox"));
    categories.push_back(category);
    names.push_back(classes.names.at(whole_numbers(category).get<std::size_t>() - 1));
  }
  const Json row = {{"file_name", SampleFolders::name_in_tar(picture.sample, picture.name)},
                    {"sample", picture.sample},
                    {"kind", image.at("kind")},
                    {"sonar", image.at("sonar")},
                    {"pixel_across_m", image.at("pixel_across_m")},
                    {"pixel_along_m", image.at("pixel_along_m")},
                    {"seen_from", image.at("seen_from")},
                    {"objects", {{"bbox", boxes}, {"categories", categories}, {"names", names}}}};
  return json_text(row) + "\n";
}

}  // namespace ensonify::engine
