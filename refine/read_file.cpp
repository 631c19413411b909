#include <ensonify/refine/read_file.h>

#include <array>
#include <cerrno>
#include <fstream>
#include <new>
#include <system_error>

#include <fmt/format.h>
#include <unistd.h>

#include <ensonify/refine/fail_to_read.h>

namespace ensonify::refine {

namespace fs = std::filesystem;

std::string read_file(const fs::path& file) {
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  if (!stream.is_open()) fail_to_read(file, errno);
  std::string content;
  std::array<char, 1 << 16> block{};
  // Not `stream.rdbuf()` into another stream, which ends at an error as it does at the file's end.
  while (stream.read(block.data(), block.size()) || stream.gcount() > 0)
    content.append(block.data(), static_cast<std::size_t>(stream.gcount()));
  if (stream.bad()) fail_to_read(file, errno);
  return content;
}

std::string fault_of_file(const fs::path& file) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (status.type() == fs::file_type::not_found) return "there is no such file; correct the path";
  if (!fs::exists(status)) return fmt::format("{}; correct the path", error.message());
  if (fs::is_directory(status)) return "is a folder; give the path of a file";
  // A named pipe would wait for ever when it is opened.
  if (!fs::is_regular_file(status)) return "is not a regular file; correct the path";
  if (::access(file.c_str(), R_OK) != 0) return "cannot be opened; check its permissions";
  return {};
}

std::string try_read_file(const fs::path& file, std::uintmax_t max_bytes, std::string& fault) {
  fault = fault_of_file(file);
  if (!fault.empty()) return {};
  std::error_code error;
  const std::uintmax_t bytes = fs::file_size(file, error);
  if (bytes > max_bytes) {
    fault =
        fmt::format("has {} bytes, expected at most {}; is it the right file?", bytes, max_bytes);
    return {};
  }
  try {
    std::string content(static_cast<std::size_t>(bytes), '\0');
    std::ifstream stream(file, std::ios::binary);
    if (stream.read(content.data(), static_cast<std::streamsize>(bytes))) return content;
    fault = "cannot be read to its end; check the disk";
  } catch (const std::bad_alloc&) {
    fault = "is too large for the memory; split it";
  }
  return {};
}

std::string begin_of_file(const fs::path& file, std::size_t bytes) {
  if (!fault_of_file(file).empty()) return {};
  std::string begin(bytes, '\0');
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  if (!stream.is_open() || (!stream.read(begin.data(), std::ssize(begin)) && stream.bad()))
    fail_to_read(file, errno);
  begin.resize(static_cast<std::size_t>(stream.gcount()));
  return begin;
}

bool begins_with(const fs::path& file, std::string_view begin) {
  return begin_of_file(file, begin.size()) == begin;
}

}  // namespace ensonify::refine
