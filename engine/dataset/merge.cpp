#include <ensonify/engine/dataset/merge.h>

#include <algorithm>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/json_text.h>
#include <ensonify/engine/base/untrusted.h>
#include <ensonify/engine/dataset/picture_index-inl.h>
#include <ensonify/engine/dataset/piece_sizes.h>
#include <ensonify/engine/output/png.h>
#include <ensonify/engine/output/staging.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/scene/keys/dataset_options.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/refine/atomic_file.h>
#include <ensonify/refine/read_file.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// A JSON string that becomes a part of a file's name. Throws std::runtime_error if it has a slash.
std::string word_of(const Json& json) {
  auto word = json.get<std::string>();
  if (word.find('/') != word.npos)
    throw std::runtime_error(fmt::format("'{}' cannot be a part of a file's name", word));
  return word;
}

class Merge {
 public:
  Merge(const fs::path& folder, const MergeStep& step, const MergeOptions& options)
      : folder_(folder), options_(options), stored_(described()), files_(folder, step) {}

  MergeReport run() {
    for (std::size_t i = 0; i < samples_; ++i) {
      files_.step("samples", i, samples_);
      std::string damage;
      if (!stored_.finished(i)) {
        report_.missing.push_back(i);
      } else if (const std::optional<SampleRecord> record = stored_.read(i, damage)) {
        ++report_.samples;
        try {
          add(i, *record);
        } catch (const std::exception& error) {
          report_.damaged.push_back(
              fmt::format("{}: {}", stored_.place(i).string(), fault_in_json(error)));
        }
      } else {
        report_.damaged.push_back(damage);
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
      if (report_.chips_without_target > 0)
        report_.warnings.push_back(fmt::format(
            "{} of {} chips about a target have no label of it, because they show less "
            "of it than dataset.least_visible, or fewer pixels than dataset.least_px: {}",
            report_.chips_without_target, target_chips_, larger_chips));
    }
    return std::move(report_);
  }

 private:
  /// Reads dataset.json into the members, and returns its samples.
  CheckedSamples described() {
    if (!fs::exists(folder_ / "dataset.json"))
      throw SceneError(fmt::format(
          "{}: {}; expected a folder made by `ensonify generate`, or by `ensonify run` in several "
          "parts",
          folder_.string(),
          fs::is_directory(folder_) ? "there is no dataset.json in it"
                                    : "there is no such folder"));
    std::string dataset_xxh128;
    try {
      const Json dataset =
          json_of<Json>(refine::read_file(folder_ / "dataset.json", most_json_bytes));
      if (!fits_its_hash(dataset))
        throw std::runtime_error("its content has changed since it was written");
      dataset_xxh128 = dataset.at("xxh128").get<std::string>();
      samples_ = whole_numbers(dataset.at("samples")).get<std::size_t>();
      per_tar_ = whole_numbers(dataset.at("samples_per_tar")).get<std::size_t>();
      targets_ = whole_numbers(dataset.at("target_classes")).get<std::size_t>();
      classes_.shadow_class = whole_numbers(dataset.at("shadow_class")).get<std::size_t>();
      card_.licence = dataset.at("licence").get<std::string>();
      card_.creator = dataset.at("creator").get<std::string>();
      card_.url = dataset.at("url").get<std::string>();
      card_.published = dataset.at("published").get<std::string>();
      card_.title = dataset.at("title").get<std::string>();
      card_.overrides = dataset.at("overrides").get<std::vector<std::string>>();
      card_.recipe = dataset.at("recipe").get<std::string>();
      card_.version = dataset.at("version").get<std::string>();
      card_.samples = samples_;
      card_.seafloors = whole_numbers(dataset.at("seafloors")).get<std::size_t>();
      card_.classes = dataset.at("classes").get<std::vector<std::string>>();
      classes_.names = card_.classes;
      card_.sediments = dataset.at("sediments").get<std::vector<std::string>>();
      card_.licences = dataset.at("licences").get<std::vector<std::string>>();
      for (const Json& asset : dataset.at("assets"))
        card_.assets.push_back(asset.at("name").get<std::string>());
      wanted_splits_ = dataset.at("splits").get<std::vector<std::string>>();
      if (samples_ > max_samples || targets_ > card_.classes.size() ||
          classes_.shadow_class > targets_)
        throw std::out_of_range("too many samples, or numbers of classes that have no name");
    } catch (const std::exception& error) {
      throw SceneError(fmt::format(
          "{}: not a dataset's description; expected a folder made by `ensonify generate` ({})",
          (folder_ / "dataset.json").string(), fault_in_json(error)));
    }
    return {folder_, std::move(dataset_xxh128), samples_, per_tar_};
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
    const auto is_line = [](const Json& image, std::string_view geometry) {
      return image.at("kind") == "line" && image.at("geometry") == geometry;
    };
    // The card has the frames as fans, and the lines in slant range or, if there are none, in
    // ground range.
    const bool slant = std::ranges::any_of(
        record.images, [&](const auto& named) { return is_line(named.second, "slant"); });
    for (const auto& [name, image] : record.images) {
      if (is_line(image, slant ? "slant" : "ground") || image.at("geometry") == "fan")
        add_to_card(number, image, split);
      add_image(number, image, split);
    }
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
    if (kind == "background" || kind == "hard_negative") kind = "chip";
    const std::string group = fmt::format("{}_{}", geometry, kind);
    groups_.insert(group);
    if (image.at("kind") == "chip") count_chip(image);
    for (const Json& name : image.at("classes"))
      classes_shown_[split].insert(name.get<std::string>());
    // If the parts of a target have separate classes, the mask does not show the target's class.
    for (const Json& target : image.at("targets"))
      if (!target.at("ignored").get<bool>())
        classes_shown_[split].insert(target.at("class").get<std::string>());
    const auto stem = image.at("image").get<std::string>();
    if (options_.webdataset) {
      std::string key = fmt::format("{:06}-{}", number, stem);
      std::ranges::replace(key, '/', '-');
      records_[SampleFolders::name_in_tar(number, stem) + "."] = {key, group + "_" + split};
    }
    Json masks = Json::object();
    for (const char* mask : {"class", "sediment", "instance", "region"})
      masks[mask] = stored_.path_of(number, fmt::format("{}.{}.png", stem, mask));
    for (const Json& picture : image.at("pictures")) {
      const auto name = picture.get<std::string>();
      check_picture(number, name, image);
      ++report_.images[fmt::format("{}, {}", group, split)];
      count_small_boxes(image);
      indexes_[{group, split}].add(number, name, {stored_.path_of(number, name), masks}, image,
                                   classes_);
    }
  }

  /// Throws std::runtime_error if a picture is not one of its sample's files, or if it has too few
  /// bytes for the number of its pixels.
  void check_picture(std::size_t number, const std::string& name, const Json& image) const {
    const std::optional<std::uint64_t> size_bytes = stored_.size_bytes(number, name);
    if (!size_bytes || !stays_inside(name))
      throw std::runtime_error(fmt::format("the picture '{}' is not a file of its sample", name));
    const double columns = image.at("width").get<double>(), rows = image.at("height").get<double>();
    const auto bytes = static_cast<double>(*size_bytes);
    if (!(columns >= 1.0 && rows >= 1.0 && columns * rows <= max_png_compression * bytes))
      throw std::runtime_error(
          fmt::format("the picture '{}' cannot have {} x {} pixels", name, columns, rows));
  }

  /// Counts chips of a target, and those of them without a label of their target.
  void count_chip(const Json& image) {
    const Json of = image.value("of_instance", Json());  // not in datasets of version 0.2
    if (of.is_null()) return;
    ++target_chips_;
    report_.chips_without_target +=
        std::ranges::none_of(image.at("targets"), [&](const Json& target) {
          return target.at("instance") == of && !target.at("ignored").get<bool>();
        });
  }

  void count_small_boxes(const Json& image) {
    for (const Json& target : image.at("targets")) {
      // Only objects have a table; features of the bed are never ignored.
      if (target.at("ignored").get<bool>() || target.at("body").is_null() ||
          !target.contains("table"))
        continue;
      ++boxes_;
      small_boxes_ += whole_numbers(target.at("body").at("area_px")).get<std::size_t>() < small_px;
    }
  }

  void add_to_card(std::size_t number, const Json& image, const std::string& split) {
    const bool is_later_frame =
        image.contains("frame") && !on_card_.empty() && on_card_.back().sample == number;
    if (is_on_card(number) && !is_later_frame)
      on_card_.push_back({number, image.at("pictures").at(0).get<std::string>(), ""});
    for (const Json& target : image.at("targets")) {
      if (target.at("ignored").get<bool>()) continue;
      ++card_.targets[target.at("class").get<std::string>()][split];
      for (const char* key : {"range_m", "aspect_deg", "buried", "visible_fraction", "contrast_db"})
        if (target.contains(key) && target.at(key).is_number())
          card_.measured[key].add(target.at(key).get<double>());
    }
  }

  void write() {
    const Claim claim = StagingFolder::wait_for(
        folder_ / "merge", [&] { files_.step("another merge of this folder", 0, 1); });
    files_.remove_leftovers();
    files_.write("manifest.jsonl", manifest_);
    for (const char* split : split_names)
      files_.write(fmt::format("splits/{}.txt", split), splits_[split]);
    Json categories = Json::array();
    for (std::size_t i = 0; i < targets_; ++i)
      categories.push_back(
          {{"id", i + 1},
           {"name", card_.classes[i]},
           {"supercategory", i + 1 == classes_.shadow_class ? "shadow" : "object"}});
    std::size_t groups_done = 0;
    for (const std::string& group : groups_) {
      for (const char* split : split_names) {
        files_.step("annotations", groups_done, groups_.size());
        const PictureIndex& index = indexes_[{group, split}];
        Json coco = {{"info", {{"description", card_.title}, {"version", card_.version}}},
                     {"categories", categories},
                     {"images", index.images()},
                     {"annotations", index.annotations()}};
        if (group.ends_with("_frame")) coco["videos"] = index.videos();
        files_.write(fmt::format("coco/{}_{}.json", group, split), json_text(coco) + "\n");
      }
      ++groups_done;
    }
    if (per_tar_ == 0) {
      const std::vector<std::string> targets(
          card_.classes.begin(), card_.classes.begin() + static_cast<std::ptrdiff_t>(targets_));
      write_yolo(indexes_, targets, files_, report_.warnings);
      card_.hub = write_hub(indexes_, stored_, files_);
    }
    if (options_.webdataset)
      files_.write_folder("webdataset", [&](const fs::path& place) { write_webdataset(place); });
    card_.samples_by_split = report_.samples_by_split;
    card_.images = report_.images;
    for (const IndexedPicture& picture : on_card_) {
      card_.pictures.push_back(fmt::format("pictures/{:06}_{}", picture.sample, picture.name));
      files_.write(card_.pictures.back(), stored_.content_of(picture.sample, picture.name));
    }
    files_.write("README.md", card_.markdown());
    files_.write("croissant.json", croissant_json(card_, files_.index()));
    report_.files = files_.files();
  }

  void write_webdataset(const fs::path& place) {
    WebDatasetWriter writer(place);
    stored_.for_each_file(
        [&](std::size_t sample, const std::string& name, std::span<const std::byte> content) {
          files_.step("samples for WebDataset", sample, samples_);
          const bool wanted =
              name.ends_with(".png") || name.ends_with(".json") || name.ends_with(".txt");
          auto record = records_.upper_bound(name);
          if (!wanted || record == records_.begin() || !name.starts_with((--record)->first)) return;
          const auto& [prefix, of] = *record;
          writer.add(of.group, of.key, name.substr(prefix.size()), content);
        });
    writer.finish();
  }

  /// Whether the card shows a sample. It shows a few samples, evenly chosen.
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
  const MergeOptions options_;
  static constexpr std::size_t small_px = 4;
  std::size_t boxes_ = 0, small_boxes_ = 0, target_chips_ = 0;
  std::size_t samples_ = 0, per_tar_ = 0, targets_ = 0;
  IndexClasses classes_;
  Card card_;
  std::vector<std::string> wanted_splits_;
  CheckedSamples stored_;  // from described(), which also sets the members above
  MergedFiles files_;
  MergeReport report_;
  std::string manifest_;
  std::map<std::string, std::string> splits_;
  std::map<std::string, std::set<std::string>> classes_shown_;       // by split
  std::map<std::uint64_t, std::set<std::string>> splits_of_seabed_;  // by its seed
  std::set<std::string> groups_;
  PictureIndexes indexes_;
  std::map<std::string, WebRecord> records_;  // by the beginning of their files' names in tars
  std::vector<IndexedPicture> on_card_;
};

}  // namespace

MergeReport merge(const fs::path& folder,
                  const std::function<bool(std::string_view, std::size_t, std::size_t)>& progress,
                  const MergeOptions& options) {
  const auto step = [&](std::string_view stage, std::size_t done, std::size_t of) {
    if (progress && !progress(stage, done, of)) throw Stopped("stopped on request");
  };
  return Merge(folder, step, options).run();
}

}  // namespace ensonify::engine
