#include <ensonify/refine/fail_to_read.h>

#include <cerrno>
#include <system_error>

#include <fmt/format.h>

namespace ensonify::refine {

void fail_to_read(const std::filesystem::path& file, int error) {
  const bool forbidden = error == EACCES || error == EPERM;
  const bool too_many = error == EMFILE || error == ENFILE;
  throw std::system_error(error != 0 ? error : EIO, std::generic_category(),
                          fmt::format("{}: cannot be read; {}", file.string(),
                                      forbidden  ? "check its permissions"
                                      : too_many ? "allow more open files (ulimit -n)"
                                                 : "check the disk, then run the command again"));
}

}  // namespace ensonify::refine
