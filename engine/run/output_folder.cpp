#include <ensonify/engine/run/output_folder.h>

#include <cstdint>
#include <limits>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/clock.h>
#include <ensonify/engine/base/untrusted.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/refine/read_file.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;

constexpr const char* manifest_name = "manifest.json";
constexpr const char* earlier_name = "earlier";  // a folder in the staging folder
constexpr auto no_size = std::numeric_limits<std::uint64_t>::max();

nlohmann::json manifest_in(const fs::path& folder) {
  if (!fs::is_regular_file(folder / manifest_name)) return {};
  return json_or_null<nlohmann::json>(refine::read_file(folder / manifest_name, most_json_bytes));
}

/// The names and sizes of the files that a folder's manifest lists (`no_size` for a file without a
/// size). None if there is no manifest, or if it is damaged.
std::optional<std::vector<FileRecord>> listed_files(const fs::path& folder) {
  const nlohmann::json manifest = manifest_in(folder);
  if (!manifest.is_object() || !manifest.contains("files")) return std::nullopt;
  std::vector<FileRecord> files;
  for (const nlohmann::json& file : manifest["files"]) {
    if (!file.is_object() || !file.contains("name") || !file["name"].is_string()) continue;
    const nlohmann::json size = file.value("size_bytes", nlohmann::json());
    files.push_back(
        {file["name"], size.is_number_unsigned() ? size.get<std::uint64_t>() : no_size, {}});
  }
  return files;
}

/// The names of the listed files that lie directly in the folder and have the listed size.
std::vector<std::string> own_files(const fs::path& folder) {
  std::vector<std::string> names;
  for (const FileRecord& file : listed_files(folder).value_or(std::vector<FileRecord>())) {
    const fs::path name = file.name;
    std::error_code missing;
    if (name == name.filename() && fs::is_regular_file(folder / name, missing) &&
        fs::file_size(folder / name, missing) == file.size_bytes)
      names.push_back(file.name);
  }
  return names;
}

/// Those of `names` that the folder's manifest does not list. Empty if the manifest is damaged.
std::vector<std::string> not_listed(const fs::path& folder, std::span<const std::string> names) {
  std::vector<std::string> left(names.begin(), names.end());
  if (!fs::exists(folder / manifest_name)) return left;
  const std::optional listed = listed_files(folder);
  if (!listed) return {};
  for (const FileRecord& file : *listed) std::erase(left, file.name);
  return left;
}

/// Moves the files of an earlier run from the staging folder back, unless the new run is complete.
void restore_earlier_run(const fs::path& folder, const fs::path& staging) {
  const fs::path aside = staging / earlier_name;
  if (fs::exists(folder / manifest_name) || !fs::exists(aside / manifest_name)) return;
  // Remove the files of the new run that are in place already.
  for (const FileRecord& file : listed_files(staging).value_or(std::vector<FileRecord>()))
    if (!fs::exists(staging / file.name)) fs::remove(folder / file.name);
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(aside))
    if (entry.path().filename() != manifest_name) names.push_back(entry.path().filename().string());
  names.emplace_back(manifest_name);
  refine::move_files(aside, folder, names);
}

}  // namespace

void require_none_of(const fs::path& folder, std::span<const std::string> names) {
  for (const std::string& name : names)
    if (fs::exists(fs::symlink_status(folder / name)))
      throw SceneError(fmt::format(
          "{}: is not of an earlier run in this folder, and would be overwritten; move it away, or "
          "choose another folder with -o",
          (folder / name).string()));
}

std::vector<fs::path> files_of_run(const fs::path& folder) {
  if (!fs::is_regular_file(folder / manifest_name)) return {};
  std::vector<fs::path> files{folder / manifest_name};
  for (const FileRecord& file : listed_files(folder).value_or(std::vector<FileRecord>()))
    files.push_back(folder / file.name);
  return files;
}

OutputFolder::OutputFolder(fs::path folder, bool staged)
    : folder_(std::move(folder)), staged_(staged) {
  made_ = refine::make_folder(folder_);
}

OutputFolder::~OutputFolder() {
  std::error_code ignored;
  if (!kept_) {
    for (const std::string& name : shown_) fs::remove(folder_ / name, ignored);
    for (const auto& [name, record] : records_)
      if (!staging_ || !fs::exists(staging_->path() / name, ignored))
        fs::remove(folder_ / name, ignored);
    try {
      if (staging_) restore_earlier_run(folder_, staging_->path());
    } catch (const std::exception&) {
      // Keep the staging folder: the next run in this folder restores the earlier run from it.
      staging_->leave();
    }
  }
  staging_.reset();
  claim_.reset();
  if (!kept_) refine::remove_empty(made_);
}

