#include <ensonify/engine/dataset/merged_files.h>

#include <system_error>

#include <fmt/format.h>

#include <ensonify/engine/output/sha256.h>
#include <ensonify/engine/output/staging.h>
#include <ensonify/engine/run.h>
#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {

namespace fs = std::filesystem;

void MergedFiles::write(const std::string& name, const std::string& text) {
  refine::make_folder((folder_ / name).parent_path());
  refine::write_file(folder_ / name, text);
  files_.push_back(folder_ / name);
  if (name.ends_with(".json") || name.ends_with(".jsonl")) add_to_index(name, text);
}

void MergedFiles::write_folder(const std::string& name,
                               const std::function<void(const fs::path&)>& fill) {
  const fs::path place = folder_ / name;
  refine::make_folder(place.parent_path());
  const auto removing = [&] { step("old files of " + name, 0, 1); };
  const Claim claim = StagingFolder::wait_for(place, removing);
  StagingFolder staging(place), former(place);
  try {
    fill(staging.path());
    if (fs::exists(place)) fs::rename(place, former.path() / "former");
    staging.put_in_place();
    former.remove(removing);
  } catch (const Stopped&) {
    staging.leave();
    throw;
  }
  files_.push_back(place);
}

void MergedFiles::stage(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  refine::write_staged(file, std::as_bytes(std::span(text)));
}

void MergedFiles::add_to_index(const std::string& name, const std::string& text) {
  index_.push_back({name, text.size(), sha256(text)});
}

void MergedFiles::remove_leftovers() const {
  for (const char* name : {"", "splits", "coco", "yolo", "yolo_segment", "pictures"}) {
    std::error_code ignored;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_ / name, ignored)) {
      const std::string file = entry.path().filename().string();
      if (file.starts_with(".") && file.ends_with(".tmp") && !file.starts_with(".dataset.json.") &&
          entry.is_regular_file(ignored))
        fs::remove(entry.path(), ignored);
    }
  }
  // Also at folders that this merge does not make.
  for (const std::string name : {"hub", "webdataset", "yolo_segment/labels"}) {
    const fs::path place = folder_ / name;
    if (fs::exists(place.parent_path()) &&
        StagingFolder::places_with_remains(place.parent_path()).contains(place.filename().string()))
      StagingFolder::try_claim(place, [&] { step("old files of " + name, 0, 1); });
  }
}

void WebDatasetWriter::add(const std::string& group_name, const std::string& key,
                           const std::string& extension, std::span<const std::byte> content) {
  Group& group = groups_[group_name];
  if (group.key != key) {
    if (group.records % records_per_tar == 0) {
      if (group.tar) group.tar->finish();
      group.tar = std::make_unique<TarFile>(
          folder_ / fmt::format("{}-{:06}.tar", group_name, group.records / records_per_tar));
    }
    group.key = key;
    ++group.records;
  }
  group.tar->add(key + "." + extension, content);
}

void WebDatasetWriter::finish() {
  for (auto& [name, group] : groups_) group.tar->finish();
  groups_.clear();
}

}  // namespace ensonify::engine
