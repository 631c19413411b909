#include <ensonify/engine/dataset/merge.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/dataset/card.h>
#include <ensonify/engine/dataset/croissant.h>
#include <ensonify/engine/dataset/sample_folder.h>
#include <ensonify/engine/dataset/webdataset.h>
#include <ensonify/engine/dataset/yolo_segments.h>
#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/output/png.h>
#include <ensonify/engine/output/sha256.h>
#include <ensonify/engine/output/staging.h>
#include <ensonify/engine/output/tar.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/untrusted.h>
#include <ensonify/refine/atomic_file.h>
#include <ensonify/refine/read_file.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::array split_names{"train", "val", "test"};
constexpr std::size_t max_samples = 999999;  // as the recipe's key

/// A sample's JSON files: sample.json and those of its images.
struct SampleRecord {
  Json sample;
  std::map<std::string, Json> images;
};

std::string text_of_file(const fs::path& file) {
  return fs::exists(file) ? refine::read_file(file) : std::string();
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

/// A picture of a sample.
struct IndexedPicture {
  std::size_t sample = 0;
  std::string name;      ///< in the sample's folder
  std::string segments;  ///< its outlines for YOLO
};

/// The pictures of one geometry and kind, and what the files about them have.
struct Index {
  Json images = Json::array(), annotations = Json::array();
  std::string yolo, hub;
  std::vector<IndexedPicture> pictures;
};

Json json_of(const std::string& text) {
  require_shallow_json(text);
  return Json::parse(text);
}

/// Whether the key "xxh128" is the hash of the others.
bool fits_its_hash(Json json) {
  const std::string hash = json.at("xxh128").get<std::string>();
  json.erase("xxh128");
  return hash == xxh128(json.dump());
}

/// A text that becomes a part of a file's name.
std::string word_of(const Json& json) {
  auto word = json.get<std::string>();
  if (word.find('/') != word.npos)
    throw std::runtime_error(fmt::format("'{}' cannot be a part of a file's name", word));
  return word;
}

/// A name without its extension.
std::string stem_of(const std::string& picture) {
  return picture.substr(0, picture.size() - std::string(".png").size());
}

class Merge {
 public:
  Merge(const fs::path& folder, const std::function<bool(std::size_t, std::size_t)>& progress,
        const MergeOptions& options)
      : folder_(folder), progress_(progress), options_(options) {
    if (!fs::exists(folder / "dataset.json"))
      throw SceneError(fmt::format(
          "{}: {}; expected a folder made by `ensonify generate`", folder.string(),
          fs::is_directory(folder) ? "there is no dataset.json in it" : "there is no such folder"));
    try {
      const Json dataset = Json::parse(text_of_file(folder / "dataset.json"));
      // Those of other programs, and of versions before 0.3, have no hash.
      if (dataset.contains("xxh128") && !fits_its_hash(dataset))
        throw std::runtime_error("its content has changed since it was written");
      samples_ = whole_numbers(dataset.at("samples")).get<std::size_t>();
      per_tar_ = whole_numbers(dataset.at("samples_per_tar")).get<std::size_t>();
      targets_ = whole_numbers(dataset.at("target_classes")).get<std::size_t>();
      if (dataset.contains("shadow_class"))
        shadow_class_ = whole_numbers(dataset.at("shadow_class")).get<std::size_t>();
      card_.licence = dataset.value("licence", "");
      card_.creator = dataset.value("creator", "");
      card_.url = dataset.value("url", "");
      card_.published = dataset.value("published", "");
      card_.title = dataset.at("title").get<std::string>();
      card_.overrides = dataset.value("overrides", std::vector<std::string>{});
      card_.recipe = dataset.at("recipe").get<std::string>();
      card_.version = dataset.at("version").get<std::string>();
      card_.samples = samples_;
      card_.seafloors = whole_numbers(dataset.at("seafloors")).get<std::size_t>();
      card_.classes = dataset.at("classes").get<std::vector<std::string>>();
      card_.sediments = dataset.at("sediments").get<std::vector<std::string>>();
      card_.licences = dataset.at("licences").get<std::vector<std::string>>();
      for (const Json& asset : dataset.at("assets"))
        card_.assets.push_back(asset.at("name").get<std::string>());
      wanted_splits_ =
          dataset.value("splits", std::vector<std::string>(split_names.begin(), split_names.end()));
      if (samples_ > max_samples || targets_ > card_.classes.size() || shadow_class_ > targets_)
        throw std::out_of_range("too many samples, or numbers of classes that have no name");
    } catch (const std::exception& error) {
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
        } catch (const std::exception& error) {
          report_.damaged.push_back(fmt::format("{}: {}", place(i).string(), error.what()));
        }
      }
    }
    if (report_.missing.empty() && report_.damaged.empty()) {
      write();
      warn_of_splits();
      if (small_boxes_ > 0)
        report_.warnings.push_back(fmt::format(
            "{} of {} labels of objects cover fewer than {} pixels: to leave such objects out of "
            "all labels and masks, set dataset.least_px = {} in the recipe and generate again",
            small_boxes_, boxes_, small_px, small_px));
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
      record.sample = json_of(own->second.text);
      if (!fits_its_hash(record.sample))
        return damaged("sample.json", "its hash is not the one that it contains");
      for (const Json& file : record.sample.at("files")) {
        const auto name = file.at("name").get<std::string>();
        const auto there = seen_.find(name_of(name));
        if (there == seen_.end()) return damaged(name, "is missing");
        if (there->second.size_and_hash !=
            std::pair(whole_numbers(file.at("size_bytes")).get<std::uint64_t>(),
                      file.at("xxh128").get<std::string>()))
          return damaged(name, "its bytes have changed since it was written");
        if (name.ends_with(".json") && name != "manifest.json")
          if (Json image = json_of(there->second.text); image.contains("pictures"))
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
    const std::string split = word_of(record.sample.at("split"));
    manifest_ += record.sample.dump() + "\n";
    splits_[split] += fmt::format("{:06}\n", number);
    ++report_.samples_by_split[split];
    splits_of_seabed_[whole_numbers(record.sample.at("seafloor_seed")).get<std::uint64_t>()].insert(
        split);
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
    std::string kind = word_of(image.at("kind"));
    const std::string geometry = word_of(image.at("geometry"));
    if (kind == "line" && geometry == "slant") add_line(image, split);
    if (kind == "line" && geometry == "slant" && is_on_card(number))
      on_card_.push_back({number, image.at("pictures").at(0).get<std::string>(), ""});
    if (kind == "background" || kind == "hard_negative") kind = "chip";
    const std::string group = fmt::format("{}_{}", geometry, kind);
    groups_.insert(group);
    Index& index = indexes_[{group, split}];
    for (const Json& name : image.at("classes"))
      classes_shown_[split].insert(name.get<std::string>());
    // A target whose parts have classes of their own is not in the mask with its class.
    for (const Json& target : image.at("targets"))
      if (!target.at("ignored").get<bool>())
        classes_shown_[split].insert(target.at("class").get<std::string>());
    if (options_.webdataset) {
      const auto stem = image.at("image").get<std::string>();
      std::string key = fmt::format("{:06}-{}", number, stem);
      std::ranges::replace(key, '/', '-');
      records_[SampleFolders::name_in_tar(number, stem) + "."] = {key, group + "_" + split};
    }
    for (const Json& picture : image.at("pictures")) {
      const auto name = picture.get<std::string>();
      check_picture(number, name, image);
      ++report_.images[fmt::format("{}, {}", group, split)];
      add_picture(index, number, name, image);
    }
  }

  /// Throws if a picture is not one of its sample's files, or has not enough bytes for its pixels.
  void check_picture(std::size_t number, const std::string& name, const Json& image) const {
    const auto file = seen_.find(in_tar(number) ? SampleFolders::name_in_tar(number, name) : name);
    if (file == seen_.end() || !stays_inside(name))
      throw std::runtime_error(fmt::format("the picture '{}' is not a file of its sample", name));
    const double columns = image.at("width").get<double>(), rows = image.at("height").get<double>();
    const auto bytes = static_cast<double>(file->second.size_and_hash.first);
    if (!(columns >= 1.0 && rows >= 1.0 && columns * rows <= max_png_compression * bytes))
      throw std::runtime_error(
          fmt::format("the picture '{}' cannot have {} x {} pixels", name, columns, rows));
  }

  /// The path of a sample's file in the dataset's folder, also of one in a tar.
  std::string path_of(std::size_t number, const std::string& name) const {
    return in_tar(number)
               ? fmt::format("tars/{}/{}", folders_->tar(number / per_tar_).filename().string(),
                             SampleFolders::name_in_tar(number, name))
               : fmt::format("samples/{:06}/{}", number, name);
  }

  void add_picture(Index& index, std::size_t number, const std::string& name, const Json& image) {
    const std::size_t id = index.images.size() + 1;
    Json masks = Json::object();
    for (const char* kind : {"class", "sediment", "instance", "region"})
      masks[kind] =
          path_of(number, fmt::format("{}.{}.png", image.at("image").get<std::string>(), kind));
    index.images.push_back({{"id", id},
                            {"file_name", path_of(number, name)},
                            {"width", image.at("width")},
                            {"height", image.at("height")},
                            {"sample", number},
                            {"sonar", image.at("sonar")},
                            {"pixel_across_m", image.at("pixel_across_m")},
                            {"pixel_along_m", image.at("pixel_along_m")},
                            {"masks", masks},
                            {"seen_from", image.at("seen_from")}});
    index.yolo += fmt::format("./images/{:06}/{}\n", number, name);
    IndexedPicture picture{number, name, ""};
    const std::size_t first = index.annotations.size();
    for (const Json& target : image.at("targets")) {
      if (target.at("ignored").get<bool>()) continue;
      if (!target.at("body").is_null()) {
        if (target.contains("table")) {  // features of the bed are never ignored
          ++boxes_;
          small_boxes_ +=
              whole_numbers(target.at("body").at("area_px")).get<std::size_t>() < small_px;
        }
        add_annotation(index, id, target);
        picture.segments +=
            segment(whole_numbers(target.at("category_id")), target.at("body"), image);
      }
      if (shadow_class_ > 0 && !target.at("shadow").is_null()) {
        add_shadow(index, id, target);
        picture.segments += segment(shadow_class_, target.at("shadow"), image);
      }
    }
    index.hub += hub_row(image, picture, index.annotations, first);
    index.pictures.push_back(std::move(picture));
  }

  /// A row of YOLO's segmentation format.
  static std::string segment(std::size_t category, const Json& outline, const Json& image) {
    const auto columns = whole_numbers(image.at("width")).get<std::size_t>(),
               rows = whole_numbers(image.at("height")).get<std::size_t>();
    std::vector<std::vector<Corner>> loops;
    if (outline.contains("rle")) {
      const auto runs =
          whole_numbers(outline.at("rle").at("counts")).get<std::vector<std::size_t>>();
      std::size_t left = columns * rows;
      for (const std::size_t run : runs) {
        if (run > left) throw std::runtime_error("an outline has more pixels than its picture");
        left -= run;
      }
      loops = loops_of(runs, rows);
    } else {
      for (const Json& polygon :
           whole_numbers(outline.at("polygons"), std::numeric_limits<int>::max())) {
        if (polygon.size() < 2)
          throw std::runtime_error("an outline has a polygon without corners");
        std::vector<Corner>& loop = loops.emplace_back();
        for (std::size_t i = 0; i + 1 < polygon.size(); i += 2)
          loop.push_back({polygon[i].get<int>(), polygon[i + 1].get<int>()});
      }
    }
    return yolo_segment(category - 1, loops, columns, rows);
  }

  /// A line of the Hub's metadata.jsonl: a picture, and its annotations from number `first`.
  std::string hub_row(const Json& image, const IndexedPicture& picture, const Json& annotations,
                      std::size_t first) const {
    Json boxes = Json::array(), categories = Json::array(), names = Json::array();
    for (std::size_t i = first; i < annotations.size(); ++i) {
      boxes.push_back(annotations[i].at("bbox"));
      categories.push_back(annotations[i].at("category_id"));
      names.push_back(
          card_.classes.at(whole_numbers(annotations[i].at("category_id")).get<std::size_t>() - 1));
    }
    Json row = {{"file_name", SampleFolders::name_in_tar(picture.sample, picture.name)},
                {"sample", picture.sample},
                {"kind", image.at("kind")},
                {"sonar", image.at("sonar")},
                {"pixel_across_m", image.at("pixel_across_m")},
                {"pixel_along_m", image.at("pixel_along_m")},
                {"seen_from", image.at("seen_from")},
                {"objects", {{"bbox", boxes}, {"categories", categories}, {"names", names}}}};
    return row.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  }

  /// The polygons, or the run lengths if there are holes.
  static const Json& segmentation(const Json& outline) {
    return outline.contains("rle") ? outline.at("rle") : outline.at("polygons");
  }

  static Json& add_outline(Index& index, std::size_t image, std::size_t category,
                           const Json& outline) {
    return index.annotations.emplace_back(Json{{"id", index.annotations.size() + 1},
                                               {"image_id", image},
                                               {"category_id", category},
                                               {"bbox", outline.at("box")},
                                               {"area", outline.at("area_px")},
                                               {"segmentation", segmentation(outline)},
                                               {"iscrowd", 0}});
  }

  static void add_annotation(Index& index, std::size_t image, const Json& target) {
    Json& annotation =
        add_outline(index, image, whole_numbers(target.at("category_id")), target.at("body"));
    for (const auto& [key, value] : target.items())
      if (key != "body" && key != "shadow" && key != "category_id" && key != "ignored")
        annotation[key] = value;
    const Json& shadow = target.at("shadow");
    annotation["shadow_bbox"] = shadow.is_null() ? Json(nullptr) : shadow.at("box");
    annotation["shadow_area"] = shadow.is_null() ? Json(0) : shadow.at("area_px");
    annotation["shadow_segmentation"] = shadow.is_null() ? Json::array() : segmentation(shadow);
  }

  /// A target's shadow as an annotation of its own.
  void add_shadow(Index& index, std::size_t image, const Json& target) const {
    Json& annotation = add_outline(index, image, shadow_class_, target.at("shadow"));
    annotation["instance"] = target.at("instance");
    annotation["shadow_of"] = target.at("class");
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
    if (name.ends_with(".json") || name.ends_with(".jsonl"))
      index_files_.push_back({name, text.size(), sha256(text)});
  }

  /// Makes a whole folder of the dataset again: fill(its place while it is made).
  void write_folder(const std::string& name, const std::function<void(const fs::path&)>& fill) {
    const fs::path place = folder_ / name;
    refine::make_folder(place.parent_path());
    const Claim claim = StagingFolder::wait_for(place, [] {});
    StagingFolder staging(place);
    fill(staging.path());
    fs::remove_all(place);
    staging.put_in_place();
    report_.files.push_back(place);
  }

  static void stage(const fs::path& file, const std::string& text) {
    fs::create_directories(file.parent_path());
    refine::write_staged(file, std::as_bytes(std::span(text)));
  }

  /// Removes the temporary files that killed merges left.
  void remove_leftovers() const {
    for (const char* name : {"", "splits", "coco", "yolo", "yolo_segment", "pictures"}) {
      std::error_code ignored;
      for (const fs::directory_entry& entry : fs::directory_iterator(folder_ / name, ignored)) {
        const std::string file = entry.path().filename().string();
        if (file.starts_with(".") && file.ends_with(".tmp") &&
            !file.starts_with(".dataset.json.") && entry.is_regular_file(ignored))
          fs::remove(entry.path(), ignored);
      }
    }
  }

  void write() {
    const Claim claim = StagingFolder::wait_for(folder_ / "merge", [] {});  // one merge at a time
    remove_leftovers();
    write("manifest.jsonl", manifest_);
    for (const char* split : split_names)
      write(fmt::format("splits/{}.txt", split), splits_[split]);
    Json categories = Json::array();
    for (std::size_t i = 0; i < targets_; ++i)
      categories.push_back({{"id", i + 1},
                            {"name", card_.classes[i]},
                            {"supercategory", i + 1 == shadow_class_ ? "shadow" : "object"}});
    for (const std::string& group : groups_)
      for (const char* split : split_names) {
        const Index& index = indexes_[{group, split}];
        const Json coco = {{"info", {{"description", card_.title}, {"version", card_.version}}},
                           {"categories", categories},
                           {"images", index.images},
                           {"annotations", index.annotations}};
        write(fmt::format("coco/{}_{}.json", group, split),
              coco.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n");
      }
    if (per_tar_ == 0) {
      write_yolo("yolo", {"images", "labels"});
      if (write_yolo("yolo_segment", {"images"}))
        write_folder("yolo_segment/labels", [&](const fs::path& place) {
          for (const auto& [of, index] : indexes_)
            for (const IndexedPicture& picture : index.pictures)
              if (!picture.segments.empty())  // without a file, there is nothing in the picture
                stage(place / SampleFolders::name_of(picture.sample) /
                          (stem_of(picture.name) + ".txt"),
                      picture.segments);
        });
      write_hub();
    }
    if (options_.webdataset)
      write_folder("webdataset", [&](const fs::path& place) { write_webdataset(place); });
    card_.samples_by_split = report_.samples_by_split;
    card_.images = report_.images;
    for (const IndexedPicture& picture : on_card_) {
      card_.pictures.push_back(fmt::format("pictures/{:06}_{}", picture.sample, picture.name));
      write(card_.pictures.back(), content_of(picture));
    }
    write("README.md", card_.markdown());
    write("croissant.json", croissant_json(card_, std::exchange(index_files_, {})));
  }

  /// The lists of one of YOLO's formats. `links` are its folders that are the samples themselves:
  /// Ultralytics finds a list's ./images/ next to the list, and an image's labels by replacing the
  /// last images/ with labels/. Returns false, with a warning, on a file system without links.
  bool write_yolo(const std::string& folder, const std::vector<std::string>& links) {
    if (!link_samples(folder, links)) return false;
    std::string names;
    for (std::size_t i = 0; i < targets_; ++i)
      names += fmt::format("  {}: {}\n", i, Json(card_.classes[i]).dump());
    for (const std::string& group : groups_) {
      for (const char* split : split_names)
        write(fmt::format("{}/{}_{}.txt", folder, group, split), indexes_[{group, split}].yolo);
      // Without a `path`, YOLO looks for the lists next to this file, in any working directory.
      write(fmt::format("{}/{}.yaml", folder, group),
            fmt::format("train: {0}_train.txt\nval: {0}_val.txt\ntest: {0}_test.txt\nnames:\n{1}",
                        group, names));
    }
    return true;
  }

  bool link_samples(const std::string& folder, const std::vector<std::string>& links) {
    fs::create_directories(folder_ / folder);
    for (const std::string& name : links) {
      const fs::path link = folder_ / folder / name;
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

  /// hub/GROUP/SPLIT/, as the Hub's ImageFolder reads them: pictures, and metadata.jsonl next to
  /// them. The pictures are hard links, or copies on a file system without.
  void write_hub() {
    write_folder("hub", [&](const fs::path& place) {
      for (const auto& [of, index] : indexes_) {
        const auto& [group, split] = of;
        if (index.pictures.empty()) continue;
        const fs::path folder = place / group / split;
        card_.hub[group].insert(split);
        stage(folder / "metadata.jsonl", index.hub);
        index_files_.push_back({fmt::format("hub/{}/{}/metadata.jsonl", group, split),
                                index.hub.size(), sha256(index.hub)});
        for (const IndexedPicture& picture : index.pictures) {
          const fs::path file = folder / SampleFolders::name_in_tar(picture.sample, picture.name);
          std::error_code error;
          fs::create_hard_link(folders_->sample(picture.sample) / picture.name, file, error);
          if (error) stage(file, content_of(picture));
        }
      }
    });
  }

  /// Passes the files of all samples to f, by their names in tars, in the order of these names.
  void for_each_file(const std::function<void(const std::string&, std::span<const std::byte>)>& f) {
    for (std::size_t i = 0; i < samples_; ++i) {
      if (in_tar(i)) {
        if (i % per_tar_ == 0)
          read_tar(
              folders_->tar(i / per_tar_),
              [&](const std::string& name, std::vector<std::byte> content) { f(name, content); });
        continue;
      }
      std::map<std::string, fs::path> files;
      for (const fs::directory_entry& entry : fs::recursive_directory_iterator(place(i)))
        if (entry.is_regular_file())
          files[SampleFolders::name_in_tar(i, entry.path().lexically_relative(place(i)).string())] =
              entry.path();
      for (const auto& [name, file] : files) {
        const std::string content = refine::read_file(file);
        f(name, std::as_bytes(std::span(content)));
      }
    }
  }

  void write_webdataset(const fs::path& place) {
    WebDatasetWriter writer(place);
    for_each_file([&](const std::string& name, std::span<const std::byte> content) {
      const bool wanted =
          name.ends_with(".png") || name.ends_with(".json") || name.ends_with(".txt");
      auto record = records_.upper_bound(name);
      if (!wanted || record == records_.begin() || !name.starts_with((--record)->first)) return;
      const auto& [prefix, of] = *record;
      writer.add(of.group, of.key, name.substr(prefix.size()), content);
    });
    writer.finish();
  }

  std::string content_of(const IndexedPicture& picture) const {
    if (!in_tar(picture.sample))
      return refine::read_file(folders_->sample(picture.sample) / picture.name);
    std::string found;
    read_tar(folders_->tar(picture.sample / per_tar_),
             [&](const std::string& name, const std::vector<std::byte>& content) {
               if (name == SampleFolders::name_in_tar(picture.sample, picture.name))
                 found.assign(reinterpret_cast<const char*>(content.data()), content.size());
             });
    return found;
  }

  /// Whether the card shows a sample: a few, evenly chosen.
  bool is_on_card(std::size_t number) const {
    constexpr std::size_t shown = 4;
    for (std::size_t k = 0; k < shown; ++k)
      if (number == k * samples_ / shown) return true;
    return false;
  }

  void warn_of_splits() {
    const std::vector<std::string>& classes = card_.classes;
    for (const std::string& split : wanted_splits_) {
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

  struct WebRecord {
    std::string key, group;
  };

  fs::path folder_;
  const std::function<bool(std::size_t, std::size_t)>& progress_;
  const MergeOptions options_;
  static constexpr std::size_t small_px = 4;
  std::size_t boxes_ = 0, small_boxes_ = 0;
  std::size_t samples_ = 0, per_tar_ = 0, targets_ = 0;
  std::size_t shadow_class_ = 0;  // number of the class of shadows; 0: none
  std::optional<SampleFolders> folders_;
  MergeReport report_;
  Card card_;
  std::string manifest_;
  std::map<std::string, std::string> splits_;
  std::vector<std::string> wanted_splits_;
  std::map<std::string, std::set<std::string>> classes_shown_;       // by split
  std::map<std::uint64_t, std::set<std::string>> splits_of_seabed_;  // by its seed
  std::set<std::string> groups_;
  std::map<std::pair<std::string, std::string>, Index> indexes_;
  std::map<std::string, WebRecord> records_;  // by what their files' names in tars begin with
  std::vector<IndexedPicture> on_card_;
  std::vector<IndexFile> index_files_;  // those that croissant.json names
  static constexpr std::size_t none = ~std::size_t{0};
  std::size_t tar_of_ = none;
  std::map<std::string, FileSeen> seen_;  // by name, in a tar or in a sample's folder
};

}  // namespace

MergeReport merge(const fs::path& folder,
                  const std::function<bool(std::size_t, std::size_t)>& progress,
                  const MergeOptions& options) {
  return Merge(folder, progress, options).report();
}

}  // namespace ensonify::engine
