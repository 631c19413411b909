#include <ensonify/refine/read_file.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <ensonify/refine/error.h>

namespace ensonify::refine {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t block_bytes = 1 << 20, line_block_bytes = 1 << 16;

/// Throws std::system_error for a file that cannot be opened or read to its end. The message has
/// the file's name and what to do. `error` is the value of errno; 0 if it is not known.
[[noreturn]] void fail_to_read(const fs::path& file, int error) {
  const bool forbidden = error == EACCES || error == EPERM;
  const bool too_many = error == EMFILE || error == ENFILE;
  throw std::system_error(error != 0 ? error : EIO, std::generic_category(),
                          fmt::format("{}: cannot be read; {}", file.string(),
                                      forbidden  ? "check its permissions"
                                      : too_many ? "allow more open files (ulimit -n)"
                                                 : "check the disk, then run the command again"));
}

/// What is wrong with a file that is only a pointer to a file not fetched; empty for others.
std::string fault_of_pointer(std::string_view begin) {
  constexpr std::array lfs{"version https://git-lfs.github.com/spec/",
                           "version https://hawser.github.com/spec/"};
  if (std::ranges::any_of(lfs, [&](std::string_view its) { return begin.starts_with(its); }))
    return "is a pointer of Git LFS, not the file itself; fetch it with `git lfs pull`";
  if (begin.starts_with("/annex/objects/"))
    return "is a pointer of git-annex, not the file itself; fetch it with `git annex get`";
  return {};
}

std::string fault_of(const struct stat& status) {
  if (S_ISDIR(status.st_mode)) return "is a folder; give the path of a file";
  return S_ISREG(status.st_mode) ? "" : "is not a regular file; correct the path";
}

}  // namespace

FileReader::FileReader(const fs::path& file, std::uintmax_t max_bytes,
                       std::function<void()> stop_check)
    : file_(file), max_bytes_(max_bytes), stop_check_(std::move(stop_check)) {
  open();
  if (fault_.empty()) return;
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
}

FileReader::~FileReader() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void FileReader::open() {
  struct stat status {};
  // The kind of file is checked before it is opened, because opening starts some devices, and again
  // when it is open, because the name may then belong to another file.
  if (::stat(file_.c_str(), &status) != 0) {
    error_ = errno;
    fault_ = error_ == ENOENT || error_ == ENOTDIR
                 ? "there is no such file; correct the path"
                 : fmt::format("{}; correct the path", std::generic_category().message(error_));
    return;
  }
  if (fault_ = fault_of(status); !fault_.empty()) return;
  descriptor_ = ::open(file_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (descriptor_ < 0 || ::fstat(descriptor_, &status) != 0) {
    error_ = errno;
    fault_ = error_ == EACCES || error_ == EPERM
                 ? "cannot be opened; check its permissions"
                 : fmt::format("cannot be opened ({}); try again",
                               std::generic_category().message(error_));
    return;
  }
  if (fault_ = fault_of(status); !fault_.empty()) return;
  bytes_ = static_cast<std::uintmax_t>(status.st_size);
  if (bytes_ > max_bytes_) {
    fault_ =
        fmt::format("has {} bytes, expected at most {}; is it the right file?", bytes_, max_bytes_);
    return;
  }
  constexpr std::uintmax_t largest_pointer = 32768;  // of git-annex
  std::array<char, 64> begin{};
  if (bytes_ > largest_pointer) return;
  if (const ssize_t found = ::pread(descriptor_, begin.data(), begin.size(), 0); found > 0)
    fault_ = fault_of_pointer({begin.data(), static_cast<std::size_t>(found)});
}

std::size_t FileReader::read(std::span<std::byte> bytes) {
  std::size_t done = std::min(bytes.size(), block_.size() - place_in_block_);
  std::memcpy(bytes.data(), block_.data() + place_in_block_, done);
  place_in_block_ += done;
  while (done < bytes.size()) {
    if (stop_check_) stop_check_();
    const ssize_t count =
        ::read(descriptor_, bytes.data() + done, std::min(bytes.size() - done, block_bytes));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail_to_read(file_, errno);
    if (count == 0) break;
    done += static_cast<std::size_t>(count);
  }
  return done;
}

bool FileReader::next_line(std::string& line, char line_end) {
  line.clear();
  for (;;) {
    if (place_in_block_ == block_.size()) {
      block_.clear();
      place_in_block_ = 0;
      std::string block(line_block_bytes, '\0');
      block.resize(read(std::as_writable_bytes(std::span(block))));
      if (block.empty()) return !line.empty();
      block_ = std::move(block);
    }
    const std::size_t end = std::min(block_.find(line_end, place_in_block_), block_.size());
    line.append(block_, place_in_block_, end - place_in_block_);
    const bool is_whole = end < block_.size();
    place_in_block_ = is_whole ? end + 1 : end;
    if (is_whole) return true;
  }
}

std::string FileReader::rest() {
  std::string content;
  // One byte more is read, to meet the file's end. A file of the system has a size of 0.
  for (std::size_t next = static_cast<std::size_t>(bytes_) + 1;; next = block_bytes) {
    const std::size_t begin = content.size();
    content.resize(begin + next);
    const std::size_t count = read(std::as_writable_bytes(std::span(content).subspan(begin)));
    content.resize(begin + count);
    if (content.size() > max_bytes_)
      throw Error(fmt::format("{}: has more than {} bytes; is it the right file?", file_.string(),
                              max_bytes_));
    if (count < next) return content;
  }
}

void FileReader::seek(std::uint64_t place) {
  block_.clear();
  place_in_block_ = 0;
  if (::lseek(descriptor_, static_cast<off_t>(place), SEEK_SET) < 0) fail_to_read(file_, errno);
}

void FileReader::require_open() const {
  if (error_ != 0) fail_to_read(file_, error_);
  if (!fault_.empty()) throw Error(file_.string() + ": " + fault_);
}

std::string read_file(const fs::path& file, std::uintmax_t max_bytes) {
  FileReader reader(file, max_bytes);
  reader.require_open();
  return reader.rest();
}

std::string fault_of_file(const fs::path& file) { return FileReader(file).fault(); }

std::string begin_of_file(const fs::path& file, std::size_t bytes) {
  FileReader reader(file);
  constexpr std::array by_user{0, ENOENT, ENOTDIR, EACCES, EPERM, ELOOP, ENAMETOOLONG};
  if (std::ranges::find(by_user, reader.error()) == by_user.end())
    fail_to_read(file, reader.error());
  if (!reader.fault().empty()) return {};
  std::string begin(bytes, '\0');
  begin.resize(reader.read(std::as_writable_bytes(std::span(begin))));
  return begin;
}

bool begins_with(const fs::path& file, std::string_view begin) {
  return begin_of_file(file, begin.size()) == begin;
}

bool is_utf16(std::string_view bytes) {
  return bytes.size() >= 4 && ((bytes.starts_with("\xff\xfe") && bytes[2] != 0 && bytes[3] == 0) ||
                               (bytes.starts_with("\xfe\xff") && bytes[2] == 0 && bytes[3] != 0));
}

}  // namespace ensonify::refine
