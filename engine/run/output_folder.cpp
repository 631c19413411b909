#include <ensonify/engine/run/output_folder.h>

#include <system_error>
#include <utility>

#include <ensonify/engine/clock.h>

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
  const auto read_back = [&](const refine::ReadAt& read_at) { record = record_of(name, read_at); };
  if (staged_)
    refine::write_staged(folder_ / name, timed, read_back);
  else
    refine::write_file(folder_ / name, timed, read_back);
  const std::lock_guard lock(mutex_);
  disk_s_ += seconds_since(start) - content_s;
  records_[name] = std::move(record);
}

void OutputFolder::write(const std::string& name, std::span<const std::byte> content) {
  write(name, refine::content_of(content));
}

std::vector<FileRecord> OutputFolder::records() const {
  std::vector<FileRecord> all;
  for (const auto& [name, record] : records_) all.push_back(record);
  return all;
}

}  // namespace ensonify::engine