void OutputFolder::begin() {
  if (staged_) return;
  const fs::path place = folder_ / manifest_name;
  if (std::optional<Claim> claim = Claim::try_take(StagingFolder::lock_of(place)))
    claim_.emplace(std::move(*claim));
  else
    throw SceneError(fmt::format(
        "{}: another process makes a run in this folder; wait until it has finished, or choose "
        "another folder with -o",
        folder_.string()));
  const std::vector<fs::path> left_behind = StagingFolder::left_behind(place);
  if (claim_->exclusive())
    for (const fs::path& staging : left_behind) restore_earlier_run(folder_, staging);
  holds_earlier_run_ = fs::exists(fs::symlink_status(place));
  if (holds_earlier_run_) {
    const nlohmann::json manifest = manifest_in(folder_);
    if (!fs::is_regular_file(place) ||
        (manifest.is_object() ? manifest.value("program", nlohmann::json()) != "ensonify"
                              : !begins_as_manifest(place)))
      throw SceneError(fmt::format(
          "{}: is not the manifest of a run; choose another folder with -o", place.string()));
  }
  after_killed_ = !left_behind.empty();
  staging_.emplace(place);
  // Remove the old staging folders only after the new one exists: a staging folder shows the next
  // run that unlisted files here belong to a run.
  std::error_code ignored;
  if (claim_->exclusive())
    for (const fs::path& staging : left_behind) fs::remove_all(staging, ignored);
}

void OutputFolder::require_own(std::span<const std::string> names) const {
  // A killed run may have left files that no manifest lists, so the check would refuse them.
  if (!after_killed_) require_none_of(folder_, not_listed(folder_, names));
}

void OutputFolder::write(const std::string& name, const refine::WriteContent& write_content) {
  const Clock::time_point start = Clock::now();
  double content_s = 0.0;
  const auto timed = [&](const refine::WriteAt& write_at) {
    const Clock::time_point content_start = Clock::now();
    double pieces_s = 0.0;
    write_content([&](std::uint64_t place, std::span<const std::byte> piece) {
      const Clock::time_point piece_start = Clock::now();
      write_at(place, piece);
      pieces_s += seconds_since(piece_start);
    });
    content_s = seconds_since(content_start) - pieces_s;
  };
  FileRecord record;
  refine::write_staged((staging_ ? staging_->path() : folder_) / name, timed,
                       [&](const refine::ReadAt& read_at) { record = record_of(name, read_at); });
  const std::lock_guard lock(mutex_);
  disk_s_ += seconds_since(start) - content_s;
  records_[name] = std::move(record);
}

void OutputFolder::write(const std::string& name, std::span<const std::byte> content) {
  write(name, refine::content_of(content));
}

void OutputFolder::write(const std::string& name, std::string_view text) {
  write(name, std::as_bytes(std::span(text)));
}

void OutputFolder::show(const std::string& name, std::span<const std::byte> content) {
  if (holds_earlier_run_) return;
  shown_.insert(name);
  refine::write_file(folder_ / name, content);
}

void OutputFolder::keep() {
  if (staging_) {
    const Clock::time_point start = Clock::now();
    replace_earlier_run();
    disk_s_ += seconds_since(start);
  }
  kept_ = true;
}

/// Moves the old manifest away first, and puts the new manifest in place last. So a folder with a
/// manifest always has all files that the manifest lists.
void OutputFolder::replace_earlier_run() {
  std::vector<std::string> names;
  for (const auto& [name, record] : records_) {
    if (name != manifest_name) names.push_back(name);
    if (fs::is_directory(folder_ / name))
      throw std::system_error(std::make_error_code(std::errc::is_a_directory),
                              (folder_ / name).string() +
                                  ": cannot write a file in place of a folder; choose another "
                                  "folder with -o");
  }
  const std::vector<std::string> manifest{manifest_name};
  refine::sync_files(staging_->path());
  if (holds_earlier_run_) {
    const std::vector<std::string> earlier = own_files(folder_);
    const fs::path aside = staging_->path() / earlier_name;
    refine::make_folder(aside);
    refine::move_files(folder_, aside, manifest);
    refine::move_files(folder_, aside, earlier);
  }
  refine::move_files(staging_->path(), folder_, names);
  refine::move_files(staging_->path(), folder_, manifest);
  // If a run was killed in show(), temporary files of its pictures are left.
  for (const std::string& name : names)
    for (const fs::path& temporary : StagingFolder::left_behind(folder_ / name))
      refine::remove_abandoned(temporary);
}

std::vector<FileRecord> OutputFolder::records() const {
  std::vector<FileRecord> all;
  for (const auto& [name, record] : records_) all.push_back(record);
  return all;
}

}  // namespace ensonify::engine
