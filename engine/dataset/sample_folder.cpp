#include <ensonify/engine/dataset/sample_folder.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>

#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {

namespace fs = std::filesystem;

SampleFolders::SampleFolders(fs::path dataset, std::size_t samples_per_tar)
    : dataset_(std::move(dataset)), samples_per_tar_(samples_per_tar) {}

bool SampleFolders::finished(std::size_t number) const {
  // A tar appears before its samples' folders are removed, so this order misses none.
  return fs::exists(sample(number)) ||
         (samples_per_tar_ > 0 && fs::exists(tar(number / samples_per_tar_)));
}

fs::path SampleFolders::sample(std::size_t number) const {
  return dataset_ / "samples" / name_of(number);
}
fs::path SampleFolders::tar(std::size_t number) const {
  return dataset_ / "tars" / (name_of(number) + ".tar");
}
std::string SampleFolders::name_of(std::size_t sample) { return fmt::format("{:06}", sample); }

std::string SampleFolders::name_in_tar(std::size_t sample, const std::string& file) {
  const std::size_t slash = file.find('/');
  if (slash == std::string::npos) return fmt::format("{:06}.{}", sample, file);
  return fmt::format("{:06}-{}-{}", sample, file.substr(0, slash), file.substr(slash + 1));
}

std::optional<Claim> Claim::try_take(const fs::path& lock_file) {
  while (true) {
    const int descriptor = ::open(lock_file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (descriptor < 0)
      throw std::system_error(
          errno, std::generic_category(),
          fmt::format("{}: cannot make a lock; choose a folder that you may write to",
                      lock_file.string()));
    Claim claim(lock_file, descriptor);
    if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
      const bool held_elsewhere = errno == EWOULDBLOCK;
      // Closed here: the destructor would remove the holder's file.
      if (held_elsewhere) ::close(std::exchange(claim.descriptor_, -1));
      if (held_elsewhere) return std::nullopt;
      claim.exclusive_ = false;
      return claim;
    }
    // The former holder may have removed the file between open() and flock().
    struct stat ours {
    }, there{};
    if (::fstat(descriptor, &ours) == 0 && ::stat(lock_file.c_str(), &there) == 0 &&
        ours.st_ino == there.st_ino && ours.st_dev == there.st_dev)
      return claim;
    ::close(std::exchange(claim.descriptor_, -1));
  }
}

Claim::Claim(Claim&& other) noexcept
    : file_(std::move(other.file_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      exclusive_(other.exclusive_) {}

Claim::~Claim() {
  if (descriptor_ < 0) return;
  ::unlink(file_.c_str());  // while it is still locked, so no other process holds it
  ::close(descriptor_);
}

fs::path StagingFolder::lock_of(const fs::path& place) {
  return place.parent_path() / fmt::format(".{}.lock", place.filename().string());
}

void StagingFolder::clear(const fs::path& place) {
  const std::string begin = fmt::format(".{}.", place.filename().string());
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(place.parent_path(), ignored)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(begin) && name.ends_with(".tmp")) fs::remove_all(entry.path(), ignored);
  }
}

StagingFolder::StagingFolder(const fs::path& place) : place_(place) {
  for (int n = 0;; ++n) {
    folder_ = place.parent_path() / fmt::format(".{}.{}.tmp", place.filename().string(), n);
    if (fs::create_directory(folder_)) return;
  }
}

StagingFolder::~StagingFolder() {
  std::error_code ignored;
  if (!folder_.empty()) fs::remove_all(folder_, ignored);
}

void StagingFolder::put_in_place() {
  if (!refine::put_in_place(folder_, place_)) return;
  folder_.clear();
}

}  // namespace ensonify::engine
