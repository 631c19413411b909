#include <ensonify/refine/atomic_file.h>

#include <cerrno>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>

#include <ensonify/refine/temporary_name.h>

namespace ensonify::refine {
namespace {

const char* advice(int error) {
  switch (error) {
    case ENOSPC:
    case EDQUOT: return "free some space there, or choose another folder";
    case EFBIG: return "raise the file-size limit (ulimit -f)";
    case EACCES:
    case EPERM:
    case EROFS: return "choose a folder that you may write to";
    case ENOENT: return "make its folder first, or correct the path";
    case ENOTDIR: return "choose another path, because a file is in the place of a folder";
    case ENAMETOOLONG: return "choose a shorter name";
    case EISDIR:
    case EINVAL: return "choose another name";
    default: return "check the disk, or choose another folder";
  }
}

[[noreturn]] void fail_to_write(const std::filesystem::path& file, const char* step, int error) {
  throw std::system_error(error, std::generic_category(),
                          fmt::format("{}: cannot {}; {}", file.string(), step, advice(error)));
}

struct Descriptor {
  int number = -1;
  ~Descriptor() {
    if (number >= 0) ::close(number);
  }
};

std::filesystem::path folder_of(const std::filesystem::path& file) {
  return file.has_parent_path() ? file.parent_path() : ".";
}

int open_folder(const std::filesystem::path& folder) {
  const int number = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (number < 0) fail_to_write(folder, "open it", errno);
  return number;
}

/// Removes a temporary file if no process has it locked, because then its writer was killed.
bool remove_abandoned(int folder, const std::string& name) {
  const Descriptor its{::openat(folder, name.c_str(), O_WRONLY | O_CLOEXEC | O_NOFOLLOW)};
  struct stat ours {
  }, there{};
  // Once the file is locked, it is removed only if it still has this name.
  return its.number >= 0 && ::flock(its.number, LOCK_EX | LOCK_NB) == 0 &&
         ::fstat(its.number, &ours) == 0 &&
         ::fstatat(folder, name.c_str(), &there, AT_SYMLINK_NOFOLLOW) == 0 &&
         ours.st_ino == there.st_ino && ours.st_dev == there.st_dev &&
         ::unlinkat(folder, name.c_str(), 0) == 0;
}

/// A temporary file in the folder of the target file. It is locked (flock) while it is open. The
/// destructor removes it unless it was renamed.
struct Temporary {
  int folder;
  std::string name;
  Descriptor descriptor;
  bool renamed = false;

  Temporary(const std::filesystem::path& file, int folder_number) : folder(folder_number) {
    const auto numbered = [&](int n) { return temporary_name(file, n); };
    constexpr int most = 10000;
    int n = 0;
    for (; n < most && !create(numbered(n)); ++n) {
      if (errno != EEXIST) break;
      if (remove_abandoned(folder, numbered(n))) --n;  // the name is free now
    }
    if (descriptor.number < 0) fail_to_write(file, "make a temporary file in its folder", errno);
    while (++n < most && remove_abandoned(folder, numbered(n))) {
    }
  }
  ~Temporary() {
    if (!renamed) ::unlinkat(folder, name.c_str(), 0);
  }

 private:
  bool create(std::string wanted) {
    // O_EXCL reserves the name. With 0666 (mkstemp has 0600) the umask decides the mode.
    descriptor.number =
        ::openat(folder, wanted.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor.number < 0) return false;
    name = std::move(wanted);
    struct stat status {};
    if (::flock(descriptor.number, LOCK_EX) != 0 ||  // not on every file system
        ::fstat(descriptor.number, &status) != 0 || status.st_nlink > 0)
      return true;
    // Before the file was locked, another writer removed it as abandoned.
    ::close(std::exchange(descriptor.number, -1));
    return create(std::move(name));
  }
};

void write_all(const std::filesystem::path& file, int descriptor, std::uint64_t place,
               std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written =
        ::pwrite(descriptor, bytes.data(), bytes.size(), static_cast<off_t>(place));
    if (written < 0 && errno != EINTR) fail_to_write(file, "write it", errno);
    if (written <= 0) continue;
    bytes = bytes.subspan(static_cast<std::size_t>(written));
    place += static_cast<std::uint64_t>(written);
  }
}

std::size_t read_all(const std::filesystem::path& file, int descriptor, std::uint64_t place,
                     std::span<std::byte> bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count = ::pread(descriptor, bytes.data() + done, bytes.size() - done,
                                  static_cast<off_t>(place + done));
    if (count < 0 && errno != EINTR) fail_to_write(file, "read it back", errno);
    if (count == 0) break;
    if (count > 0) done += static_cast<std::size_t>(count);
  }
  return done;
}

void sync_folder(const std::filesystem::path& file, int folder) {
  // EINVAL: the file system does not support this for folders.
  if (::fsync(folder) != 0 && errno != EINVAL)
    fail_to_write(file, "write its folder to the disk (fsync)", errno);
}

}  // namespace

WriteContent content_of(std::span<const std::byte> bytes) {
  return [bytes](const WriteAt& write_at) { write_at(0, bytes); };
}

struct NewFile::Open {
  Descriptor folder;
  std::optional<Temporary> temporary;
};

