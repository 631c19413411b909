#include <ensonify/engine/run/output_folder.h>

#include <system_error>
#include <utility>

#include <ensonify/engine/clock.h>
#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {

namespace fs = std::filesystem;

OutputFolder::OutputFolder(fs::path folder, bool staged)
    : folder_(std::move(folder)), staged_(staged) {
  made_ = refine::make_folder(folder_);
}

OutputFolder::~OutputFolder() {
  if (kept_) return;
  std::error_code ignored;
  for (const auto& [name, record] : records_) fs::remove(folder_ / name, ignored);
  if (made_) fs::remove(folder_, ignored);  // only if nothing else is in it
}

void OutputFolder::write(const std::string& name, std::span<const std::byte> content) {
  const Clock::time_point start = Clock::now();
  if (staged_)
    refine::write_staged(folder_ / name, content);
  else
    refine::write_file(folder_ / name, content);
  const FileRecord record{name, content.size(), xxh128(content)};
  const std::lock_guard lock(mutex_);
  disk_s_ += seconds_since(start);
  records_[name] = record;
}

std::vector<FileRecord> OutputFolder::records() const {
  std::vector<FileRecord> all;
  for (const auto& [name, record] : records_) all.push_back(record);
  return all;
}

}  // namespace ensonify::engine
