#include <ensonify/engine/dataset/merge.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <optional>
#include <set>
#include <span>
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/dataset/card.h>
#include <ensonify/engine/dataset/sample_folder.h>
#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/output/tar.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::array split_names{"train", "val", "test"};

/// A sample's JSON files: sample.json and those of its images.
struct SampleRecord {
  Json sample;
  std::map<std::string, Json> images;
};

std::string text_of_file(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// A file's size and hash, and the text of a JSON file.
struct FileSeen {
  std::pair<std::uint64_t, std::string> size_and_hash;
  std::string text;

  FileSeen(const std::string& name, std::span<const std::byte> content)
      : size_and_hash(content.size(), xxh128(content)) {
    if (name.ends_with(".json"))
      text.assign(reinterpret_cast<const char*>(content.data()), content.size());
  }
};

/// The COCO file and the YOLO lists of one geometry and kind.
struct Index {
  Json images = Json::array(), annotations = Json::array();
  std::string yolo;
};

class Merge {
 public:
  Merge(const fs::path& folder, const std::function<bool(std::size_t, std::size_t)>& progress)
      : folder_(folder), progress_(progress) {
    if (!fs::exists(folder / "dataset.json"))
      throw SceneError(fmt::format(
          "{}: {}; expected a folder made by `ensonify generate`", folder.string(),
          fs::is_directory(folder) ? "there is no dataset.json in it" : "there is no such folder"));
    try {
      dataset_ = Json::parse(text_of_file(folder / "dataset.json"));
      samples_ = dataset_.at("samples").get<std::size_t>();
      per_tar_ = dataset_.at("samples_per_tar").get<std::size_t>();
      targets_ = dataset_.at("target_classes").get<std::size_t>();
      card_.title = dataset_.at("title").get<std::string>();
      card_.recipe = dataset_.at("recipe").get<std::string>();
      card_.version = dataset_.at("version").get<std::string>();
      card_.samples = samples_;
      card_.seafloors = dataset_.at("seafloors").get<std::size_t>();
      card_.classes = dataset_.at("classes").get<std::vector<std::string>>();
      card_.sediments = dataset_.at("sediments").get<std::vector<std::string>>();
      card_.licences = dataset_.at("licences").get<std::vector<std::string>>();
      for (const Json& asset : dataset_.at("assets"))
        card_.assets.push_back(asset.at("name").get<std::string>());
    } catch (const Json::exception& error) {
      throw SceneError(fmt::format(
          "{}: not a dataset's description; expected a folder made by `ensonify generate` ({})",
          (folder / "dataset.json").string(), error.what()));
    }
    folders_.emplace(folder, per_tar_);
  }

  MergeReport report() {
    for (std::size_t i = 0; i < samples_; ++i) {
      if (progress_ && !progress_(i, samples_))
        throw Stopped("stopped on request; nothing was written");
      if (!folders_->finished(i)) {
        report_.missing.push_back(i);
      } else if (std::optional<SampleRecord> record = read(i)) {
        ++report_.samples;
        try {
          add(i, *record);
        } catch (const Json::exception& error) {
          report_.damaged.push_back(fmt::format("{}: {}", place(i).string(), error.what()));
        }
      }
    }
    if (report_.missing.empty() && report_.damaged.empty()) {
      write();
      warn_of_splits();
    }
    return std::move(report_);
  }

 private:
  bool in_tar(std::size_t sample) const {
    return per_tar_ > 0 && fs::exists(folders_->tar(sample / per_tar_));
  }
  fs::path place(std::size_t sample) const {
    return in_tar(sample) ? folders_->tar(sample / per_tar_) : folders_->sample(sample);
  }

  /// Reads and checks every file of a sample. None if one is damaged, which is added to the report.
  std::optional<SampleRecord> read(std::size_t number) {
    const auto damaged = [&](const std::string& file, std::string_view what) {
      report_.damaged.push_back(fmt::format("{}: {}", (place(number) / file).string(), what));
      return std::nullopt;
    };
    const bool tar = in_tar(number);
    const auto name_of = [&](const std::string& file) {
      return tar ? SampleFolders::name_in_tar(number, file) : file;
    };
    try {
      if (tar) {
        // A tar is read once for all its samples, which follow each other.
        if (tar_of_ != number / per_tar_) read_whole_tar(number / per_tar_);
      } else {
        seen_.clear();
        tar_of_ = none;
        for (const fs::directory_entry& entry : fs::recursive_directory_iterator(place(number)))
          if (entry.is_regular_file()) {
            const std::string text = text_of_file(entry.path());
            see(entry.path().lexically_relative(place(number)).string(),
                std::as_bytes(std::span(text)));
          }
      }
      SampleRecord record;
      const auto own = seen_.find(name_of("sample.json"));
      if (own == seen_.end()) return damaged("sample.json", "is missing");
      record.sample = Json::parse(own->second.text);
      Json signed_part = record.sample;
      signed_part.erase("xxh128");
      if (record.sample.at("xxh128") != xxh128(signed_part.dump()))
        return damaged("sample.json", "its hash is not the one that it contains");
      for (const Json& file : record.sample.at("files")) {
        const auto name = file.at("name").get<std::string>();
        const auto there = seen_.find(name_of(name));
        if (there == seen_.end()) return damaged(name, "is missing");
        if (there->second.size_and_hash != std::pair(file.at("size_bytes").get<std::uint64_t>(),
                                                     file.at("xxh128").get<std::string>()))
          return damaged(name, "its bytes have changed since it was written");
        if (name.ends_with(".json") && name != "manifest.json")
          if (Json image = Json::parse(there->second.text); image.contains("pictures"))
            record.images[name] = std::move(image);
      }
      return record;
    } catch (const std::exception& error) {
      return damaged("", error.what());
    }
  }

  void read_whole_tar(std::size_t number) {
    seen_.clear();
    tar_of_ = number;
    read_tar(folders_->tar(number),
             [&](const std::string& name, std::vector<std::byte> content) { see(name, content); });
  }
  void see(const std::string& name, std::span<const std::byte> content) {
    seen_.emplace(name, FileSeen(name, content));
  }

  void add(std::size_t number, const SampleRecord& record) {
    const auto split = record.sample.at("split").get<std::string>();
    manifest_ += record.sample.dump() + "\n";
    splits_[split] += fmt::format("{:06}\n", number);
    ++report_.samples_by_split[split];
    splits_of_seabed_[record.sample.at("seafloor_seed").get<std::uint64_t>()].insert(split);
    for (const auto& [key, value] : record.sample.at("drawn").items())
      add_to(card_.drawn[key], value);
    for (const auto& [name, image] : record.images) add_image(number, image, split);
  }

  static void add_to(Realised& realised, const Json& value) {
    if (value.is_number())
      realised.add(value.get<double>());
    else if (value.is_null())
      realised.add(std::string("(left out)"));
    else
      realised.add(value.is_string() ? value.get<std::string>() : value.dump());
  }

  void add_image(std::size_t number, const Json& image, const std::string& split) {
    auto kind = image.at("kind").get<std::string>();
    const auto geometry = image.at("geometry").get<std::string>();
    if (kind == "line" && geometry == "slant") add_line(image, split);
    if (kind == "background") kind = "chip";
    const std::string group = fmt::format("{}_{}", geometry, kind);
    groups_.insert(group);
    Index& index = indexes_[{group, split}];
    for (const Json& name : image.at("classes"))
      classes_shown_[split].insert(name.get<std::string>());
    for (const Json& picture : image.at("pictures")) {
      const auto name = picture.get<std::string>();
      ++report_.images[fmt::format("{}, {}", group, split)];
      const std::string file =
          in_tar(number)
              ? fmt::format("tars/{}/{}", folders_->tar(number / per_tar_).filename().string(),
                            SampleFolders::name_in_tar(number, name))
              : fmt::format("samples/{:06}/{}", number, name);
      const std::size_t id = index.images.size() + 1;
      index.images.push_back({{"id", id},
                              {"file_name", file},
                              {"width", image.at("width")},
                              {"height", image.at("height")},
                              {"sample", number},
                              {"sonar", image.at("sonar")},
                              {"pixel_across_m", image.at("pixel_across_m")},
                              {"pixel_along_m", image.at("pixel_along_m")}});
      index.yolo += fmt::format("./images/{:06}/{}\n", number, name);
      for (const Json& target : image.at("targets"))
        if (!target.at("ignored").get<bool>() && !target.at("body").is_null())
          add_annotation(index, id, target);
    }
  }

  /// The polygons, or the run lengths if there are holes.
  static const Json& segmentation(const Json& outline) {
    return outline.contains("rle") ? outline.at("rle") : outline.at("polygons");
  }

  static void add_annotation(Index& index, std::size_t image, const Json& target) {
    const Json& body = target.at("body");
    Json annotation = {{"id", index.annotations.size() + 1},
                       {"image_id", image},
                       {"category_id", target.at("category_id")},
                       {"bbox", body.at("box")},
                       {"area", body.at("area_px")},
                       {"segmentation", segmentation(body)},
                       {"iscrowd", 0}};
    for (const auto& [key, value] : target.items())
      if (key != "body" && key != "shadow" && key != "category_id" && key != "ignored")
        annotation[key] = value;
    const Json& shadow = target.at("shadow");
    annotation["shadow_bbox"] = shadow.is_null() ? Json(nullptr) : shadow.at("box");
    annotation["shadow_area"] = shadow.is_null() ? Json(0) : shadow.at("area_px");
    annotation["shadow_segmentation"] = shadow.is_null() ? Json::array() : segmentation(shadow);
    index.annotations.push_back(std::move(annotation));
  }

  void add_line(const Json& image, const std::string& split) {
    for (const Json& target : image.at("targets")) {
      ++card_.targets[target.at("class").get<std::string>()][split];
      for (const char* key : {"range_m", "aspect_deg", "buried", "visible_fraction", "contrast_db"})
        if (target.contains(key) && target.at(key).is_number())
          card_.measured[key].add(target.at(key).get<double>());
    }
  }

  void write(const std::string& name, const std::string& text) {
    refine::make_folder((folder_ / name).parent_path());
    refine::write_file(folder_ / name, text);
    report_.files.push_back(folder_ / name);
  }

  void write() {
    write("manifest.jsonl", manifest_);
    for (const char* split : split_names)
      write(fmt::format("splits/{}.txt", split), splits_[split]);
    Json categories = Json::array();
    std::string names;
    for (std::size_t i = 0; i < targets_; ++i) {
      categories.push_back(
          {{"id", i + 1}, {"name", card_.classes[i]}, {"supercategory", "object"}});
      names += fmt::format("  {}: {}\n", i, Json(card_.classes[i]).dump());
    }
    const bool yolo = per_tar_ == 0 && link_samples();
    for (const std::string& group : groups_) {
      for (const char* split : split_names) {
        const Index& index = indexes_[{group, split}];
        const Json coco = {{"info", {{"description", card_.title}, {"version", card_.version}}},
                           {"categories", categories},
                           {"images", index.images},
                           {"annotations", index.annotations}};
        write(fmt::format("coco/{}_{}.json", group, split),
              coco.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n");
        if (yolo) write(fmt::format("yolo/{}_{}.txt", group, split), index.yolo);
      }
      // Without a `path`, YOLO looks for the lists next to this file, in any working directory.
      if (yolo)
        write(fmt::format("yolo/{}.yaml", group),
              fmt::format("train: {0}_train.txt\nval: {0}_val.txt\ntest: {0}_test.txt\nnames:\n{1}",
                          group, names));
    }
    card_.samples_by_split = report_.samples_by_split;
    card_.images = report_.images;
    write("README.md", card_.markdown());
  }

  /// Makes the links yolo/images and yolo/labels to samples/: Ultralytics finds a list's ./images/
  /// next to the list, and an image's labels by replacing the last images/ with labels/. Returns
  /// false, with a warning, on a file system without links.
  bool link_samples() {
    fs::create_directories(folder_ / "yolo");
    for (const char* name : {"images", "labels"}) {
      const fs::path link = folder_ / "yolo" / name;
      if (fs::exists(link)) continue;
      std::error_code error;
      fs::create_directory_symlink("../samples", link, error);
      if (!error || fs::exists(link)) continue;
      report_.warnings.push_back(fmt::format(
          "{}: {}: YOLO's lists need links and are left out; merge on a file system with links",
          link.string(), error.message()));
      return false;
    }
    return true;
  }

  void warn_of_splits() {
    const std::vector<std::string>& classes = card_.classes;
    for (const std::string split : split_names) {
      if (!report_.samples_by_split.contains(split)) {
        report_.warnings.push_back(
            fmt::format("the split {} is empty: use more samples or seafloors, or other shares in "
                        "[dataset.split]",
                        split));
        continue;
      }
      std::vector<std::string> absent;
      for (const std::string& name : classes)
        if (!classes_shown_[split].contains(name)) absent.push_back(name);
      if (!absent.empty() && !groups_.empty())
        report_.warnings.push_back(
            fmt::format("no picture of the split {} shows the class{} {}: use more seafloors, or "
                        "split by another key",
                        split, absent.size() > 1 ? "es" : "", fmt::join(absent, ", ")));
    }
    for (const auto& [seed, splits] : splits_of_seabed_)
      if (splits.size() > 1)
        report_.warnings.push_back(
            fmt::format("the splits {} share a seabed, because the recipe sets seafloor.seed = {}: "
                        "remove it to give each seafloor its own seabed",
                        fmt::join(splits, ", "), seed));
  }

  fs::path folder_;
  const std::function<bool(std::size_t, std::size_t)>& progress_;
  Json dataset_;
  std::size_t samples_ = 0, per_tar_ = 0, targets_ = 0;
  std::optional<SampleFolders> folders_;
  MergeReport report_;
  Card card_;
  std::string manifest_;
  std::map<std::string, std::string> splits_;
  std::map<std::string, std::set<std::string>> classes_shown_;       // by split
  std::map<std::uint64_t, std::set<std::string>> splits_of_seabed_;  // by its seed
  std::set<std::string> groups_;
  std::map<std::pair<std::string, std::string>, Index> indexes_;
  static constexpr std::size_t none = ~std::size_t{0};
  std::size_t tar_of_ = none;
  std::map<std::string, FileSeen> seen_;  // by name, in a tar or in a sample's folder
};

}  // namespace

MergeReport merge(const fs::path& folder,
                  const std::function<bool(std::size_t, std::size_t)>& progress) {
  return Merge(folder, progress).report();
}

}  // namespace ensonify::engine
