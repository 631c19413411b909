#include <ensonify/engine/dataset/picture_index-inl.h>

#include <set>
#include <system_error>

#include <fmt/format.h>

#include <ensonify/engine/scene/keys/dataset_options.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;

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
