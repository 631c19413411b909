#include <ensonify/engine/run/output_folder.h>

#include <fstream>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/clock.h>
#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

namespace fs = std::filesystem;

namespace {

constexpr const char* manifest_name = "manifest.json";

/// The files that the manifest of a folder lists; none if it is damaged. A name leads nowhere else.
std::set<std::string> listed_files(const fs::path& folder) {
  std::ifstream stream(folder / manifest_name, std::ios::binary);
  const auto manifest = nlohmann::json::parse(stream, nullptr, /* exceptions: */ false);
  std::set<std::string> names;
  if (!manifest.is_object() || !manifest.contains("files")) return names;
  for (const nlohmann::json& file : manifest["files"])
    if (file.is_object() && file.contains("name") && file["name"].is_string())
      if (const fs::path name = file["name"].get<std::string>(); name == name.filename())
        names.insert(name.string());
  return names;
}

}  // namespace

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
  }
  staging_.reset();
  claim_.reset();
  if (!kept_ && made_) fs::remove(folder_, ignored);  // only if nothing else is in it
}

void OutputFolder::begin() {
  if (staged_) return;
  if (std::optional<Claim> claim = StagingFolder::try_claim(folder_ / manifest_name))
    claim_.emplace(std::move(*claim));
  else
    throw SceneError(fmt::format(
        "{}: another process makes a run in this folder; wait until it has finished, or choose "
        "another folder with -o",
        folder_.string()));
  holds_earlier_run_ = fs::exists(folder_ / manifest_name);
  staging_.emplace(folder_ / manifest_name);
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

/// The manifest goes first and comes last: a folder with one has all files that it lists.
void OutputFolder::replace_earlier_run() {
  std::vector<std::string> names;
  for (const auto& [name, record] : records_)
    if (name != manifest_name) names.push_back(name);
  const std::set<std::string> earlier = listed_files(folder_);
  refine::sync_files(staging_->path());
  fs::remove(folder_ / manifest_name);
  refine::move_files(staging_->path(), folder_, names);
  std::error_code ignored;
  for (const std::string& name : earlier)
    if (!records_.contains(name)) fs::remove(folder_ / name, ignored);
  refine::move_files(staging_->path(), folder_, std::vector<std::string>{manifest_name});
}

std::vector<FileRecord> OutputFolder::records() const {
  std::vector<FileRecord> all;
  for (const auto& [name, record] : records_) all.push_back(record);
  return all;
}

}  // namespace ensonify::engine
