#include <ensonify/engine/output/staging.h>

#include <cerrno>
#include <chrono>
#include <system_error>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>

#include <ensonify/refine/atomic_file.h>
#include <ensonify/refine/temporary_name.h>

namespace ensonify::engine {

namespace fs = std::filesystem;

namespace {

/// Removes a folder. `between` is called before each file: a disk may need a millisecond per file.
void remove_folder(const fs::path& folder, const std::function<void()>& between) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    if (entry.is_directory(ignored) && !entry.is_symlink(ignored)) {
      remove_folder(entry.path(), between);
    } else {
      between();
      fs::remove(entry.path(), ignored);
    }
  }
  fs::remove(folder, ignored);
}

}  // namespace

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
      if (errno == EWOULDBLOCK) {
        // Closed here, because the destructor would remove the lock file of the holder.
        ::close(std::exchange(claim.descriptor_, -1));
        return std::nullopt;
      }
      claim.exclusive_ = false;
      return claim;
    }
    // The holder before may have removed the file between open() and flock().
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

std::optional<Claim> StagingFolder::try_claim(const fs::path& place,
                                              const std::function<void()>& between) {
  std::optional<Claim> claim = Claim::try_take(lock_of(place));
  if (claim && claim->exclusive())
    for (const fs::path& folder : left_behind(place)) remove_folder(folder, between);
  return claim;
}

std::vector<fs::path> StagingFolder::left_behind(const fs::path& place) {
  std::vector<fs::path> found;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(place.parent_path(), ignored))
    if (refine::is_temporary_of(place, entry.path())) found.push_back(entry.path());
  return found;
}

std::set<std::string> StagingFolder::places_with_remains(const fs::path& folder) {
  std::set<std::string> places;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(".")) continue;
    const fs::path without_end = fs::path(name.substr(1)).stem(), place = without_end.stem();
    if (name.ends_with(".lock")) places.insert(without_end.string());
    if (refine::is_temporary_of(place, name)) places.insert(place.string());
  }
  return places;
}

Claim StagingFolder::wait_for(const fs::path& place, const std::function<void()>& waiting) {
  while (true) {
    if (std::optional<Claim> claim = try_claim(place, waiting)) return std::move(*claim);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    waiting();
  }
}

StagingFolder::StagingFolder(const fs::path& place) : place_(place) {
  for (int n = 0;; ++n) {
    folder_ = place.parent_path() / refine::temporary_name(place, n);
    std::error_code error;
    if (fs::create_directory(folder_, error)) break;
    if (error)
      throw std::system_error(
          error,
          folder_.string() + ": cannot make this folder; choose a place that you may write to");
  }
  // With any umask the owner must be able to write files into the folder and to remove them.
  fs::permissions(folder_, fs::perms::owner_all, fs::perm_options::add);
}

StagingFolder::~StagingFolder() {
  std::error_code ignored;
  if (!folder_.empty()) fs::remove_all(folder_, ignored);
}

void StagingFolder::remove(const std::function<void()>& between) {
  remove_folder(std::exchange(folder_, {}), between);
}

void StagingFolder::put_in_place() {
  if (refine::put_in_place(folder_, place_)) folder_.clear();
}

}  // namespace ensonify::engine
