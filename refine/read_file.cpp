#include <ensonify/refine/read_file.h>

#include <cerrno>
#include <fstream>
#include <sstream>
#include <system_error>

namespace ensonify::refine {

std::string read_file(const std::filesystem::path& file) {
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();  // sets failbit for an empty file, too
  if (!stream.is_open() || stream.bad() || text.bad())
    throw std::system_error(errno != 0 ? errno : EIO, std::generic_category(),
                            file.string() + ": cannot be read");
  return std::move(text).str();
}

}  // namespace ensonify::refine