NewFile::NewFile(const std::filesystem::path& file) : file_(file), open_(std::make_unique<Open>()) {
  // Other things than files are refused, because a rename would replace a device such as /dev/null.
  std::error_code unknown;
  const auto status = std::filesystem::status(file, unknown);
  if (std::filesystem::is_directory(status))
    fail_to_write(file, "write a file in place of a folder", EISDIR);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
    fail_to_write(file, "replace something other than a regular file", EINVAL);

  const std::filesystem::path parent = folder_of(file);
  open_->folder.number = ::open(parent.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (open_->folder.number < 0) fail_to_write(file, "open its folder", errno);
  open_->temporary.emplace(file, open_->folder.number);
}

NewFile::~NewFile() = default;

void NewFile::write(std::span<const std::byte> bytes) {
  write_all(file_, open_->temporary->descriptor.number, end_, bytes);
  end_ += bytes.size();
}

std::filesystem::path NewFile::temporary() const {
  return file_.parent_path() / open_->temporary->name;
}

void NewFile::commit() {
  const int folder = open_->folder.number;
  Temporary& temporary = *open_->temporary;
  if (::fsync(temporary.descriptor.number) != 0)
    fail_to_write(file_, "write it to the disk (fsync)", errno);
  // It is renamed while it is open, so that it is locked as long as it has its temporary name.
  if (::renameat(folder, temporary.name.c_str(), folder, file_.filename().c_str()) != 0) {
    if (errno == ENOENT)
      throw std::system_error(errno, std::generic_category(),
                              fmt::format("{}: another program has removed {}, which is renamed to "
                                          "it; run the same command again",
                                          file_.string(), temporary.name));
    fail_to_write(file_, "put it in place (rename)", errno);
  }
  temporary.renamed = true;
  if (::close(std::exchange(temporary.descriptor.number, -1)) != 0)
    fail_to_write(file_, "close it", errno);
  sync_folder(file_, folder);
}

void remove_abandoned(const std::filesystem::path& temporary) {
  remove_abandoned(AT_FDCWD, temporary.string());
}

void write_file(const std::filesystem::path& file,
                std::span<const std::span<const std::byte>> parts) {
  NewFile whole(file);
  for (const std::span<const std::byte> bytes : parts) whole.write(bytes);
  whole.commit();
}

void write_file(const std::filesystem::path& file, std::span<const std::byte> bytes) {
  write_file(file, std::span(&bytes, 1));
}

void write_file(const std::filesystem::path& file, std::string_view text) {
  write_file(file, std::as_bytes(std::span(text)));
}

void write_staged(const std::filesystem::path& file, std::span<const std::byte> bytes) {
  write_staged(file, content_of(bytes));
}

void write_staged(const std::filesystem::path& file, const WriteContent& write_content,
                  const ReadBack& read_back) {
  Descriptor descriptor{::open(file.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0666)};
  if (descriptor.number < 0) fail_to_write(file, "make it", errno);
  write_content(std::bind_front(write_all, std::cref(file), descriptor.number));
  if (read_back) read_back(std::bind_front(read_all, std::cref(file), descriptor.number));
  if (::close(std::exchange(descriptor.number, -1)) != 0) fail_to_write(file, "close it", errno);
}

void sync_files(const std::filesystem::path& folder) {
  const Descriptor itself{open_folder(folder)};
  if (::syncfs(itself.number) != 0) fail_to_write(folder, "write it to the disk (syncfs)", errno);
}

void move_files(const std::filesystem::path& from, const std::filesystem::path& to,
                std::span<const std::string> names) {
  const Descriptor folder{open_folder(to)};
  for (const std::string& name : names)
    if (::rename((from / name).c_str(), (to / name).c_str()) != 0)
      fail_to_write(to / name, "put it in place (rename)", errno);
  sync_folder(to, folder.number);
}

bool put_in_place(const std::filesystem::path& folder, const std::filesystem::path& place) {
  sync_files(folder);
  const Descriptor parent{open_folder(folder_of(place))};
  if (::rename(folder.c_str(), place.c_str()) != 0) {
    if (errno == EEXIST || errno == ENOTEMPTY) return false;
    fail_to_write(place, "put it in place (rename)", errno);
  }
  sync_folder(place, parent.number);
  return true;
}

std::vector<std::filesystem::path> make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::vector<std::filesystem::path> missing, made;
  for (auto at = folder; !at.empty() && !std::filesystem::exists(at, error); at = at.parent_path())
    missing.push_back(at);
  const auto give_up = [&](const char* what, int reason) {
    remove_empty(made);
    fail_to_write(folder, what, reason);
  };
  for (auto at = missing.rbegin(); at != missing.rend(); ++at)
    if (std::filesystem::create_directory(*at, error))
      made.insert(made.begin(), *at);
    else if (std::error_code none; std::filesystem::is_symlink(*at, none))
      give_up(fmt::format("make {}, which is a link to a folder that is not there", at->string())
                  .c_str(),
              ENOENT);
    else if (error)
      give_up("make this folder", error.value());
  if (!std::filesystem::is_directory(folder, error)) give_up("make this folder", ENOTDIR);
  // The umask may forbid writing.
  if (::access(folder.c_str(), W_OK) != 0) give_up("write into this folder", errno);
  return made;
}

void remove_empty(std::span<const std::filesystem::path> folders) {
  std::error_code not_empty;
  for (const std::filesystem::path& folder : folders) std::filesystem::remove(folder, not_empty);
}

}  // namespace ensonify::refine
