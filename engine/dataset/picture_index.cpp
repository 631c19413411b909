#include <ensonify/engine/dataset/picture_index-inl.h>

#include <limits>
#include <set>
#include <stdexcept>
#include <system_error>

#include <fmt/format.h>

#include <ensonify/engine/base/json_text.h>
#include <ensonify/engine/base/untrusted.h>
#include <ensonify/engine/dataset/yolo_segments.h>
#include <ensonify/engine/scene/keys/dataset_options.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;
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

/// A name without its extension.
std::string stem_of(const std::string& picture) {
  return picture.substr(0, picture.size() - std::string(".png").size());
}

/// Calls files.step() and then f(group, split, picture), for each picture.
template <class F>
void for_each_picture(const PictureIndexes& indexes, const MergedFiles& files,
                      std::string_view stage, const F& f) {
  std::size_t done = 0, all = 0;
  for (const auto& [of, index] : indexes) all += index.pictures().size();
  for (const auto& [of, index] : indexes)
    for (const IndexedPicture& picture : index.pictures()) {
      files.step(stage, done++, all);
      f(of.first, of.second, picture);
    }
}

/// Makes links to samples/ in one of YOLO's folders. If the file system has no links, adds a
/// warning and returns false.
bool link_samples(const fs::path& folder, const std::vector<std::string>& links,
                  std::vector<std::string>& warnings) {
  fs::create_directories(folder);
  for (const std::string& name : links) {
    const fs::path link = folder / name;
    if (fs::exists(link)) continue;
    std::error_code error;
    fs::create_directory_symlink("../samples", link, error);
    if (!error || fs::exists(link)) continue;
    warnings.push_back(fmt::format(
        "{}: {}: YOLO's lists need links and are left out; merge on a file system with links",
        link.string(), error.message()));
    return false;
  }
  return true;
}

/// Writes the lists of one of YOLO's folders.
void write_lists(const std::string& folder, const PictureIndexes& indexes,
                 const std::vector<std::string>& classes, MergedFiles& files) {
  std::string names;
  for (std::size_t i = 0; i < classes.size(); ++i)
    names += fmt::format("  {}: {}\n", i, nlohmann::ordered_json(classes[i]).dump());
  std::set<std::string> groups;
  for (const auto& [of, index] : indexes) groups.insert(of.first);
  for (const std::string& group : groups) {
    std::string lists;
    for (const char* split : split_names) {
      const auto index = indexes.find({group, split});
      if (index == indexes.end() || index->second.pictures().empty()) continue;
      const std::string list = fmt::format("{}_{}.txt", group, split);
      files.write(fmt::format("{}/{}", folder, list), index->second.yolo_list());
      lists += fmt::format("{}: {}\n", split, list);
    }
    // Without a `path`, YOLO looks for the lists next to this file, in any working directory.
    files.write(fmt::format("{}/{}.yaml", folder, group),
                fmt::format("{}names:\n{}", lists, names));
  }
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
  if (image.contains("frame")) {
    Json& added = images_.back();
    added["video_id"] = number_of_video(sample, name, image);
    added["frame_id"] = image.at("frame");
  }
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

/// The number of the video that a frame belongs to. A video has the frames of one sample, sonar and
/// display.
std::size_t PictureIndex::number_of_video(std::size_t sample, const std::string& name,
                                          const Json& image) {
  const Json& pictures = image.at("pictures");
  const auto display = std::ranges::find(pictures, Json(name)) - pictures.begin();
  const std::string video =
      fmt::format("{}/{}{}", SampleFolders::name_of(sample), image.at("sonar").get<std::string>(),
                  display > 0 ? fmt::format(".r{}", display) : "");
  const auto [at, is_new] = video_numbers_.emplace(video, videos_.size() + 1);
  if (is_new) videos_.push_back({{"id", at->second}, {"name", video}});
  return at->second;
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
  if (const Json& image = images_.back(); image.contains("video_id")) {
    const auto video = image.at("video_id").get<std::size_t>();
    const auto instance = whole_numbers(target.at("instance")).get<std::size_t>();
    annotation["video_id"] = video;
    annotation["instance_id"] =
        tracks_.emplace(std::pair(video, instance), tracks_.size() + 1).first->second;
  }
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

// Ultralytics finds a list's ./images/ next to the list, and an image's labels by replacing the
// last images/ with labels/.
void write_yolo(const PictureIndexes& indexes, const std::vector<std::string>& classes,
                MergedFiles& files, std::vector<std::string>& warnings) {
  if (link_samples(files.folder() / "yolo", {"images", "labels"}, warnings))
    write_lists("yolo", indexes, classes, files);
  if (!link_samples(files.folder() / "yolo_segment", {"images"}, warnings)) return;
  write_lists("yolo_segment", indexes, classes, files);
  files.write_folder("yolo_segment/labels", [&](const fs::path& place) {
    for_each_picture(indexes, files, "pictures for YOLO", [&](auto&, auto&, const auto& picture) {
      if (!picture.segments.empty())  // without a file, there is nothing in the picture
        MergedFiles::stage(
            place / SampleFolders::name_of(picture.sample) / (stem_of(picture.name) + ".txt"),
            picture.segments);
    });
  });
}

HubGroups write_hub(const PictureIndexes& indexes, const CheckedSamples& samples,
                    MergedFiles& files) {
  HubGroups hub;
  files.write_folder("hub", [&](const fs::path& place) {
    for (const auto& [of, index] : indexes) {
      if (index.pictures().empty()) continue;
      const fs::path name = fs::path("hub") / of.first / of.second;
      const fs::path folder = place / of.first / of.second;
      hub[of.first][of.second] = !index.annotations().empty();
      MergedFiles::stage(folder / "metadata.jsonl", index.hub_metadata());
      files.add_to_index((name / "metadata.jsonl").string(), index.hub_metadata());
    }
    for_each_picture(
        indexes, files, "pictures for the Hub",
        [&](const std::string& group, const std::string& split, const auto& picture) {
          const fs::path file =
              place / group / split / SampleFolders::name_in_tar(picture.sample, picture.name);
          std::error_code error;
          fs::create_hard_link(samples.file(picture.sample, picture.name), file, error);
          if (error) MergedFiles::stage(file, samples.content_of(picture.sample, picture.name));
        });
  });
  return hub;
}

}  // namespace ensonify::engine
