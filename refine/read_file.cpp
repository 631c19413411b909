#include <ensonify/refine/read_file.h>

#include <cerrno>
#include <fstream>
#include <new>
#include <sstream>
#include <system_error>

#include <fmt/format.h>
#include <unistd.h>

namespace ensonify::refine {

namespace fs = std::filesystem;

std::string read_file(const fs::path& file) {
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();  // sets failbit for an empty file, too
  if (!stream.is_open() || stream.bad() || text.bad())
    throw std::system_error(errno != 0 ? errno : EIO, std::generic_category(),
                            file.string() + ": cannot be read");
  return std::move(text).str();
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
  std::ifstream stream(file, std::ios::binary);
  stream.read(begin.data(), static_cast<std::streamsize>(bytes));
  begin.resize(static_cast<std::size_t>(stream.gcount()));
  return begin;
}

bool begins_with(const fs::path& file, std::string_view begin) {
  return begin_of_file(file, begin.size()) == begin;
}

}  // namespace ensonify::refine
